"""Rows of the table of walks with forces: one walk over one terrain each, kept in a CSV file.

A file of rows is written as the rows come. Who begins with such a file makes only what it lacks,
so that a run that was stopped goes on where it was.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from time import process_time

import gaitopt

ROBOTS = ("wang2020", "wang2020-fast", "a1", "go1", "go2", "b1", "laikago", "anymal", "anymal_c",
          "hyq", "solo12")  # fmt: skip
COLUMNS = 5
"""Columns a leg: 16 steps."""
SPEEDS = tuple(round(0.1 * k, 1) for k in range(30, 0, -1))
"""Speeds of body and feet that the sweep may try, fast ones first [m/s]."""
FIRST_SPEED = 2.0
"""Where it begins [m/s]. Where the speed passes at which a sweep begins, it tries all faster ones,
too: on one of six terrains b1 passes at 2.4 m/s."""
WHOLE_SWEEPS, FASTER = 2, 0.3
"""From the third terrain of a robot on the sweep begins by this much above what has passed on any
terrain before [m/s]."""
SWEEP = "fastest fixed speed"
"""The walk of the sweep: phase by phase, by joint velocities, as fast as physics lets it pass."""
WATCHED = gaitopt.SimulationSettings().watch_time
"""How long physics watches a robot that has walked [s]."""
SOLO_EFFORT, SOLO_VELOCITY = 2.7, 20.0
"""Limits of solo12, whose file has placeholders: the torque of its motors at 12 A [N m], with a
gear of 9, and a velocity that was chosen [rad/s]."""


@dataclass(frozen=True)
class Row:
    """What became of a walk.

    Attributes:
        seed: of the terrain.
        robot: its name.
        walk: ``"default"``, a variant of ``plan_route``, or :data:`SWEEP`.
        outcome: of the certificate with forces, or what the planner said of why there is no plan.
        found: whether it is the kind of walk that was asked for.
        passed: whether it passes in physics.
        duration: of the plan [s]; NaN for none.
        walked: until the walk has ended in physics, with what the controller waits [s].
        planning: processor time of the planner for each step [ms].
        told: what physics said of a walk that does not pass.
    """

    seed: int
    robot: str
    walk: str
    outcome: str = ""
    found: bool = False
    passed: bool = False
    duration: float = float("nan")
    walked: float = float("nan")
    planning: float = float("nan")
    told: str = ""

    @property
    def kept(self) -> bool:
        """Whether the certificate finds nothing violated."""
        return self.outcome in ("certified", "not all checked")

    @property
    def planned(self) -> bool:
        """Whether there is a plan."""
        return self.duration == self.duration


def benchmark_robot(name: str) -> gaitopt.Quadruped:
    """A robot of the table; solo12 with limits that make sense."""
    if name == "solo12":
        return gaitopt.load_robot(name, effort_limits=SOLO_EFFORT, velocity_limits=SOLO_VELOCITY)
    return gaitopt.load_robot(name)


def made(
    robot: gaitopt.Quadruped, row: Row, certify: bool, physics: bool, before: Iterable[Row] = ()
) -> Row:
    """The row, with what becomes of its walk.

    Args:
        robot: the robot.
        row: what to make.
        certify: whether its certificate is made.
        physics: whether it is walked in physics.
        before: rows that were made, by which a sweep knows where to begin.
    """
    footholds = gaitopt.s_columns(row.seed, columns=COLUMNS, robot=robot)
    if row.walk == SWEEP:
        passed = [
            speed_of(r) for r in before if (r.robot, r.walk) == (row.robot, SWEEP) and r.planned
        ]
        top = max(passed) + FASTER if len(passed) >= WHOLE_SWEEPS else FIRST_SPEED
        top = min(top, FIRST_SPEED)
        return _swept(robot, footholds, row, top)
    began = process_time()
    try:
        if row.walk == "default":
            plan = gaitopt.plan_crawl(robot, footholds)
        else:
            plan = gaitopt.plan_route(robot, footholds, free=row.walk)
    except gaitopt.GaitoptError as error:
        return replace(row, outcome=f"no plan: {error}")
    planning = 1e3 * (process_time() - began) / footholds.steps
    row = replace(row, duration=plan.duration, planning=planning,
                  found=getattr(plan.record, "instead", None) is None)  # fmt: skip
    if certify:
        certificate = gaitopt.verify(plan)
        told = "; ".join(str(check) for check in certificate.violations)
        row = replace(row, outcome=str(certificate.outcome), told=told)
    if physics:
        result = gaitopt.simulate(plan)
        told = "; ".join([row.told, *([] if result.passed else str(result).splitlines())])
        row = replace(row, passed=result.passed, walked=result.end - WATCHED, told=told.strip("; "))
    return row


def speed_of(row: Row) -> float:
    """The speed of a walk that a sweep found [m/s]."""
    return float(row.told.removesuffix(" m/s"))


def _swept(robot: gaitopt.Quadruped, footholds: gaitopt.Footholds, row: Row, top: float) -> Row:
    """The fastest walk of a fixed speed that passes; one that joints hold back is not run twice."""

    def plan_at(speed: float) -> gaitopt.Plan:
        return gaitopt.plan_crawl(robot, footholds, speed=speed, timing="velocity")

    last, slower = float("nan"), [speed for speed in SPEEDS if speed <= top + 1e-9]
    for speed in slower:
        plan = plan_at(speed)
        if plan.duration == last:
            continue
        last = plan.duration
        result = gaitopt.simulate(plan)
        if not result.passed:
            continue
        if speed == slower[0] and plan_at(max(SPEEDS)).duration < plan.duration:
            return _swept(robot, footholds, row, max(SPEEDS))
        return replace(row, duration=plan.duration, walked=result.end - WATCHED, found=True,
                       passed=True, told=f"{speed} m/s")  # fmt: skip
    return replace(row, told="no speed passes")


def wanted(seeds: int, robots: list[str], walks: list[str]) -> Iterator[Row]:
    """The rows to make, those of a terrain together, so that a part of the table is fair."""
    for seed in range(seeds):
        for robot in robots:
            for walk in walks:
                yield Row(seed, robot, walk)


class RowFile:
    """Rows in a CSV file, or only in memory where there is no ``path``."""

    def __init__(self, path: str | None) -> None:
        self._path = None if path is None else Path(path)
        self.rows: dict[tuple[int, str, str], Row] = {}
        if self._path is not None and self._path.exists():
            with self._path.open(newline="") as file:
                for texts in csv.DictReader(file):
                    self._keep(_row(texts))

    def _keep(self, row: Row) -> None:
        self.rows[row.seed, row.robot, row.walk] = row

    def __contains__(self, row: Row) -> bool:
        """Whether this walk was made."""
        return (row.seed, row.robot, row.walk) in self.rows

    def add(self, row: Row) -> None:
        """Keep a row, and write it at once."""
        self._keep(row)
        if self._path is None:
            return
        new = not self._path.exists()
        with self._path.open("a", newline="") as file:
            writer = csv.DictWriter(file, [field.name for field in fields(Row)])
            if new:
                writer.writeheader()
            writer.writerow(asdict(row))


def _row(texts: dict[str, str]) -> Row:
    """A row out of the texts of its file."""
    return Row(
        int(texts["seed"]), texts["robot"], texts["walk"], texts["outcome"],
        texts["found"] == "True", texts["passed"] == "True", float(texts["duration"]),
        float(texts["walked"]), float(texts["planning"]), texts["told"],
    )  # fmt: skip
