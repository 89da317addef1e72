"""How fast a path may be followed so that contact forces and joint torques can make the motion.

Along a path ``q(s)`` the equations of motion are linear in the path acceleration ``u = s''``, in
the squared path speed ``x = s'^2`` and in the contact forces, and so are all limits on forces and
torques [Hauser2014] [Pham2015]. The fastest timing then takes two sweeps, as with limits on joints
alone [Pham2018]: backward for the speeds from which the path can still be followed to its end, and
forward with the largest acceleration that these allow. With limits on joint velocities alone it is
the question of [Wang2020], Section IV.

Where the robot can rest at all places of a chain, the pairs ``(u, x)`` that have forces at a place
are a polygon around (0, 0). The sweeps then use the sides of polygons that are known, and cost
little; programs look for forces at what they found, and where there are none a side was not known.
So the last sweeps are those of the polygons themselves. On other chains every interval is a linear
program (:mod:`gaitopt.dynamics.chains.sweeps`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.chains.interval_programs import interval_programs, path_units
from gaitopt.dynamics.chains.sweeps import SLOWER, ProgramSweeps
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.motion_polygons import MotionPolygons
from gaitopt.dynamics.path_intervals import PathIntervals, TimingLimits
from gaitopt.dynamics.place_tables import used
from gaitopt.dynamics.small_programs import NO_BOUND
from gaitopt.dynamics.speed_sweeps import SweptIntervals, swept
from gaitopt.dynamics.whole_body import PathDynamics
from gaitopt.robots.quadruped import Quadruped

MOST_INTERVALS = 2000
"""Intervals whose linear programs are made at once: about 20 kB each."""
MOST_SWEEPS = 40
"""Most times that sweeps are repeated with more sides of polygons; 1 to 6 are usual."""


@dataclass(frozen=True, eq=False)
class ForceTiming:
    """The fastest timing of ``C`` chains of ``K`` intervals in all.

    Attributes:
        begin, end: squared path speeds at both ends of every interval ``(K,)`` [1/s^2].
        stuck: chains that cannot be followed at any speed ``(C,)``.
        places: of each such chain an interval on which no motion was found ``(C,)``; -1 for others.
        polygons: what was learnt of the polygons. It does not depend on velocity limits; limits of
            torques that fall with the speed stay those of the first timing.
        squares: largest squared path speeds for which it was found, at all samples ``(S,)``.
        sweeps: those by programs, of some of the chains: the last ones whose programs were made at
            once.
    """

    begin: FloatArray
    end: FloatArray
    stuck: BoolArray
    places: np.ndarray
    polygons: MotionPolygons
    squares: FloatArray
    sweeps: Mapping[int, ProgramSweeps] = field(default_factory=dict)


def fastest_with_forces(
    robot: Quadruped,
    dynamics: PathDynamics,
    intervals: PathIntervals,
    limits: ForceLimits,
    timing: TimingLimits,
    before: ForceTiming | None = None,
) -> ForceTiming:
    """The fastest timing, with forces, of many chains.

    On every interval the path acceleration is constant. Limits hold at both of its ends with that
    same acceleration. The first chain that has no timing is the last one that is looked at.

    Args:
        robot: the robot.
        dynamics: at all samples.
        intervals: between samples.
        limits: on forces and torques.
        timing: on joint velocities and accelerations, and where to stop.
        before: the timing of the same path with other velocity limits, if there is one. Chains
            whose limits are the same keep it.
    """
    count, chains = len(intervals), len(intervals.first) - 1
    if before is None:
        units = path_units(robot, dynamics, intervals, timing)
        polygons = MotionPolygons.at_rest(robot, dynamics, intervals, limits, timing, units)
        nowhere = np.zeros(chains, dtype=np.bool_)
        before = ForceTiming(np.zeros(count), np.zeros(count), nowhere, np.full(chains, -1),
                             polygons, np.full(len(dynamics), np.nan))  # fmt: skip
    changed = (before.squares != timing.squares)[[intervals.begin, intervals.end]].any(axis=0)
    asked = np.flatnonzero(np.logical_or.reduceat(changed, intervals.first[:-1]))
    begin, end, stuck, places = (
        array.copy() for array in (before.begin, before.end, before.stuck, before.places)
    )
    stuck[asked], places[asked] = False, -1
    slow, polygons = _by_polygons(intervals, timing, before.polygons, asked, begin, end)
    sweeps = before.sweeps
    for group in _groups(slow, intervals.first):
        part, owner = _part(intervals, group)
        if not all(chain in sweeps for chain in group.tolist()):
            rows = interval_programs(robot, dynamics, part, limits, timing)
            sweeps = {
                chain: ProgramSweeps(rows, part, timing, np.arange(*part.first[i : i + 2]))
                for i, chain in enumerate(group.tolist())
            }
        for i, chain in enumerate(group.tolist()):
            own = owner[part.first[i] : part.first[i + 1]]
            sweeps[chain].limit(timing)
            found = sweeps[chain].fastest()
            if isinstance(found, int):
                stuck[chain], places[chain] = True, own[found]
                return ForceTiming(begin, end, stuck, places, polygons, timing.squares, sweeps)
            begin[own], end[own] = found
    return ForceTiming(begin, end, stuck, places, polygons, timing.squares, sweeps)


def _by_polygons(
    intervals: PathIntervals, timing: TimingLimits, polygons: MotionPolygons, chains: np.ndarray,
    begin: FloatArray, end: FloatArray,
) -> tuple[np.ndarray, MotionPolygons]:  # fmt: skip
    """Write squared speeds of ``chains`` into ``begin`` and ``end (K,)`` [1/s^2].

    Returns:
        The chains for which there is nothing, and the polygons as they are known in the end.
    """
    at = polygons.places
    tops = np.minimum(timing.squares[at.samples] / at.units, NO_BOUND)
    resting = polygons.resting[at.begin] & polygons.resting[at.end]
    rests = np.logical_and.reduceat(resting, intervals.first[:-1])[chains]
    slow, chains = [chains[~rests]], chains[rests]
    for _ in range(MOST_SWEEPS):
        if not len(chains):
            break
        own, first = _intervals_of(chains, intervals.first)
        steps = 2.0 * intervals.lengths[own]
        if intervals.even is not None:
            steps[intervals.even[own]] = 0.0
        here, there = at.begin[own], at.end[own]
        sides = polygons.sides[:, : _used(polygons, np.append(here, there))]
        found = swept(
            SweptIntervals(sides[here], sides[there], steps, tops[here], tops[there], first), SLOWER
        )
        begin[own], end[own] = at.units[here] * found
        u = (found[1] - found[0]) / np.where(steps > 0.0, steps, 1.0)
        points = np.stack([np.concatenate([u, u]), np.concatenate(found)], axis=1)
        polygons, state = polygons.refined(np.concatenate([here, there]), points)
        worst = np.minimum.reduceat(state.reshape(2, -1).min(axis=0), first[:-1])
        slow.append(chains[worst < 0])
        chains = chains[worst == 0]
    return np.sort(np.concatenate([*slow, chains])), polygons


def _used(polygons: MotionPolygons, places: np.ndarray) -> int:
    """How many columns of sides are in use at any of the places ``(P,)``."""
    columns = used(polygons.sides[places]).any(axis=0)
    return int(np.flatnonzero(columns).max(initial=-1)) + 1


def _intervals_of(chains: np.ndarray, first: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All intervals of chains, and the first one of each among them, and their number."""
    counts = first[chains + 1] - first[chains]
    begins = np.concatenate([[0], np.cumsum(counts)])
    return np.arange(begins[-1]) + np.repeat(first[chains] - begins[:-1], counts), begins


def _groups(chains: np.ndarray, first: np.ndarray) -> list[np.ndarray]:
    """Chains, in groups that have about :data:`MOST_INTERVALS` intervals together."""
    total = np.cumsum(first[chains + 1] - first[chains])
    return [chains[total // MOST_INTERVALS == i] for i in np.unique(total // MOST_INTERVALS)]


def _part(intervals: PathIntervals, chains: np.ndarray) -> tuple[PathIntervals, np.ndarray]:
    """The intervals of a group of chains, and which ones they are."""
    own, first = _intervals_of(chains, intervals.first)
    return PathIntervals(
        intervals.begin[own], intervals.end[own], intervals.lengths[own], intervals.standing[own],
        first, None if intervals.even is None else intervals.even[own],
    ), own  # fmt: skip
