"""Footholds of a walk over an obstacle.

The robot walks straight across. In every cycle each leg makes one step of the same length, so that
the feet stand square again after each cycle. In two of the cycles feet stride over the obstacle:
the front feet in one, the hind feet in a later one. These two begin and end at given gaps between
feet and obstacle; the steps of all other cycles share the distances between them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.settings.over_obstacle import StrideSettings
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.obstacles import Obstacle

FRONT = ("LF", "RF")
"""The front legs."""


class Gaps(NamedTuple):
    """Distances between the obstacle's sides and the feet that stand beside it [m].

    Attributes:
        front_before, front_after: of the front feet, before and after they are taken over.
        hind_before, hind_after: of the hind feet.
    """

    front_before: float
    front_after: float
    hind_before: float
    hind_after: float

    def widened(self, leg: str, *, after: bool, by: float) -> Gaps:
        """The gaps with one of them larger: that of a leg's pair of feet, on one side."""
        name = f"{'front' if leg in FRONT else 'hind'}_{'after' if after else 'before'}"
        return self._replace(**{name: getattr(self, name) + by})


class Layout(NamedTuple):
    """A walk's cycles, in the obstacle's frame.

    Attributes:
        centres: x of the middle of the four feet before each cycle, and at the end ``(C + 1,)``
            [m].
        front, hind: the cycles in which front and hind feet stride over the obstacle.
        longest: the longest step [m].
    """

    centres: FloatArray
    front: int
    hind: int
    longest: float

    @property
    def cycles(self) -> int:
        """Number of cycles."""
        return len(self.centres) - 1

    def strides_over(self, leg: str, cycle: int) -> bool:
        """Whether a leg steps over the obstacle in a cycle."""
        return cycle == (self.front if leg in FRONT else self.hind)


def lay_out(robot: Quadruped, obstacle: Obstacle, gaps: Gaps, approach: int, leave: int) -> Layout:
    """The cycles of a walk over an obstacle.

    Steps between the two striding cycles are at most as long as the longer of these; steps before
    and after them are just as long.

    Args:
        robot: the robot.
        obstacle: the obstacle.
        gaps: between it and the feet beside it.
        approach, leave: cycles before the first stride over it, and after the last.
    """
    half = robot.stance_size[0] / 2.0
    low, high = obstacle.extent
    first = low - gaps.front_before - half
    second = high + gaps.front_after - half
    third = low - gaps.hind_before + half
    fourth = high + gaps.hind_after + half
    step = max(second - first, fourth - third)
    # A robot that is too short to stand over the obstacle has no cycle between.
    between = max(int(np.ceil((third - second) / step - 1e-9)), 0)
    middle = np.linspace(second, third, between + 1)
    before = first - step * np.arange(approach, 0, -1)
    after = fourth + step * np.arange(1, leave + 1)
    centres = np.concatenate([before, [first], middle, [fourth], after])
    return Layout(centres, approach, approach + 1 + between, step)


def stands_over(robot: Quadruped, obstacle: Obstacle, gaps: Gaps) -> float:
    """Length by which the robot is longer than it must be to stand over the obstacle [m].

    Negative when it is too short: front feet behind the obstacle, hind feet before it.
    """
    return robot.stance_size[0] - obstacle.width - gaps.front_after - gaps.hind_before


def first_gaps(settings: StrideSettings, robot: Quadruped, reserve: float) -> Gaps:
    """The least gaps: the margin, the radius of the feet's balls, and a ``reserve`` [m]."""
    least = settings.margin + robot.foot_radius + reserve
    return Gaps(least, least, least, least)


def footholds(robot: Quadruped, obstacle: Obstacle, layout: Layout) -> Footholds:
    """All footholds in the world [m]: centres of the feet's balls, one radius above the ground."""
    poses = np.zeros((len(layout.centres), 3))
    poses[:, 0] = layout.centres
    feet = obstacle.to_world(square_stances(robot, poses))
    return Footholds({leg: feet[:, i] for i, leg in enumerate(LEGS)})


def square_stances(robot: Quadruped, poses: FloatArray) -> FloatArray:
    """Feet of square stances on the ground ``(..., 4, 3)`` [m], in the obstacle's frame.

    Args:
        robot: whose size they have.
        poses: x, y of their middles, and the directions that they face ``(..., 3)`` [m], [rad].
    """
    length, width = robot.stance_size
    corners = []
    for leg in robot.legs.values():
        under = leg.hip + leg.axes[:, 1] * leg.lateral - robot.centre
        corners.append([np.copysign(length / 2.0, under[0]), np.copysign(width / 2.0, under[1])])
    x, y = np.array(corners).T
    cos, sin = np.cos(poses[..., 2:]), np.sin(poses[..., 2:])
    level = np.full(np.broadcast_shapes(cos.shape, x.shape), robot.foot_radius)
    return np.stack(
        [poses[..., :1] + cos * x - sin * y, poses[..., 1:2] + sin * x + cos * y, level], axis=-1
    )
