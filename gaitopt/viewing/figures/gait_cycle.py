"""Figs. 4 and 5 of [Wang2020]: the gait cycle and the swing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gaitopt.conventions import FloatArray, leg_index
from gaitopt.errors import InputError
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.swing.box import box_corners
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    INK,
    MUTED,
    SMALL,
    add_legend,
    cycle_phases,
    cycle_title,
    dress,
    forward_axis,
    line_key,
    panel,
    span_of,
    step_phases,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot_gait_cycle(plan: Plan, cycle: int | None = None, ax: Axes | None = None) -> Figure:
    """The gait diagram of one cycle: who swings when, and when the body moves on four feet.

    Source: Fig. 4 of [Wang2020]. A stance phase that takes no time is marked by a
    tick.

    Args:
        plan: any plan.
        cycle: index of the gait cycle, from 0; the middle one by default.
        ax: where to draw; by default a new figure.

    Raises:
        InputError: there is no such cycle.
    """
    from matplotlib.patches import Patch

    number, phases = cycle_phases(plan, cycle)
    figure, ax = panel(ax, 8.5, 2.9)
    rows = {leg: 3 - i for i, leg in enumerate(LEG_COLOURS)}
    span = span_of(phases)
    for row in rows.values():
        ax.plot(span, (row, row), color=MUTED, linewidth=1.0, zorder=1)
    for phase in phases:
        bar = [(phase.start, phase.duration)]
        for leg in phase.flying:
            ax.broken_barh(bar, (rows[leg] - 0.32, 0.64), facecolor=LEG_COLOURS[leg], gid=leg,
                           zorder=2)  # fmt: skip
            _write(ax, f"{leg}_SW", phase, rows[leg], span)
        if phase.kind == "stance":
            ax.broken_barh(bar, (3.68, 0.64), facecolor="#6f6f6f", edgecolor="#6f6f6f",
                           linewidth=0.8, gid="COG", zorder=2)  # fmt: skip
            _write(ax, f"COG_{phase.leg}", phase, 4.0, span, above=True)
    seconds = f", {span[1] - span[0]:.2f} s" if phases else ""
    dress(ax, cycle_title(number, phases) + seconds, "time [s]", "", grid=False)
    ax.set_yticks([*rows.values(), 4], [*rows, "COG"])
    ax.spines["left"].set_visible(False)
    ax.set(xlim=span, ylim=(-0.6, 5.1))
    keys = [Patch(facecolor=c, label=f"{leg} swings") for leg, c in LEG_COLOURS.items()]
    keys += [Patch(facecolor="#6f6f6f", label="body moves,\nfour feet stand")]
    keys += [line_key("foot stands", MUTED, width=1.0)]
    add_legend(ax, keys, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def _write(ax: Axes, text: str, phase: Phase, row: float, span: tuple[float, float],
           above: bool = False) -> None:  # fmt: skip
    """A phase's name in its bar, or over the bar."""
    wide = phase.duration > 0.07 * (span[1] - span[0])
    if above or wide:
        ax.annotate(text, (phase.start + phase.duration / 2.0, row + (0.45 if above else 0.0)),
                    ha="center", va="bottom" if above else "center", fontsize=SMALL - 0.5,
                    color=INK if above else _on(LEG_COLOURS[phase.leg]), zorder=3)  # fmt: skip


def _on(colour: str) -> str:
    """Black or white, whichever reads better on ``colour``."""
    from matplotlib.colors import to_rgb

    return INK if float(np.dot(to_rgb(colour), (0.299, 0.587, 0.114))) > 0.6 else "white"


