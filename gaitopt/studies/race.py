"""The race: several methods plan walks over the same footholds, and are compared with the paper's.

Each method is a row of the race's table. Two are those of [Wang2020], planned phase by phase. The
others are the variants of the time-optimal walk (:data:`gaitopt.plan.settings.freedoms.VARIANTS`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import Progress
from gaitopt.errors import GaitoptError, InputError
from gaitopt.files import StrPath
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.base import VELOCITY
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.planners.crawl import plan_crawl
from gaitopt.robots.quadruped import Quadruped
from gaitopt.studies.compare import with_one_height
from gaitopt.studies.race_standings import (
    BOUND_WINDOW,
    PAPER,
    SSM,
    Finish,
    Lane,
    Race,
    Standings,
)
from gaitopt.studies.tables import appending, one_line
from gaitopt.terrain.columns import s_columns
from gaitopt.terrain.footholds import Footholds

_SHORT_NAMES = {"ssm": SSM, "paper": PAPER}
"""Names of rows as users type them."""


def row_names(rows: Sequence[str] | None = None) -> tuple[str, ...]:
    """The full names of rows in the order of the table; the paper's method is always among them.

    Args:
        rows: names: ``"ssm"``, ``"paper"``, or those of variants; ``None`` for all.

    Raises:
        InputError: a name is unknown.
    """
    known = (SSM, PAPER, *VARIANTS)
    if rows is None:
        return known
    wanted = [_SHORT_NAMES.get(str(row).strip().lower(), str(row).strip()) for row in rows]
    for row in wanted:
        if row not in known:
            raise InputError(
                f"rows names {row!r}; there are {', '.join((*_SHORT_NAMES, *VARIANTS))}"
            )
    return tuple(row for row in known if row in wanted or row == PAPER)


def race(
    robot: Quadruped,
    footholds: Footholds,
    rows: Sequence[str] | None = None,
    *,
    certify: bool = True,
    collisions: bool = True,
    bound: bool = True,
    progress: Progress | None = None,
    **settings: Any,
) -> Race:
    """Plan all rows over the same footholds.

    Args:
        robot: from :func:`gaitopt.load_robot`.
        footholds: to walk over.
        rows: names of rows, see :func:`row_names`; the paper's method is always among them.
        certify: whether to certify the plans.
        collisions: whether certificates check for self-collisions, which takes most of the time.
        bound: whether to compute lower bounds on the times.
        progress: called with (rows done, rows in all).
        settings: of both :func:`gaitopt.plan_crawl` and :func:`gaitopt.plan_route`: stability
            margin, heights, order of legs, ...

    Returns:
        The race. Where a row has no plan, its lane's ``error`` says why.

    Raises:
        InputError: a row's name is unknown, or a setting is out of range.
    """
    names = row_names(rows)
    shared = with_one_height(robot, footholds, settings)
    rules = _Rules(certify, collisions, bound, shared)
    lanes = []
    for i, name in enumerate(names):
        lanes.append(_run_row(robot, footholds, name, rules))
        if progress is not None:
            progress(i + 1, len(names))
    return Race(robot.name, footholds, tuple(lanes))


def race_many(
    robot: Quadruped,
    seeds: Sequence[int],
    rows: Sequence[str] | None = None,
    *,
    columns: int = 17,
    certify: bool = True,
    collisions: bool = True,
    bound: bool = True,
    jobs: int = -1,
    table: StrPath | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Standings:
    """Race on random S-shaped columns, one terrain for each seed.

    Args:
        robot: from :func:`gaitopt.load_robot`. The terrains are in proportion to its size.
        seeds: of the terrains.
        rows, certify, collisions, bound, settings: as for :func:`race`.
        columns: number of columns for each leg.
        jobs: number of processes; -1 for one on each core.
        table: a CSV file that is written anew; a line is appended when a walk is done.
        progress: called with (walks done, walks in all).

    Raises:
        InputError: there is no seed, a row's name is unknown, a setting is out of range, or the
            table cannot be written.
    """
    from joblib import Parallel, delayed

    names, terrains = row_names(rows), list(dict.fromkeys(seeds))
    if not terrains:
        raise InputError("a race needs at least one seed")
    first = terrains[0]
    shared = with_one_height(robot, s_columns(first, columns=columns, robot=robot), settings)
    rules = _Rules(certify, collisions, bound, shared)
    todo = [(seed, name) for seed in terrains for name in names]
    finishes: dict[tuple[int, str], Finish] = {}
    plans: dict[str, Plan] = {}
    with _finish_table(table) as append:
        results = Parallel(n_jobs=jobs, return_as="generator_unordered", batch_size=1)(
            delayed(_run)(robot, seed, columns, name, rules, seed == first) for seed, name in todo
        )
        for finish, plan in results:
            finishes[finish.seed, finish.row] = finish
            append(finish)
            if plan is not None:
                plans[finish.row] = plan
            if progress is not None:
                progress(len(finishes), len(todo))
    return Standings(
        robot.name, 4 * (columns - 1), names, tuple(finishes[key] for key in todo),
        {name: plans[name] for name in names if name in plans},
    )  # fmt: skip


class _Rules(NamedTuple):
    """What is the same for all rows: what to compute beside plans, and the planners' settings."""

    certify: bool
    collisions: bool
    bound: bool
    settings: dict[str, Any]


