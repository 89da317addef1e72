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
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.many_programs import solve_linear_programs
from gaitopt.dynamics.path_programs import PathIntervals, TimingLimits
from gaitopt.dynamics.path_rows import place_rows
from gaitopt.dynamics.small_programs import NO_BOUND
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


class _Group(NamedTuple):
    """Rows of the places on the same feet: ``low <= by_motion (u, x) + by_force z <= high``.

    Attributes:
        places: ``(n,)``.
        by_motion: in the units of the places ``(n, r, 2)``.
        by_force: ``(n, r, d)``.
        low, high: ``(n, r)``.
    """

    places: np.ndarray
    by_motion: FloatArray
    by_force: FloatArray
    low: FloatArray
    high: FloatArray

    def sides(
        self, own: np.ndarray, rays: FloatArray, far: FloatArray
    ) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Sides of polygons that rays from (0, 0) hit.

        Args:
            own: positions in this group ``(n,)``.
            rays: points on them ``(n, 2)``.
            far: the largest multiple of these points that is looked at ``(n,)``.

        Returns:
            The multiple at which each ray leaves ``(n,)``; its side ``(n, 2)``, zeros where none is
            that near; and whether both are proven ``(n,)``.
        """
        by_motion, free = self.by_motion[own], self.by_force.shape[2]
        count, length = by_motion.shape[:2]
        rows = np.zeros((count, length + 1, 1 + free))
        rows[:, :length, 0] = (by_motion @ rays[..., None])[..., 0]
        rows[:, :length, 1:] = self.by_force[own]
        rows[:, length, 0] = 1.0
        low = np.concatenate([self.low[own], np.full((count, 1), -NO_BOUND)], axis=1)
        high = np.concatenate([self.high[own], far[:, None]], axis=1)
        found = solve_linear_programs(-np.eye(1 + free)[0], rows, low, high)
        multiple, weights = found.points[:, 0], found.multipliers[:, :length]
        near = found.proven & (multiple > 0.0) & (found.multipliers[:, length] <= 0.0)
        sides = (weights[:, None] @ by_motion)[:, 0]
        sides = np.where(near[:, None], sides / np.where(near, multiple, 1.0)[:, None], 0.0)
        return multiple, sides, found.proven


@dataclass(frozen=True, eq=False)
class MotionPolygons:
    """What is known of the polygons at ``N`` places.

    Attributes:
        places: the places.
        groups: their rows.
        joints: path derivatives of the joints over the limit of their accelerations, in the units
            of the places: of ``u`` and ``x`` ``(N, n, 2)``; ``None`` without such a limit.
        resting: where the robot can rest, with some room ``(N,)``.
        sides: half-planes ``a u + b x <= 1`` ``(N, M, 2)``; zeros for none.
        inner: points that have forces ``(N, J, 2)``; zeros for none.
    """

    places: Places
    groups: tuple[_Group, ...]
    joints: FloatArray | None
    resting: BoolArray
    sides: FloatArray
    inner: FloatArray

    @classmethod
    def at_rest(
        cls, robot: Quadruped, dynamics: PathDynamics, intervals: PathIntervals,
        limits: ForceLimits, timing: TimingLimits, units: FloatArray,
    ) -> MotionPolygons:  # fmt: skip
        """Of both ends of all intervals, with the sides that bound accelerations at rest.

        Args:
            robot, dynamics, intervals, limits, timing: as for
                :func:`gaitopt.dynamics.force_timing.fastest_with_forces`.
            units: of accelerations and squared speeds on each interval ``(K,)`` [1/s^2].
        """
        places = Places.of(intervals, units)
        groups = []
        patterns, member = np.unique(places.standing, axis=0, return_inverse=True)
        for i, pattern in enumerate(patterns):
            own = np.flatnonzero(member.ravel() == i)
            rows = place_rows(robot, dynamics, limits, pattern, places.samples[own], timing.slack)
            by_motion = np.stack([rows.by_u, rows.by_x], axis=2) * places.units[own, None, None]
            groups.append(_Group(own, by_motion, rows.by_z, rows.low, rows.high))
        joints = None
        if np.isfinite(timing.acceleration):
            joints = np.stack([timing.first, timing.second], axis=2)[places.samples]
            joints = joints * (places.units / timing.acceleration)[:, None, None]
        count = len(places.samples)
        none = np.zeros((count, 0, 2))
        empty = cls(places, tuple(groups), joints, np.zeros(count, dtype=np.bool_), none, none)
        return empty._with_rest(_accelerations(intervals, places, timing))

    def _with_rest(self, fastest: FloatArray) -> MotionPolygons:
        """With what accelerations up to ``fastest (N,)`` meet at rest."""
        resting, sides, inner = self.resting.copy(), self.sides, self.inner
        for group in self.groups:
            own = group.places
            if self.places.standing[own[0]].sum() < LEAST_FEET:
                continue
            sizes = np.abs(group.by_motion[..., 0]).max(axis=1)
            ray = np.minimum(1.0 / np.maximum(sizes, LEAST_POINT), fastest[own])
            far = fastest[own] / ray
            resting[own] = True
            for sign in (1.0, -1.0):
                rays = np.stack([sign * ray, np.zeros(len(own))], axis=1)
                multiple, side, proven = group.sides(np.arange(len(own)), rays, far)
                room = (multiple * ray * sizes > STRICTLY) | (multiple >= (1.0 - WITHIN) * far)
                resting[own] &= proven & room
                near = used_sides(side)
                sides = _appended(sides, own[near], side[near])
                inner = _appended(inner, own, multiple[:, None] * rays)
        return replace(self, resting=resting, sides=sides, inner=inner)

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
        state, polygons = np.ones(len(places), dtype=int), self
        # The point of each place that is nearest to a side first: the other may be inside then.
        open_ = np.flatnonzero(~self._surrounds(places, points))
        gauge = (self.sides[places[open_]] @ points[open_][..., None])[..., 0].max(
            axis=1, initial=0.0
        )
        open_ = open_[np.argsort(-gauge)]
        _, first = np.unique(places[open_], return_index=True)
        for own in (open_[first], np.setdiff1d(open_, open_[first])):
            own = own[~polygons._surrounds(places[own], points[own])]
            own = own[np.argsort(places[own], kind="stable")]
            polygons, state[own] = polygons._asked(places[own], points[own])
        if self.joints is None:
            return polygons, state
        use = (self.joints[places] @ points[..., None])[..., 0]
        worst = np.abs(use).argmax(axis=1)
        value = use[np.arange(len(use)), worst]
        beyond = np.abs(value) > 1.0 + WITHIN
        side = np.sign(value)[:, None] * self.joints[places, worst]
        polygons = replace(polygons, sides=_appended(polygons.sides, places[beyond], side[beyond]))
        return polygons, np.where(beyond, np.minimum(state, 0), state)

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

    def _asked(self, places: np.ndarray, points: FloatArray) -> tuple[MotionPolygons, np.ndarray]:
        """:meth:`refined` by a program for each point, without limits of joint accelerations."""
        state, sides = np.ones(len(places), dtype=int), np.zeros((len(places), 2))
        ends = np.zeros((len(places), 2))
        owner, position = self._groups_of_places
        for i, group in enumerate(self.groups):
            own = np.flatnonzero(owner[places] == i)
            far = np.full(len(own), BEYOND)
            multiple, side, proven = group.sides(position[places[own]], points[own], far)
            inside = multiple >= 1.0 - WITHIN
            outside = (side * points[own]).sum(axis=1) > 1.0
            state[own] = np.where(proven & inside, 1, np.where(proven & outside, 0, -1))
            sides[own] = side
            ends[own] = np.where(proven, multiple, 0.0)[:, None] * points[own]
        known, near = state >= 0, (state >= 0) & used_sides(sides)
        return replace(
            self, sides=_appended(self.sides, places[near], sides[near]),
            inner=_appended(self.inner, places[known], ends[known]),
        ), state  # fmt: skip


def _appended(table: FloatArray, places: np.ndarray, added: FloatArray) -> FloatArray:
    """Points or sides ``(N, M, 2)`` with more of them ``(P, 2)``, of places that may repeat."""
    if not len(places):
        return table
    order = np.argsort(places, kind="stable")
    places, added = places[order], added[order]
    starts = np.flatnonzero(np.concatenate([[True], np.diff(places) > 0]))
    rank = np.arange(len(places)) - np.repeat(starts, np.diff(np.append(starts, len(places))))
    column = used_sides(table).sum(axis=1)[places] + rank
    wide = np.zeros((len(table), max(int(column.max()) + 1, table.shape[1]), 2))
    wide[:, : table.shape[1]] = table
    wide[places, column] = added
    return wide


def used_sides(table: FloatArray) -> BoolArray:
    """Which of the sides or points ``(N, M, 2)`` are there ``(N, M)``."""
    return np.asarray((table[..., 0] != 0.0) | (table[..., 1] != 0.0))


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
