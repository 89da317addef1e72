"""How high a robot stands, with its feet below its hips."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.robots.leg import Leg

STANDING_SHARE = 0.7
"""Height of the hips of a standing robot as a share of its legs' reach. Chosen: it makes 0.40 m for
wang2020, the height at which [Wang2020] walks."""
STANDING_SHARES = (0.7, 0.8, 0.6, 0.9, 0.5)
"""Heights at which a leg is tried, as shares of its reach. Chosen: those of walking robots."""
LEVEL_FEET, LEAST_STANDING = 0.03, 0.4
"""Largest difference of the feet's heights, and least height of the hips, of a standing robot, as
shares of its legs' reach. Chosen: files also hold poses of lying and of other robots."""
LEAST_STRETCH = 0.3
"""Least height of the hips in that range which the knees' limits allow, as a share of it. Chosen:
some knees bend little, and a walk needs room below."""
STEP = 0.01
"""Heights are whole multiples of this, and at least this [m]."""


def standing_height(legs: Sequence[Leg], pose: Mapping[str, float]) -> float:
    """Height of the hips above the feet of a standing robot, in whole centimetres [m].

    Args:
        legs: the robot's.
        pose: joint angles of the file's standing pose, by joint [rad]; empty for none.
    """
    reach = float(np.mean([leg.reach + leg.drop for leg in legs]))
    told = _height_in(pose, legs, reach)
    if told is not None:
        return told
    least = float(np.mean([leg.least_reach + leg.drop for leg in legs]))
    bent = least + LEAST_STRETCH * (reach - least)
    usual = _whole(max(STANDING_SHARE * reach, bent))
    heights = np.round(np.arange(max(least, STEP), reach, STEP), 2)
    nearest = sorted(heights.tolist(), key=lambda height: abs(height - usual))
    return next((h for h in [usual, *nearest] if _may_stand(legs, h)), usual)


def can_stand(leg: Leg) -> bool:
    """Whether a leg keeps its joints' limits with the foot below the hip, at some usual height."""
    reach = leg.reach + leg.drop
    return any(_may_stand([leg], share * reach) for share in STANDING_SHARES)


def foot_below_hip(leg: Leg, height: float) -> FloatArray:
    """The foot's place ``(3,)`` in the body frame straight below the hip, so far below it [m]."""
    foot = leg.hip + leg.axes[:, 1] * leg.lateral
    foot[2] = leg.hip[2] - height
    return foot


def _may_stand(legs: Sequence[Leg], height: float) -> bool:
    """Whether joints keep their limits with feet below hips of this height [m]."""
    for leg in legs:
        foot = foot_below_hip(leg, height)
        if leg.shortfall(foot) > 0.0 or not _within(leg, leg.inverse(foot)):
            return False
    return True


def _height_in(pose: Mapping[str, float], legs: Sequence[Leg], reach: float) -> float | None:
    """Height of the hips in a pose [m]; ``None`` where the robot does not stand in it.

    In a standing pose joints keep their limits, and the feet are level.
    """
    heights = []
    for leg in legs:
        angles = np.array([pose.get(joint, np.nan) for joint in leg.joints])
        if not _within(leg, angles):
            return None
        heights.append(float(leg.hip[2] - leg.forward(angles)[2]))
    height, spread = float(np.mean(heights)), float(np.ptp(heights))
    good = spread <= LEVEL_FEET * reach and LEAST_STANDING * reach <= height
    return _whole(height) if good else None


def _within(leg: Leg, angles: FloatArray) -> bool:
    """Whether joint angles ``(nj,)`` keep their limits; NaN does not."""
    low, high = leg.position_limits
    return bool(((angles >= low) & (angles <= high)).all())


def _whole(height: float) -> float:
    """A height in whole centimetres [m]."""
    return max(round(height, 2), STEP)
