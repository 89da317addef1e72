"""The lanes of a race on one terrain, with their plans and certificates."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from rich.table import Table

from gaitopt.certificate.certificate import Certificate
from gaitopt.errors import UnknownNameError
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import RouteRecord
from gaitopt.plan.settings.base import VELOCITY
from gaitopt.studies.race_standings import PAPER, Finish, Standings
from gaitopt.studies.tables import one_line
from gaitopt.terrain.footholds import Footholds


@dataclass(frozen=True, eq=False)
class Lane:
    """One row of a race on one terrain, with its plan.

    Attributes:
        name: name of the row.
        plan: its plan; ``None`` where planning failed.
        error: why planning or the certificate failed; otherwise empty.
        solve_time: processor time for planning [s].
        certificate: of the plan; ``None`` where none was asked for, or it failed.
        bound: lower bound on the time of this row [s]; ``nan`` where there is none.
    """

    name: str
    plan: Plan | None
    error: str
    solve_time: float
    certificate: Certificate | None
    bound: float = np.nan

    def finish(self, seed: int = -1) -> Finish:
        """The lane in numbers; ``seed`` is that of the terrain."""
        if self.plan is None:
            return Finish(seed, self.name, solve_time=self.solve_time, message=self.error)
        verdict, message = "unchecked", self.error
        if self.certificate is not None:
            verdict = str(self.certificate.outcome)
            message = one_line("; ".join(map(str, self.certificate.violations)))
        message = message or _instead(self.plan)
        margin, dynamic = _margin(self.plan)
        return Finish(seed, self.name, self.plan.duration, self.plan.mean_speed, self.bound,
                      self.solve_time, margin, dynamic, verdict, message)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Race:
    """All rows on the same footholds.

    Attributes:
        robot: name of the robot.
        footholds: that were walked over.
        lanes: one for each row.
        timing: what bounds the speed of all rows but the paper's: ``"velocity"`` or ``"forces"``.
    """

    robot: str
    footholds: Footholds
    lanes: tuple[Lane, ...]
    timing: str = VELOCITY

    def __getitem__(self, name: str) -> Lane:
        for lane in self.lanes:
            if lane.name == name:
                return lane
        raise UnknownNameError(
            f"no row {name!r}; there are {', '.join(x.name for x in self.lanes)}"
        )

    @property
    def plans(self) -> dict[str, Plan]:
        """The plans by their rows' names."""
        return {lane.name: lane.plan for lane in self.lanes if lane.plan is not None}

    @property
    def standings(self) -> Standings:
        """The race in numbers."""
        return Standings(
            self.robot, self.footholds.steps, tuple(lane.name for lane in self.lanes),
            tuple(lane.finish() for lane in self.lanes), self.plans, self.timing,
        )  # fmt: skip

    def ratio(self, name: str, baseline: str = PAPER) -> float:
        """How many times faster a row is than ``baseline``; ``nan`` where either has no plan."""
        return float(self.standings.ratios(name, baseline)[0])

    def table(self) -> Table:
        """The race as a table to print."""
        return self.standings.table()

    def __str__(self) -> str:
        return str(self.standings)


def _margin(plan: Plan) -> tuple[float, bool]:
    """The smallest margin that a plan promises [m], and whether it is that of the ZMP."""
    zmp = plan.record.zmp_margin
    dynamic = not plan.settings.static
    return (zmp if dynamic and zmp is not None else plan.margin), dynamic


def _instead(plan: Plan) -> str:
    """Why a plan is a walk phase by phase, and not along splines; empty where it is not."""
    told = plan.record.instead if isinstance(plan.record, RouteRecord) else None
    return f"phase by phase: {one_line(told)}" if told else ""
