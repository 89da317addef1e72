"""A leg of any three hinges, with the interface of the legs whose inverse is a closed form.

Hips whose axes are not square to each other, and legs whose joints come in another order, have no
leg frame in which sine and cosine separate. Their inverse is a closed form where the first two
axes meet or are parallel, and otherwise the roots of a polynomial of fourth degree
(:mod:`gaitopt.robots.general_leg.inverse`). Of the up to four postures the leg takes the one that
is on the same side of straight and folded as its standing posture, and nearest to it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.inputs import check_leads, check_shape
from gaitopt.robots.general_leg.hinges import ThreeHinges
from gaitopt.robots.general_leg.inverse import HingeInverse
from gaitopt.robots.leg import Leg
from gaitopt.robots.leg_angles import wrap_angle

CLOSE_ENOUGH = 0.01
"""How far from a point the foot of a posture may be, so that Newton's method starts from it, as a
share of the leg's length. Others are postures for points out of reach."""
LEAST_TURN, TURN_BY_GAP = 1e-6, 10.0
"""How much the determinant of a posture's Jacobian may differ in sign from that of the standing
posture, as a share of the leg's cubed length: for a foot in its place (the knee is then straight or
folded to about 1e-6 rad), and more for one that is away from it, by the share of the leg's length
that it is away. Chosen."""
MOST_AWAY = 3.0 * np.pi**2
"""Largest squared distance between two postures [rad^2]."""
ROUNDING = 1e-12
"""A foot that is nearer to its place than this share of the leg's length is there."""


