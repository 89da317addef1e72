"""The result of a simulation, computed from its record."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gaitopt.control.gains import ControlGains
from gaitopt.conventions import LEGS, BoolArray, FloatArray, TextEnum
from gaitopt.plan.com_margin import margins_over, true_com
from gaitopt.plan.plan import Plan, Trajectory
from gaitopt.robots.rotations import quaternion_to_matrix
from gaitopt.simulation.settings import SimulationSettings

BEFORE_LIFT_OFF = 0.06
"""How long before its planned lift-off a foot may already rise [s]. Chosen: the controller's
reference is averaged over 40 ms, and the record has a sample every 20 ms."""


class SimulationStatus(TextEnum):
    """How a simulation ended. Members equal their texts: ``result.status == "fell"``."""

    FINISHED = "finished"
    """The robot was on its feet until the end of the plan."""
    FELL = "fell"
    """The body tilted too far, or went too far from the plan."""
    DIVERGED = "diverged"
    """Positions or velocities are no sensible numbers any more; it counts as a fall. Try a smaller
    ``timestep``, or softer gains."""


class MissReason(TextEnum):
    """Why a foothold counts as missed. Members equal their texts."""

    NO_CONTACT = "no contact"
    """Nothing was under the foot."""
    BESIDE = "beside"
    """The foot stood on something else, or farther away than the footholds' landing radius."""
    LEFT = "left"
    """The foot stood, and was away before its next swing."""


@dataclass(frozen=True)
class MissedFoothold:
    """A foot that did not stand where the plan has it.

    Attributes:
        step: index of the step, from 0 over the whole walk.
        leg: the leg.
        distance: how far the foot was from its foothold, horizontally [m].
        reason: why it counts as missed.
    """

    step: int
    leg: str
    distance: float
    reason: MissReason


@dataclass(frozen=True, eq=False)
class SimulationResult:
    """A plan's walk in physics.

    Attributes:
        status: how it ended.
        end: when it ended [s]: some time after the plan's end, or with the fall.
        waited: how long the plan's clock stood still [s], because a foot had yet to find the ground
            or to take up its load before another might lift off.
        steps_done: steps whose touch-down came before the end.
        steps: steps of the plan.
        missed: footholds that were missed.
        landing_error: largest horizontal distance of a foot from its foothold when it landed [m].
        landing_errors: of each step ``(steps,)`` [m]; NaN for steps that were not done.
        tilt: largest angle between the body's orientation and the plan's [rad].
        body_error: largest distance between the body's position and the plan's [m].
        com_margin: static stability margin of the true COM over the feet that the plan has
            standing, where they really are, at the times of ``motion`` ``(N,)`` [m]; NaN where
            the plan has fewer than three.
        smallest_margin: the smallest of it [m].
        slip: largest horizontal distance of a standing foot from where it landed [m]; its ball
            may have rolled there.
        peak_torques, peak_rates: of every joint over all steps of the physics ``(nj,)`` [N m],
            [rad/s].
        torque_use, rate_use: the largest of them as shares of the URDF's limits.
        servo_tolerance: by how much ``rate_use`` may exceed 1.
        energy: mechanical work done by the joints [J]; energy from braking is not recovered.
        wall_time, cpu_time: time that the simulation took, and time that the processor spent on it
            [s]. No other values differ from run to run.
        simulated_time: time simulated [s].
        motion: the simulated motion, for a replay beside the plan.
        gains: of the controller and the servos.
        settings: what was asked for.
    """

    status: SimulationStatus
    end: float
    waited: float
    steps_done: int
    steps: int
    missed: tuple[MissedFoothold, ...]
    landing_error: float
    landing_errors: FloatArray
    tilt: float
    body_error: float
    com_margin: FloatArray
    smallest_margin: float
    slip: float
    peak_torques: FloatArray
    peak_rates: FloatArray
    torque_use: float
    rate_use: float
    servo_tolerance: float
    energy: float
    wall_time: float
    cpu_time: float
    simulated_time: float
    motion: Trajectory
    gains: ControlGains
    settings: SimulationSettings

    @property
    def finished(self) -> bool:
        """Whether the robot was still on its feet at the end of the plan."""
        return self.status is SimulationStatus.FINISHED

    @property
    def succeeded(self) -> bool:
        """Finished, with every foot on its foothold."""
        return self.finished and not self.missed and self.steps_done == self.steps

    @property
    def rates_within(self) -> bool:
        """Whether joint velocities kept their limits within the servos' tolerance."""
        return self.rate_use <= 1.0 + self.servo_tolerance

    @property
    def passed(self) -> bool:
        """Whether it succeeded, with joint velocities within their limits and the tolerance."""
        return self.succeeded and self.rates_within

    @property
    def real_time_factor(self) -> float:
        """Simulated time over processor time: above 1 it is faster than real time."""
        return self.simulated_time / self.cpu_time if self.cpu_time > 0 else float("inf")

    def __repr__(self) -> str:
        return f"SimulationResult({self.status.value!r}, {self.steps_done} of {self.steps} steps)"

    def __str__(self) -> str:
        """The report as plain text."""
        missed = ", ".join(f"step {m.step + 1} {m.leg} ({m.reason})" for m in self.missed[:5])
        more = f" and {len(self.missed) - 5} more" if len(self.missed) > 5 else ""
        return "\n".join([
            f"{self.status} at {self.end:.1f} s, {self.steps_done} of {self.steps} steps, "
            f"{self.waited:.2f} s of it waiting for feet",
            f"missed footholds: {missed or 'none'}{more}",
            f"largest landing error {1e3 * self.landing_error:.1f} mm, "
            f"slip {1e3 * self.slip:.1f} mm",
            f"largest tilt {np.degrees(self.tilt):.2f} deg, "
            f"body error {1e3 * self.body_error:.1f} mm",
            f"smallest margin of the true COM {1e3 * self.smallest_margin:.1f} mm",
            f"peaks: torque {self.torque_use:.0%} of the limit, joint velocity "
            f"{self.rate_use:.0%} (tolerance {1.0 + self.servo_tolerance:.0%})",
            f"work of the joints {self.energy:.0f} J; "
            f"{self.real_time_factor:.1f} times as fast as real time",
        ])  # fmt: skip


