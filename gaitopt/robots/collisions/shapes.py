"""Collision shapes of a robot for planners: beside obstacles, and against one another.

Beside obstacles (:func:`robot_shapes`) meshes are not read, because a plan may come from somebody
else. A part of a leg without another shape counts as a line between its joints, as thick as the
foot, and such a body as a flat box between its hips. Against one another
(:func:`collision_geometry`) meshes count as their convex hulls, or those of a trunk's parts, which
the robot's notes hold.
"""

from __future__ import annotations

from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.errors import RobotError
from gaitopt.robots.files.hulls import convex_hull
from gaitopt.robots.quadruped import Quadruped

HULL = "(hull "
"""In the names of hulls."""
THICKNESS = 0.02
"""Radius of the lines that replace meshes, where the foot is no ball [m]. Chosen: about that of the
feet and shanks of the robots at hand."""


class RobotShapes(NamedTuple):
    """A robot's shapes beside obstacles.

    Attributes:
        geometry: Pinocchio's geometry model.
        names: of the shapes.
        owners: leg of each shape, ``""`` for the body.
        stand_ins: names of the lines and the box that replace meshes.
    """

    geometry: Any
    names: tuple[str, ...]
    owners: tuple[str, ...]
    stand_ins: tuple[str, ...]


def robot_shapes(robot: Quadruped) -> RobotShapes:
    """The boxes, cylinders and balls of the URDF, with lines and a box in place of its meshes."""
    import pinocchio as pin

    model = robot.model
    text, meshed = _without_meshes(robot.urdf)
    geometry = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    shaped = {int(shape.parentJoint) for shape in geometry.geometryObjects}
    shaped -= {
        int(model.frames[model.getFrameId(link, pin.FrameType.BODY)].parentJoint) for link in meshed
    }
    stand_ins = []
    for joint, name, solid, place in lines_of_limbs(robot):
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
    """The URDF's text without collision meshes, and the links that had some."""
    root, links = ElementTree.fromstring(urdf), set()
    for link in root.iter("link"):
        for shape in link.findall("collision"):
            if shape.find("geometry/mesh") is not None:
                link.remove(shape)
                links.add(str(link.get("name")))
    return ElementTree.tostring(root, encoding="unicode"), links


def lines_of_limbs(robot: Quadruped) -> list[tuple[int, str, Any, Any]]:
    """A box for the body and a line for each part of each leg: joint, name, solid and place."""
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
    """The leg that a joint belongs to, or is moved by; ``""`` for the body."""
    while joint > 1 and joint not in legs:
        joint = int(model.parents[joint])
    return legs.get(joint, "")


def collision_geometry(robot: Quadruped) -> Any:
    """Pinocchio's model of a robot's collision shapes, with hulls for meshes.

    ``None`` where shapes are missing, or hulls of meshes are.
    """
    import pinocchio as pin

    text, meshed = _without_meshes(robot.urdf)
    if meshed - {link for link, _ in robot.notes.hulls}:
        return None
    geometry = pin.buildGeomFromUrdfString(robot.model, text, pin.GeometryType.COLLISION)
    _add_hulls(geometry, robot)
    return geometry


def known_shapes(robot: Quadruped) -> list[tuple[int, Any, Any]]:
    """Joint, coal's solid and place of all shapes of the URDF, and of the hulls that are known."""
    import pinocchio as pin

    text, _ = _without_meshes(robot.urdf)
    geometry = pin.buildGeomFromUrdfString(robot.model, text, pin.GeometryType.COLLISION)
    _add_hulls(geometry, robot)
    return [(int(s.parentJoint), s.geometry, s.placement) for s in geometry.geometryObjects]


def _add_hulls(geometry: Any, robot: Quadruped) -> None:
    """Add the convex hulls of the robot's meshes to its shapes."""
    import pinocchio as pin

    model = robot.model
    for number, (link, numbers) in enumerate(robot.notes.hulls):
        index = model.getFrameId(link, pin.FrameType.BODY)
        if index >= model.nframes:
            raise RobotError(f"{robot.name}: there is no link {link!r}, which has a hull")
        frame = model.frames[index]
        geometry.addGeometryObject(
            pin.GeometryObject(
                f"{link} {HULL}{number})", int(frame.parentJoint), frame.placement,
                convex_hull(numbers),
            )
        )  # fmt: skip
