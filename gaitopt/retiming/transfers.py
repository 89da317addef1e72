"""Timings in which loads go over from foot to foot within the time that limits ask for.

The normal force of a foot may grow with the time since it has landed, and with that until it lifts
off (:mod:`gaitopt.plan.load_transfer`). At a place of a course this is a limit on a force, once
these times are known. They are taken from another timing:

* Of the timing without such limits, which is faster at every place. So the times are too short, the
  limits too low, and what is found keeps them.
* Of what was found, which is slower. These limits are too high; but those that are the lower ones
  of them and of the limits that belong to the timing found with them are kept, and allow more than
  the first ones.

Where the robot could rest if forces were free to jump, it must also be able to rest with these
limits, or there is no timing. So time is added where feet change: a rest before or after the
motion on four feet where it stops there, and elsewhere less speed while four feet stand.

Loads that nobody promises may go over *gently* all the same. Then a time is asked for as far as the
robot could rest with it, in the times that the course has itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.dynamics.chains.interval_programs import path_units
from gaitopt.dynamics.motion_polygons import MotionPolygons
from gaitopt.errors import InfeasibleStepError
from gaitopt.motion.path import MotionPath
from gaitopt.plan.load_transfer import most_normal_shares, stances
from gaitopt.plan.plan import Plan
from gaitopt.retiming.paced import PacedCourse
from gaitopt.retiming.pacing import Pacing
from gaitopt.retiming.reserves import PLANNED_SHARE, SHARE_OF_WEIGHT, tightened

REST_STEP = 0.125
"""By how much a rest grows at a time, as a share of the transfer time: after eight of these steps a
foot may carry the whole weight."""
SLOWER_STEP = 1.3
"""Factor by which a motion on four feet is slowed down at a time."""
LONGEST_REST = 1.5
"""Longest rest, as a share of the transfer time: a longer one changes nothing."""
GENTLE_SHARES = (1.0, 1.0 / 3.0)
"""Shares of the time in which loads go over gently: where the robot could not rest with one, the
next one is tried."""
MOST_STEPS = 30
"""Most times that time is added: 1.3 to the power of 30 is 2600."""
AT_ONCE = 1e-9
"""Instants that are nearer to each other are one [s]: times of long walks are known to 1e-12 s."""


def with_transfers(pacing: Pacing) -> Pacing:
    """The same, with largest normal forces; unchanged where forces are free to jump.

    Raises:
        InfeasibleStepError: somewhere there is no speed at which forces exist.
    """
    promised = pacing.promised
    if promised is None or promised.transfer_time == 0.0:
        return pacing
    motion, found = pacing.fastest()
    assert found is not None
    first = _able_to_rest(replace(pacing, before=None), motion, found.polygons)
    motion, _ = first.fastest()
    try:
        second = _with(first, _most(first, motion.begin, motion.end))
        faster, _ = second.fastest()
        most = _most(first, faster.begin, faster.end)
        third = _with(first, np.minimum(_most(first, motion.begin, motion.end), most))
        faster, _ = third.fastest()
    except InfeasibleStepError:
        # A program may fail near its limits. The first timing is there.
        return first
    return third if faster.times[-1] < motion.times[-1] else first


def with_gentle_loads(pacing: Pacing, time: float) -> Pacing:
    """The same, with loads that go over gently where the motion leaves a choice.

    It is a wish for timings whose course has nearly the right times, and no promise: nothing looks
    at it between the places of the grid.

    Args:
        pacing: of a course.
        time: within which a foot takes over the weight [s]; 0 for none. Where limits promise
            another time it is not looked at.
    """
    promised = pacing.promised
    if time == 0.0 or promised is None or promised.transfer_time > 0.0:
        return pacing
    pace = np.ones(len(pacing.grid.piece))
    most = np.full((len(pacing.places.s), len(LEGS)), np.inf)
    stuck = np.ones(len(most), dtype=np.bool_)
    for share in GENTLE_SHARES:
        asked = replace(promised, transfer_time=share * time)
        most[stuck] = _most(replace(pacing, promised=asked), pace, pace)[stuck]
        stuck = ~_resting(_at_rest(_with(pacing, most)), len(most))
        if not stuck.any():
            break
    most[stuck] = np.inf
    return _with(pacing, most)


def _with(pacing: Pacing, most: FloatArray) -> Pacing:
    """With largest normal forces at the places ``(N, 4)``, and nothing known of their polygons."""
    return replace(pacing, timing=replace(pacing.timing, most=most), before=None)


def _most(pacing: Pacing, begin: FloatArray, end: FloatArray) -> FloatArray:
    """Largest normal forces at the places, as shares of the weight ``(N, 4)``.

    Args:
        pacing: the course, with its rests.
        begin, end: squared speeds of a timing at both ends of the intervals ``(K,)``.
    """
    assert pacing.promised is not None
    clock = pacing.clock(begin, end)
    standing = pacing.course.standing[pacing.grid.piece]
    most = np.full((len(pacing.places.s), len(LEGS)), np.inf)
    for at, times in ((pacing.places.begin, clock.begin), (pacing.places.end, clock.end)):
        shares = most_normal_shares(pacing.promised, *clock.since_and_until(times))
        np.minimum.at(most, at, np.where(standing, shares, np.inf))
    return np.asarray(most - SHARE_OF_WEIGHT * PLANNED_SHARE)


def _able_to_rest(pacing: Pacing, motion: PacedCourse, polygons: MotionPolygons) -> Pacing:
    """With rests and lower speeds, so that the robot can rest wherever forces that jump let it.

    Args:
        pacing: without them.
        motion: its fastest timing.
        polygons: what is known of its places.
    """
    assert pacing.promised is not None
    free, changes = _resting(polygons, len(pacing.places.s)), _Changes.of(pacing)
    step = REST_STEP * pacing.promised.transfer_time
    squares = fastest = pacing.squares(motion)
    for _ in range(MOST_STEPS):
        begin, end = squares[pacing.places.begin], squares[pacing.places.end]
        # Elsewhere limits stay what they are: with them nothing is faster than without.
        limited = np.where(squares < fastest, squares, pacing.timing.squares)
        slow = replace(pacing, timing=replace(pacing.timing, squares=limited))
        held = _with(slow, _most(pacing, begin, end))
        stuck = free & ~_resting(_at_rest(held), len(free))
        rests, factors = changes.more_time(stuck, pacing, (begin, end), step)
        if not rests.any() and (factors == 1.0).all():
            break
        pacing = replace(pacing, rests=pacing.rests + rests)
        squares = squares / factors**2
    return held


def _at_rest(pacing: Pacing) -> MotionPolygons:
    """What is known of the places before any timing."""
    assert pacing.promised is not None and pacing.dynamics is not None
    robot, limits = pacing.course.robot, tightened(pacing.promised, PLANNED_SHARE)
    intervals, timing = pacing.intervals, pacing.timing
    units = path_units(robot, pacing.dynamics, intervals, timing)
    return MotionPolygons.at_rest(
        robot, pacing.dynamics, intervals, limits, timing, units, sides=False
    )


def _resting(polygons: MotionPolygons, count: int) -> BoolArray:
    """At which of ``count`` places the robot can rest, on all sets of feet that stand there."""
    out = np.ones(count, dtype=np.bool_)
    np.logical_and.at(out, polygons.places.samples, polygons.resting)
    return out


@dataclass(frozen=True, eq=False)
class _Changes:
    """Where feet land and lift off.

    Attributes:
        stops: whether the motion stops where an interval begins ``(K,)``.
        landed, lifted: the interval with which each foot's stance begins, and the first one behind
            it ``(K, 4)``.
        four: number of the motion on four feet that each interval belongs to ``(K,)``; -1 for none.
    """

    stops: BoolArray
    landed: np.ndarray
    lifted: np.ndarray
    four: np.ndarray

    @classmethod
    def of(cls, pacing: Pacing) -> _Changes:
        """Those of a course."""
        standing = pacing.course.standing[pacing.grid.piece]
        count = len(standing)
        stops = np.zeros(count + 1, dtype=np.bool_)
        stops[pacing.grid.first] = True
        number = np.arange(count, dtype=np.float64)
        # An interval that ends where the next one begins: its number stands for both times.
        spans = stances(standing, number, number + 1.0)
        on_four = standing.all(axis=1)
        begins = on_four & ~np.append(False, on_four[:-1])
        four = np.where(on_four, np.cumsum(begins) - 1, -1)
        landed, lifted = np.maximum(spans.landed, 0.0), np.minimum(spans.lifted, count)
        return cls(stops, landed.astype(int), lifted.astype(int), four)

    def more_time(
        self, stuck: BoolArray, pacing: Pacing, squares: tuple[FloatArray, FloatArray], step: float
    ) -> tuple[FloatArray, FloatArray]:
        """Rests and lower speeds beside those that there are.

        Args:
            stuck: places at which the robot cannot rest ``(N,)``.
            pacing: the course, with its rests.
            squares: squared speeds at both ends of the intervals, each ``(K,)``.
            step: by which a rest grows [s].

        Returns:
            Times to rest before intervals ``(K,)`` [s], and factors by which to slow down at places
            ``(N,)``.
        """
        assert pacing.promised is not None
        clock = pacing.clock(*squares)
        standing = pacing.course.standing[pacing.grid.piece]
        rests, factors = np.zeros(len(standing) + 1), np.ones(len(stuck))
        slow = np.zeros(int(self.four.max(initial=-1)) + 2, dtype=np.bool_)
        for at, times in ((pacing.places.begin, clock.begin), (pacing.places.end, clock.end)):
            own = np.flatnonzero(stuck[at])
            since, until = clock.since_and_until(times)
            left = np.where(standing, np.minimum(since, until), np.inf)[own]
            foot, row = left.argmin(axis=1), np.arange(len(own))
            known = np.isfinite(left[row, foot])
            own, foot = own[known], foot[known]
            change = np.where(since[own, foot] <= until[own, foot],
                              self.landed[own, foot], self.lifted[own, foot])  # fmt: skip
            resting = self.stops[change]
            rests[change[resting]] = step
            moving = change[~resting]
            slow[self.four[moving - 1]] = slow[self.four[moving]] = True
        slow[-1] = False
        for at in (pacing.places.begin, pacing.places.end):
            factors[at[slow[self.four]]] = SLOWER_STEP
        rests = np.where(pacing.rests < LONGEST_REST * pacing.promised.transfer_time,
                         rests[:-1], 0.0)  # fmt: skip
        return rests, factors


def rested(plan: Plan, motion: PacedCourse, rests: FloatArray) -> Plan:
    """A plan that rests on four feet before intervals of its motion.

    Args:
        plan: with the path and the phases of the motion.
        motion: the motion.
        rests: how long to rest before each interval ``(K,)`` [s].
    """
    before, path = np.flatnonzero(rests), plan.path
    if not len(before):
        return plan
    nearest = [int(np.abs(path.times - time).argmin()) for time in motion.times[before].tolist()]
    knots, which = np.unique(nearest, return_inverse=True)
    lengths = np.bincount(which, rests[before])
    still = np.zeros((len(path.coefficients), len(knots), path.coefficients.shape[2]))
    still[-1] = path.knots()[knots]
    so_far = np.concatenate([[0.0], np.cumsum(lengths)])
    times = path.times + so_far[np.searchsorted(knots, np.arange(len(path.times)))]
    longer = MotionPath(
        np.insert(times, knots + 1, times[knots] + lengths),
        np.insert(path.coefficients, knots, still, axis=1),
    )
    # The phase on four feet that begins or ends at a rest lasts longer.
    stances = [(i, p) for i, p in enumerate(plan.phases) if p.kind == "stance"]
    owners = np.array([
        next(i for i, p in stances if p.start - AT_ONCE <= when <= p.end + AT_ONCE)
        for when in path.times[knots].tolist()
    ])  # fmt: skip
    own = np.bincount(owners, lengths, minlength=len(plan.phases)).tolist()
    shifts = so_far[np.searchsorted(owners, np.arange(len(plan.phases)))].tolist()
    phases = tuple(
        replace(phase, start=phase.start + shift, duration=phase.duration + rest)
        for phase, shift, rest in zip(plan.phases, shifts, own, strict=True)
    )
    return replace(plan, path=longer, phases=phases)
