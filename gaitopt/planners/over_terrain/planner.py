"""``plan_terrain`` and ``choose_footholds``: a walk over a height map to a goal."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import fields, replace
from functools import partial
from typing import Any

from numpy.typing import ArrayLike

from gaitopt.conventions import Progress
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.entering.ending import ended
from gaitopt.errors import InfeasibleStateError
from gaitopt.gait.crawl import WANG_SEQUENCE
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.base import FORCES, check_names
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.settings.over_footholds import force_margin
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.plan.state import State
from gaitopt.planners.crawl import plan_crawl
from gaitopt.planners.over_terrain.failure import no_way
from gaitopt.planners.over_terrain.from_state import pose_of, reached_from
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.links.plan_clearance import first_touching_step
from gaitopt.planners.over_terrain.planned_forces import usual_forces
from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import search_for
from gaitopt.planners.over_terrain.walks import Walks
from gaitopt.planners.over_terrain.ways.arrival import arrived
from gaitopt.planners.over_terrain.ways.kinds import ways_of
from gaitopt.planners.over_terrain.ways.treads import fitted_ways
from gaitopt.planners.over_terrain.ways.tries import Tries
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.height_map import HeightMap


def search_terrain(
    robot: Quadruped,
    ground: HeightMap,
    goal: ArrayLike,
    *,
    start: ArrayLike | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> TerrainSearch:
    """Search for footholds from a start to a goal on a height map.

    Args:
        robot: from :func:`gaitopt.load_robot`, with three joints on each leg.
        ground: the map.
        goal: a place ``(x, y)``, to which the robot faces as it goes; a pose ``(x, y, yaw)``; or
            several of either to go through [m, rad].
        start: pose of the body at the start ``(x, y, yaw)``; by default at x = y = 0 where the map
            has room for the robot there, else in the middle of the side of the map that is farthest
            from the goal; facing it.
        progress: called with (steps done, steps in all).
        options: fields of :class:`TerrainSettings` by name.

    Returns:
        What was found. Where the goal was not reached, ``complete`` is false, and the result tells
        how far the way got, and why not farther.

    Raises:
        InputError: start, goal or a setting is wrong, or there is no place for the feet at the
            start.
    """
    return _tries(robot, ground, goal, start, progress, options, None).result()


def _tries(
    robot: Quadruped, ground: HeightMap, goal: ArrayLike, start: ArrayLike | None,
    progress: Progress | None, options: Mapping[str, Any], forces: ForceLimits | None,
) -> Tries:  # fmt: skip
    """The searches of :func:`search_terrain`, for steps that these limits of forces allow."""
    began = time.perf_counter(), time.thread_time()
    settings = TerrainSettings.for_robot(robot, **options)
    search = search_for(robot, ground, goal, start, settings, forces)
    ways = ways_of(search.judge.settings, options)
    return Tries(search, ways, fitted_ways(search, options), progress, began)


def choose_footholds(
    robot: Quadruped,
    ground: HeightMap,
    goal: ArrayLike,
    *,
    start: ArrayLike | None = None,
    progress: Progress | None = None,
    **options: Any,
) -> Footholds:
    """Footholds for a walk from a start to a goal on a height map.

    They come with normals, friction, the order of the legs, the height of each swing, and the
    postures of the body, so that every planner of walks over footholds can go on with them.
    Arguments are those of :func:`search_terrain`.

    Raises:
        InputError: as for :func:`search_terrain`.
        TerrainError: no way was found; tells how far the search got and what was in the way.
    """
    search = search_terrain(robot, ground, goal, start=start, progress=progress, **options)
    if not search.complete:
        raise no_way(search)
    return search.footholds


def plan_terrain(
    robot: Quadruped,
    ground: HeightMap,
    goal: ArrayLike,
    *,
    start: ArrayLike | State | None = None,
    end: State | None = None,
    progress: Progress | None = None,
    search: TerrainSearch | None = None,
    **options: Any,
) -> Plan:
    """Plan a walk from a start to a goal on a height map.

    Footholds are searched for (:func:`search_terrain`), and the walk over them is planned
    (:func:`gaitopt.plan_crawl`). Limbs and trunk of the plan are looked at once more, all along its
    path. Where the planner refuses a step, or something touches the ground or another link, the
    search goes on without this step, for as long as ``longest_for_walks`` of
    :class:`TerrainSettings` says. Where no such walk is found, shorter steps are tried for half of
    this time in addition, and then the other ways of walking and the courses beside for as long
    again as this time. The walk that is planned when this time is over is ended.

    After the last step the body moves to the goal, or as near to it as its legs and the ground
    allow, while four feet stand. Plans without contact forces (``timing="velocity"``) end where
    the body was in the last swing.

    Args:
        robot, ground, goal: as for :func:`search_terrain`.
        start: as there; or the state in which the plan begins (:class:`gaitopt.State`). The way is
            then planned from where its body is, and feet that stand elsewhere than at the begin of
            the way first step there.
        end: the state in which the plan ends: at rest on the last footholds, with the body where it
            has it. The search chooses the footholds, so the same call without ``end`` tells them.
        progress: called with (steps found, steps in all) while the search goes on, and with (steps
            done, steps in all) while a walk is planned.
        search: a result of :func:`search_terrain` for the same arguments, to begin with.
        options: fields of :class:`TerrainSettings`, and others of :func:`gaitopt.plan_crawl`, by
            name. ``stability_margin`` goes to both. Where no ``forces`` are given, 85 % of the
            ground's ``friction`` may be used by the planned ones; the rest is for the controller.
            They are then handed over in 50 ms, with reserves of 3 and 2 % of the weight.

    Returns:
        The plan; its footholds carry the ground.

    Raises:
        InputError: start, goal or a setting is wrong.
        TerrainError: no way was found; tells how far the search got and what was in the way.
        InfeasibleStateError: no plan begins in ``start``, or ends in ``end``; tells which limit is
            in the way.
        SolverError: a solution failed the check of its residuals.
    """
    pose = pose_of(robot, start) if isinstance(start, State) else start
    way, searching = _walk(robot, ground, goal, pose, progress, search, options)
    if isinstance(start, State):
        way = _from_state(way, start, options.get("forces"))
    return arrived(way, searching) if end is None else _ended(way, end, searching.limbs)


def _walk(
    robot: Quadruped, ground: HeightMap, goal: ArrayLike, start: ArrayLike | None,
    progress: Progress | None, search: TerrainSearch | None, options: dict[str, Any],
) -> tuple[Plan, Search]:  # fmt: skip
    """The walk of :func:`plan_terrain` from a pose to its last step, and the search it is of."""
    check_names(
        TerrainSettings,
        options,
        *(f.name for k in (CrawlSettings, RouteSettings) for f in fields(k)),
    )
    asked = _of_search(options)
    further = {name: value for name, value in options.items() if name not in asked}
    if further.get("forces") is not None:
        check_kind("forces", further["forces"], ForceLimits)
    forces, tries = further.get("forces"), None
    if search is None:
        tries = _tries(robot, ground, goal, start, progress, asked, forces)
        search = tries.result()
    if search.settings.stability_margin != force_margin(robot):
        further["stability_margin"] = search.settings.stability_margin
    if _by_usual_forces(further):
        further["forces"] = usual_forces(search.settings.friction)
    if not search.complete:
        raise no_way(search)
    if tries is not None:
        return Walks(tries.search, further, asked, progress).first_of(search, lambda: tries)
    searching = search_for(robot, ground, goal, start, search.settings, further.get("forces"))
    anew = partial(_tries, robot, ground, goal, start, progress, asked, forces)
    return Walks(searching, further, asked, progress).first_of(search, anew)


def _by_usual_forces(further: Mapping[str, Any]) -> bool:
    """Whether options of :func:`gaitopt.plan_crawl` leave the limits of forces to the terrain.

    The objective ``"margin"`` has careful ones of its own.
    """
    by_forces = further.get("timing") in (None, FORCES)
    return by_forces and further.get("forces") is None and further.get("objective") != "margin"


def _of_search(options: dict[str, Any]) -> dict[str, Any]:
    """The options that are fields of :class:`TerrainSettings`."""
    own = {f.name for f in fields(TerrainSettings)}
    return {name: value for name, value in options.items() if name in own}


def _ended(way: Plan, end: State, limbs: Limbs) -> Plan:
    """The walk of a plan over a map that ends in a state.

    Args:
        way: the walk.
        end: the state.
        limbs: of the robot over the map.

    Raises:
        InfeasibleStateError: the state is not possible, or limbs touch something on the way there.
    """
    plan = ended(way, end)
    if first_touching_step(plan, limbs) is not None:
        raise InfeasibleStateError(
            "end: on the way there a limb touches the ground or another link; end higher, or "
            "nearer to where the walk ends",
            "clearance", 0.0, 0.0, "m", way.duration,
        )  # fmt: skip
    return plan


def _from_state(way: Plan, start: State, forces: ForceLimits | None) -> Plan:
    """The walk of a plan over a map that begins in a state; errors are those of the planner."""
    settings = way.settings
    assert isinstance(settings, (CrawlSettings, RouteSettings))
    if forces is None and settings.forces is not None:
        # With two feet in the air the way from the state to the walk can hardly keep one.
        settings = replace(settings, forces=replace(settings.forces, transfer_time=0.0))
    over = reached_from(way.robot, start, way.footholds, settings.swing_height)
    # The order is that of the footholds.
    open_order = replace(settings, sequence=WANG_SEQUENCE)
    return plan_crawl(way.robot, over, open_order, start=start)
