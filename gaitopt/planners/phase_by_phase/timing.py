"""From the COG targets to a timed path of body and joints, with its phases.

Source: [Wang2020], Section IV. Body and feet move as fast as the joints allow, or at the speed that
was asked for.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.motion.body_and_feet import base_poses
from gaitopt.motion.path import MotionPath
from gaitopt.optimize.cog.solver import CogSolution
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import CrawlRecord
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.joint_checks import check_within_reach
from gaitopt.planners.phase_by_phase.phases import crawl_phases
from gaitopt.planners.phase_by_phase.refinement import Knots, TimedMove, refined_moves
from gaitopt.planners.phase_by_phase.steps import CrawlSteps, feet_in_body
from gaitopt.planners.phase_by_phase.swing_polylines import swing_polylines
from gaitopt.planners.phase_by_phase.turning import base_targets, turning_pose
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import joints_from_feet_in_body
from gaitopt.terrain.footholds import Footholds

SLIP_TOLERANCE = 1e-5
"""Largest slip of a standing foot between two knots [m]. Chosen here: a hundredth of a millimetre
is far below what a real foot slips, and costs few knots."""
CHORD_TOLERANCE = 1e-4
"""Largest distance of a swing foot from its path between two knots [m]. Chosen here: ten times
:data:`SLIP_TOLERANCE`, as a swing foot touches nothing."""


def assemble_plan(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    steps: CrawlSteps,
    start: FloatArray,
    solutions: list[CogSolution],
) -> Plan:
    """Time the whole walk and put it into a plan.

    Args:
        robot, footholds, settings, steps: the walk.
        start: body centre at the start ``(3,)`` [m], in the heading frame.
        solutions: the COG target of each step.

    Raises:
        InfeasibleStepError: a joint would leave its position limits, or a foot is out of reach.
        SolverError: so many knots as the tolerances ask for are not allowed.
    """
    targets = np.array([solution.position for solution in solutions]).reshape(-1, 2)
    cogs = np.vstack([start, np.column_stack([targets, steps.heights])])
    bodies = cogs if steps.tilts is None else base_targets(robot, steps, cogs)
    stances = _stance_moves(robot, steps, settings, bodies)
    swings = _swing_moves(robot, steps, settings, cogs, stances)
    # The body stands still during swings.
    ends = np.cumsum([0, *(len(move.body) for move in swings)])
    resting = np.repeat(bodies[1:], np.diff(ends), axis=0)
    swings = [
        move._replace(body=resting[a:b])
        for move, a, b in zip(swings, ends[:-1].tolist(), ends[1:].tolist(), strict=True)
    ]
    moves = [move for pair in zip(stances, swings, strict=True) for move in pair]
    timed = _joined(robot, settings, steps, start, bodies[0], moves)
    phases = crawl_phases(
        robot, settings, steps, cogs, solutions, timed.times, timed.ends, timed.slowest
    )
    centre = "true centre of mass" if settings.true_com else "body centre"
    record = CrawlRecord(
        stability=f"static margin of the {centre}, on the horizontal projection",
        cog_error_bound=max((s.error_bound for s in solutions), default=0.0),
    )
    return Plan(robot, footholds, settings, phases, timed.path, record)


class _TimedWalk(NamedTuple):
    """All moves of a walk, one after another.

    Attributes:
        path: base and joints over time, in the world.
        times: of all knots ``(K,)`` [s]; those of moves that last no time included.
        ends: index of the first knot, then of each move's last one ``(2 S + 1,)``.
        slowest: joint that sets the time of each interval, -1 for the given speed ``(K - 1,)``.
    """

    path: MotionPath
    times: FloatArray
    ends: np.ndarray
    slowest: np.ndarray


def _joined(
    robot: Quadruped,
    settings: CrawlSettings,
    steps: CrawlSteps,
    start: FloatArray,
    first_body: FloatArray,
    moves: list[TimedMove],
) -> _TimedWalk:
    """Join the moves of a walk.

    Args:
        robot, settings, steps: the walk.
        start: body centre at the start ``(3,)`` [m], in the heading frame.
        first_body: the same, as :class:`TimedMove` has it.
        moves: one after another.
    """
    turn = None if steps.turns is None else steps.turns[:1]
    first = joints_from_feet_in_body(
        robot, feet_in_body(robot, steps.feet[:1], start[None], turn)
    )  # fmt: skip
    joints = np.concatenate([first, *(m.joints for m in moves)])
    body = np.concatenate([first_body[None], *(m.body for m in moves)])
    durations = np.concatenate([np.zeros(1), *(m.durations for m in moves)])
    # The sum of durations is rounded. Two units in the last place of the largest time more for each
    # interval keep every velocity within its limit all the same.
    durations[durations > 0.0] += 2.0 * np.spacing(durations.sum())
    times = np.cumsum(durations)
    kept = np.concatenate([[True], np.diff(times) > 0.0])
    bases = body if steps.tilts is not None else base_poses(robot, settings.heading, body)
    path = MotionPath.polyline(times[kept], np.concatenate([bases, joints], axis=1)[kept])
    return _TimedWalk(
        path=path,
        times=times,
        ends=np.cumsum([1, *(len(m.durations) for m in moves)]) - 1,
        slowest=np.concatenate([*(m.slowest for m in moves), np.zeros(0, dtype=int)]),
    )


def _stance_moves(
    robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings, cogs: FloatArray
) -> list[TimedMove]:
    """Moves of the body on four feet, along straight lines.

    They go between COG targets ``(S + 1, 3)``, or where the body turns, between poses of the base
    ``(S + 1, 6)``.
    """
    if steps.tilts is not None:
        pose = turning_pose(robot, steps, cogs)
        return refined_moves(robot, settings, steps, pose, 1, SLIP_TOLERANCE, "stance")
    shifts = np.diff(cogs, axis=0)

    def level_pose(at: Knots) -> tuple[FloatArray, FloatArray, FloatArray]:
        body = cogs[at.step] + shifts[at.step] * at.share[:, None]
        feet = steps.feet[at.step]
        local = feet - body[:, None] + robot.centre
        joints = joints_from_feet_in_body(robot, local, order="F")
        for i, name in enumerate(LEGS):
            check_within_reach(robot.legs[name], local[:, i], at.step, steps)
        # The body is level, so that feet slip in its frame as they do in the world. In the middle
        # between two knots they are farthest from their places, since the path is a chord.
        # Rows of one coordinate: NumPy takes sums over three neighbours one by one.
        angles = ((joints[1:] + joints[:-1]) / 2.0).T
        places = feet[1:] - (body[1:] + body[:-1])[:, None] / 2.0 + robot.centre
        farthest = np.zeros(len(joints) - 1)
        for i, name in enumerate(LEGS):
            foot = robot.legs[name].forward_columns(*angles[list(robot.leg_columns[name])])
            x, y, z = (one - other for one, other in zip(foot, places[:, i].T, strict=True))
            np.maximum(farthest, x * x + y * y + z * z, out=farthest)
        return body, joints, np.sqrt(farthest)

    still = np.asarray(~shifts.any(axis=1))
    return refined_moves(robot, settings, steps, level_pose, 1, SLIP_TOLERANCE, "stance", still)


def _swing_moves(
    robot: Quadruped,
    steps: CrawlSteps,
    settings: CrawlSettings,
    cogs: FloatArray,
    stances: list[TimedMove],
) -> list[TimedMove]:
    """Swings of the feet while the body stands still at the COG targets ``cogs (S + 1, 3)``.

    In the result the ``body`` is the foot.
    """
    starts = steps.feet[np.arange(len(steps.legs)), steps.indices]
    corners = swing_polylines(settings.swing, starts, steps.targets, steps.lifts)
    edges = np.diff(corners, axis=1)
    # Angles of one joint stand side by side, which is faster where each joint is looked at.
    standing = np.array([s.joints[-1] for s in stances]).T.copy()

    def pose(at: Knots) -> tuple[FloatArray, FloatArray, FloatArray]:
        foot = corners[at.step, at.edge] + edges[at.step, at.edge] * at.share[:, None]
        turns = None if steps.turns is None else steps.turns[at.step + 1]
        local = feet_in_body(robot, foot[:, None], cogs[at.step + 1], turns)[:, 0]
        joints = np.take(standing, at.step, axis=1).T
        flying = steps.indices[at.step]
        errors = np.zeros(len(at.step) - 1)
        for i, name in enumerate(LEGS):
            mine = np.flatnonzero(flying == i)
            if not mine.size:
                continue
            leg, points = robot.legs[name], local[mine]
            check_within_reach(leg, points, at.step[mine], steps)
            angles = np.array(leg.inverse_columns(*points.T))
            for column, angle in zip(robot.leg_columns[name], angles, strict=True):
                joints[mine, column] = angle
            middle = leg.forward_columns(*((angles[:, 1:] + angles[:, :-1]) / 2.0))
            chord = ((points[1:] + points[:-1]) / 2.0).T
            x, y, z = (one - other for one, other in zip(middle, chord, strict=True))
            # Some of these pairs of knots are of different steps: refined_moves overwrites them.
            errors[mine[:-1]] = np.sqrt(x * x + y * y + z * z)
        return foot, joints, errors

    count = corners.shape[1] - 1
    return refined_moves(robot, settings, steps, pose, count, CHORD_TOLERANCE, "swing")
