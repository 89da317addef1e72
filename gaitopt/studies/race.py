"""The race: every way to walk the same footholds, held against the paper's.

The rows are the two baselines of 000_6dacb41600db6a3c.txt, planned phase by phase, and those of
:data:`gaitopt.planning.route_settings.ROWS`, planned over the whole route at once.
"""

from __future__ import annotations

import csv
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import GaitoptError, InputError
from gaitopt.files import StrPath
from gaitopt.planning.crawl import plan_crawl
from gaitopt.planning.plan import Plan
from gaitopt.planning.route_settings import ROWS
from gaitopt.robots.quadruped import Quadruped
from gaitopt.studies.terrains import s_columns_for
from gaitopt.terrain.footholds import Footholds

if TYPE_CHECKING:
    from rich.table import Table

    from gaitopt.checking.certificate import Certificate

Progress = Callable[[int, int], None]

SSM, PAPER = "SSM baseline", "the paper"
"""Names of the two rows that are planned phase by phase."""

BOUND_WINDOW = 16
"""Steps of each part of the route that the lower bound looks at by itself."""

_SHORT = {"ssm": SSM, "paper": PAPER}


@dataclass(frozen=True)
class Finish:
    """How one row did on one terrain, in numbers; ``nan`` where there are none.

    Attributes:
        seed: of the terrain; -1 for footholds of one's own.
        row: the row's name.
        time: duration of the plan [s].
        mean_speed: [m/s].
        bound: lower bound on the time of this row [s]; see
            :func:`gaitopt.planning.route_bound.route_bound`.
        solve_time: the processor's time for planning [s].
        margin: smallest margin of what the row is held to [m]: of the body centre, or of the ZMP
            where ``dynamic``.
        dynamic: whether the plan is balanced by its ZMP.
        verdict: ``"certified"``, ``"violated"``, ``"unchecked"``, or ``"failed"`` without a plan.
        message: what is violated, or why there is no plan, in one line.
    """

    seed: int
    row: str
    time: float = np.nan
    mean_speed: float = np.nan
    bound: float = np.nan
    solve_time: float = np.nan
    margin: float = np.nan
    dynamic: bool = False
    verdict: str = "failed"
    message: str = ""


@dataclass(frozen=True, eq=False)
class Lane:
    """One row of a race.

    Attributes:
        name: the row's name.
        plan: its plan; ``None`` where it failed.
        error: why it failed, or could not be certified; else empty.
        solve_time: the processor's time for planning [s].
        certificate: the plan's certificate; ``None`` where none was asked for, or none could be
            worked out.
        bound: lower bound on the time of this row [s]; ``nan`` where there is none.
    """

    name: str
    plan: Plan | None
    error: str
    solve_time: float
    certificate: Certificate | None
    bound: float = np.nan

    def finish(self, seed: int = -1) -> Finish:
        """The lane in numbers."""
        if self.plan is None:
            return Finish(seed, self.name, solve_time=self.solve_time, message=self.error)
        verdict, message = "unchecked", self.error
        if self.certificate is not None:
            verdict = "certified" if self.certificate.ok else "violated"
            message = _one_line("; ".join(map(str, self.certificate.violations)))
        margin, dynamic = _margin(self.plan)
        return Finish(seed, self.name, self.plan.duration, self.plan.mean_speed, self.bound,
                      self.solve_time, margin, dynamic, verdict, message)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Standings:
    """What all rows did on all terrains.

    Attributes:
        robot: the robot's name.
        steps: of the walk.
        rows: names of the rows.
        finishes: one for each terrain and row.
        plans: the plans on the first terrain, by their rows' names.
    """

    robot: str
    steps: int
    rows: tuple[str, ...]
    finishes: tuple[Finish, ...]
    plans: dict[str, Plan]

    @cached_property
    def seeds(self) -> tuple[int, ...]:
        """Seeds of the terrains."""
        return tuple(dict.fromkeys(f.seed for f in self.finishes))

    def of(self, row: str) -> tuple[Finish, ...]:
        """The finishes of one row."""
        return tuple(f for f in self.finishes if f.row == row)

    def values(self, row: str, quantity: str) -> FloatArray:
        """One number a terrain: ``quantity`` is an attribute of :class:`Finish`."""
        found = {f.seed: float(getattr(f, quantity)) for f in self.of(row)}
        return np.array([found.get(seed, np.nan) for seed in self.seeds])

    def ratios(self, row: str, baseline: str = PAPER) -> FloatArray:
        """How many times faster a row is than ``baseline``, a number a terrain."""
        return np.asarray(self.values(baseline, "time") / self.values(row, "time"))

    def gaps(self, row: str) -> FloatArray:
        """How much longer a row takes than its lower bound, as a share, a number a terrain."""
        return np.asarray(self.values(row, "time") / self.values(row, "bound") - 1.0)

    def table(self) -> Table:
        """The race as a table to print: medians and spread over several terrains."""
        from gaitopt.studies.race_report import race_table

        return race_table(self)

    def __str__(self) -> str:
        from gaitopt.studies.report import as_text

        return as_text(self.table(), 150)


