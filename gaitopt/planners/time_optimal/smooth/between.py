"""What a smooth motion asks of joints and ground between its knots, and how a problem learns of it.

The problem sees knots. The motion through its solution is measured, and what joints and ZMP ask for
beyond what the problem saw is taken off the room that its rows have; then it is solved again. So
rows are neither too tight nor too loose. After a few rounds rooms are only made tighter, and only
where there is still too little. A last small stretch of time takes what is left.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.dynamic_layout import interval_times
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.optimize.route.legs import JOINTS
from gaitopt.planners.time_optimal.smooth.motion import RouteMotion
from gaitopt.stability.zmp import point_mass_zmp

SPARE = 1e-3
"""Share of the joints' limits that is kept in reserve."""
ZMP_SPARE = 3e-5
"""The same for the ZMP's margin [m]."""
MOST_STRETCH = 1.005
"""Most that time is stretched in the end."""
HASTE = 1.5
"""How many times what is too much is taken off the room, once rooms are tightened only."""
_LEAST_SHARE, _MOST_SHARE = -0.75, 1.75
"""Range of rooms in shares of the limits: where the map to joints is curved, a steady body
accelerates them, and what knots see must even slow them down."""


def corrected(
    problem: DynamicRouteProblem, motion: RouteMotion, skip: int, limit: float, reserve: FloatArray
) -> DynamicRouteProblem:
    """The problem with the room that leaves the motion through its solution within its limits.

    Args:
        problem: whose solution gave the motion.
        motion: the solution's, with so many knots before it as ``skip`` says.
        skip: spans of the motion that are not the problem's.
        limit: of joint accelerations [rad/s^2].
        reserve: how many spares to keep at each of the problem's knots ``(K,)``.
    """
    rooms = []
    limits = _reserved(problem, limit, reserve)
    for (most, wanted), asked, seen in zip(limits, motion.asked, _seen(motion), strict=True):
        extra = (asked - np.stack([seen, -seen]))[:, skip:]
        rooms.append(np.clip(wanted - extra, _LEAST_SHARE * most, _MOST_SHARE * most))
    zmp = problem.zmp
    if len(zmp.knot):
        at = zmp.knot + skip
        # What the problem sees is the body centre's control point, with the span's acceleration.
        centre, pull = motion.poses[at, :3], 2.0 * motion.pieces[0, at, :3]
        seen = (zmp.normal * point_mass_zmp(centre, pull, zmp.ground)).sum(axis=1)
        wander = seen - _least_along(problem, motion, skip)
        zmp = zmp._replace(offset=zmp.least + ZMP_SPARE * reserve[zmp.knot] + wander)
    return replace(
        problem, interval_velocity_limits=rooms[0], acceleration_limits=rooms[1], zmp=zmp
    )


def tightened(
    problem: DynamicRouteProblem, motion: RouteMotion, skip: int, limit: float, reserve: FloatArray
) -> DynamicRouteProblem:
    """The problem with less room only where the motion through its solution asks for too much.

    Corrections move the solution, which asks for other corrections. These leave most rows as they
    are, so the solution settles. Arguments as for :func:`corrected`.
    """
    rooms = []
    limits, old = (
        _reserved(problem, limit, 2.0 * reserve),
        (problem.interval_velocity_limits, problem.acceleration_limits),
    )
    for (most, wanted), asked, room in zip(limits, motion.asked, old, strict=True):
        over = np.maximum(asked[:, skip:] - wanted, 0.0)
        rooms.append(np.maximum(room - HASTE * over, _LEAST_SHARE * most))
    zmp = problem.zmp
    if len(zmp.knot):
        short = (
            zmp.least + 2.0 * ZMP_SPARE * reserve[zmp.knot] - _least_along(problem, motion, skip)
        )
        zmp = zmp._replace(offset=zmp.offset + HASTE * np.maximum(short, 0.0))
    return replace(
        problem, interval_velocity_limits=rooms[0], acceleration_limits=rooms[1], zmp=zmp
    )


def _reserved(
    problem: DynamicRouteProblem, limit: float, reserve: FloatArray
) -> list[tuple[FloatArray, FloatArray]]:
    """Limits of velocities and accelerations ``(12,)``, and what of them may be used.

    The latter between each two knots and at each, ``(K - 1, 12)`` and ``(K, 12)``.
    """
    most = np.full(JOINTS, limit)
    between = np.maximum(reserve[1:], reserve[:-1])
    return [
        (problem.velocity_limits, (1.0 - SPARE * between[:, None]) * problem.velocity_limits),
        (most, (1.0 - SPARE * reserve[:, None]) * most),
    ]


def _seen(motion: RouteMotion) -> tuple[FloatArray, FloatArray]:
    """Joint velocities ``(K - 1, 12)`` and accelerations ``(K, 12)`` as the problem sees them."""
    knots = motion.knots
    joints = motion.legs.joints(motion.poses, knots.feet, knots.flying).reshape(-1, JOINTS)
    velocity = np.diff(joints, axis=0) / interval_times(motion.spans[:-1])[:, None]
    rest = np.zeros((1, JOINTS))
    jumps = np.diff(np.concatenate([rest, velocity, rest]), axis=0)
    return velocity, jumps / motion.spans[:, None]


def _least_along(problem: DynamicRouteProblem, motion: RouteMotion, skip: int) -> FloatArray:
    """How far within their spans the ZMP is along the rows' normals, at least ``(M,)`` [m].

    The motion may yet be stretched a little, which moves its ZMP.
    """
    zmp = problem.zmp
    found = [
        np.einsum("mi,msi->ms", zmp.normal, m.zero_moment_points()[zmp.knot + skip]).min(axis=1)
        for m in (motion, motion.slower(MOST_STRETCH))
    ]
    return np.asarray(np.minimum(*found))


def stretch_needed(motion: RouteMotion, skip: int, rates: FloatArray, limit: float) -> float:
    """How much longer the motion must take for all joints to keep their limits, as sampled.

    Below 1 where there is room.
    """
    use, bends = (part[:, skip:] for part in motion.asked)
    return float(max((use / rates).max(), np.sqrt(bends.max() / limit)))
