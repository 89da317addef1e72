"""What friction, normal forces and torques leave over in one phase.

In a phase the contact points stand still, so the equations of the base ``G f = w`` have a constant
matrix ``G``. Forces that solve them are ``f = G^+ w + N z``, with any ``z``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.certificate.enclosure import chord_deviation
from gaitopt.conventions import GRAVITY, LEGS, FloatArray, frozen
from gaitopt.dynamics.contacts import ForceLimits, pyramid_rows
from gaitopt.dynamics.torque_limits import (
    TorqueLines,
    effort_limits,
    torque_bounds,
    torque_lines,
)
from gaitopt.robots.quadruped import Quadruped


class TorqueLimits(NamedTuple):
    """Least and largest torques at samples, each ``(n, nj)`` [N m]; infinite where not known."""

    low: FloatArray
    high: FloatArray


TOUCH_SHARE = 0.05
"""What a foot may carry beyond its reserve when it lands and lifts off, as a share of the weight:
as promised (:mod:`gaitopt.plan.load_transfer`), and stated here anew on purpose."""

RANK = 1e-9
"""Share of the largest singular value below which one is zero: rounding leaves about 1e-16."""


@dataclass(frozen=True, eq=False)
class Stance:
    """The feet that stand in a phase, and what is asked of their forces.

    Attributes:
        robot, limits: the robot, and what is asked.
        feet: indices of the standing feet ``(k,)``.
        points: their contact points ``(k, 3)`` [m].
        normals: unit normals of the ground there ``(k, 3)``.
        friction: coefficients of friction there ``(k,)``.
    """

    robot: Quadruped
    limits: ForceLimits
    feet: np.ndarray
    points: FloatArray
    normals: FloatArray
    friction: FloatArray

    @cached_property
    def centre(self) -> FloatArray:
        """Reference of moments: the middle of the contact points ``(3,)`` [m]."""
        return self.points.mean(axis=0) if len(self.feet) else np.zeros(3)

    @property
    def weight(self) -> float:
        """Weight of the robot [N]."""
        return self.robot.mass * GRAVITY

    @cached_property
    def reach(self) -> float:
        """Length that makes forces of torques: the reach of a leg [m]."""
        return float(max(leg.reach for leg in self.robot.legs.values()))

    @property
    def tolerance(self) -> float:
        """Size up to which a wrench that the feet cannot make counts as none [N].

        Of two point feet that wrench is the moment about their line, of feet in flight everything.
        A moment is divided by :attr:`reach`.
        """
        half = self.robot.stance_size[0] / 2.0
        return float(self.limits.balance_tolerance * self.weight * half / self.reach)

    @cached_property
    def grasp(self) -> FloatArray:
        """``G``: from contact forces to force and moment about the centre ``(6, 3 k)``."""
        out = np.zeros((6, 3 * len(self.feet)))
        for i, (x, y, z) in enumerate(self.points - self.centre):
            out[:3, 3 * i : 3 * i + 3] = np.eye(3)
            out[3:, 3 * i : 3 * i + 3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
        return out

    @cached_property
    def _split(self) -> tuple[FloatArray, FloatArray]:
        """Pseudo-inverse ``(3 k, 6)`` and null space ``(3 k, d)`` of ``G``."""
        scale = np.repeat([1.0, self.reach], 3)
        left, values, right = np.linalg.svd(self.grasp / scale[:, None])
        rank = int((values > RANK * values.max(initial=1.0)).sum())
        inverse = right[:rank].T @ ((left[:, :rank] / values[:rank]).T / scale)
        return inverse, right[rank:].T

    @property
    def makes_any_wrench(self) -> bool:
        """Whether the standing feet can make every wrench, were there no limits."""
        return bool(3 * len(self.feet) - self.directions.shape[1] == 6)

    @property
    def inverse(self) -> FloatArray:
        """Pseudo-inverse of ``G`` ``(3 k, 6)``."""
        return np.asarray(self._split[0])

    @property
    def directions(self) -> FloatArray:
        """Forces without resultant ``(3 k, d)``."""
        return self._split[1]

    def correction(self, force: FloatArray, moment: FloatArray) -> FloatArray:
        """How much forces change at most to make up for a wrench ``(P, k)`` [N].

        Args:
            force, moment: bounds on its parts ``(P,)`` [N], [N m].
        """
        blocks = self.inverse.reshape(len(self.feet), 3, 6)
        by_force = np.linalg.norm(blocks[:, :, :3], ord=2, axis=(1, 2))
        by_moment = np.linalg.norm(blocks[:, :, 3:], ord=2, axis=(1, 2))
        return np.asarray(force[:, None] * by_force + moment[:, None] * by_moment)

    @cached_property
    def friction_rows(self) -> FloatArray:
        """Sides of the friction pyramids, of unit length ``(k, sides, 3)``."""
        if not len(self.feet):
            return np.zeros((0, self.limits.sides, 3))
        rows = pyramid_rows(self.limits, self.normals, self.friction / self.limits.friction)
        return frozen(rows / np.linalg.norm(rows, axis=2, keepdims=True))

    def sides_of(self, forces: FloatArray) -> FloatArray:
        """What the sides of the pyramids leave of forces ``(n, k, 3)`` [N]: ``(n, k, sides)``."""
        by_foot = np.swapaxes(forces, 0, 1) @ np.swapaxes(self.friction_rows, 1, 2)
        return np.swapaxes(by_foot, 0, 1)

    @cached_property
    def least_normals(self) -> FloatArray:
        """Least normal force of each standing foot ``(k,)`` [N]."""
        standing = np.isin(np.arange(len(LEGS)), self.feet)
        return np.asarray(self.weight * self.limits.least_normal_shares(standing)[self.feet])

    def most_normals(self, left: FloatArray) -> FloatArray:
        """Largest normal forces [N], for the times since feet landed and until they lift off [s].

        Args:
            left: the shorter one of the two for each foot ``(n, k)``.
        """
        shares = self.limits.reserve + TOUCH_SHARE + left / self.limits.transfer_time
        return np.asarray(self.weight * shares)

    @cached_property
    def lines(self) -> TorqueLines | None:
        """How torques fall with the speed of their joints; ``None`` where none does."""
        return torque_lines(self.robot, self.limits)

    def torque_limits(self, speeds: FloatArray) -> TorqueLimits:
        """Limits of the torques at samples.

        Args:
            speeds: of the joints ``(n, nj)`` [rad/s].
        """
        return TorqueLimits(*torque_bounds(self.robot, self.limits, speeds))

    def torque_loss(
        self, ends: tuple[FloatArray, FloatArray], least: FloatArray, most: FloatArray,
        jerk: FloatArray, lengths: FloatArray,
    ) -> FloatArray:  # fmt: skip
        """How far limits that fall with the speed leave their chords at most ``(P, nj)`` [N m].

        The torque that drives a joint falls along a line, and so the limit is a concave function of
        the speed, up to the speed without load: it lies above its chord, but for what the speed
        leaves its own chord by. Beyond that speed it is the largest fall on the piece that counts.

        Args:
            ends: speeds of the joints at both ends of the pieces, each ``(P, nj)`` [rad/s].
            least, most: bounds on the speeds on each piece ``(P, nj)`` [rad/s].
            jerk: bounds on the size of their second derivatives ``(P, nj)`` [rad/s^3].
            lengths: of the pieces ``(P,)`` [s].
        """
        lines = self.lines
        if lines is None:
            return np.zeros_like(least)
        whole = self.limits.torque_share * effort_limits(self.robot).limits
        known = np.isfinite(whole)
        fastest = self.torque_limits(least).low[:, known], self.torque_limits(most).high[:, known]
        fall = np.zeros_like(least)
        for speeds in ends:
            at = self.torque_limits(speeds)
            falls = fastest[0] - at.low[:, known], at.high[:, known] - fastest[1]
            fall[:, known] = np.maximum(fall[:, known], np.maximum(*falls))
        bent = np.where(known, whole, 0.0) / lines.span * chord_deviation(jerk, lengths[:, None])
        within = np.maximum(-least, most) <= lines.no_load
        return np.asarray(np.where(within, np.minimum(bent, fall), fall))

    @cached_property
    def names(self) -> list[str]:
        """What each column of :meth:`left` is about."""
        legs = [LEGS[i] for i in self.feet]
        return [
            *(f"friction {leg}" for leg in legs for _ in range(self.limits.sides)),
            *(f"normal force {leg}" for leg in legs),
            *(f"load transfer {leg}" for leg in legs if self.limits.transfer_time > 0.0),
            *(f"torque {name}" for name in self.robot.joint_names),
        ]

    def left(
        self, forces: FloatArray, torques: FloatArray, limits: TorqueLimits, most: FloatArray
    ) -> FloatArray:
        """What each limit leaves ``(n, r)`` [N].

        Args:
            forces: contact forces ``(n, k, 3)`` [N].
            torques: of the joints ``(n, nj)`` [N m].
            limits: of the torques.
            most: largest normal forces ``(n, k)`` [N], or ``(n, 0)`` for none.
        """
        sides = self.sides_of(forces)
        friction = sides.reshape(len(forces), sides.shape[1] * sides.shape[2])
        pressing = np.einsum("nkd,kd->nk", forces, self.normals)
        over = most - pressing[:, : most.shape[1]]
        torque = np.minimum(limits.high - torques, torques - limits.low) / self.reach
        return np.concatenate([friction, pressing - self.least_normals, over, torque], axis=1)
