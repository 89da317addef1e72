"""One check of a certificate, and how a worst value is held against its limit."""

from __future__ import annotations

from dataclasses import dataclass
from math import isnan, nan

import numpy as np

from gaitopt.conventions import FloatArray, TextEnum
from gaitopt.plan.plan import Plan

FORCES = "contact forces"
"""Name of the check without which no plan is certified."""
ASKED_FORCES = "contact forces as asked"
"""Its name where a plan promises forces, and others are asked for beside them."""


class Verdict(TextEnum):
    """What a check found. Members equal their texts: ``check.status == "ok"``."""

    OK = "ok"
    """Nothing is violated at any instant."""
    VIOLATED = "violated"
    """A limit is exceeded, or it could not be shown that it is kept."""
    UNCHECKED = "unchecked"
    """The check does not apply, or could not be made; its note says why."""


@dataclass(frozen=True)
class Check:
    """One thing that was checked.

    Attributes:
        name: what was checked.
        status: the verdict.
        worst: its worst value over all instants, with the bounds for the time between samples;
            ``nan`` when unchecked.
        limit: what the worst value is held against.
        unit: of both.
        sense: ``"<="`` or ``">="``: how the worst value must compare with the limit.
        bound: how much of the worst value is a bound for the time between samples.
        when: time of the worst value [s]; ``nan`` where no single time is to blame.
        where: the leg, joint, phase or pair that it belongs to.
        note: what a reader should know.
        promised: whether the plan promises what is checked. What is not promised may be exceeded
            without making the plan wrong, but then the plan is not certified.
    """

    name: str
    status: Verdict
    worst: float
    limit: float
    unit: str
    sense: str = "<="
    bound: float = 0.0
    when: float = nan
    where: str = ""
    note: str = ""
    promised: bool = True

    def __str__(self) -> str:
        if self.status is Verdict.UNCHECKED:
            return f"{self.name}: {self.status} ({self.note})"
        place = "" if isnan(self.when) else f" at {self.when:.4f} s"
        status = self.status if self.promised else f"{self.status} (not promised)"
        told = f" ({self.about})" if self.about else ""
        return (
            f"{self.name}: {status}, {self.worst:.6g} {self.sense} {self.limit:.6g} "
            f"{self.unit}{place}{told}"
        )

    @property
    def about(self) -> str:
        """Where it is and what a reader should know, in one text."""
        parts = [self.where, *([] if self.note in self.where else [self.note])]
        return "; ".join(part for part in parts if part)


JUMP = 1e-9
"""Largest jump of body or joints at a knot that counts as rounding [m, rad]. Pieces of a path that
meet in exact arithmetic differ by about 1e-16 times their terms, which are metres and radians."""
RELATIVE = 1e-9
"""Share by which a joint may exceed a limit and it counts as rounding. A knot's time is rounded to
1e-16 of the walk's duration, so the rate on a piece of 1 ms in a walk of 1000 s is known to 1e-10.
"""
SHORT = 1e-6
"""Shortfall of swing height, clearance, reach or margin that counts as rounding [m]. Chosen: a
thousand times the tolerance of the planners' solvers, and a thousandth of what a robot can keep."""


def unchecked(name: str, unit: str, note: str, limit: float = nan, *, needed: bool = True) -> Check:
    """A check that was not made; ``note`` says why.

    Args:
        name, unit, note, limit: as in :class:`Check`.
        needed: whether a plan can only be certified with it.
    """
    return Check(name, Verdict.UNCHECKED, nan, limit, unit, note=note, promised=needed)


def judged(
    name: str,
    worst: float,
    limit: float,
    unit: str,
    sense: str = "<=",
    *,
    bound: float = 0.0,
    when: float = nan,
    where: str = "",
) -> Check:
    """The check of a worst value, held against its limit; see :class:`Check` for the arguments."""
    # A comparison with NaN is false: what cannot be compared is violated.
    good = worst <= limit if sense == "<=" else worst >= limit
    verdict = Verdict.OK if good else Verdict.VIOLATED
    return Check(name, verdict, worst, limit, unit, sense, float(bound), float(when), where)


def worst_place(array: FloatArray) -> tuple[int, int]:
    """Row and column of the largest number of ``array (m, n)``."""
    row, column = np.unravel_index(int(np.argmax(array)), array.shape)
    return int(row), int(column)


def column_name(plan: Plan, column: int) -> str:
    """What a column of the plan's path holds: a coordinate of the base, or a joint's name."""
    names: tuple[str, ...] = ("x", "y", "z", "roll", "pitch", "yaw", *plan.robot.joint_names)
    return names[column]


def phase_name(plan: Plan, index: int) -> str:
    """A phase in words, for messages."""
    if not plan.phases:
        return "standing"
    phase = plan.phases[index]
    return f"{phase.kind} {phase.leg}, step {phase.step}"
