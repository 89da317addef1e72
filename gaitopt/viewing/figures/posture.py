"""Fig. 7 of [Shao2011]: the path of the COG in a cycle, with its turning points.

Nine points are numbered: 0 is where the cycle starts, and then each of the four legs has two, its
lift-off and its touch-down. The paper draws one cycle of normal walking, and one in which the front
legs stride over the obstacle.

A robot whose legs only pitch moves its COG straight ahead and back, and not sideways at all; the
paper's own does, because its body leans (``docs/papers.md``, errata). For such a robot the upper
panels show the side view instead: there the COG rises and sinks with the legs that fly.

Source: [Shao2011], Fig. 5 and Fig. 7.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, rotation_z
from gaitopt.errors import InputError
from gaitopt.inputs import check_count
from gaitopt.plan.phase import Swing
from gaitopt.plan.plan import Plan
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import INK, MUTED, SMALL, dress, leg_keys, line_key, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COM_COLOUR, CENTRE_COLOUR = "#1b4f8f", "#b35806"
SAMPLES = 240
"""Samples of a cycle."""
SIDEWAYS = 1e-3
"""Sideways motion below which the side view is drawn [m]."""
FRONT = ("LF", "RF")


class CogCycle(NamedTuple):
    """The COG's way in one cycle, in a frame along the walk whose origin is where it starts.

    Attributes:
        times: since the cycle's start ``(N,)`` [s].
        com: the true centre of mass, ahead, to the left and up ``(N, 3)`` [m].
        centre: the body centre ``(N, 3)`` [m].
        points: times of the nine points ``(9,)`` [s].
        at: the true centre of mass there ``(9, 3)`` [m].
        swings: the four swings.
    """

    times: FloatArray
    com: FloatArray
    centre: FloatArray
    points: FloatArray
    at: FloatArray
    swings: tuple[Swing, ...]


def cog_cycle(plan: Plan, cycle: int) -> CogCycle:
    """The COG's way in a cycle of four swings, counted from 0.

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
    # Heights count from the start each on its own: the centre of mass lies below the hips.
    zero = np.array([centre[0], centre[0]])
    zero[0, 2] = com[0, 2]
    turned = [
        (part - at) @ rotation_z(heading) for part, at in zip((com, centre), zero, strict=True)
    ]
    return CogCycle(
        times - start, turned[0][:SAMPLES], turned[1][:SAMPLES], marks - start,
        turned[0][SAMPLES:], swings,
    )  # fmt: skip


def striding_cycle(plan: Plan) -> int:
    """The cycle in which the first front leg strides over the first obstacle.

    Raises:
        InputError: the plan knows of no obstacle, or no front leg goes over it.
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


def plot_posture(plan: Plan) -> Figure:
    """Fig. 7: the way of the COG in a normal cycle, and in that of the front legs' striding.

    The upper panels show it from above, or from the side for a robot that does not sway; the lower
    ones the way ahead over time. The normal cycle is the one before the striding one, or the last
    where there is none before.

    Raises:
        InputError: the plan strides over no obstacle.
    """
    over = striding_cycle(plan)
    normal = over - 1 if over else len(plan.swings) // len(LEGS) - 1
    figure = new_figure(9.0, 6.4)
    axes = figure.subplots(2, 2)
    ways = [cog_cycle(plan, cycle) for cycle in (normal, over)]
    upright = all(np.ptp(way.com[:, 1]) < SIDEWAYS for way in ways)
    titles = "(a) a normal cycle", "(b) the front legs stride over the obstacle"
    for column, (way, title) in enumerate(zip(ways, titles, strict=True)):
        draw_plane(axes[0, column], way, title, upright=upright)
        draw_times(axes[1, column], way)
    for row in axes:
        _same_limits(list(row))
    keys = [line_key("true centre of mass", COM_COLOUR),
            line_key("body centre", CENTRE_COLOUR, "--"), *leg_keys("s")]  # fmt: skip
    figure.legend(
        handles=keys, loc="outside lower center", ncols=len(keys), fontsize=SMALL, frameon=False
    )
    return figure


def draw_plane(ax: Axes, way: CogCycle, title: str, *, upright: bool = False) -> None:
    """The way of the COG from above, or from the side, with its nine points; not to one scale."""
    mm, pair = 1e3, [0, 2 if upright else 1]
    ax.plot(
        *(mm * way.centre[:, pair].T), "--", color=CENTRE_COLOUR, linewidth=1.2, gid="body centre"
    )
    ax.plot(*(mm * way.com[:, pair].T), color=COM_COLOUR, linewidth=1.4, gid="com")
    ax.plot(*(mm * way.at[:, pair].T), "o", color=INK, markersize=3.5, gid="points")
    for k, (x, y) in enumerate(mm * way.at[:, pair]):
        ax.annotate(
            str(k), (x, y), xytext=(4, 4 if k % 2 else -11), textcoords="offset points",
            fontsize=SMALL, color=INK,
        )  # fmt: skip
    dress(ax, title, "ahead [mm]", "up [mm]" if upright else "to the left [mm]")


def draw_times(ax: Axes, way: CogCycle) -> None:
    """The way ahead over time; coloured where a leg flies."""
    mm = 1e3
    begun = way.swings[0].start - way.points[1]
    for swing in way.swings:
        ax.axvspan(swing.start - begun, swing.end - begun, color=LEG_COLOURS[swing.leg], alpha=0.15,
                   linewidth=0, gid=f"swing {swing.leg}")  # fmt: skip
    ax.plot(way.times, mm * way.centre[:, 0], "--", color=CENTRE_COLOUR, linewidth=1.2)
    ax.plot(way.times, mm * way.com[:, 0], color=COM_COLOUR, linewidth=1.4)
    ax.plot(way.points, mm * way.at[:, 0], "o", color=INK, markersize=3.5)
    for k, (t, x) in enumerate(zip(way.points, mm * way.at[:, 0], strict=True)):
        ax.annotate(str(k), (t, x), xytext=(3, 4), textcoords="offset points", fontsize=SMALL,
                    color=MUTED)  # fmt: skip
    dress(ax, "", "time since the cycle's start [s]", "ahead [mm]")


def _places(plan: Plan, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """True centre of mass and body centre ``(N, 3)`` [m]."""
    import pinocchio as pin

    motion, model = plan.at(times), plan.robot.model
    data = model.createData()
    com = np.array([pin.centerOfMass(model, data, q).copy() for q in motion.q])
    return com, motion.cog


def _same_limits(axes: list[Axes]) -> None:
    """The same scale of the vertical axis, so that panels can be compared."""
    low = min(ax.get_ylim()[0] for ax in axes)
    high = max(ax.get_ylim()[1] for ax in axes)
    for ax in axes:
        ax.set_ylim(low, high)
