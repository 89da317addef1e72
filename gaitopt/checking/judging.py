"""What all checks of a certificate share: tolerances, places and verdicts."""

from __future__ import annotations

from math import nan

import numpy as np

from gaitopt.checking.certificate import Check
from gaitopt.conventions import FloatArray
from gaitopt.planning.plan import Plan

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
