"""Figs. 6 and 7 of [Wang2020]: where the COG may be before a step, and its target."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.viewing.colours import HELD, LEG_COLOURS
from gaitopt.viewing.figures.area import FeasibleArea, feasible_area
from gaitopt.viewing.figures.common import (
    INK,
    MUTED,
    add_legend,
    dot_key,
    line_key,
    style_axes,
)
from gaitopt.viewing.figures.panels import Panels, legend_below, panel, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TRIANGLE = "#4d4d4d"
SHRUNKEN = "#e08214"
COMMON = "#bcd9c6"
"""Colours of the support polygon, Area A, and the intersection of Areas A and B."""
FEET_BORDER, FOOTHOLD_BORDER = 0.09, 0.05
"""Borders around the feet and the next foothold [m]: room for their names."""


@overload
def plot_feasible_area(plan: Plan, step: int, ax: None = None) -> Panels: ...
@overload
def plot_feasible_area(plan: Plan, step: int, ax: Axes) -> Axes: ...
def plot_feasible_area(plan: Plan, step: int, ax: Axes | None = None) -> Axes | Panels:
    """Plot Areas A and B before a step, their intersection, and the COG's move from O to O'.

    Source: Figs. 6 and 7 of [Wang2020].

    Args:
        plan: any plan.
        step: index of the step, from 0.
        ax: where to draw the whole area; by default a new figure, which also has a close-up of
            the COG's move.

    Returns:
        ``ax``; or the two axes of the new figure: the whole area, and the close-up.

    Raises:
        InputError: there is no such step.
    """
    check_kind("plan", plan, Plan)
    area = feasible_area(plan, step)
    title = f"Step {area.step}: where the COG may be while {area.leg} swings"
    if ax is not None:
        ax = panel(ax, 0.0, 0.0)
        _draw_area(ax, area, title)
        add_legend(ax, _keys(area), loc="upper left", bbox_to_anchor=(1.02, 1.0))
        return ax
    drawn: Panels = panels(None, (1, 2), 11.5, 5.2, width_ratios=[1.25, 1.0])[0]
    whole, close = drawn
    _draw_area(whole, area, title)
    _draw_area(close, area, _move_title(area))
    _close_up(close, area)
    whole.indicate_inset_zoom(close, edgecolor=INK, linewidth=0.8)
    legend_below(drawn, _keys(area), own=True, ncols=4 if len(area.held) else 5)
    return drawn


def _move_title(area: FeasibleArea) -> str:
    """Title of the close-up: how far the COG moves, and which constraints are active."""
    moved = 1e3 * float(np.hypot(*(area.target - area.start)))
    pairs = [name.split(" ", 1) for name in area.active]
    active = [
        f"{kind} " + ", ".join(what.replace("-", "–") for k, what in pairs if k == kind)
        for kind in dict.fromkeys(kind for kind, _ in pairs)
    ]
    return f"{moved:.1f} mm from O to O'\nactive: {'; '.join(active) or 'nothing'}"


def _draw_area(ax: Axes, area: FeasibleArea, title: str) -> None:
    """Draw regions, reach, feet and COG on axes of the same scale."""
    _draw_regions(ax, area)
    _draw_reach(ax, area)
    _draw_places(ax, area)
    style_axes(ax, title, "x [m]", "y [m]", grid=False)
    low, high = area.feet.min(axis=0) - FEET_BORDER, area.feet.max(axis=0) + FEET_BORDER
    if area.foothold is not None:
        low = np.minimum(low, area.foothold - FOOTHOLD_BORDER)
        high = np.maximum(high, area.foothold + FOOTHOLD_BORDER)
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_aspect("equal", adjustable="box")


def _draw_regions(ax: Axes, area: FeasibleArea) -> None:
    """Draw support polygon, Area A, where forces hold, and what all of them have in common."""
    from matplotlib.patches import Polygon

    if len(area.common):
        ax.add_patch(Polygon(area.common, facecolor=COMMON, edgecolor="none", zorder=1,
                             label="A and B"))  # fmt: skip
    if len(area.triangle):
        ax.add_patch(Polygon(area.triangle, fill=False, edgecolor=TRIANGLE, linewidth=1.0,
                             zorder=2, label="support"))  # fmt: skip
    if len(area.shrunken) >= 3:
        ax.add_patch(Polygon(area.shrunken, fill=False, edgecolor=SHRUNKEN, linewidth=1.3,
                             linestyle=(0, (5, 2)), zorder=3, label="A"))  # fmt: skip
    if len(area.held):
        wide = any(name.startswith("forces") for name in area.active)
        ax.add_patch(Polygon(area.held, fill=False, edgecolor=HELD, linewidth=2.4 if wide else 1.2,
                             linestyle=(0, (1, 1.5)), zorder=3, label="forces"))  # fmt: skip
    for name in area.active:
        kind, what = name.split(" ", 1)
        if kind == "margin" and set(what.split("-")) <= set(LEGS):
            ends = np.array([area.feet[LEGS.index(leg)] for leg in what.split("-")])
            ax.plot(*ends.T, color=TRIANGLE, linewidth=2.6, solid_capstyle="round", zorder=2)


def _draw_reach(ax: Axes, area: FeasibleArea) -> None:
    """Draw the borders of the legs' reach, thick where the constraint is active."""
    for name, line in area.reach.items():
        if len(line):
            closed = np.vstack([line, line[:1]])
            ax.plot(*closed.T, color=LEG_COLOURS[name.split()[0]], zorder=4,
                    linewidth=2.4 if f"reach {name}" in area.active else 1.0,
                    linestyle="--" if name.endswith("foothold") else "-")  # fmt: skip


