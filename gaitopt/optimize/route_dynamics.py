"""The time-optimal route with bounded joint accelerations, and a ZMP that stays in its support.

Poses at knots are the control points of a quadratic B-spline in time. Its acceleration is constant
on a span about each knot: with spans ``d``, the velocity between the spans of knots ``k`` and ``k +
1`` is ``v(k) = (u(k+1) - u(k)) / h(k)`` with ``h(k) = (d(k) + d(k+1)) / 2``, and the acceleration
of span ``k`` is ``(v(k) - v(k-1)) / d(k)``. For the body and a flying foot that is exact; for the
joints, which follow by inverse kinematics, it holds up to the curvature of that map, and rows are
tightened by whoever looks there. The motion begins and ends at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route_band import Band, Slots
from gaitopt.optimize.route_dynamics_linear import LinearisedDynamics, intervals
from gaitopt.optimize.route_legs import JOINTS
from gaitopt.optimize.route_problem import RouteProblem, Rows

LEAST_SPAN = 0.01
"""Shortest span, in units of the problem's time."""


class ZmpRows(NamedTuple):
    """``normal . zmp >= offset`` for the ZMP ``c - height / (g + a_z) a`` of the body centre.

    The height is that of the body centre above ``ground``. Each row is taken times its knot's span
    and ``(g + a_z) / g``, which makes it a polynomial of places and velocity jumps.

    Attributes:
        knot: ``(M,)``.
        normal: ``(M, 2)``.
        offset: ``(M,)`` [m].
        ground: ``(M,)`` [m].
        least: what the offset must be at least, without any reserve ``(M,)`` [m].
        gravity: ``g`` ``(M,)`` [m/s^2].
    """

    knot: np.ndarray
    normal: FloatArray
    offset: FloatArray
    ground: FloatArray
    least: FloatArray
    gravity: FloatArray

    def chosen(self, which: np.ndarray) -> ZmpRows:
        """Some of the rows, by a mask or their numbers."""
        return ZmpRows(*(part[which] for part in self))


class Entry(NamedTuple):
    """How a motion comes in at its first knot, where that is not at rest.

    Attributes:
        velocity: of the joints and the body centre before the first knot's span ``(15,)``.
        span: length of that span, which is no unknown [s].
    """

    velocity: FloatArray
    span: float