def plot_swing(plan: Plan, step: int, ax: Axes | None = None) -> Figure:
    """The path of the swing foot in the vertical plane of its motion, with dots at equal times.

    Source: Fig. 5 of [Wang2020]. Where the foot comes down on the place it left, the
    plane is the one of the walk's forward direction.

    Args:
        plan: any plan.
        step: index of the step, from 0.
        ax: where to draw; by default a new figure.

    Raises:
        InputError: there is no such step, or no foot flies in it.
    """
    _, phase = step_phases(plan, step)
    if phase is None:
        raise InputError(f"no foot flies in step {step}, so there is no swing to draw")
    figure, ax = panel(ax, 7.0, 3.6)
    times, beat = _swing_times(plan, phase)
    line = _in_swing_plane(plan, phase, times)
    dots = _in_swing_plane(plan, phase, _beats(plan, phase, beat))
    colour = LEG_COLOURS[phase.leg]
    ax.plot(*line.T, color=colour, linewidth=1.8, label=f"{phase.leg} foot", gid="foot")
    ax.plot(*dots.T, "o", color=colour, markersize=4, label=f"every {beat:g} s")
    if isinstance(plan.settings, CrawlSettings) and plan.settings.swing == "box":
        _mark_box(ax, plan, phase)
    dress(ax, f"Swing of {phase.leg} in step {step}, {phase.duration:.2f} s",
          "along the step [mm]", "height over lift-off [mm]")  # fmt: skip
    ax.margins(0.14)
    ax.set_aspect("equal", adjustable="datalim")
    add_legend(ax, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def _swing_times(plan: Plan, phase: Phase) -> tuple[FloatArray, float]:
    """Times that show a swing: knots and some between; and the beat of about 25 dots."""
    end = min(phase.end, plan.duration)
    knots = plan.path.times[(plan.path.times >= phase.start) & (plan.path.times <= end)]
    times = np.unique(np.concatenate([knots, np.linspace(phase.start, end, 200)]))
    wanted = max(phase.duration / 25.0, 1e-6)
    scale = 10.0 ** np.floor(np.log10(wanted))
    return times, float(scale * min(n for n in (1.0, 2.0, 5.0, 10.0) if n * scale >= wanted))


def _beats(plan: Plan, phase: Phase, beat: float) -> FloatArray:
    return np.asarray(np.minimum(np.arange(phase.start, phase.end + 1e-9, beat), plan.duration))


def _in_swing_plane(plan: Plan, phase: Phase, times: FloatArray) -> FloatArray:
    """The foot along the step and over its lift-off ``(n, 2)`` [mm]."""
    moved = plan.at(times).feet[:, leg_index(phase.leg)] - phase.foot_start
    return np.asarray(1e3 * np.column_stack([moved[:, :2] @ _step_axis(plan, phase), moved[:, 2]]))


def _step_axis(plan: Plan, phase: Phase) -> FloatArray:
    step = (phase.foot_end - phase.foot_start)[:2]
    length = float(np.hypot(*step))
    return step / length if length > 1e-9 else forward_axis(plan)


def _mark_box(ax: Axes, plan: Plan, phase: Phase) -> None:
    """Letters and measures of the box A, B, C, D of a swing."""
    height = plan.settings.swing_height
    moved = box_corners(phase.foot_start, phase.foot_end, height) - phase.foot_start
    corners = 1e3 * np.column_stack([moved[:, :2] @ _step_axis(plan, phase), moved[:, 2]])
    for name, corner, offset in zip("ABCD", corners, ((-1, 0), (-1, 1), (1, 1), (1, 0)),
                                    strict=True):  # fmt: skip
        ax.annotate(name, corner, xytext=(9 * offset[0], 7 * offset[1]), ha="center", va="center",
                    textcoords="offset points", fontsize=SMALL + 1, color=INK)  # fmt: skip
    (a, b, c, _), arrow = corners, {"arrowstyle": "<->", "color": MUTED, "linewidth": 0.8}
    across, up = c - b, (corners[1] - corners[0])[1]
    middle, level = (b + c) / 2.0, (a + b) / 2.0
    drop = np.array([0.0, -0.16 * max(up, 1.0)])
    ax.annotate("", b + drop, c + drop, arrowprops=arrow)
    ax.annotate(f"{np.linalg.norm(across):.0f} mm", middle + 1.2 * drop, ha="center", va="top",
                fontsize=SMALL, color=INK)  # fmt: skip
    side = np.array([0.1 * max(float(np.linalg.norm(across)), 1.0), 0.0])
    ax.annotate("", a + side, b + side, arrowprops=arrow)
    ax.annotate(f"{up:.0f} mm", level + 1.15 * side, ha="left", va="center", fontsize=SMALL,
                color=INK)  # fmt: skip
