"""The fastest swing of one leg over an obstacle: a joint spline whose foot curve clears it.

Source: [Shao2011], Section III. The path is in :mod:`gaitopt.swing.obstacle_paths`, the spline in
:mod:`gaitopt.optimize.spline.solver`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.motion.foot_curve import FootCurve
from gaitopt.optimize.spline.joint_spline import JointSpline
from gaitopt.optimize.spline.limits import JointLimits
from gaitopt.optimize.spline.problem import build_spline_problem
from gaitopt.optimize.spline.solver import solve_spline
from gaitopt.robots.leg import Leg
from gaitopt.swing.clearance import Clearance, clear_path
from gaitopt.swing.obstacle_paths import PAPER_COUNT, ObstaclePath, Pattern, Section

REACH_TOLERANCE = 1e-6
"""By how much a waypoint may lie out of a leg's reach [m]: the foot misses it by as much."""
LIMIT_TOLERANCE = 1e-9
"""By how much an angle may exceed a position limit [rad], for rounding."""


class ObstacleSwing(NamedTuple):
    """A swing over an obstacle.

    Attributes:
        path: the waypoints, and the path on which they lie.
        curve: what the foot flies; ``curve.joints`` is the joints' motion.
        clearance: of the curve from the obstacle with its margin.
    """

    path: ObstaclePath
    curve: FootCurve[JointSpline]
    clearance: Clearance

    @property
    def spline(self) -> JointSpline:
        """The joints' motion."""
        return self.curve.joints


def swing_angles(
    leg: Leg, waypoints: ArrayLike, position: ArrayLike, rotation: ArrayLike | None = None
) -> FloatArray:
    """Joint knots ``(n, nj)`` [rad] that take a foot to ``waypoints (n, 3)`` in the world [m].

    Args:
        leg: the leg.
        waypoints: places of the foot frame.
        position: of the body frame ``(3,)`` [m].
        rotation: body axes in the world ``(3, 3)``; the world's own by default.

    Raises:
        InputError: a waypoint is out of reach or needs a joint beyond its limits.
    """
    turn = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64)
    local = (
        np.asarray(waypoints, dtype=np.float64) - np.asarray(position, dtype=np.float64)
    ) @ turn
    short = leg.shortfall(local)
    worst = int(short.argmax())
    if not short[worst] <= REACH_TOLERANCE:
        raise InputError(
            f"waypoint {worst} is {short[worst]:.4g} m out of the reach of leg {leg.name}; move "
            "the body nearer, or take a lower or shorter path"
        )
    angles = leg.inverse(local)
    _check_positions(leg, angles, angles, "a waypoint")
    return angles


def solve_obstacle_swing(
    leg: Leg,
    start: ArrayLike,
    end: ArrayLike,
    obstacle: Section,
    limits: JointLimits,
    *,
    position: ArrayLike,
    rotation: ArrayLike | None = None,
    margin: float = 0.03,
    pattern: Pattern = "parabola",
    count: int = PAPER_COUNT,
    time_weight: float = 1.0,
    acceleration_weight: float = 0.0,
) -> ObstacleSwing:
    """The fastest swing of a leg over an obstacle, the body standing still.

    The foot's curve keeps ``margin`` from the obstacle at every instant, which
    :func:`gaitopt.swing.clearance.clear_path` proves. The foot is a point here: add the radius of
    the foot's ball to the margin.

    Args:
        leg: the leg that swings.
        start, end: where the foot frame lifts off and touches down ``(3,)`` [m].
        obstacle: the obstacle in between.
        limits: of the leg's joints.
        position, rotation: of the body, as in :func:`swing_angles`.
        margin, pattern, count: as in :func:`gaitopt.swing.obstacle_paths.obstacle_path`.
        time_weight, acceleration_weight: as in
            :func:`gaitopt.optimize.spline.problem.build_spline_problem`.

    Raises:
        InputError: no path, a waypoint out of reach, or a joint beyond its limits.
        SolverError: no spline was verified, or none that clears the obstacle.
    """
    turn = frozen(np.eye(3) if rotation is None else rotation)
    place = frozen(position)

    def fly(waypoints: FloatArray) -> FootCurve[JointSpline]:
        angles = swing_angles(leg, waypoints, place, turn)
        problem = build_spline_problem(
            angles, limits, time_weight=time_weight, acceleration_weight=acceleration_weight
        )
        spline = solve_spline(problem)
        _check_positions(leg, *spline.position_range(), "the swing between waypoints")
        return FootCurve(leg, spline, place, turn)

    return ObstacleSwing(
        *clear_path(fly, start, end, obstacle, margin, pattern=pattern, count=count)
    )


def _check_positions(leg: Leg, low: FloatArray, high: FloatArray, what: str) -> None:
    """Raise :class:`InputError` for angles beyond a leg's position limits."""
    least, most = leg.position_limits
    beyond = np.maximum(least - low, high - most).reshape(-1, len(leg.joints)).max(axis=0)
    joint = int(beyond.argmax())
    if beyond[joint] > LIMIT_TOLERANCE:
        raise InputError(
            f"{what} takes joint {leg.joints[joint]} {np.degrees(beyond[joint]):.3g} degrees "
            "beyond its limits; move the body, or take a lower or shorter path"
        )
