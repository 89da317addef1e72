"""The timed plan of a walk over an obstacle, from its postures and footholds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, Progress, leg_index
from gaitopt.motion.bounds import largest_sizes
from gaitopt.motion.foot_curve import FootCurve, LegOfPath
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import joined
from gaitopt.optimize.posture.problem import BodyPose
from gaitopt.optimize.spline.limits import JointLimits
from gaitopt.optimize.spline.obstacle_swing import solve_obstacle_swing
from gaitopt.plan.phase import Limit, Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import StrideRecord
from gaitopt.planners.over_obstacle.pieces import (
    StrideLimits,
    body_move,
    leg_limits,
    open_ground_swing,
    spline_swing,
    without_end_accelerations,
)
from gaitopt.planners.over_obstacle.route import Step, StrideRoute
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.stability.energy import energy_stability_margin
from gaitopt.stability.margins import static_stability_margin
from gaitopt.swing.clearance import least_clearance

ACTIVE_SHARE = 0.999
"""Share of its limit from which a joint counts as one that limits a phase."""
CENTRE_SAMPLES = 9
"""Samples of a piece at which the margin of the body centre is taken; chosen here."""
_KINDS = {1: "joint velocity", 2: "joint acceleration", 3: "joint jerk"}


class Piece(NamedTuple):
    """A part of the motion: a move of the body, or a swing.

    Attributes:
        number: index of the step to which it belongs; the number of steps for the last move.
        leg: the leg that flies, ``""`` for a move.
        path: body and joints; ``None`` for a move between equal poses.
        start, end: the body's poses.
        feet: where the feet are before it ``(4, 3)`` [m].
    """

    number: int
    leg: str
    path: MotionPath | None
    start: BodyPose
    end: BodyPose
    feet: FloatArray


def pieces_of(route: StrideRoute, progress: Progress | None = None) -> list[Piece]:
    """All moves and swings of a walk, with their timing.

    Raises:
        SolverError: a swing was not solved.
        InputError: a swing has no path, or its curve breaks a joint's limits.
    """
    settings, robot = route.settings, route.robot
    limits = leg_limits(robot, settings.accelerations, settings.jerks)
    pose, pieces = route.start, []
    for k, step in enumerate(route.steps):
        move = body_move(robot, pose, step.pose, step.feet, limits)
        pieces.append(Piece(k, "", move, pose, step.pose, step.feet))
        flight = _swing(route, step, limits)
        pieces.append(Piece(k, step.leg, flight, step.pose, step.pose, step.feet))
        pose = step.pose
        if progress is not None:
            progress(k + 1, len(route.steps))
    feet = route.footholds.array[:, -1]
    last = body_move(robot, pose, route.end, feet, limits)
    if last is not None:
        pieces.append(Piece(len(route.steps), "", last, pose, route.end, feet))
    return pieces


def _swing(route: StrideRoute, step: Step, limits: StrideLimits) -> MotionPath:
    """The timed swing of a step."""
    robot, settings = route.robot, route.settings
    if not step.over:
        return open_ground_swing(
            robot, step.pose, step.feet, step.leg, step.target, settings.swing_height, limits
        )
    columns = list(robot.leg_columns[step.leg])
    found = solve_obstacle_swing(
        robot.legs[step.leg], step.feet[leg_index(step.leg)], step.target, route.raised,
        JointLimits(limits.velocity[columns], limits.acceleration[columns], limits.jerk[columns]),
        position=step.pose.origin(robot), rotation=step.pose.axes, margin=route.foot_margin,
        pattern=settings.pattern, count=settings.waypoints,
    )  # fmt: skip
    path = spline_swing(robot, step.pose, step.feet, step.leg, found.spline, limits)
    return without_end_accelerations(path, limits) if settings.jerks else path


def foot_margin(route: StrideRoute, pieces: list[Piece]) -> float:
    """Distance from the obstacle that the balls of the feet keep in all swings over it [m].

    Proven for every instant, on the final paths.
    """
    robot, least = route.robot, np.inf
    for piece in pieces:
        if piece.path is None or not piece.leg or not route.steps[piece.number].over:
            continue
        joints = LegOfPath(piece.path, robot.leg_columns[piece.leg])
        pose = piece.end
        foot = FootCurve(robot.legs[piece.leg], joints, pose.origin(robot), pose.axes)
        least = min(least, least_clearance(foot, route.obstacle).proven)
    return least - robot.foot_radius


def plan_of(route: StrideRoute, pieces: list[Piece], record: StrideRecord) -> Plan:
    """The plan made of timed pieces."""
    limits = leg_limits(route.robot, route.settings.accelerations, route.settings.jerks)
    paths = [piece.path for piece in pieces if piece.path is not None]
    path = joined(paths) if paths else still_path(route)
    phases, start = [], 0.0
    for piece in pieces:
        duration = 0.0 if piece.path is None else piece.path.duration
        phases.append(_phase(route, piece, start, duration, limits))
        start += duration
    return Plan(route.robot, route.footholds, route.settings, tuple(phases), path, record)


def still_path(route: StrideRoute) -> MotionPath:
    """The path of a robot that only stands."""
    from gaitopt.robots.whole_body import joints_from_feet

    base = route.start.base(route.robot)
    joints = joints_from_feet(route.robot, base[:3], base[3:], route.footholds.array[:, 0])
    return MotionPath(np.zeros(1), np.concatenate([base, joints])[None, None])


def energy_margin(route: StrideRoute) -> float:
    """Least energy that tips the robot over in any swing [J], by the NESM of the body centre."""
    feet = np.array([s.feet for s in route.steps])
    contacts = np.array([[leg != s.leg for leg in LEGS] for s in route.steps])
    centres = np.array([s.pose.centre for s in route.steps])
    return float(energy_stability_margin(feet, centres, route.robot.mass, contacts).min())


def _phase(
    route: StrideRoute, piece: Piece, start: float, duration: float, limits: StrideLimits
) -> Phase:
    flying = bool(piece.leg)
    last = piece.number == len(route.steps)
    leg = "" if last else route.steps[piece.number].leg
    i = leg_index(leg or LEGS[0])
    support = tuple(name for name in LEGS if name != piece.leg)
    standing = piece.feet[[leg_index(name) for name in support]]
    centres = _centres(route.robot, piece)
    end = route.steps[piece.number].target if flying else piece.feet[i]
    return Phase(
        "swing" if flying else "stance", leg, piece.number, start, duration, centres[0],
        centres[-1], support, piece.feet[i], end,
        float(static_stability_margin(standing, centres).min()),
        _limited_by(route.robot, piece, start, limits),
    )  # fmt: skip


def _centres(robot: Quadruped, piece: Piece) -> FloatArray:
    """Places of the body centre at samples of a piece ``(n, 3)`` [m]."""
    if piece.path is None:
        return np.array([piece.start.centre, piece.end.centre])
    base = piece.path.evaluate(np.linspace(0.0, piece.path.duration, CENTRE_SAMPLES))[:, :6]
    turned = rpy_to_matrix(base[:, 3:]) @ robot.body_axes
    return np.asarray(base[:, :3] + turned @ robot.centre)


def _limited_by(
    robot: Quadruped, piece: Piece, start: float, limits: StrideLimits
) -> tuple[Limit, ...]:
    """Joints that reach a limit during a piece, with the times and their share of the piece."""
    if piece.path is None:
        return ()
    times = piece.path.times
    found = []
    for order, bound in enumerate((limits.velocity, limits.acceleration, limits.jerk), start=1):
        active = largest_sizes(piece.path, order)[:, BASE_COLUMNS:] >= ACTIVE_SHARE * bound
        for joint in np.flatnonzero(active.any(axis=0)).tolist():
            spans = tuple(
                (start + float(times[k]), start + float(times[k + 1]))
                for k in np.flatnonzero(active[:, joint])
            )
            share = sum(b - a for a, b in spans) / piece.path.duration
            found.append(Limit(_KINDS[order], robot.joint_names[joint], share, spans))
    return tuple(sorted(found, key=lambda limit: -limit.value))
