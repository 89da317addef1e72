"""Feet and ground from the side: how high each foot is over the ground along its way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.conventions import FloatArray, leg_index
from gaitopt.errors import InputError
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory
from gaitopt.terrain.height_map import HeightMap
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    INK,
    dot_key,
    line_key,
    plain,
    style_axes,
    times_to_draw,
)
from gaitopt.viewing.figures.map_layers import patch_key
from gaitopt.viewing.figures.panels import Panels, legend_below, panels
from gaitopt.viewing.figures.terrain_map import MOST_NUMBERS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH, PANEL = 10.0, 1.55
"""Width of the figure, and height of the panel of a leg [inch]."""
SOIL, EDGE = "#e4ded1", "#8a8375"
ROOM = 1.25
"""Height of a panel, as a multiple of what is drawn."""
LEAST = 0.08
"""Least height of a panel [m]. Chosen: level ground does not look like mountains."""


def plot_terrain_profile(plan: Plan, axes: Sequence[Axes] | Panels | None = None) -> Panels:
    """Plot for each leg the height of its foot, and of the ground straight below, along its way.

    The line is the lowest point of the foot's ball. Dots are the points in which standing feet
    touch the ground, with the numbers of the steps that lead there.

    Args:
        plan: a plan over a height map.
        axes: where to draw ``(4,)``; by default a new figure.

    Returns:
        The axes ``(4,)``, one for each leg in the order of the legend of other figures.

    Raises:
        InputError: the plan has no height map, or the axes have another shape.
    """
    check_kind("plan", plan, Plan)
    ground = plan.footholds.ground
    if ground is None:
        raise InputError(
            "the plan's footholds have no height map; plot_paths draws the paths of the feet, or "
            "give them a map: footholds.with_(ground=...)"
        )
    count = len(LEG_COLOURS)
    drawn = panels(axes, (count,), WIDTH, 0.8 + PANEL * count, sharex=True, sharey=True)
    walk = plan.at(times_to_draw(plan))
    for i, (leg, ax) in enumerate(zip(LEG_COLOURS, drawn, strict=True)):
        _draw_leg(ax, plan, ground, leg, walk)
        last = i == count - 1
        title = f"{plain(plan.robot.name)}: feet over the ground" if i == 0 else ""
        style_axes(ax, title, "way of the foot [m]" if last else "", f"{leg}\nheight [m]")
    _fit(drawn)
    keys = [line_key("lowest point of the foot", INK), patch_key("ground below it", SOIL),
            dot_key("foothold, with its step", INK)]  # fmt: skip
    legend_below(drawn, keys, own=axes is None, ncols=3)
    return drawn


def _draw_leg(ax: Axes, plan: Plan, ground: HeightMap, leg: str, walk: Trajectory) -> None:
    """Draw the way of a foot, its footholds, and the ground below."""
    colour, radius = LEG_COLOURS[leg], plan.robot.foot_radius
    path = walk.feet[:, leg_index(leg)]
    along = _lengths(path)
    ax.plot(along, path[:, 2] - radius, color=colour, linewidth=1.4, zorder=4, gid="foot")
    fine = _between(path, ground.resolution / 2.0)
    z = ground.height(fine[:, :2])
    below, known = ground.height_range[0] - 1.0, np.isfinite(z)
    ax.fill_between(_lengths(fine), below, np.where(known, z, below), where=known,
                    color=SOIL, linewidth=0, zorder=1)  # fmt: skip
    ax.plot(_lengths(fine), z, color=EDGE, linewidth=0.9, zorder=2, gid="ground")
    count = plan.footholds.counts[leg]
    touches = plan.footholds.touching(radius)[leg_index(leg), :count]
    swings = [swing for swing in plan.swings if swing.leg == leg]
    places = np.interp([0.0, *(swing.end for swing in swings)], walk.t, along)
    ax.plot(
        places,
        touches[: len(places), 2],
        "o",
        color=colour,
        markersize=4,
        zorder=5,
        gid="footholds",
    )
    for swing in swings if len(plan.swings) <= MOST_NUMBERS else ():
        number, landing = swing.step + 1, swing.index + 1
        ax.annotate(str(number), (places[landing], touches[landing, 2]), xytext=(0, -5),
                    textcoords="offset points", ha="center", va="top", fontsize=5.5, color=INK,
                    zorder=6, gid=f"step {number}")  # fmt: skip


def _lengths(path: FloatArray) -> FloatArray:
    """Distance along a path ``(n, 3)``, seen from above ``(n,)`` [m]."""
    steps = np.linalg.norm(np.diff(path[:, :2], axis=0), axis=1)
    return np.concatenate([[0.0], np.cumsum(steps)])


def _between(path: FloatArray, apart: float) -> FloatArray:
    """The same path ``(m, 3)`` with points at most ``apart`` [m] from each other."""
    along = _lengths(path)
    if along[-1] <= 0.0:
        return path[:1]
    count = max(int(np.ceil(along[-1] / apart)), 1)
    at = np.union1d(along, np.linspace(0.0, along[-1], count + 1))
    return np.column_stack([np.interp(at, along, column) for column in path.T])


def _fit(drawn: Panels) -> None:
    """Limits of the panels around feet and ground, not below what is drawn."""
    heights = [line.get_ydata() for ax in drawn for line in ax.lines]
    every = np.concatenate([np.asarray(h, dtype=np.float64) for h in heights])
    low, high = float(np.nanmin(every)), float(np.nanmax(every))
    span = max(ROOM * (high - low), LEAST)
    for ax in drawn:
        ax.set_ylim(low - 0.18 * span, low + span)
        ax.margins(x=0.01)
