"""The joint servos of a simulated robot: what they make of a command, and what they went through.

A servo is a speed loop inside a position loop, as most are. It tells its motor a speed, the
set-point's own and more in proportion to the error of the angle, and pulls in proportion to what
is missing of that speed; what is fed forward adds to it. Neither the speed that it tells nor its
torque goes beyond the joint's limits. What the ground does to a joint is beyond the servo: a foot
that lands may still turn a joint faster.
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
        peak_torques, peak_rates: the largest so far of every joint ``(nj,)`` [N m], [rad/s].
        energy: mechanical work done so far, braking not given back [J].
    """

    def __init__(
        self, sim: SimModel, robot: Quadruped, gains: ControlGains, settings: SimulationSettings
    ) -> None:
        self._step = import_mujoco().mj_step
        self._sim, self._timestep = sim, settings.timestep
        self._stiffness, self._damping = gains.joint_stiffness, gains.joint_damping
        self._most = largest_pulls(robot.velocity_limits, gains, settings)
        self.forget()

    def forget(self) -> None:
        """Start the record anew."""
        self.peak_torques = np.zeros(len(self._sim.ctrl))
        self.peak_rates = np.zeros(len(self._sim.ctrl))
        self.energy = 0.0

    def drive(self, data: Any, command: Command, steps: int) -> None:
        """Step the physics ``steps`` times under a command.

        MuJoCo's actuators pull with ``kp (ctrl - q) - kd dq``, the last implicitly in time, which
        keeps stiff servos stable; so all else comes in through ``ctrl``.
        """
        sim, qpos, qvel, ctrl = self._sim, data.qpos, data.qvel, data.ctrl
        aim = self._stiffness * command.angles + self._damping * command.rates
        for _ in range(steps):
            q = qpos[sim.qpos]
            pull = np.minimum(np.maximum(aim - self._stiffness * q, -self._most), self._most)
            ctrl[sim.ctrl] = q + (pull + command.torque) / self._stiffness
            self._step(sim.model, data)
            torque, rate = data.actuator_force[sim.ctrl], qvel[sim.qvel]
            np.fmax(self.peak_torques, np.abs(torque), out=self.peak_torques)
            np.fmax(self.peak_rates, np.abs(rate), out=self.peak_rates)
            self.energy += float(np.maximum(torque * rate, 0.0).sum()) * self._timestep


def largest_pulls(
    velocity_limits: FloatArray, gains: ControlGains, settings: SimulationSettings
) -> FloatArray:
    """The pull at which a servo tells its motor the joint's velocity limit ``(nj,)`` [N m].

    Without bound for joints without a limit, and for servos without a speed loop.
    """
    pulls = np.full(velocity_limits.shape, np.inf)
    if settings.rate_limits and gains.joint_damping > 0.0:
        known = np.isfinite(velocity_limits) & (velocity_limits > 0.0)
        pulls[known] = gains.joint_damping * velocity_limits[known]
    return pulls
