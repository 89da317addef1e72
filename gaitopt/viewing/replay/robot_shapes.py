"""What a robot looks like: its URDF's own shapes, or a figure of tubes along its joints."""

from __future__ import annotations

import io
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import RobotError
from gaitopt.files import StrPath
from gaitopt.robots.quadruped import Quadruped
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.replay.scene import Ball, Box, Cylinder, Look, Part, Shape, pose
from gaitopt.viewing.replay.solids import along

Parts = dict[int, tuple[Part, ...]]
"""The parts that move with each of Pinocchio's joints."""

PLAIN, BODY, METAL = "#9aa3ad", "#3c434c", "#aab2bb"


def robot_parts(robot: Quadruped, meshes: bool | StrPath = False) -> Parts:
    """The parts of every joint's frame, by Pinocchio's joint number (the body is 1).

    URDFs of boxes, balls and cylinders show those. Where one names mesh files, they are read when
    ``meshes`` asks for them; otherwise the robot is drawn as tubes along its joints.

    Raises:
        InputError: ``meshes`` were asked for and a file is missing.
        RobotError: a shape of the URDF cannot be read.
    """
    description = _described(robot)
    visuals = [(link.name, v) for link in description.links for v in link.visuals if v.geometry]
    has_meshes = any(v.geometry.mesh is not None for _, v in visuals)
    if not visuals or (has_meshes and meshes is False):
        return _figure(robot)
    colours = {m.name: m.color for m in description.materials if m.color is not None}
    parts: Parts = {}
    for link, visual in visuals:
        joint, placement = _carrier(robot.model, link)
        shape = _shape(visual.geometry, meshes)
        origin = np.eye(4) if visual.origin is None else np.asarray(visual.origin)
        part = Part(shape, _look(visual.material, colours), placement @ origin)
        parts[joint] = (*parts.get(joint, ()), part)
    return parts


def _described(robot: Quadruped) -> Any:
    import yourdfpy

    try:
        return yourdfpy.URDF.load(
            io.BytesIO(robot.urdf.encode()),
            build_scene_graph=False,
            load_meshes=False,
            load_collision_meshes=False,
            mesh_dir="",
        ).robot
    except Exception as error:  # yourdfpy and lxml raise errors of many kinds
        raise RobotError(f"{robot.name}: the URDF's shapes cannot be read: {error}") from error


def _carrier(model: Any, link: str) -> tuple[int, FloatArray]:
    """The joint that moves a link, and the link's pose in that joint's frame."""
    import pinocchio as pin

    if not model.existFrame(link, pin.FrameType.BODY):
        return 1, np.eye(4)
    frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
    return max(int(frame.parentJoint), 1), np.asarray(frame.placement.homogeneous).copy()


def _shape(geometry: Any, meshes: bool | StrPath) -> Shape:
    if geometry.box is not None:
        x, y, z = (float(s) for s in geometry.box.size)
        return Box((x, y, z))
    if geometry.sphere is not None:
        return Ball(float(geometry.sphere.radius))
    if geometry.cylinder is not None:
        return Cylinder(float(geometry.cylinder.radius), float(geometry.cylinder.length))
    from gaitopt.viewing.replay.mesh_files import read_mesh

    return read_mesh(geometry.mesh.filename, geometry.mesh.scale, meshes)


def _look(material: Any, colours: dict[str, Any]) -> Look:
    colour = None
    if material is not None:
        colour = material.color if material.color is not None else colours.get(material.name)
    if colour is None:
        return Look(PLAIN)
    rgba = np.clip(np.nan_to_num(np.asarray(colour.rgba, dtype=np.float64)), 0.0, 1.0)
    red, green, blue = (round(255 * c) for c in rgba[:3])
    return Look(f"#{red:02x}{green:02x}{blue:02x}", float(rgba[3]) if len(rgba) > 3 else 1.0)


def _figure(robot: Quadruped) -> Parts:
    """A body box through the hips, and tubes from joint to joint down to the feet."""
    model, parts = robot.model, {1: list(_body(robot))}
    size = float(np.mean([leg.upper + leg.lower for leg in robot.legs.values()]))
    thick = 0.045 * size
    for joint in range(2, model.njoints):
        parent, place = int(model.parents[joint]), model.jointPlacements[joint].translation
        mine = parts.setdefault(joint, [])
        mine.append(Part(Ball(1.25 * thick), Look(BODY)))
        if parent > 1:
            parts[parent] += along(np.zeros(3), place, thick, Look(METAL))
    for name in LEGS:
        leg, look = robot.legs[name], Look(LEG_COLOURS[name])
        frame = model.frames[model.getFrameId(leg.foot)]
        last, tip = int(frame.parentJoint), frame.placement.translation.copy()
        parts.setdefault(last, [])
        parts[last] += along(np.zeros(3), tip, 0.75 * thick, Look(METAL))
        parts[last] += along(0.65 * tip, 0.9 * tip, 0.85 * thick, look)
        parts[last].append(Part(Ball(robot.foot_radius or thick), look, pose(tip)))
    return {joint: tuple(found) for joint, found in parts.items()}


def _body(robot: Quadruped) -> list[Part]:
    hips = np.array([leg.hip for leg in robot.legs.values()])
    length, width = np.ptp(hips[:, 0]), np.ptp(hips[:, 1])
    height = 0.3 * float(np.mean([leg.upper for leg in robot.legs.values()])) + 0.02
    box = Box((1.1 * length, max(0.75 * width, 0.3 * length), height))
    at = robot.body_axes @ robot.centre
    nose = at + robot.body_axes @ np.array([0.56 * length, 0.0, 0.1 * height])
    bar = Box((0.02 * length, 0.6 * box.size[1], 0.35 * height))
    return [
        Part(box, Look(BODY), pose(at, robot.body_axes)),
        Part(bar, Look("#f2f2ee"), pose(nose, robot.body_axes)),
    ]
