"""Fig. 7 of [Shao2011]: the path of the COG during a cycle, with nine numbered points.

Point 0 is the start of the cycle. Then follow lift-off and touchdown of each of the four legs. The
paper draws one cycle of normal walking, and one in which the front legs step over the obstacle.

A robot without roll joints moves its COG only forward and back; that of the paper also moves
sideways, because its body leans (``docs/papers.md``, errata). For such a robot the upper panels
show the view from the side, in which the COG rises and falls with the swinging legs.

Source: [Shao2011], Fig. 5 and Fig. 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, rotation_z
from gaitopt.errors import InputError
from gaitopt.inputs import check_count, check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.swings import Swing
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    INK,
    MUTED,
    SMALL,
    leg_keys,
    line_key,
    style_axes,
)
from gaitopt.viewing.figures.panels import Panels, legend_below, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COM_COLOUR, CENTRE_COLOUR = "#1b4f8f", "#b35806"
SAMPLES = 240
"""Samples of a cycle. Chosen here: about one for each two pixels of a panel."""
SIDEWAYS = 1e-3
"""Sideways motion of the COG below which the view is from the side [m]. Chosen here: a millimetre
is far below the sway of a robot that has roll joints."""
FRONT = ("LF", "RF")
MM = 1e3
"""Millimetres in a metre."""


class CogCycle(NamedTuple):
    """The COG's path during one cycle, relative to its start, with x along the heading.

    Attributes:
        times: since the start of the cycle ``(N,)`` [s].
        com: true centre of mass: forward, to the left, up ``(N, 3)`` [m].
        centre: body centre ``(N, 3)`` [m].
        point_times: times of the nine points ``(9,)`` [s].
        point_coms: true centre of mass at these times ``(9, 3)`` [m].
        swings: the four swings.
    """

    times: FloatArray
    com: FloatArray
    centre: FloatArray
    point_times: FloatArray
    point_coms: FloatArray
    swings: tuple[Swing, ...]


def cog_cycle(plan: Plan, cycle: int) -> CogCycle:
    """The COG's path during a cycle of four swings; ``cycle`` counts from 0.

    Raises:
        InputError: the plan has no such cycle.
    """
    count = len(plan.swings) // len(LEGS)
    check_count("cycle", cycle, 0, count - 1)
    swings = plan.swings[4 * cycle : 4 * cycle + 4]
    start = plan.swings[4 * cycle - 1].end if cycle else 0.0
    marks = np.array([start, *(t for s in swings for t in (s.start, s.end))])
    times = np.linspace(start, swings[-1].end, SAMPLES)
    heading = plan.settings.heading
    com, centre = _places(plan, np.concatenate([times, marks]))
    # Each height is relative to its own start, as the centre of mass is below the hips.
    origins = np.array([centre[0], centre[0]])
    origins[0, 2] = com[0, 2]
    turned = [
        (places - origin) @ rotation_z(heading)
        for places, origin in zip((com, centre), origins, strict=True)
    ]
    return CogCycle(
        times - start, turned[0][:SAMPLES], turned[1][:SAMPLES], marks - start,
        turned[0][SAMPLES:], swings,
    )  # fmt: skip


def striding_cycle(plan: Plan) -> int:
    """Index of the cycle in which the first front leg steps over the first obstacle.

    Raises:
        InputError: the plan has no obstacle, or no front leg steps over it.
    """
    obstacles = plan.settings.obstacles
    if not obstacles:
        raise InputError("the plan has no obstacle; plan_stride makes plans that have one")
    for swing in plan.swings:
        ends = np.array([swing.foot_start, swing.foot_end])
        before, after = obstacles[0].to_local(ends)[:, 0]
        if swing.leg in FRONT and before * after < 0.0:
            return swing.step // len(LEGS)
    raise InputError("no front leg strides over the obstacle in this plan")


def front_strides(plan: Plan) -> tuple[Swing, Swing]:
    """The swings in which the front legs step over the first obstacle, the earlier one first.

    Raises:
        InputError: the plan has no obstacle, or a front leg does not step over it.
    """
    if not plan.settings.obstacles:
        raise InputError("the plan has no obstacle; plan_stride makes plans that have one")
    found: dict[str, Swing] = {}
    for swing in plan.swings:
        ends = plan.settings.obstacles[0].to_local(np.array([swing.foot_start, swing.foot_end]))
        if swing.leg in FRONT and ends[0, 0] * ends[1, 0] < 0.0:
            found.setdefault(swing.leg, swing)
    if len(found) < len(FRONT):
        raise InputError(
            f"{' and '.join(leg for leg in FRONT if leg not in found)} does not step over the "
            "obstacle in this plan"
        )
    first, second = sorted(found.values(), key=lambda swing: swing.start)
    return first, second


def plot_posture(plan: Plan, axes: Sequence[Axes] | Panels | None = None) -> Panels:
    """Plot the path of the COG in a normal cycle, and in that of the front legs' strides: Fig. 7.

    The upper panels show it from above, or from the side for a robot that does not sway. The lower
    panels show the distance forward over time. The normal cycle is the one before the strides, or
    the last one where there is none before.

    Args:
        plan: of :func:`gaitopt.plan_stride`.
        axes: where to draw ``(2, 2)``; by default a new figure.

    Returns:
        The axes ``(2, 2)``: path and distance, of the normal cycle and of the strides.

    Raises:
        InputError: the plan has no obstacle, no front leg steps over it, or the axes have another
            shape.
    """
    check_kind("plan", plan, Plan)
    over = striding_cycle(plan)
    normal = over - 1 if over else len(plan.swings) // len(LEGS) - 1
    drawn = panels(axes, (2, 2), 9.0, 6.4)
    cycles = [cog_cycle(plan, cycle) for cycle in (normal, over)]
    from_side = all(np.ptp(cycle.com[:, 1]) < SIDEWAYS for cycle in cycles)
    titles = "(a) a normal cycle", "(b) the front legs stride over the obstacle"
    for column, (cycle, title) in enumerate(zip(cycles, titles, strict=True)):
        draw_path(drawn[0, column], cycle, title, from_side=from_side)
        draw_over_time(drawn[1, column], cycle)
    for row in drawn:
        _same_limits(list(row))
    keys = [line_key("true centre of mass", COM_COLOUR),
            line_key("body centre", CENTRE_COLOUR, "--"), *leg_keys("s")]  # fmt: skip
    legend_below(drawn, keys, own=axes is None, ncols=len(keys))
    return drawn


def draw_path(ax: Axes, cycle: CogCycle, title: str, *, from_side: bool = False) -> None:
    """Draw the COG's path from above or from the side, with its nine points.

    The axes have different scales.
    """
    pair = [0, 2 if from_side else 1]
    ax.plot(
        *(MM * cycle.centre[:, pair].T), "--", color=CENTRE_COLOUR, linewidth=1.2, gid="body centre"
    )
    ax.plot(*(MM * cycle.com[:, pair].T), color=COM_COLOUR, linewidth=1.4, gid="com")
    ax.plot(*(MM * cycle.point_coms[:, pair].T), "o", color=INK, markersize=3.5, gid="points")
    for k, (x, y) in enumerate(MM * cycle.point_coms[:, pair]):
        ax.annotate(
            str(k), (x, y), xytext=(4, 4 if k % 2 else -11), textcoords="offset points",
            fontsize=SMALL, color=INK,
        )  # fmt: skip
    style_axes(ax, title, "ahead [mm]", "up [mm]" if from_side else "to the left [mm]")


def draw_over_time(ax: Axes, cycle: CogCycle) -> None:
    """Draw the COG's distance forward over time; swings are shaded."""
    start = cycle.swings[0].start - cycle.point_times[1]
    for swing in cycle.swings:
        ax.axvspan(swing.start - start, swing.end - start, color=LEG_COLOURS[swing.leg], alpha=0.15,
                   linewidth=0, gid=f"swing {swing.leg}")  # fmt: skip
    ax.plot(cycle.times, MM * cycle.centre[:, 0], "--", color=CENTRE_COLOUR, linewidth=1.2)
    ax.plot(cycle.times, MM * cycle.com[:, 0], color=COM_COLOUR, linewidth=1.4)
    ax.plot(cycle.point_times, MM * cycle.point_coms[:, 0], "o", color=INK, markersize=3.5)
    for k, (t, x) in enumerate(zip(cycle.point_times, MM * cycle.point_coms[:, 0], strict=True)):
        ax.annotate(str(k), (t, x), xytext=(3, 4), textcoords="offset points", fontsize=SMALL,
                    color=MUTED)  # fmt: skip
    style_axes(ax, "", "time since the cycle's start [s]", "ahead [mm]")


def _places(plan: Plan, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """True centre of mass and body centre at ``times (N,)`` [s], both ``(N, 3)`` [m]."""
    import pinocchio as pin

    motion, model = plan.at(times), plan.robot.model
    data = model.createData()
    com = np.array([pin.centerOfMass(model, data, q).copy() for q in motion.q])
    return com, motion.cog


def _same_limits(axes: list[Axes]) -> None:
    """Set the same vertical limits for some axes, so that they can be compared."""
    low = min(ax.get_ylim()[0] for ax in axes)
    high = max(ax.get_ylim()[1] for ax in axes)
    for ax in axes:
        ax.set_ylim(low, high)
