"""The data of a walk with acceleration limits, and how its unknowns and rows are numbered.

Here the poses are control points of a quadratic B-spline in time
(:mod:`gaitopt.optimize.route.dynamic_problem`). Beside the words of
:mod:`gaitopt.optimize.route.layout`:

- A *span* is the piece of the spline that belongs to a knot, on which its acceleration is
  constant. The unknown times are the spans of all knots but the last, whose span is as long as the
  one before it.
- An *interval* reaches from the middle of a knot's span to the middle of the next. The spline's
  velocity at the border of two spans is the change of pose over the interval's time.
- A *velocity change* is that over a knot's span: its acceleration times its span.

Arrays over both directions of a limit begin with the limit on positive values.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.band import RowGroups
from gaitopt.optimize.route.layout import RouteLayout, sorted_by_knot
from gaitopt.optimize.route.legs import BODY, JOINTS
from gaitopt.optimize.route.place_blocks import PlaceBand

LEAST_SPAN = 0.01
"""Shortest span by default, in time units: a hundredth of the time in which the slowest joint turns
17 degrees. Spans of a solution are much longer; rows of accelerations need positive ones."""


class ZmpRows(NamedTuple):
    """Inequalities ``normal . zmp >= offset`` on the zero moment point in the spans of knots.

    The ZMP is that of a point mass at the body centre: ``c - height / (g + a_z) a`` with the body
    centre ``c``, its acceleration ``a``, and its height above ``ground``. Each row is multiplied by
    its span and by ``(g + a_z) / g``: so it is a polynomial of places and velocity changes.

    Attributes:
        knot: the knot whose span each row looks at ``(M,)``, ascending.
        normal: ``(M, 2)``.
        offset: ``(M,)`` [m].
        ground: height of the ground ``(M,)`` [m].
        least: the offset that is to be kept between knots, too ``(M,)`` [m].
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

    def terms(self, poses: FloatArray, velocity_changes: FloatArray) -> ZmpTerms:
        """What the rows are made of.

        Args:
            poses: of all knots ``(K, 9)``.
            velocity_changes: of the body centre in all spans ``(K, 3)``.
        """
        change = velocity_changes[self.knot]
        return ZmpTerms(
            (self.normal * poses[self.knot, :2]).sum(axis=1) - self.offset,
            poses[self.knot, 2] - self.ground,
            (self.normal * change[:, :2]).sum(axis=1), change[:, 2],
        )  # fmt: skip


class ZmpTerms(NamedTuple):
    """What rows of the ZMP are made of, each ``(M,)``.

    Attributes:
        distance: of the body centre from the row's line, inward [m].
        height: of the body centre above the ground [m].
        change_inward: velocity change of the body centre along the row's normal.
        change_up: its vertical velocity change.
    """

    distance: FloatArray
    height: FloatArray
    change_inward: FloatArray
    change_up: FloatArray


class Entry(NamedTuple):
    """How a motion comes in at its first knot, where it does not begin at rest.

    Attributes:
        velocity: of joints and body centre before the first knot's span ``(15,)``.
        span: length of that span, which is no unknown [s].
    """

    velocity: FloatArray
    span: float


def interval_times(spans: FloatArray) -> FloatArray:
    """Times between the middles of neighbouring spans ``(K - 1,)``.

    Args:
        spans: of all knots but the last ``(K - 1,)``.
    """
    return (spans + np.append(spans[1:], spans[-1:])) / 2.0


class DynamicParts(NamedTuple):
    """A vector over all rows, split by what they are about.

    Attributes:
        static: a vector over the rows of the problem without accelerations ``(m0,)``, with zeros
            in place of velocity rows, which are others here.
        accelerations: limits of accelerations ``(2, K, 12)``.
        velocities: limits of velocities ``(2, K, 12)``; of interval ``k`` at knot ``k``, with
            zeros at the last knot.
        zmp: rows of the ZMP ``(M,)``.
        spans: shortest spans ``(K - 1,)``, with zero for one that is no unknown.
    """

    static: FloatArray
    accelerations: FloatArray
    velocities: FloatArray
    zmp: FloatArray
    spans: FloatArray


