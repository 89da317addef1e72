"""A plan in physics: MuJoCo with the tracking controller.

The simulation has what a plan leaves out: inertia, contact, friction, servos that give way, feet
that roll. Of a robot that was read from an MJCF its own shapes collide. Of others feet, limbs and
trunk collide with the ground, and not with one another (that no two links touch is checked by the
certificate). The same plan and settings give the same result on the same machine, bit for bit.
"""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from gaitopt.control.gains import ControlGains
from gaitopt.control.tracking import RobotState, TrackingController
from gaitopt.conventions import GRAVITY
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.over_obstacle import StrideSettings
from gaitopt.simulation.body_loop import called_in_time
from gaitopt.simulation.grip import Grip
from gaitopt.simulation.landings import Looks
from gaitopt.simulation.light_feet import time_to_give_way
from gaitopt.simulation.model import (
    SimModel,
    build_sim_model,
    import_mujoco,
    to_mujoco,
    velocity_to_mujoco,
)
from gaitopt.simulation.pressed import press_in
from gaitopt.simulation.report import SimulationRecord, report
from gaitopt.simulation.result import SimulationResult, SimulationStatus
from gaitopt.simulation.servos import Servos
from gaitopt.simulation.settings import SimulationSettings
from gaitopt.simulation.shapes import LEAST_BALL
from gaitopt.simulation.touching import LEAST_SHARE, Touching


def simulate(
    plan: Plan,
    settings: SimulationSettings | None = None,
    gains: ControlGains | None = None,
) -> SimulationResult:
    """Simulate a plan's robot walking it.

    Args:
        plan: the motion.
        settings: of the physics, with disturbances.
        gains: of controller and servos; :meth:`ControlGains.for_plan` by default.

    Returns:
        The result. A robot that falls is a result, and no error; so is a simulation that diverges.

    Raises:
        MissingPackageError: MuJoCo is not installed.
        RobotError: MuJoCo cannot simulate the plan's URDF.
        InputError: an argument is something else, a setting does not fit the plan, or the robot has
            no mass.
        FootholdsError: columns of different heights overlap, and a foot on the lower one would
            touch the higher one.
        GroundError: the footholds' height map is nowhere near them.
    """
    check_kind("plan", plan, Plan)
    plan.robot.require_masses()
    settings = SimulationSettings() if settings is None else settings
    gains = ControlGains.for_plan(plan) if gains is None else gains
    check_kind("settings", settings, SimulationSettings)
    check_kind("gains", gains, ControlGains)
    if not plan.robot.foot_radius > 0.0:
        # Feet are points, so nobody knows where the legs end, and shins would stand in the ground.
        settings = replace(settings, limbs=False)
    mujoco = import_mujoco()
    physics = settings.for_reach(max(leg.reach for leg in plan.robot.legs.values()))
    physics = physics.for_feet(time_to_give_way(plan.robot))
    if plan.footholds.ground is not None:
        physics = physics.on_height_map()
    physics = called_in_time(physics, plan.robot, gains)
    asked = plan.settings
    obstacles = asked.obstacles if isinstance(asked, StrideSettings) else ()
    sim = build_sim_model(plan.robot, plan.footholds, physics, obstacles)
    controller = TrackingController(plan, gains, physics.control_interval)
    record = _Run(mujoco, plan, sim, controller, physics).run()
    return report(plan, record, sim.columns, gains, settings)


LARGEST_SPEED = 1e3
"""A simulation with a faster base or joint has diverged [m/s, rad/s]."""
LEAST_HEIGHT = 0.05
"""Least height of the base above the feet that a body's largest error is measured by [m]."""
ROUNDING = 1e-9
"""Rounding of times, and of numbers of control intervals [s, 1]."""


