"""From COG targets to a timed path of body and joints, and its phases."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, rotation_z
from gaitopt.errors import InfeasibleStepError
from gaitopt.optimize.cog import CogSolution
from gaitopt.optimize.speed import knot_times
from gaitopt.planning.path import MotionPath
from gaitopt.planning.phases import crawl_phases
from gaitopt.planning.plan import Plan
from gaitopt.planning.settings import CrawlSettings
from gaitopt.robots.leg import Leg
from gaitopt.robots.quadruped import Quadruped
from gaitopt.swing.box import box_corners
from gaitopt.terrain.footholds import Footholds

if TYPE_CHECKING:
    from gaitopt.planning.crawl import CrawlSteps

SLIP_TOLERANCE = 1e-5
"""Most that a standing foot may wander between two knots [m]."""
CHORD_TOLERANCE = 1e-4
"""Most that a flying foot may depart from its path between two knots [m]."""
FIRST_INTERVALS = 8
MOST_INTERVALS = 1024


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
    swings = _swing_strands(robot, steps, settings, cogs)
    strands = [strand for pair in zip(stances, swings, strict=True) for strand in pair]
    first = _standing_joints(robot, steps.feet[:1], start[None])[0]
    joints = np.concatenate([first[None], *(s.joints for s in strands)])
    body = np.concatenate([start[None], *(s.body for s in strands)])
    durations = np.concatenate([np.zeros(1), *(s.times for s in strands)])
    # Times are rounded to their spacing; a little more of it keeps every velocity within its limit.
    durations[durations > 0.0] += 2.0 * np.spacing(durations.sum())
    times = np.cumsum(durations)
    ends = np.cumsum([1, *(len(s.times) for s in strands)]) - 1
    kept = np.concatenate([[True], np.diff(times) > 0.0])
    path = MotionPath.polyline(
        times[kept], np.concatenate([_base_pose(robot, settings, body), joints], axis=1)[kept]
    )
    slowest = np.concatenate([*(s.slowest for s in strands), np.zeros(0, dtype=int)])
    phases = crawl_phases(robot, settings, steps, cogs, solutions, times, ends, slowest)
    worst = max((s.error_bound for s in solutions), default=0.0)
    return Plan(robot, footholds, settings, phases, path, {"cog_error_bound": worst})


def _stance_strands(
    robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings, cogs: FloatArray
) -> list[Strand]:
    """Body moves on four feet, along straight lines between COG targets."""

    def knots(which: np.ndarray, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        u = _spacing(n)[:, None]
        body = cogs[which, None] + (cogs[which + 1] - cogs[which])[:, None] * u
        joints = _standing_joints(robot, steps.feet[which, None], body)
        middle = (body[:, 1:] + body[:, :-1]) / 2.0
        slip = np.max(
            [
                np.linalg.norm(
                    middle - robot.centre + robot.legs[leg].forward(_midway(robot, leg, joints))
                    - steps.feet[which, None, i],
                    axis=-1,
                ).max(axis=-1)
                for i, leg in enumerate(LEGS)
            ],
            axis=0,
        )  # fmt: skip
        return body, joints, slip

    return _refined(robot, settings, steps, len(steps.legs), knots, SLIP_TOLERANCE, "stance")


def _swing_strands(
    robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings, cogs: FloatArray
) -> list[Strand]:
    """Feet fly, the body stands still."""
    starts = steps.feet[np.arange(len(steps.legs)), steps.indices]
    corners = box_corners(starts, steps.targets, settings.swing_height)
    standing = _standing_joints(robot, steps.feet[: len(steps.legs)], cogs[1:])

    def knots(which: np.ndarray, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        u = _spacing(n)[1:, None]
        legs = corners[which, :-1, None] + np.diff(corners[which], axis=1)[:, :, None] * u
        foot = np.concatenate([corners[which, :1], legs.reshape(len(which), 3 * n, 3)], axis=1)
        local = foot - cogs[which + 1, None] + robot.centre
        joints = np.repeat(standing[which, None], 3 * n + 1, axis=1)
        error = np.zeros(len(which))
        for i, name in enumerate(LEGS):
            mine = np.flatnonzero(steps.indices[which] == i)
            if not mine.size:
                continue
            leg = robot.legs[name]
            _refuse_unreachable(leg, local[mine], which[mine], steps)
            columns = list(robot.leg_columns[name])
            angles = leg.inverse(local[mine])
            joints[mine[:, None, None], np.arange(3 * n + 1)[:, None], columns] = angles
            middle = leg.forward((angles[:, 1:] + angles[:, :-1]) / 2.0)
            chord = (local[mine, 1:] + local[mine, :-1]) / 2.0
            error[mine] = np.linalg.norm(middle - chord, axis=-1).max(axis=-1)
        return foot, joints, error

    strands = _refined(robot, settings, steps, len(steps.legs), knots, CHORD_TOLERANCE, "swing")
    return [
        s._replace(body=np.repeat(cogs[i + 1][None], len(s.body), axis=0))
        for i, s in enumerate(strands)
    ]


def _refined(
    robot: Quadruped,
    settings: CrawlSettings,
    steps: CrawlSteps,
    count: int,
    knots: Callable[[np.ndarray, int], tuple[FloatArray, FloatArray, FloatArray]],
    tolerance: float,
    kind: str,
) -> list[Strand]:
    """Strands of all steps, with as many knots each as the tolerance asks for.

    Steps are worked on together; those whose chord error is too large get more knots.
    """
    speed = None if settings.speed == "max" else float(settings.speed)
    found: list[Strand | None] = [None] * count
    waiting = {FIRST_INTERVALS: np.arange(count)} if count else {}
    while waiting:
        n = min(waiting)
        which = waiting.pop(n)
        points, joints, error = knots(which, n)
        _refuse_limits(robot, joints, which, steps, kind)
        lengths = np.linalg.norm(np.diff(points, axis=1), axis=-1)
        times, slowest = knot_times(joints, robot.velocity_limits, lengths, speed)
        done = (error <= tolerance) | (n >= MOST_INTERVALS)
        for i in np.flatnonzero(done):
            found[which[i]] = Strand(points[i, 1:], joints[i, 1:], times[i], slowest[i])
        # The error of a chord goes like the square of its length.
        doublings = np.ceil(np.log2(np.maximum(error[~done] / tolerance, 1.1)) / 2.0)
        needed = np.minimum(n * 2 ** doublings.astype(int), MOST_INTERVALS)
        for more in np.unique(needed):
            rest = which[~done][needed == more]
            waiting[int(more)] = np.union1d(waiting.get(int(more), rest), rest)
    return [s for s in found if s is not None]


def _spacing(n: int) -> FloatArray:
    """``n + 1`` numbers from 0 to 1, dense at the ends.

    Legs are straightest at the ends of a move; there joint angles go like the square root of the
    way, which this spacing turns into a smooth function.
    """
    return (1.0 - np.cos(np.pi * np.arange(n + 1) / n)) / 2.0


def _standing_joints(robot: Quadruped, feet: FloatArray, body: FloatArray) -> FloatArray:
    """Joint angles ``(..., nj)`` with the feet at ``feet (..., 4, 3)``, body at ``(..., 3)``."""
    shape = np.broadcast_shapes(feet.shape[:-2], body.shape[:-1])
    joints = np.empty((*shape, len(robot.joint_names)))
    joints[...] = robot.neutral_joints()
    for i, name in enumerate(LEGS):
        local = feet[..., i, :] - body + robot.centre
        joints[..., list(robot.leg_columns[name])] = robot.legs[name].inverse(local)
    return joints


def _midway(robot: Quadruped, leg: str, joints: FloatArray) -> FloatArray:
    mine = joints[..., list(robot.leg_columns[leg])]
    return np.asarray((mine[:, 1:] + mine[:, :-1]) / 2.0)


def _base_pose(robot: Quadruped, settings: CrawlSettings, body: FloatArray) -> FloatArray:
    """Base position and roll, pitch, yaw ``(K, 6)`` in the world, from the body centre's path."""
    world = (body - robot.centre) @ rotation_z(settings.heading).T
    ahead = robot.body_axes[:, 0]
    yaw = settings.heading - float(np.arctan2(ahead[1], ahead[0]))
    pose = np.zeros((len(body), 6))
    pose[:, :3] = world
    pose[:, 5] = yaw
    return pose


