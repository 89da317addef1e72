"""Inertias that no body can have: physics takes those of the plan's robot, and no others.

Some files hold a principal moment above the sum of the other two. Planner, certificate and
controller take it as it is. MuJoCo's compiler would refuse it, or replace it by the inertia of a
ball with the same trace. A lower leg of a public Pupper got 22 times its inertia about the knee so,
and the robot fell over a plan that was right for its file. The equations of motion need no more
than positive moments, so the compiled model gets the file's numbers back.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.robots.quadruped import Quadruped

ODD = 0.01
"""Difference of a moving part's inertia from the file's, as a share of its largest moment, from
which on it is set. Chosen: below it are rounding, and small links whose odd inertias vanish in the
body that carries them, as anymal_c's cameras."""


def keep_inertias(
    mujoco: Any, model: Any, robot: Quadruped, base: int, joints: np.ndarray
) -> tuple[str, ...]:
    """Give moving parts of a compiled model the inertia of the robot, where it has another.

    Args:
        mujoco: the module.
        model: ``mujoco.MjModel``, in which links that do not move against each other are one body;
            it is changed.
        robot: whose masses and centres of mass it has.
        base: id of the body that is free to move.
        joints: ids of MuJoCo's joints, for each of ``robot.joint_names``.

    Returns:
        Names of the joints whose parts were set; ``""`` for the body.
    """
    ours = robot.model
    parts = {1: base, **{
        int(ours.getJointId(name)): int(model.jnt_bodyid[joint])
        for name, joint in zip(robot.joint_names, joints, strict=True)
    }}  # fmt: skip
    names = {int(ours.getJointId(name)): name for name in robot.joint_names}
    changed = []
    for index, body in parts.items():
        wanted = ours.inertias[index]
        moments, axes = np.linalg.eigh(wanted.inertia)
        turn = _rotation(mujoco, model.body_iquat[body])
        found = turn @ np.diag(model.body_inertia[body]) @ turn.T
        same_mass = abs(model.body_mass[body] - wanted.mass) <= ODD * wanted.mass
        far = np.abs(found - wanted.inertia).max() > ODD * moments[2]
        if far and same_mass and moments[0] > 0.0:
            axes[:, 0] *= np.sign(np.linalg.det(axes))
            model.body_inertia[body] = moments
            model.body_iquat[body] = _quaternion(mujoco, axes)
            changed.append(names.get(index, ""))
    if changed:
        mujoco.mj_setConst(model, mujoco.MjData(model))
    return tuple(changed)


def _rotation(mujoco: Any, quaternion: FloatArray) -> FloatArray:
    """Rotation matrix ``(3, 3)`` of MuJoCo's quaternion w, x, y, z."""
    out = np.empty(9)
    mujoco.mju_quat2Mat(out, quaternion)
    return out.reshape(3, 3)


def _quaternion(mujoco: Any, rotation: FloatArray) -> FloatArray:
    """MuJoCo's quaternion w, x, y, z of a rotation matrix ``(3, 3)``."""
    out = np.empty(4)
    mujoco.mju_mat2Quat(out, np.ascontiguousarray(rotation).reshape(-1))
    return out