@dataclass(eq=False)
class _Run:
    """One simulation: MuJoCo's state, the delayed measurements, and the record."""

    mujoco: Any
    plan: Plan
    sim: SimModel
    controller: TrackingController
    settings: SimulationSettings
    samples: list[tuple[Any, ...]] = field(default_factory=list)
    looks: list[tuple[Any, ...]] = field(default_factory=list)

    def run(self) -> SimulationRecord:
        """Step until the plan's end, or a fall.

        The controller waits for a limited time only, so the number of steps is known to be finite.
        """
        begin = (time.perf_counter(), time.thread_time())
        settings, data = self.settings, self._start()
        interval = settings.control_interval
        end = self.plan.duration + settings.watch_time
        longest_waits = self.controller.gains.longest_wait * len(self.plan.swings)
        paused = self.controller.reference.clock.paused
        count = int(np.ceil((end + paused + longest_waits) / interval)) + 1
        stride = max(round(settings.record_every / interval), 1)
        delay = int(np.ceil(settings.sensing_delay / interval - ROUNDING))
        sensed: deque[RobotState] = deque(maxlen=delay + 1)
        status = SimulationStatus.FINISHED
        for tick in range(count + 1):
            clock = self.controller.plan_time(tick * interval)
            state, beneath = self._sense(data)
            status = self._status(tick * interval, state, data)
            finished = status is SimulationStatus.FINISHED
            last = clock >= end - ROUNDING or tick == count or not finished
            self.looks.append((tick * interval, clock, state.q, beneath))
            if tick % stride == 0 or last:
                self.samples.append(
                    (tick * interval, clock, state.q, state.v, state.contacts, beneath,
                     self._servos.applied, self._touching.forces(data))
                )  # fmt: skip
            if last:
                break
            sensed.append(state)
            self._push(data, clock)
            self._grip.stand_on(clock)
            command = self.controller.command(tick * interval, sensed[0])
            self._servos.drive(data, command, settings.control_every)
        spent = (time.perf_counter() - begin[0], time.thread_time() - begin[1])
        return self._record(status, spent)

    def _start(self) -> Any:
        """MuJoCo's state in the plan's first posture, after the feet have come to rest.

        A plan that begins in motion begins so in physics, too.
        """
        self._grip.stand_on(0.0)
        data = self.mujoco.MjData(self.sim.model)
        first = self.plan.at([0.0])
        data.qpos[:] = to_mujoco(self.sim, first.q[0])
        if self.plan.begins_moving:
            press_in(self.sim, self._touching, data, self._first_loads())
            pressed = np.append(data.qpos[4:7], data.qpos[3])
            data.qvel[:] = velocity_to_mujoco(self.sim, pressed, first.v[0])
            self.mujoco.mj_forward(self.sim.model, data)
            self._servos.start_record()
            return data
        self.mujoco.mj_forward(self.sim.model, data)
        interval = self.settings.control_interval
        ticks = int(
            np.ceil(max(self.settings.stand_time, self.controller.reference.before) / interval)
        )
        for tick in range(-ticks, 0):
            state, _ = self._sense(data)
            if not np.isfinite(state.q).all():
                break
            # The reference is smoothed, so it begins to move a little before the plan.
            command = self.controller.command(tick * interval, state)
            self._servos.drive(data, command, self.settings.control_every)
        self._servos.start_record()
        return data

    def _first_loads(self) -> np.ndarray:
        """Normal forces on the feet at the begin, as they are planned ``(4,)`` [N]."""
        reference = self.controller.reference
        tick = reference.tick(0.0)
        return np.asarray((reference.forces[tick] * reference.normals[tick]).sum(axis=-1))

    @cached_property
    def _unstable(self) -> list[int]:
        """Numbers of MuJoCo's warnings after which it begins anew, or leaves out all torques.

        After these its state is finite again, and says nothing.
        """
        kinds = self.mujoco.mjtWarning
        return [
            int(getattr(kinds, f"mjWARN_BAD{what}")) for what in ("QPOS", "QVEL", "QACC", "CTRL")
        ]

    @cached_property
    def _servos(self) -> Servos:
        return Servos(self.sim, self.plan.robot, self.controller.gains, self.settings)

    @cached_property
    def _grip(self) -> Grip:
        return Grip(self.sim, self.plan, self.settings)

    @cached_property
    def _touching(self) -> Touching:
        return Touching(self.sim, self.plan.robot.foot_radius or LEAST_BALL)

    @cached_property
    def _least_load(self) -> float:
        """Normal force from which on a foot bears load, to the controller [N]."""
        return LEAST_SHARE * self.plan.robot.mass * GRAVITY

    @cached_property
    def _largest_error(self) -> float:
        """How far the body may be from the plan before it counts as fallen [m]."""
        reference = self.controller.reference
        height = float(reference.position[0, 2] - reference.feet[0, :, 2].mean())
        return self.settings.fall_error * max(height, LEAST_HEIGHT)

    def _sense(self, data: Any) -> tuple[RobotState, np.ndarray]:
        """The true state in Pinocchio's order, and the id of the shape under each foot ``(4,)``.

        Feet bear load from :data:`LEAST_SHARE` of the weight on.
        """
        sim = self.sim
        qpos, qvel = data.qpos, data.qvel
        q, v = np.empty(7 + len(sim.qpos)), np.empty(6 + len(sim.qvel))
        q[:3], q[3:6], q[6], q[7:] = qpos[:3], qpos[4:7], qpos[3], qpos[sim.qpos]
        v[3:6], v[6:] = qvel[3:6], qvel[sim.qvel]
        beneath, loads = self._touching.beneath(data)
        state = RobotState(q, v, beneath >= 0, loads >= self._least_load)
        # MuJoCo's velocity of the base's origin is in the world's axes. (Its xmat, geom_xpos and
        # contacts are those before the last step; that is good enough only for the contacts.)
        v[:3] = qvel[:3] @ state.rotation
        return state, beneath

    def _status(self, time: float, state: RobotState, data: Any) -> SimulationStatus:
        """Whether the robot is still on its feet."""
        reference = self.controller.reference
        tick = reference.tick(time - self.controller.waited)
        if not (np.isfinite(state.q).all() and np.abs(state.v).max() < LARGEST_SPEED):
            return SimulationStatus.DIVERGED
        if data.warning.number[self._unstable].any():
            return SimulationStatus.DIVERGED
        upright = float(state.rotation[:, 2] @ reference.rotation[tick, :, 2])
        place = state.q[:3] - reference.position[tick]
        tilted = upright < np.cos(self.settings.fall_tilt)
        if tilted or np.sqrt(place @ place) > self._largest_error:
            return SimulationStatus.FELL
        return SimulationStatus.FINISHED

    def _push(self, data: Any, clock: float) -> None:
        """Apply the pushes of this instant to the body."""
        if self.settings.pushes:
            force = np.zeros(3)
            for push in self.settings.pushes:
                if push.time <= clock < push.time + push.duration:
                    force += push.force
            data.xfrc_applied[self.sim.base, :3] = force

    def _record(self, status: SimulationStatus, spent: tuple[float, float]) -> SimulationRecord:
        t, clock, q, v, touching, beneath, torques, forces = zip(*self.samples, strict=True)
        q_all, v_all = np.array(q), np.array(v)
        looks = Looks(*map(np.array, zip(*self.looks, strict=True)))
        # A diverged state is no posture, and is left out.
        good = np.isfinite(q_all).all(axis=1) & np.isfinite(v_all).all(axis=1)
        keep = good if good.any() else np.ones(len(t), dtype=bool)
        return SimulationRecord(
            t=np.array(t, dtype=np.float64)[keep],
            clock=np.array(clock, dtype=np.float64)[keep],
            q=q_all[keep],
            v=v_all[keep],
            touching=np.array(touching)[keep],
            beneath=np.array(beneath)[keep],
            torques=np.array(torques)[keep],
            forces=np.array(forces)[keep],
            looks=looks.finite,
            peak_torques=self._servos.peak_torques,
            peak_rates=self._servos.peak_rates,
            energy=self._servos.energy,
            own_shapes=self.sim.own_shapes,
            bumps=tuple(sorted(self._touching.bumps)),
            status=status,
            wall_time=spent[0],
            cpu_time=spent[1],
        )