def _refuse_unreachable(leg: Leg, local: FloatArray, which: np.ndarray, steps: CrawlSteps) -> None:
    short = leg.shortfall(local)
    if short.max() <= 1e-6:
        return
    row, sample = np.unravel_index(int(short.argmax()), short.shape)
    distance = float(np.sqrt(leg.straightness(*local[row, sample])))
    raise InfeasibleStepError(
        f"step {which[row]} ({leg.name}): its foot would have to be {distance:.4g} m from the "
        f"hip's pitch axis during the swing, and the knee allows {leg.least_reach:.4g} to "
        f"{leg.reach:.4g} m; change swing_height or body_height",
        step=int(which[row]), leg=leg.name, conflicts=(f"reach {leg.name}",),
    )  # fmt: skip


def _refuse_limits(
    robot: Quadruped, joints: FloatArray, which: np.ndarray, steps: CrawlSteps, kind: str
) -> None:
    """Raise when a joint leaves its position limits, naming the worst."""
    for name, leg in robot.legs.items():
        angles = joints[..., list(robot.leg_columns[name])]
        low, high = leg.position_limits
        over = np.maximum(low - angles, angles - high)
        if over.max(initial=0.0) <= 1e-9:
            continue
        row, _, joint = (int(i) for i in np.unravel_index(int(over.argmax()), over.shape))
        worst = angles[np.unravel_index(int(over.argmax()), over.shape)]
        raise InfeasibleStepError(
            f"step {which[row]} ({kind} for {steps.legs[which[row]]}): joint {leg.joints[joint]} "
            f"would turn to {worst:.4f} rad, and its limits are {low[joint]:.4f} to "
            f"{high[joint]:.4f} rad; try another body_height or nearer footholds",
            step=int(which[row]), leg=name, conflicts=(f"position {leg.joints[joint]}",),
        )  # fmt: skip
