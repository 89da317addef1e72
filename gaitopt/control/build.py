"""Samples a plan into the reference that a controller follows."""

from __future__ import annotations

import numpy as np

from gaitopt.control.averaged_reference import averaged_reference
from gaitopt.control.clock import walk_clock
from gaitopt.control.exact_reference import exact_reference
from gaitopt.control.gains import ControlGains
from gaitopt.control.reference import Reference
from gaitopt.errors import InputError
from gaitopt.plan.plan import Plan

MOST_TICKS = 1_000_000
"""Most ticks of a reference, which takes about 1 kB each: 100 minutes at 6 ms."""


def build_reference(plan: Plan, gains: ControlGains, dt: float) -> Reference:
    """Sample ``plan`` for a controller that runs every ``dt`` seconds.

    A static walk stands still where one foot lifts off as another lands (:func:`walk_clock`). A
    plan that promises forces is followed as it is, with its forces; any other one is averaged over
    short times.

    Args:
        plan: the motion.
        gains: of the controller.
        dt: time between ticks [s].

    Raises:
        InputError: ``dt`` is no positive time or makes too many ticks, or a leg has no roll joint.
    """
    if not (np.isfinite(dt) and dt > 0 and plan.duration / dt < MOST_TICKS):
        raise InputError(
            f"the control interval must be a positive time, got {dt!r}; it makes at most "
            f"{MOST_TICKS:.0e} ticks of {plan.duration:.1f} s (a longer walk goes in parts)"
        )
    for name, leg in plan.robot.legs.items():
        if not leg.has_roll:
            raise InputError(
                f"{plan.robot.name}: leg {name} has two joints; the tracking controller needs three"
            )
    clock = walk_clock(plan, gains.handover_time)
    limits = plan.settings.promised_forces
    if limits is None:
        return averaged_reference(plan, clock, gains, dt)
    return exact_reference(plan, clock, gains, dt, limits)
