"""The figures of [Wang2020], drawn from a plan.

Every function returns a :class:`matplotlib.figure.Figure` that pyplot knows nothing of: no window
opens, and there is nothing to close. Figure numbers are those of [Wang2020].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.files import StrPath
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.viewing.figures.feasible_area import plot_feasible_area
from gaitopt.viewing.figures.files import write_figures
from gaitopt.viewing.figures.gait_cycle import plot_gait_cycle, plot_swing
from gaitopt.viewing.figures.margin import plot_margin
from gaitopt.viewing.figures.over_time import plot_cog_over_time, plot_joint_velocities
from gaitopt.viewing.figures.paths import plot_paths, plot_terrain

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = [
    "plot_cog_over_time",
    "plot_feasible_area",
    "plot_gait_cycle",
    "plot_joint_velocities",
    "plot_margin",
    "plot_paths",
    "plot_swing",
    "plot_terrain",
    "save_figures",
]


def save_figures(
    plan: Plan,
    folder: StrPath,
    *,
    comparison: Mapping[str, Plan] | None = None,
    com_margin: tuple[ArrayLike, ArrayLike] | None = None,
    step: int | None = None,
) -> list[Path]:
    """Write all figures of a plan as PNG files, each whole or not at all.

    A plan without steps has no feasible area and no swing to draw; a gait by velocity has figures
    of its own (:func:`gaitopt.save_gait_figures`).

    Args:
        plan: any plan.
        folder: where to write; made when it is missing. Files of the same names are replaced.
        comparison: plans to draw beside this one in the figure of the COG over time.
        com_margin: see :func:`plot_margin`.
        step: whose feasible area and swing to draw; by default the step before which the COG moves
            farthest.

    Returns:
        The files, in the order of the paper's figures.

    Raises:
        InputError: the folder cannot be made or written to, or there is no such step.
    """
    if isinstance(plan.settings, GaitSettings):
        from gaitopt.viewing.figures.gait_figures import save_gait_figures

        return save_gait_figures(plan, folder)
    return write_figures(_figures(plan, comparison or {}, com_margin, step), folder)


def _figures(
    plan: Plan,
    comparison: Mapping[str, Plan],
    com_margin: tuple[ArrayLike, ArrayLike] | None,
    step: int | None = None,
) -> dict[str, Callable[[], Figure]]:
    """What to draw under which name."""
    among = any(other is plan for other in comparison.values())
    plans = comparison if among else {"this plan": plan, **comparison}
    figures: dict[str, Callable[[], Figure]] = {
        "fig03_terrain": lambda: plot_terrain(plan.footholds),
        "fig04_gait_cycle": lambda: plot_gait_cycle(plan),
        "fig05_swing": lambda: plot_swing(plan, telling_step(plan) if step is None else step),
        "fig06_07_feasible_area": lambda: plot_feasible_area(
            plan, telling_step(plan) if step is None else step
        ),
        "fig11_paths": lambda: plot_paths(plan),
        "fig12_14_15_cog": lambda: plot_cog_over_time(plans),
        "fig13_joint_velocities": lambda: plot_joint_velocities(plan),
        "stability_margin": lambda: plot_margin(plan, com_margin),
    }
    if not any(p.kind == "swing" for p in plan.phases):
        del figures["fig05_swing"], figures["fig06_07_feasible_area"]
    return figures


def telling_step(plan: Plan) -> int:
    """The step, among those in which a foot flies, before which the COG moves farthest."""
    swings = {p.step for p in plan.phases if p.kind == "swing"}
    chosen = [p for p in plan.phases if p.step in swings]
    moved = [float(np.linalg.norm(p.cog_end - p.cog_start)) for p in chosen]
    return chosen[int(np.argmax(moved))].step