@dataclass(frozen=True, eq=False)
class GeneralLeg(Leg):
    """One leg of three hinges with any axes.

    Its size is in the attributes of :class:`gaitopt.Leg`, with these meanings: ``hip`` is the
    place of the shoulder, where the second axis is nearest to the first one, in the standing
    posture; ``axes`` are the body's; ``lateral`` is the offset of the foot from the shoulder along
    the axis of the knee, and ``upper`` and ``lower`` are lengths square to that axis; ``drop`` is
    0; of a spider's leg whose foot stands beside its hip, ``hip`` is the place above the foot as
    high as the shoulder, and ``lateral`` is 0; of ``signs`` and ``zeros`` those of the knee count.

    Attributes:
        hinges: the axes.
        standing: joint angles of the standing posture ``(3,)`` [rad].
        slack: how much longer the leg may be than the distance of its foot from ``hip`` tells [m]:
            the shoulder of a leg whose first two axes do not meet moves with the first joint.
    """

    hinges: ThreeHinges = field(kw_only=True)
    standing: FloatArray = field(kw_only=True)
    slack: float = field(kw_only=True, default=0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "standing", frozen(self.standing))

    @property
    def is_general(self) -> bool:
        """Always true."""
        return True

    @property
    def is_closed_form(self) -> bool:
        """Whether :meth:`inverse` needs no iteration."""
        return self._solver.is_closed_form

    @property
    def constants(self) -> FloatArray:
        """All numbers that set the leg's kinematics ``(n,)``."""
        parts = (super().constants, self.hinges.axes, self.hinges.points, self.hinges.foot)
        return np.concatenate([np.ravel(part) for part in parts])

    def forward_columns(self, *q: Any) -> tuple[Any, Any, Any]:
        """:meth:`forward` on separate columns; takes arrays or CasADi symbols."""
        return self.hinges.moved(tuple(self.hinges.foot), q)

    def inverse(self, point: Any) -> FloatArray:
        """Joint angles that put the foot at ``point``.

        The posture is that on the standing posture's side of straight and folded. For a point that
        cannot be reached, the nearest posture that Newton's method finds is returned;
        :meth:`shortfall` tells whether it can.

        Args:
            point: foot position in the body frame ``(..., 3)`` [m].

        Returns:
            ``(..., 3)`` [rad], each angle within half a turn of the middle of its limits; NaN for a
            place that is not finite.
        """
        place = check_shape("point", point, 3)
        rows = place.reshape(-1, 3)
        finite = np.isfinite(rows).all(axis=-1)
        found = np.full(rows.shape, np.nan)
        found[finite] = self._posture(rows[finite])
        return np.asarray(wrap_angle(found, np.array(self.centres)).reshape(place.shape))

    def inverse_columns(self, x: Any, y: Any, z: Any) -> tuple[Any, ...]:
        """:meth:`inverse` on separate columns; takes arrays only, and no CasADi symbols."""
        return tuple(np.moveaxis(self.inverse(np.stack(np.broadcast_arrays(x, y, z), -1)), -1, 0))

    def jacobian(self, q: Any) -> FloatArray:
        """Derivative of :meth:`forward`, ``(..., 3, 3)`` [m/rad], in the body frame.

        Args:
            q: joint angles ``(..., 3)`` [rad].
        """
        return self.hinges.placed(check_shape("q", q, 3)).jacobian

    def jacobian_rate(self, q: ArrayLike, rates: ArrayLike) -> FloatArray:
        """Derivative of :meth:`jacobian` over time ``(..., 3, 3)``, in the body frame.

        Args:
            q, rates: joint angles, and their derivatives ``(..., 3)`` [rad], [rad/s].

        Raises:
            InputError: an array has another shape.
        """
        angles, speeds = check_shape("q", q, 3), check_shape("rates", rates, 3)
        check_leads(q=angles.shape, rates=speeds.shape)
        angles, speeds = np.broadcast_arrays(angles, speeds)
        return self.hinges.placed(angles).jacobian_rate(speeds)

    def joint_points(self, q: FloatArray) -> FloatArray:
        """Hip, shoulder, knee and foot in the body frame ``(..., 4, 3)`` [m].

        Args:
            q: joint angles ``(..., 3)`` [rad].
        """
        columns, solver = tuple(np.moveaxis(q, -1, 0)), self._solver
        points = ((solver.start, 0), (solver.shoulder, 1), (solver.knee, 2), (self.hinges.foot, 3))
        lead = np.zeros(q.shape[:-1])
        return np.stack([
            np.stack([x + lead for x in self.hinges.moved(tuple(point), columns[:joints])], axis=-1)
            for point, joints in points
        ], axis=-2)  # fmt: skip

    def straightness(self, x: Any, y: Any, z: Any) -> Any:
        """A bound on the squared length of the leg, square to the knee's axis, ``s**2`` [m^2].

        For legs whose first two axes meet it is that length itself, and the foot at ``(x, y, z)``
        (body frame, [m]) is within reach when ``s**2 <= reach**2``. Convex in ``x, y`` for a foot
        below the hip.
        """
        dx, dy, dz = x - self.hip[0], y - self.hip[1], z - self.hip[2]
        square = np.maximum(dx * dx + dy * dy + dz * dz - self.lateral**2, 0.0)
        return (np.sqrt(square) + self.slack) ** 2 if self.slack else square

    @property
    def levers(self) -> FloatArray:
        """Bounds on the foot's distance from the axis of each joint ``(3,)`` [m]."""
        solver = self._solver
        return np.array([solver.size, solver.size - abs(solver.offset), self.lower])

    def shortfall(self, point: Any) -> FloatArray:
        """How far ``point`` ``(..., 3)`` lies outside the leg's reach ``(...)`` [m]; 0 inside.

        It is the distance from where the leg gets with any knee, and how much longer or shorter the
        leg then is than the knee's limits allow.
        """
        length, missing = self._length_and_gap(point)
        over = np.maximum(np.maximum(length - self.reach, self.least_reach - length), 0.0)
        short, rounding = missing + over, ROUNDING * self._solver.size
        return np.asarray(np.where(short <= rounding, 0.0, short))

    def length(self, point: Any) -> FloatArray:
        """Length of the leg, square to the knee's axis, for places ``(..., 3)``: ``(...)`` [m].

        For a place that it does not reach, with the distance from where it gets.
        """
        length, missing = self._length_and_gap(point)
        return np.asarray(length + missing)

    def _length_and_gap(self, point: Any) -> tuple[FloatArray, FloatArray]:
        """Length of the leg square to the knee's axis, and the distance of its foot from a place.

        ``(...)`` each [m].
        """
        place = check_shape("point", point, 3)
        q = self.inverse(place)
        bend = self.signs[2] * q[..., 2] + self.zeros[1]
        square = self.upper**2 + self.lower**2 + 2.0 * self.upper * self.lower * np.cos(bend)
        missing = np.linalg.norm(self.forward(q) - place, axis=-1)
        return np.sqrt(np.maximum(square, 0.0)), np.asarray(missing)

    def gap_in_words(self, point: FloatArray) -> str:
        """What is wrong with a place ``(3,)`` that the leg does not reach."""
        return (
            f"{float(self.shortfall(point)):.4g} m away from where the leg gets, whose knee allows "
            f"{self.least_reach:.4g} to {self.reach:.4g} m from its shoulder"
        )

    @cached_property
    def _solver(self) -> HingeInverse:
        return HingeInverse.of(self.hinges)

    @cached_property
    def _standing_side(self) -> float:
        """Sign of the Jacobian's determinant in the standing posture."""
        return float(np.sign(np.linalg.det(self.jacobian(self.standing))))

    @cached_property
    def _standing_axis(self) -> FloatArray:
        """The knee's axis in the standing posture ``(3,)``."""
        return np.asarray(self.hinges.placed(self.standing).axes[2])

    def _posture(self, points: FloatArray) -> FloatArray:
        """Joint angles ``(N, 3)`` [rad] for places of the foot ``(N, 3)`` [m] that are finite."""
        solver = self._solver
        found = solver.postures(points)
        if solver.is_rough:
            each = np.repeat(points, found.shape[1], axis=0)
            found = solver.improved(found.reshape(-1, 3), each).reshape(found.shape)
        at = self.hinges.placed(found)
        missing = np.linalg.norm(at.foot - points[:, None], axis=-1) / solver.size
        turn = self._standing_side * np.linalg.det(at.jacobian) / solver.size**3
        # The sign changes where two postures become one, and beyond it says nothing.
        wrong = turn < -(LEAST_TURN + TURN_BY_GAP * missing)
        away = (wrap_angle(found - self.standing) ** 2).sum(axis=-1)
        # With the hip turned by half a turn the leg is on the other side of the body.
        upright = at.axes[..., 2, :] @ self._standing_axis > 0.0
        reached = (missing <= CLOSE_ENOUGH) & upright
        poor = np.where(reached.any(axis=-1, keepdims=True), 2.0 * ~reached, 2.0 * missing)
        rows, taken = np.arange(len(found)), (away + MOST_AWAY * (wrong + poor)).argmin(axis=-1)
        best = found[rows, taken]
        # Newton's method for what is not exact: roots of a polynomial, and places out of reach.
        inexact = missing[rows, taken] > (ROUNDING if self.is_closed_form else 0.0)
        best[inexact] = solver.improved(best[inexact], points[inexact])
        return np.asarray(best)
