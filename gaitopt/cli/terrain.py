"""The command ``gaitopt terrain``: a walk over a map, from the file to the replay."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from gaitopt.cli.completion import complete_ground
from gaitopt.cli.ground_options import GroundChoice, ground_options, is_made
from gaitopt.cli.grouped_options import numbers, takes_options
from gaitopt.cli.options import (
    CollisionsOption,
    Objective,
    ObjectiveOption,
    SpeedOption,
    Timing,
    TimingOption,
)
from gaitopt.cli.results.deliver import PLAN, Delivery, deliver
from gaitopt.cli.results.options import Results, result_options
from gaitopt.cli.results.report import Report
from gaitopt.cli.results.run_folder import RunFolder, record_run, run_folder
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.search_options import in_search_options, search_options
from gaitopt.cli.support import file_name, parse_speed, progress_bar, summarise
from gaitopt.errors import InputError, TerrainError

if TYPE_CHECKING:
    from gaitopt.plan.plan import Plan
    from gaitopt.planners.over_terrain.result import TerrainSearch
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.terrain.height_map import HeightMap

WAY = "What walks where"

MapArgument = Annotated[
    str,
    typer.Argument(
        help="A map: PNG, NumPy file, GeoTIFF, mesh, cloud of points or bag of ROS; or the name of "
        "ground that is made: flat, rubble, stepping_stones, stairs, stairs_up, stairs_down, ramp, "
        "gaps, hills or beams.",
        metavar="MAP",
        autocompletion=complete_ground,
    ),
]
GoalOption = Annotated[
    str | None,
    typer.Option(help="Where to go, in metres, and with a third number the direction to face "
                 "there, in radians. Without it the middle of the far side of the map.",
                 metavar="X,Y[,YAW]", rich_help_panel=WAY),
]  # fmt: skip
WaypointOption = Annotated[
    list[str] | None,
    typer.Option(help="A place to go through on the way; may be given more than once.",
                 metavar="X,Y[,YAW]", rich_help_panel=WAY),
]  # fmt: skip
StartOption = Annotated[
    str | None,
    typer.Option(help="Where the body is at the start, and the direction that it faces. Without it "
                 "0,0 where the map has room for the robot there, else the middle of the side of "
                 "the map that is farthest from the goal; facing the goal.", metavar="X,Y,YAW",
                 rich_help_panel=WAY),
]  # fmt: skip
PAGE, MAP, FOOTHOLDS = "replay.html", "map.png", "footholds.csv"
"""Names of the files that are written, beside the plan."""
SHORT = 0.2
"""Length up to which the time of a search is not told for each metre: turns on the spot [m]."""
BESIDE = 5e-3
"""Distance from the goal from which on the command tells of it [m]."""


@takes_robot("wang2020")
@takes_options("results", result_options)
@takes_options("settings", search_options)
@takes_options("ground", ground_options)
def terrain(
    where: MapArgument,
    robot: RobotChoice,
    ground: GroundChoice,
    settings: dict[str, Any],
    results: Results,
    goal: GoalOption = None,
    waypoint: WaypointOption = None,
    start: StartOption = None,
    objective: ObjectiveOption = Objective.distance,
    speed: SpeedOption = "max",
    timing: TimingOption = Timing.forces,
    collisions: CollisionsOption = True,
) -> None:
    """Walk over a map: search for footholds, plan, certify, and write replay and figure.

    Exit code 0 when the walk is certified (and passes in physics, with --simulate); 1 when a
    promise is violated or physics fails; 3 when not all could be checked; 2 when there is no way.
    """
    model = robot.load()
    surface = ground.load(where, model)
    begin, places = _way(model, surface, is_made(where), ground, start, waypoint, goal)
    report = Report(results.as_json, {"command": "terrain"})
    run = f"terrain-{file_name(model.name) or 'robot'}-{file_name(Path(where).stem) or 'map'}"
    folder = run_folder(results.out, run, results.overwrite, (PAGE, PLAN, MAP, FOOTHOLDS))
    how = {"objective": objective.value, "speed": parse_speed(speed), "timing": timing.value}
    try:
        search, plan, seconds = _planned(model, surface, places, begin, settings, how)
    except TerrainError as error:
        _explain(error, folder, report)
        if error.search.footholds.steps:
            _tell_edges(model, surface, {"start": begin, "goal": places[-1]}, report)
        report.end()
        told = in_search_options(error.message)
        raise TerrainError(told, error.step, error.leg, error.refused, error.search) from error
    except InputError as error:
        raise InputError(in_search_options(str(error))) from error
    report.add(search={"seconds": seconds, "metres": search.metres, "tried": len(search.tried)})
    raise typer.Exit(deliver(_delivery(plan, search, collisions, seconds), folder, results, report))


def _way(
    robot: Quadruped, ground: HeightMap, made: bool, choice: GroundChoice,
    start: str | None, waypoints: list[str] | None, goal: str | None,
) -> tuple[tuple[float, ...], list[tuple[float, ...]]]:  # fmt: skip
    """The pose at the start, and the places to go through with the goal as the last.

    Raises:
        InputError: an option is no place, some have a direction and others none, or one is off the
            map.
    """
    from gaitopt.planners.over_terrain.setup import default_start, side_pose

    places = [numbers("--waypoint", text, 2, 3) for text in waypoints or []]
    begin = None if start is None else numbers("--start", start, 3)
    if goal is not None:
        places.append(numbers("--goal", goal, 2, 3))
    elif made:
        places.append((choice.making.get("length", 3.0), 0.0))
    else:
        # The far side as seen from the start; without one, that at the highest x.
        (_, x1), (y0, y1) = ground.extent
        begin = begin or tuple(side_pose(robot, ground, (x1, (y0 + y1) / 2.0)).tolist())
        places.append(tuple(side_pose(robot, ground, begin[:2])[:2].tolist()))
    if len({len(place) for place in places}) > 1:
        raise InputError("give --goal and all --waypoint with YAW, or all without it")
    if begin is None:
        begin = tuple(default_start(robot, ground, places[0]).tolist())
    for name, place in (("start", begin), *(("goal or waypoint", p) for p in places)):
        _check_on_map(name, place, ground)
    return begin, places


def _check_on_map(name: str, place: tuple[float, ...], ground: HeightMap) -> None:
    (x0, x1), (y0, y1) = ground.extent
    if not (x0 <= place[0] <= x1 and y0 <= place[1] <= y1):
        raise InputError(
            f"the {name} at x = {place[0]:g} m, y = {place[1]:g} m is off the map, which reaches "
            f"from x = {x0:g} to {x1:g} m and from y = {y0:g} to {y1:g} m; --origin moves a map"
        )


def _planned(
    robot: Quadruped, ground: HeightMap, places: list[tuple[float, ...]],
    begin: tuple[float, ...], settings: dict[str, Any], how: dict[str, Any],
) -> tuple[TerrainSearch, Plan, dict[str, float]]:  # fmt: skip
    """The search, the plan over its footholds, and how long both took [s].

    Raises:
        TerrainError: no way was found.
    """
    from gaitopt.planners.over_terrain.planner import plan_terrain, search_terrain

    clock = time.perf_counter()
    with progress_bar("searching for footholds") as tick:
        search = search_terrain(robot, ground, places, start=begin, progress=tick, **settings)
    searched = time.perf_counter()
    with progress_bar("planning") as tick:
        plan = plan_terrain(
            robot, ground, places, start=begin, search=search, progress=tick, **settings, **how
        )
    return search, plan, {"search": searched - clock, "planning": time.perf_counter() - searched}


def _delivery(
    plan: Plan, search: TerrainSearch, collisions: bool, seconds: dict[str, float]
) -> Delivery:
    """What is written and said of a walk over a map."""
    from gaitopt.planners.over_terrain.ways.arrival import off_goal

    took = ", ".join(f"{what} {value:.1f} s" for what, value in seconds.items())
    told = [f"{len(search.tried)} places were tried for the feet; {took}"]
    if search.metres > SHORT:
        told[0] += f"; the search {seconds['search'] / search.metres:.2f} s a metre"
    beside = off_goal(plan, search.course.poses[-1])
    if beside > BESIDE:
        told.append(f"The body ends {beside:.2f} m beside the goal, as near as it gets.")
    instead = getattr(plan.record, "instead", None)
    if instead:
        told.append(escape(f"It is the walk phase by phase, and no time-optimal one: {instead}"))
    return Delivery(
        plan, summarise(plan), PAGE, told=tuple(told), replay_options={"search": search},
        collisions=collisions, strict=True,
        others={
            MAP: ("the map with footholds and paths", lambda path: _draw(plan, search, path)),
            FOOTHOLDS: ("the footholds: gaitopt walk --footholds", plan.footholds.to_csv),
        },
    )  # fmt: skip


def _draw(plan: Plan, search: TerrainSearch, path: Path) -> None:
    from gaitopt.viewing.figures.files import save_figure
    from gaitopt.viewing.figures.terrain_map import plot_terrain_map

    save_figure(plot_terrain_map(plan, search=search), path)


def _tell_edges(
    robot: Quadruped, ground: HeightMap, places: dict[str, tuple[float, ...]], report: Report
) -> None:
    """Report which places are so near the edge of the map that limbs may come beyond it."""
    from gaitopt.planners.over_terrain.setup import ROOM

    (x0, x1), (y0, y1) = ground.extent
    room = robot.stance_size[0] / 2.0 + ROOM * robot.standing_height
    for name, (x, y, *_) in places.items():
        gap = min(x - x0, x1 - x, y - y0, y1 - y)
        # The last points of a map that is made are as far away as the grid allows.
        if gap < room - ground.resolution:
            report.say(
                f"The {name} is {gap:.2f} m from the edge of the map. No limb may be above the "
                f"unknown ground beyond it: choose a place {room:.2f} m from the edge."
            )


def _explain(error: TerrainError, folder: RunFolder, report: Report) -> None:
    """Report what stopped a search, and draw how far it got."""
    from gaitopt.planners.over_terrain.beam.ending import Ending
    from gaitopt.planners.over_terrain.failure import TOLD, in_order
    from gaitopt.viewing.figures.files import save_figure
    from gaitopt.viewing.figures.terrain_map import plot_terrain_map

    causes = in_order(error.refused)
    # The error itself tells the most frequent ones, and all of them where nothing was searched.
    others = causes[TOLD:]
    if error.search.ended in (Ending.NO_GOAL, Ending.NO_START):
        others = []
        report.say(f"No way was looked for: {error.search.ended}.")
    elif error.search.footholds.steps < error.search.steps:
        report.say("No way was found.")
    else:
        report.say("Footholds to the goal were found, but no walk over them.")
    if others:
        report.say("Less often tries were refused for:")
    for cause, count in others:
        report.say(f"{count:6d} x {escape(str(cause))}")
    report.add(
        error=error.message, step=error.step, leg=error.leg,
        refused={str(cause): count for cause, count in causes},
    )  # fmt: skip
    with folder.writing() as (made, place):
        save_figure(plot_terrain_map(error.search), made / MAP)
        record_run(made, {"command": "terrain", "files": [MAP], "error": error.message})
    report.files({place / MAP: "how far the search got, and where no foot may stand"})
