"""The joint servos of a simulated robot, and a record of their torques and velocities.

A servo is a speed controller inside a position controller, as most are. The wanted speed is that
of the set-point plus a term in proportion to the error of the angle. The torque is in proportion to
the error of the speed, plus the torque that is fed forward. Both the wanted speed and the torque
are clipped to the joint's limits, and where the torque of a motor falls with its speed to what is
left of it. Beyond its limit the speed is held with more gain, whether torque that is fed forward or
the ground turns the joint; the ground may still turn it faster, for instance when its foot lands.
Friction and damping of the joints are fed forward, as drives do that know their gears: without that
a joint whose speed is limited to little would stand still where it rubs, and one whose damping is
larger than the servo's would come late.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gaitopt.control.gains import ControlGains
from gaitopt.control.tracking import Command
from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.torque_limits import torque_lines
from gaitopt.robots.quadruped import Quadruped
from gaitopt.simulation.model import SimModel, import_mujoco
from gaitopt.simulation.settings import SimulationSettings

MOST_ROUNDS = 8
"""How often a step is done at most until it is known which joints are at their torque limits. One
round is enough where none is, two where the same joints stay there."""

CREEP = 0.05
"""Wanted speed from which on the whole friction of a joint is fed forward [rad/s]; below it, so
much less. Chosen: a twentieth of the speeds of slow joints."""
DRIVEN_SHARE, HOLDING = 1.1, 30.0
"""Share of a joint's velocity limit from which on its speed is held, and by how many times the
servo's damping for each rad/s beyond. Wanted speeds are clipped, but not the torque that is fed
forward for a load: light knees of wang2020 turned at 1.6 to 6 times their limits within two steps
of the physics, where a foot had left the ground by some micrometres, and at 1.45 times where the
ground threw a foot up that lifted off. Drives with a speed limit do not let that happen."""
FREE_ROUNDS = 2
"""From this round on joints stay at their limits, so that joints do not take turns."""


class Servos:
    """The servos of one simulation, and their record over every step of the physics.

    Attributes:
        energy: mechanical work done so far [J]; energy from braking is not recovered.
        applied: torques of the last step ``(nj,)`` [N m].
    """

    def __init__(
        self, sim: SimModel, robot: Quadruped, gains: ControlGains, settings: SimulationSettings
    ) -> None:
        self._step = import_mujoco().mj_step
        self._sim, self._timestep = sim, settings.timestep
        self._stiffness, self._damping = gains.joint_stiffness, gains.joint_damping
        self._largest = speed_torques(robot.velocity_limits, gains, settings)
        self._holding = HOLDING * gains.joint_damping
        bounded = np.isfinite(self._largest)
        self._fastest = np.where(bounded, DRIVEN_SHARE * np.array(robot.velocity_limits), np.inf)
        self._least = -self._largest
        self._angles, self._speeds, self._columns = map(_in_a_row, (sim.qpos, sim.qvel, sim.ctrl))
        self._copies = not all(isinstance(s, slice) for s in (self._angles, self._speeds))
        self._friction = np.array(sim.model.dof_frictionloss[sim.qvel])
        self._viscous = np.array(sim.model.dof_damping[sim.qvel])
        creep = CREEP * gains.joint_damping
        self._per_torque = 1.0 / creep if creep > 0.0 else 0.0
        self._rubs = bool(self._friction.any())
        # What MuJoCo takes for the motors' inertia, without and with what damping adds to it, and
        # whether the last step has changed it.
        self._inertia, self._bounded = sim.model.dof_armature, True
        self._motors = sim.motor_inertias
        unlimited = np.full(len(sim.ctrl), np.inf)
        self._efforts = np.array(robot.effort_limits) if settings.torque_limits else unlimited
        self._lines = torque_lines(robot, ForceLimits()) if settings.torque_limits else None
        self.applied = np.zeros(len(sim.ctrl))
        self.start_record()

    def start_record(self) -> None:
        """Start the record anew."""
        self._peaks = np.zeros((2, len(self._sim.ctrl)))
        self.energy = 0.0

    def drive(self, data: Any, command: Command, steps: int) -> None:
        """Step the physics ``steps`` times under a command."""
        angles, speeds = data.qpos[self._angles], data.qvel[self._speeds]
        moved = self._stiffness * self._timestep * command.rates
        wanted = self._stiffness * command.angles + self._damping * command.rates
        wanted += (0.5 - command.ahead / self._timestep) * moved
        known = command.torque + self._viscous * command.rates
        done, torque = np.empty((steps, 2, len(known))), np.empty(len(known))
        stiffness, least, largest = self._stiffness, self._least, self._largest
        for k in range(steps):
            # Views of MuJoCo's state follow it; other choices of joints are copies.
            if self._copies:
                angles = data.qpos[self._angles]
            np.multiply(angles, stiffness, out=torque)
            np.subtract(wanted, torque, out=torque)
            wanted += moved
            np.maximum(torque, least, out=torque)
            np.minimum(torque, largest, out=torque)
            if self._rubs:
                share = np.minimum(np.maximum(torque * self._per_torque, -1.0), 1.0)
                torque += known
                torque += self._friction * share
            else:
                torque += known
            done[k, 0] = self._advance(data, torque)
            done[k, 1] = data.qvel[self._speeds] if self._copies else speeds
        self.applied = done[-1, 0]
        np.fmax(self._peaks, np.fmax.reduce(np.abs(done)), out=self._peaks)
        for power in np.maximum(done[:, 0] * done[:, 1], 0.0).sum(axis=1).tolist():
            self.energy += power * self._timestep

    @property
    def peak_torques(self) -> FloatArray:
        """The largest torque of every joint so far ``(nj,)`` [N m]."""
        return np.array(self._peaks[0])

    @property
    def peak_rates(self) -> FloatArray:
        """The largest velocity of every joint so far ``(nj,)`` [rad/s]."""
        return np.array(self._peaks[1])

    def _advance(self, data: Any, torque: FloatArray) -> FloatArray:
        """One step of the physics under the torques ``torque - kd dq``, within their limits.

        The damping counts at the end of the step (it is implicit in time), which keeps stiff
        servos of light legs stable, and so do torques that fall with the speed. At the end of a
        step ``h`` the velocity is ``dq + h ddq``. So the step is that of a joint with the inertia
        ``h kd`` more, under the damping at its begin. MuJoCo's own damping would come to the same
        velocities, but for what touches: it finds contact forces without it, and they are too small
        where ``h kd`` is as large as the leg's inertia. A foot then sank for 12 ms and more where
        the ground should stop it within 8.

        It is only known after the step whether a torque is within its limit. Where it is not, the
        step is done again with the torque at its limit.

        Returns:
            The torques ``(nj,)`` [N m] that were applied.
        """
        before = _State(data.time, data.qpos.copy(), data.qvel.copy(), data.qacc_warmstart.copy())
        data.ctrl[self._columns] = torque - self._damping * data.qvel[self._speeds]
        if self._bounded:
            self._inertia[self._speeds] = self._motors + self._timestep * self._damping
            self._bounded = False
        self._step(self._sim.model, data)
        turned = data.qvel[self._speeds]
        asked = torque - self._damping * turned
        slow = (np.abs(turned) <= self._fastest).all()
        # Limits that fall with the speed are looked at one by one, and so is what is no number.
        if self._lines is None and slow and (np.abs(asked) <= self._efforts).all():
            return np.asarray(asked)
        return self._within_limits(data, torque, before)

    def _within_limits(self, data: Any, torque: FloatArray, before: _State) -> FloatArray:
        """The same for a step that was done once without limits, from the state ``before``."""
        limited = held = np.zeros(len(torque), dtype=np.bool_)
        bound = _Bound(np.zeros(len(torque)), np.zeros(len(torque)), limited)
        drive, damping = torque, np.full(len(torque), self._damping)
        for rounds in range(MOST_ROUNDS):
            if rounds:
                before.restore(data)
                slope = np.where(limited, bound.slope, damping)
                begun = np.where(limited, bound.torque, drive)
                data.ctrl[self._columns] = begun - slope * data.qvel[self._speeds]
                self._inertia[self._speeds] = self._motors + self._timestep * slope
                self._bounded = True
                self._step(self._sim.model, data)
            speeds = data.qvel[self._speeds]
            asked = drive - damping * speeds
            applied = np.where(limited, bound.torque - bound.slope * speeds, asked)
            low, high = self._limits(speeds)
            over = (asked > high) | (asked < low)
            falling = self._falling(over, asked, speeds, bound.falling)
            if rounds >= FREE_ROUNDS:
                over |= limited
            if (over != limited).any() or (falling != bound.falling).any():
                limited, bound = over, self._bound(np.clip(asked, low, high), asked, falling)
                continue
            fast = np.abs(speeds) > self._fastest
            if (fast == held).all():
                break
            # What is to be held now asks for another torque, which may be within its limits.
            limited = limited & ~(fast & ~held)
            held, beyond = fast, np.where(fast, self._fastest, 0.0)
            drive = torque + self._holding * np.copysign(beyond, speeds)
            damping = self._damping + np.where(held, self._holding, 0.0)
        return np.asarray(applied)

    def _limits(self, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Least and largest torques at speeds ``(nj,)``, each ``(nj,)`` [N m]."""
        if self._lines is None:
            return -self._efforts, self._efforts
        known = np.isfinite(self._efforts)
        driving = np.where(known, self._efforts, 0.0) * self._lines.left(speeds)
        driving = np.where(known, driving, np.inf)
        return (-np.where(speeds < 0.0, driving, self._efforts),
                np.where(speeds > 0.0, driving, self._efforts))  # fmt: skip

    def _falling(
        self, over: BoolArray, asked: FloatArray, speeds: FloatArray, before: BoolArray
    ) -> BoolArray:
        """Which joints are at a limit that falls with their speed ``(nj,)``.

        Args:
            over: which joints would exceed a limit ``(nj,)``.
            asked, speeds: their torques and speeds ``(nj,)``.
            before: which joints were at such a limit: those that are still faster than their
                motors without load have no torque.
        """
        if self._lines is None:
            return before
        driven = np.sign(asked) * speeds
        stopped = before & (driven >= self._lines.no_load)
        return np.asarray(over & (driven > self._lines.knee) & ~stopped)

    def _bound(self, torque: FloatArray, asked: FloatArray, falling: BoolArray) -> _Bound:
        """What joints at their limits get; the others are passed over."""
        slope = np.zeros_like(torque)
        if self._lines is not None and falling.any():
            slope[falling] = self._efforts[falling] / self._lines.span[falling]
            whole = np.sign(asked[falling]) * slope[falling] * self._lines.no_load[falling]
            torque[falling] = whole
        return _Bound(torque, slope, falling)


