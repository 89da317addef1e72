"""The figures of a gait by velocity, drawn from its plan.

Figure numbers are those of [Wang2024].
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.files import StrPath
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.viewing.figures.files import write_figures
from gaitopt.viewing.figures.joint_curves import plot_joint_curves
from gaitopt.viewing.figures.schedule import plot_gait_diagram
from gaitopt.viewing.figures.snapshots import plot_snapshots
from gaitopt.viewing.figures.swing_curves import plot_cycloids, plot_swing_curves
from gaitopt.viewing.figures.zmp import plot_zmp

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from gaitopt.viewing.figures.panels import Panels

__all__ = [
    "plot_cycloids",
    "plot_gait_diagram",
    "plot_joint_curves",
    "plot_snapshots",
    "plot_swing_curves",
    "plot_zmp",
    "save_gait_figures",
]

CYCLES = 2.0
"""Cycles in the figure of angles, velocities and accelerations. Chosen here: two show that the
motion is periodic."""


def save_gait_figures(plan: Plan, folder: StrPath) -> list[Path]:
    """Write the figures of a gait as PNG files.

    A plan without a schedule, such as a crawl over footholds, has no gait diagram. A plan without
    swings has no swing curves; these are drawn for the longest step.

    Args:
        plan: any plan.
        folder: where to write; it is made if it does not exist. Files of the same names are
            replaced.

    Returns:
        The files, in the order of the paper's figures.

    Raises:
        InputError: the folder cannot be made or written to.
    """
    check_kind("plan", plan, Plan)
    return write_figures(_figures(plan), folder)


def _figures(plan: Plan) -> dict[str, Callable[[], Axes | Panels]]:
    """Functions that draw the figures, by the names of their files."""
    settings = plan.settings
    schedule = settings.schedule if isinstance(settings, GaitSettings) else None
    figures: dict[str, Callable[[], Axes | Panels]] = {}
    if isinstance(schedule, GaitSchedule):
        figures["fig02_03_05_gait_diagram"] = lambda: plot_gait_diagram(schedule)
    figures["fig11_cycloids"] = plot_cycloids
    if plan.swings:
        figures["swing_curves"] = lambda: _swing_curves(plan)
    return {
        **figures,
        "fig12_snapshots": lambda: plot_snapshots(plan),
        "fig13_joint_angles": lambda: plot_joint_curves(plan, derivatives=(0,)),
        "fig14_joint_curves": lambda: plot_joint_curves(plan, span=_middle(plan, schedule)),
        "zmp": lambda: plot_zmp(plan),
    }


def _swing_curves(plan: Plan) -> Panels:
    """All swing curves for the plan's longest step."""
    steps = [swing.foot_end - swing.foot_start for swing in plan.swings]
    lengths = [float(np.hypot(*step[:2])) for step in steps]
    longest = int(np.argmax(lengths))
    return plot_swing_curves(
        lengths[longest], plan.settings.swing_height, plan.swings[longest].duration,
        float(steps[longest][2]),
    )  # fmt: skip


def _middle(plan: Plan, schedule: object) -> tuple[float, float] | None:
    """Start and end of :data:`CYCLES` cycles in the middle of a gait [s].

    ``None`` stands for the whole plan, where it is not longer or has no schedule.
    """
    if not isinstance(schedule, GaitSchedule):
        return None
    half = CYCLES * schedule.cycle_time / 2.0
    if 2.0 * half >= plan.duration:
        return None
    return plan.duration / 2.0 - half, plan.duration / 2.0 + half
