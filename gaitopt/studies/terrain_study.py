"""A study of made grounds: search, plan, certify and simulate a walk over each of many seeds.

A walk that fails has a row that says where and why. A map is *solvable* if the same search finds
footholds to the goal, if need be with a wider beam.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any

from gaitopt.errors import GaitoptError, InputError, TerrainError
from gaitopt.files import StrPath
from gaitopt.inputs import as_text
from gaitopt.studies.result_table import Columns
from gaitopt.studies.resumable import run_jobs
from gaitopt.studies.robots import study_robot
from gaitopt.studies.tables import one_line

if TYPE_CHECKING:
    from gaitopt.plan.plan import Plan
    from gaitopt.planners.over_terrain.result import TerrainSearch
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.terrain.height_map import HeightMap

WIDEST = 384
"""Width up to which maps are searched once more before they count as not solvable. Chosen: twice
the usual limit, so that searches take twice as long, too."""

SAID = "the planner of the walk said: "
"""Before the planner's words in the message of a :class:`gaitopt.TerrainError`."""


@dataclass(frozen=True)
class TerrainWalk:
    """One walk of a study of made grounds.

    Attributes:
        robot: a name, or the path of a robot's file, as for :func:`gaitopt.load_robot`.
        terrain: name of the ground, as for :func:`gaitopt.make_ground`.
        seed, difficulty, length: of the ground; length in metres.
        sizes: of the ground, in place of what follows from the difficulty: ``"height=0.15"``,
            joined by commas.
        friction: of the ground; ``None`` for the usual one.
        width_limit: width up to which the search is repeated at a dead end; ``None`` for the
            usual one.
        exhaustive: the same for a second search where the first finds no way, to tell whether the
            map is solvable; 0 to leave that open. At the command line it is ``--widest``; here it
            is the name of the column in tables that there are.
        certify, collisions: whether to certify the plan, and whether for self-collisions, too.
        simulate: whether to walk the plan in physics.
        physics_friction: coefficient of friction in physics; ``None`` for the usual 1.0.
    """

    robot: str = "go2"
    terrain: str = "rubble"
    seed: int = 0
    difficulty: float = 0.5
    length: float = 3.0
    sizes: str = ""
    friction: float | None = None
    width_limit: int | None = None
    exhaustive: int = WIDEST
    certify: bool = True
    collisions: bool = True
    simulate: bool = False
    physics_friction: float | None = None

    def ground(self, robot: Quadruped) -> HeightMap:
        """The ground, to the robot's size.

        Raises:
            InputError: there is no such ground, or a size is out of range.
        """
        from gaitopt.terrain.maps.catalogue import make_ground

        return make_ground(
            self.terrain, seed=self.seed, difficulty=self.difficulty, length=self.length,
            robot=robot, **sizes_of(self.sizes),
        )  # fmt: skip


@dataclass(frozen=True)
class TerrainRow:
    """The result of one walk; ``None`` for what was not computed.

    Attributes:
        status: ``"ok"``; ``"no way"``: the search found none; ``"refused"``: the planner of the
            walk found no plan over its footholds; ``"violated"``: the certificate found a
            violation; ``"not certified"``: not all could be checked; ``"fell"``: in physics the
            robot fell or missed a foothold; ``"too fast"``: its joints exceeded their velocity
            limits; ``"error"``: any other error.
        message: the reason, in one line.
        solvable: whether the search finds footholds to the goal, if need be with a wider
            beam; ``None`` where this was not looked for.
        found: whether the search found footholds to the goal.
        planned, certified, passed: whether a walk over them was planned, is certified, and passed
            in physics.
        steps: of the walk.
        metres: length of the way that was asked for [m].
        width: of the search's beam, at the end.
        search_time: processor time of the search [s].
        plan_time: of the planner, with further searches where it refused steps [s].
        certify_time, simulate_time: of certificate and physics [s].
        duration: of the plan [s].
        mean_speed: of the plan [m/s].
        margin: of the plan [m].
        failed_step, failed_leg: where the search found no way.
        causes: how many tries of this step were refused for what.
        violations: names of violated checks.
        landing_error, tilt: their largest values in physics [m], [rad].
    """

    status: str = "ok"
    message: str = ""
    solvable: bool | None = None
    found: bool = False
    planned: bool = False
    certified: bool | None = None
    passed: bool | None = None
    steps: int | None = None
    metres: float | None = None
    width: int | None = None
    search_time: float | None = None
    plan_time: float | None = None
    certify_time: float | None = None
    simulate_time: float | None = None
    duration: float | None = None
    mean_speed: float | None = None
    margin: float | None = None
    failed_step: int | None = None
    failed_leg: str = ""
    causes: str = ""
    violations: str = ""
    landing_error: float | None = None
    tilt: float | None = None


TERRAIN_COLUMNS = Columns(TerrainWalk, TerrainRow)
TERRAIN_HEADER = TERRAIN_COLUMNS.names


def terrain_grid(
    seeds: Iterable[int],
    *,
    robots: Sequence[str] = ("go2",),
    terrains: Sequence[str] = ("rubble",),
    difficulties: Sequence[float] = (0.5,),
    **others: Any,
) -> list[TerrainWalk]:
    """Walks with every combination of robots, grounds, difficulties and seeds.

    Args:
        seeds, robots, terrains, difficulties: to combine.
        others: fields of :class:`TerrainWalk` that are the same for all walks.
    """
    return [
        TerrainWalk(robot=r, terrain=t, difficulty=d, seed=s, **others)
        for r, t, d, s in product(robots, terrains, difficulties, seeds)
    ]


