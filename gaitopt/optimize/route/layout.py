"""Rows, unknowns and their numbering."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.band import BlockBand, RowGroups
from gaitopt.optimize.route.centre_of_mass import ComRows
from gaitopt.optimize.route.legs import JOINTS, POSE, StackedLegs

TIME_UNIT_ROTATION = np.radians(17.0)
"""At its velocity limit the slowest joint turns by so much in a problem's unit of time [rad]."""


class Rows(NamedTuple):
    """Inequalities ``offset + linear . y + sum(square * y**2) / 2 >= 0`` on single poses ``y``.

    Attributes:
        knot: the pose that each row looks at ``(M,)``, ascending.
        linear, square: ``(M, 9)``.
        offset: ``(M,)``.
    """

    knot: np.ndarray
    linear: FloatArray
    square: FloatArray
    offset: FloatArray

    @classmethod
    def joined(cls, parts: Iterable[Rows]) -> Rows:
        """All rows of ``parts``, sorted by knot; on one knot they stand in the parts' order."""
        none = np.zeros((0, POSE))
        empty = cls(np.zeros(0, dtype=int), none, none, np.zeros(0))
        return cls(*sorted_by_knot([empty, *parts]))

    def chosen(self, which: np.ndarray) -> Rows:
        """Some of the rows, by a mask ``(M,)`` or their ascending numbers."""
        return Rows(*(part[which] for part in self))

    def shifted(self, knots: int) -> Rows:
        """The same rows on poses that stand so many knots later."""
        return self._replace(knot=self.knot + knots)


def sorted_by_knot(parts: Iterable[tuple[np.ndarray, ...]]) -> list[np.ndarray]:
    """Columns of tables, joined and sorted by the first column, which is the rows' knot.

    The order of rows on the same knot is kept.
    """
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    order = np.argsort(columns[0], kind="stable")
    return [column[order] for column in columns]


Layout = TypeVar("Layout", bound="RouteLayout")


