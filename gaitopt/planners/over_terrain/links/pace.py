"""How long steps take, estimated before any of them is timed.

The body goes from one place of rest to the next, and the foot from one foothold to the next. Each
is held back by the velocities of joints, or by contact forces and torques, for which an
acceleration stands: from rest to rest over a way ``d`` that takes ``2 sqrt(d / a)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.pairs import Pairs
from gaitopt.planners.over_terrain.settings import TerrainSettings

BODY_ACCELERATION = 3.9
"""Of the body between two swings [m/s^2]. Measured: timings by contact forces over ten made grounds
reach 2.9 (hyq) to 4.8 (anymal_c), on ground with a friction of 0.6 (docs/terrain.md)."""
FOOT_ACCELERATION = 60.0
"""Of a flying foot along its way [m/s^2]. Measured: 30 (anymal_c) to 100 (hyq) on these grounds."""
CORNERS = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Places along the top of a box swing between which joint angles are taken as straight."""


@dataclass(frozen=True, eq=False)
class Pace:
    """The estimates for one robot.

    Attributes:
        limbs: the robot's links.
        velocities: joint velocity limits ``(4, 3)`` [rad/s], infinite for joints without.
        step: time of a usual step on level ground [s]: the penalties of the search are counted in
            the times of such steps.
        swing: share of it that the swing takes [s].
        way: of the foot in it [m].
    """

    limbs: Limbs
    velocities: FloatArray
    step: float
    swing: float
    way: float

    @classmethod
    def of(cls, limbs: Limbs, settings: TerrainSettings, hips: FloatArray) -> Pace:
        """The estimates for a robot and what its search asks for.

        Args:
            limbs: the robot's links.
            settings: of the search; the usual step is one of its ``step_length``.
            hips: usual places of the feet from the body centre, body frame ``(4, 2)`` [m].
        """
        velocities = np.array([limbs.robot.legs[leg].velocity_limits for leg in LEGS])
        length = settings.step_length
        feet = np.column_stack([hips, np.full(len(LEGS), -settings.body_height)])
        # Halfway through the stance of each foot it is below its hip.
        begin = feet - np.array([length / 2.0, 0.0, 0.0])
        end, level = begin + np.array([length, 0.0, 0.0]), np.zeros((1, 6))
        first = cls(limbs, velocities, 0.0, 0.0, length)
        rise = np.full(1, settings.swing_height)
        swings = [
            first.of_swings(leg, begin[leg, None], end[leg, None], rise, level)[0]
            for leg in range(len(LEGS))
        ]
        # In a cycle of four swings the body moves twice, by half of the step each time.
        quarter = np.array([length / 4.0, 0.0, 0.0])
        back, ahead = (limbs.local(at[None], level)[0] for at in (feet - quarter, feet + quarter))
        legs = [limbs.robot.legs[leg] for leg in LEGS]
        turns = np.array([leg.inverse(ahead[k]) - leg.inverse(back[k])
                          for k, leg in enumerate(legs)])  # fmt: skip
        body = float(first.of_moves(np.full(1, length / 2.0), turns[None])[0])
        swing = float(np.mean(swings))
        return cls(limbs, velocities, swing + body / 2.0, swing, length)

    def of_moves(self, ways: FloatArray, turns: FloatArray) -> FloatArray:
        """Times of moves of the body on four feet ``(K,)`` [s].

        Args:
            ways: of the body ``(K,)`` [m].
            turns: changes of the joints' angles ``(K, 4, 3)`` [rad].
        """
        by_joints = (np.abs(turns) / self.velocities).max(axis=(1, 2))
        return np.asarray(np.maximum(2.0 * np.sqrt(ways / BODY_ACCELERATION), by_joints))

    def of_swings(
        self, leg: int, start: FloatArray, end: FloatArray, rise: FloatArray, poses: FloatArray
    ) -> FloatArray:
        """Times of box swings of a leg ``(K,)`` [s].

        Args:
            leg: index of the leg.
            start, end: of the swings ``(K, 3)`` [m].
            rise: of their tops above their higher ends ``(K,)`` [m].
            poses: of the body meanwhile ``(K, 6)``.
        """
        over = start[:, None] + np.array(CORNERS)[:, None] * (end - start)[:, None]
        over[..., 2] = (np.maximum(start[:, 2], end[:, 2]) + rise)[:, None]
        path = np.concatenate([start[:, None], over, end[:, None]], axis=1)
        angles = self.limbs.robot.legs[LEGS[leg]].inverse(self.limbs.local(path, poses))
        turns = np.abs(np.diff(angles, axis=1))
        by_joints = (turns / self.velocities[leg]).max(axis=2).sum(axis=1)
        way = np.linalg.norm(np.diff(path, axis=1), axis=2).sum(axis=1)
        return np.asarray(np.hypot(by_joints, 2.0 * np.sqrt(way / FOOT_ACCELERATION)))

    def rough(self, ways: FloatArray) -> FloatArray:
        """Roughly the times of swings between places that are ``ways (K,)`` apart [m], in [s]."""
        return self.swing * ways / self.way

    def of_steps(
        self, pairs: Pairs, body: FloatArray, rise: FloatArray, angles: FloatArray
    ) -> FloatArray:
        """Times of steps: of the body's move and of the swing ``(K,)`` [s].

        Args:
            pairs: the steps.
            body: its pose in the swing ``(K, 6)``.
            rise: of the swings above their higher ends ``(K,)`` [m].
            angles: of the legs before and after the body's move ``(2, K, 4, 3)`` [rad].
        """
        start = pairs.feet[:, pairs.leg]
        moved = np.linalg.norm(body[:, :3] - pairs.body[:, :3], axis=1)
        swings = self.of_swings(pairs.leg, start, pairs.target, rise, body)
        return self.of_moves(moved, angles[1] - angles[0]) + swings