@dataclass(frozen=True, eq=False)
class RouteDynamics(RouteProblem):
    """A route problem with accelerations. Its times are the spans of all knots but the last.

    The last knot's span is as long as the one before it.

    Attributes:
        accelerations: limits on the span of every knot, up and down ``(2, K, 12)`` [rad/s^2].
        hurry: velocity limits between each two spans, up and down ``(2, K - 1, 12)`` [rad/s].
        zmp: rows of the zero moment point; none for joint accelerations alone.
        entry: how the motion comes in; ``None`` from rest.
    """

    accelerations: FloatArray = None  # type: ignore[assignment]
    hurry: FloatArray = None  # type: ignore[assignment]
    zmp: ZmpRows = None  # type: ignore[assignment]
    entry: Entry | None = None

    @cached_property
    def cost(self) -> FloatArray:
        """Gradient of the sum of all spans that are unknown."""
        out = np.array(super().cost)
        out[self.numbering[1][-1]] += 1.0
        if self.entry is not None:
            out[self.numbering[1][0]] = 0.0
        return out

    @cached_property
    def even(self) -> FloatArray:
        """Diagonal of the small quadratic term; it also holds what nothing else looks at."""
        out = np.array(super().even)
        if self.entry is not None:
            out[self.numbering[1][0]] = 1.0
        return out

    @property
    def settled(self) -> int:
        """None: a longer span changes accelerations, too."""
        return 0

    def settle(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Nothing is changed."""
        return x, values

    def unpack(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses ``(K, 9)`` and spans ``(K - 1,)`` of a vector of unknowns."""
        poses, times = super().unpack(x)
        if self.entry is not None:
            times[0] = self.entry.span
        return poses, times

    def jumps(self, moves: FloatArray, between: FloatArray) -> FloatArray:
        """Change of velocity over every span ``(K, 15)``.

        Args:
            moves: joints and body centre at all knots ``(K, 15)``.
            between: times between the middles of spans ``(K - 1,)`` [s].
        """
        velocity = np.diff(moves, axis=0) / between[:, None]
        rest = np.zeros((1, moves.shape[1]))
        before = rest if self.entry is None else self.entry.velocity[None]
        return np.diff(np.concatenate([before, velocity, rest]), axis=0)

    def joints(self, poses: FloatArray) -> FloatArray:
        """Joint angles at poses of all knots ``(K, 12)`` [rad]."""
        return self.legs.joints(poses, self.feet, self.swing).reshape(-1, JOINTS)

    def window(
        self, first: int, last: int, poses: FloatArray, entry: Entry | None
    ) -> RouteDynamics:
        """The problem from one knot to another, at whose end the motion rests.

        Args:
            first, last: knots; the first one's pose is fixed.
            poses: first guess ``(last - first + 1, 9)``, with the first pose as it is.
            entry: how the motion comes in there.
        """
        unknown = self.unknown[first : last + 1].copy()
        unknown[0] = -1
        free = unknown >= 0
        unknown[free] -= unknown[free].min()
        inside = (self.rows.knot > first) & (self.rows.knot <= last)
        rows = Rows(*(part[inside] for part in self.rows))
        near = (self.zmp.knot >= first) & (self.zmp.knot <= last)
        zmp = self.zmp.chosen(near)
        return replace(
            self, feet=self.feet[first : last + 1], swing=self.swing[first : last + 1],
            poses=poses, unknown=unknown, rows=rows._replace(knot=rows.knot - first),
            accelerations=self.accelerations[:, first : last + 1],
            hurry=self.hurry[:, first:last], entry=entry,
            zmp=zmp._replace(knot=zmp.knot - first),
        )  # fmt: skip

    def values_at(self, poses: FloatArray, times: FloatArray, joints: FloatArray) -> FloatArray:
        """All inequalities at given poses ``(K, 9)`` and spans ``(K - 1,)`` [s] with their joints.

        Those with a time in them count it in the problem's unit.
        """
        between, spans = intervals(times), np.append(times, times[-1])
        base = super().values_at(poses, between, joints)
        count = (self.knots - 1) * JOINTS
        base[: 2 * count] += ((self.hurry - self.rates) * between[:, None]).ravel()
        jumps = self.jumps(np.concatenate([joints, poses[:, :3]], axis=1), between)
        room = self.accelerations * spans[:, None]
        z, unit = self.zmp, self.unit
        apart = (z.normal * poses[z.knot, :2]).sum(axis=1) - z.offset
        sway, heave = jumps[z.knot, JOINTS : JOINTS + 2], jumps[z.knot, JOINTS + 2]
        pull = (poses[z.knot, 2] - z.ground) * (z.normal * sway).sum(axis=1)
        return np.concatenate([
            base, unit * (room[0] - jumps[:, :JOINTS]).ravel(),
            unit * (room[1] + jumps[:, :JOINTS]).ravel(),
            (apart * (spans[z.knot] + heave / z.gravity) - pull / z.gravity) / unit,
            times / unit - LEAST_SPAN,
        ])  # fmt: skip

    def linearised(self, x: FloatArray) -> LinearisedDynamics:
        """Values and derivatives at ``x``."""
        return LinearisedDynamics(self, x)

    @cached_property
    def local(self) -> np.ndarray:
        """Unknowns about each knot ``(K, 3 c + 3)``; -1 where none is.

        In the order pose before, its span, pose, its span, pose after, its span.
        """
        placed, at, _ = self.numbering
        none = np.full((1, placed.shape[1] + 1), -1)
        spans = np.append(at, at[-1:])
        if self.entry is not None:
            spans[0] = -1
        each = np.concatenate([placed, spans[:, None]], axis=1)
        return np.concatenate(
            [np.concatenate([none, each[:-1]]), each, np.concatenate([each[1:], none])], axis=1
        )

    @cached_property
    def zmp_slots(self) -> Slots:
        """The ZMP's rows by their knots."""
        return Slots.of(self.zmp.knot, self.knots)

    @cached_property
    def wide(self) -> Band:
        """Where blocks at knots go in the banded matrix."""
        return Band.of(self.local, self.numbering[2])