@dataclass(frozen=True, eq=False)
class RouteLayout:
    """A time-optimal route problem: its data, the numbering of its unknowns, and its values.

    Attributes:
        legs: constants of the robot's legs.
        feet: where the feet stand at each knot ``(K, 4, 3)`` [m].
        swing: 1 for the leg whose foot is part of the pose ``(K, 4)``.
        poses: values of all poses ``(K, 9)``; those that are unknowns serve as a first guess.
        unknown: number of each entry among the poses' unknowns ``(K, 9)``, -1 where it is fixed;
            ascending from knot to knot. Knots may share unknowns.
        rows: inequalities on single poses.
        bounded: which position limits are looked at, low and high ``(2, 12)``.
        unit: the solver counts times in it, so that robots of all speeds look alike to it [s].
        quadratic_weight: weight of the small quadratic term in the times, counted so.
        com: inequalities on the true centre of mass, where there are any.
    """

    legs: StackedLegs
    feet: FloatArray
    swing: FloatArray
    poses: FloatArray
    unknown: np.ndarray
    rows: Rows
    used_limits: np.ndarray
    time_unit: float = 1.0
    quadratic_weight: float = 1.0
    com: ComRows | None = None

    def with_start(self: Layout, pose: FloatArray) -> Layout:
        """The same problem, but for the pose ``(9,)`` of its first knot."""
        return replace(self, poses=np.concatenate([pose[None], self.poses[1:]]))

    @property
    def knots(self) -> int:
        """Number of knots ``K``."""
        return len(self.poses)

    @cached_property
    def velocity_limits(self) -> FloatArray:
        """Velocity limits of all joints ``(12,)`` [rad/s]."""
        return np.asarray(self.legs.velocity_limits.reshape(JOINTS))

    @cached_property
    def turns(self) -> FloatArray:
        """What all joints turn at most in a unit of time ``(12,)`` [rad]."""
        return self.velocity_limits * self.time_unit

    @cached_property
    def columns(self) -> np.ndarray:
        """The pose's entries that are unknown at any knot."""
        return np.flatnonzero((self.unknown >= 0).any(axis=0))

    @cached_property
    def numbering(self) -> tuple[np.ndarray, np.ndarray, int]:
        """Places of poses ``(K, nc)`` and times ``(K - 1,)`` in the vector of unknowns; its size.

        Times are put between the poses that they separate, so that matrices are banded.
        """
        poses = self.unknown[:, self.columns]
        latest = np.maximum.accumulate(poses.max(axis=1, initial=-1))
        times = latest[:-1] + 1 + np.arange(self.knots - 1)
        count = int(poses.max(initial=-1)) + 1
        # An unknown pose moves back by the number of times that stand before it.
        before = np.searchsorted(latest[:-1], np.arange(count), side="left")
        placed = np.where(poses >= 0, poses + before[np.maximum(poses, 0)], -1)
        return placed, times, count + self.knots - 1

    @cached_property
    def fixed_knots(self) -> int:
        """Number of leading knots without unknowns, at which nothing is to be decided."""
        free = (self.unknown >= 0).any(axis=1)
        return int(np.argmax(free)) if free.any() else self.knots

    def pack(self, poses: FloatArray, times: FloatArray) -> FloatArray:
        """The vector of unknowns of given poses ``(K, 9)`` and times ``(K - 1,)`` [s]."""
        placed, at, size = self.numbering
        x = np.zeros(size)
        mine = placed >= 0
        x[placed[mine]] = poses[:, self.columns][mine]
        x[at] = times / self.time_unit
        return x

    def unpack(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses ``(K, 9)`` and times ``(K - 1,)`` [s] of a vector of unknowns."""
        placed, at, _ = self.numbering
        poses = self.poses.copy()
        poses[:, self.columns] = np.where(
            placed >= 0, x[np.maximum(placed, 0)], poses[:, self.columns]
        )
        return poses, x[at] * self.time_unit

    def values_at(self, poses: FloatArray, times: FloatArray, joints: FloatArray) -> FloatArray:
        """All inequalities at given poses ``(K, 9)`` and times ``(K - 1,)`` with their joints."""
        turn, room = np.diff(joints, axis=0), self.velocity_limits * times[:, None]
        late = joints[self.fixed_knots :]
        low, high = self.used_limits
        y = poses[self.rows.knot]
        single = self.rows.offset + ((self.rows.linear + self.rows.square * y / 2.0) * y).sum(1)
        if self.com is not None:
            points = self.com.masses.points(poses, joints.reshape(-1, 4, 3))
            single = np.concatenate([single, self.com.values(points)])[self.order]
        return np.concatenate([
            (room - turn).ravel(), (room + turn).ravel(),
            (late - self.legs.low.ravel())[:, low].ravel(),
            (self.legs.high.ravel() - late)[:, high].ravel(), single,
        ])  # fmt: skip

    @cached_property
    def order(self) -> np.ndarray:
        """Order that makes knots ascend in ``rows`` followed by those of the centre of mass."""
        return np.argsort(self._knots_in_turn, kind="stable")

    @property
    def _knots_in_turn(self) -> np.ndarray:
        return self.rows.knot if self.com is None else np.append(self.rows.knot, self.com.knot)

    @cached_property
    def row_knots(self) -> np.ndarray:
        """Knots of all rows on single poses, ascending."""
        return np.asarray(self._knots_in_turn[self.order])

    @cached_property
    def squares(self) -> FloatArray:
        """Quadratic parts of all rows on single poses, in the poses' unknown entries."""
        square = np.zeros((len(self.order), len(self.columns)))
        square[: len(self.rows.knot)] = self.rows.square[:, self.columns]
        return np.asarray(square[self.order])

    @cached_property
    def slots(self) -> RowGroups:
        """The rows by their knots."""
        return RowGroups.of(self.row_knots, self.knots)

    @cached_property
    def band(self) -> BlockBand:
        """Where the blocks of each interval go in the banded matrix."""
        placed, at, size = self.numbering
        return BlockBand.of(np.concatenate([placed[:-1], at[:, None], placed[1:]], axis=1), size)
