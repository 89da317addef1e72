"""The quickest way from a state to rest on four feet for which limits are kept and forces exist."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.entering.begin import Begin
from gaitopt.entering.braking import Entry, body_rests, entries
from gaitopt.entering.joint_limits import Fault
from gaitopt.entering.judging import Judge
from gaitopt.entering.steering import MARGINS, steered_entries
from gaitopt.errors import GaitoptError, InfeasibleStateError
from gaitopt.motion.body_and_feet import body_and_feet_path
from gaitopt.motion.path import MotionPath

FOOT_TOLERANCE = 1e-6
"""Largest distance of a foot from its place between knots [m]."""
AT_A_TIME = 128
"""Entries that are looked at together at a few instants."""


@dataclass(frozen=True, eq=False)
class Landed:
    """An entry that ends at rest on four feet.

    Attributes:
        path: of body and joints.
        landings: when each foot lands that was in the air [s].
        base: where the base comes to rest ``(6,)``.
    """

    path: MotionPath
    landings: dict[str, float]
    base: FloatArray


def landed(
    begin: Begin, limits: ForceLimits, accelerations: FloatArray, swing_height: float
) -> Landed | None:
    """The quickest entry to rest on four feet; ``None`` for a robot that rests on them already.

    Args:
        begin: the state.
        limits: on forces and torques.
        accelerations: that joints keep ``(nj,)`` [rad/s^2]; infinite for none.
        swing_height: how far feet may rise on their way down [m].

    Raises:
        InfeasibleStateError: there is none; names the limit, by how much and when it is exceeded in
            the one that exceeds its limits least.
    """
    if begin.standing.sum() < 2:
        raise InfeasibleStateError(
            f"start: the robot stands on {len(LEGS) - len(begin.flying)} feet, and a plan begins "
            "on two or more; begin when they have landed",
            "contact", float(begin.standing.sum()), 2.0, "feet",
        )  # fmt: skip
    judge = Judge.of(begin, limits, accelerations)
    if not begin.flying and body_rests(begin):
        judge.check_rest(begin)
        return None
    faults: list[Fault] = []
    # On two feet hardly any other path has forces than one that is made for them.
    braking, rests = begin.standing.sum() > 2, body_rests(begin)
    tries: list[Callable[[], list[Entry]]] = [
        lambda: entries(begin, swing_height, all_ways=False) if braking else [],
        lambda: entries(begin, swing_height, all_ways=True) if braking and rests else [],
    ]
    for ways in tries:
        found = _first(judge, ways(), faults)
        if found is not None:
            return found
    steered = (steered_entries(begin, judge, swing_height, margin) for margin in MARGINS)
    for entries_of_landing in chain.from_iterable(steered):
        for entry in entries_of_landing:
            fault, found = _tried(judge, entry)
            if found is not None:
                return found
            faults += [fault] if fault else []
            if fault is not None and fault.time < max(entry.landings.values(), default=0.0):
                # How the body brakes afterwards changes nothing of that.
                break
    raise judge.refusal(
        min(faults, key=lambda fault: (not fault.of_forces, fault.share), default=None)
    )


def _first(judge: Judge, ways: list[Entry], faults: list[Fault]) -> Landed | None:
    """The first entry that keeps all limits; what others lack is added to the faults."""
    for first in range(0, len(ways), AT_A_TIME):
        fast, fault = judge.quick(ways[first : first + AT_A_TIME])
        faults += [fault] if fault else []
        for entry in fast:
            fault, found = _tried(judge, entry)
            if found is not None:
                return found
            faults += [fault] if fault else []
    return None


def _tried(judge: Judge, entry: Entry) -> tuple[Fault | None, Landed | None]:
    """What is wrong with an entry, or the entry."""
    knots = entry.knots()
    try:
        path = body_and_feet_path(judge.robot, knots, entry.body.at, entry.feet, FOOT_TOLERANCE)
    except GaitoptError:
        # A leg is too short between two of the knots.
        return None, None
    fault = judge.path(path, entry.landings)
    if fault is not None:
        return fault, None
    return None, Landed(path, entry.landings, entry.body.at(knots[-1:])[0][0])
