"""From COG targets to a timed path of body and joints, and its phases."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.motion.body_and_feet import base_poses, slip_between
from gaitopt.motion.path import MotionPath
from gaitopt.optimize.cog.solver import CogSolution
from gaitopt.optimize.speed import knot_times
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import CrawlRecord
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.phases import crawl_phases
from gaitopt.planners.phase_by_phase.swing_ways import swing_ways
from gaitopt.robots.leg import Leg
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import joints_from_feet_in_body
from gaitopt.terrain.footholds import Footholds

if TYPE_CHECKING:
    from gaitopt.planners.phase_by_phase.steps import CrawlSteps

SLIP_TOLERANCE = 1e-5
"""Most that a standing foot may wander between two knots [m]."""
CHORD_TOLERANCE = 1e-4
"""Most that a flying foot may depart from its path between two knots [m]."""
FIRST_INTERVALS = {"stance": 8, "swing": 42}
"""Intervals of each move to begin with, shared out over its straight edges."""
MOST_INTERVALS = 4096


class Strand(NamedTuple):
    """Knots of one phase after its first.

    Attributes:
        body: body centre ``(n, 3)`` [m].
        joints: ``(n, nj)`` [rad].
        times: time since the knot before ``(n,)`` [s].
        slowest: joint that sets it, -1 for the speed asked for ``(n,)``.
    """

    body: FloatArray
    joints: FloatArray
    times: FloatArray
    slowest: np.ndarray


def assemble_plan(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    steps: CrawlSteps,
    start: FloatArray,
    solutions: list[CogSolution],
) -> Plan:
    """Time the whole walk and put it into a plan.

    Raises:
        InfeasibleStepError: a joint would leave its position limits, or a leg would have to fold
            further than it can.
    """
    cogs = np.vstack([start, *(
        np.append(s.position, z) for s, z in zip(solutions, steps.heights, strict=True)
    )])  # fmt: skip
    stances = _stance_strands(robot, steps, settings, cogs)
    swings = _swing_strands(robot, steps, settings, cogs, stances)
    strands = [strand for pair in zip(stances, swings, strict=True) for strand in pair]
    first = joints_from_feet_in_body(robot, steps.feet[:1] - start + robot.centre)
    joints = np.concatenate([first, *(s.joints for s in strands)])
    body = np.concatenate([start[None], *(s.body for s in strands)])
    durations = np.concatenate([np.zeros(1), *(s.times for s in strands)])
    # Times are rounded to their spacing; a little more of it keeps every velocity within its limit.
    durations[durations > 0.0] += 2.0 * np.spacing(durations.sum())
    times = np.cumsum(durations)
    ends = np.cumsum([1, *(len(s.times) for s in strands)]) - 1
    kept = np.concatenate([[True], np.diff(times) > 0.0])
    path = MotionPath.polyline(
        times[kept],
        np.concatenate([base_poses(robot, settings.heading, body), joints], axis=1)[kept],
    )
    slowest = np.concatenate([*(s.slowest for s in strands), np.zeros(0, dtype=int)])
    phases = crawl_phases(robot, settings, steps, cogs, solutions, times, ends, slowest)
    record = CrawlRecord(
        stability="static margin of the body centre, on the horizontal projection",
        cog_error_bound=max((s.error_bound for s in solutions), default=0.0),
    )
    return Plan(robot, footholds, settings, phases, path, record)


def _stance_strands(
    robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings, cogs: FloatArray
) -> list[Strand]:
    """Body moves on four feet, along straight lines between COG targets."""
    moves = np.diff(cogs, axis=0)

    def place(at: Knots) -> tuple[FloatArray, FloatArray, FloatArray]:
        body = cogs[at.step] + moves[at.step] * at.share[:, None]
        feet = steps.feet[at.step]
        local = feet - body[:, None] + robot.centre
        joints = joints_from_feet_in_body(robot, local)
        for i, name in enumerate(LEGS):
            _refuse_unreachable(robot.legs[name], local[:, i], at.step, steps)
        # In the heading frame, as body and feet are.
        values = np.concatenate([base_poses(robot, 0.0, body), joints], axis=1)
        standing = np.ones((len(body) - 1, len(LEGS)), dtype=np.bool_)
        return body, joints, slip_between(robot, values, feet[1:], standing)

    return _refined(robot, settings, steps, place, 1, SLIP_TOLERANCE, "stance")


def _swing_strands(
    robot: Quadruped,
    steps: CrawlSteps,
    settings: CrawlSettings,
    cogs: FloatArray,
    stances: list[Strand],
) -> list[Strand]:
    """Feet fly, the body stands still."""
    starts = steps.feet[np.arange(len(steps.legs)), steps.indices]
    corners = swing_ways(settings.swing, starts, steps.targets, settings.swing_height)
    edges = np.diff(corners, axis=1)
    standing = np.array([s.joints[-1] for s in stances])

    def place(at: Knots) -> tuple[FloatArray, FloatArray, FloatArray]:
        foot = corners[at.step, at.edge] + edges[at.step, at.edge] * at.share[:, None]
        local = foot - cogs[at.step + 1] + robot.centre
        joints = standing[at.step]
        flying = steps.indices[at.step]
        chord = np.zeros(len(at.step) - 1)
        for i, name in enumerate(LEGS):
            mine = np.flatnonzero(flying == i)
            if not mine.size:
                continue
            leg, points = robot.legs[name], local[mine]
            _refuse_unreachable(leg, points, at.step[mine], steps)
            angles = leg.inverse(points)
            joints[mine[:, None], list(robot.leg_columns[name])] = angles
            gap = leg.forward((angles[1:] + angles[:-1]) / 2.0) - (points[1:] + points[:-1]) / 2.0
            # Where two of the leg's knots are not neighbours the value is never looked at.
            chord[mine[:-1]] = np.linalg.norm(gap, axis=1)
        return foot, joints, chord

    count = corners.shape[1] - 1
    strands = _refined(robot, settings, steps, place, count, CHORD_TOLERANCE, "swing")
    return [
        s._replace(body=np.repeat(cogs[i + 1][None], len(s.body), axis=0))
        for i, s in enumerate(strands)
    ]


class Knots(NamedTuple):
    """Knots of many moves, one move after another.

    Attributes:
        step: the step that each knot belongs to ``(M,)``.
        edge: the straight edge of the move that it lies on ``(M,)``.
        share: how far along the edge, from 0 to 1 ``(M,)``.
    """

    step: np.ndarray
    edge: np.ndarray
    share: FloatArray


def _knots(which: np.ndarray, intervals: np.ndarray, edges: int) -> tuple[Knots, np.ndarray]:
    """Knots of the steps ``which``, with so many intervals on each edge; and each step's first.

    Knots are dense at the ends of an edge. Legs are straightest there, and their joint angles go
    like the square root of the way, which this spacing turns into a smooth function.
    """
    counts = edges * intervals + 1
    firsts = np.cumsum(counts) - counts
    owner = np.repeat(np.arange(len(which)), counts)
    number, n = np.arange(len(owner)) - firsts[owner], intervals[owner]
    edge = np.minimum(number // n, edges - 1)
    share = (1.0 - np.cos(np.pi * (number - edge * n) / n)) / 2.0
    return Knots(which[owner], edge, share), firsts


def _refined(
    robot: Quadruped,
    settings: CrawlSettings,
    steps: CrawlSteps,
    place: Callable[[Knots], tuple[FloatArray, FloatArray, FloatArray]],
    edges: int,
    tolerance: float,
    kind: str,
) -> list[Strand]:
    """Strands of all steps, with as many knots each as the tolerance asks for.

    All steps are worked on together; those whose chord error is too large get more knots.

    Args:
        place: gives points ``(M, 3)``, joints ``(M, nj)`` and chord errors ``(M - 1,)`` at knots.
        edges: straight edges of each move.
        robot, settings, steps, tolerance, kind: of the walk.
    """
    speed = None if settings.speed == "max" else float(settings.speed)
    limits = robot.velocity_limits
    found: list[Strand | None] = [None] * len(steps.legs)
    which = np.arange(len(steps.legs))
    intervals = np.full(len(which), -(-FIRST_INTERVALS[kind] // edges))
    while which.size:
        at, firsts = _knots(which, intervals, edges)
        points, joints, chord = place(at)
        _refuse_limits(robot, joints, at.step, steps, kind)
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        times, slowest = knot_times(joints, limits, lengths, speed)
        # What lies between the last knot of one step and the first of the next is no interval.
        chord[firsts[1:] - 1] = 0.0
        _refuse_flips(robot, joints, firsts, at.step, steps, kind)
        error = np.maximum.reduceat(chord, firsts)
        done = error <= tolerance
        _refuse_coarse(which, error, ~done & (intervals >= MOST_INTERVALS), steps, kind)
        for i in np.flatnonzero(done).tolist():
            a, b = firsts[i], firsts[i] + edges * intervals[i]
            found[which[i]] = Strand(
                points[a + 1 : b + 1], joints[a + 1 : b + 1], times[a:b], slowest[a:b]
            )
        # The error of a chord goes like the square of its length.
        more = np.ceil(intervals * np.sqrt(1.1 * error / tolerance)).astype(int)
        which, intervals = which[~done], np.minimum(more[~done], MOST_INTERVALS)
    return [s for s in found if s is not None]


def _refuse_flips(
    robot: Quadruped,
    joints: FloatArray,
    firsts: np.ndarray,
    step: np.ndarray,
    steps: CrawlSteps,
    kind: str,
) -> None:
    """Raise when a joint would have to jump by a turn, which inverse kinematics hides."""
    jumps = np.abs(np.diff(joints, axis=0))
    jumps[firsts[1:] - 1] = 0.0
    row, joint = (int(i) for i in np.unravel_index(int(jumps.argmax()), jumps.shape))
    if jumps[row, joint] > np.pi:
        raise InfeasibleStepError(
            f"step {step[row]} ({kind} for {steps.legs[step[row]]}): joint "
            f"{robot.joint_names[joint]} would have to turn right over; raise body_height",
            step=int(step[row]), leg=steps.legs[step[row]],
            conflicts=(f"position {robot.joint_names[joint]}",),
        )  # fmt: skip


def _refuse_coarse(
    which: np.ndarray, error: FloatArray, stuck: BoolArray, steps: CrawlSteps, kind: str
) -> None:
    """Raise when not even the most knots keep feet on their paths."""
    if stuck.any():
        i = int(np.flatnonzero(stuck)[0])
        raise SolverError(
            f"step {which[i]} ({kind} for {steps.legs[which[i]]}): feet leave their path by "
            f"{error[i]:.2g} m between knots, even with {MOST_INTERVALS} intervals; take "
            "reach_fraction below 1 or another body_height, so that no leg is quite straight or "
            "folded"
        )


def _refuse_unreachable(leg: Leg, local: FloatArray, step: np.ndarray, steps: CrawlSteps) -> None:
    short = leg.shortfall(local)
    worst = int(short.argmax())
    if short[worst] <= 1e-6:
        return
    distance = float(np.sqrt(leg.straightness(*local[worst])))
    raise InfeasibleStepError(
        f"step {step[worst]} ({steps.legs[step[worst]]}): the foot of {leg.name} would have to "
        f"be {distance:.4g} m from the hip's pitch axis, and the knee allows "
        f"{leg.least_reach:.4g} to {leg.reach:.4g} m; change swing_height or body_height",
        step=int(step[worst]), leg=leg.name, conflicts=(f"reach {leg.name}",),
    )  # fmt: skip


def _refuse_limits(
    robot: Quadruped, joints: FloatArray, step: np.ndarray, steps: CrawlSteps, kind: str
) -> None:
    """Raise when a joint leaves its position limits, naming the worst."""
    least, most = joints.min(axis=0), joints.max(axis=0)
    for name, leg in robot.legs.items():
        columns = list(robot.leg_columns[name])
        low, high = leg.position_limits
        over = np.maximum(low - least[columns], most[columns] - high)
        worst = int(over.argmax())
        if over[worst] <= 1e-9:
            continue
        angles = joints[:, columns[worst]]
        row = int(np.maximum(low[worst] - angles, angles - high[worst]).argmax())
        raise InfeasibleStepError(
            f"step {step[row]} ({kind} for {steps.legs[step[row]]}): joint {leg.joints[worst]} "
            f"would turn to {angles[row]:.4f} rad, and its limits are {low[worst]:.4f} to "
            f"{high[worst]:.4f} rad; try another body_height or nearer footholds",
            step=int(step[row]), leg=name, conflicts=(f"position {leg.joints[worst]}",),
        )  # fmt: skip
