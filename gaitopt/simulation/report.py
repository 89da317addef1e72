"""Computes the result of a simulation from what was recorded during it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gaitopt.control.clock import SAME_INSTANT
from gaitopt.control.gains import ControlGains
from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.plan.com_margin import margins_over, true_com
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory
from gaitopt.robots.abilities import friction_warnings, inertia_warnings
from gaitopt.robots.rotations import quaternion_to_matrix
from gaitopt.simulation.result import (
    MissedFoothold,
    MissReason,
    SimulationResult,
    SimulationStatus,
)
from gaitopt.simulation.settings import SimulationSettings

BEFORE_LIFT_OFF = 0.06
"""How long before its planned lift-off a foot may already rise [s]. Chosen: the controller's
reference is averaged over 40 ms, and the record has a sample every 20 ms."""


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
    inside = np.stack([robot.legs[leg].forward(record.q[:, 7:][:, list(robot.leg_columns[leg])])
                       for leg in LEGS], axis=1)  # fmt: skip
    feet = base[:, None, :] + np.einsum("nij,nlj->nli", to_world, inside)
    landings = _landings(plan, record, feet, columns, settings)
    errors = np.array([e for e, _ in landings])
    missed = tuple(m for _, m in landings if m is not None)
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


def stances(plan: Plan) -> list[tuple[int, str, float, float, FloatArray]]:
    """Every time that a foot stands after a swing, by step.

    Returns:
        Tuples of step, leg, touch-down [s], next lift-off [s] and foothold ``(3,)`` [m].
    """
    found = []
    for i, swing in enumerate(plan.swings):
        later = (s.start for s in plan.swings[i + 1 :] if s.leg == swing.leg)
        found.append((swing.step, swing.leg, swing.end, next(later, np.inf), swing.foot_end))
    return found


def _landings(
    plan: Plan,
    record: SimulationRecord,
    feet: FloatArray,
    columns: np.ndarray,
    settings: SimulationSettings,
) -> list[tuple[float, MissedFoothold | None]]:
    """For each step the landing error [m], NaN where it was not done, and whether it missed.

    A foot is on its column where that is the shape under it. A height map is one shape, so there
    the foot is on its foothold where its ball touches the map and its centre is near the foothold,
    heights included.
    """
    counts = dict.fromkeys(LEGS, 0)
    # Feet that are in the air when the plan begins land on their first foothold.
    counts.update({swing.leg: -1 for swing in plan.swings if swing.index < 0})
    one_surface = plan.footholds.ground is not None
    radius = plan.footholds.landing_radius
    out: list[tuple[float, MissedFoothold | None]] = []
    for step, leg, start, end, foothold in stances(plan):
        column = LEGS.index(leg)
        counts[leg] += 1
        mine = columns[column, min(counts[leg], columns.shape[1] - 1)]
        first = int(np.searchsorted(record.clock, start))
        # While the clock stands still at the lift-off the foot still stands.
        until = min(start + settings.landing_time, end) + SAME_INSTANT
        settled = max(int(np.searchsorted(record.clock, until, side="right")) - 1, first)
        last = int(np.searchsorted(record.clock, end - BEFORE_LIFT_OFF)) - 1
        if first >= len(record.clock):
            last_distance = float(np.linalg.norm(feet[-1, column, :2] - foothold[:2]))
            never = MissedFoothold(step, leg, last_distance, MissReason.NEVER_REACHED)
            out.append((np.nan, never))
            continue
        settled = min(settled, len(record.clock) - 1)
        last = min(max(last, settled), len(record.clock) - 1)
        off = np.linalg.norm(feet[:, column, :2] - foothold[:2], axis=1)
        away = np.linalg.norm(feet[:, column] - foothold, axis=1) if one_surface else off
        beneath = record.beneath[first : settled + 1, column]
        reason: MissReason | None = None
        if (beneath < 0).all():
            reason = MissReason.NO_CONTACT
        elif away[settled] > radius or not (beneath == mine).any():
            reason = MissReason.BESIDE
        elif away[last] > radius or (record.beneath[last - 2 : last + 1, column] != mine).all():
            reason = MissReason.LEFT
        distance = float(away[last] if reason is MissReason.LEFT else away[settled])
        out.append((float(off[settled]),
                    MissedFoothold(step, leg, distance, reason) if reason else None))  # fmt: skip
    return out


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
