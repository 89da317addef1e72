"""Rows and unknowns of the problem with accelerations."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.band import BlockBand, RowGroups
from gaitopt.optimize.route.layout import RouteLayout, sorted_by_knot
from gaitopt.optimize.route.legs import JOINTS

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

    @classmethod
    def joined(cls, parts: Iterable[ZmpRows]) -> ZmpRows:
        """All rows of one or more ``parts``, sorted by knot."""
        return cls(*sorted_by_knot(parts))

    def chosen(self, which: np.ndarray) -> ZmpRows:
        """Some of the rows, by a mask ``(M,)`` or their ascending numbers."""
        return ZmpRows(*(part[which] for part in self))

    def shifted(self, knots: int) -> ZmpRows:
        """The same rows on spans of so many knots later."""
        return self._replace(knot=self.knot + knots)


class Entry(NamedTuple):
    """How a motion comes in at its first knot, where that is not at rest.

    Attributes:
        velocity: of the joints and the body centre before the first knot's span ``(15,)``.
        span: length of that span, which is no unknown [s].
    """

    velocity: FloatArray
    span: float


def intervals(times: FloatArray) -> FloatArray:
    """Times between the middles of spans ``(K - 1,)``, of all spans but the last."""
    return (times + np.append(times[1:], times[-1:])) / 2.0


@dataclass(frozen=True, eq=False)
class DynamicLayout(RouteLayout):
    """Data, unknowns and values of a route problem with accelerations.

    Its times are the spans of all knots but the last, which is as long as the one before it.

    Attributes:
        acceleration_limits: on the span of every knot, up and down ``(2, K, 12)`` [rad/s^2].
        interval_velocity_limits: velocity limits between each two spans, up and down
            ``(2, K - 1, 12)`` [rad/s].
        zmp: rows of the zero moment point; none for joint accelerations alone.
        entry: how the motion comes in; ``None`` from rest.
    """

    acceleration_limits: FloatArray = None  # type: ignore[assignment]
    interval_velocity_limits: FloatArray = None  # type: ignore[assignment]
    zmp: ZmpRows = None  # type: ignore[assignment]
    entry: Entry | None = None

    def unpack(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses ``(K, 9)`` and spans ``(K - 1,)`` of a vector of unknowns."""
        poses, times = super().unpack(x)
        if self.entry is not None:
            times[0] = self.entry.span
        return poses, times

    def velocity_changes(self, moves: FloatArray, between: FloatArray) -> FloatArray:
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

    def values_at(self, poses: FloatArray, times: FloatArray, joints: FloatArray) -> FloatArray:
        """All inequalities at given poses ``(K, 9)`` and spans ``(K - 1,)`` [s] with their joints.

        Those with a time in them count it in the problem's unit.
        """
        between, spans = intervals(times), np.append(times, times[-1])
        base = super().values_at(poses, between, joints)
        count = (self.knots - 1) * JOINTS
        base[: 2 * count] += (
            (self.interval_velocity_limits - self.velocity_limits) * between[:, None]
        ).ravel()
        jumps = self.velocity_changes(np.concatenate([joints, poses[:, :3]], axis=1), between)
        room = self.acceleration_limits * spans[:, None]
        z, unit = self.zmp, self.time_unit
        apart = (z.normal * poses[z.knot, :2]).sum(axis=1) - z.offset
        sway, heave = jumps[z.knot, JOINTS : JOINTS + 2], jumps[z.knot, JOINTS + 2]
        pull = (poses[z.knot, 2] - z.ground) * (z.normal * sway).sum(axis=1)
        return np.concatenate([
            base, unit * (room[0] - jumps[:, :JOINTS]).ravel(),
            unit * (room[1] + jumps[:, :JOINTS]).ravel(),
            (apart * (spans[z.knot] + heave / z.gravity) - pull / z.gravity) / unit,
            times / unit - LEAST_SPAN,
        ])  # fmt: skip

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
    def zmp_slots(self) -> RowGroups:
        """The ZMP's rows by their knots."""
        return RowGroups.of(self.zmp.knot, self.knots)

    @cached_property
    def wide(self) -> BlockBand:
        """Where blocks at knots go in the banded matrix."""
        return BlockBand.of(self.local, self.numbering[2])
