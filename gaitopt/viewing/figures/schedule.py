"""Gait diagrams, and the stability of crawls over their duty factor."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.errors import InputError
from gaitopt.gait.crawl import CRAWL_SEQUENCES, WANG_SEQUENCE
from gaitopt.gait.longitudinal import margin_over_duty, wave_margin_over_duty
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.inputs import check_array, check_count, check_kind
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    BESIDE,
    INK,
    MUTED,
    SMALL,
    add_legend,
    line_key,
    plain,
    shared_dashes,
    style_axes,
    text_colour_on,
)
from gaitopt.viewing.figures.panels import panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_DRAWN = 20
"""Most cycles in one diagram: more bars are too narrow to read."""
FEET_COLOURS = ("#ffffff", "#e4e4e4", "#cfcfcf", "#b5b5b5", "#979797")
"""Colours for the number of standing feet, from none to four."""
ORDER_COLOURS = ("#1b4f8f", "#b35806", "#2e9e5b", "#e3b505", "#8e4585", "#d1383d")


def plot_gait_diagram(schedule: GaitSchedule, cycles: int = 2, ax: Axes | None = None) -> Axes:
    """Plot a gait diagram: a bar for each stance of a leg, and below the number of standing feet.

    The duty factor β is marked above the first leg. The phase offset φ, the share of the cycle at
    which a leg touches down, is written into the first bar of each leg that is long enough.

    Source: Figs. 2, 3 and 5 of [Wang2024].

    Args:
        schedule: the gait.
        cycles: number of cycles to draw.
        ax: where to draw; by default a new figure.

    Returns:
        The axes.

    Raises:
        InputError: the number of cycles is not a whole number from 1 to :data:`MOST_DRAWN`.
    """
    check_kind("schedule", schedule, GaitSchedule)
    check_count("cycles", cycles, 1, MOST_DRAWN)
    ax = panel(ax, 8.5, 3.1)
    rows = {leg: 4 - i for i, leg in enumerate(LEG_COLOURS)}
    for leg, row in rows.items():
        _draw_leg(ax, schedule, leg, row, cycles)
    _mark_duty(ax, schedule, next(iter(rows)), cycles)
    _draw_feet(ax, schedule, cycles)
    for whole in range(cycles + 1):
        ax.axvline(whole, color=INK, linewidth=0.6, linestyle=(0, (4, 3)), zorder=3)
    name = plain(schedule.name.replace("_", "-"))
    title = f"{name}: β = {schedule.duty_factor:g}, cycle {schedule.cycle_time:g} s"
    flight = sum(i.duration for i in schedule.intervals(schedule.cycle_time) if not i.support)
    if schedule.has_flight:
        title += f", in flight for {100 * flight / schedule.cycle_time:.0f} % of it"
    style_axes(ax, title[0].upper() + title[1:], "time [cycles]", "", grid=False)
    ax.set_yticks([*rows.values(), 0], [*rows, "feet"])
    ax.tick_params(axis="y", length=0)
    ax.spines["left"].set_visible(False)
    ax.set(xlim=(0, cycles), ylim=(-0.55, 5.15))
    return ax


def _draw_leg(ax: Axes, schedule: GaitSchedule, leg: str, row: int, cycles: int) -> None:
    """Draw bars for the stances of a leg, on a line."""
    touch, duty = schedule.touchdowns[leg], schedule.duty_factor
    starts = np.maximum(touch + np.arange(-1, cycles), 0.0)
    ends = np.minimum(touch + duty + np.arange(-1, cycles), cycles)
    bars = [(a, b - a) for a, b in zip(starts, ends, strict=True) if b > a]
    ax.plot((0, cycles), (row, row), color=MUTED, linewidth=1.0, zorder=1)
    ax.broken_barh(bars, (row - 0.32, 0.64), facecolor=LEG_COLOURS[leg], gid=leg, zorder=2)
    if min(duty, cycles - touch) > 0.08 * cycles:
        ax.annotate(f"φ = {touch:.3g}", (touch, row), xytext=(5, 0), textcoords="offset points",
                    ha="left", va="center", fontsize=SMALL - 0.5, zorder=4,
                    color=text_colour_on(LEG_COLOURS[leg]))  # fmt: skip


def _mark_duty(ax: Axes, schedule: GaitSchedule, leg: str, cycles: int) -> None:
    """Draw an arrow as long as a stance above the first bar of ``leg``, if that bar is complete."""
    touch, duty = schedule.touchdowns[leg], schedule.duty_factor
    if touch + duty > cycles:
        return
    ax.annotate("", (touch, 4.5), (touch + duty, 4.5),
                arrowprops={"arrowstyle": "<->", "color": INK, "linewidth": 0.8,
                            "shrinkA": 0, "shrinkB": 0})  # fmt: skip
    ax.annotate(f"β = {duty:.3g}", (touch + duty / 2.0, 4.56), ha="center", va="bottom",
                fontsize=SMALL, color=INK)  # fmt: skip


def _draw_feet(ax: Axes, schedule: GaitSchedule, cycles: int) -> None:
    """Write the number of standing feet into the lowest row."""
    for interval in schedule.intervals(cycles * schedule.cycle_time):
        start, length = (
            interval.start / schedule.cycle_time,
            interval.duration / schedule.cycle_time,
        )
        feet = len(interval.support)
        ax.broken_barh([(start, length)], (-0.28, 0.56), facecolor=FEET_COLOURS[feet],
                       edgecolor=INK, linewidth=0.5, gid="feet", zorder=2)  # fmt: skip
        if length > 0.015 * cycles:
            ax.annotate(f"{feet}", (start + length / 2.0, 0.0), ha="center", va="center",
                        fontsize=SMALL, color=INK, zorder=4)  # fmt: skip


def plot_margin_over_duty(
    duties: ArrayLike | None = None,
    *,
    stride: float = 0.3,
    length: float = 0.6,
    ax: Axes | None = None,
) -> Axes:
    """Plot the longitudinal stability margin of the six crawl orders over the duty factor.

    The swings of these are evenly spaced in time. The dashed line above them is the wave gait: the
    best order with its best timing. Lines that coincide are drawn as alternating dashes.

    Args:
        duties: duty factors ``(D,)`` in [0.75, 1); by default 0.75 to 0.99.
        stride: distance that the body moves in a cycle [m].
        length: distance from hind to front hips [m].
        ax: where to draw; by default a new figure.

    Returns:
        The axes.

    Raises:
        InputError: a number is out of range.
    """
    shares = np.linspace(0.75, 0.99, 49) if duties is None else check_array("duties", duties)
    if not shares.size:
        raise InputError("duties must be at least one duty factor, got none")
    margins = 1e3 * margin_over_duty(CRAWL_SEQUENCES, shares, stride, length)
    best = 1e3 * wave_margin_over_duty(shares, stride, length)
    ax = panel(ax, 7.5, 3.8)
    ax.axhline(0.0, color=INK, linewidth=0.8)
    keys = [line_key(f"{' '.join(WANG_SEQUENCE)}, as a wave", ORDER_COLOURS[0], "--")]
    ax.plot(shares, best, "--", color=ORDER_COLOURS[0], linewidth=1.5, gid="wave")
    for order, line, colour, dashes in zip(
        CRAWL_SEQUENCES, margins, ORDER_COLOURS, shared_dashes(list(margins)), strict=True
    ):
        label = " ".join(order)
        ax.plot(shares, line, color=colour, linewidth=2.0, linestyle=dashes, gid=label,
                dash_capstyle="butt")  # fmt: skip
        keys.append(line_key(label, colour, width=2.0))
    title = f"Longitudinal stability of crawls (stride {stride:g} m, hips {length:g} m apart)"
    style_axes(ax, title, "duty factor [-]", "smallest margin in a cycle [mm]")
    ax.set_xlim(shares.min(), shares.max())
    add_legend(ax, keys, title="order of swings", title_fontsize=SMALL, **BESIDE)
    return ax
