"""The quickest way from a state to rest on four feet for which limits are kept and forces exist."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain, islice

from gaitopt.conventions import FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.entering.begin import Begin, check_apart, check_few_feet
from gaitopt.entering.braking import Entry, body_rests, entries
from gaitopt.entering.joint_limits import Fault
from gaitopt.entering.judging import Judge
from gaitopt.entering.steering import MARGINS, steered_entries
from gaitopt.errors import GaitoptError
from gaitopt.motion.body_and_feet import body_and_feet_path
from gaitopt.motion.path import MotionPath

FOOT_TOLERANCE = 1e-6
"""Largest distance of a foot from its place between knots [m]."""
AT_A_TIME = 128
"""Entries that are looked at together at a few instants."""
FEW = 8
"""Braking entries that are looked at at every instant, at some 30 ms each, before the body is
steered; the others come after that. At 56 instants of seven plans one of the first six was found
good, or none of up to 229."""


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
    begin: Begin, limits: ForceLimits, accelerations: FloatArray, swing_height: float,
    reach_fraction: float,
) -> Landed | None:  # fmt: skip
    """The quickest entry to rest on four feet; ``None`` for a robot that rests on them already.

    Args:
        begin: the state.
        limits: on forces and torques.
        accelerations: that joints keep ``(nj,)`` [rad/s^2]; infinite for none.
        swing_height: how far feet may rise on their way down [m].
        reach_fraction: share of the legs' reach that is used.

    Raises:
        InfeasibleStateError: there is none; names the limit, by how much and when it is exceeded in
            the one that exceeds its limits least.
    """
    check_few_feet(int(begin.standing.sum()))
    judge = Judge.of(begin, limits, accelerations, reach_fraction)
    if not begin.flying and body_rests(begin):
        judge.check_rest(begin)
        check_apart(begin.robot, begin.joints)
        return None
    check_apart(begin.robot, begin.joints)
    faults: list[Fault] = []
    # On two feet hardly any other path has forces than one that is made for them.
    ways = (False, True) if body_rests(begin) else (False,)
    braked = [_braked(begin, judge, swing_height, faults, all_ways=every) for every in ways]
    if begin.standing.sum() <= 2:
        braked = []
    steered = _steered(begin, judge, swing_height, faults)
    lowered = _braked(begin, judge, swing_height, faults, all_ways=False, lowered=True)
    last = [] if body_rests(begin) else [lowered]
    for found in chain(*(islice(tries, FEW) for tries in braked), steered, *braked, *last):
        if found is not None:
            return found
    raise judge.refusal(
        min(faults, key=lambda fault: (not fault.of_forces, fault.share), default=None),
        lies=bool(begin.flying) and body_rests(begin),
    )


def _braked(
    begin: Begin, judge: Judge, swing_height: float, faults: list[Fault], *, all_ways: bool,
    lowered: bool = False,
) -> Iterator[Landed | None]:  # fmt: skip
    """Entries whose body brakes along its velocity: each that keeps all limits, or ``None``.

    Args:
        begin, judge, swing_height: as above.
        faults: what entries lack is added.
        all_ways: whether feet land in all ways.
        lowered: whether the body sinks.
    """
    found = entries(begin, swing_height, all_ways=all_ways, lowered=lowered)
    for first in range(0, len(found), AT_A_TIME):
        fast, fault = judge.quick(found[first : first + AT_A_TIME])
        faults += [fault] if fault else []
        for entry in fast:
            fault, landing = _tried(judge, entry)
            faults += [fault] if fault else []
            yield landing


def _steered(
    begin: Begin, judge: Judge, swing_height: float, faults: list[Fault]
) -> Iterator[Landed | None]:
    """Entries whose body is steered, in the same way."""
    steered = (steered_entries(begin, judge, swing_height, margin) for margin in MARGINS)
    for entries_of_landing in chain.from_iterable(steered):
        for entry in entries_of_landing:
            fault, landing = _tried(judge, entry)
            faults += [fault] if fault else []
            yield landing
            if fault is not None and fault.time < max(entry.landings.values(), default=0.0):
                # How the body brakes afterwards changes nothing of that.
                break


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
