"""One check of a certificate, and how values are judged."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.plan.plan import Plan


@dataclass(frozen=True)
class Check:
    """One thing that was checked.

    Attributes:
        name: what.
        status: ``"ok"``, ``"violated"``, or ``"unchecked"`` where it could not be judged.
        worst: its worst value over all instants, bounds included; ``nan`` when unchecked.
        limit: what the worst value is held against.
        unit: of both.
        sense: ``"<="`` or ``">="``: how the worst value must compare with the limit.
        bound: how much of the worst value is a bound for the time between samples.
        when: time of the worst value [s]; ``nan`` where no single time is to blame.
        where: the leg, joint, phase or pair that it belongs to.
        note: what a reader should know.
    """

    name: str
    status: str
    worst: float
    limit: float
    unit: str
    sense: str = "<="
    bound: float = 0.0
    when: float = float("nan")
    where: str = ""
    note: str = ""

    def __str__(self) -> str:
        if self.status == "unchecked":
            return f"{self.name}: unchecked ({self.note})"
        place = f" at {self.when:.4f} s" if self.when == self.when else ""
        return (
            f"{self.name}: {self.status}, {self.worst:.6g} {self.sense} {self.limit:.6g} "
            f"{self.unit}{place}{f' ({self.where})' if self.where else ''}"
        )


JUMP = 1e-9
"""Largest jump of body or joints at a knot [m, rad]."""
RELATIVE = 1e-9
"""Relative excess of a joint's limits that counts as rounding."""
SHORT = 1e-6
"""Shortfall of swing height, reach and margin that counts as rounding [m]."""


def worst_place(array: FloatArray) -> tuple[int, int]:
    row, column = np.unravel_index(int(np.argmax(array)), array.shape)
    return int(row), int(column)


def column_name(plan: Plan, column: int) -> str:
    names: tuple[str, ...] = ("x", "y", "z", "roll", "pitch", "yaw", *plan.robot.joint_names)
    return names[column]


def phase_name(plan: Plan, index: int) -> str:
    if not plan.phases:
        return "standing"
    phase = plan.phases[index]
    return f"{phase.kind} {phase.leg}, step {phase.step}"


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
    # A comparison with NaN is false: what cannot be compared is violated.
    good = worst <= limit if sense == "<=" else worst >= limit
    return Check(name, "ok" if good else "violated", worst, limit, unit, sense, float(bound),
                 float(when), where)  # fmt: skip
