"""The figures of [Wang2020], drawn from a plan.

Every function returns the axes that it drew: one of Matplotlib's axes, or an array of them where a
figure has several panels. Figure numbers are those of [Wang2020].
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.files import StrPath
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.viewing.figures.feasible_area import plot_feasible_area
from gaitopt.viewing.figures.files import write_figures
from gaitopt.viewing.figures.gait_cycle import plot_gait_cycle, plot_swing
from gaitopt.viewing.figures.margin import plot_margin
from gaitopt.viewing.figures.over_time import plot_cog_over_time, plot_joint_velocities
from gaitopt.viewing.figures.paths import plot_paths, plot_terrain
from gaitopt.viewing.figures.terrain_map import plot_terrain_map
from gaitopt.viewing.figures.terrain_profile import plot_terrain_profile
from gaitopt.viewing.ground_search import GroundSearch

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from gaitopt.viewing.figures.panels import Panels

COMPARED = "fig12_14_15_cog"
"""Name of the figure that shows other plans, too."""

__all__ = [
    "plot_cog_over_time",
    "plot_feasible_area",
    "plot_gait_cycle",
    "plot_joint_velocities",
    "plot_margin",
    "plot_paths",
    "plot_swing",
    "plot_terrain",
    "plot_terrain_map",
    "plot_terrain_profile",
    "save_figures",
]


def save_figures(
    plan: Plan,
    folder: StrPath,
    *,
    comparison: Mapping[str, Plan] | None = None,
    com_margin: tuple[ArrayLike, ArrayLike] | None = None,
    step: int | None = None,
    search: GroundSearch | None = None,
) -> list[Path]:
    """Write all figures of a plan as PNG files.

    A plan without steps has no figures of a feasible area and a swing. A plan over a height map has
    two more: the map from above, and the feet over the ground from the side. The figures of a gait
    by velocity are others (:func:`gaitopt.save_gait_figures`).

    Args:
        plan: any plan.
        folder: where to write; it is made if it does not exist. Files of the same names are
            replaced.
        comparison: other plans in the figure of the COG over time, by name.
        com_margin: see :func:`plot_margin`.
        step: step whose feasible area and swing are drawn; by default the one before which the COG
            moves farthest.
        search: for the footholds of a plan over a height map; what it tried is drawn on the map.

    Returns:
        The files, in the order of the paper's figures.

    Raises:
        InputError: the folder cannot be made or written to, or there is no such step.
    """
    check_kind("plan", plan, Plan)
    if isinstance(plan.settings, GaitSettings):
        from gaitopt.viewing.figures.gait_figures import save_gait_figures

        return save_gait_figures(plan, folder)
    return write_figures(_figures(plan, comparison or {}, com_margin, step, search), folder)


def save_figures_alone(
    plan: Plan, folder: StrPath, com_margin: tuple[ArrayLike, ArrayLike] | None
) -> list[Path]:
    """:func:`save_figures` without the one that shows other plans: those need not be known yet."""
    figures = _figures(plan, {}, com_margin)
    del figures[COMPARED]
    return write_figures(figures, folder)


def save_compared(plan: Plan, folder: StrPath, comparison: Mapping[str, Plan]) -> list[Path]:
    """The figure of :func:`save_figures` that shows other plans, too."""
    return write_figures({COMPARED: _figures(plan, comparison, None)[COMPARED]}, folder)


def _figures(
    plan: Plan,
    comparison: Mapping[str, Plan],
    com_margin: tuple[ArrayLike, ArrayLike] | None,
    step: int | None = None,
    search: GroundSearch | None = None,
) -> dict[str, Callable[[], Axes | Panels]]:
    """Functions that draw the figures, by the names of their files."""
    included = any(other is plan for other in comparison.values())
    plans = comparison if included else {"this plan": plan, **comparison}
    figures: dict[str, Callable[[], Axes | Panels]] = {
        "fig03_terrain": lambda: plot_terrain(plan.footholds),
        "fig04_gait_cycle": lambda: plot_gait_cycle(plan),
    }
    if plan.footholds.ground is not None:
        figures["terrain_map"] = lambda: plot_terrain_map(plan, search=search)
        figures["terrain_profile"] = lambda: plot_terrain_profile(plan)
    if any(p.kind == "swing" for p in plan.phases):
        shown = step_of_longest_move(plan) if step is None else step
        figures["fig05_swing"] = lambda: plot_swing(plan, shown)
        figures["fig06_07_feasible_area"] = lambda: plot_feasible_area(plan, shown)
    return {
        **figures,
        "fig11_paths": lambda: plot_paths(plan),
        COMPARED: lambda: plot_cog_over_time(plans),
        "fig13_joint_velocities": lambda: plot_joint_velocities(plan),
        "stability_margin": lambda: plot_margin(plan, com_margin),
    }


def step_of_longest_move(plan: Plan) -> int:
    """The step with the longest move of the COG, among those that have a swing phase."""
    swings = {p.step for p in plan.phases if p.kind == "swing"}
    chosen = [p for p in plan.phases if p.step in swings]
    moved = [float(np.linalg.norm(p.cog_end - p.cog_start)) for p in chosen]
    return chosen[int(np.argmax(moved))].step
