"""The tracking controller: joint torques and servo set-points that follow a plan.

The wanted force and torque on the body are its weight, the reference's inertial forces, and a
spring and a damper for the body's errors of position and orientation. The feet that stand share
them out: for a plan that promises forces, near the planned ones and within their limits
(:mod:`gaitopt.control.nearest_forces`), for others with least forces
(:mod:`gaitopt.control.forces`). The joints' torques for these contact forces and for the legs'
weight and inertia are fed forward to the servos, which are PD controllers of the joints' angles.
Their set-points come from inverse kinematics: standing legs bring the body to the reference, flying
legs bring their feet there. The controller knows nothing of any simulator.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gaitopt.control.build import build_reference
from gaitopt.control.footing import Footing
from gaitopt.control.forces import ForceDistribution, ForceShare
from gaitopt.control.gains import ControlGains
from gaitopt.control.nearest_forces import LegTorques, NearestForces
from gaitopt.control.reference import Reference
from gaitopt.control.rotation import rotation_of, rotation_vector
from gaitopt.control.stepping import Stepping
from gaitopt.conventions import GRAVITY, LEGS, BoolArray, FloatArray
from gaitopt.plan.plan import Plan

LIGHT_LOAD = 0.06
"""Share of the weight up to which a foot is light: its leg follows the body, the more the less it
bears, and does not push the body to its place. Chosen: with 0.06 and 0.1 feet of hyq on slippery
stairs slide equally far; with 0.2, held up as well, a hind foot of it slid by 31 mm."""
LARGEST_PROBE = 0.2
"""Largest step of a leg's joints with which its foot reaches for the ground [rad]. A leg that is
nearly straight hardly goes deeper, and one Newton step for a depth of centimetres swings its foot
aside: feet of a Bittle whose knees fold by 17 mm went 20 to 30 mm beside their footholds so."""


@dataclass(frozen=True, eq=False)
class RobotState:
    """What a robot's sensors and its state estimator measure.

    Attributes:
        q: configuration ``(nq,)``, Pinocchio's: base position, quaternion xyzw, joints.
        v: velocity ``(nv,)``, Pinocchio's: base twist in the base's frame, joint rates.
        contacts: which feet touch the ground ``(4,)``, legs in the order of :data:`gaitopt.LEGS`.
        bearing: which of them the ground pushes, where that is measured ``(4,)``: a foot that is
            leaving it touches it without a force, and would kick if it were asked for a large one.
            Without it those that touch.
    """

    q: FloatArray
    v: FloatArray
    contacts: BoolArray
    bearing: BoolArray | None = None

    @cached_property
    def rotation(self) -> FloatArray:
        """Rotation matrix of the base ``(3, 3)``."""
        return rotation_of(self.q[3:7])

    @property
    def pushed(self) -> BoolArray:
        """Feet that touch the ground and bear load, as far as is known ``(4,)``."""
        return self.contacts if self.bearing is None else self.contacts & self.bearing


@dataclass(frozen=True, eq=False)
class Command:
    """What the joint servos are told, in the order of ``robot.joint_names``.

    The servo's torque is ``torque + kp (angles - q) + kd (rates - dq)``, with ``kp`` the gains'
    ``joint_stiffness`` and ``kd`` their ``joint_damping``. The same torque is that of a speed
    controller whose wanted speed is ``rates + kp / kd (angles - q)``; a servo with a speed limit
    clips this speed. Until the next command the angles move with the rates. If they stood still, a
    quick joint would be pushed forward at the begin of every interval and held back at its end.

    Attributes:
        torque: fed forward ``(nj,)`` [N m].
        angles, rates: set-points ``(nj,)`` [rad], [rad/s].
        share: the contact forces that ``torque`` is for.
        ahead: how long after the command the joints are to be at ``angles`` [s].
    """

    torque: FloatArray
    angles: FloatArray
    rates: FloatArray
    share: ForceShare
    ahead: float = 0.0


class TrackingController:
    """Follows one plan; call :meth:`command` every :attr:`dt` seconds, in order of time.

    Attributes:
        gains: what it is tuned to.
        reference: what it follows.
        dt: control interval [s].

    Args:
        plan: the motion. Its robot is the model that the controller computes with.
        gains: :meth:`ControlGains.for_plan` by default.
        dt: control interval [s].

    Raises:
        InputError: the interval is no positive time.
    """

    def __init__(self, plan: Plan, gains: ControlGains | None = None, dt: float = 0.006) -> None:
        robot = plan.robot
        self.gains = ControlGains.for_plan(plan) if gains is None else gains
        self.reference: Reference = build_reference(plan, self.gains, dt)
        self.dt = dt
        self._robot = robot
        self._model: Any = robot.model
        self._data: Any = robot.model.createData()
        self._frames = [robot.model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
        self._columns = np.array([robot.leg_columns[leg] for leg in LEGS])
        # Of the Jacobians of four feet (4, 3, nj) the columns of each foot's own leg.
        four, rows = np.arange(len(LEGS))[:, None, None], np.arange(3)[:, None]
        self._own_joints = four, rows, self._columns[:, None]
        self._radius = robot.foot_radius
        self._normals, self._friction = np.zeros((len(LEGS), 3)), np.zeros(len(LEGS))
        self._levers = np.zeros((len(LEGS), 3, 3))
        self._at_rest = np.zeros(robot.model.nv)
        self._still = np.zeros(len(robot.joint_names))
        self._blend_decay = _decay(dt, self.gains.blend_time)
        self._swing_decay = _decay(dt, self.gains.swing_blend_time)
        self._force_decay = _decay(dt, self.gains.force_smoothing)
        weight, length = robot.mass * GRAVITY, 0.5 * max(robot.stance_size)
        limits = plan.settings.promised_forces
        self._weight = weight
        growth = self.gains.growth_time
        # By how much the force on a foot may grow from call to call [N].
        self._most_growth = weight * dt / growth if growth > 0.0 else np.inf
        self._forces = ForceDistribution(weight, length, self.gains.friction)
        self._nearest = None if limits is None else NearestForces(weight, length, limits)
        self._efforts = np.array(robot.effort_limits)[self._columns]
        self.reset()

    def reset(self) -> None:
        """Start anew: all feet that stand at the plan's start have found the ground."""
        self._footing = Footing(self.reference, self.gains, self.dt)
        # Displacements of the feet's set-points from the reference's feet, in the base frame [m]:
        # in all, and the part that fades after a touch-down.
        self._correction = np.zeros((len(LEGS), 3))
        self._offset = np.zeros((len(LEGS), 3))
        self._was_grounded = self._footing.grounded
        self._stepping = Stepping(self._robot, self.reference, self.gains.foothold_shift)
        self._forces.reset()
        if self._nearest is not None:
            self._nearest.reset()
        self._last_forces: FloatArray | None = None

    @property
    def waited(self) -> float:
        """How long it has waited for feet so far, beyond the pauses of the reference [s]."""
        return self._footing.waited

    def plan_time(self, time: float) -> float:
        """Which instant of the plan is followed at ``time`` [s]."""
        return float(self.reference.clock.plan_time(time - self.waited))

    def command(self, time: float, state: RobotState) -> Command:
        """What the servos are to do from ``time`` [s] on, given the measured ``state``."""
        footing = self._footing
        tick = footing.wait(self.reference.tick(time - self.waited))
        self._stand_on(tick)
        state = self._ahead(state)
        rotation = state.rotation
        feet, jacobian, needed = self._dynamics(tick, state.q)
        footing.update(tick, state.contacts)
        wrench = needed[:6] + self._feedback(tick, state, rotation)
        share = self._share(tick, jacobian, wrench, needed[6:], state.pushed)
        torque = needed[6:] - self._filtered(share.forces, state.contacts) @ jacobian[:, 6:]
        return Command(
            torque=torque,
            angles=self._set_points(tick, state, rotation, feet, share.forces),
            rates=self._still if footing.waiting else self.reference.rates[tick],
            share=share,
            ahead=self.reference.ahead,
        )

    def _ahead(self, state: RobotState) -> RobotState:
        """Where the robot will be at the instant that the reference's entries are of."""
        if not self.reference.ahead:
            return state
        import pinocchio as pin

        q = pin.integrate(self._model, state.q, self.reference.ahead * state.v)
        return RobotState(np.asarray(q), state.v, state.contacts, state.bearing)

    def _stand_on(self, tick: int) -> None:
        """Take up the ground below each foot, where it is another than at the last call."""
        normals, friction = self.reference.normals[tick], self.reference.friction[tick]
        if (normals == self._normals).all() and (friction == self._friction).all():
            return
        self._normals, self._friction = normals, friction
        # A ball that turns by w moves its contact at -r n by r n x w.
        self._levers = np.swapaxes(np.cross(self._radius * normals[:, None], np.eye(3)), 1, 2)
        self._forces.stand_on(normals, friction)
        if self._nearest is not None:
            self._nearest.stand_on(normals, friction)

    def _share(
        self, tick: int, jacobian: FloatArray, wrench: FloatArray, own: FloatArray,
        contacts: BoolArray,
    ) -> ForceShare:  # fmt: skip
        """Contact forces that make up ``wrench (6,)``; ``own (nj,)`` are torques without them."""
        loads, grasp = self._footing.loads(tick), jacobian[:, :6].T
        if self._nearest is None:
            return self._forces.share(grasp, wrench, loads)
        planned = self.reference.forces[tick] * self._footing.taken_up[:, None]
        by_foot = jacobian[:, 6:].reshape(len(LEGS), 3, -1)
        legs = LegTorques(by_foot[self._own_joints], own[self._columns], self._efforts)
        return self._nearest.share(grasp, wrench, loads, planned, contacts, legs)

    def _dynamics(self, tick: int, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Feet ``(4, 3)`` [m], Jacobian of their contact points ``(12, nv)``, inverse dynamics.

        The last are the generalised forces ``(nv,)`` that carry the robot's weight and accelerate
        it as the reference says, at the reference's velocity.
        """
        import pinocchio as pin

        model, data = self._model, self._data
        velocity, acceleration = self.reference.velocity[tick], self.reference.acceleration[tick]
        if self._footing.waiting:
            velocity = acceleration = self._at_rest
        needed = np.array(pin.rnea(model, data, q, velocity, acceleration))
        pin.computeJointJacobians(model, data, q)
        feet, whole = np.empty((4, 3)), np.empty((4, 6, model.nv))
        for i, frame in enumerate(self._frames):
            feet[i] = pin.updateFramePlacement(model, data, frame).translation
            whole[i] = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        jacobian = whole[:, :3] + self._levers @ whole[:, 3:]
        return feet, jacobian.reshape(12, model.nv), needed

    def _filtered(self, forces: FloatArray, contacts: BoolArray) -> FloatArray:
        """The wanted ``forces (4, 3)`` after a first-order filter ``(12,)``; 0 in the air.

        They grow by no more than the gains' ``growth_time`` allows.
        """
        before = forces if self._last_forces is None else self._last_forces
        filtered = forces + self._force_decay * (before - forces)
        if self._most_growth < np.inf:
            size = np.sqrt((filtered**2).sum(axis=1))
            most = np.sqrt((before**2).sum(axis=1)) + self._most_growth
            filtered *= np.minimum(most / np.maximum(size, most), 1.0)[:, None]
        filtered[~(contacts | self._footing.grounded)] = 0.0
        self._last_forces = filtered
        return filtered.reshape(-1)

    def _feedback(self, tick: int, state: RobotState, rotation: FloatArray) -> FloatArray:
        """Force and torque of spring and damper on the body, in its own frame ``(6,)``."""
        ref, gains = self.reference, self.gains
        place = ref.position[tick] - state.q[:3]
        linear, angular = ref.linear[tick], ref.angular[tick]
        if self._footing.waiting:
            linear = angular = self._at_rest[:3]
        velocity = linear - rotation @ state.v[:3]
        angle = rotation_vector(ref.rotation[tick] @ rotation.T)
        spin = angular - rotation @ state.v[3:6]
        force = gains.body_damping * velocity + gains.body_stiffness * _shortened(
            place, gains.largest_error
        )
        torque = gains.rotation_damping * spin + gains.rotation_stiffness * _shortened(
            angle, gains.largest_rotation
        )
        return np.concatenate([force @ rotation, torque @ rotation])

    def _set_points(
        self, tick: int, state: RobotState, rotation: FloatArray, feet: FloatArray,
        forces: FloatArray,
    ) -> FloatArray:  # fmt: skip
        """Joint angles ``(nj,)``: one Newton step of inverse kinematics from the plan's angles.

        The foot of a standing leg stays where it is, and its leg brings the body to the reference.
        The foot of a flying leg goes to its reference, from where the body is. A Newton step has an
        error of second order: about 0.1 mm for a displacement of 1 cm.
        """
        ref, footing = self.reference, self._footing
        held = footing.grounded
        target = ref.feet[tick] + self._stepping.shifts(tick, state.q, state.v)
        if self._nearest is not None:
            # A foot that bears hardly any load may leave the ground: it is brought back.
            held = held & state.contacts
            target[footing.grounded & ~held, 2] -= self.gains.landing_depth
        standing = (feet - ref.position[tick]) @ ref.rotation[tick]
        if self._nearest is not None:
            standing += self._let_go(forces, standing, (feet - state.q[:3]) @ rotation, rotation)
        flying = (target - state.q[:3]) @ rotation
        grounded = held[:, None]
        wanted = np.where(grounded, standing, flying) - ref.feet_in_base[tick]
        landed = held & ~self._was_grounded
        if landed.any():
            # At touch-down no set-point jumps: the difference fades. It leads a little below the
            # ground, so that the foot keeps touching it until it carries load.
            self._offset[landed] = (self._correction - wanted)[landed]
            self._offset[landed] -= self.gains.landing_depth * rotation[2]
        self._was_grounded = held
        self._offset *= self._blend_decay
        # A flying foot follows the body's errors slowly, so that joint velocities stay low.
        slowly = wanted + (self._correction - wanted) * self._swing_decay
        self._correction = np.where(grounded, wanted + self._offset, slowly)
        step = (ref.inverse[tick] @ self._correction[:, :, None])[:, :, 0]
        if footing.probe.any():
            step += self._probing(tick, rotation)
        angles = ref.joints[tick].copy()
        angles[self._columns] += step
        return np.asarray(angles)

    def _let_go(
        self, forces: FloatArray, standing: FloatArray, here: FloatArray, rotation: FloatArray
    ) -> FloatArray:
        """By how much the set-points of light feet follow the body ``(4, 3)`` [m], in its frame.

        The leg of a standing foot brings the body to the reference. A foot that bears hardly any
        load is pushed along the ground by that: it stays where it is, along the ground.

        Args:
            forces: that the feet are to bear ``(4, 3)`` [N].
            standing: places of the feet with the body at the reference ``(4, 3)`` [m].
            here: where they are, with the body where it is ``(4, 3)`` [m].
            rotation: of the body ``(3, 3)``.
        """
        load = (forces * self._normals).sum(axis=1) / (LIGHT_LOAD * self._weight)
        away, normals = here - standing, self._normals @ rotation
        away -= (away * normals).sum(axis=1)[:, None] * normals
        return np.asarray(np.minimum(np.maximum(1.0 - load, 0.0), 1.0)[:, None] * away)

    def _probing(self, tick: int, rotation: FloatArray) -> FloatArray:
        """Steps of the joints ``(4, j)`` [rad] by which feet that should stand go down at once."""
        down = -self._footing.probe[:, None] * rotation[2]
        step = (self.reference.inverse[tick] @ down[:, :, None])[:, :, 0]
        turn = np.sqrt((step * step).sum(axis=1, keepdims=True))
        return np.asarray(step * (LARGEST_PROBE / np.maximum(turn, LARGEST_PROBE)))


def _decay(dt: float, time_constant: float) -> float:
    """What is left of a difference after ``dt`` [s]; nothing where the time constant is zero."""
    return float(np.exp(-dt / max(time_constant, 1e-9)))


def _shortened(vector: FloatArray, largest: float) -> FloatArray:
    """The ``vector``, shortened to the length ``largest`` where it is longer."""
    length = float(np.sqrt(vector @ vector))
    return vector if length <= largest else np.asarray(vector * (largest / length))
