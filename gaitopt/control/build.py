"""Samples a plan into the reference that a controller follows."""

from __future__ import annotations

from gaitopt.control.averaged_reference import averaged_reference
from gaitopt.control.clock import walk_clock
from gaitopt.control.exact_reference import exact_reference
from gaitopt.control.gains import ControlGains
from gaitopt.control.reference import Reference
from gaitopt.inputs import check_kind, check_number
from gaitopt.plan.plan import Plan

MOST_TICKS = 1_000_000
"""Most ticks of a reference, which takes about 1 kB each: 100 minutes at 6 ms."""
SHORTEST = 1e-3
"""Walks that take less time than this count as this long [s], so that ticks last some time."""
LONGEST_INTERVAL = 1.0
"""Longest time between ticks [s]: with longer ones no robot is controlled."""


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
        InputError: ``gains`` are something else, ``dt`` is no positive time, too long, or makes too
            many ticks.
    """
    check_kind("gains", gains, ControlGains)
    least = max(plan.duration, SHORTEST) / MOST_TICKS
    check_number("the control interval", dt, least, LONGEST_INTERVAL, "s",
                 "; longer walks go in parts")  # fmt: skip
    clock = walk_clock(plan, gains.handover_time)
    limits = plan.settings.promised_forces
    if limits is None:
        return averaged_reference(plan, clock, gains, dt)
    return exact_reference(plan, clock, gains, dt, limits)
