"""The way from where a robot stands to where its walk over an obstacle begins.

The four feet go from stance to stance, one cycle for each. The middles of the stances lie on a
straight line, they turn evenly into the direction of the obstacle, and become square.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InfeasibleStateError
from gaitopt.optimize.posture.problem import BodyPose
from gaitopt.planners.over_obstacle.layout import square_stances
from gaitopt.robots.leg_angles import wrap_angle
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.terrain.obstacles import Obstacle

SAME_PLACE = 1e-3
"""Feet that are nearer to their places make no step [m]: the certificate allows as much between a
foot and the ground."""
MOST_CYCLES = 1000
"""Most cycles up to an obstacle; a robot that is farther away is refused."""


class Stand(NamedTuple):
    """Where a robot stands before its walk.

    Attributes:
        feet: in the world ``(4, 3)`` [m].
        yaw: direction in which its body faces, in the world [rad].
    """

    feet: FloatArray
    yaw: float


class Way(NamedTuple):
    """Stances from where a robot stands to the first one of its walk.

    Attributes:
        feet: in the world, before the first cycle and after each ``(K + 1, 4, 3)`` [m].
        poses: middle and direction of each stance in the obstacle's frame: x, y, yaw ``(K + 1, 3)``
            [m], [rad].
    """

    feet: FloatArray
    poses: FloatArray

    @property
    def cycles(self) -> int:
        """Number of cycles."""
        return len(self.feet) - 1

    def body(self, cycle: int, obstacle: Obstacle, height: float) -> BodyPose:
        """The level pose halfway between the stances before and after a cycle.

        Args:
            cycle: its number; -1 for the pose above the first stance.
            obstacle: the obstacle.
            height: of the body above the ground on which the obstacle stands [m].
        """
        x, y, yaw = self.poses[max(cycle, 0) : cycle + 2].mean(axis=0)
        centre = obstacle.to_world(np.array([x, y, height]))
        return BodyPose(centre, np.array([0.0, 0.0, obstacle.yaw + yaw]))


def way_to(robot: Quadruped, obstacle: Obstacle, stand: Stand, first: float, step: float) -> Way:
    """The stances from where a robot stands to the first one of its walk.

    Args:
        robot: the robot.
        obstacle: the obstacle.
        stand: where the robot stands.
        first: x of the middle of the first stance of the walk, in the obstacle's frame [m].
        step: longest step [m].

    Raises:
        InfeasibleStateError: the way is longer than :data:`MOST_CYCLES` cycles.
    """
    here = obstacle.to_local(stand.feet)
    begin = np.array([*here[:, :2].mean(axis=0), float(wrap_angle(stand.yaw - obstacle.yaw, 0.0))])
    goal = np.array([first, 0.0, 0.0])
    last = square_stances(robot, goal)
    away = float(np.linalg.norm((here - last)[:, :2], axis=1).max())
    if away <= SAME_PLACE:
        return Way(stand.feet[None], goal[None])
    count = max(int(np.ceil(away / step - 1e-9)), 1)
    while count <= MOST_CYCLES:
        share = np.linspace(0.0, 1.0, count + 1)[:, None]
        poses = begin + share * (goal - begin)
        turned = rpy_to_matrix((poses - begin) * [0.0, 0.0, 1.0])
        feet = square_stances(robot, poses)
        feet += (1.0 - share[..., None]) * ((here - feet[0]) @ np.swapaxes(turned, -1, -2))
        if np.linalg.norm(np.diff(feet, axis=0)[..., :2], axis=-1).max() <= step * (1.0 + 1e-9):
            world = obstacle.to_world(feet)
            world[0] = stand.feet
            return Way(world, poses)
        count += 1
    raise InfeasibleStateError(
        f"start: the obstacle is {away:.4g} m away, more than {MOST_CYCLES} cycles of steps; walk "
        "nearer to it first",
        "distance", away, MOST_CYCLES * step, "m",
    )  # fmt: skip


def check_stand(robot: Quadruped, obstacle: Obstacle, stand: Stand, high: float) -> None:
    """Refuse feet that are not on the level ground in front of the obstacle.

    Args:
        robot, obstacle, stand: as for :func:`way_to`.
        high: how far above or below the ground a foot may be [m].

    Raises:
        InfeasibleStateError: names the leg, and how far its foot is from where it may be.
    """
    here = obstacle.to_local(stand.feet)
    front = obstacle.extent[0] - robot.foot_radius
    for leg, (x, _, z) in zip(LEGS, here.tolist(), strict=True):
        off = z - robot.foot_radius
        if abs(off) > high:
            raise InfeasibleStateError(
                f"start: foot {leg} is {1e3 * off:.1f} mm above the level ground on which the "
                f"obstacle stands, at most {1e3 * high:g} mm are allowed; give the obstacle the "
                "height of that ground",
                f"contact {leg}", off, high, "m",
            )  # fmt: skip
        if x > front:
            raise InfeasibleStateError(
                f"start: foot {leg} is {x - front:.4g} m beyond the front of the obstacle; walk "
                "back first, or turn the obstacle's yaw by half a turn to cross it from this side",
                f"contact {leg}", x, front, "m",
            )  # fmt: skip
