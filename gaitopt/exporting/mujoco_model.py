"""A MuJoCo model for a plan: made from the robot's URDF, or the user's own."""

from __future__ import annotations

from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Any, Final

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError, RobotError
from gaitopt.exporting.sampled import Samples, Source
from gaitopt.robots.files.mjcf.bare_urdf import bare_urdf
from gaitopt.robots.rotations import quaternion_to_matrix

AGREEMENT: Final = 1e-6
"""Largest distance between the plan's joints and the model's [m, rad]: both compute from digits of
files, so that more is another robot."""
LEAST_FOOT: Final = 0.01
"""Radius of the feet of the model that is made, where the robot's file tells none [m]."""


@dataclass(frozen=True, eq=False)
class Addresses:
    """Where a model has its numbers.

    Attributes:
        qpos, qvel: of the file's joints ``(n,)``.
        joints: their ids ``(n,)``.
        free_qpos, free_qvel: of the free joint.
        offset: the free body in the plan's base frame: rotation ``(3, 3)`` and place ``(3,)``.
        actuators: by id: its joint's place in the file, the number that the joint's value is
            multiplied with, and whether it takes ``"position"``, ``"velocity"`` or ``"torque"``.
        notes: for the user.
    """

    qpos: np.ndarray
    qvel: np.ndarray
    joints: np.ndarray
    free_qpos: int
    free_qvel: int
    offset: tuple[FloatArray, FloatArray]
    actuators: dict[int, tuple[int, float, str]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def base_of(self, samples: Samples) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Position, quaternion w, x, y, z, and velocity of the free body, as MuJoCo has them."""
        q, v = samples.vectors.q, samples.vectors.v
        turn, place = self.offset
        rotation = quaternion_to_matrix(q[:, 3:7])
        position = q[:, :3] + rotation @ place
        # The body's origin moves with the base's, and around it.
        linear = np.einsum("nij,nj->ni", rotation, v[:, :3] + np.cross(v[:, 3:6], place))
        angular = v[:, 3:6] @ turn
        whole = _quaternions(rotation @ turn)
        return position, whole, np.concatenate([linear, angular], axis=1)


def _quaternions(rotations: FloatArray) -> FloatArray:
    """Quaternions w, x, y, z of rotation matrices ``(N, 3, 3)``."""
    from scipy.spatial.transform import Rotation

    return np.asarray(np.roll(Rotation.from_matrix(rotations).as_quat(canonical=True), 1, axis=1))


def made_model(
    mujoco: Any, source: Source, gains: tuple[float, float], keyframes: str
) -> tuple[str, Any]:
    """A model of the robot's URDF as MJCF text, and compiled.

    It has links, joints, inertias, a ball at every foot, and a position servo for every joint.

    Raises:
        RobotError: MuJoCo cannot read the URDF.
    """
    robot = source.plan.robot
    try:
        spec = mujoco.MjSpec.from_string(bare_urdf(robot))
        order = zip(source.order.columns, source.order.names, strict=True)
        renamed = {robot.joint_names[column]: name for column, name in order}
        inertia = dict(zip(robot.joint_names, robot.motor_inertia.tolist(), strict=True))
        for joint in spec.joints:
            joint.armature = inertia.get(joint.name, 0.0)
            joint.name = renamed.get(joint.name, joint.name)
        for leg in LEGS:
            foot = spec.body(robot.legs[leg].foot)
            foot.add_geom(
                name=f"foot {leg}", type=mujoco.mjtGeom.mjGEOM_SPHERE, mass=0.0,
                size=[max(robot.foot_radius, LEAST_FOOT), 0.0, 0.0],
            )  # fmt: skip
            foot.add_site(name=f"foot {leg}")
        for name in source.order.names:
            servo = spec.add_actuator(name=name, target=name)
            servo.trntype = mujoco.mjtTrn.mjTRN_JOINT
            servo.gaintype = mujoco.mjtGain.mjGAIN_FIXED
            servo.biastype = mujoco.mjtBias.mjBIAS_AFFINE
            servo.gainprm[0] = gains[0]
            servo.biasprm[:3] = [0.0, -gains[0], -gains[1]]
        spec.modelname = "robot"
        model = spec.compile()
        text = str(spec.to_xml())
    except (ValueError, mujoco.FatalError, AttributeError) as error:
        raise RobotError(f"{robot.name}: MuJoCo cannot read this URDF: {error}") from error
    return text.replace("</mujoco>", f'  <include file="{keyframes}"/>\n</mujoco>'), model


def addresses(mujoco: Any, model: Any, source: Source) -> Addresses:
    """Where the model has the file's joints.

    Raises:
        InputError: a joint is missing, or the model has not one free body.
    """
    names = [
        mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, j) or "" for j in range(model.njnt)
    ]
    free = [j for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE]
    if not free:
        raise InputError("the MJCF has no body with a free joint: no robot can walk there")
    ids = []
    for name in source.order.names:
        if name not in names:
            near = get_close_matches(name, names, n=1)
            hint = f"did you mean {near[0]!a}? " if near else ""
            raise InputError(
                f"the MJCF has no joint {name!a}; {hint}Give its names: joints={{'plan': 'MJCF'}}"
            )
        ids.append(names.index(name))
    root = int(model.body_rootid[model.jnt_bodyid[ids[0]]])
    mine = [j for j in free if int(model.jnt_bodyid[j]) == root]
    if not mine:
        raise InputError("the robot of the MJCF has no free joint: add <freejoint/> to its trunk")
    order = {joint: column for column, joint in enumerate(ids)}
    actuators, notes = _actuators(mujoco, model, order, source)
    return Addresses(
        qpos=np.array([int(model.jnt_qposadr[j]) for j in ids]),
        qvel=np.array([int(model.jnt_dofadr[j]) for j in ids]),
        joints=np.array(ids),
        free_qpos=int(model.jnt_qposadr[mine[0]]), free_qvel=int(model.jnt_dofadr[mine[0]]),
        offset=_offset(mujoco, model, root, source), actuators=actuators, notes=notes,
    )  # fmt: skip


def _offset(mujoco: Any, model: Any, body: int, source: Source) -> tuple[FloatArray, FloatArray]:
    """Where the free body is in the plan's base frame: found by its name, or the same."""
    name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body) or ""
    for frame in source.plan.robot.model.frames:
        if str(frame.name) == name and frame.parentJoint == 1:
            placement = frame.placement
            return np.array(placement.rotation), np.array(placement.translation)
    return np.eye(3), np.zeros(3)


