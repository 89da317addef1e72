"""The robot and its footholds as a MuJoCo model, made from the robot's own URDF text.

MuJoCo reads links, joints and inertias from the URDF, which has those of an MJCF to the last digit
(:mod:`gaitopt.robots.files.mjcf.check`). Shapes are replaced (:mod:`gaitopt.simulation.shapes`):
the feet are balls beside limbs and trunk, or all are those of the robot's MJCF. Mass and
forward kinematics are compared with what Pinocchio reads from the same text each time, so that the
simulated robot is that of the plan.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import MissingPackageError, RobotError
from gaitopt.robots.files.mjcf.bare_urdf import bare_urdf
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import quaternion_to_matrix
from gaitopt.simulation.ground import add_ground
from gaitopt.simulation.inertias import keep_inertias
from gaitopt.simulation.obstacles import add_obstacles
from gaitopt.simulation.settings import SimulationSettings
from gaitopt.simulation.shapes import FOOT, add_shapes, has_own_feet
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.obstacles import Obstacle

AGREEMENT = 1e-6
"""Largest disagreement with Pinocchio [m], and as a share of the mass: both read the same digits,
so more than rounding is a different robot."""

STEPS_TO_REST = 2.0
"""Time constant with which dry friction stops a joint, in steps of the physics: the shortest that
MuJoCo allows."""
HARD_FRICTION = (0.999, 0.999, 0.001, 0.5, 2.0)
"""MuJoCo's ``solimp`` of dry friction in joints. By default MuJoCo lets a tenth of a torque through
that is less than the friction: 1 less the first number. In a light leg of the rex, which rubs with
0.5 N m, that was enough to turn a joint at 2.5 times its limit of 0.5 rad/s, and 4.7 times in
spotMicro; with 1 % and less it is 1.1 times."""


@dataclass(frozen=True, eq=False)
class SimModel:
    """A MuJoCo model, and how its vectors are ordered.

    Attributes:
        model: ``mujoco.MjModel``.
        qpos, qvel, ctrl: for each of ``robot.joint_names`` its place in MuJoCo's ``qpos``,
            ``qvel`` and ``ctrl`` ``(nj,)``.
        base: id of the body that is free to move.
        feet: ids of the foot balls, legs in the order of :data:`gaitopt.LEGS`; none with shapes of
            the robot's own.
        sites: ids of the places of the feet, in the same order.
        columns: id of the shape under each foothold ``(4, n)``; on open ground that of the ground,
            save for footholds that are higher; on a height map that of the map.
        mass_error: disagreement with Pinocchio's mass, as a share of it.
        kinematics_error: largest disagreement with Pinocchio over random postures, of the feet and
            the centre of mass [m].
    """

    model: Any
    qpos: np.ndarray
    qvel: np.ndarray
    ctrl: np.ndarray
    base: int
    feet: tuple[int, ...]
    sites: tuple[int, ...]
    columns: np.ndarray
    mass_error: float
    kinematics_error: float

    @cached_property
    def motor_inertias(self) -> FloatArray:
        """What the motors add to the inertia of each joint ``(nj,)`` [kg m²].

        Servos change MuJoCo's copy as they step, so it is read once, before the first ones do.
        """
        return np.array(self.model.dof_armature[self.qvel])

    @property
    def own_shapes(self) -> bool:
        """Whether the shapes are those of the robot's file, and not balls at its feet."""
        return not self.feet


