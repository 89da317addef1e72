"""The tracking controller: joint torques and servo set-points that follow a plan.

Body: a wrench of weight and spring-damper on the body's error, made up by the feet that stand.
Joints: the torques of these contact forces and of the legs' own weight, fed forward; and PD around
the reference's inverse kinematics, taken relative to where the body and the standing feet really
are. It knows nothing of any simulator.
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
    """What a robot's sensors and estimator say.

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

    The servo's torque is ``torque + kp (angles - q) + kd (rates - dq)`` with the gains'
    ``joint_stiffness`` and ``joint_damping``. Put the other way round: it is told to move at the
    speed ``rates + kp / kd (angles - q)``. A servo that has a speed limit holds that within it.

    Attributes:
        torque: fed forward ``(nj,)`` [N m].
        angles, rates: set-points ``(nj,)`` [rad], [rad/s].
        share: the contact forces behind it.
    """

    torque: FloatArray
    angles: FloatArray
    rates: FloatArray
    share: ForceShare


class TrackingController:
    """Follows one plan; call :meth:`command` every :attr:`dt` seconds, in order of time.

    Attributes:
        waited: how long feet were waited for, beyond the pauses that the reference has [s].

    Args:
        plan: the motion. Its robot is the model that the controller believes in.
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
        self._may_wait = plan.settings.static
        self._model: Any = robot.model
        self._data: Any = robot.model.createData()
        self._frames = [robot.model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
        self._columns = robot.leg_joint_columns.reshape(len(LEGS), -1)
        self._radius = robot.foot_radius
        self._still = np.zeros(robot.model.nv)
        self._decay = float(np.exp(-dt / max(self.gains.blend_time, 1e-9)))
        self._lingering = float(np.exp(-dt / max(self.gains.force_smoothing, 1e-9)))
        self._forces = ForceDistribution(
            robot.mass * GRAVITY, 0.5 * max(robot.stance_size), self.gains.friction
        )
        self.reset()

    def reset(self) -> None:
        """Start anew: all feet that the plan has standing at the start do stand."""
        self._grounded = np.array(self.reference.standing[0])
        self._absent = np.zeros(len(LEGS))
        self._probe = np.zeros(len(LEGS))
        self._awaited = np.zeros(len(LEGS), dtype=np.bool_)
        self._late = np.zeros(len(LEGS))
        # For how long each foot has borne load; those that stand at the start, for ever.
        self._firm = np.where(self._grounded, np.inf, 0.0)
        # A robot that is held up by its motion cannot stop in the middle of it.
        self._patience = self.gains.patience if self._may_wait else 0.0
        self.waited = 0.0
        self._ruled = self._grounded
        self._correction = np.zeros((len(LEGS), 3))
        self._offset = np.zeros((len(LEGS), 3))
        self._forces.reset()
        self._pressed: FloatArray | None = None

    def plan_time(self, time: float) -> float:
        """Which instant of the plan is followed at ``time`` [s]."""
        return float(self.reference.clock.plan_time(time - self.waited))

    def command(self, time: float, state: RobotState) -> Command:
        """What the servos are to do from ``time`` [s] on, given the measured ``state``."""
        tick = self._wait(self.reference.tick(time - self.waited))
        rotation = rotation_of(state.q[3:7])
        feet, grasp, needed = self._dynamics(tick, state.q)
        self._watch(tick, state.contacts)
        waiting = self._awaited.any()
        share = self._forces.share(
            grasp[:, :6].T,
            needed[:6] + self._feedback(tick, state, rotation),
            self._loads(tick),
        )
        torque = needed[6:] - self._pressing(share.forces, state.contacts) @ grasp[:, 6:]
        return Command(
            torque=torque,
            angles=self._angles(tick, state.q[:3], rotation, feet),
            rates=0.0 * self.reference.rates[tick] if waiting else self.reference.rates[tick],
            share=share,
        )

    def _wait(self, tick: int) -> int:
        """The tick to follow: the plan waits for feet that should stand and have found no ground.

        No foot lifts off before, and the body does not go far. Where a foot lands at the very
        instant at which another leaves, the walk would otherwise depend on a ground that is
        exactly where the plan believes it to be.
        """
        standing = self.reference.standing
        after = standing[min(tick + 1, len(standing) - 1)]
        if (standing[tick] & ~after).any():
            missing = after & (self._firm < self.gains.firm_time)
        else:
            missing = after & (self._late > self.gains.grace)
        if self._patience <= 0.0 or not missing.any():
            self._awaited = np.zeros(len(LEGS), dtype=np.bool_)
            if not missing.any() and self._may_wait:
                self._patience = self.gains.patience
            return tick
        self._awaited = missing
        self._patience -= self.dt
        self.waited += self.dt
        return tick

    def _dynamics(self, tick: int, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Feet ``(4, 3)``, Jacobian of their contact points ``(12, nv)``, inverse dynamics.

        The last ``(nv,)`` are the forces that carry the weight and the reference's accelerations.
        """
        import pinocchio as pin

        model, data = self._model, self._data
        acceleration = self._still if self._awaited.any() else self.reference.acceleration[tick]
        needed = np.array(pin.rnea(model, data, q, self._still, acceleration))
        pin.computeJointJacobians(model, data, q)
        feet, grasp = np.empty((4, 3)), np.empty((12, model.nv))
        for i, frame in enumerate(self._frames):
            feet[i] = pin.updateFramePlacement(model, data, frame).translation
            j = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            # The ground touches the ball's lowest point: v - r (w x z).
            grasp[3 * i : 3 * i + 3] = j[:3]
            grasp[3 * i] -= self._radius * j[4]
            grasp[3 * i + 1] += self._radius * j[3]
        return feet, grasp, needed

    def _watch(self, tick: int, contacts: BoolArray) -> None:
        """Which feet bear load: those that should stand, and have found ground."""
        standing = self.reference.standing[tick] | self._awaited
        self._absent = np.where(contacts, 0.0, self._absent + self.dt)
        lost = self._absent > self.gains.contact_loss
        self._grounded = standing & (contacts | (self._grounded & ~lost))
        self._firm = np.where(self._grounded, self._firm + self.dt, 0.0)
        probing = standing & ~self._grounded
        self._late = np.where(standing & ~self._grounded, self._late + self.dt, 0.0)
        deeper = np.minimum(self._probe + self.gains.probe_speed * self.dt, self.gains.probe_depth)
        self._probe = np.where(probing, deeper, np.where(standing, self._probe, 0.0))

    def _loads(self, tick: int) -> FloatArray:
        """Share of a full load for each foot ``(4,)``, 0 for those in the air."""
        borne = np.minimum(self._firm / self.gains.firm_time, 1.0)
        load = self.reference.load[tick]
        if self._awaited.any():
            # While the clock stands still, the foot that is about to leave hands its load over.
            standing = self.reference.standing
            leaving = standing[tick] & ~standing[min(tick + 1, len(standing) - 1)]
            load = np.where(leaving, 1.0 - borne[self._awaited].min(), 1.0)
        return np.asarray(self._grounded * np.maximum(np.minimum(load, borne), LEAST_LOAD))

    def _pressing(self, forces: FloatArray, contacts: BoolArray) -> FloatArray:
        """The wanted ``forces (4, 3)`` as they come about ``(12,)``; at once none in the air."""
        before = forces if self._pressed is None else self._pressed
        pressed = forces + self._lingering * (before - forces)
        pressed[~(contacts | self._grounded)] = 0.0
        self._pressed = pressed
        return pressed.reshape(-1)

    def _feedback(self, tick: int, state: RobotState, rotation: FloatArray) -> FloatArray:
        """Spring-damper wrench on the body, in its own frame ``(6,)``."""
        ref, gains = self.reference, self.gains
        place = ref.position[tick] - state.q[:3]
        moving = not self._awaited.any()
        speed = moving * ref.linear[tick] - rotation @ state.v[:3]
        turn = _turn(ref.rotation[tick] @ rotation.T)
        spin = moving * ref.angular[tick] - rotation @ state.v[3:6]
        out = np.empty(6)
        out[:3] = gains.body_damping * speed + gains.body_stiffness * _capped(
            place, gains.largest_error
        )
        out[3:] = gains.turn_damping * spin + gains.turn_stiffness * _capped(
            turn, gains.largest_turn
        )
        out[:3], out[3:] = out[:3] @ rotation, out[3:] @ rotation
        return out

    def _angles(
        self, tick: int, position: FloatArray, rotation: FloatArray, feet: FloatArray
    ) -> FloatArray:
        """Set-points ``(nj,)``: one Newton step of inverse kinematics from the plan's angles.

        A foot that stands is left where it is, and its leg brings the body to the reference; a
        foot in the air goes to its reference from where the body is. The step's error is of second
        order: some 0.1 mm for 1 cm.
        """
        ref = self.reference
        aim = ref.feet[tick].copy()
        aim[:, 2] -= self._probe
        standing = (feet - ref.position[tick]) @ ref.rotation[tick]
        flying = (aim - position) @ rotation
        rule = self._grounded[:, None]
        wanted = np.where(rule, standing, flying) - ref.feet_in_base[tick]
        for leg in np.flatnonzero(self._grounded & ~self._ruled):
            # No set-point jumps at touch-down: the difference fades. A little below the ground
            # the foot keeps in touch with it until its load does so.
            self._offset[leg] = self._correction[leg] - wanted[leg]
            self._offset[leg] -= self.gains.press * rotation[2]
        self._ruled = self._grounded
        self._offset *= self._decay
        # A flying foot has time: it follows the body's wobbling slowly, joint velocities stay low.
        slowly = wanted + (self._correction - wanted) * self._decay
        self._correction = np.where(rule, wanted + self._offset, slowly)
        step = (ref.inverse[tick] @ self._correction[:, :, None])[:, :, 0]
        angles = ref.joints[tick].copy()
        angles[self._columns] += step
        return np.asarray(angles)


def rotation_of(quaternion: FloatArray) -> FloatArray:
    """Rotation matrix ``(3, 3)`` of a unit quaternion xyzw; plain numbers are quickest here."""
    x, y, z, w = quaternion.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _turn(rotation: FloatArray) -> FloatArray:
    """Rotation vector ``(3,)`` [rad] of a rotation matrix, for turns below half a turn."""
    r = rotation
    axis = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    sine = float(np.sqrt(axis @ axis))
    if sine < 1e-9:
        return axis
    angle = float(np.arctan2(sine, 0.5 * (r[0, 0] + r[1, 1] + r[2, 2] - 1.0)))
    return np.asarray(axis * (angle / sine))


def _capped(vector: FloatArray, largest: float) -> FloatArray:
    length = float(np.sqrt(vector @ vector))
    return vector if length <= largest else np.asarray(vector * (largest / length))
