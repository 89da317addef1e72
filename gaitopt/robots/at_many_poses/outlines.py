"""Points that hold a robot's collision shapes, and how low its links are."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.robots.collisions.shapes import collision_geometry
from gaitopt.robots.quadruped import Quadruped

SIDES = 24
"""Points on the rim of a cylinder."""


class Outline(NamedTuple):
    """A shape, as the hull of balls.

    Attributes:
        name: of the shape.
        joint: number of the joint that moves it; 1 is the base.
        points: centres of the balls in the joint's frame ``(n, 3)`` [m].
        radius: of the balls [m].
    """

    name: str
    joint: int
    points: FloatArray
    radius: float


def outlines(robot: Quadruped) -> list[Outline] | None:
    """The shapes of a robot's links; ``None`` where they are not known."""
    geometry = collision_geometry(robot)
    if geometry is None:
        return None
    found = []
    for shape in geometry.geometryObjects:
        points, radius = _balls(shape.geometry)
        placed = points @ shape.placement.rotation.T + shape.placement.translation
        found.append(Outline(str(shape.name), int(shape.parentJoint), placed, radius))
    return found


def _balls(shape: Any) -> tuple[FloatArray, float]:
    """Centres ``(n, 3)`` and radius of the balls whose hull is a shape, in its own frame [m]."""
    from pinocchio import coal

    ends = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
    if isinstance(shape, coal.Sphere):
        return np.zeros((1, 3)), float(shape.radius)
    if isinstance(shape, coal.Capsule):
        return shape.halfLength * ends, float(shape.radius)
    if isinstance(shape, coal.Cylinder):
        turns = 2.0 * np.pi * np.arange(SIDES) / SIDES
        rim = shape.radius * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
        return (shape.halfLength * ends[:, None] + rim).reshape(-1, 3), 0.0
    if isinstance(shape, coal.Box):
        corners = np.stack(np.meshgrid(*3 * [[-1.0, 1.0]]), axis=-1).reshape(-1, 3)
        return corners * np.asarray(shape.halfSide).ravel(), 0.0
    return np.array(shape.points(), dtype=np.float64).reshape(-1, 3), 0.0


def lowest_points(robot: Quadruped, shapes: list[Outline], q: FloatArray) -> list[FloatArray]:
    """The undersides of shapes in a configuration, in the world ``(n, 3)`` [m] each.

    Args:
        robot: the robot.
        shapes: of it.
        q: Pinocchio's configuration ``(nq,)``.
    """
    import pinocchio as pin

    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    out = []
    for shape in shapes:
        place = data.oMi[shape.joint]
        points = shape.points @ place.rotation.T + place.translation
        out.append(points - np.array([0.0, 0.0, shape.radius]))
    return out
