"""The shapes of a robot: those of its URDF, or bars from joint to joint."""

from __future__ import annotations

import io
from dataclasses import replace as changed
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError, RobotError
from gaitopt.hidden_packages import DRAWING, refuse_shadows
from gaitopt.robots.quadruped import Quadruped
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.replay.mesh_files import MeshFolders, check_meshes, read_mesh
from gaitopt.viewing.replay.scene import Appearance, Ball, Box, Cylinder, Part, Shape, pose
from gaitopt.viewing.replay.solids import rounded_bar

Parts = dict[int, tuple[Part, ...]]
"""The parts that move with each of Pinocchio's joints, by the joint's number."""

PLAIN, BODY, METAL, MARK = "#9aa3ad", "#3c434c", "#aab2bb", "#f2f2ee"
"""Colours of shapes without one, and of body, legs and the mark at the front of drawn robots."""
THICKNESS = 0.045
"""Radius of a leg's bar over the leg's length. This and the other proportions of a drawn robot are
chosen here, to look like the robots at hand."""
FOOT_BALL, LEAST_FOOT = 1.05, 0.01
"""Size of the coloured balls, in radii of the feet; and that of point feet [m]. Chosen."""

MOST_KNOWN = 8
"""Robots whose parts are remembered. Chosen: a race has no more."""
_known: dict[Quadruped, Parts] = {}


def robot_parts(robot: Quadruped, meshes: MeshFolders = False) -> Parts:
    """The parts of a robot by the number of the joint with which they move; the body has number 1.

    Those without meshes are remembered for the next replay of the same robot.

    Raises:
        InputError, RobotError: as for :func:`read_parts`.
    """
    if meshes is not False:
        return read_parts(robot, meshes)
    parts = _known.get(robot)
    if parts is None:
        parts = read_parts(robot)
        remember_parts(robot, parts)
    return parts


def remember_parts(robot: Quadruped, parts: Parts) -> None:
    """Take the parts of a robot without meshes from elsewhere: another process read them."""
    while len(_known) >= MOST_KNOWN:
        _known.pop(next(iter(_known)))
    _known[robot] = parts


def read_parts(robot: Quadruped, meshes: MeshFolders = False) -> Parts:
    """The parts of a robot, read from its URDF.

    Boxes, balls and cylinders of the URDF are taken as they are. If the URDF names mesh files, they
    are read where ``meshes`` asks for them (see :func:`gaitopt.replay`); otherwise the robot is
    drawn as bars from joint to joint. A mesh that is missing leaves its link out. Shanks of robots
    with meshes have the colours of their legs, and so have balls at their feet.

    Raises:
        InputError: ``meshes`` were asked for, and no file is there; or it is no folder.
        RobotError: a shape of the URDF cannot be read.
    """
    check_meshes(meshes)
    description = _described(robot)
    visuals = [(link.name, v) for link in description.links for v in link.visuals if v.geometry]
    has_meshes = any(v.geometry.mesh is not None for _, v in visuals)
    if not visuals or (has_meshes and meshes is False):
        return _bars(robot)
    colours = {m.name: m.color for m in description.materials if m.color is not None}
    parts: Parts = _feet(robot) if has_meshes else {}
    shanks = {int(robot.model.getJointId(robot.legs[leg].joints[-1])): leg for leg in LEGS}
    missing, drawn = [], 0
    for link, visual in visuals:
        joint, placement = _joint_of(robot.model, link)
        try:
            shape = _shape(visual.geometry, meshes)
        except InputError as error:
            missing.append(error)
            continue
        drawn += visual.geometry.mesh is not None
        origin = np.eye(4) if visual.origin is None else np.asarray(visual.origin)
        look = _appearance(visual.material, colours)
        if has_meshes and joint in shanks:
            look = changed(look, colour=LEG_COLOURS[shanks[joint]])
        part = Part(shape, look, placement @ origin)
        parts[joint] = (*parts.get(joint, ()), part)
    if missing and not drawn:
        raise missing[0]
    return parts


def _feet(robot: Quadruped) -> Parts:
    """Balls at the feet in the colours of the legs, a little larger than the feet."""
    parts: Parts = {}
    for name in LEGS:
        frame = robot.model.frames[robot.model.getFrameId(robot.legs[name].foot)]
        ball = Ball(FOOT_BALL * (robot.foot_radius or LEAST_FOOT))
        part = Part(ball, Appearance(LEG_COLOURS[name]), pose(frame.placement.translation))
        parts[int(frame.parentJoint)] = (part,)
    return parts


