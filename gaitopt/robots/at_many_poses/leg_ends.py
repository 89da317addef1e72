"""How far the ends of legs come below the balls that stand for their feet, where legs lean."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.at_many_poses.outlines import Outline, outlines
from gaitopt.robots.quadruped import Quadruped

LEANS = (-0.2, 0.0, 0.2)
"""How far the lower leg leans from where it is when the robot stands, forward and sideways [rad].
Chosen: lower legs lean so far in walks over columns."""
FOOT_SHARE = 1.25
"""A shape that lies within this many radii of the middle of a foot is the foot itself, as in the
certificate."""
DEEPER = 1e-4
"""Depth below the ball from which on it is warned about [m]. Chosen: far below what a step in
physics gives way, and above the rounding of meshes."""
STEP = 1e-4
"""The radius that is told is a multiple of this [m]."""


LARGEST_END = 0.3
"""Largest radius that is taken for a foot by itself, as a share of the lower leg, as for feet that
are read from meshes (:data:`gaitopt.robots.files.ends.LARGEST_FOOT`)."""


class WideEnd(NamedTuple):
    """A leg whose lower link comes below the ball of its foot where it leans.

    Attributes:
        leg: its name.
        radius: of the ball [m].
        depth: how far below it the link comes [m].
        lower: length of the lower leg [m].
    """

    leg: str
    radius: float
    depth: float
    lower: float

    @property
    def enough(self) -> float:
        """Radius of a ball below which the link does not come [m]."""
        return math.ceil((self.radius + self.depth) / STEP) * STEP

    @property
    def is_foot(self) -> bool:
        """Whether a ball with this radius may be a foot."""
        return self.enough <= LARGEST_END * self.lower

    @property
    def words(self) -> str:
        """What is wrong with the ball."""
        return (
            f"the end of leg {self.leg} is wider than the ball of its foot, whose radius is "
            f"{1e3 * self.radius:.4g} mm: where the leg leans, it comes {1e3 * self.depth:.2g} mm "
            "into the ground"
        )


def wide_end(robot: Quadruped) -> WideEnd | None:
    """The leg that ends lowest below the ball of its foot where it leans; ``None`` where none does.

    Where the shape of a lower leg is wider than its foot's ball, it comes into the ground on walks
    that stand on the ball. Nothing is told of feet without a radius, or without known shapes.
    """
    shapes = outlines(robot) if robot.foot_radius > 0.0 else None
    if not shapes:
        return None
    depths = {leg: _depth(robot, leg, shapes) for leg in LEGS}
    leg = max(depths, key=lambda name: depths[name])
    if depths[leg] < DEEPER:
        return None
    return WideEnd(leg, robot.foot_radius, depths[leg], robot.legs[leg].lower)


def _depth(robot: Quadruped, leg: str, shapes: list[Outline]) -> float:
    """How far a leg's last link comes below the ball of its foot, over some leans [m]."""
    foot, directions = _downwards(robot, leg)
    centre, deepest = np.array(foot.placement.translation), 0.0
    for shape in shapes:
        if shape.joint != int(foot.parentJoint):
            continue
        points = shape.points - centre
        reach = float(np.linalg.norm(points, axis=1).max()) + shape.radius
        if reach > FOOT_SHARE * robot.foot_radius:
            lowest = float((points @ directions.T).max()) + shape.radius
            deepest = max(deepest, lowest - robot.foot_radius)
    return deepest


def _downwards(robot: Quadruped, leg: str) -> tuple[Any, FloatArray]:
    """The frame of a leg's foot, and the ways down in the frame of its joint ``(n, 3)``."""
    import pinocchio as pin

    model = robot.model
    q = pin.neutral(model)
    q[7:] = robot.standing_joints()
    data = model.createData()
    pin.forwardKinematics(model, data, q)
    foot = model.frames[model.getFrameId(robot.legs[leg].foot)]
    ahead, sideways = robot.body_axes[:, 0], robot.body_axes[:, 1]
    down = -robot.body_axes[:, 2]
    ways = [down + pitch * ahead + roll * sideways for pitch in np.tan(LEANS)
            for roll in np.tan(LEANS)]  # fmt: skip
    units = np.array(ways) / np.linalg.norm(ways, axis=1, keepdims=True)
    return foot, np.asarray(units @ data.oMi[int(foot.parentJoint)].rotation)
