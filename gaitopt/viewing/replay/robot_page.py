"""A robot as one HTML file: its legs, axes and feet, with each joint moved through its limits."""

from __future__ import annotations

from dataclasses import replace as changed
from pathlib import Path

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.files import StrPath, written_whole
from gaitopt.motion.path import MotionPath
from gaitopt.robots.discovery import local_axis
from gaitopt.robots.quadruped import Quadruped
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.replay.mesh_files import MeshFolders
from gaitopt.viewing.replay.page import Caption, Label, Page, render
from gaitopt.viewing.replay.robot_scene import joint_paths, moving_robot
from gaitopt.viewing.replay.scene import (
    Appearance,
    Ball,
    Box,
    Node,
    Part,
    Scene,
    Segments,
    joined,
    pose,
)  # fmt: skip

STAND, SWEEP = 2.0, 0.8
"""How long the robot stands first, and how long a joint takes to each of its limits [s]."""
FREE = np.pi / 2.0
"""How far a joint without limits is moved to each side [rad]."""
GROUND, AXIS = "#e9e7e2", "#1f1f1f"


def draw_robot(robot: Quadruped, path: StrPath, *, meshes: MeshFolders = False) -> Path:
    """Write a robot as an HTML file that shows what gaitopt read, in any browser.

    The robot stands, and then moves one joint after the other through its limits. Legs and feet
    have their names, the joints' axes are black lines, and the feet are balls of their radius.

    Args:
        robot: the robot.
        path: the file, which appears complete or not at all.
        meshes: as for :func:`gaitopt.replay`.

    Returns:
        The path of the file.

    Raises:
        InputError: the file cannot be written, or a mesh is missing.
        RobotError: a shape of the URDF cannot be read.
    """
    page = robot_page(robot, meshes)
    with written_whole(path) as stream:
        stream.write(render(page))
    return Path(path)


def robot_page(robot: Quadruped, meshes: MeshFolders = False) -> Page:
    """The page of :func:`draw_robot`."""
    motion, captions = sweeps(robot)
    body = moving_robot(robot, motion, meshes)
    marks = _marks(robot)
    nodes = tuple(
        changed(node, parts=(*node.parts, *marks.get(node.path, ()))) for node in body.nodes
    )
    size = float(np.hypot(*robot.stance_size)) + robot.standing_height
    floor = Box((6.0 * size, 6.0 * size, 0.01))
    ground = Scene((Node(("ground",), (Part(floor, Appearance(GROUND, casts_shadow=False),
                                            pose([0.0, 0.0, -0.005])),)),))  # fmt: skip
    length, width = robot.stance_size
    return Page(
        scene=joined([ground, changed(body, nodes=nodes)]),
        title=robot.name,
        facts=(
            f"{robot.mass:.4g} kg, {len(robot.joint_names)} joints",
            f"stance {length:.3g} x {width:.3g} m, hips {robot.standing_height:.2f} m high",
            f"feet: balls of {1e3 * robot.foot_radius:.4g} mm",
            *(f"warning: {text}" for text in robot.notes.warnings[:6]),
        ),
        legend=(*((leg, LEG_COLOURS[leg]) for leg in LEGS), ("axes of the joints", AXIS)),
        captions=tuple(captions),
        centre=(0.0, 0.0, 0.5 * robot.standing_height),
        radius=0.7 * size,
        labels=tuple(_label(robot, leg) for leg in LEGS),
    )


def sweeps(robot: Quadruped) -> tuple[MotionPath, list[Caption]]:
    """Each joint through its limits, and what is said of it meanwhile."""
    standing = robot.standing_joints()
    height = robot.standing_height - float(robot.centre[2]) + robot.foot_radius
    times, rows = [0.0, STAND], [standing, standing]
    captions = [Caption(0.0, "standing")]
    for leg in LEGS:
        for column in robot.leg_columns[leg]:
            captions.append(Caption(times[-1], _said(robot, leg, column), LEG_COLOURS[leg]))
            for angle in (*_range(robot, column, float(standing[column])), standing[column]):
                row = standing.copy()
                row[column] = angle
                times.append(times[-1] + SWEEP)
                rows.append(row)
    base = np.tile([0.0, 0.0, height, 0.0, 0.0, 0.0], (len(times), 1))
    return MotionPath.polyline(np.array(times), np.hstack([base, np.array(rows)])), captions


def _range(robot: Quadruped, column: int, standing: float) -> tuple[float, float]:
    """The angles that a joint is moved to [rad]."""
    low, high = robot.position_limits[:, column]
    return (
        float(low) if np.isfinite(low) else standing - FREE,
        float(high) if np.isfinite(high) else standing + FREE,
    )


def _said(robot: Quadruped, leg: str, column: int) -> str:
    """A joint with its limits, in words."""
    low, high = robot.position_limits[:, column]
    ends = f"{low:.3g} to {high:.3g} rad" if np.isfinite(high - low) else "no position limits"
    effort = robot.effort_limits[column]
    torque = f"{effort:.4g} N m" if np.isfinite(effort) else "no torque limit"
    speed = f"{robot.velocity_limits[column]:.4g} rad/s"
    acceleration = robot.acceleration_limits[column]
    if np.isfinite(acceleration):
        speed += f", {acceleration:.4g} rad/s²"
    inertia = robot.motor_inertia[column]
    motor = f", motor {inertia:.4g} kg m²" if inertia > 0.0 else ""
    full, none = robot.torque_lines[:, column]
    if np.isfinite(none):
        motor += f", whole torque up to {full:.4g} rad/s, none at {none:.4g} rad/s"
    return f"{leg}: {robot.joint_names[column]}, {ends}, {speed}, {torque}{motor}"


def _marks(robot: Quadruped) -> dict[tuple[str, ...], list[Part]]:
    """Axes of the joints, and balls of the feet, by the frames that they move with."""
    model, paths = robot.model, joint_paths(robot, ("robot",))
    out: dict[tuple[str, ...], list[Part]] = {}
    for name in LEGS:
        leg, colour = robot.legs[name], Appearance(LEG_COLOURS[name], opacity=0.6)
        half = 0.25 * leg.upper
        for joint in leg.joints:
            number = int(model.getJointId(joint))
            axis = local_axis(model.joints[number])
            line = Segments(np.array([-half * axis, half * axis]))
            out.setdefault(paths[number], []).append(Part(line, Appearance(AXIS, lit=False)))
        frame = model.frames[model.getFrameId(leg.foot)]
        ball = Part(Ball(robot.foot_radius or 0.003), colour, pose(frame.placement.translation))
        out.setdefault(paths[int(frame.parentJoint)], []).append(ball)
    return out


def _label(robot: Quadruped, leg: str) -> Label:
    """The leg's name above its knee."""
    number = int(robot.model.getJointId(robot.legs[leg].joints[-1]))
    frame = "/" + "/".join(joint_paths(robot, ("robot",))[number])
    foot = f"foot: {robot.legs[leg].foot}, {1e3 * robot.foot_radius:.4g} mm"
    return Label(frame, 0.05, leg, LEG_COLOURS[leg], (), foot, 0.0)