@dataclass(frozen=True, eq=False)
class Race:
    """All rows on the same footholds.

    Attributes:
        robot: the robot's name.
        footholds: what is walked.
        lanes: one for each row.
    """

    robot: str
    footholds: Footholds
    lanes: tuple[Lane, ...]

    def __getitem__(self, name: str) -> Lane:
        for lane in self.lanes:
            if lane.name == name:
                return lane
        raise KeyError(f"no row {name!r}; there are {', '.join(x.name for x in self.lanes)}")

    @property
    def plans(self) -> dict[str, Plan]:
        """The plans by their rows' names."""
        return {lane.name: lane.plan for lane in self.lanes if lane.plan is not None}

    @property
    def standings(self) -> Standings:
        """The race in numbers."""
        return Standings(
            self.robot, self.footholds.steps, tuple(lane.name for lane in self.lanes),
            tuple(lane.finish() for lane in self.lanes), self.plans,
        )  # fmt: skip

    def ratio(self, name: str, baseline: str = PAPER) -> float:
        """How many times faster a row is than ``baseline``; ``nan`` where either has no plan."""
        return float(self.standings.ratios(name, baseline)[0])

    def table(self) -> Table:
        """The race as a table to print."""
        return self.standings.table()

    def __str__(self) -> str:
        return str(self.standings)


def row_names(rows: Sequence[str] | None = None) -> tuple[str, ...]:
    """Rows by name, in the order of the table; the paper's is always among them.

    Args:
        rows: names, ``"ssm"`` and ``"paper"`` among them; ``None`` for all.

    Raises:
        InputError: a name is unknown.
    """
    known = (SSM, PAPER, *ROWS)
    if rows is None:
        return known
    wanted = [_SHORT.get(str(row).strip().lower(), str(row).strip()) for row in rows]
    for row in wanted:
        if row not in known:
            raise InputError(f"rows names {row!r}; there are {', '.join((*_SHORT, *ROWS))}")
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
        robot: the robot.
        footholds: what is walked.
        rows: names of rows, see :func:`row_names`; the paper's method always runs along.
        certify: whether to certify the plans.
        collisions: whether the certificates look for self-collisions, which takes most of the
            time.
        bound: whether to work out lower bounds on the times.
        progress: called with (rows done, rows in all).
        settings: for :func:`gaitopt.plan_crawl` and the route's planner alike (stability margin,
            heights, order of legs, ...).

    Returns:
        The race. A row without a plan says why in its lane's ``error``.

    Raises:
        InputError: a row's name is unknown, or a setting is out of range.
    """
    names, rules = row_names(rows), _Rules(certify, collisions, bound, settings)
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
        robot: the robot, to whose size the terrains are.
        seeds: of the terrains.
        rows, certify, collisions, bound, settings: as for :func:`race`.
        columns: columns a leg.
        jobs: processes; -1 for one a core.
        table: a CSV file, begun anew, to which a line is appended as each walk is done.
        progress: called with (walks done, walks in all).

    Raises:
        InputError: there is no seed, a row's name is unknown, a setting is out of range, or the
            table cannot be written.
    """
    from joblib import Parallel, delayed

    names, terrains = row_names(rows), list(dict.fromkeys(seeds))
    if not terrains:
        raise InputError("a race needs at least one seed")
    rules, first = _Rules(certify, collisions, bound, settings), terrains[0]
    todo = [(seed, name) for seed in terrains for name in names]
    finishes: dict[tuple[int, str], Finish] = {}
    plans: dict[str, Plan] = {}
    with _appending(table) as append:
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
    """What holds for all rows: what to work out beside the plans, and the planners' settings."""

    certify: bool
    collisions: bool
    bound: bool
    settings: dict[str, Any]


