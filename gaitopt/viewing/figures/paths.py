"""Figs. 3 and 11 of [Wang2020]: the columns, and the paths of feet and COG above them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, overload

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory
from gaitopt.terrain.footholds import Footholds
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    BESIDE,
    INK,
    NORMAL,
    SMALL,
    add_legend,
    dot_key,
    fit_limits,
    leg_keys,
    line_key,
    panel_height,
    plain,
    style_axes,
    style_space_axis,
    times_to_draw,
    true_proportions,
)
from gaitopt.viewing.figures.panels import Panels, new_figure, panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH = 9.0
"""Width of a figure [inch]."""
AZIMUTH, ELEVATION = -68, 22
"""Direction of the view in three dimensions [deg]."""
VIEW = np.array([[0.93, 0.37, 0.0], [0.14, 0.35, 0.93]])
"""Width and height in this view of unit lengths along x, y and z: absolute values of sines and
cosines of azimuth and elevation."""
STILL = 1e-6
"""Largest move of a standing foot between two samples [m]: its slip is smaller."""


def plot_terrain(footholds: Footholds, ax: Axes | None = None) -> Axes:
    """Plot the footholds from above in the legs' colours, columns in their true size.

    Source: Fig. 3 of [Wang2020]. Footholds on open ground are drawn as crosses.

    Args:
        footholds: any footholds.
        ax: where to draw; by default a new figure.

    Returns:
        The axes.
    """
    check_kind("footholds", footholds, Footholds)
    points = footholds.array.reshape(-1, 3)
    ax = panel(ax, WIDTH, panel_height(points, WIDTH - 2.0) + 0.9)
    _draw_footholds(ax, footholds, alpha=0.9)
    first = footholds.array[:, 0, :2]
    ax.plot(*first.T, "s", markerfacecolor="none", markeredgecolor=INK, markersize=13, zorder=4)
    for leg, place in zip(LEGS, first, strict=True):
        ax.annotate(leg, place, xytext=(0, 11), textcoords="offset points", fontsize=SMALL,
                    ha="center", color=INK)  # fmt: skip
    style_axes(ax, _terrain_title(footholds), "x [m]", "y [m]")
    fit_limits(ax, points, 0.08)
    true_proportions(ax)
    marker = "o" if footholds.radius else "x"
    keys = [*leg_keys(marker), dot_key("first footholds", INK, "s", "none")]
    add_legend(ax, keys, **BESIDE)
    return ax


def _terrain_title(footholds: Footholds) -> str:
    """Number of footholds, and size of columns."""
    counts = footholds.counts.values()
    most = len(footholds)
    count = f"{most} foothold{'s' * (most > 1)} for each leg, "
    if min(counts) < most:
        count = f"{min(counts)} to {most} footholds for each leg, "
    if footholds.ground is not None:
        return count + "height map"
    if footholds.radius is None:
        return count + "open ground"
    return count + f"columns of {2e3 * footholds.radius:g} mm diameter"


@overload
def plot_paths(plan: Plan, ax: None = None) -> Panels: ...
@overload
def plot_paths(plan: Plan, ax: Axes) -> Axes: ...
def plot_paths(plan: Plan, ax: Axes | None = None) -> Axes | Panels:
    """Plot the paths of the feet and the COG from above, and in three dimensions.

    Source: Fig. 11 of [Wang2020].

    Args:
        plan: any plan.
        ax: where to draw the view from above; by default a new figure with both views.

    Returns:
        ``ax``; or the two axes of the new figure: from above, and in three dimensions.
    """
    check_kind("plan", plan, Plan)
    walk = plan.at(times_to_draw(plan))
    places = (walk.feet.reshape(-1, 3), walk.cog, plan.footholds.array.reshape(-1, 3))
    points = np.concatenate(places)
    keys = [*(line_key(f"{leg} foot", colour) for leg, colour in LEG_COLOURS.items()),
            line_key("COG", INK), dot_key("start", INK, fill="white"),
            dot_key("end", INK)]  # fmt: skip
    if ax is not None:
        ax = panel(ax, 0.0, 0.0)
        _draw_top(ax, plan, walk, points)
        add_legend(ax, keys, **BESIDE)
        return ax
    # Placed by hand, as Matplotlib would make three-dimensional axes square.
    strip, space, feet = panel_height(points, WIDTH - 0.9), 3.3, 0.95
    height = feet + strip + 0.35 + space
    figure = new_figure(WIDTH, height, None)
    wide = (WIDTH - 0.9) / WIDTH
    low = figure.add_axes((0.75 / WIDTH, feet / height, wide, strip / height))
    high = figure.add_axes((0.0, 1.0 - space / height, 1.0, space / height), projection="3d")
    _draw_top(low, plan, walk, points)
    _draw_space(high, plan.footholds, walk, points)
    title = f"{plain(plan.robot.name)}: paths of the feet and the COG"
    figure.text(0.01, 1.0 - 0.1 / height, title, fontsize=NORMAL, color=INK, va="top")
    figure.legend(handles=keys, loc="lower center", ncols=7, fontsize=SMALL, frameon=False)
    return np.array([low, high], dtype=object)


def foot_path(walk: Trajectory, leg: int) -> FloatArray:
    """Places of a foot ``(n, 3)`` [m], without those samples at which it stands.

    ``leg`` is its index in ``LEGS``.
    """
    path = walk.feet[:, leg]
    moved = np.concatenate([[True], np.abs(np.diff(path, axis=0)).max(axis=1) > STILL])
    # The last sample before a swing belongs to the line, too.
    return np.asarray(path[moved | np.append(moved[1:], True)])


def _draw_top(ax: Axes, plan: Plan, walk: Trajectory, points: FloatArray) -> None:
    """Draw the paths from above, with limits around ``points (n, 3)``."""
    _draw_footholds(ax, plan.footholds, alpha=0.22)
    for i, leg in enumerate(LEGS):
        ax.plot(*foot_path(walk, i)[:, :2].T, color=LEG_COLOURS[leg], linewidth=1.2)
    ax.plot(*walk.cog[:, :2].T, color=INK, linewidth=1.2)
    _draw_ends(ax, walk.cog[:, :2])
    style_axes(ax, "From above", "x [m]", "y [m]")
    fit_limits(ax, points, 0.06)
    true_proportions(ax)


def _draw_space(ax: Any, footholds: Footholds, walk: Trajectory, points: FloatArray) -> None:
    """Draw the paths in three dimensions, with limits around ``points (n, 3)``."""
    # The drawing is wider than the square to which Matplotlib clips, so nothing is clipped.
    for i, leg in enumerate(LEGS):
        ax.plot(*foot_path(walk, i).T, color=LEG_COLOURS[leg], linewidth=1.0, clip_on=False)
        ax.plot(*footholds[leg].T, "o", color=LEG_COLOURS[leg], markersize=2, clip_on=False)
    ax.plot(*walk.cog.T, color=INK, linewidth=1.2, clip_on=False)
    _draw_ends(ax, walk.cog)
    low, high = points.min(axis=0) - 0.03, points.max(axis=0) + 0.03
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    span = high - low
    aspect = np.maximum(span, 0.16 * span.max())
    across, up = VIEW @ aspect / np.linalg.norm(aspect)
    ax.set_box_aspect(aspect, zoom=min(1.85 / across, 0.78 / up))
    ax.view_init(elev=ELEVATION, azim=AZIMUTH)
    for axis, name, pad in zip((ax.xaxis, ax.yaxis, ax.zaxis), "xyz", (6, 2, 0), strict=True):
        style_space_axis(axis, f"{name} [m]")
        axis.labelpad = pad
        axis.set_major_locator(
            _few_ticks(8 if name == "x" and span[0] > 2.0 * span[1:].max() else 3)
        )
    ax.tick_params(labelsize=SMALL - 1, pad=0)


def _few_ticks(count: int) -> Any:
    """A locator for at most ``count`` intervals."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(count)


def _draw_ends(ax: Any, line: FloatArray) -> None:
    """Mark start and end of a line ``(n, d)``."""
    for place, fill in ((line[0], "white"), (line[-1], INK)):
        ax.plot(*place[:, None], "o", markersize=5, markerfacecolor=fill, markeredgecolor=INK,
                clip_on=False, zorder=6)  # fmt: skip


def _draw_footholds(ax: Axes, footholds: Footholds, alpha: float) -> None:
    """Draw columns as discs in their true size; on open ground footholds are crosses."""
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
