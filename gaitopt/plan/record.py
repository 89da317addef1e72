"""What a planner tells of its work beside the plan itself: one typed record a planner."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any, ClassVar

from gaitopt.errors import InputError


@dataclass(frozen=True)
class PlanRecord:
    """What every plan tells. ``None`` stands for what a planner does not know.

    Attributes:
        stability: which kind of balance the plan's margins are about, in words.
        zmp_margin: smallest margin of the ZMP that the planner found [m].
    """

    planner: ClassVar[str] = ""

    stability: str = ""
    zmp_margin: float | None = None

    def __post_init__(self) -> None:
        # Late, as it imports NumPy: the command line imports the names of records alone.
        from gaitopt.inputs import as_text, is_real

        for f in fields(self):
            value = getattr(self, f.name)
            text = isinstance(value, str) and str(f.type).startswith("str")
            number = is_real(value) and value == value and not str(f.type).startswith("str")
            missing = value is None and str(f.type).endswith("None")
            if not (text or number or missing):
                raise InputError(f"the record's {f.name} is {as_text(value)}, which says nothing")

    def to_dict(self) -> dict[str, Any]:
        """The record as plain JSON values, without what is not known."""
        return {name: value for name, value in asdict(self).items() if value is not None}


@dataclass(frozen=True)
class CrawlRecord(PlanRecord):
    """Of a walk planned phase by phase.

    Attributes:
        cog_error_bound: largest bound on the distance of a body centre's target from the true
            optimum [m].
        free_order_gain: share of the time that the order of legs that was searched for saves;
            where the settings' own order is possible, too.
    """

    planner: ClassVar[str] = "crawl"

    cog_error_bound: float | None = None
    free_order_gain: float | None = None


@dataclass(frozen=True)
class RouteRecord(PlanRecord):
    """Of a time-optimal walk. Residuals are worked out anew at the end.

    Attributes:
        knot_time: time of the walk by its knots alone [s].
        solver_seconds: processor time that the planner took [s].
        solver_iterations: Newton steps of all solutions.
        stationarity: largest entry of the Lagrangian's gradient.
        violation: largest violation of an inequality.
        complementarity: sum of multiplier times value: how far the walk's time can be from the
            optimum of the linearised problem [s]. Where a walk is planned in windows, these three
            are the largest ones, and the sum, of all of them.
        clearance: smallest height of a flying foot over the higher of its footholds, outside the
            columns [m].
        windows, window_share: with a horizon, how many windows were planned, and the largest time
            that one took, as a share of the time that the robot walks on what is kept of it.
        orders_feasible: with a free order, how many orders of legs gave a plan.
        instead: why the plan is the walk phase by phase, with box swings, and not along splines.
    """

    planner: ClassVar[str] = "route"

    knot_time: float | None = None
    solver_seconds: float | None = field(default=None, compare=False)
    solver_iterations: int | None = None
    stationarity: float | None = None
    violation: float | None = None
    complementarity: float | None = None
    clearance: float | None = None
    windows: int | None = None
    window_share: float | None = field(default=None, compare=False)
    orders_feasible: int | None = None
    instead: str | None = None


@dataclass(frozen=True)
class GaitRecord(PlanRecord):
    """Of a gait by velocity.

    ``zmp_margin`` is the smallest margin of the ZMP while any foot stands [m] (minus the distance
    from the support line for a trot): of the whole robot's with the timing ``"forces"``, and else
    of the body centre's.

    Attributes:
        flight: share of the time without a foot on the ground, where there is no ZMP.
    """

    planner: ClassVar[str] = "gait"

    flight: float | None = None


@dataclass(frozen=True)
class StrideRecord(PlanRecord):
    """Of a walk over an obstacle.

    Attributes:
        clearance: distance from the obstacle that no part of the robot falls short of [m].
        foot_margin: the same of the feet's balls on their way over it [m].
        energy_margin: least energy that tips the robot while a foot flies [J].
        nearest: which part comes nearest, and when.
        lines_for_meshes: links whose meshes are replaced by lines along the legs.
        gap_front_before, gap_front_after: gaps between the obstacle and the front feet, before and
            after they are taken over it [m].
        gap_hind_before, gap_hind_after: the same of the hind feet [m].
    """

    planner: ClassVar[str] = "stride"

    clearance: float | None = None
    foot_margin: float | None = None
    energy_margin: float | None = None
    nearest: str | None = None
    lines_for_meshes: str | None = None
    gap_front_before: float | None = None
    gap_front_after: float | None = None
    gap_hind_before: float | None = None
    gap_hind_after: float | None = None


RECORDS: Mapping[str, type[PlanRecord]] = {
    kind.planner: kind for kind in (CrawlRecord, RouteRecord, GaitRecord, StrideRecord)
}
"""The record of every planner, by its name in plan files."""


def record_from_dict(planner: str, stored: Mapping[str, Any]) -> PlanRecord:
    """The record of a plan file; what this version does not know is left out.

    Raises:
        InputError: a value is of the wrong kind.
    """
    kind = RECORDS.get(planner, PlanRecord)
    known = {f.name for f in fields(kind)}
    return kind(**{name: value for name, value in stored.items() if name in known})