def import_mujoco() -> Any:
    """The module ``mujoco``.

    Raises:
        MissingPackageError: it is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise MissingPackageError(
            "simulating needs the package mujoco: pip install 'gaitopt[sim]'"
        ) from error
    return mujoco


def build_sim_model(
    robot: Quadruped, footholds: Footholds, settings: SimulationSettings,
    obstacles: Sequence[Obstacle] = (),
) -> SimModel:  # fmt: skip
    """The model of ``robot`` on ``footholds``, with ``obstacles`` in its way.

    Raises:
        MissingPackageError: MuJoCo is not installed.
        RobotError: MuJoCo cannot read the URDF, or reads another robot from it than Pinocchio.
        InputError: ``settings.column_errors`` names an unknown column.
        FootholdsError: columns of different heights overlap where a foot stands.
        GroundError: the footholds' height map is nowhere near them.
    """
    mujoco = import_mujoco()
    own = settings.own_shapes and has_own_feet(robot)
    try:
        spec = mujoco.MjSpec.from_string(bare_urdf(robot))
    except (ValueError, mujoco.FatalError) as error:
        raise RobotError(f"{robot.name}: MuJoCo cannot read this URDF: {error}") from error
    _set_options(mujoco, spec, settings)
    add_shapes(mujoco, spec, robot, settings, own)
    columns = add_ground(mujoco, spec, robot, footholds, settings, own)
    add_obstacles(mujoco, spec, obstacles, settings, own)
    _add_servos(mujoco, spec, robot)
    # Now that the robot has its shapes, links that do not move may go: anymal_c has sixty. Contacts
    # of feet on links without mass would be softer.
    spec.compiler.fusestatic = True
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise RobotError(f"{robot.name}: MuJoCo cannot simulate this URDF: {error}") from error
    found = _mapped(mujoco, model, robot, columns)
    joints = np.array([model.joint(name).id for name in robot.joint_names])
    keep_inertias(mujoco, model, robot, found.base, joints)
    _scale_masses(mujoco, found, settings)
    return found


def _set_options(mujoco: Any, spec: Any, settings: SimulationSettings) -> None:
    option = spec.option
    option.timestep = settings.timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = settings.impratio
    option.noslip_iterations = int(settings.noslip_iterations)
    # MuJoCo starts over when a simulation diverges; here that is a fall and must be seen.
    option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)


def _add_servos(mujoco: Any, spec: Any, robot: Quadruped) -> None:
    """Add the joints' servos, which are torques to MuJoCo.

    Damping, and limits of torques and speeds, are those of
    :class:`gaitopt.simulation.servos.Servos`.
    """
    for name in robot.joint_names:
        servo = spec.add_actuator(name=f"gaitopt servo {name}", target=name)
        servo.trntype = mujoco.mjtTrn.mjTRN_JOINT
        servo.gaintype = mujoco.mjtGain.mjGAIN_FIXED
        servo.gainprm[0] = 1.0
    inertias = dict(zip(robot.joint_names, robot.motor_inertia.tolist(), strict=True))
    for joint in spec.joints:
        # The servos keep the limits; MuJoCo would clip to the URDF's once more, unseen.
        joint.actfrclimited = 0
        # The inertia of motors and gears, which a URDF cannot state and an MJCF does.
        joint.armature = inertias.get(joint.name, 0.0)
        joint.solref_friction = [STEPS_TO_REST * spec.option.timestep, 1.0]
        joint.solimp_friction = list(HARD_FRICTION)


def _mapped(mujoco: Any, model: Any, robot: Quadruped, columns: list[list[str]]) -> SimModel:
    """The compiled model with the places of joints, feet and columns in its vectors.

    Raises:
        RobotError: it is not the robot that Pinocchio reads from the same URDF.
    """

    def geom(name: str) -> int:
        return int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, name))

    joints = [model.joint(name) for name in robot.joint_names]
    floating = [j for j in range(model.njnt) if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_FREE]
    if len(floating) != 1 or model.nq != 7 + len(joints):
        raise RobotError(
            f"{robot.name}: MuJoCo finds {model.nq} coordinates where Pinocchio has "
            f"{7 + len(joints)}"
        )
    found = SimModel(
        model=model,
        qpos=np.array([int(j.qposadr[0]) for j in joints]),
        qvel=np.array([int(j.dofadr[0]) for j in joints]),
        ctrl=np.array([int(model.actuator(f"gaitopt servo {n}").id) for n in robot.joint_names]),
        base=int(model.jnt_bodyid[floating[0]]),
        feet=tuple(ball for ball in (geom(FOOT + leg) for leg in LEGS) if ball >= 0),
        sites=tuple(int(model.site(FOOT + leg).id) for leg in LEGS),
        columns=np.array([[geom(name) for name in row] for row in columns]),
        mass_error=abs(float(model.body_mass.sum()) / robot.mass - 1.0),
        kinematics_error=0.0,
    )
    found = replace(found, kinematics_error=_kinematics_error(mujoco, found, robot))
    if not max(found.mass_error, found.kinematics_error) <= AGREEMENT:
        raise RobotError(
            f"{robot.name}: MuJoCo and Pinocchio read different robots from this URDF: masses "
            f"differ by {found.mass_error:.2g}, feet by {found.kinematics_error:.2g} m"
        )
    return found


def to_mujoco(sim: SimModel, q: FloatArray) -> FloatArray:
    """MuJoCo's ``qpos`` for a Pinocchio configuration ``q (nq,)``."""
    out = np.empty(sim.model.nq)
    out[:3] = q[:3]
    out[3], out[4:7] = q[6], q[3:6]
    out[sim.qpos] = q[7:]
    return out


def velocity_to_mujoco(sim: SimModel, turn: FloatArray, v: FloatArray) -> FloatArray:
    """MuJoCo's ``qvel`` for Pinocchio's ``v (nv,)``, and the base's quaternion x, y, z, w."""
    out = np.empty(sim.model.nv)
    # MuJoCo's velocity of the base's origin is in the world's axes.
    out[:3] = quaternion_to_matrix(turn) @ v[:3]
    out[3:6], out[sim.qvel] = v[3:6], v[6:]
    return out


def _kinematics_error(mujoco: Any, sim: SimModel, robot: Quadruped, postures: int = 4) -> float:
    """Largest disagreement of feet and centre of mass with Pinocchio over random postures [m]."""
    import pinocchio as pin

    rng = np.random.default_rng(0)
    data, ours = mujoco.MjData(sim.model), robot.model.createData()
    worst = 0.0
    for _ in range(postures):
        turn = rng.normal(size=4)
        q = np.concatenate([
            rng.normal(size=3), turn / np.linalg.norm(turn),
            rng.uniform(-1.0, 1.0, len(robot.joint_names)),
        ])  # fmt: skip
        data.qpos[:] = to_mujoco(sim, q)
        mujoco.mj_kinematics(sim.model, data)
        mujoco.mj_comPos(sim.model, data)
        pin.framesForwardKinematics(robot.model, ours, q)
        com = pin.centerOfMass(robot.model, ours, q)
        errors = [np.linalg.norm(com - data.subtree_com[0])]
        for leg, site in zip(LEGS, sim.sites, strict=True):
            place = ours.oMf[robot.model.getFrameId(robot.legs[leg].foot)].translation
            errors.append(np.linalg.norm(place - data.site_xpos[site]))
        worst = max(worst, float(np.max(errors)))
    return worst


def _scale_masses(mujoco: Any, sim: SimModel, settings: SimulationSettings) -> None:
    """Multiply masses and inertias by the settings' factors."""
    if settings.body_mass_factor == 1.0 and settings.leg_mass_factor == 1.0:
        return
    model = sim.model
    scale = np.full(model.nbody, settings.leg_mass_factor)
    for body in range(1, model.nbody):
        # Links that are fixed to the base belong to the body.
        if model.body_weldid[body] == model.body_weldid[sim.base]:
            scale[body] = settings.body_mass_factor
    model.body_mass[:] *= scale
    model.body_inertia[:] *= scale[:, None]
    mujoco.mj_setConst(model, mujoco.MjData(model))
