"""A study: plan, certify and simulate many walks on all cores, with a row of a table for each.

A study that was stopped can be continued. A walk that fails has a row that says why.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass
from itertools import product
from typing import Any, Literal

from gaitopt.errors import FootholdsWarning, InfeasibleStepError
from gaitopt.files import StrPath
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import Speed
from gaitopt.studies.result_table import Columns
from gaitopt.studies.resumable import run_jobs
from gaitopt.studies.robots import study_robot
from gaitopt.studies.tables import one_line


@dataclass(frozen=True)
class Walk:
    """One walk of a study.

    Attributes:
        robot: a name, or the path of a URDF file, as for :func:`gaitopt.load_robot`.
        seed: of the S-shaped columns, which are in proportion to the robot's size.
        columns: number of columns for each leg.
        objective, speed: as for :func:`gaitopt.plan_crawl`.
        stability_margin, body_height: [m]; ``None`` for the defaults, which fit the robot.
        free: with the objective ``"time"``, what is optimised beside the body's targets.
        timing: what bounds the speed, as for :func:`gaitopt.plan_crawl`.
        certify: whether to certify the plan.
        collisions: whether the certificate checks for self-collisions.
        simulate: whether to simulate the plan with physics.
    """

    robot: str = "wang2020"
    seed: int = 0
    columns: int = 17
    objective: Literal["distance", "margin", "time"] = "distance"
    speed: Speed = "max"
    stability_margin: float | None = None
    body_height: float | None = None
    free: str | None = None
    timing: Literal["velocity", "forces"] = "velocity"
    certify: bool = True
    collisions: bool = False
    simulate: bool = False


@dataclass(frozen=True)
class Row:
    """The result of one walk; ``None`` for what was not computed.

    Attributes:
        status: ``"ok"``; ``"infeasible"``: there is no plan; ``"violated"``: the certificate found
            a violation; ``"fell"``: the simulated robot fell or missed a foothold; ``"too fast"``:
            its joints exceeded their velocity limits; ``"error"``: any other error.
        message: the reason, in one line.
        duration: of the plan [s].
        mean_speed: [m/s].
        cog_distance: [m].
        margin: smallest stability margin of the body centre [m].
        com_margin: smallest certified margin of the true COM [m].
        violations: names of violated checks.
        outcome: of the certificate: ``"certified"``, ``"not all checked"``, ``"kinematics only"``
            or ``"violated"``.
        warned: what the planner warned of.
        passed: whether it passed in physics.
        steps_done: number of steps of the simulated robot.
        landing_error, tilt, body_error: their largest values in the simulation [m], [rad], [m].
        rate_use: largest joint velocity in the simulation as a share of its limit.
        real_time_factor: simulated time divided by computing time.
        work_time: time for planning, certificate and simulation [s].
    """

    status: str
    message: str = ""
    duration: float | None = None
    mean_speed: float | None = None
    cog_distance: float | None = None
    margin: float | None = None
    com_margin: float | None = None
    violations: str = ""
    outcome: str = ""
    warned: str = ""
    passed: bool | None = None
    steps_done: int | None = None
    landing_error: float | None = None
    tilt: float | None = None
    body_error: float | None = None
    rate_use: float | None = None
    real_time_factor: float | None = None
    work_time: float | None = None


COLUMNS = Columns(Walk, Row)
HEADER = COLUMNS.names


def grid(
    seeds: Iterable[int],
    *,
    robots: Sequence[str] = ("wang2020",),
    objectives: Sequence[str] = ("distance",),
    stability_margins: Sequence[float | None] = (None,),
    body_heights: Sequence[float | None] = (None,),
    **others: Any,
) -> list[Walk]:
    """Walks with every combination of some values.

    Args:
        seeds, robots, objectives, stability_margins, body_heights: values of the fields of
            :class:`Walk` to combine.
        others: fields of :class:`Walk` that are the same for all walks.
    """
    return [
        Walk(robot=r, objective=o, stability_margin=m, body_height=h, seed=s, **others)  # type: ignore[arg-type]
        for r, o, m, h, s in product(robots, objectives, stability_margins, body_heights, seeds)
    ]


def run_walk(walk: Walk) -> Row:
    """Plan, certify and simulate one walk; errors become rows."""
    begin = time.perf_counter()
    try:
        row = _planned_and_checked(walk)
    except InfeasibleStepError as error:
        row = Row("infeasible", one_line(error))
    except Exception as error:
        # Errors of any kind: one walk must not end a study of thousands.
        row = Row("error", f"{type(error).__name__}: {one_line(error)}")
    return Row(**{**asdict(row), "work_time": time.perf_counter() - begin})


def run_study(
    walks: Sequence[Walk],
    table: StrPath,
    *,
    jobs: int = -1,
    scheduler: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> list[dict[str, str]]:
    """Run all walks that are not in the table yet, and append a row for each.

    Args:
        walks: the walks.
        table: a CSV file, which is made if it does not exist. A last line that a crash has cut off
            is deleted, and its walk is run again; lines in the middle that are damaged are told by
            a :class:`gaitopt.errors.StudyWarning`. A row belongs to a walk by the content of the
            robot: where its file has changed, the walk is run again.
        jobs: number of processes; -1 for one on each core. There are never more than cores.
        scheduler: address of a Dask scheduler (``tcp://...``), to compute there and not here.
        progress: called with (walks done, walks in all).

    Returns:
        All rows of the table that belong to ``walks``, as text by column.

    Raises:
        InputError: the table cannot be read or written, is no table of a study, or another study
            writes to it; ``jobs`` is no number of processes; or no scheduler answers.
        StudyError: workers or the cluster were lost. All rows so far are in the table.
        MissingPackageError: a scheduler was named, and Dask is not installed.
    """
    return run_jobs(
        walks, run_walk, COLUMNS, table, jobs=jobs, scheduler=scheduler, progress=progress
    )


def _planned_and_checked(walk: Walk) -> Row:
    """Plan, certify and simulate one walk; errors are raised."""
    from gaitopt.planners.crawl import plan_crawl
    from gaitopt.terrain.columns import s_columns

    robot = study_robot(walk.robot)
    columns = s_columns(walk.seed, columns=walk.columns, robot=robot)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always", FootholdsWarning)
        plan = plan_crawl(
            robot, columns, objective=walk.objective, speed=walk.speed,
            stability_margin=walk.stability_margin, body_height=walk.body_height, free=walk.free,
            timing=walk.timing,
        )  # fmt: skip
    warned = [one_line(w.message) for w in told if issubclass(w.category, FootholdsWarning)]
    found: dict[str, Any] = {
        "status": "ok", "duration": plan.duration, "mean_speed": plan.mean_speed,
        "cog_distance": plan.cog_distance, "margin": plan.margin, "warned": "; ".join(warned),
    }  # fmt: skip
    if walk.certify:
        _certify(plan, walk, found)
    if walk.simulate:
        _simulate(plan, found)
    return Row(**found)


def _certify(plan: Plan, walk: Walk, found: dict[str, Any]) -> None:
    """Certify a plan, and put what was found into the fields of its row."""
    from gaitopt.certificate.verify import verify

    certificate = verify(plan, collisions=walk.collisions)
    found["outcome"] = str(certificate.outcome)
    found["com_margin"] = certificate["margin of the true COM"].worst
    if not certificate.ok:
        found["status"] = "violated"
        found["violations"] = "; ".join(c.name for c in certificate.violations)
        found["message"] = one_line(certificate.violations[0])


def _simulate(plan: Plan, found: dict[str, Any]) -> None:
    """Simulate a plan, and put what was found into the fields of its row."""
    from gaitopt.simulation.simulate import simulate

    result = simulate(plan)
    found["passed"] = result.passed
    for name in ("steps_done", "landing_error", "tilt", "body_error", "rate_use",
                 "real_time_factor"):  # fmt: skip
        found[name] = getattr(result, name)
    if not result.passed:
        status = "too fast" if result.succeeded else "fell"
        found["status"] = status if found["status"] == "ok" else found["status"]
        found["message"] = found.get("message") or one_line(result.verdict)
