"""Figs. 3 and 11 of [Wang2020]: the columns, and the paths of feet and COG over them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan, Trajectory
from gaitopt.terrain.footholds import Footholds
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    INK,
    NORMAL,
    SMALL,
    add_legend,
    dot_key,
    dress,
    fit,
    leg_keys,
    line_key,
    new_figure,
    panel,
    strip_height,
    true_proportions,
    walk_times,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 9.0
# Width and height that a box of unit sides takes in the view from azimuth -68 and elevation 22.
VIEW = np.array([[0.93, 0.37, 0.0], [0.14, 0.35, 0.93]])


def plot_terrain(footholds: Footholds, ax: Axes | None = None) -> Figure:
    """The footholds seen from above, columns in their true size, in the legs' colours.

    Source: Fig. 3 of [Wang2020]. Footholds on open ground are drawn as crosses.

    Args:
        footholds: any footholds.
        ax: where to draw; by default a new figure.
    """
    points = footholds.array.reshape(-1, 3)
    figure, ax = panel(ax, WIDTH, strip_height(points, WIDTH - 2.0) + 0.9)
    _draw_footholds(ax, footholds, alpha=0.9)
    first = footholds.array[:, 0, :2]
    ax.plot(*first.T, "s", markerfacecolor="none", markeredgecolor=INK, markersize=13, zorder=4)
    for leg, place in zip(LEGS, first, strict=True):
        ax.annotate(leg, place, xytext=(0, 11), textcoords="offset points", fontsize=SMALL,
                    ha="center", color=INK)  # fmt: skip
    dress(ax, _terrain_title(footholds), "x [m]", "y [m]")
    fit(ax, points, 0.08)
    true_proportions(ax)
    marker = "o" if footholds.radius else "x"
    keys = [*leg_keys(marker), dot_key("first footholds", INK, "s", "none")]
    add_legend(ax, keys, loc="center left", bbox_to_anchor=(1.01, 0.5))
    return figure


def _terrain_title(footholds: Footholds) -> str:
    count = f"{len(footholds)} foothold{'s' * (len(footholds) > 1)} for each leg, "
    if footholds.radius is None:
        return count + "open ground"
    return count + f"columns of {2e3 * footholds.radius:g} mm diameter"


def plot_paths(plan: Plan, ax: Axes | None = None) -> Figure:
    """Paths of the feet and the COG, from the side and from above.

    Source: Fig. 11 of [Wang2020].

    Args:
        plan: any plan.
        ax: where to draw the view from above; by default a new figure with a view in three
            dimensions over it.
    """
    walk = plan.at(walk_times(plan))
    places = (walk.feet.reshape(-1, 3), walk.cog, plan.footholds.array.reshape(-1, 3))
    points = np.concatenate(places)
    keys = [*(line_key(f"{leg} foot", colour) for leg, colour in LEG_COLOURS.items()),
            line_key("COG", INK), dot_key("start", INK, fill="white"),
            dot_key("end", INK)]  # fmt: skip
    if ax is not None:
        figure, ax = panel(ax, 0.0, 0.0)
        _draw_top(ax, plan, walk, points)
        add_legend(ax, keys, loc="center left", bbox_to_anchor=(1.01, 0.5))
        return figure
    # Laid out by hand: three-dimensional axes are square to Matplotlib, and would waste the room.
    strip, space, feet = strip_height(points, WIDTH - 0.9), 3.3, 0.95
    height = feet + strip + 0.35 + space
    figure = new_figure(WIDTH, height, None)
    wide = (WIDTH - 0.9) / WIDTH
    low = figure.add_axes((0.75 / WIDTH, feet / height, wide, strip / height))
    high = figure.add_axes((0.0, 1.0 - space / height, 1.0, space / height), projection="3d")
    _draw_top(low, plan, walk, points)
    _draw_space(high, plan.footholds, walk, points)
    title = f"{plan.robot.name}: paths of the feet and the COG"
    figure.text(0.01, 1.0 - 0.1 / height, title, fontsize=NORMAL, color=INK, va="top")
    figure.legend(handles=keys, loc="lower center", ncols=7, fontsize=SMALL, frameon=False)
    return figure


def flown(walk: Trajectory, leg: int) -> FloatArray:
    """Where a foot has been ``(n, 3)`` [m], without the samples in which it stood still."""
    path = walk.feet[:, leg]
    moved = np.concatenate([[True], np.abs(np.diff(path, axis=0)).max(axis=1) > 1e-6])
    # The last sample at rest before a flight belongs to the line as well.
    return np.asarray(path[moved | np.append(moved[1:], True)])


def _draw_top(ax: Axes, plan: Plan, walk: Trajectory, points: FloatArray) -> None:
    _draw_footholds(ax, plan.footholds, alpha=0.22)
    for i, leg in enumerate(LEGS):
        ax.plot(*flown(walk, i)[:, :2].T, color=LEG_COLOURS[leg], linewidth=1.2)
    ax.plot(*walk.cog[:, :2].T, color=INK, linewidth=1.2)
    _draw_ends(ax, walk.cog[:, :2])
    dress(ax, "From above", "x [m]", "y [m]")
    fit(ax, points, 0.06)
    true_proportions(ax)


def _draw_space(ax: Any, footholds: Footholds, walk: Trajectory, points: FloatArray) -> None:
    # The box is wider than the square that Matplotlib clips to: nothing may be clipped.
    for i, leg in enumerate(LEGS):
        ax.plot(*flown(walk, i).T, color=LEG_COLOURS[leg], linewidth=1.0, clip_on=False)
        ax.plot(*footholds[leg].T, "o", color=LEG_COLOURS[leg], markersize=2, clip_on=False)
    ax.plot(*walk.cog.T, color=INK, linewidth=1.2, clip_on=False)
    _draw_ends(ax, walk.cog)
    low, high = points.min(axis=0) - 0.03, points.max(axis=0) + 0.03
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    span = high - low
    aspect = np.maximum(span, 0.16 * span.max())
    across, up = VIEW @ aspect / np.linalg.norm(aspect)
    ax.set_box_aspect(aspect, zoom=min(1.85 / across, 0.78 / up))
    ax.view_init(elev=22, azim=-68)
    for axis, name, pad in zip((ax.xaxis, ax.yaxis, ax.zaxis), "xyz", (6, 2, 0), strict=True):
        axis.set_label_text(f"{name} [m]", fontsize=SMALL)
        axis.labelpad = pad
        axis.set_major_locator(
            _few_ticks(8 if name == "x" and span[0] > 2.0 * span[1:].max() else 3)
        )
        axis.pane.set_facecolor("white")
        # Matplotlib has no public way to the grid of three-dimensional axes.
        axis._axinfo["grid"].update(color="#e6e6e6", linewidth=0.5)
    ax.tick_params(labelsize=SMALL - 1, pad=0)


def _few_ticks(count: int) -> Any:
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(count)


def _draw_ends(ax: Any, line: FloatArray) -> None:
    for place, fill in ((line[0], "white"), (line[-1], INK)):
        ax.plot(*place[:, None], "o", markersize=5, markerfacecolor=fill, markeredgecolor=INK,
                clip_on=False, zorder=6)  # fmt: skip


def _draw_footholds(ax: Axes, footholds: Footholds, alpha: float) -> None:
    """Discs of the columns' size, or crosses on open ground, one collection a leg."""
    from matplotlib.collections import EllipseCollection

    for leg, colour in LEG_COLOURS.items():
        places = footholds[leg][:, :2]
        if footholds.radius is None:
            ax.plot(*places.T, "x", markersize=5, color=colour, alpha=alpha, gid=leg)
            continue
        size = np.full(len(places), 2.0 * footholds.radius)
        discs = EllipseCollection(
            size, size, np.zeros(len(places)), units="xy", offsets=places,
            offset_transform=ax.transData, facecolor=colour, linewidth=0.0,
            alpha=alpha,
        )  # fmt: skip
        discs.set_gid(leg)
        ax.add_collection(discs)
