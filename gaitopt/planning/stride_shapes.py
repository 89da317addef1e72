"""The robot's collision shapes for planning around obstacles; lines stand for what is a mesh.

Meshes are not read: a plan may come from somebody else. Where a part of a leg has no other shape it
counts as a line between its joints, as thick as the foot; the body as a flat box between its hips.
"""

from __future__ import annotations

from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.obstacles import Obstacle

THICKNESS = 0.02
"""Radius of the lines that stand for meshes, where the foot is no ball [m]."""
SIDES = 64
"""Tangents that stand for a full turn of a rounded obstacle."""


class RobotShapes(NamedTuple):
    """A robot's shapes.

    Attributes:
        geometry: Pinocchio's geometry model.
        names: of the shapes.
        owners: leg of each shape, ``""`` for the body.
        stand_ins: names of those that stand for meshes.
    """

    geometry: Any
    names: tuple[str, ...]
    owners: tuple[str, ...]
    stand_ins: tuple[str, ...]


def robot_shapes(robot: Quadruped) -> RobotShapes:
    """Boxes, cylinders and balls of the URDF, and stand-ins for its meshes."""
    import pinocchio as pin

    model = robot.model
    text, meshed = _without_meshes(robot.urdf)
    geometry = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    shaped = {int(shape.parentJoint) for shape in geometry.geometryObjects}
    shaped -= {int(model.frames[model.getFrameId(link)].parentJoint) for link in meshed}
    stand_ins = []
    for joint, name, solid, place in _lines(robot):
        if joint not in shaped:
            geometry.addGeometryObject(pin.GeometryObject(name, joint, place, solid))
            stand_ins.append(name)
    shapes = list(geometry.geometryObjects)
    owner = {model.getJointId(name): leg for leg in LEGS for name in robot.legs[leg].joints}
    return RobotShapes(
        geometry, tuple(str(shape.name) for shape in shapes),
        tuple(_owner(model, int(shape.parentJoint), owner) for shape in shapes), tuple(stand_ins),
    )  # fmt: skip


def _without_meshes(urdf: str) -> tuple[str, set[str]]:
    """The URDF without collision meshes, and the links that lost some."""
    root, links = ElementTree.fromstring(urdf), set()
    for link in root.iter("link"):
        for shape in link.findall("collision"):
            if shape.find("geometry/mesh") is not None:
                link.remove(shape)
                links.add(str(link.get("name")))
    return ElementTree.tostring(root, encoding="unicode"), links


def _lines(robot: Quadruped) -> list[tuple[int, str, Any, Any]]:
    """Joint, name, solid and place of the body's box and of a line for each part of each leg."""
    import pinocchio as pin
    from pinocchio import coal

    model, radius = robot.model, robot.foot_radius or THICKNESS
    hips = np.array([leg.hip for leg in robot.legs.values()])
    low, high = hips.min(axis=0) - radius, hips.max(axis=0) + radius
    box = coal.Box(*(high - low).tolist())
    place = pin.SE3(robot.body_axes.copy(), robot.body_axes @ ((low + high) / 2.0))
    out = [(1, "body as a box", box, place)]
    for leg in LEGS:
        joints = [int(model.getJointId(name)) for name in robot.legs[leg].joints]
        tips = [np.array(model.jointPlacements[joint].translation) for joint in joints[1:]]
        foot = model.frames[model.getFrameId(robot.legs[leg].foot)]
        tips.append(np.array(foot.placement.translation))
        for joint, tip in zip(joints, tips, strict=True):
            turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), tip).matrix()
            line = coal.Capsule(radius, float(np.linalg.norm(tip)))
            name = f"{model.names[joint]} as a line"
            out.append((joint, name, line, pin.SE3(turn, tip / 2.0)))
    return out


def _owner(model: Any, joint: int, legs: dict[int, str]) -> str:
    """The leg that a joint belongs to, or hangs on; ``""`` for the body."""
    while joint > 1 and joint not in legs:
        joint = int(model.parents[joint])
    return legs.get(joint, "")


def obstacle_solid(obstacle: Obstacle) -> Any:
    """The obstacle as a convex solid of coal's; a round one with a hull just outside it."""
    from pinocchio import coal

    vertices, faces = obstacle.mesh(SIDES)
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(vertices))
    triangles.extend([coal.Triangle(*face) for face in faces.tolist()])
    return coal.Convex(points, triangles)
