"""The race: several methods plan walks over the same footholds, and are compared with the paper's.

Each method is a row of the race's table. Two are those of [Wang2020], planned phase by phase. The
others are the variants of the time-optimal walk (:data:`gaitopt.plan.settings.freedoms.VARIANTS`).
All may be timed by contact forces, except for the paper's method, with which they are compared.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import Progress
from gaitopt.errors import GaitoptError, InputError
from gaitopt.files import StrPath
from gaitopt.inputs import check_choice, check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.base import FORCES, VELOCITY
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.crawl import plan_crawl
from gaitopt.robots.quadruped import Quadruped
from gaitopt.studies.one_height import with_one_height
from gaitopt.studies.race_lanes import Lane, Race
from gaitopt.studies.race_standings import BOUND_WINDOW, PAPER, PHASES, SSM, Finish, Standings
from gaitopt.studies.tables import appending, one_line
from gaitopt.studies.workers import no_workers_left, on_all_cores, process_count
from gaitopt.terrain.columns import s_columns
from gaitopt.terrain.footholds import Footholds

_SHORT_NAMES = {"ssm": SSM, "paper": PAPER, "phases": PHASES}
"""Names of rows as users type them."""
_NOT_OF_THE_PAPER = ("com", "forces")
"""Settings that the paper's method does not take."""


def row_names(rows: Sequence[str] | None = None, timing: str = VELOCITY) -> tuple[str, ...]:
    """The full names of rows in the order of the table; the paper's method is always among them.

    Args:
        rows: names: ``"ssm"``, ``"paper"``, or those of variants; with the timing ``"forces"``
            also ``"phases"``, the paper's method with forces. ``None`` for all.
        timing: what bounds the speed.

    Raises:
        InputError: a name is unknown.
    """
    check_choice("timing", timing, (VELOCITY, FORCES))
    phases = (PHASES,) if timing == FORCES else ()
    known = (SSM, PAPER, *phases, *VARIANTS)
    if rows is None:
        return known
    typed = [str(row).strip() for row in rows]
    wanted = [_SHORT_NAMES.get(row.lower(), row) for row in typed]
    for row, name in zip(typed, wanted, strict=True):
        if name not in known:
            there = ", ".join(map(_short_name, known))
            raise InputError(f"rows names {row!r}; there are {there}")
    return tuple(row for row in known if row in wanted or row == PAPER)


def _short_name(name: str) -> str:
    """The name of a row as users type it."""
    return next((short for short, full in _SHORT_NAMES.items() if full == name), name)