def _draw_places(ax: Axes, area: FeasibleArea) -> None:
    """Draw the feet, the next foothold, and the COG's move."""
    for leg, foot in zip(LEGS, area.feet, strict=True):
        ax.plot(*foot, "o", color=LEG_COLOURS[leg], markersize=8, zorder=5)
        away = foot - area.feet.mean(axis=0)
        _write(ax, leg, foot, 13.0 * away / max(float(np.hypot(*away)), 1e-12))
    if area.foothold is not None:
        ax.plot(*area.foothold, "o", markerfacecolor="white", zorder=5, markersize=8,
                markeredgewidth=1.6, markeredgecolor=LEG_COLOURS[area.leg])  # fmt: skip
    ax.plot(*np.array([area.start, area.target]).T, color=INK, linewidth=1.2, zorder=6)
    ax.plot(*area.start, "o", markerfacecolor="white", markeredgecolor=INK, zorder=7, markersize=6)
    ax.plot(*area.target, "o", color=INK, markersize=6, zorder=7)


def _close_up(ax: Axes, area: FeasibleArea) -> None:
    """Set the limits of the close-up around the COG's move, and write O and O' there."""
    move = area.target - area.start
    # At least 15 mm, and wide enough to show S0 between the polygon's side and Area A.
    half = max(0.9 * float(np.hypot(*move)), 1.6 * area.margin, 0.015)
    middle = (area.start + area.target) / 2.0
    ax.set_xlim(middle[0] - half, middle[0] + half)
    ax.set_ylim(middle[1] - half, middle[1] + half)
    direction = move / max(float(np.hypot(*move)), 1e-12)
    direction = direction if direction.any() else np.array([1.0, 0.0])
    _write(ax, "O", area.start, -14.0 * direction)
    _write(ax, "O'", area.target, 14.0 * direction)
    _draw_margin(ax, area, 0.35 * half)


def _draw_margin(ax: Axes, area: FeasibleArea, offset: float) -> None:
    """Draw S0 as an arrow from the side nearest to O', ``offset`` [m] along that side."""
    if len(area.triangle) != 3 or area.margin <= 0:
        return
    first, second = area.triangle, np.roll(area.triangle, -1, axis=0)
    along = (second - first) / np.linalg.norm(second - first, axis=1)[:, None]
    foot = first + ((area.target - first) * along).sum(axis=1)[:, None] * along
    side = int(np.argmin(np.linalg.norm(area.target - foot, axis=1)))
    inward = np.array([-along[side, 1], along[side, 0]])
    inward *= np.sign(inward @ (area.triangle.mean(axis=0) - first[side]))
    nearest = foot[side] + offset * along[side] * np.sign(along[side, 1] or 1.0)
    top = nearest + area.margin * inward
    ax.annotate("", xy=top, xytext=nearest, zorder=6, annotation_clip=True,
                arrowprops={"arrowstyle": "<->", "color": SHRUNKEN, "shrinkA": 0,
                            "shrinkB": 0})  # fmt: skip
    ax.annotate("$S_0$", (top[0], top[1]), xytext=(9.0 * inward[0], 9.0 * inward[1]), ha="center",
                va="center", textcoords="offset points", fontsize=9, color=SHRUNKEN,
                annotation_clip=True)  # fmt: skip


def _write(ax: Axes, text: str, place: FloatArray, offset: FloatArray) -> None:
    """Write a text at an offset [pt] from a place, with a white border."""
    from matplotlib.patheffects import withStroke

    ax.annotate(text, (place[0], place[1]), xytext=(offset[0], offset[1]), fontsize=9, color=INK,
                textcoords="offset points", ha="center", va="center", zorder=8,
                path_effects=[withStroke(linewidth=2.5, foreground="white")],
                annotation_clip=True)  # fmt: skip


def _keys(area: FeasibleArea) -> list[Any]:
    """Entries of the legend, for what is drawn."""
    from matplotlib.patches import Patch

    keys: list[Any] = []
    if len(area.triangle):
        keys.append(line_key("support polygon of " + ", ".join(area.support), TRIANGLE))
    if len(area.shrunken):
        whose = "" if area.margin_of == "body centre" else f", of the {area.margin_of}"
        keys.append(line_key(f"Area A: shrunken by $S_0$ = {1e3 * area.margin:g} mm{whose}",
                             SHRUNKEN, "--"))  # fmt: skip
    if len(area.held):
        keys.append(line_key("contact forces hold the true centre of mass", HELD, ":"))
    keys.append(line_key("Area B: reach of the legs", MUTED))
    if area.foothold is not None:
        keys.append(line_key(f"reach of {area.leg} to its next foothold",
                             LEG_COLOURS[area.leg], "--"))  # fmt: skip
        keys.append(dot_key(f"next foothold of {area.leg}", LEG_COLOURS[area.leg], fill="white"))
    if len(area.common):
        of = "A, B and forces" if len(area.held) else "A and B"
        keys.append(Patch(facecolor=COMMON, label=f"intersection of {of}"))
    keys.append(dot_key("O: COG before", INK, fill="white"))
    keys.append(dot_key("O': COG after", INK))
    if area.active:
        keys.append(line_key("bold: active constraint", INK, width=2.6))
    return keys