def _described(robot: Quadruped) -> Any:
    """The URDF as yourdfpy describes it; raises RobotError where it cannot be read."""
    refuse_shadows(DRAWING)
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


def _joint_of(model: Any, link: str) -> tuple[int, FloatArray]:
    """Number of the joint that moves a link, and the link's pose ``(4, 4)`` in its frame."""
    import pinocchio as pin

    if not model.existFrame(link, pin.FrameType.BODY):
        return 1, np.eye(4)
    frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
    return max(int(frame.parentJoint), 1), np.asarray(frame.placement.homogeneous).copy()


def _shape(geometry: Any, meshes: MeshFolders) -> Shape:
    """A shape of the URDF; raises InputError where its mesh is missing."""
    if geometry.box is not None:
        x, y, z = (float(s) for s in geometry.box.size)
        return Box((x, y, z))
    if geometry.sphere is not None:
        return Ball(float(geometry.sphere.radius))
    if geometry.cylinder is not None:
        return Cylinder(float(geometry.cylinder.radius), float(geometry.cylinder.length))
    return read_mesh(geometry.mesh.filename, geometry.mesh.scale, meshes)


def _appearance(material: Any, colours: dict[str, Any]) -> Appearance:
    """Colour and opacity of a material; ``colours`` are those of materials that are only named.

    A material whose name begins with a leg's, as ``LF_red`` of the robots that ship with gaitopt,
    has the colour of the leg.
    """
    leg = "" if material is None else str(material.name).split("_")[0]
    if leg in LEG_COLOURS:
        return Appearance(LEG_COLOURS[leg])
    colour = None
    if material is not None:
        colour = material.color if material.color is not None else colours.get(material.name)
    if colour is None or np.size(colour.rgba) < 3:
        return Appearance(PLAIN)
    rgba = np.clip(np.nan_to_num(np.asarray(colour.rgba, dtype=np.float64)), 0.0, 1.0)
    red, green, blue = (round(255 * c) for c in rgba[:3])
    return Appearance(f"#{red:02x}{green:02x}{blue:02x}", float(rgba[3]) if len(rgba) > 3 else 1.0)


def _bars(robot: Quadruped) -> Parts:
    """A box for the body, and bars from joint to joint down to the feet."""
    model, parts = robot.model, {1: list(_body(robot))}
    size = float(np.mean([leg.upper + leg.lower for leg in robot.legs.values()]))
    radius = THICKNESS * size
    for joint in range(2, model.njoints):
        parent, place = int(model.parents[joint]), model.jointPlacements[joint].translation
        parts.setdefault(joint, []).append(Part(Ball(1.25 * radius), Appearance(BODY)))
        if parent > 1:
            parts[parent] += rounded_bar(np.zeros(3), place, radius, Appearance(METAL))
    for name in LEGS:
        leg, colour = robot.legs[name], Appearance(LEG_COLOURS[name])
        frame = model.frames[model.getFrameId(leg.foot)]
        last, foot = int(frame.parentJoint), frame.placement.translation.copy()
        parts.setdefault(last, [])
        parts[last] += rounded_bar(np.zeros(3), foot, 0.75 * radius, Appearance(METAL))
        parts[last] += rounded_bar(0.65 * foot, 0.9 * foot, 0.85 * radius, colour)
        parts[last].append(Part(Ball(robot.foot_radius or radius), colour, pose(foot)))
    return {joint: tuple(found) for joint, found in parts.items()}


def _body(robot: Quadruped) -> list[Part]:
    """A box as large as the stance, and a bright bar at its front."""
    hips = np.array([leg.hip for leg in robot.legs.values()])
    length, width = np.ptp(hips[:, 0]), np.ptp(hips[:, 1])
    height = 0.3 * float(np.mean([leg.upper for leg in robot.legs.values()])) + 0.02
    box = Box((1.1 * length, max(0.75 * width, 0.3 * length), height))
    middle = robot.body_axes @ robot.centre
    front = middle + robot.body_axes @ np.array([0.56 * length, 0.0, 0.1 * height])
    bar = Box((0.02 * length, 0.6 * box.size[1], 0.35 * height))
    return [
        Part(box, Appearance(BODY), pose(middle, robot.body_axes)),
        Part(bar, Appearance(MARK), pose(front, robot.body_axes)),
    ]
