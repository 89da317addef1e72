"""Computes the result of a simulation from what was recorded during it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gaitopt.control.gains import ControlGains
from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.plan.com_margin import margins_over, true_com
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory
from gaitopt.robots.abilities import friction_warnings, inertia_warnings
from gaitopt.robots.rotations import quaternion_to_matrix
from gaitopt.simulation.landings import BEFORE_LIFT_OFF, Looks, feet_of, landings, stances
from gaitopt.simulation.result import SimulationResult, SimulationStatus
from gaitopt.simulation.settings import SimulationSettings


@dataclass(frozen=True, eq=False)
class SimulationRecord:
    """What was recorded during a simulation, at ``N`` samples.

    Attributes:
        t: ``(N,)`` [s].
        clock: the plan's time ``(N,)`` [s], which stands still while the controller waits.
        q, v: Pinocchio's configurations ``(N, nq)`` and velocities ``(N, nv)``.
        touching: which feet touch anything ``(N, 4)``.
        beneath: id of the shape under each foot ``(N, 4)``, -1 for none.
        torques: of the joints ``(N, nj)`` [N m].
        forces: on the feet, in the world's axes ``(N, 4, 3)`` [N].
        looks: what was seen at each call of the controller.
        peak_torques, peak_rates, energy, own_shapes, bumps, status, wall_time, cpu_time: see
            :class:`SimulationResult`.
    """

    t: FloatArray
    clock: FloatArray
    q: FloatArray
    v: FloatArray
    touching: BoolArray
    beneath: np.ndarray
    torques: FloatArray
    forces: FloatArray
    looks: Looks
    peak_torques: FloatArray
    peak_rates: FloatArray
    energy: float
    own_shapes: bool
    bumps: tuple[str, ...]
    status: SimulationStatus
    wall_time: float
    cpu_time: float


def report(
    plan: Plan,
    record: SimulationRecord,
    columns: np.ndarray,
    gains: ControlGains,
    settings: SimulationSettings,
) -> SimulationResult:
    """The result that a record amounts to.

    Args:
        plan: what was simulated.
        record: what was recorded.
        columns: ids of the shapes under the footholds ``(4, n)``.
        gains, settings: of the simulation.
    """
    robot, t = plan.robot, record.t
    planned = plan.at(np.clip(record.clock, 0.0, plan.duration))
    base, to_world = record.q[:, :3], quaternion_to_matrix(record.q[:, 3:7]) @ robot.body_axes
    feet = feet_of(robot, record.q)
    landed = landings(plan, record.looks, columns, settings)
    errors = np.array([e for e, _ in landed])
    missed = tuple(m for _, m in landed if m is not None)
    motion = Trajectory(
        t=t,
        q=record.q,
        v=record.v,
        contacts=record.touching,
        cog=base + to_world @ robot.centre,
        feet=feet,
        legs=LEGS,
        joint_names=robot.joint_names,
    )
    margin = margins_over(replace(motion, contacts=planned.contacts), true_com(robot, record.q))
    done = errors[np.isfinite(errors)]
    return SimulationResult(
        status=record.status,
        end=float(t[-1]),
        waited=float(t[-1] - record.clock[-1]),
        steps_done=len(done),
        steps=len(errors),
        missed=missed,
        landing_error=float(done.max(initial=0.0)),
        landing_errors=errors,
        tilt=float(_tilt(record.q[:, 3:7], planned.q[:, 3:7]).max()),
        body_error=float(np.linalg.norm(record.q[:, :3] - planned.q[:, :3], axis=1).max()),
        com_margin=margin,
        smallest_margin=float(np.nanmin(margin)) if np.isfinite(margin).any() else float("nan"),
        slip=_slip(plan, record.clock, feet, settings),
        peak_torques=record.peak_torques,
        peak_rates=record.peak_rates,
        torque_use=float((record.peak_torques / robot.effort_limits).max(initial=0.0)),
        rate_use=float((record.peak_rates / robot.velocity_limits).max(initial=0.0)),
        servo_tolerance=settings.servo_tolerance,
        known_motors=bool(plan.robot.motor_inertia.any()),
        doubts=(*inertia_warnings(robot), *friction_warnings(robot)),
        energy=record.energy,
        own_shapes=record.own_shapes,
        bumps=record.bumps,
        wall_time=record.wall_time,
        cpu_time=record.cpu_time,
        simulated_time=float(t[-1]),
        motion=motion,
        plan_times=record.clock,
        torques=record.torques,
        forces=record.forces,
        gains=gains,
        settings=settings,
    )


def _slip(plan: Plan, times: FloatArray, feet: FloatArray, settings: SimulationSettings) -> float:
    """Largest horizontal distance of a standing foot from where it landed [m]."""
    worst = 0.0
    starts = [
        (0, leg, 0.0, next((s.start for s in plan.swings if s.leg == leg), np.inf), None)
        for leg in LEGS
        if not plan.entry or leg in plan.phases[0].support
    ]
    for _, leg, start, end, _ in [*starts, *stances(plan)]:
        a, b = np.searchsorted(times, [start + settings.landing_time, end - BEFORE_LIFT_OFF])
        places = feet[a:b, LEGS.index(leg), :2]
        if len(places):
            worst = max(worst, float(np.linalg.norm(places - places[0], axis=1).max()))
    return worst


def _tilt(quaternions: FloatArray, others: FloatArray) -> FloatArray:
    """Angles ``(N,)`` [rad] between orientations, given as unit quaternions ``(N, 4)``."""
    # A quaternion and its opposite are the same orientation.
    flip = np.sign(np.einsum("ni,ni->n", quaternions, others))[:, None]
    half = np.linalg.norm(quaternions - np.where(flip < 0, -1.0, 1.0) * others, axis=1) / 2.0
    return np.asarray(4.0 * np.arcsin(np.clip(half, 0.0, 1.0)))
