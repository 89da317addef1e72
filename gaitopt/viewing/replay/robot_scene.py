"""The robot of a plan as a scene: a frame for each joint, and keyframes that move the frames."""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.motion.path import MotionPath
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_quaternion
from gaitopt.viewing.replay.keyframes import (
    ANGLE_TOLERANCE,
    LARGEST_TURN,
    POSITION_TOLERANCE,
    kept_samples,
    sample_times,
    turn_error,
)
from gaitopt.viewing.replay.mesh_files import MeshFolders
from gaitopt.viewing.replay.robot_shapes import robot_parts
from gaitopt.viewing.replay.scene import FramePath, Node, Scene, Track, pose


def robot_scene(plan: Plan, meshes: MeshFolders = False, root: FramePath = ("robot",)) -> Scene:
    """The robot with the plan's motion.

    Args:
        plan: the motion.
        meshes: see :func:`gaitopt.replay`.
        root: the frame above the robot's base.

    Raises:
        InputError: ``meshes`` were asked for, and a file is missing.
        RobotError: a shape of the URDF cannot be read.
    """
    return moving_robot(plan.robot, plan.path, meshes, root)


def moving_robot(
    robot: Quadruped,
    motion: MotionPath,
    meshes: MeshFolders = False,
    root: FramePath = ("robot",),
) -> Scene:
    """A robot along a path of its body and joints; see :func:`robot_scene`."""
    paths = joint_paths(robot, root)
    parts = robot_parts(robot, meshes)
    nodes = []
    for joint, path in paths.items():
        placement = robot.model.jointPlacements[joint]
        local = pose(placement.translation, placement.rotation)
        nodes.append(Node(path, parts.get(joint, ()), np.eye(4) if joint == 1 else local))
    nodes += [Node(path, (), at) for path, at in foot_frames(robot, root).values()]
    return Scene(tuple(nodes), tuple(_tracks(robot, motion, paths)), motion.duration)


def foot_frames(robot: Quadruped, root: FramePath) -> dict[str, tuple[FramePath, FloatArray]]:
    """The frame of each leg's foot, and its pose ``(4, 4)`` in the frame above it."""
    paths, found = joint_paths(robot, root), {}
    for leg in LEGS:
        frame = robot.model.frames[robot.model.getFrameId(robot.legs[leg].foot)]
        above = paths[int(frame.parentJoint)]
        found[leg] = (*above, "foot"), pose(frame.placement.translation)
    return found


def joint_paths(robot: Quadruped, root: FramePath) -> dict[int, FramePath]:
    """The frame of each of Pinocchio's joints by its number; the free-flyer has number 1.

    Frames are numbered, and not named like the joints, because a joint's name may contain a slash,
    which separates frames.
    """
    paths: dict[int, FramePath] = {1: (*root, "base")}
    for joint in range(2, robot.model.njoints):
        paths[joint] = (*paths[int(robot.model.parents[joint])], f"joint{joint}")
    return paths


def _tracks(robot: Quadruped, motion: MotionPath, paths: dict[int, FramePath]) -> list[Track]:
    """Keyframes of the base and all joints."""
    times = sample_times(motion)
    values = motion.evaluate(times)
    base, turn = paths[1], rpy_to_quaternion(values[:, 3:6])
    # One half of the tolerance is for the motion between samples, the other for left-out samples.
    at = kept_samples(times, values[:, :3], 0.5 * POSITION_TOLERANCE)
    turns = kept_samples(times, turn, 0.5 * ANGLE_TOLERANCE, error=turn_error)
    tracks = [
        Track(base, "position", times[at], values[at, :3]),
        Track(base, "quaternion", times[turns], turn[turns]),
    ]
    for column, joint in enumerate(range(2, robot.model.njoints)):
        tracks += _joint_track(robot.model, joint, paths[joint], times, values[:, 6 + column])
    return tracks


def _joint_track(
    model: Any, joint: int, path: FramePath, times: FloatArray, values: FloatArray
) -> list[Track]:
    """Keyframes of one joint with ``values (n,)``; none for joints with more than one coordinate.

    Slerp about a fixed axis is a straight line in the joint's angle.
    """
    import pinocchio as pin

    kind, data = model.joints[joint], model.joints[joint].createData()
    if kind.nq != 1:
        return []
    # calc() takes the configuration of the whole robot.
    kind.calc(data, pin.neutral(model))
    direction, axis = np.split(np.reshape(data.S, 6), 2)
    placement = model.jointPlacements[joint]
    if np.linalg.norm(axis) < 1e-9:
        keys = kept_samples(times, values, 0.5 * POSITION_TOLERANCE)
        places = placement.translation + values[keys, None] * (placement.rotation @ direction)
        return [Track(path, "position", times[keys], places)]
    keys = kept_samples(times, values, 0.5 * ANGLE_TOLERANCE, largest_step=LARGEST_TURN)
    zero = np.asarray(pin.Quaternion(placement.rotation).coeffs())
    return [Track(path, "quaternion", times[keys], _turned(zero, axis, values[keys]))]


def _turned(zero: FloatArray, axis: FloatArray, angles: FloatArray) -> FloatArray:
    """Quaternion ``zero (4,)`` times turns by ``angles (n,)`` about a unit ``axis``: ``(n, 4)``."""
    vector = np.sin(angles / 2.0)[:, None] * axis
    scalar = np.cos(angles / 2.0)[:, None]
    xyz = zero[3] * vector + scalar * zero[:3] + np.cross(zero[:3], vector)
    return np.concatenate([xyz, zero[3] * scalar - (vector @ zero[:3])[:, None]], axis=1)
