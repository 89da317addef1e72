"""The robot of a plan as a scene: one frame for each joint, and keyframes that turn them."""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.files import StrPath
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_quaternion
from gaitopt.viewing.replay.keyframes import (
    ANGLE_TOLERANCE,
    LARGEST_TURN,
    POSITION_TOLERANCE,
    sample_times,
    thinned,
    turn_deviation,
)
from gaitopt.viewing.replay.robot_shapes import robot_parts
from gaitopt.viewing.replay.scene import FramePath, Node, Scene, Track, pose


def robot_scene(plan: Plan, meshes: bool | StrPath = False, root: FramePath = ("robot",)) -> Scene:
    """The robot with the plan's motion.

    Args:
        plan: the motion.
        meshes: see :func:`gaitopt.replay`.
        root: the frame that carries the robot.

    Raises:
        InputError: ``meshes`` were asked for and a file is missing.
    """
    robot = plan.robot
    paths = joint_paths(robot, root)
    parts = robot_parts(robot, meshes)
    nodes = []
    for joint, path in paths.items():
        placement = robot.model.jointPlacements[joint]
        local = pose(placement.translation, placement.rotation)
        nodes.append(Node(path, parts.get(joint, ()), np.eye(4) if joint == 1 else local))
    return Scene(tuple(nodes), tuple(_tracks(plan, paths)), plan.duration)


def joint_paths(robot: Quadruped, root: FramePath) -> dict[int, FramePath]:
    """The frame of each of Pinocchio's joints, the free-flyer (1) first.

    Frames are numbered: a joint's name may hold a slash, which would be another frame.
    """
    paths: dict[int, FramePath] = {1: (*root, "base")}
    for joint in range(2, robot.model.njoints):
        paths[joint] = (*paths[int(robot.model.parents[joint])], f"joint{joint}")
    return paths


def _tracks(plan: Plan, paths: dict[int, FramePath]) -> list[Track]:
    times = sample_times(plan.path)
    values = plan.path.evaluate(times)
    base, turn = paths[1], rpy_to_quaternion(values[:, 3:6])
    # Half of the tolerance is spent between samples, half by leaving samples out.
    at = thinned(times, values[:, :3], 0.5 * POSITION_TOLERANCE)
    turns = thinned(times, turn, 0.5 * ANGLE_TOLERANCE, deviation=turn_deviation)
    tracks = [
        Track(base, "position", times[at], values[at, :3]),
        Track(base, "quaternion", times[turns], turn[turns]),
    ]
    for column, joint in enumerate(range(2, plan.robot.model.njoints)):
        tracks += _joint_track(plan.robot.model, joint, paths[joint], times, values[:, 6 + column])
    return tracks


def _joint_track(
    model: Any, joint: int, path: FramePath, times: FloatArray, values: FloatArray
) -> list[Track]:
    """Keys of one joint. Slerp about a fixed axis is a straight line in the joint's angle."""
    import pinocchio as pin

    kind, data = model.joints[joint], model.joints[joint].createData()
    if kind.nq != 1:
        return []
    # calc() reads the joint's own entries of a whole configuration.
    kind.calc(data, pin.neutral(model))
    slide, axis = np.split(np.reshape(data.S, 6), 2)
    placement = model.jointPlacements[joint]
    if np.linalg.norm(axis) < 1e-9:
        keys = thinned(times, values, 0.5 * POSITION_TOLERANCE)
        places = placement.translation + values[keys, None] * (placement.rotation @ slide)
        return [Track(path, "position", times[keys], places)]
    keys = thinned(times, values, 0.5 * ANGLE_TOLERANCE, most=LARGEST_TURN)
    zero = np.asarray(pin.Quaternion(placement.rotation).coeffs())
    return [Track(path, "quaternion", times[keys], _turned(zero, axis, values[keys]))]


def _turned(zero: FloatArray, axis: FloatArray, angles: FloatArray) -> FloatArray:
    """Quaternion ``zero (4,)`` times turns by ``angles (n,)`` about a unit ``axis (3,)``."""
    vector = np.sin(angles / 2.0)[:, None] * axis
    scalar = np.cos(angles / 2.0)[:, None]
    xyz = zero[3] * vector + scalar * zero[:3] + np.cross(zero[:3], vector)
    return np.concatenate([xyz, zero[3] * scalar - (vector @ zero[:3])[:, None]], axis=1)