def race(
    robot: Quadruped,
    footholds: Footholds,
    rows: Sequence[str] | None = None,
    *,
    timing: str = VELOCITY,
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
        timing: ``"velocity"``, or ``"forces"`` to time all rows but the paper's by contact forces.
            All rows keep the same stability margin, 0.05 times the standing height by default.
        certify: whether to certify the plans.
        collisions: whether certificates check for self-collisions.
        bound: whether to compute lower bounds on the times.
        progress: called with (rows done, rows in all).
        settings: of both :func:`gaitopt.plan_crawl` and :func:`gaitopt.plan_route`: stability
            margin, heights, order of legs, limits on forces, ...

    Returns:
        The race. Where a row has no plan, its lane's ``error`` says why.

    Raises:
        InputError: a row's name is unknown, or a setting is out of range.
    """
    check_kind("robot", robot, Quadruped)
    check_kind("footholds", footholds, Footholds)
    names = row_names(rows, timing)
    shared = shared_settings(robot, footholds, settings, timing)
    rules = _Rules(certify, collisions, bound, timing, shared)
    lanes = []
    for i, name in enumerate(names):
        lanes.append(_run_row(robot, footholds, name, rules))
        if progress is not None:
            progress(i + 1, len(names))
    return Race(robot.name, footholds, tuple(lanes), timing)


def race_many(
    robot: Quadruped,
    seeds: Sequence[int],
    rows: Sequence[str] | None = None,
    *,
    columns: int = 17,
    timing: str = VELOCITY,
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
        rows, timing, certify, collisions, bound, settings: as for :func:`race`.
        columns: number of columns for each leg.
        jobs: number of processes; -1 for one on each core. There are never more than cores.
        table: a CSV file that is written anew; a line is appended when a walk is done.
        progress: called with (walks done, walks in all).

    Raises:
        InputError: there is no seed, a row's name is unknown, a setting is out of range, or the
            table cannot be written.
    """
    names, terrains = row_names(rows, timing), list(dict.fromkeys(seeds))
    if not terrains:
        raise InputError("a race needs at least one seed")
    first = terrains[0]
    ground = s_columns(first, columns=columns, robot=robot)
    shared = shared_settings(robot, ground, settings, timing)
    rules = _Rules(certify, collisions, bound, timing, shared)
    todo = [(seed, name) for seed in terrains for name in names]
    finishes: dict[tuple[int, str], Finish] = {}
    plans: dict[str, Plan] = {}
    work = ((robot, seed, columns, name, rules, seed == first) for seed, name in todo)
    results = on_all_cores(_run, work, process_count(jobs))
    with no_workers_left(), closing(results), _finish_table(table) as append:
        for finish, plan in results:
            finishes[finish.seed, finish.row] = finish
            append(finish)
            if plan is not None:
                plans[finish.row] = plan
            if progress is not None:
                progress(len(finishes), len(todo))
    return Standings(
        robot.name, 4 * (columns - 1), names, tuple(finishes[key] for key in todo),
        {name: plans[name] for name in names if name in plans}, timing,
    )  # fmt: skip


def shared_settings(
    robot: Quadruped, footholds: Footholds, settings: Mapping[str, Any], timing: str
) -> dict[str, Any]:
    """Settings with one stability margin and one body height for all rows.

    Those that are not given are the ones of the paper's method.

    Args:
        robot, footholds: the walk.
        settings, timing: as for :func:`race`.

    Raises:
        InputError: a setting is out of range, or limits on forces come with another timing.
    """
    others = {name: settings.get(name) for name in _NOT_OF_THE_PAPER}
    # The paper's row does not look at these: what is out of range is refused here.
    CrawlSettings.for_robot(robot, timing=timing, **others)
    paper = {name: value for name, value in settings.items() if name not in others}
    found = with_one_height(robot, footholds, {**paper, "timing": VELOCITY})
    known = {**settings, "body_height": found["body_height"]}
    if known.get("stability_margin") is None:
        known["stability_margin"] = CrawlSettings.for_robot(robot, timing=VELOCITY).stability_margin
    return known


class _Rules(NamedTuple):
    """What is the same for all rows: what to compute beside plans, and the planners' settings."""

    certify: bool
    collisions: bool
    bound: bool
    timing: str
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
        plan = _planned(robot, footholds, name, rules)
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


def _planned(robot: Quadruped, footholds: Footholds, name: str, rules: _Rules) -> Plan:
    """The plan of the row that is so named."""
    settings = {"timing": rules.timing, **rules.settings}
    if name == PAPER or (name == SSM and rules.timing == VELOCITY):
        # The paper and its baseline keep the margin of the body centre, whatever the others do.
        kept = {k: value for k, value in settings.items() if k not in _NOT_OF_THE_PAPER}
        settings = {**kept, "timing": VELOCITY}
    if name in (SSM, PAPER, PHASES):
        objective: Any = "margin" if name == SSM else "distance"
        return plan_crawl(robot, footholds, objective=objective, **settings)
    from gaitopt.planners.time_optimal.planner import plan_route

    return plan_route(robot, footholds, free=name, **settings)


def _bound(plan: Plan) -> float:
    """Lower bound on the time of plans of the same row [s]; ``nan`` where none is known."""
    from gaitopt.planners.time_optimal.bound import route_bound

    settings = plan.settings
    if settings.promised_forces is not None:
        if not (isinstance(settings, RouteSettings) and settings.free.swing):
            # With forces the corners of boxes are rounded, and the bound is that of whole boxes.
            return float("nan")
        try:
            # Forces only make a walk slower.
            relaxed = replace(settings, timing=VELOCITY, forces=None)
        except InputError:
            return float("nan")
        plan = replace(plan, settings=relaxed)
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
