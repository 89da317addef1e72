"""The data of a time-optimal walk's problem, and how its unknowns and inequalities are numbered.

Words that all modules of this package use:

- A *pose* is nine numbers: body centre, roll, pitch and yaw, and the foot that swings
  (:mod:`gaitopt.optimize.route.legs`).
- A *knot* is one of the ``K`` instants of the walk for which the problem has a pose. The first
  pose is given.
- An *interval* is the time from one knot to the next; there are ``K - 1``.
- The *unknowns* are entries of the poses, and the times of all intervals. Knots may share
  unknowns: while the body stands still, its pose is the same at several knots. What is fixed is no
  unknown, so the problem has no equalities.
- A *row* is one inequality, ``value >= 0``. Rows of joint velocities look at two neighbouring
  poses and the time between them, all others at one pose. Hence all matrices are banded.

Variables ``c`` and ``M`` in shapes: the entries of a pose that are unknown at any knot, and rows.
"""

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
from gaitopt.optimize.route.numbering import Numbering, RowParts

TIME_UNIT_ROTATION = np.radians(17.0)
"""How far the slowest joint turns in a problem's unit of time at its velocity limit [rad]. On
wang2020 ([Wang2020], Table I: 17 deg/s) the unit so is a second, and on every robot the times of
intervals are numbers of about the same size, as the solver's constants expect."""


