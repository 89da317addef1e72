"""A plan in physics: MuJoCo, with the tracking controller in the loop.

The physics knows what the plan does not: inertia, contact, friction, servos that give, feet that
roll. Only feet touch things: legs and body pass through columns, ground and one another (that no
two links meet is the certificate's to show). The same plan, settings and machine give the same
result, bit for bit.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from gaitopt.control.gains import ControlGains
from gaitopt.control.tracking import RobotState, TrackingController, rotation_of
from gaitopt.conventions import LEGS
from gaitopt.plan.plan import Plan
from gaitopt.simulation.model import SimModel, build_sim_model, import_mujoco, to_mujoco
from gaitopt.simulation.result import SimulationRecord, SimulationResult, report
from gaitopt.simulation.servos import Servos
from gaitopt.simulation.settings import SimulationSettings


def simulate(
    plan: Plan,
    settings: SimulationSettings | None = None,
    gains: ControlGains | None = None,
) -> SimulationResult:
    """Let a plan's robot walk it in physics.

    Args:
        plan: the motion.
        settings: the world and its disturbances.
        gains: of controller and servos; in proportion to the robot's weight and size by default.

    Returns:
        What became of it. A robot that falls, and a simulation that diverges, are results, not
        errors.

    Raises:
        MissingPackageError: MuJoCo is not installed.
        RobotError: MuJoCo cannot simulate the plan's URDF.
        InputError: a setting does not fit the plan, or the robot's legs have two joints.
    """
    mujoco = import_mujoco()
    settings = settings or SimulationSettings()
    gains = gains or ControlGains.for_robot(plan.robot)
    sim = build_sim_model(plan.robot, plan.footholds, gains, settings)
    controller = TrackingController(plan, gains, settings.control_interval)
    record = _Run(mujoco, plan, sim, controller, settings).run()
    return report(plan, record, sim.columns, gains, settings)


@dataclass(eq=False)
class _Run:
    """One simulation: MuJoCo's state, the sensors' queue, and the record."""

    mujoco: Any
    plan: Plan
    sim: SimModel
    controller: TrackingController
    settings: SimulationSettings
    samples: list[tuple[Any, ...]] = field(default_factory=list)

    def run(self) -> SimulationRecord:
        """Step until the plan's end, or a fall; the number of steps has a bound from the start."""
        begin = (time.perf_counter(), time.thread_time())
        settings, data = self.settings, self._start()
        interval = settings.control_interval
        end = self.plan.duration + settings.settle
        patience = self.controller.gains.patience * len(self.plan.swings)
        paused = self.controller.reference.clock.paused
        count = int(np.ceil((end + paused + patience) / interval)) + 1
        stride = max(round(settings.record_every / interval), 1)
        delay = int(np.ceil(settings.sensing_delay / interval - 1e-9))
        sensed: deque[RobotState] = deque(maxlen=delay + 1)
        status = "finished"
        for tick in range(count + 1):
            clock = self.controller.plan_time(tick * interval)
            state, beneath = self._sense(data)
            status = self._verdict(tick * interval, state) or status
            last = clock >= end - 1e-9 or tick == count or status != "finished"
            if tick % stride == 0 or last:
                self.samples.append(
                    (tick * interval, clock, state.q, state.v, state.contacts, beneath)
                )
            if last:
                break
            sensed.append(state)
            self._push(data, clock)
            command = self.controller.command(tick * interval, sensed[0])
            self._servos.drive(data, command, settings.control_every)
        spent = (time.perf_counter() - begin[0], time.thread_time() - begin[1])
        return self._record(status, spent)

    def _start(self) -> Any:
        """The plan's first posture, once the feet have settled into the ground."""
        data = self.mujoco.MjData(self.sim.model)
        data.qpos[:] = to_mujoco(self.sim, self.plan.at([0.0]).q[0])
        self.mujoco.mj_forward(self.sim.model, data)
        interval = self.settings.control_interval
        ticks = int(np.ceil(max(self.settings.stand, self.controller.reference.before) / interval))
        for tick in range(-ticks, 0):
            state, _ = self._sense(data)
            if not np.isfinite(state.q).all():
                break
            # The reference gets under way a little before the plan: it has no jumps.
            command = self.controller.command(tick * interval, state)
            self._servos.drive(data, command, self.settings.control_every)
        self._servos.forget()
        return data

    @cached_property
    def _servos(self) -> Servos:
        return Servos(self.sim, self.plan.robot, self.controller.gains, self.settings)

    @cached_property
    def _lost(self) -> float:
        """How far from the plan a body is lost [m]."""
        reference = self.controller.reference
        height = float(reference.position[0, 2] - reference.feet[0, :, 2].mean())
        return self.settings.fall_error * max(height, 0.05)

    def _sense(self, data: Any) -> tuple[RobotState, np.ndarray]:
        """The true state in Pinocchio's order, and the shape under each foot."""
        sim = self.sim
        qpos, qvel = data.qpos, data.qvel
        q, v = np.empty(7 + len(sim.qpos)), np.empty(6 + len(sim.qvel))
        q[:3], q[3:6], q[6], q[7:] = qpos[:3], qpos[4:7], qpos[3], qpos[sim.qpos]
        # MuJoCo gives the velocity of the base's origin in the world's axes. (Its xmat, geom_xpos
        # and contacts are those before the last step; only for contacts that is good enough.)
        v[:3] = qvel[:3] @ rotation_of(q[3:7])
        v[3:6], v[6:] = qvel[3:6], qvel[sim.qvel]
        beneath, deepest = np.full(len(LEGS), -1), [0.0] * len(LEGS)
        if data.ncon:
            pairs, gaps = data.contact.geom.tolist(), data.contact.dist.tolist()
            for (a, b), gap in zip(pairs, gaps, strict=True):
                foot, other = (a, b) if a in sim.feet else (b, a)
                leg = sim.feet.index(foot)
                # A foot may touch two columns at once; it stands on the one it presses most.
                if gap <= deepest[leg]:
                    beneath[leg], deepest[leg] = other, gap
        return RobotState(q, v, beneath >= 0), beneath

    def _verdict(self, time: float, state: RobotState) -> str:
        """``"fell"``, ``"diverged"``, or nothing."""
        reference = self.controller.reference
        tick = reference.tick(time - self.controller.waited)
        if not (np.isfinite(state.q).all() and np.abs(state.v).max() < 1e3):
            return "diverged"
        lean = float(rotation_of(state.q[3:7])[:, 2] @ reference.rotation[tick, :, 2])
        place = state.q[:3] - reference.position[tick]
        if lean < np.cos(self.settings.fall_tilt) or np.sqrt(place @ place) > self._lost:
            return "fell"
        return ""

    def _push(self, data: Any, clock: float) -> None:
        if self.settings.pushes:
            force = np.zeros(3)
            for push in self.settings.pushes:
                if push.time <= clock < push.time + push.duration:
                    force += push.force
            data.xfrc_applied[self.sim.base, :3] = force

    def _record(self, status: str, spent: tuple[float, float]) -> SimulationRecord:
        t, clock, q, v, touching, beneath = zip(*self.samples, strict=True)
        q_all, v_all = np.array(q), np.array(v)
        # A diverged state is no posture; the last good one stands for it.
        good = np.isfinite(q_all).all(axis=1) & np.isfinite(v_all).all(axis=1)
        keep = good if good.any() else np.ones(len(t), dtype=bool)
        return SimulationRecord(
            t=np.array(t, dtype=np.float64)[keep],
            clock=np.array(clock, dtype=np.float64)[keep],
            q=q_all[keep],
            v=v_all[keep],
            touching=np.array(touching)[keep],
            beneath=np.array(beneath)[keep],
            peak_torques=self._servos.peak_torques,
            peak_rates=self._servos.peak_rates,
            energy=self._servos.energy,
            status=status,
            wall_time=spent[0],
            cpu_time=spent[1],
        )
