"""What friction, normal forces and torques leave over, in many phases at once.

In a phase the contact points stand still, so the equations of the base ``G f = w`` have a constant
matrix ``G``. Forces that solve them are ``f = G^+ w + N z``, with any ``z``. Phases are looked at
together in which equally many feet stand and the matrices have one rank.
"""

from __future__ import annotations

from collections.abc import Collection
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
class Stances:
    """The feet that stand in ``S`` phases, ``k`` in each, and what is asked of their forces.

    Samples and pieces belong to one of the phases each; ``owner`` says to which one.

    Attributes:
        robot, limits: the robot, and what is asked.
        feet: indices of the standing feet ``(S, k)``.
        points: their contact points ``(S, k, 3)`` [m].
        normals: unit normals of the ground there ``(S, k, 3)``.
        friction: coefficients of friction there ``(S, k)``.
        centres: references of moments ``(S, 3)`` [m].
    """

    robot: Quadruped
    limits: ForceLimits
    feet: np.ndarray
    points: FloatArray
    normals: FloatArray
    friction: FloatArray
    centres: FloatArray

    def chosen(self, which: np.ndarray) -> Stances:
        """Some of the phases, by a mask or their numbers."""
        rows = (self.feet, self.points, self.normals, self.friction, self.centres)
        return Stances(self.robot, self.limits, *(each[which] for each in rows))

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
        """``G``: from contact forces to force and moment about the centre ``(S, 6, 3 k)``."""
        count, feet = self.feet.shape
        out = np.zeros((count, 6, feet, 3))
        out[:, :3] = np.eye(3)[:, None]
        x, y, z = np.moveaxis(self.points - self.centres[:, None], -1, 0)
        out[:, 3, :, 1], out[:, 3, :, 2] = -z, y
        out[:, 4, :, 0], out[:, 4, :, 2] = z, -x
        out[:, 5, :, 0], out[:, 5, :, 1] = -y, x
        return out.reshape(count, 6, 3 * feet)

    @cached_property
    def _parts(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Singular values and vectors of ``G``, whose moments are divided by the reach."""
        left, values, right = np.linalg.svd(self.grasp / self._scale[:, None])
        return left, values, right

    @property
    def _scale(self) -> FloatArray:
        return np.repeat([1.0, self.reach], 3)

    @cached_property
    def ranks(self) -> np.ndarray:
        """Rank of each ``G`` ``(S,)``."""
        values = self._parts[1]
        return np.asarray((values > RANK * values.max(axis=1, initial=1.0)[:, None]).sum(axis=1))

    @cached_property
    def _rank(self) -> int:
        """The rank of all ``G``."""
        return int(self.ranks[0])

    @property
    def makes_any_wrench(self) -> bool:
        """Whether the standing feet can make every wrench, were there no limits."""
        return self._rank == 6

    @cached_property
    def inverse(self) -> FloatArray:
        """Pseudo-inverses of ``G``, which have all one rank ``(S, 3 k, 6)``."""
        left, values, right = (part[..., : self._rank] for part in
                               (*self._parts[:2], np.swapaxes(self._parts[2], 1, 2)))  # fmt: skip
        return np.asarray(right @ (np.swapaxes(left / values[:, None], 1, 2) / self._scale))

    @cached_property
    def directions(self) -> FloatArray:
        """Forces without resultant ``(S, 3 k, d)``."""
        return np.asarray(np.swapaxes(self._parts[2][:, self._rank :], 1, 2))

    def correction(self, force: FloatArray, moment: FloatArray, owner: np.ndarray) -> FloatArray:
        """How much forces change at most to make up for a wrench ``(P, k)`` [N].

        Args:
            force, moment: bounds on its parts ``(P,)`` [N], [N m].
            owner: the phases ``(P,)``.
        """
        blocks = self.inverse.reshape(*self.feet.shape, 3, 6)
        by_force = np.linalg.norm(blocks[..., :3], ord=2, axis=(2, 3))
        by_moment = np.linalg.norm(blocks[..., 3:], ord=2, axis=(2, 3))
        return np.asarray(force[:, None] * by_force[owner] + moment[:, None] * by_moment[owner])

    @cached_property
    def friction_rows(self) -> FloatArray:
        """Sides of the friction pyramids, of unit length ``(S, k, sides, 3)``."""
        if not self.feet.size:
            return np.zeros((*self.feet.shape, self.limits.sides, 3))
        rows = pyramid_rows(self.limits, self.normals, self.friction / self.limits.friction)
        return frozen(rows / np.linalg.norm(rows, axis=3, keepdims=True))

    def sides_of(self, forces: FloatArray, owner: np.ndarray) -> FloatArray:
        """What the sides of the pyramids leave of forces [N].

        Args:
            forces: ``(n, k, 3)`` [N].
            owner: the phases ``(n,)``.

        Returns:
            ``(n, k sides)``.
        """
        sides = (self.friction_rows[owner] @ forces[..., None])[..., 0]
        return np.asarray(sides.reshape(len(forces), self.feet.shape[1] * self.limits.sides))

    @cached_property
    def least_normals(self) -> FloatArray:
        """Least normal force of each standing foot ``(S, k)`` [N]."""
        shares = {}
        for feet in set(map(tuple, self.feet.tolist())):
            standing = np.isin(np.arange(len(LEGS)), feet)
            shares[feet] = self.limits.least_normal_shares(standing)[list(feet)]
        each = [shares[feet] for feet in map(tuple, self.feet.tolist())]
        return np.asarray(self.weight * np.reshape(each, self.feet.shape))

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

    def left(
        self, forces: FloatArray, torques: FloatArray, limits: TorqueLimits, most: FloatArray,
        owner: np.ndarray,
    ) -> FloatArray:  # fmt: skip
        """What each limit leaves ``(n, r)`` [N].

        Args:
            forces: contact forces ``(n, k, 3)`` [N].
            torques: of the joints ``(n, nj)`` [N m].
            limits: of the torques.
            most: largest normal forces ``(n, k)`` [N], or ``(n, 0)`` for none.
            owner: the phases ``(n,)``.
        """
        pressing = np.einsum("nkd,nkd->nk", forces, self.normals[owner])
        over = most - pressing[:, : most.shape[1]]
        torque = np.minimum(limits.high - torques, torques - limits.low) / self.reach
        friction, resting = self.sides_of(forces, owner), pressing - self.least_normals[owner]
        return np.concatenate([friction, resting, over, torque], axis=1)


def limit_name(
    robot: Quadruped, limits: ForceLimits, standing: Collection[str], column: int
) -> str:
    """What a column of :meth:`Stances.left` is about; the one beyond the last is the balance.

    Args:
        robot, limits: the robot, and what is asked.
        standing: the legs that stand.
        column: number of the column.
    """
    legs = [leg for leg in LEGS if leg in standing]
    names = [
        *(f"friction {leg}" for leg in legs for _ in range(limits.sides)),
        *(f"normal force {leg}" for leg in legs),
        *(f"load transfer {leg}" for leg in legs if limits.transfer_time > 0.0),
        *(f"torque {name}" for name in robot.joint_names),
        "a wrench that the standing feet cannot make",
    ]
    return names[column]
