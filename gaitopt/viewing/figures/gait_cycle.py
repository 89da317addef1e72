"""Figs. 4 and 5 of [Wang2020]: the gait cycle and the swing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gaitopt.conventions import FloatArray, leg_index
from gaitopt.errors import InputError
from gaitopt.inputs import check_kind
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.swing.box import box_corners
from gaitopt.terrain.height_map import HeightMap
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    BESIDE,
    INK,
    MUTED,
    SMALL,
    add_legend,
    cycle_phases,
    cycle_title,
    forward_axis,
    line_key,
    span_of,
    step_phases,
    style_axes,
    text_colour_on,
)
from gaitopt.viewing.figures.panels import panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes


LEAST_BAR = 0.07
"""Share of the time axis from which a bar is wide enough for the name of a phase."""
DOTS = 25.0
"""Dots along a swing, about: more would touch each other."""


def plot_gait_cycle(plan: Plan, cycle: int | None = None, ax: Axes | None = None) -> Axes:
    """Plot the gait diagram of one cycle: which leg swings when, and when the body moves.

    Source: Fig. 4 of [Wang2020]. A stance phase that takes no time is a thin line.

    Args:
        plan: any plan.
        cycle: index of the gait cycle, from 0; the middle one by default.
        ax: where to draw; by default a new figure.

    Returns:
        The axes.

    Raises:
        InputError: there is no such cycle.
    """
    check_kind("plan", plan, Plan)
    from matplotlib.patches import Patch

    number, phases = cycle_phases(plan, cycle)
    ax = panel(ax, 8.5, 2.9)
    rows = {leg: 3 - i for i, leg in enumerate(LEG_COLOURS)}
    span = span_of(phases)
    for row in rows.values():
        ax.plot(span, (row, row), color=MUTED, linewidth=1.0, zorder=1)
    for phase in phases:
        bar = [(phase.start, phase.duration)]
        for leg in phase.flying:
            ax.broken_barh(bar, (rows[leg] - 0.32, 0.64), facecolor=LEG_COLOURS[leg], gid=leg,
                           zorder=2)  # fmt: skip
            _label_phase(ax, f"{leg}_SW", phase, rows[leg], span)
        if phase.kind == "stance":
            ax.broken_barh(bar, (3.68, 0.64), facecolor="#6f6f6f", edgecolor="#6f6f6f",
                           linewidth=0.8, gid="COG", zorder=2)  # fmt: skip
            _label_phase(ax, f"COG_{phase.leg}", phase, 4.0, span, above=True)
    duration = f", {span[1] - span[0]:.2f} s" if phases else ""
    style_axes(ax, cycle_title(number, phases) + duration, "time [s]", "", grid=False)
    ax.set_yticks([*rows.values(), 4], [*rows, "COG"])
    ax.spines["left"].set_visible(False)
    ax.set(xlim=span, ylim=(-0.6, 5.1))
    keys = [Patch(facecolor=c, label=f"{leg} swings") for leg, c in LEG_COLOURS.items()]
    keys += [Patch(facecolor="#6f6f6f", label="body moves,\nfour feet stand")]
    keys += [line_key("foot stands", MUTED, width=1.0)]
    add_legend(ax, keys, **BESIDE)
    return ax


def _label_phase(ax: Axes, text: str, phase: Phase, row: float, span: tuple[float, float],
                 above: bool = False) -> None:  # fmt: skip
    """Write a phase's name above its bar, or into the bar if that is wide enough."""
    wide = phase.duration > LEAST_BAR * (span[1] - span[0])
    if above or wide:
        ax.annotate(text, (phase.start + phase.duration / 2.0, row + (0.45 if above else 0.0)),
                    ha="center", va="bottom" if above else "center", fontsize=SMALL - 0.5, zorder=3,
                    color=INK if above else text_colour_on(LEG_COLOURS[phase.leg]))  # fmt: skip


def plot_swing(plan: Plan, step: int, ax: Axes | None = None) -> Axes:
    """Plot the path of a swing foot in the vertical plane of its step, with dots at equal times.

    Source: Fig. 5 of [Wang2020]. For a step of no length the plane is that of the heading.

    Args:
        plan: any plan.
        step: index of the step, from 0.
        ax: where to draw; by default a new figure.

    Returns:
        The axes.

    Raises:
        InputError: there is no such step, or no foot flies in it.
    """
    check_kind("plan", plan, Plan)
    _, phase = step_phases(plan, step)
    if phase is None:
        raise InputError(f"step {step} has no swing phase to draw; choose another step")
    ax = panel(ax, 7.0, 3.6)
    times, interval = _swing_times(plan, phase)
    line = _in_swing_plane(plan, phase, times)
    dots = _in_swing_plane(plan, phase, _dot_times(plan, phase, interval))
    colour = LEG_COLOURS[phase.leg]
    ax.plot(*line.T, color=colour, linewidth=1.8, label=f"{phase.leg} foot", gid="foot")
    ax.plot(*dots.T, "o", color=colour, markersize=4, label=f"every {interval:g} s")
    if isinstance(plan.settings, CrawlSettings) and plan.settings.swing == "box":
        _mark_box(ax, plan, phase)
    if plan.footholds.ground is not None:
        ground = _ground_below(plan, phase, plan.footholds.ground)
        ax.plot(*ground.T, color=MUTED, linewidth=1.2, label="ground below it", gid="ground")
    style_axes(ax, f"Swing of {phase.leg} in step {step}, {phase.duration:.2f} s",
               "along the step [mm]", "height over lift-off [mm]")  # fmt: skip
    ax.margins(0.14)
    ax.set_aspect("equal", adjustable="datalim")
    add_legend(ax, **BESIDE)
    return ax


