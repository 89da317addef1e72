"""What a smooth motion asks of joints and ground between its knots, and stricter rows for it.

Joints follow from the control points by inverse kinematics, which is not linear. So between knots a
joint may need more velocity or acceleration than its row sees at the knots, and the ZMP may be
elsewhere. Therefore the motion through a solution is measured. In the first rounds the limit in
each row is what is allowed, minus what the motion asks for beyond the value that the row sees: some
rows become stricter, others less strict. In later rounds limits are only tightened, and only where
the motion still asks for too much, so that solutions converge. What is left is removed by
stretching the motion in time a little.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.motion.retiming import needed_stretch
from gaitopt.optimize.route.dynamic_layout import interval_times
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.optimize.route.legs import BODY, JOINTS
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.smooth.window import SmoothWindow
from gaitopt.stability.zmp import point_mass_zmp

JOINT_RESERVE = 1e-3
"""Share of the joints' limits that is kept in reserve."""
ZMP_RESERVE = 3e-5
"""Length that is added to the margin of the ZMP in reserve [m]."""
MARGIN_RESERVE = 2e-5
"""Margin of the centre of mass beyond what is asked for that is left as it is [m]."""
MARGIN_LOWERED_SHARE = 0.7
"""Share of what is beyond it by which rows are lowered. Walks of wang2020 (16 steps, seeds 0 to 3)
came out 0.2 % (``swing``) and 0.3 % (``height``) faster than with 0. With 0.8 motions missed up to
0.2 mm, and took a round more."""
MOVES, MOVE_SHARE, MOST_MOVED = 3, 1.3, 1e-4
"""How often control points of the body are moved inward at most where a motion misses a little of
its margin, by how much of what is missing, and how much that may be at most [m]."""
HOLDING = 2e-4
"""Value of a row of the centre of mass below which it counts as one that holds the motion [m]."""
TIGHTENING_RESERVES = 2.0
"""How many reserves are kept where limits are only tightened."""
MOST_STRETCH = 1.005
"""Most that time is stretched in the end."""
LIMIT_OVERCORRECTION = 1.5
"""How many times what is too much is taken off a limit, once limits are only tightened."""
MOST_CORRECTION = 0.1
"""Most by which a row of the ZMP is corrected at once [m]."""
LEAST_LIMIT_SHARE, MOST_LIMIT_SHARE = -0.75, 1.75
"""Range of the limits in rows, as shares of the joints' limits.

They may be negative: where the map from poses to joints is curved, a joint accelerates although
the body moves evenly, and the values that the row sees must make up for it.
"""


def with_corrected_limits(
    problem: DynamicRouteProblem, window: SmoothWindow, motion: SplineMotion
) -> DynamicRouteProblem:
    """The problem with limits in its rows by which this motion would just keep all limits.

    Args:
        problem: whose solution gave the motion.
        window: what is planned.
        motion: the window's, through the solution.
    """
    first, demand = window.first_knot, motion.joint_demand
    seen = _demand_in_rows(motion)
    limits = []
    for (full, usable), asked, at_knots in zip(
        _usable_limits(problem, window, window.reserves), demand, seen, strict=True
    ):
        beyond = (asked - np.stack([at_knots, -at_knots]))[:, first:]
        limits.append(np.clip(usable - beyond, LEAST_LIMIT_SHARE * full, MOST_LIMIT_SHARE * full))
    zmp = problem.zmp
    if len(zmp.knot):
        knot = zmp.knot + first
        # A row sees the control point of the body centre, with the acceleration of its span.
        centre, acceleration = motion.poses[knot, BODY], 2.0 * motion.parabolas[0, knot, BODY]
        seen_there = np.where(
            np.isfinite(zmp.gravity)[:, None],
            point_mass_zmp(centre, acceleration, zmp.ground), centre[:, :2],
        )  # fmt: skip
        at_knot = (zmp.normal * seen_there).sum(axis=1)
        beyond = at_knot - _least_along_normals(problem, window, motion)
        # Where the ground bears almost no load the ZMP says nothing.
        beyond = np.clip(np.nan_to_num(beyond, nan=0.0), -MOST_CORRECTION, MOST_CORRECTION)
        reserve = ZMP_RESERVE * window.reserves[zmp.knot]
        zmp = zmp._replace(offset=zmp.least + reserve + beyond)
    return replace(
        problem, interval_velocity_limits=limits[0], acceleration_limits=limits[1], zmp=zmp
    )