def _run(
    robot: Quadruped, seed: int, columns: int, name: str, rules: _Rules, keep: bool
) -> tuple[Finish, Plan | None]:
    """Run one row on one terrain in a worker process; return the plan only if ``keep`` is set."""
    lane = _run_row(robot, s_columns(seed, columns=columns, robot=robot), name, rules)
    return lane.finish(seed), lane.plan if keep else None


def _run_row(robot: Quadruped, footholds: Footholds, name: str, rules: _Rules) -> Lane:
    """Plan and certify one row.

    Raises:
        InputError: a setting is out of range for the paper's method, and so for all others.
    """
    began = time.process_time()
    try:
        plan = _planned(robot, footholds, name, rules.settings)
    except Exception as error:
        if name == PAPER and isinstance(error, InputError):
            raise
        # Errors of any kind: one row must not end the race of the others.
        return Lane(name, None, _reason(error), time.process_time() - began, None)
    solve_time = time.process_time() - began
    certificate, bound, message = None, np.nan, ""
    try:
        if rules.certify:
            from gaitopt.certificate.verify import verify

            certificate = verify(plan, collisions=rules.collisions)
        if rules.bound:
            bound = _bound(plan)
    except Exception as error:
        # The plan is shown all the same, with the reason why it was not certified.
        message = _reason(error)
    return Lane(name, plan, message, solve_time, certificate, bound)


def _planned(robot: Quadruped, footholds: Footholds, name: str, settings: dict[str, Any]) -> Plan:
    """The plan of the row that is so named."""
    settings = {"timing": VELOCITY, **settings}
    if name in (SSM, PAPER):
        objective: Any = "margin" if name == SSM else "distance"
        # The paper and its baseline keep the margin of the body centre, whatever the others do.
        shared = {name: value for name, value in settings.items() if name != "com"}
        return plan_crawl(robot, footholds, objective=objective, **shared)
    from gaitopt.planners.time_optimal.planner import plan_route

    return plan_route(robot, footholds, free=name, **settings)


def _bound(plan: Plan) -> float:
    """Lower bound on the time of plans of the same row [s]; ``nan`` where none is known."""
    from gaitopt.planners.time_optimal.bound import route_bound

    try:
        # Parts without a solution count as 0 s, so that the sum is still a lower bound.
        bound = float(np.nansum(route_bound(plan, BOUND_WINDOW)))
    except InputError:
        return float("nan")
    # Solvers may miss an optimum, but a plan that exists cannot be below the bound.
    return min(bound, plan.duration) if bound > 0.0 else float("nan")


def _reason(error: Exception) -> str:
    """An error in one line; errors of the program with their type."""
    words = str(error) if isinstance(error, GaitoptError) else f"{type(error).__name__}: {error}"
    return one_line(words)


@contextmanager
def _finish_table(table: StrPath | None) -> Iterator[Callable[[Finish], None]]:
    """A function that appends a finish to a table; it does nothing where there is no table."""
    if table is None:
        yield lambda finish: None
        return
    with appending(Path(table), [field.name for field in fields(Finish)], anew=True) as append:
        yield lambda finish: append(asdict(finish))