def _run(
    robot: Quadruped, seed: int, columns: int, name: str, rules: _Rules, keep: bool
) -> tuple[Finish, Plan | None]:
    """One row on one terrain, in a worker; its plan comes back only where it is kept."""
    lane = _run_row(robot, s_columns_for(robot, seed, columns), name, rules)
    return lane.finish(seed), lane.plan if keep else None


def _run_row(robot: Quadruped, footholds: Footholds, name: str, rules: _Rules) -> Lane:
    """Plan and certify one row.

    Raises:
        InputError: a setting is out of range for the paper's method, and so for all.
    """
    began = time.process_time()
    try:
        plan = _planned(robot, footholds, name, rules.settings)
    except Exception as error:
        if name == PAPER and isinstance(error, InputError):
            raise
        # One row's fault, the program's included, must not end the race of the others.
        return Lane(name, None, _reason(error), time.process_time() - began, None)
    taken = time.process_time() - began
    certificate, least, trouble = None, np.nan, ""
    try:
        if rules.certify:
            from gaitopt.checking.certificate import verify

            certificate = verify(plan, collisions=rules.collisions)
        if rules.bound:
            least = _bound(plan)
    except Exception as error:
        trouble = _reason(error)
    return Lane(name, plan, trouble, taken, certificate, least)


def _planned(
    robot: Quadruped, footholds: Footholds, name: str, settings: dict[str, Any]
) -> Plan:  # fmt: skip
    if name in (SSM, PAPER):
        objective: Any = "margin" if name == SSM else "distance"
        return plan_crawl(robot, footholds, objective, **settings)
    from gaitopt.planning.route_crawl import plan_route

    return plan_route(robot, footholds, name, **settings)


def _bound(plan: Plan) -> float:
    """A time below which no plan of the same row is expected; ``nan`` where none is known [s]."""
    from gaitopt.planning.route_bound import route_bound

    try:
        least = float(route_bound(plan, BOUND_WINDOW).sum())
    except InputError:
        return float("nan")
    # What has been walked can be walked, whatever a solver missed.
    return min(least, plan.duration)


def _margin(plan: Plan) -> tuple[float, bool]:
    """The smallest margin of what holds the robot up, and whether that is its ZMP."""
    zmp = plan.info.get("zmp_margin")
    dynamic = not plan.settings.static
    return (zmp if dynamic and isinstance(zmp, float) else plan.margin), dynamic


def _reason(error: Exception) -> str:
    words = str(error) if isinstance(error, GaitoptError) else f"{type(error).__name__}: {error}"
    return _one_line(words)


def _one_line(words: str) -> str:
    return " ".join(words.split())[:500]


@contextmanager
def _appending(table: StrPath | None) -> Iterator[Callable[[Finish], None]]:
    """Append finishes to a table as they come, so that one can watch, and keep what is done."""
    if table is None:
        yield lambda finish: None
        return
    path, names = Path(table), [field.name for field in fields(Finish)]
    try:
        stream = path.open("w", encoding="utf-8", newline="")
    except OSError as error:
        raise InputError(f"cannot write the table {path}: {error.strerror or error}") from error
    with stream:
        writer = csv.DictWriter(stream, names, lineterminator="\n")
        writer.writeheader()

        def append(finish: Finish) -> None:
            writer.writerow(asdict(finish))
            stream.flush()

        yield append
