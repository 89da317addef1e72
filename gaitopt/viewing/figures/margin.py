"""The static stability margin over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, overload

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import check_kind
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.stability.margins import static_stability_margin
from gaitopt.viewing.figures.common import (
    BESIDE,
    DASHED,
    INK,
    NORMAL,
    SMALL,
    add_legend,
    cycle_phases,
    cycle_title,
    leg_keys,
    phases_within,
    shade_swings,
    span_of,
    style_axes,
    support_table,
    thinned_to_pixels,
    time_limits,
)
from gaitopt.viewing.figures.panels import Panels, panel, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COG_COLOUR, COM_COLOUR = "#1b4f8f", "#b35806"
POINTS = 20_000
"""Points of a line before it is thinned out, about: several for each pixel column."""


@overload
def plot_margin(
    plan: Plan,
    com_margin: tuple[ArrayLike, ArrayLike] | None = None,
    *,
    cycle: int | None = None,
    ax: None = None,
) -> Panels: ...
@overload
def plot_margin(
    plan: Plan,
    com_margin: tuple[ArrayLike, ArrayLike] | None = None,
    *,
    cycle: int | None = None,
    ax: Axes,
) -> Axes: ...
def plot_margin(
    plan: Plan,
    com_margin: tuple[ArrayLike, ArrayLike] | None = None,
    *,
    cycle: int | None = None,
    ax: Axes | None = None,
) -> Axes | Panels:
    """Plot the static stability margin over time: of the whole plan, and of one gait cycle.

    The margin jumps where the set of standing feet changes. It is not drawn where fewer than three
    feet stand.

    Args:
        plan: any plan.
        com_margin: margin of the true centre of mass: times ``(n,)`` [s] and margins ``(n,)``
            [m], for instance from :func:`gaitopt.com_margin`. Not drawn by default.
        cycle: index of the gait cycle in the lower panel, from 0; the middle one by default.
        ax: where to draw only the whole plan; by default a new figure with both panels.

    Returns:
        ``ax``; or the two axes of the new figure: the whole plan, and the cycle.

    Raises:
        InputError: there is no such cycle, or ``com_margin`` is not two arrays of the same length.
    """
    check_kind("plan", plan, Plan)
    com = None if com_margin is None else _checked(com_margin)
    number, phases = cycle_phases(plan, cycle)
    if ax is not None:
        ax = panel(ax, 0.0, 0.0)
        _draw_margin(ax, plan, time_limits(plan), com)
        add_legend(ax, loc="upper right")
        return ax
    drawn = panels(None, (2,), 9.0, 5.4, sharey=True)
    whole, close = drawn
    _draw_margin(whole, plan, time_limits(plan), com)
    shade_swings(close, phases)
    _draw_margin(close, plan, span_of(phases), com)
    close.set_title(cycle_title(number, phases), fontsize=NORMAL, color=INK, loc="left")
    handles, _ = whole.get_legend_handles_labels()
    add_legend(whole, handles, **BESIDE)
    add_legend(close, leg_keys("s"), title="shaded: foot flies", title_fontsize=SMALL, **BESIDE)
    return drawn


def _checked(com_margin: tuple[ArrayLike, ArrayLike]) -> tuple[FloatArray, FloatArray]:
    """Times and margins as arrays; raises InputError where their shapes do not fit."""
    times, margins = (np.asarray(a, dtype=np.float64) for a in com_margin)
    if times.ndim != 1 or times.shape != margins.shape:
        raise InputError(
            f"com_margin must be times (n,) and margins (n,), got {times.shape} and {margins.shape}"
        )
    return times, margins


def _draw_margin(
    ax: Axes,
    plan: Plan,
    span: tuple[float, float],
    com: tuple[FloatArray, FloatArray] | None,
) -> None:
    """Draw the margins within ``span`` [s]."""
    within = phases_within(plan, span)
    # Four feet that stand for 0 s would be a spike.
    lasting = tuple(phase for phase in within if phase.duration > 0.0) or within
    lines = [("COG of the plan", COG_COLOUR, margin_line(plan, lasting))]
    if com is not None:
        inside = (com[0] >= span[0]) & (com[0] <= span[1])
        lines.append(("true centre of mass", COM_COLOUR, (com[0][inside], com[1][inside])))
    for label, colour, (times, margins) in lines:
        t, y = thinned_to_pixels(times, margins)
        marker = "o" if len(t) and t[-1] <= t[0] else "-"
        ax.plot(t, 1e3 * y, marker, color=colour, linewidth=1.0, label=label, gid=label)
    least = plan.settings.stability_margin
    ax.axhline(1e3 * least, color=INK, linewidth=0.9, linestyle=DASHED,
               label=f"$S_0$ = {1e3 * least:g} mm")  # fmt: skip
    found = f"; smallest {1e3 * plan.margin:.1f} mm" if plan.phases else ""
    style_axes(ax, "Static stability margin" + found, "time [s]", "margin [mm]")
    ax.set_xlim(span)
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))


def margin_line(plan: Plan, phases: tuple[Phase, ...]) -> tuple[FloatArray, FloatArray]:
    """Static stability margin of the COG over time.

    Args:
        plan: any plan.
        phases: those to compute; without any, four feet stand over the whole plan.

    Returns:
        Times ``(m,)`` [s], with the ends of all phases, and margins ``(m,)`` [m], which are NaN
        where fewer than three feet stand.
    """
    if not phases:
        here = plan.at([0.0, plan.duration])
        return here.t, static_stability_margin(here.feet, here.cog)
    count = int(np.clip(POINTS // len(phases), 3, 33))
    starts = np.array([[p.start, p.duration] for p in phases])
    times = starts[:, :1] + starts[:, 1:] * np.linspace(0.0, 1.0, count)
    walk = plan.at(np.minimum(times.ravel(), plan.duration))
    standing = np.repeat(support_table(phases), count, axis=0)
    margins = np.full(len(walk), np.nan)
    for pattern in np.unique(standing, axis=0):
        if pattern.sum() >= 3:
            mine = (standing == pattern).all(axis=1)
            feet = walk.feet[mine][:, [i for i in range(len(LEGS)) if pattern[i]]]
            margins[mine] = static_stability_margin(feet, walk.cog[mine])
    return np.array(walk.t), margins