def with_tightened_limits(
    problem: DynamicRouteProblem, window: SmoothWindow, motion: SplineMotion
) -> DynamicRouteProblem:
    """The problem with stricter limits in its rows only where the motion asks for too much.

    Corrections move the solution, which then needs other corrections. Here most rows stay as they
    are, so that solutions converge. Arguments as for :func:`with_corrected_limits`.
    """
    reserves = TIGHTENING_RESERVES * window.reserves
    limits = []
    for (full, usable), asked, old in zip(
        _usable_limits(problem, window, reserves),
        motion.joint_demand,
        (problem.interval_velocity_limits, problem.acceleration_limits),
        strict=True,
    ):
        excess = np.maximum(asked[:, window.first_knot :] - usable, 0.0)
        limits.append(np.maximum(old - LIMIT_OVERCORRECTION * excess, LEAST_LIMIT_SHARE * full))
    zmp = problem.zmp
    if len(zmp.knot):
        wanted = zmp.least + TIGHTENING_RESERVES * ZMP_RESERVE * window.reserves[zmp.knot]
        missing = np.maximum(wanted - _least_along_normals(problem, window, motion), 0.0)
        missing = np.minimum(np.nan_to_num(missing, nan=0.0), MOST_CORRECTION)
        zmp = zmp._replace(offset=zmp.offset + LIMIT_OVERCORRECTION * missing)
    return replace(
        problem, interval_velocity_limits=limits[0], acceleration_limits=limits[1], zmp=zmp
    )


def with_corrected_margins(
    problem: DynamicRouteProblem, window: SmoothWindow, motion: SplineMotion, *, only_upward: bool
) -> DynamicRouteProblem:
    """The problem with other rows of the true centre of mass.

    Rows look at control points. The centre of mass stays inside of these where the body turns, and
    between them it may be elsewhere by a little.

    Args:
        problem: whose solution gave the motion.
        window: what is planned.
        motion: the window's, through the solution.
        only_upward: raise rows only, where margin is missing; else those that hold the motion are
            also lowered where it has more than is asked for.
    """
    if problem.com is None:
        return problem
    missing, holding = _missing_margins(problem, window, motion)
    raised = LIMIT_OVERCORRECTION * np.maximum(missing, 0.0)
    if not only_upward:
        too_much = np.maximum(-missing - MARGIN_RESERVE, 0.0)
        raised -= np.where(holding, MARGIN_LOWERED_SHARE * too_much, 0.0)
    return replace(problem, com=problem.com.raised(raised))


def with_body_moved_inward(
    problem: DynamicRouteProblem, window: SmoothWindow, motion: SplineMotion
) -> SplineMotion:
    """The motion with its body inside the polygons by the little that its margin misses.

    A round more would mend it, too, but costs as much as others.

    Args:
        problem: whose solution gave the motion.
        window: what is planned, a whole walk.
        motion: through the solution.

    Returns:
        The same motion where more than :data:`MOST_MOVED` is missing, or nothing.
    """
    com = problem.com
    if com is None:
        return motion
    for _ in range(MOVES):
        missing, holding = _missing_margins(problem, window, motion)
        # The reserve is for what is missing between samples: up to 6 um in walks of wang2020.
        short = missing + MARGIN_RESERVE
        if not 0.0 < short.max(initial=0.0) <= MOST_MOVED + MARGIN_RESERVE:
            break
        size = np.where(holding & (short > 0.0), MOVE_SHARE * short, 0.0)
        poses = motion.poses.copy()
        np.add.at(poses[:, :2], com.knot, size[:, None] * com.normal)
        motion = replace(motion, poses=poses)
    return motion


