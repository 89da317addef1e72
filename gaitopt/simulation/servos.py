"""The joint servos of a simulated robot, and a record of their torques and velocities.

A servo is a speed controller inside a position controller, as most are. The wanted speed is that
of the set-point plus a term in proportion to the error of the angle. The torque is in proportion to
the error of the speed, plus the torque that is fed forward. Both the wanted speed and the torque
are clipped to the joint's limits. The ground may still turn a joint faster, for instance when its
foot lands.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.control.gains import ControlGains
from gaitopt.control.tracking import Command
from gaitopt.conventions import FloatArray
from gaitopt.robots.quadruped import Quadruped
from gaitopt.simulation.model import SimModel, import_mujoco
from gaitopt.simulation.settings import SimulationSettings


class Servos:
    """The servos of one simulation, and their record over every step of the physics.

    Attributes:
        peak_torques, peak_rates: the largest of every joint so far ``(nj,)`` [N m], [rad/s].
        energy: mechanical work done so far [J]; energy from braking is not recovered.
    """

    def __init__(
        self, sim: SimModel, robot: Quadruped, gains: ControlGains, settings: SimulationSettings
    ) -> None:
        self._step = import_mujoco().mj_step
        self._sim, self._timestep = sim, settings.timestep
        self._stiffness, self._damping = gains.joint_stiffness, gains.joint_damping
        self._speed_torques = speed_torques(robot.velocity_limits, gains, settings)
        self.start_record()

    def start_record(self) -> None:
        """Start the record anew."""
        self.peak_torques = np.zeros(len(self._sim.ctrl))
        self.peak_rates = np.zeros(len(self._sim.ctrl))
        self.energy = 0.0

    def drive(self, data: Any, command: Command, steps: int) -> None:
        """Step the physics ``steps`` times under a command.

        The torque of MuJoCo's actuators is ``kp (ctrl - q) - kd dq``, whose last term is implicit
        in time, which keeps stiff servos stable. Everything else enters through ``ctrl``.
        """
        sim, qpos, qvel, ctrl = self._sim, data.qpos, data.qvel, data.ctrl
        wanted = self._stiffness * command.angles + self._damping * command.rates
        largest = self._speed_torques
        for _ in range(steps):
            q = qpos[sim.qpos]
            torque = np.minimum(np.maximum(wanted - self._stiffness * q, -largest), largest)
            ctrl[sim.ctrl] = q + (torque + command.torque) / self._stiffness
            self._step(sim.model, data)
            applied, rate = data.actuator_force[sim.ctrl], qvel[sim.qvel]
            np.fmax(self.peak_torques, np.abs(applied), out=self.peak_torques)
            np.fmax(self.peak_rates, np.abs(rate), out=self.peak_rates)
            self.energy += float(np.maximum(applied * rate, 0.0).sum()) * self._timestep


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
