"""Compares a URDF that was made of an MJCF with what MuJoCo makes of the MJCF."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gaitopt.errors import RobotError
from gaitopt.robots.files.mjcf.links import HINGE, SLIDE, body_name, joint_name

AGREEMENT = 1e-6
"""Largest disagreement [m], and as a share of the mass: both have the same numbers, so more than
rounding is a mistake."""
POSTURES = 4
"""Random postures that are compared."""


def disagreement(
    mujoco: Any,
    model: Any,
    base: int,
    urdf: str,
    *,
    locked: Mapping[str, float],
    masses: bool,
) -> float:
    """How far masses, centres of mass and the places of all joints are from MuJoCo's.

    It is the largest distance [m], or share of the mass.

    Args:
        mujoco, model: the package, and the MJCF's model.
        base: number of the body that is the URDF's base.
        urdf: the URDF's text.
        locked: joints of the MJCF that do not move in the URDF, and where they are [rad, m].
        masses: whether masses are compared, too; the user may have given others.
    """
    import pinocchio as pin

    ours = pin.buildModelFromXML(urdf, pin.JointModelFreeFlyer())
    theirs, data, rng = mujoco.MjData(model), ours.createData(), np.random.default_rng(0)
    names = [str(name) for name in ours.names[2:]]
    numbers = {joint_name(model, j): j for j in range(model.njnt)}
    # The MJCF's body is the URDF's, or is fixed to one that stands upright.
    link = ours.getFrameId(body_name(model, base), pin.FrameType.BODY)
    inside = ours.frames[link].placement
    mass = float(model.body_subtreemass[base])
    worst = abs(pin.computeTotalMass(ours) / mass - 1.0) if masses else 0.0
    for _ in range(POSTURES):
        q = pin.neutral(ours)
        q[7:] = rng.uniform(-1.0, 1.0, len(names))
        for name, at in locked.items():
            if model.jnt_type[numbers[name]] in (HINGE, SLIDE):
                theirs.qpos[model.jnt_qposadr[numbers[name]]] = at
        theirs.qpos[model.jnt_qposadr[[numbers[name] for name in names]]] = q[7:]
        mujoco.mj_kinematics(model, theirs)
        mujoco.mj_comPos(model, theirs)
        pin.forwardKinematics(ours, data, q)
        com = pin.centerOfMass(ours, data, q)
        turn, place = theirs.xmat[base].reshape(3, 3), theirs.xpos[base]
        com = inside.actInv(com)
        errors = [masses * np.linalg.norm((theirs.subtree_com[base] - place) @ turn - com)]
        for name in names:
            anchor = inside.act((theirs.xanchor[numbers[name]] - place) @ turn)
            errors.append(np.linalg.norm(anchor - data.oMi[ours.getJointId(name)].translation))
        worst = float(np.max([worst, *errors]))
    return worst


def refuse_disagreement(worst: float, label: str) -> None:
    """Refuse a URDF that is as far as this from MuJoCo's model, whose ``label`` is named.

    Raises:
        RobotError: it is more than rounding.
    """
    if not worst <= AGREEMENT:
        raise RobotError(
            f"{label}: the URDF that was made of this MJCF differs from MuJoCo's model by "
            f"{worst:.2g} m or as a share of the mass; please report this file"
        )
