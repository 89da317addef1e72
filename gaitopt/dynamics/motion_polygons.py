"""Path accelerations and squared path speeds that have forces, at places of a path: polygons.

At a place the pairs ``(u, x)`` of path acceleration and squared path speed for which there are
contact forces within all limits form a convex polygon [Pham2015]. Where the robot can rest,
(0, 0) lies in it, and its sides are half-planes ``a u + b x <= 1``. A linear program finds the side
that a ray from (0, 0) hits: it looks for the largest multiple of a point that still has forces, and
the multipliers of its rows tell the side. So a polygon is known from outside, by the sides that
matter, and a point is only believed to be inside when a program has found forces for it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.path_intervals import PathIntervals, TimingLimits
from gaitopt.dynamics.path_rows import place_rows
from gaitopt.dynamics.place_programs import MOST_HOLDING, PlacePrograms
from gaitopt.dynamics.place_tables import appended, used
from gaitopt.dynamics.whole_body import PathDynamics
from gaitopt.robots.quadruped import Quadruped

LEAST_FEET = 3
"""With fewer feet a polygon is a line or a point, and has no inside."""
BEYOND = 2.0
"""How many times as far as a point a program looks along its ray."""
WITHIN = 1e-6
"""Share by which a point may lie outside of a polygon: rounding of the programs."""
STRICTLY = 1e-6
"""Least change of a force, as a share of the weight or of a torque limit, that must be left in both
directions where the robot can rest."""
LEAST_POINT = 1e-12
"""A point nearer to (0, 0) than this, in units of the chain, is (0, 0)."""
AROUND = 64
"""Where a joint accelerates too much its limit becomes a side at so many places before and behind,
too: it will be next to bind there."""
MOST_SQUARE = 1e3
"""Largest squared speed, in units of the chain, for which accelerations are looked for at rest."""


@dataclass(frozen=True, eq=False)
class Places:
    """Where limits hold: both ends of all intervals. Neighbours with the same feet share theirs.

    Attributes:
        samples: of the path ``(N,)``.
        standing: which feet stand ``(N, 4)``.
        units: of accelerations and squared speeds ``(N,)`` [1/s^2].
        begin, end: place at which each interval begins and ends ``(K,)``.
    """

    samples: np.ndarray
    standing: BoolArray
    units: FloatArray
    begin: np.ndarray
    end: np.ndarray

    @classmethod
    def of(cls, intervals: PathIntervals, units: FloatArray) -> Places:
        """Of all intervals, with the units of each ``(K,)`` [1/s^2]."""
        shared = np.zeros(len(intervals), dtype=np.bool_)
        same = (intervals.standing[1:] == intervals.standing[:-1]).all(axis=1)
        shared[1:] = same & (intervals.begin[1:] == intervals.end[:-1])
        shared[intervals.first[:-1]] = False
        end = np.cumsum(np.where(shared, 1, 2)) - 1
        interval, samples = np.zeros(end[-1] + 1, dtype=int), np.zeros(end[-1] + 1, dtype=int)
        for places, ends in ((end, intervals.end), (end - 1, intervals.begin)):
            interval[places], samples[places] = np.arange(len(end)), ends
        return cls(samples, intervals.standing[interval], units[interval], end - 1, end)


@dataclass(frozen=True, eq=False)
class MotionPolygons:
    """What is known of the polygons at ``N`` places.

    Attributes:
        places: the places.
        groups: their rows, one group for each set of standing feet.
        joints: path derivatives of the joints over the limit of their accelerations, in the units
            of the places: of ``u`` and ``x`` ``(N, n, 2)``; ``None`` without such a limit.
        resting: where the robot can rest, with some room ``(N,)``.
        sides: half-planes ``a u + b x <= 1`` ``(N, M, 2)``; zeros for none.
        holding: the rows that hold these back ``(N, M, MOST_HOLDING)``, as in
            :class:`gaitopt.dynamics.place_programs.Sides`.
        inner: points that have forces ``(N, J, 2)``; zeros for none.
        still: free coordinates of forces at rest ``(N, MOST_HOLDING - 1)``.
        known: which limits of joint accelerations are sides ``(N, n, 2)``: lower, upper.
    """

    places: Places
    groups: tuple[PlacePrograms, ...]
    joints: FloatArray | None
    resting: BoolArray
    sides: FloatArray
    holding: np.ndarray
    inner: FloatArray
    still: FloatArray
    known: BoolArray

    @classmethod
    def at_rest(
        cls, robot: Quadruped, dynamics: PathDynamics, intervals: PathIntervals,
        limits: ForceLimits, timing: TimingLimits, units: FloatArray, sides: bool = True,
    ) -> MotionPolygons:  # fmt: skip
        """Of both ends of all intervals, with the sides that bound accelerations at rest.

        Chains along which the robot cannot rest everywhere need no sides, and get none where forces
        of least norm show that it can.

        Args:
            robot, dynamics, intervals, limits, timing: as for
                :func:`gaitopt.dynamics.force_timing.fastest_with_forces`.
            units: of accelerations and squared speeds on each interval ``(K,)`` [1/s^2].
            sides: whether sides are asked for, and not only where the robot can rest.
        """
        places = Places.of(intervals, units)
        groups = []
        patterns, member = np.unique(places.standing, axis=0, return_inverse=True)
        for i, pattern in enumerate(patterns):
            own = np.flatnonzero(member.ravel() == i)
            rows = place_rows(robot, dynamics, limits, pattern, places.samples[own], timing)
            by_motion = np.stack([rows.by_u, rows.by_x], axis=2) * places.units[own, None, None]
            groups.append(PlacePrograms(own, by_motion, rows.by_z, rows.low, rows.high))
        joints = None
        if np.isfinite(timing.acceleration):
            joints = np.stack([timing.first, timing.second], axis=2)[places.samples]
            joints = joints * (places.units / timing.acceleration)[:, None, None]
        known = np.zeros((len(places.samples), timing.first.shape[1], 2), dtype=np.bool_)
        count = len(places.samples)
        none = np.zeros((count, 0, 2))
        empty = cls(places, tuple(groups), joints, np.zeros(count, dtype=np.bool_), none,
                    np.zeros((count, 0, MOST_HOLDING), dtype=np.int16), none,
                    np.zeros((count, MOST_HOLDING - 1)), known)  # fmt: skip
        fastest, by_least = _accelerations(intervals, places, timing), empty._by_least_forces()
        out = empty._with_rest(fastest, ~by_least)
        out = replace(out, resting=out.resting | by_least)
        if not sides:
            return out
        both = out.resting[places.begin] & out.resting[places.end]
        chains = np.logical_and.reduceat(both, intervals.first[:-1])
        whole = np.repeat(chains, np.diff(intervals.first))
        asked = np.zeros(count, dtype=np.bool_)
        asked[places.begin[whole]] = asked[places.end[whole]] = True
        return out._with_rest(fastest, asked & by_least)._with_quickest()

    def _by_least_forces(self) -> BoolArray:
        """Where contact forces of least norm hold the robot, with some room ``(N,)``."""
        out = np.zeros(len(self.resting), dtype=np.bool_)
        for group in self.groups:
            if self.places.standing[group.places[0]].sum() >= LEAST_FEET:
                room = np.minimum(group.high, -group.low).min(axis=1)
                out[group.places] = room > STRICTLY
        return out

    def _with_rest(self, fastest: FloatArray, asked: BoolArray) -> MotionPolygons:
        """With what accelerations up to ``fastest (N,)`` meet at rest, where it is ``asked``."""
        out, resting, still = self, self.resting.copy(), self.still.copy()
        for group in self.groups:
            mine = np.flatnonzero(asked[group.places])
            own = group.places[mine]
            if not len(own) or self.places.standing[own[0]].sum() < LEAST_FEET:
                continue
            sizes = np.abs(group.by_motion[mine, :, 0]).max(axis=1)
            ray = np.minimum(1.0 / np.maximum(sizes, LEAST_POINT), fastest[own])
            far = fastest[own] / ray
            met = []
            for sign in (1.0, -1.0):
                rays = np.stack([sign * ray, np.zeros(len(own))], axis=1)
                found = group.sides(mine, rays, far)
                most = found.multiples
                room = (most * ray * sizes > STRICTLY) | (most >= (1.0 - WITHIN) * far)
                met.append((most, found.forces, found.proven & room))
                out = out._with(own, found.lines, found.holding, most[:, None] * rays)
            (up, upper, first), (down, lower, second) = met
            resting[own] = first & second
            # Forces are mixed as (0, 0) is, from both ends.
            share = np.where(resting[own], down / np.where(resting[own], up + down, 1.0), 0.0)
            mixed = share[:, None] * upper + (1.0 - share[:, None]) * lower
            still[own, : mixed.shape[1]] = mixed
        return replace(out, resting=resting, still=still)

    def _with_quickest(self) -> MotionPolygons:
        """With the limits of the joint that accelerates most, at all places."""
        if self.joints is None:
            return self
        out, every = self, np.arange(len(self.resting))
        quickest = np.abs(self.joints[..., 0]).argmax(axis=1)
        for end in (True, False):
            out = out._with_joints(every, quickest, np.full(len(every), end))
        return out

    @cached_property
    def _groups_of_places(self) -> tuple[np.ndarray, np.ndarray]:
        """Group of each place, and its position there, each ``(N,)``."""
        owner, position = np.zeros((2, len(self.resting)), dtype=int)
        for i, group in enumerate(self.groups):
            owner[group.places], position[group.places] = i, np.arange(len(group.places))
        return owner, position

    def refined(self, places: np.ndarray, points: FloatArray) -> tuple[MotionPolygons, np.ndarray]:
        """Look for forces at points, and learn the sides that leave points outside.

        Args:
            places: of the points ``(P,)``.
            points: ``(P, 2)``, in the units of the places.

        Returns:
            The polygons with these sides; and of each point ``(P,)`` 1 where it has forces, 0 where
            it is now known to be outside, and -1 where neither was proven.
        """
        use = (self.sides[places] @ points[..., None])[..., 0].max(axis=1, initial=0.0)
        state = np.where(use > 1.0 + WITHIN, 0, 1)
        own = np.flatnonzero((state == 1) & ~self._surrounds(places, points))
        own = own[np.argsort(places[own], kind="stable")]
        known, ends = self._held(places[own], points[own])
        polygons = replace(self, inner=appended(self.inner, places[own[known]], ends[known]))
        own = own[~known & ~polygons._surrounds(places[own], points[own])]
        polygons, state[own] = polygons._asked(places[own], points[own])
        if self.joints is None:
            return polygons, state
        use = (self.joints[places] @ points[..., None])[..., 0]
        point, joint = np.nonzero(np.abs(use) > 1.0 + WITHIN)
        state[point] = np.minimum(state[point], 0)
        return polygons._with_joints(places[point], joint, use[point, joint] > 0.0), state

    def _with_joints(
        self, places: np.ndarray, joint: np.ndarray, upper: BoolArray
    ) -> MotionPolygons:
        """With limits of joint accelerations as sides, here and at places around ``(P,)``."""
        assert self.joints is not None
        wanted = np.zeros_like(self.known)
        for shift in range(-AROUND, AROUND + 1):
            beside = np.clip(places + shift, 0, len(wanted) - 1)
            wanted[beside, joint, upper.astype(int)] = True
        at, which, end = np.nonzero(wanted & ~self.known)
        sides = np.where(end > 0, 1.0, -1.0)[:, None] * self.joints[at, which]
        none = np.zeros((len(at), MOST_HOLDING), dtype=np.int16)
        return replace(self._with(at, sides, none, np.zeros_like(sides)), known=self.known | wanted)

    def _surrounds(self, places: np.ndarray, points: FloatArray) -> BoolArray:
        """Points ``(P, 2)`` between (0, 0) and points that are known to have forces ``(P,)``."""
        inside = np.abs(points).max(axis=1) <= LEAST_POINT
        first, second = np.triu_indices(self.inner.shape[1], 1)
        a, b = self.inner[places][:, first], self.inner[places][:, second]
        total = _cross(a, b)
        divided = np.where(total != 0.0, total, np.inf)
        shares = _cross(points[:, None], b) / divided, _cross(a, points[:, None]) / divided
        found = (total != 0.0) & (shares[0] >= -LEAST_POINT) & (shares[1] >= -LEAST_POINT)
        return np.asarray(inside | (found & (shares[0] + shares[1] <= 1.0 + WITHIN)).any(axis=1))

    def _held(self, places: np.ndarray, points: FloatArray) -> tuple[BoolArray, FloatArray]:
        """Points that have forces, by the rows of the side that they are nearest to.

        Returns:
            Which points do ``(P,)``; and points that have them, too, at their place or farther out
            where their rays meet the side ``(P, 2)``.
        """
        use = (self.sides[places] @ points[..., None])[..., 0]
        side = use.argmax(axis=1) if use.shape[1] else np.zeros(len(use), dtype=int)
        largest = use.max(axis=1, initial=0.0)
        met = largest > 1.0 / BEYOND
        ends = points / np.where(met, largest, 1.0)[:, None]
        owner, position = self._groups_of_places
        for i, group in enumerate(self.groups):
            mine = owner[places] == i
            own, inside = np.flatnonzero(mine & met), np.flatnonzero(mine & ~met)
            at, holding = position[places], self.holding[places[own], side[own]]
            met[own] = group.have_forces(at[own], ends[own], holding)
            # Far from all sides the forces at rest may do.
            still = self.still[places[inside], : group.by_force.shape[2]]
            met[inside] = group.keep(at[inside], points[inside], still)
        return met, ends

    def _asked(self, places: np.ndarray, points: FloatArray) -> tuple[MotionPolygons, np.ndarray]:
        """:meth:`refined` by a program for each point, without limits of joint accelerations."""
        state, out = np.ones(len(places), dtype=int), self
        owner, position = self._groups_of_places
        for i, group in enumerate(self.groups):
            own = np.flatnonzero(owner[places] == i)
            far = np.full(len(own), BEYOND)
            found = group.sides(position[places[own]], points[own], far)
            inside = found.multiples >= 1.0 - WITHIN
            outside = (found.lines * points[own]).sum(axis=1) > 1.0
            state[own] = np.where(found.proven & inside, 1, np.where(found.proven & outside, 0, -1))
            ends = np.where(found.proven, found.multiples, 0.0)[:, None] * points[own]
            out = out._with(places[own], found.lines, found.holding, ends)
        return out, state

    def _with(
        self, places: np.ndarray, sides: FloatArray, holding: np.ndarray, inner: FloatArray
    ) -> MotionPolygons:
        """With more sides and points ``(P, 2)`` of places that may repeat; zeros for none."""
        near, known = used(sides), used(inner)
        return replace(
            self, sides=appended(self.sides, places[near], sides[near]),
            holding=appended(self.holding, places[near], holding[near], self.sides),
            inner=appended(self.inner, places[known], inner[known]),
        )  # fmt: skip


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    """Cross products of vectors in the plane ``(...)``."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def _accelerations(intervals: PathIntervals, places: Places, timing: TimingLimits) -> FloatArray:
    """Largest accelerations that squared speeds leave room for ``(N,)``, in units of the places."""
    tops = np.minimum(timing.squares[places.samples] / places.units, MOST_SQUARE)
    top = np.maximum(tops[places.begin], tops[places.end])
    largest = top / (2.0 * intervals.lengths)
    if intervals.even is not None:
        largest[intervals.even] = 0.0
    out = np.zeros(len(places.samples))
    for ends in (places.begin, places.end):
        np.maximum.at(out, ends, largest)
    # Where nothing accelerates, or the speed is 0 at both ends, any acceleration will do.
    return np.where(out > 0.0, out, 1.0)
