"""A height map from above: footholds in the order of the steps, paths, and what a search tried."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.plan.com_margin import true_com
from gaitopt.plan.plan import Plan
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.height_map import HeightMap
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    BESIDE,
    INK,
    SMALL,
    add_legend,
    dot_key,
    leg_keys,
    line_key,
    plain,
    style_axes,
    times_to_draw,
)
from gaitopt.viewing.figures.map_layers import Limits, draw_heights, draw_refused
from gaitopt.viewing.figures.panels import figure_of, panel
from gaitopt.viewing.ground_search import GroundSearch

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH = 10.0
"""Width of the figure [inch]."""
TALLEST = 9.0
"""Largest height of the figure [inch]."""
COLUMNS = 4
"""Columns of the legend below the map."""
AROUND = 0.5
"""How far around the walk the map is drawn [m]; a smaller map is drawn as a whole."""
MOST_NUMBERS = 80
"""Most steps whose numbers are all written; of more, only each fifth, tenth and so on are."""
SHORTEST = 1e-3
"""Shortest step that has an arrow [m]."""
COM_TIMES = 600
"""Instants of the line of the true centre of mass. Chosen: more than can be seen."""
MOST_CAUSES = 3
"""Causes that are written, those that refused most."""
TRIED = "#c2410c"
"""Colour of what a search tried, and of the way that it was asked for; as in replays."""


def plot_terrain_map(
    shown: HeightMap | Plan | GroundSearch,
    ax: Axes | None = None,
    *,
    search: GroundSearch | None = None,
) -> Axes:
    """Plot a height map from above, with what walks on it.

    Of a plan: the footholds in the colours of the legs with the numbers of their steps, an arrow
    for each swing, and the paths of body centre and true centre of mass. Of a search: the
    footholds that it found, all places that it tried, the way that it was asked for, and in colours
    where no foot may stand and why; if it did not reach its goal, also how far it got, and how many
    steps were refused for what. Unknown ground is hatched.

    Args:
        shown: a height map, a plan over one, or a search (:func:`gaitopt.search_terrain`).
        ax: where to draw; by default a new figure.
        search: for the footholds of the plan; what it tried is drawn below the plan.

    Returns:
        The axes of the map.

    Raises:
        InputError: there is nothing of the kind, or the plan has no height map.
    """
    plan = shown if isinstance(shown, Plan) else None
    if plan is None and search is None and not isinstance(shown, HeightMap):
        search = _checked(shown)
    ground = _ground(shown, search)
    limits = _limits(ground, plan, search)
    own = ax is None
    ax = panel(ax, WIDTH, _height(limits))
    keys = draw_heights(ax, ground, limits)
    if search is not None:
        keys += _draw_search(ax, search, limits, whole=plan is None)
    walk = plan or search
    if walk is not None:
        _draw_steps(ax, walk.footholds, order_of(walk.footholds, plan))
        keys = [*leg_keys(), dot_key("first footholds", INK, "s", "none"), *keys]
    if plan is not None:
        keys += _draw_paths(ax, plan)
    style_axes(ax, _title(ground, plan, search), "x [m]", "y [m]", grid=False)
    ax.set(xlim=limits[0], ylim=limits[1], aspect="equal")
    if not own:
        add_legend(ax, keys, **BESIDE)
    else:
        rows, figure = -(-len(keys) // COLUMNS), figure_of(ax)
        # Else the layout cuts off the upper side of the title.
        figure.get_layout_engine().set(h_pad=0.12)  # type: ignore[union-attr, call-arg]
        figure.set_size_inches(WIDTH, _height(limits) + 0.19 * rows)
        figure.legend(handles=keys, loc="outside lower left", ncols=COLUMNS, fontsize=SMALL,
                      frameon=False, columnspacing=1.5, handlelength=1.8)  # fmt: skip
    return ax


def order_of(footholds: Footholds, plan: Plan | None = None) -> list[tuple[str, int]]:
    """The steps of a walk: the leg, and the index of the foothold that it leaves.

    Without a plan they are in the order of the footholds; without an order there are none.
    """
    if plan is not None:
        return [(swing.leg, swing.index) for swing in plan.swings]
    made = dict.fromkeys(LEGS, 0)
    steps = []
    for leg in footholds.order or ():
        steps.append((leg, made[leg]))
        made[leg] += 1
    return steps


def walked(search: GroundSearch) -> float:
    """How far along the way that was asked for the feet got [m], by the middle of the last ones."""
    way = np.asarray(search.course.poses, dtype=np.float64)[:, :2]
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
    middle = search.footholds.array[:, -1, :2].mean(axis=0)
    return float(length[np.argmin(np.linalg.norm(way - middle, axis=1))])


def _checked(shown: Any) -> GroundSearch:
    """A search.

    Raises:
        InputError: it is something else.
    """
    if not all(hasattr(shown, name) for name in ("layers", "tried", "course", "footholds")):
        raise InputError(
            f"a map can be drawn of a HeightMap, a Plan or a search for footholds, got "
            f"{type(shown).__name__}; make one with gaitopt.make_ground or gaitopt.plan_terrain"
        )
    search: GroundSearch = shown
    return search


def _ground(shown: Any, search: GroundSearch | None) -> HeightMap:
    """The map below what is shown.

    Raises:
        InputError: the plan has none.
    """
    if isinstance(shown, HeightMap):
        return shown
    found = shown.footholds.ground if isinstance(shown, Plan) else None
    if found is None and search is not None:
        found = search.layers.ground
    if found is None:
        raise InputError(
            "the plan's footholds have no height map; draw them with plot_terrain, or give them "
            "one: footholds.with_(ground=...)"
        )
    return found


def _limits(ground: HeightMap, plan: Plan | None, search: GroundSearch | None) -> Limits:
    """The part of the map that is drawn: around walk and way."""
    places = []
    if plan is not None:
        places += [*plan.footholds.points.values(), plan.path.knots()]
    if search is not None:
        places += [*search.footholds.points.values(), np.asarray(search.course.poses)]
    if not places:
        return ground.extent
    every = np.concatenate([p[:, :2] for p in places])
    low, high = every.min(axis=0) - AROUND, every.max(axis=0) + AROUND
    (x0, x1), (y0, y1) = ground.extent
    x = max(x0, float(low[0])), min(x1, float(high[0]))
    y = max(y0, float(low[1])), min(y1, float(high[1]))
    # Where the walk is beside the map, the whole map is drawn.
    return (x, y) if x[0] < x[1] and y[0] < y[1] else ground.extent


def _height(limits: Limits) -> float:
    """Height of a figure without its legend [inch]: true proportions, beside a colour bar."""
    (x0, x1), (y0, y1) = limits
    return float(np.clip((WIDTH - 1.9) * (y1 - y0) / (x1 - x0) + 0.8, 2.0, TALLEST))


def _draw_search(ax: Axes, search: GroundSearch, limits: Limits, *, whole: bool) -> list[Any]:
    """Draw what a search tried; as a ``whole`` also where no foot may stand, and how far it got."""
    keys = draw_refused(ax, search.layers, limits) if whole else []
    tried = np.asarray(search.tried, dtype=np.float64).reshape(-1, 3)
    ax.plot(*tried[:, :2].T, ".", color=TRIED, markersize=1.6, alpha=0.7, zorder=2.5, gid="tried")
    way = np.asarray(search.course.poses, dtype=np.float64)[:, :2]
    ax.plot(*way.T, "--", color=TRIED, linewidth=1.2, zorder=2.6, gid="way")
    ax.plot(*way[-1], "*", color=TRIED, markersize=12, zorder=6, gid="goal")
    keys += [dot_key(f"{len(tried)} places tried", TRIED, "."),
             line_key("way asked for", TRIED, "--"), dot_key("goal", TRIED, "*")]  # fmt: skip
    if search.complete or not whole:
        return keys
    last = search.footholds.array[:, -1, :2]
    around = last[[LEGS.index(leg) for leg in ("LF", "LH", "RH", "RF")]]
    ax.fill(*around.T, facecolor="none", edgecolor=INK, linewidth=1.6, zorder=5, gid="last")
    keys.append(line_key("feet where the search ended", INK, width=1.6))
    return keys


def _draw_steps(ax: Axes, footholds: Footholds, steps: list[tuple[str, int]]) -> None:
    """Draw footholds, an arrow for each swing, and the number of each step beside its foothold."""
    for leg in LEGS:
        places = footholds[leg][:, :2]
        ax.plot(*places.T, "o", color=LEG_COLOURS[leg], markersize=4.5, markeredgecolor="white",
                markeredgewidth=0.5, zorder=5, gid=f"footholds {leg}")  # fmt: skip
        ax.plot(*places[0], "s", markerfacecolor="none", markeredgecolor=INK, markersize=10,
                zorder=4)  # fmt: skip
        ax.annotate(leg, places[0], xytext=(0, 9), textcoords="offset points", fontsize=SMALL,
                    ha="center", color=INK, zorder=7)  # fmt: skip
    every = 1 if len(steps) <= MOST_NUMBERS else 5 * int(np.ceil(len(steps) / MOST_NUMBERS / 5))
    for number, (leg, index) in enumerate(steps, 1):
        start, end = footholds[leg][index, :2], footholds[leg][index + 1, :2]
        if np.linalg.norm(end - start) > SHORTEST:
            _draw_swing(ax, start, end, leg)
        if number % every == 0:
            # Numbers of fore and hind legs on one side do not hide each other.
            aside = 5 if leg in ("LF", "RH") else -5
            ax.annotate(str(number), (end[0], end[1]), xytext=(0, aside), fontsize=5.5,
                        textcoords="offset points", ha="center", color=INK, zorder=7,
                        va="bottom" if aside > 0 else "top", gid=f"step {number}")  # fmt: skip


def _draw_swing(ax: Axes, start: FloatArray, end: FloatArray, leg: str) -> None:
    """Draw an arrow from foothold to foothold ``(2,)``, bent away from the body."""
    from matplotlib.patches import FancyArrowPatch

    bend = -0.25 if leg.startswith("L") else 0.25
    arrow = FancyArrowPatch(
        (start[0], start[1]), (end[0], end[1]), arrowstyle="-|>", mutation_scale=6,
        connectionstyle=f"arc3,rad={bend}", color=LEG_COLOURS[leg], linewidth=0.9, shrinkA=2,
        shrinkB=2.5, zorder=4.5,
    )  # fmt: skip
    arrow.set_gid("swing")
    ax.add_patch(arrow)


def _draw_paths(ax: Axes, plan: Plan) -> list[Any]:
    """Draw the paths of the body centre and of the true centre of mass."""
    walk = plan.at(times_to_draw(plan))
    ax.plot(*walk.cog[:, :2].T, color=INK, linewidth=1.2, zorder=3.5, gid="cog")
    keys = [line_key("body centre", INK)]
    if plan.robot.mass > 0:
        few = plan.at(np.linspace(0.0, plan.duration, COM_TIMES))
        com = true_com(plan.robot, few.q)[:, :2]
        ax.plot(*com.T, ":", color=INK, linewidth=1.0, zorder=3.4, gid="com")
        keys.append(line_key("true centre of mass", INK, ":"))
    return keys


def _title(ground: HeightMap, plan: Plan | None, search: GroundSearch | None) -> str:
    """What is shown, and how far a search got."""
    if plan is not None:
        return f"{plain(plan.robot.name)}: {plan.footholds.steps} steps in {plan.duration:.1f} s"
    if search is None:
        nx, ny = ground.shape
        return f"{nx} x {ny} points every {1e3 * ground.resolution:.3g} mm"
    way = np.asarray(search.course.poses, dtype=np.float64)[:, :2]
    length = float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())
    if search.complete:
        return f"Footholds to the goal: {search.footholds.steps} steps over {length:.2f} m"
    title = (
        f"Goal not reached: {search.footholds.steps} steps, {walked(search):.2f} m of "
        f"{length:.2f} m"
    )
    causes = sorted(((n, str(cause)) for cause, n in search.refused.items() if n), reverse=True)
    if not causes:
        return title
    # A line each: a figure is as wide as its longest line.
    told = (f"{count} because {cause}" for count, cause in causes[:MOST_CAUSES])
    return "\n".join([f"{title}; tries of the next step that were refused:", *told])
