"""Configurations for the user's own model of a robot's file."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_numbers, check_shape
from gaitopt.robots.quadruped import Quadruped


def file_configurations(robot: Quadruped, q: ArrayLike, model: Any) -> FloatArray:
    """A robot's configurations for another Pinocchio model of the same robot.

    ``Trajectory.q`` is for ``robot.model``. A model that Pinocchio makes of the robot's own file
    may have two numbers for a joint without an end, joints that gaitopt has locked, and another
    order of joints.

    Args:
        robot: the robot.
        q: configurations ``(N, robot.model.nq)``.
        model: Pinocchio's, whose root moves freely, and whose joints have the robot's names.

    Returns:
        Configurations ``(N, model.nq)``. Joints that the robot does not know are neutral.

    Raises:
        InputError: the model has no free joint, lacks a joint of the robot, or its body; or ``q``
            has another shape, or is no number.
    """
    import pinocchio as pin

    numbers = check_numbers("q", q, -np.inf, np.inf)
    values = check_shape("q", numbers, robot.model.nq).reshape(-1, robot.model.nq)
    if not isinstance(model, pin.Model):
        raise InputError(f"{robot.name}: model must be a pinocchio.Model, got {as_text(model)}")
    out = np.tile(np.asarray(pin.neutral(model)), (len(values), 1))
    names = [str(name) for name in model.names]
    missing = [name for name in robot.joint_names if name not in names]
    free = [j for j in range(1, model.njoints) if model.joints[j].nq == 7]
    if missing or not free:
        raise InputError(
            f"{robot.name}: the model has no joint {missing[0]}" if missing
            else f"{robot.name}: the model has no free joint; build it with JointModelFreeFlyer"
        )  # fmt: skip
    angles = {name: values[:, 7 + k] for k, name in enumerate(robot.joint_names)}
    angles |= {name: np.full(len(values), at) for name, at in robot.notes.locked.items()}
    for name, angle in angles.items():
        if name in names:
            joint = model.joints[names.index(name)]
            if joint.nq == 1:
                out[:, joint.idx_q] = angle
            elif joint.nq == 2:
                out[:, joint.idx_q : joint.idx_q + 2] = np.stack([np.cos(angle), np.sin(angle)], -1)
    _set_base(robot, values, model, free, out)
    return out


def _set_base(
    robot: Quadruped, values: FloatArray, model: Any, free: list[int], out: FloatArray
) -> None:
    """Put the body where it is, whatever the model's free joint carries.

    There may be other free joints: a floating joint of the file, or links that hang on one.
    """
    import pinocchio as pin

    # A body that gaitopt has put above the file's base is no link of the model.
    ours = [frame for frame in robot.model.frames
            if frame.parentJoint == 1 and frame.type == pin.FrameType.BODY]  # fmt: skip
    theirs = {str(frame.name): frame for frame in model.frames if frame.type == pin.FrameType.BODY}
    body = next((frame for frame in ours if str(frame.name) in theirs), ours[0])
    frame = theirs.get(str(body.name))
    if frame is None or frame.parentJoint not in free:
        raise InputError(
            f"{robot.name}: the model's free joint does not carry the link {body.name}"
        )
    inside = body.placement * frame.placement.inverse()
    start = model.joints[frame.parentJoint].idx_q
    for row, q in zip(out, values, strict=True):
        row[start : start + 7] = pin.SE3ToXYZQUAT(pin.XYZQUATToSE3(q[:7]) * inside)