def _missing_margins(
    problem: DynamicRouteProblem, window: SmoothWindow, motion: SplineMotion
) -> tuple[FloatArray, BoolArray]:
    """Margin of the true centre of mass that is missing about each of its rows ``(M,)`` [m].

    Also which of them hold the motion ``(M,)``. Arguments as for :func:`with_corrected_margins`.
    """
    com, first = problem.com, window.first_knot
    assert com is not None
    missing = window.wanted_margins(motion) - motion.margins(dynamic=False)[first:]
    around = np.pad(missing, 1, constant_values=-np.inf)
    near = np.maximum(missing, np.maximum(around[:-2], around[2:]))[com.knot]
    poses, knots = motion.poses, motion.knots
    joints = motion.legs.joints(poses, knots.feet, knots.in_air)
    values = com.values(com.masses.com(poses, joints)[first:])
    return near, values < HOLDING


def _usable_limits(
    problem: DynamicRouteProblem, window: SmoothWindow, reserves: FloatArray
) -> list[tuple[FloatArray, FloatArray]]:
    """Limits of velocities and of accelerations, and what of them may be used.

    Args:
        problem, window: what is planned.
        reserves: how many reserves to keep at each knot ``(K,)``.

    Returns:
        For velocities ``(12,)`` and ``(K - 1, 12)``, for accelerations ``(K, 12)`` twice.
    """
    velocity = problem.velocity_limits
    acceleration = np.repeat(window.turn_limits[:, None], JOINTS, axis=1)
    between = np.maximum(reserves[1:], reserves[:-1])
    return [
        (velocity, (1.0 - JOINT_RESERVE * between[:, None]) * velocity),
        (acceleration, (1.0 - JOINT_RESERVE * reserves[:, None]) * acceleration),
    ]


def _demand_in_rows(motion: SplineMotion) -> tuple[FloatArray, FloatArray]:
    """Joint velocities ``(K - 1, 12)`` and accelerations ``(K, 12)`` as rows of the problem see.

    They follow from differences of the joint angles in the poses at knots.
    """
    knots = motion.knots
    joints = motion.legs.joints(motion.poses, knots.feet, knots.in_air).reshape(-1, JOINTS)
    velocity = np.diff(joints, axis=0) / interval_times(motion.spans[:-1])[:, None]
    rest = np.zeros((1, JOINTS))
    changes = np.diff(np.concatenate([rest, velocity, rest]), axis=0)
    return velocity, changes / motion.spans[:, None]


def _least_along_normals(
    problem: DynamicRouteProblem, window: SmoothWindow, motion: SplineMotion
) -> FloatArray:
    """Least ``normal . zmp`` on the span of each of the ZMP's rows ``(M,)`` [m].

    As the motion is now, and with all the stretch that it may get: this moves the ZMP. Where forces
    set the timing it gets none. Rows of infinite gravity are about the centre of mass.
    """
    zmp, knot = problem.zmp, problem.zmp.knot + window.first_knot
    static = np.isinf(zmp.gravity)
    # The centre of mass is where it is, however the motion is stretched.
    centres = motion.centres_of_mass[knot[static]] if static.any() else None
    found, forces = [], window.route.settings.forces is not None
    for one in (motion,) if forces else (motion, motion.slower(MOST_STRETCH)):
        points = one.zero_moment_points[knot]
        if centres is not None:
            points[static] = centres
        found.append(np.einsum("mi,msi->ms", zmp.normal, points).min(axis=1))
    return np.asarray(np.minimum.reduce(found))


def sampled_stretch(window: SmoothWindow, motion: SplineMotion) -> float:
    """Factor by which the motion's time must grow so that joints keep their limits at samples.

    Below 1 where the motion may be faster.
    """
    velocities, accelerations = motion.joint_demand.since(window.first_knot)
    return needed_stretch(
        (velocities / window.problem.velocity_limits).max(),
        accelerations.max() / window.acceleration_limit,
    )