def run_terrain_study(
    walks: Sequence[TerrainWalk],
    table: StrPath,
    *,
    jobs: int = -1,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[dict[str, str]]:
    """Run all walks that are not in the table yet, and append a row for each.

    Arguments, return value and errors are those of :func:`gaitopt.studies.study.run_study`.
    """
    return run_jobs(
        walks, run_terrain_walk, TERRAIN_COLUMNS, table, jobs=jobs, scheduler=scheduler,
        progress=progress,
    )  # fmt: skip


def run_terrain_walk(walk: TerrainWalk) -> TerrainRow:
    """Search, plan, certify and simulate one walk; errors become rows."""
    found: dict[str, Any] = {}
    try:
        _walk(walk, found)
    except Exception as error:
        # Errors of any kind: one walk must not end a study of hundreds.
        found["status"] = "error"
        found["message"] = f"{type(error).__name__}: {one_line(error)}"
    return TerrainRow(**found)


def sizes_of(text: str) -> dict[str, float]:
    """Sizes of a ground by name, from ``"height=0.15,block=0.1"``.

    Raises:
        InputError: the text is something else.
    """
    sizes: dict[str, float] = {}
    for part in text.split(",") if text else ():
        name, _, value = part.partition("=")
        try:
            sizes[name] = float(value)
        except ValueError:
            raise InputError(f"sizes are written as NAME=NUMBER, got {as_text(part)}") from None
    return sizes


def _walk(walk: TerrainWalk, found: dict[str, Any]) -> None:
    """Do all of a walk, and put what was found into the fields of its row."""
    from gaitopt.planners.over_terrain.planner import plan_terrain, search_terrain
    from gaitopt.planners.over_terrain.settings import TerrainSettings

    robot = study_robot(walk.robot)
    way = robot, walk.ground(robot), (walk.length, 0.0)
    start = (0.0, 0.0, 0.0)
    how: dict[str, Any] = {"friction": walk.friction, "width_limit": walk.width_limit}
    with _timed(found, "search_time"):
        search = search_terrain(*way, start=start, **how)
    found |= {"found": search.complete, "metres": search.metres, "width": search.width}
    found["solvable"] = search.complete or None
    if not search.complete:
        _no_way(search, found)
        if walk.exhaustive:
            # The first search went as far as its own width, and would find the same.
            wider = walk.exhaustive > (walk.width_limit or TerrainSettings.width_limit)
            how["width_limit"] = walk.exhaustive
            found["solvable"] = wider and search_terrain(*way, start=start, **how).complete
        return
    try:
        with _timed(found, "plan_time"):
            plan = plan_terrain(*way, start=start, search=search, width_limit=walk.width_limit)
    except GaitoptError as error:
        # What the planner said comes after how far the search got, which was to the goal.
        _, _, said = str(error).partition(SAID)
        found |= {"status": "refused", "message": one_line(said or error)}
        if isinstance(error, TerrainError) and error.leg:
            found |= {"failed_step": error.step, "failed_leg": error.leg}
        return
    found |= {
        "planned": True, "steps": plan.footholds.steps, "duration": plan.duration,
        "mean_speed": plan.mean_speed, "margin": plan.margin,
    }  # fmt: skip
    if walk.certify:
        _certify(plan, walk, found)
    if walk.simulate:
        _simulate(plan, walk, found)


def _no_way(search: TerrainSearch, found: dict[str, Any]) -> None:
    """Where and why a search ended."""
    from gaitopt.planners.over_terrain.failure import no_way

    refused: Mapping[Any, int] = search.refused
    causes = sorted(((n, str(cause)) for cause, n in refused.items() if n), reverse=True)
    found |= {
        "status": "no way", "message": one_line(no_way(search)),
        "failed_step": search.footholds.steps, "failed_leg": search.next_leg,
        "causes": "; ".join(f"{cause}: {n}" for n, cause in causes),
    }  # fmt: skip


def _certify(plan: Plan, walk: TerrainWalk, found: dict[str, Any]) -> None:
    """Certify a plan."""
    from gaitopt.certificate.certificate import Outcome
    from gaitopt.certificate.verify import verify

    with _timed(found, "certify_time"):
        certificate = verify(plan, collisions=walk.collisions)
    found["certified"] = certificate.outcome is Outcome.CERTIFIED
    if certificate.violations:
        found["status"] = "violated"
        found["violations"] = "; ".join(c.name for c in certificate.violations)
        found["message"] = one_line(certificate.violations[0])
    elif not found["certified"]:
        found |= {"status": "not certified", "message": str(certificate.outcome)}


def _simulate(plan: Plan, walk: TerrainWalk, found: dict[str, Any]) -> None:
    """Walk a plan in physics."""
    from gaitopt.simulation.settings import SimulationSettings
    from gaitopt.simulation.simulate import simulate

    with _timed(found, "simulate_time"):
        friction = walk.physics_friction
        result = simulate(plan, None if friction is None else SimulationSettings(friction=friction))
    found |= {
        "passed": result.passed, "landing_error": result.landing_error, "tilt": result.tilt,
    }  # fmt: skip
    if not result.passed and found.get("status", "ok") == "ok":
        found["status"] = "too fast" if result.succeeded else "fell"
        found["message"] = one_line("; ".join(result.failures))


@contextmanager
def _timed(found: dict[str, Any], name: str) -> Iterator[None]:
    """Put the processor time that something takes into a field [s]."""
    begin = time.process_time()
    try:
        yield
    finally:
        found[name] = time.process_time() - begin