@dataclass(frozen=True, eq=False)
class SimulationRecord:
    """What was recorded during a simulation, at ``N`` samples.

    Attributes:
        t: ``(N,)`` [s].
        clock: the plan's time ``(N,)`` [s], which stands still while the controller waits.
        q, v: Pinocchio's configurations ``(N, nq)`` and velocities ``(N, nv)``.
        touching: which feet touch anything ``(N, 4)``.
        beneath: id of the shape under each foot ``(N, 4)``, -1 for none.
        peak_torques, peak_rates, energy, status, wall_time, cpu_time: see
            :class:`SimulationResult`.
    """

    t: FloatArray
    clock: FloatArray
    q: FloatArray
    v: FloatArray
    touching: BoolArray
    beneath: np.ndarray
    peak_torques: FloatArray
    peak_rates: FloatArray
    energy: float
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
        energy=record.energy,
        wall_time=record.wall_time,
        cpu_time=record.cpu_time,
        simulated_time=float(t[-1]),
        motion=motion,
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
    """For each step the landing error [m], NaN where it was not done, and whether it missed."""
    counts = dict.fromkeys(LEGS, 0)
    radius = plan.footholds.landing_radius
    out: list[tuple[float, MissedFoothold | None]] = []
    for step, leg, start, end, foothold in stances(plan):
        column = LEGS.index(leg)
        counts[leg] += 1
        mine = columns[column, min(counts[leg], columns.shape[1] - 1)]
        first = int(np.searchsorted(record.clock, start))
        settled = int(np.searchsorted(record.clock, min(start + settings.landing_time, end - 1e-6)))
        last = int(np.searchsorted(record.clock, end - BEFORE_LIFT_OFF)) - 1
        if first >= len(record.clock):
            out.append((np.nan, None))
            continue
        settled = min(settled, len(record.clock) - 1)
        last = min(max(last, settled), len(record.clock) - 1)
        off = np.linalg.norm(feet[:, column, :2] - foothold[:2], axis=1)
        beneath = record.beneath[first : settled + 1, column]
        reason: MissReason | None = None
        if (beneath < 0).all():
            reason = MissReason.NO_CONTACT
        elif off[settled] > radius or not (beneath == mine).any():
            reason = MissReason.BESIDE
        elif off[last] > radius or (record.beneath[last - 2 : last + 1, column] != mine).all():
            reason = MissReason.LEFT
        distance = float(off[last] if reason is MissReason.LEFT else off[settled])
        out.append((float(off[settled]),
                    MissedFoothold(step, leg, distance, reason) if reason else None))  # fmt: skip
    return out


def _slip(plan: Plan, times: FloatArray, feet: FloatArray, settings: SimulationSettings) -> float:
    """Largest horizontal distance of a standing foot from where it landed [m]."""
    worst = 0.0
    starts = [
        (0, leg, 0.0, next((s.start for s in plan.swings if s.leg == leg), np.inf), None)
        for leg in LEGS
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