@dataclass(frozen=True, eq=False, kw_only=True)
class DynamicLayout(RouteLayout):
    """The data of a problem with acceleration limits, its numbering, and its rows' values.

    Attributes:
        acceleration_limits: of the joints in every span, up and down ``(2, K, 12)`` [rad/s^2].
        interval_velocity_limits: of the joints in every interval, up and down ``(2, K - 1, 12)``
            [rad/s].
        zmp: rows of the zero moment point; none for joint accelerations alone.
        entry: how the motion comes in; ``None`` from rest.
        least_span: shortest span, in time units.
    """

    acceleration_limits: FloatArray
    interval_velocity_limits: FloatArray
    zmp: ZmpRows
    entry: Entry | None = None
    least_span: float = LEAST_SPAN

    def unpack(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses ``(K, 9)`` and spans ``(K - 1,)`` [s] of a vector of unknowns."""
        poses, spans = super().unpack(x)
        if self.entry is not None:
            spans[0] = self.entry.span
        return poses, spans

    def velocity_changes(self, places: FloatArray, times: FloatArray) -> FloatArray:
        """Velocity changes over all spans ``(K, 15)``; the motion ends at rest.

        Args:
            places: joints and body centre at all knots ``(K, 15)``.
            times: of all intervals ``(K - 1,)`` [s].
        """
        velocity = np.diff(places, axis=0) / times[:, None]
        rest = np.zeros((1, places.shape[1]))
        before = rest if self.entry is None else self.entry.velocity[None]
        return np.diff(np.concatenate([before, velocity, rest]), axis=0)

    def row_values(
        self, poses: FloatArray, times: FloatArray, joints: FloatArray,
        com: FloatArray | None = None,
    ) -> FloatArray:  # fmt: skip
        """Values of all rows ``(m,)``.

        Rows with a time in them are counted in time units, so that all are of like size.

        Args:
            poses: of all knots ``(K, 9)``.
            times: spans of all knots but the last ``(K - 1,)`` [s].
            joints: at the poses ``(K, 12)`` [rad].
            com: the centre of mass there ``(K, 3)`` [m], if it is known.
        """
        between, spans = interval_times(times), np.append(times, times[-1])
        turned, way = np.diff(joints, axis=0), self.interval_velocity_limits * between[:, None]
        changes = self.velocity_changes(np.concatenate([joints, poses[:, BODY]], axis=1), between)
        zmp, unit = self.zmp, self.time_unit
        limit, turns = (
            self.acceleration_limits * (unit * spans)[:, None],
            unit * changes[:, :JOINTS],
        )
        distance, height, inward, up = zmp.terms(poses, changes[:, JOINTS:])
        return np.concatenate([
            (way[0] - turned).ravel(), (way[1] + turned).ravel(),
            *self.pose_values(poses, joints, com),
            (limit[0] - turns).ravel(), (limit[1] + turns).ravel(),
            (distance * (spans[zmp.knot] + up / zmp.gravity)
             - height * inward / zmp.gravity) / unit,
            times / unit - self.least_span,
        ])  # fmt: skip

    def split_dynamic(self, v: FloatArray) -> DynamicParts:
        """A vector over all rows ``(m,)``, part by part."""
        accelerations, spans = 2 * self.knots * JOINTS, self.knots - 1
        static = len(v) - accelerations - len(self.zmp.knot) - spans
        zmp = static + accelerations
        quiet, least = v[:static].copy(), v[len(v) - spans :].copy()
        count = 2 * (self.knots - 1) * JOINTS
        velocities = np.zeros((2, self.knots, JOINTS))
        velocities[:, :-1] = quiet[:count].reshape(2, -1, JOINTS)
        quiet[:count] = 0.0
        if self.entry is not None:
            least[0] = 0.0
        return DynamicParts(
            quiet, v[static:zmp].reshape(2, -1, JOINTS), velocities, v[zmp : len(v) - spans], least,
        )  # fmt: skip

    @cached_property
    def zmp_by_knot(self) -> RowGroups:
        """The ZMP's rows by their knots."""
        return RowGroups.of(self.zmp.knot, self.knots)

    @cached_property
    def body_axes(self) -> np.ndarray:
        """Axes of the body centre that are unknown at any knot; first among the poses' entries."""
        return self.free_columns[self.free_columns < BODY.stop]

    @cached_property
    def place_band(self) -> PlaceBand:
        """Where entries of poses and spans go in the banded matrix."""
        poses, times, size = self.numbering
        spans = np.append(times, times[-1:])
        if self.entry is not None:
            spans[0] = -1
        return PlaceBand.of(poses, spans, size)