def _actuators(
    mujoco: Any, model: Any, order: dict[int, int], source: Source
) -> tuple[dict[int, tuple[int, float, str]], tuple[str, ...]]:
    """What every actuator of a joint is told, by the law of its force.

    MuJoCo's is ``gain ctrl + bias1 length + bias2 velocity``, with the joint's angle times the gear
    as length: a servo rests where ``gain ctrl = -bias1 length``.
    """
    out: dict[int, tuple[int, float, str]] = {}
    for i in range(model.nu):
        joint = int(model.actuator_trnid[i, 0])
        if model.actuator_trntype[i] != mujoco.mjtTrn.mjTRN_JOINT or joint not in order:
            continue
        gear, gain = float(model.actuator_gear[i, 0]), float(model.actuator_gainprm[i, 0])
        bias = np.asarray(model.actuator_biasprm[i], dtype=np.float64)
        affine = model.actuator_biastype[i] == mujoco.mjtBias.mjBIAS_AFFINE
        if gain == 0.0 or gear == 0.0:
            continue
        if affine and bias[1] != 0.0:
            out[i] = (order[joint], -bias[1] * gear / gain, "position")
        elif affine and bias[2] != 0.0:
            out[i] = (order[joint], -bias[2] * gear / gain, "velocity")
        else:
            out[i] = (order[joint], 1.0 / (gear * gain), "torque")
    lacking = any(of == "torque" for _, _, of in out.values()) and not source.with_forces
    told = "motors are told 0: this plan promises no torques (gaitopt.retimed makes one that does)"
    return out, (told,) if lacking else ()


def check_kinematics(
    mujoco: Any, model: Any, source: Source, where: Addresses, samples: Samples, qpos: FloatArray
) -> float:
    """Largest distance of the model's joints from the plan's [m], at a few samples.

    Where a joint is, and how its link has turned since the first sample, need no common frames.

    Raises:
        InputError: it is more than :data:`AGREEMENT`; names the joint.
    """
    import pinocchio as pin

    robot = source.plan.robot
    data, ours = mujoco.MjData(model), robot.model.createData()
    ids = [robot.model.getJointId(robot.joint_names[c]) for c in source.order.columns]
    links = model.jnt_bodyid[where.joints]
    worst, first = 0.0, None
    for row in np.linspace(0, len(samples) - 1, 5).astype(int):
        data.qpos[:] = qpos[row]
        mujoco.mj_kinematics(model, data)
        pin.forwardKinematics(robot.model, ours, samples.vectors.q[row])
        turned = data.xmat[links].reshape(-1, 3, 3), np.array([ours.oMi[i].rotation for i in ids])
        first = first or turned
        mine, theirs = (
            now @ then.transpose(0, 2, 1) for now, then in zip(turned, first, strict=True)
        )
        apart = np.abs(data.xanchor[where.joints] - [ours.oMi[i].translation for i in ids])
        off = np.maximum(apart.max(axis=1), np.abs(mine - theirs).max(axis=(1, 2)))
        worst = max(worst, float(off.max()))
        if not off.max() <= AGREEMENT:
            name = source.order.names[int(off.argmax())]
            raise InputError(
                f"the MJCF is another robot: its joint {name} is {off.max():.3g} m or rad away "
                f"from the plan's at {samples.times[row]:.3f} s; load the robot from this MJCF"
            )
    return worst