class Rows(NamedTuple):
    """Inequalities ``offset + linear . y + sum(square * y**2) / 2 >= 0`` on single poses ``y``.

    Attributes:
        knot: the knot whose pose each row looks at ``(M,)``, ascending.
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

    def values(self, poses: FloatArray) -> FloatArray:
        """Values of all rows ``(M,)`` at poses of all knots ``(K, 9)``."""
        y = poses[self.knot]
        return np.asarray(self.offset + ((self.linear + self.square * y / 2.0) * y).sum(1))

    def by_pose(self, poses: FloatArray) -> FloatArray:
        """Derivatives of all rows by their poses ``(M, 9)``, at poses of all knots ``(K, 9)``."""
        return np.asarray(self.linear + self.square * poses[self.knot])


def sorted_by_knot(parts: Iterable[tuple[np.ndarray, ...]]) -> list[np.ndarray]:
    """Columns of several tables, joined and sorted by the first column, which is the rows' knot.

    Rows on the same knot keep their order.
    """
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    order = np.argsort(columns[0], kind="stable")
    return [column[order] for column in columns]


class LastValues(NamedTuple):
    """Where all rows were computed last, with the joints there ``(K, 12)`` and the values.

    Arrays are read-only: a linearisation takes them as its own.
    """

    x: FloatArray
    joints: FloatArray
    values: FloatArray


Layout = TypeVar("Layout", bound="RouteLayout")


@dataclass(frozen=True, eq=False)
class RouteLayout:
    """The data of a problem, the numbering of its unknowns, and the values of its rows.

    Attributes:
        legs: constants of the robot's legs.
        feet: where the feet stand at each knot ``(K, 4, 3)`` [m].
        swing: 1 for the leg whose foot is part of the pose, else 0 ``(K, 4)``.
        poses: values of all poses ``(K, 9)``; those of unknowns are a first guess.
        unknown: number of each entry among the poses' unknowns ``(K, 9)``, -1 where it is fixed;
            ascending from knot to knot. Knots may share unknowns.
        rows: inequalities on single poses.
        used_limits: which joint position limits are rows, low and high ``(2, 12)``.
        time_unit: the solver counts times in it [s]; see :data:`TIME_UNIT_ROTATION`.
        quadratic_weight: weight of the sum of squared times in the objective, over two; times
            counted in :attr:`time_unit`.
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

    @cached_property
    def last_values(self) -> list[LastValues]:
        """Where all rows were computed last, if they were: the one entry is written anew then."""
        return []

    def with_start(self: Layout, pose: FloatArray) -> Layout:
        """The same problem, but for the given pose ``(9,)`` of its first knot."""
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
    def scaled_velocity_limits(self) -> FloatArray:
        """Velocity limits of all joints ``(12,)`` [rad per time unit]."""
        return self.velocity_limits * self.time_unit

    @cached_property
    def free_columns(self) -> np.ndarray:
        """The entries of a pose that are unknown at any knot ``(c,)``."""
        return np.flatnonzero((self.unknown >= 0).any(axis=0))

    @cached_property
    def numbering(self) -> Numbering:
        """Where poses and times stand in the vector of unknowns.

        Times are put between the poses that they separate, so that matrices are banded.
        """
        poses = self.unknown[:, self.free_columns]
        latest = np.maximum.accumulate(poses.max(axis=1, initial=-1))
        times = latest[:-1] + 1 + np.arange(self.knots - 1)
        count = int(poses.max(initial=-1)) + 1
        # An unknown pose moves back by the number of times that stand before it.
        before = np.searchsorted(latest[:-1], np.arange(count), side="left")
        placed = np.where(poses >= 0, poses + before[np.maximum(poses, 0)], -1)
        return Numbering(placed, times, count + self.knots - 1)

    @cached_property
    def fixed_knots(self) -> int:
        """Number of knots before the first with an unknown; nothing is decided at these."""
        free = (self.unknown >= 0).any(axis=1)
        return int(np.argmax(free)) if free.any() else self.knots

    def pack(self, poses: FloatArray, times: FloatArray) -> FloatArray:
        """The vector of unknowns of given poses ``(K, 9)`` and times ``(K - 1,)`` [s]."""
        at = self.numbering
        x = np.zeros(at.size)
        free = at.poses >= 0
        x[at.poses[free]] = poses[:, self.free_columns][free]
        x[at.times] = times / self.time_unit
        return x

    def unpack(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses ``(K, 9)`` and times ``(K - 1,)`` [s] of a vector of unknowns."""
        poses = self.poses.copy()
        poses[:, self.free_columns] = self.of_poses(x, poses[:, self.free_columns])
        return poses, x[self.numbering.times] * self.time_unit

    def of_poses(self, x: FloatArray, fixed: FloatArray | float = 0.0) -> FloatArray:
        """The entries of a vector over all unknowns that belong to poses ``(K, c)``.

        Args:
            x: ``(n,)``.
            fixed: what stands where a pose's entry is no unknown.
        """
        number = self.numbering.poses
        return np.asarray(np.where(number >= 0, x[np.maximum(number, 0)], fixed))

    def row_values(
        self, poses: FloatArray, times: FloatArray, joints: FloatArray,
        com: FloatArray | None = None,
    ) -> FloatArray:  # fmt: skip
        """Values of all rows ``(m,)``, in the order of :class:`RowParts`.

        Args:
            poses: of all knots ``(K, 9)``.
            times: of all intervals ``(K - 1,)`` [s].
            joints: at the poses ``(K, 12)`` [rad].
            com: the centre of mass there ``(K, 3)`` [m], if it is known.
        """
        turned, limit = np.diff(joints, axis=0), self.velocity_limits * times[:, None]
        return np.concatenate([
            (limit - turned).ravel(), (limit + turned).ravel(),
            *self.pose_values(poses, joints, com),
        ])  # fmt: skip

    def pose_values(
        self, poses: FloatArray, joints: FloatArray, com: FloatArray | None
    ) -> list[FloatArray]:
        """Values of all rows but those of velocities, part by part; as :meth:`row_values`."""
        late = joints[self.fixed_knots :]
        low, high = self.used_limits
        single = self.rows.values(poses)
        if self.com is not None:
            if com is None:
                com = self.com.masses.com(poses, joints.reshape(-1, 4, 3))
            single = np.concatenate([single, self.com.values(com)])[self.row_order]
        return [
            (late[:, low] - self.legs.low.ravel()[low]).ravel(),
            (self.legs.high.ravel()[high] - late[:, high]).ravel(), single,
        ]  # fmt: skip

    def split(self, v: FloatArray) -> RowParts:
        """A vector over all rows ``(m,)``, part by part."""
        late = self.knots - self.fixed_knots
        velocity = (self.knots - 1) * JOINTS
        low, high = (int(used.sum()) * late for used in self.used_limits)
        # np.split takes ten times as long, and this is done a dozen times for a Newton step.
        begin = 2 * velocity
        middle, end = begin + low, begin + low + high
        return RowParts(
            v[:velocity].reshape(-1, JOINTS), v[velocity:begin].reshape(-1, JOINTS),
            v[begin:middle].reshape(late, -1), v[middle:end].reshape(late, -1), v[end:],
        )  # fmt: skip

    @cached_property
    def row_order(self) -> np.ndarray:
        """The order that sorts by knot the rows on poses followed by those on the COM ``(M,)``."""
        return np.argsort(self._unsorted_knots, kind="stable")

    @property
    def _unsorted_knots(self) -> np.ndarray:
        return self.rows.knot if self.com is None else np.append(self.rows.knot, self.com.knot)

    @cached_property
    def row_knots(self) -> np.ndarray:
        """Knots of all rows on single poses ``(M,)``, ascending."""
        return np.asarray(self._unsorted_knots[self.row_order])

    @cached_property
    def rows_by_knot(self) -> RowGroups:
        """All rows on single poses by their knots."""
        return RowGroups.of(self.row_knots, self.knots)

    @cached_property
    def _row_squares(self) -> FloatArray:
        """Diagonals of the Hessians of rows on single poses, knot by knot ``(K, rows, c)``.

        They are 0 for the COM's.
        """
        square = np.zeros((len(self.row_order), len(self.free_columns)))
        square[: len(self.rows.knot)] = self.rows.square[:, self.free_columns]
        return self.rows_by_knot.padded(square[self.row_order])

    def weighted_squares(self, weights: FloatArray) -> FloatArray:
        """The diagonal of the Hessian of weighted rows on single poses, without the COM ``(K, c)``.

        Args:
            weights: ``(M,)``.
        """
        return np.asarray((self.rows_by_knot.padded(weights)[:, None] @ self._row_squares)[:, 0])

    @cached_property
    def interval_band(self) -> BlockBand:
        """Where blocks of intervals go in the banded matrix: pose before, time, pose after."""
        at = self.numbering
        return BlockBand.of(
            np.concatenate([at.poses[:-1], at.times[:, None], at.poses[1:]], axis=1), at.size
        )