class _State(NamedTuple):
    """MuJoCo's state before a step: time, positions, velocities, and where its solver begins."""

    time: float
    qpos: FloatArray
    qvel: FloatArray
    warmstart: FloatArray

    def restore(self, data: Any) -> None:
        """Go back to it."""
        data.time, data.qpos[:], data.qvel[:], data.qacc_warmstart[:] = self


class _Bound(NamedTuple):
    """Torques ``torque - slope * speed`` of joints at their limits, each ``(nj,)``.

    ``falling`` are the joints whose limits fall with the speed.
    """

    torque: FloatArray
    slope: FloatArray
    falling: BoolArray


def _in_a_row(places: np.ndarray) -> slice | np.ndarray:
    """Places as a slice, where they follow one another: such a part of an array is no copy."""
    first = int(places[0])
    if (places == first + np.arange(len(places))).all():
        return slice(first, first + len(places))
    return places


def speed_torques(
    velocity_limits: FloatArray, gains: ControlGains, settings: SimulationSettings
) -> FloatArray:
    """``kp (angles - q) + kd rates`` where the wanted speed is the limit ``(nj,)`` [N m].

    It is infinite for joints without a limit, and for servos without a speed controller.

    Args:
        velocity_limits: of the joints ``(nj,)`` [rad/s]; ``inf`` for joints without.
        gains: of the servos.
        settings: whether servos keep the limits at all.
    """
    if not settings.rate_limits or gains.joint_damping == 0.0:
        return np.full(velocity_limits.shape, np.inf)
    return np.asarray(gains.joint_damping * velocity_limits)
