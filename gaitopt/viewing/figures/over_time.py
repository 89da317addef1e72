"""Figs. 12 to 15 of [Wang2020]: the COG and the joint velocities over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.errors import InputError
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    DASHED,
    INK,
    MUTED,
    NORMAL,
    SMALL,
    add_legend,
    cycle_phases,
    cycle_title,
    forward_axis,
    plain,
    shade_swings,
    span_of,
    style_axes,
    thinned_to_pixels,
    time_label,
    time_limits,
    times_to_draw,
)
from gaitopt.viewing.figures.joint_curves import curve_lines
from gaitopt.viewing.figures.panels import Panels, panel, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PLAN_STYLES = (
    ("#1b4f8f", "-"),
    ("#b35806", "--"),
    ("#5e3c99", "-."),
    ("#4d4d4d", ":"),
    ("#2a7f62", (0, (6, 1, 1, 1, 1, 1))),
    ("#9c3868", (0, (1, 1))),
)
"""Colours and line styles of plans that are compared."""
VELOCITY_POINTS = 20_000
"""Points of a line of velocities before it is thinned out, about."""
JOINT_COLOURS = ("#5a5a5a", "#8c4fa8", "#e07b1a")
"""Colours of a leg's joints from the body to the foot; none is a leg's colour."""


def plot_cog_over_time(plans: Mapping[str, Plan], ax: Axes | None = None) -> Axes:
    """Plot how far the COG has moved forward over time, with a line for each plan.

    Source: Figs. 12, 14 and 15 of [Wang2020].

    Args:
        plans: plans by their names in the legend.
        ax: where to draw; by default a new figure.

    Returns:
        The axes.

    Raises:
        InputError: no plan is given, or something is no plan.
    """
    if not plans:
        raise InputError("plot_cog_over_time needs one plan or more, got none")
    check_kind("plans", plans, Mapping)
    for plan in plans.values():
        check_kind("each of plans", plan, Plan)
    ax = panel(ax, 7.5, 4.2)
    ends = []
    for i, (name, plan) in enumerate(plans.items()):
        colour, style = PLAN_STYLES[i % len(PLAN_STYLES)]
        t = times_to_draw(plan)
        cog = plan.at(t).cog
        forward = (cog - cog[0])[:, :2] @ forward_axis(plan)
        label = f"{plain(name)} ({time_label(plan.duration)}, {1e3 * plan.mean_speed:.4g} mm/s)"
        ax.plot(t, forward, color=colour, linestyle=style, linewidth=1.5, label=label)
        ax.plot(t[-1], forward[-1], "o", color=colour, markersize=4)
        ends.append((plan.duration, float(forward[-1]), colour))
    longest = max(end[0] for end in ends) or 1.0
    style_axes(ax, "The COG along the walking direction", "time [s]", "COG moved forward [m]")
    ax.set_xlim(0.0, 1.04 * longest)
    ax.margins(y=0.14)
    _label_ends(ax, ends, longest)
    add_legend(ax, loc="upper left")
    return ax


def _label_ends(ax: Axes, ends: list[tuple[float, float, str]], longest: float) -> None:
    """Draw a line from each end to the time axis, and write the time there.

    Args:
        ax: the axes.
        ends: time [s], distance [m] and colour of each line's end.
        longest: the longest time [s].
    """
    bottom = ax.get_ylim()[0]
    before, lines_up = -np.inf, 0
    for time, place, colour in sorted(ends):
        # A text is about a ninth of the axis wide: the next one is written higher where they touch.
        lines_up = lines_up + 1 if time - before < 0.11 * longest else 0
        ax.plot((time, time), (bottom, place), color=colour, linewidth=0.7, linestyle=":")
        ax.annotate(time_label(time), (time, bottom), xytext=(-3, 4 + 11 * lines_up), ha="right",
                    textcoords="offset points", fontsize=SMALL, color=colour)  # fmt: skip
        before = time
    ax.set_ylim(bottom=bottom)


def plot_joint_velocities(
    plan: Plan, *, cycle: int | None = None, axes: Sequence[Axes] | Panels | None = None
) -> Panels:
    """Plot the velocities of the legs' joints with their limits, in a row for each leg.

    On the left is the whole plan, on the right one gait cycle. Lines are exact, and jump where the
    velocity jumps. Joints that belong to no leg are left out. Source: Fig. 13 of [Wang2020].

    Args:
        plan: any plan.
        cycle: index of the gait cycle on the right, from 0; the middle one by default.
        axes: where to draw ``(4, 2)``; by default a new figure.

    Returns:
        The axes ``(4, 2)``: a row for each leg, the whole plan and the cycle.

    Raises:
        InputError: there is no such cycle, or the axes have another shape.
    """
    check_kind("plan", plan, Plan)
    number, phases = cycle_phases(plan, cycle)
    drawn = panels(
        axes, (len(LEG_COLOURS), 2), 11.0, 8.0, sharex="col", sharey="row", width_ratios=[1.5, 1.0]
    )
    spans = (time_limits(plan), span_of(phases))
    for row, leg in enumerate(LEG_COLOURS):
        for column, span in enumerate(spans):
            ax = drawn[row, column]
            if column:
                shade_swings(ax, phases)
            _draw_velocities(ax, plan, leg, span)
            last = row == len(LEG_COLOURS) - 1
            style_axes(ax, "", "time [s]" if last else "", "" if column else f"{leg} [deg/s]")
            ax.set_xlim(span)
        add_legend(drawn[row, 1], loc="center left", bbox_to_anchor=(1.0, 0.5))
        drawn[row, 0].yaxis.label.set(color=LEG_COLOURS[leg], fontweight="bold")
    zoom = cycle_title(number, phases) + (", shaded: foot flies" if phases else "")
    titles = ("Joint velocities over the whole walk", zoom)
    for ax, title in zip(drawn[0], titles, strict=True):
        ax.set_title(title, fontsize=NORMAL, color=INK, loc="left")
    return drawn


def _draw_velocities(ax: Axes, plan: Plan, leg: str, span: tuple[float, float]) -> None:
    """Draw the velocities of one leg's joints within ``span`` [s], and their limits."""
    columns = plan.robot.leg_columns[leg]
    times, rates = curve_lines(plan.path, columns, span, 1, VELOCITY_POINTS)
    joints = plan.robot.legs[leg].joints
    for joint, rate, colour in zip(joints, rates.T, JOINT_COLOURS[-len(joints) :], strict=True):
        t, y = thinned_to_pixels(times, np.degrees(rate))
        marker = "o" if t[-1] <= t[0] else ""
        ax.plot(t, y, marker, color=colour, linewidth=0.9, label=plain(joint), gid=joint)
    limits = np.unique(np.degrees(plan.robot.velocity_limits[list(columns)]).round(9))
    for i, limit in enumerate(limits[np.isfinite(limits)]):
        for sign in (-1.0, 1.0):
            ax.axhline(sign * limit, color=INK, linewidth=0.8, linestyle=DASHED,
                       label="limit" if i == 0 and sign > 0 else None)  # fmt: skip
    if np.isfinite(limits).any():
        top = 1.18 * float(limits[np.isfinite(limits)].max())
        ax.set_ylim(-top, top)
    ax.axhline(0.0, color=MUTED, linewidth=0.5, zorder=0)
