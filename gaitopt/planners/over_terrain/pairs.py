"""Possible steps, many at a time, and what was found of them.

A *pair* is a state of the search (where four feet stand, and where the body is) with a foothold for
the leg that steps next.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray, TextEnum


class Cause(TextEnum):
    """Why a step is not possible."""

    APART = "feet too near to each other"
    MARGIN = "no place with the stability margin"
    REACH = "a leg does not reach its foot, or a joint its angle"
    SWING = "the flying foot does not get high enough"
    ROLL = "a foot would roll too far on its foothold"
    LIMB = "a limb would touch the ground, or be above unknown ground"
    TRUNK = "the trunk would touch the ground, or be above unknown ground"
    TOUCH = "a link would touch another one"
    FORCE = "no contact forces hold the robot, with its friction and torques"
    GROUND = "no ground to step on"
    PLAN = "the planner of the walk refused it"


class Pairs(NamedTuple):
    """States with a foothold each.

    Attributes:
        feet: where the feet stand before the step ``(K, 4, 3)`` [m].
        body: x, y, z, roll, pitch, yaw of the body centre before it ``(K, 6)``.
        target: where the foot goes ``(K, 3)`` [m].
        yaw: of the body during the swing ``(K,)`` [rad].
        leg: index of the leg that steps.
    """

    feet: FloatArray
    body: FloatArray
    target: FloatArray
    yaw: FloatArray
    leg: int

    def chosen(self, which: np.ndarray) -> Pairs:
        """Some of the pairs."""
        return Pairs(
            self.feet[which], self.body[which], self.target[which], self.yaw[which], self.leg
        )


class Judged(NamedTuple):
    """What was found of pairs.

    Attributes:
        possible: whether each is possible ``(K,)``.
        body: x, y, z, roll, pitch, yaw of the body centre during the swing ``(K, 6)``.
        rise: height of the swing above its higher end ``(K,)`` [m].
        prospects: at how many places ahead of the body the foothold would be of no use ``(K,)``.
        reached: whether all legs reach their feet from some place of the body ``(K,)``.
        refused: how many pairs each cause refused.
    """

    possible: BoolArray
    body: FloatArray
    rise: FloatArray
    prospects: FloatArray
    reached: BoolArray
    refused: dict[Cause, int]