def _swing_times(plan: Plan, phase: Phase) -> tuple[FloatArray, float]:
    """Times at which a swing is drawn ``(n,)`` [s], and a round interval for about 25 dots [s]."""
    end = min(phase.end, plan.duration)
    knots = plan.path.times[(plan.path.times >= phase.start) & (plan.path.times <= end)]
    times = np.unique(np.concatenate([knots, np.linspace(phase.start, end, 200)]))
    wanted = max(phase.duration / DOTS, 1e-6)
    scale = 10.0 ** np.floor(np.log10(wanted))
    return times, float(scale * min(n for n in (1.0, 2.0, 5.0, 10.0) if n * scale >= wanted))


def _dot_times(plan: Plan, phase: Phase, interval: float) -> FloatArray:
    """Times of a phase at equal intervals [s]."""
    times = np.arange(phase.start, phase.end + 1e-9, interval)
    return np.asarray(np.minimum(times, plan.duration))


def _in_swing_plane(plan: Plan, phase: Phase, times: FloatArray) -> FloatArray:
    """The foot's distance along the step, and height above its lift-off ``(n, 2)`` [mm]."""
    moved = plan.at(times).feet[:, leg_index(phase.leg)] - phase.foot_start
    return np.asarray(1e3 * np.column_stack([moved[:, :2] @ _step_axis(plan, phase), moved[:, 2]]))


def _ground_below(plan: Plan, phase: Phase, ground: HeightMap) -> FloatArray:
    """The ground below a step: distance along it, and height above lift-off ``(n, 2)`` [mm]."""
    start, end = phase.foot_start, phase.foot_end
    count = 2 * int(np.ceil(np.linalg.norm(end - start) / ground.resolution)) + 2
    places = start[:2] + np.linspace(-0.1, 1.1, count)[:, None] * (end - start)[:2]
    along = (places - start[:2]) @ _step_axis(plan, phase)
    return np.asarray(1e3 * np.column_stack([along, ground.height(places) - start[2]]))


def _swing_height(plan: Plan, phase: Phase) -> float:
    """How far the foot was to rise above the higher end of a swing [m]."""
    heights = plan.footholds.swing_heights
    made = [s.index for s in plan.swings if s.leg == phase.leg and s.start <= phase.start + 1e-9]
    if heights is None or not made or made[-1] >= len(heights[phase.leg]):
        return plan.settings.swing_height
    return float(heights[phase.leg][made[-1]])


def _step_axis(plan: Plan, phase: Phase) -> FloatArray:
    """Unit vector of a step ``(2,)``."""
    step = (phase.foot_end - phase.foot_start)[:2]
    length = float(np.hypot(*step))
    return step / length if length > 1e-9 else forward_axis(plan)


def _mark_box(ax: Axes, plan: Plan, phase: Phase) -> None:
    """Write the corners A, B, C, D of a swing along a box, and its width and height."""
    height = _swing_height(plan, phase)
    moved = box_corners(phase.foot_start, phase.foot_end, height) - phase.foot_start
    corners = 1e3 * np.column_stack([moved[:, :2] @ _step_axis(plan, phase), moved[:, 2]])
    for name, corner, offset in zip("ABCD", corners, ((-1, 0), (-1, 1), (1, 1), (1, 0)),
                                    strict=True):  # fmt: skip
        ax.annotate(name, corner, xytext=(9 * offset[0], 7 * offset[1]), ha="center", va="center",
                    textcoords="offset points", fontsize=SMALL + 1, color=INK)  # fmt: skip
    (a, b, c, _), arrow = corners, {"arrowstyle": "<->", "color": MUTED, "linewidth": 0.8}
    across, rise = c - b, (corners[1] - corners[0])[1]
    top, side = (b + c) / 2.0, (a + b) / 2.0
    below = np.array([0.0, -0.16 * max(rise, 1.0)])
    ax.annotate("", b + below, c + below, arrowprops=arrow)
    ax.annotate(f"{np.linalg.norm(across):.0f} mm", top + 1.2 * below, ha="center", va="top",
                fontsize=SMALL, color=INK)  # fmt: skip
    beside = np.array([0.1 * max(float(np.linalg.norm(across)), 1.0), 0.0])
    ax.annotate("", a + beside, b + beside, arrowprops=arrow)
    ax.annotate(f"{rise:.0f} mm", side + 1.15 * beside, ha="left", va="center", fontsize=SMALL,
                color=INK)  # fmt: skip
