"""Heights of the body that are tried, and those from which all legs reach their feet.

The foot of a leg is at most as far from its hip as the leg is long when straight, and at least as
far as when it is folded. Along a vertical this is a quadratic inequality for the body's height, so
the heights from which a leg reaches its foot are an interval, and those for all legs are, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.pairs import Pairs
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix

KEPT_BACK = 0.005
"""How far legs keep from being straight or folded at these heights, as a share of their reach: the
angles of their joints keep a distance from their limits, too."""
LOWEST, HIGHEST = 0.5, 1.1
"""Lowest and highest body that is tried, as shares of the usual height. Chosen: lower ones touch
the ground, and at higher ones legs are straight."""


class Attempt(NamedTuple):
    """One way to make a step.

    Attributes:
        height: of the body, as a share of the usual height.
        pitch: of the body, beyond that of the plane through the feet [rad].
        low: whether the foot only clears the ground, and does not rise by ``swing_height``.
        fitted: whether the body is lower or higher where legs would not reach their feet.
    """

    height: float
    pitch: float = 0.0
    low: bool = True
    fitted: bool = False


PITCHES = (-0.15, 0.15)
"""Pitches beyond that of the plane through the feet that are tried [rad]."""
ATTEMPTS = (
    Attempt(1.0, low=False), Attempt(1.0, fitted=True), Attempt(0.92), Attempt(1.06), Attempt(0.84),
)  # fmt: skip
"""Ways that are tried one after the other while many steps are not possible. Chosen: a lower body
reaches footholds farther down, a higher one lifts limbs over stones, and a leg that lifts its foot
less comes less near to the step behind it."""
RARE_ATTEMPTS = (
    *(Attempt(1.0, pitch, fitted=True) for pitch in PITCHES), Attempt(0.88),
    *(Attempt(0.92, pitch) for pitch in PITCHES),
)  # fmt: skip
"""Ways that are tried where hardly any step is possible. Chosen: of nine heights and pitches those
that made steps possible on stairs of 12 cm and rubble of 15 cm (go2)."""


@dataclass(frozen=True, eq=False)
class Heights:
    """The heights for one robot.

    Attributes:
        limbs: the robot's links.
        hips: of the legs, body frame ``(4, 3)`` [m].
        least, most: squared distances of a foot from its hip ``(4,)`` [m^2].
        usual: height of the body above the mean of its feet [m].
    """

    limbs: Limbs
    hips: FloatArray
    least: FloatArray
    most: FloatArray
    usual: float

    @classmethod
    def of(cls, robot: Quadruped, limbs: Limbs, settings: TerrainSettings) -> Heights:
        """The heights for a robot and what its search asks for."""
        legs = [robot.legs[leg] for leg in LEGS]
        least, most = [], []
        for leg in legs:
            slack, aside = KEPT_BACK * leg.reach, leg.lateral**2
            least.append((leg.least_reach + slack - leg.drop) ** 2 + aside)
            most.append((settings.reach_fraction * leg.reach - slack - leg.drop) ** 2 + aside)
        hips = np.array([leg.hip for leg in legs])
        return cls(limbs, hips, np.array(least), np.array(most), settings.body_height)

    def fitted(self, pairs: Pairs, posture: FloatArray, places: FloatArray) -> FloatArray:
        """The heights nearest to those that are asked for ``(K, P)`` [m], which stay without any.

        Args:
            pairs: steps; all four feet are to be reached, and the foothold.
            posture: height that is asked for, roll, pitch and yaw ``(K, 4)``.
            places: of the body, at this height ``(K, P, 3)`` [m].
        """
        points, poses = feet_and_poses(pairs, posture, places)
        legs = [0, 1, 2, 3, pairs.leg]
        away = self.limbs.local(points, poses) - self.hips[legs]
        up = rpy_to_matrix(poses[:, 3:])[:, 2]
        along = np.einsum("nki,ni->nk", away, up)
        square = (away**2).sum(axis=2)
        # The body rises by d: the square of the foot's distance is square - 2 d along + d^2.
        room = along**2 - square + self.most[legs]
        with np.errstate(invalid="ignore"):
            highest = (along + np.sqrt(room)).min(axis=1)
        folded = along**2 - square + self.least[legs]
        lowest = np.where(folded > 0.0, along + np.sqrt(np.maximum(folded, 0.0)), -np.inf)
        lowest = np.maximum(lowest.max(axis=1), (LOWEST - 1.0) * self.usual)
        highest = np.minimum(highest, (HIGHEST - 1.0) * self.usual)
        rise = np.clip(0.0, lowest, highest)
        fitted = poses[:, 2] + np.where(lowest <= highest, rise, 0.0)
        return np.asarray(fitted.reshape(places.shape[:2]))


def feet_and_poses(
    pairs: Pairs, posture: FloatArray, places: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The feet and the foothold ``(K P, 5, 3)`` [m], and poses of the body ``(K P, 6)``, of pairs.

    Args:
        pairs: steps.
        posture: height, roll, pitch and yaw of the body ``(K, 4)``.
        places: of the body ``(K, P, 3)`` [m].
    """
    count, choices = places.shape[:2]
    turned = np.broadcast_to(posture[:, None, 1:], (count, choices, 3))
    poses = np.concatenate([places, turned], axis=2).reshape(-1, 6)
    points = np.concatenate([pairs.feet, pairs.target[:, None]], axis=1)
    return np.repeat(points, choices, axis=0), poses
