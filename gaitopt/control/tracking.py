"""The tracking controller: joint torques and servo set-points that follow a plan.

The wanted force and torque on the body are its weight, the reference's inertial forces, and a
spring and a damper for the body's errors of position and orientation. The feet that stand share
them out (:mod:`gaitopt.control.forces`). The joints' torques for these contact forces and for the
legs' weight are fed forward to the servos, which are PD controllers of the joints' angles. Their
set-points come from inverse kinematics: standing legs bring the body to the reference, flying legs
bring their feet there. The controller knows nothing of any simulator.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitopt.control.forces import ForceDistribution, ForceShare
from gaitopt.control.gains import ControlGains
from gaitopt.control.reference import LEAST_LOAD, Reference, build_reference
from gaitopt.conventions import GRAVITY, LEGS, BoolArray, FloatArray
from gaitopt.plan.plan import Plan


@dataclass(frozen=True, eq=False)
class RobotState:
    """What a robot's sensors and its state estimator measure.

    Attributes:
        q: configuration ``(nq,)``, Pinocchio's: base position, quaternion xyzw, joints.
        v: velocity ``(nv,)``, Pinocchio's: base twist in the base's frame, joint rates.
        contacts: which feet touch the ground ``(4,)``, legs in the order of :data:`gaitopt.LEGS`.
    """

    q: FloatArray
    v: FloatArray
    contacts: BoolArray


@dataclass(frozen=True, eq=False)
class Command:
    """What the joint servos are told, in the order of ``robot.joint_names``.

    The servo's torque is ``torque + kp (angles - q) + kd (rates - dq)``, with ``kp`` the gains'
    ``joint_stiffness`` and ``kd`` their ``joint_damping``. The same torque is that of a speed
    controller whose wanted speed is ``rates + kp / kd (angles - q)``; a servo with a speed limit
    clips this speed.

    Attributes:
        torque: fed forward ``(nj,)`` [N m].
        angles, rates: set-points ``(nj,)`` [rad], [rad/s].
        share: the contact forces that ``torque`` is for.
    """

    torque: FloatArray
    angles: FloatArray
    rates: FloatArray
    share: ForceShare


class TrackingController:
    """Follows one plan; call :meth:`command` every :attr:`dt` seconds, in order of time.

    Attributes:
        gains: what it is tuned to.
        reference: what it follows.
        dt: control interval [s].
        waited: how long it has waited for feet so far, beyond the pauses of the reference [s].

    Args:
        plan: the motion. Its robot is the model that the controller computes with.
        gains: :meth:`ControlGains.for_robot` by default.
        dt: control interval [s].

    Raises:
        InputError: the interval is no positive time, or a leg has no roll joint.
    """

    def __init__(self, plan: Plan, gains: ControlGains | None = None, dt: float = 0.006) -> None:
        robot = plan.robot
        self.gains = ControlGains.for_robot(robot) if gains is None else gains
        self.reference: Reference = build_reference(plan, self.gains, dt)
        self.dt = dt
        # A robot that is not stable at rest cannot stop in the middle of its motion.
        self._can_stop = plan.settings.static
        self._model: Any = robot.model
        self._data: Any = robot.model.createData()
        self._frames = [robot.model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
        self._columns = np.array([robot.leg_columns[leg] for leg in LEGS])
        self._radius = robot.foot_radius
        self._at_rest = np.zeros(robot.model.nv)
        self._blend_decay = _decay(dt, self.gains.blend_time)
        self._force_decay = _decay(dt, self.gains.force_smoothing)
        self._forces = ForceDistribution(
            robot.mass * GRAVITY, 0.5 * max(robot.stance_size), self.gains.friction
        )
        self.reset()

    def reset(self) -> None:
        """Start anew: all feet that stand at the plan's start have found the ground."""
        four = len(LEGS)
        # Which feet bear load, and for how long each has [s]; those at the start always have.
        self._grounded = np.array(self.reference.standing[0])
        self._bearing_time = np.where(self._grounded, np.inf, 0.0)
        # How long each foot has been without contact, and how late each is that should stand [s].
        self._airborne_time = np.zeros(four)
        self._delay = np.zeros(four)
        # Which feet the clock stands still for, and how long it still may [s].
        self._awaited = np.zeros(four, dtype=np.bool_)
        self._wait_left = self.gains.longest_wait if self._can_stop else 0.0
        self.waited = 0.0
        # How far below its reference each foot reaches for the ground [m].
        self._probe = np.zeros(four)
        # Displacements of the feet's set-points from the reference's feet, in the base frame [m]:
        # in all, and the part that fades after a touch-down.
        self._correction = np.zeros((four, 3))
        self._offset = np.zeros((four, 3))
        self._was_grounded = self._grounded
        self._forces.reset()
        self._last_forces: FloatArray | None = None

    def plan_time(self, time: float) -> float:
        """Which instant of the plan is followed at ``time`` [s]."""
        return float(self.reference.clock.plan_time(time - self.waited))

    def command(self, time: float, state: RobotState) -> Command:
        """What the servos are to do from ``time`` [s] on, given the measured ``state``."""
        tick = self._wait(self.reference.tick(time - self.waited))
        rotation = rotation_of(state.q[3:7])
        feet, jacobian, needed = self._dynamics(tick, state.q)
        self._update_contacts(tick, state.contacts)
        waiting = self._awaited.any()
        share = self._forces.share(
            jacobian[:, :6].T,
            needed[:6] + self._feedback(tick, state, rotation),
            self._loads(tick),
        )
        torque = needed[6:] - self._filtered(share.forces, state.contacts) @ jacobian[:, 6:]
        return Command(
            torque=torque,
            angles=self._set_points(tick, state.q[:3], rotation, feet),
            rates=0.0 * self.reference.rates[tick] if waiting else self.reference.rates[tick],
            share=share,
        )

    def _wait(self, tick: int) -> int:
        """The tick to follow. The clock stands still while a foot is missing that should stand.

        So no foot lifts off before another has taken up its load, and the body does not go on
        without its support. Where a foot lands at the very instant at which another lifts off, the
        walk would otherwise depend on the ground being exactly where the plan has it.
        """
        standing = self.reference.standing
        after = standing[min(tick + 1, len(standing) - 1)]
        if (standing[tick] & ~after).any():
            missing = after & (self._bearing_time < self.gains.loading_time)
        else:
            missing = after & (self._delay > self.gains.tolerated_delay)
        if self._wait_left <= 0.0 or not missing.any():
            self._awaited = np.zeros(len(LEGS), dtype=np.bool_)
            if not missing.any() and self._can_stop:
                self._wait_left = self.gains.longest_wait
            return tick
        self._awaited = missing
        self._wait_left -= self.dt
        self.waited += self.dt
        return tick

    def _dynamics(self, tick: int, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Feet ``(4, 3)`` [m], Jacobian of their contact points ``(12, nv)``, inverse dynamics.

        The last are the generalised forces ``(nv,)`` that carry the robot's weight and accelerate
        it as the reference says, at zero velocity.
        """
        import pinocchio as pin

        model, data = self._model, self._data
        acceleration = self._at_rest if self._awaited.any() else self.reference.acceleration[tick]
        needed = np.array(pin.rnea(model, data, q, self._at_rest, acceleration))
        pin.computeJointJacobians(model, data, q)
        feet, jacobian = np.empty((4, 3)), np.empty((12, model.nv))
        for i, frame in enumerate(self._frames):
            feet[i] = pin.updateFramePlacement(model, data, frame).translation
            j = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            # The ground touches the ball's lowest point, whose velocity is v - r (w x z).
            jacobian[3 * i : 3 * i + 3] = j[:3]
            jacobian[3 * i] -= self._radius * j[4]
            jacobian[3 * i + 1] += self._radius * j[3]
        return feet, jacobian, needed

    def _update_contacts(self, tick: int, contacts: BoolArray) -> None:
        """Follow which feet bear load: those that should stand and have found the ground."""
        standing = self.reference.standing[tick] | self._awaited
        self._airborne_time = np.where(contacts, 0.0, self._airborne_time + self.dt)
        lost = self._airborne_time > self.gains.contact_loss
        self._grounded = standing & (contacts | (self._grounded & ~lost))
        self._bearing_time = np.where(self._grounded, self._bearing_time + self.dt, 0.0)
        probing = standing & ~self._grounded
        self._delay = np.where(probing, self._delay + self.dt, 0.0)
        deeper = np.minimum(self._probe + self.gains.probe_speed * self.dt, self.gains.probe_depth)
        self._probe = np.where(probing, deeper, np.where(standing, self._probe, 0.0))

    def _loads(self, tick: int) -> FloatArray:
        """Share of a full load for each foot ``(4,)``, 0 for those in the air."""
        taken_up = np.minimum(self._bearing_time / self.gains.loading_time, 1.0)
        load = self.reference.load[tick]
        if self._awaited.any():
            # While the clock stands still, the load of the foot that is about to lift off goes
            # over to the one that has landed.
            standing = self.reference.standing
            leaving = standing[tick] & ~standing[min(tick + 1, len(standing) - 1)]
            load = np.where(leaving, 1.0 - taken_up[self._awaited].min(), 1.0)
        return np.asarray(self._grounded * np.maximum(np.minimum(load, taken_up), LEAST_LOAD))

    def _filtered(self, forces: FloatArray, contacts: BoolArray) -> FloatArray:
        """The wanted ``forces (4, 3)`` after a first-order filter ``(12,)``; 0 in the air."""
        before = forces if self._last_forces is None else self._last_forces
        filtered = forces + self._force_decay * (before - forces)
        filtered[~(contacts | self._grounded)] = 0.0
        self._last_forces = filtered
        return filtered.reshape(-1)

    def _feedback(self, tick: int, state: RobotState, rotation: FloatArray) -> FloatArray:
        """Force and torque of spring and damper on the body, in its own frame ``(6,)``."""
        ref, gains = self.reference, self.gains
        place = ref.position[tick] - state.q[:3]
        moving = not self._awaited.any()
        velocity = moving * ref.linear[tick] - rotation @ state.v[:3]
        angle = rotation_vector(ref.rotation[tick] @ rotation.T)
        spin = moving * ref.angular[tick] - rotation @ state.v[3:6]
        out = np.empty(6)
        out[:3] = gains.body_damping * velocity + gains.body_stiffness * _shortened(
            place, gains.largest_error
        )
        out[3:] = gains.rotation_damping * spin + gains.rotation_stiffness * _shortened(
            angle, gains.largest_rotation
        )
        out[:3], out[3:] = out[:3] @ rotation, out[3:] @ rotation
        return out

    def _set_points(
        self, tick: int, position: FloatArray, rotation: FloatArray, feet: FloatArray
    ) -> FloatArray:
        """Joint angles ``(nj,)``: one Newton step of inverse kinematics from the plan's angles.

        The foot of a standing leg stays where it is, and its leg brings the body to the reference.
        The foot of a flying leg goes to its reference, from where the body is. A Newton step has an
        error of second order: about 0.1 mm for a displacement of 1 cm.
        """
        ref = self.reference
        target = ref.feet[tick].copy()
        target[:, 2] -= self._probe
        standing = (feet - ref.position[tick]) @ ref.rotation[tick]
        flying = (target - position) @ rotation
        grounded = self._grounded[:, None]
        wanted = np.where(grounded, standing, flying) - ref.feet_in_base[tick]
        for leg in np.flatnonzero(self._grounded & ~self._was_grounded):
            # At touch-down no set-point jumps: the difference fades. It leads a little below the
            # ground, so that the foot keeps touching it until it carries load.
            self._offset[leg] = self._correction[leg] - wanted[leg]
            self._offset[leg] -= self.gains.landing_depth * rotation[2]
        self._was_grounded = self._grounded
        self._offset *= self._blend_decay
        # A flying foot follows the body's errors slowly, so that joint velocities stay low.
        slowly = wanted + (self._correction - wanted) * self._blend_decay
        self._correction = np.where(grounded, wanted + self._offset, slowly)
        step = (ref.inverse[tick] @ self._correction[:, :, None])[:, :, 0]
        angles = ref.joints[tick].copy()
        angles[self._columns] += step
        return np.asarray(angles)


def _decay(dt: float, time_constant: float) -> float:
    """What is left of a difference after ``dt`` [s]; nothing where the time constant is zero."""
    return float(np.exp(-dt / max(time_constant, 1e-9)))


def rotation_of(quaternion: FloatArray) -> FloatArray:
    """Rotation matrix ``(3, 3)`` of a unit quaternion xyzw.

    For one quaternion plain numbers are faster than arrays.
    """
    x, y, z, w = quaternion.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


SMALLEST_SINE = 1e-9
"""Below this sine of a rotation's angle the sine is the angle, to rounding."""


def rotation_vector(rotation: FloatArray) -> FloatArray:
    """Rotation vector ``(3,)`` [rad] of a rotation matrix, for angles below pi."""
    r = rotation
    axis = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    sine = float(np.sqrt(axis @ axis))
    if sine < SMALLEST_SINE:
        return axis
    angle = float(np.arctan2(sine, 0.5 * (r[0, 0] + r[1, 1] + r[2, 2] - 1.0)))
    return np.asarray(axis * (angle / sine))


def _shortened(vector: FloatArray, largest: float) -> FloatArray:
    """The ``vector``, shortened to the length ``largest`` where it is longer."""
    length = float(np.sqrt(vector @ vector))
    return vector if length <= largest else np.asarray(vector * (largest / length))
