"""The swing over a board of [Shao2011], compared with other splines and with TOPP-RA.

``python -m gaitopt.studies.swing_study`` prints the table. The paper gives the board, the margin,
the number of waypoints, the limits and the resulting intervals, but no link lengths, stride or
waypoints. So its intervals belong to other knots than ours, and only the total times can be
compared. Chosen here: frog1 with its hips 0.72 m above the foot frames, the board below the hip, a
stride of 0.40 m with the board in its middle, and a foot without size.

Source: [Shao2011], Section V.A and Table I.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import MissingPackageError, SolverError
from gaitopt.optimize.spline.clamped import checked_angles
from gaitopt.optimize.spline.joint_spline import JointSpline, uniform_spline
from gaitopt.optimize.spline.limits import JointLimits
from gaitopt.optimize.spline.obstacle_swing import ObstacleSwing, solve_obstacle_swing
from gaitopt.optimize.spline.problem import build_spline_problem
from gaitopt.optimize.spline.solver import solve_spline
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.leg import Leg
from gaitopt.swing.obstacle_paths import PATTERNS, Pattern
from gaitopt.terrain.obstacles import rectangular_obstacle

PAPER_INTERVALS: Final[FloatArray] = frozen([
    0.7135, 0.8235, 0.9064, 0.7554, 0.5917, 0.4912, 0.4739, 0.4993, 0.7962, 0.8531, 0.7611, 0.8329,
])  # fmt: skip
"""The paper's optimal intervals [s]; they sum to its 8.4982 s."""
PAPER_LIMITS: Final[JointLimits] = JointLimits(
    velocity=np.radians([10.0, 20.0]),
    acceleration=np.radians([20.0, 20.0]),
    jerk=np.radians([40.0, 50.0]),
)
"""Table I, for hip and knee."""
BOARD_HEIGHT, BOARD_WIDTH, BOARD_MARGIN = 0.11, 0.04, 0.03
"""The paper's board and safety margin [m]."""
STRIDE, HIP_HEIGHT = 0.40, 0.72
"""Distance from lift-off to touchdown, and height of the hip over the foot frame [m]."""

_GRID = 1001
"""Grid points of TOPP-RA; with twice as many our own curve takes 0.14 % less."""


class ToppraResult(NamedTuple):
    """The fastest timing of one curve by TOPP-RA, with limits of velocity and acceleration.

    Attributes:
        duration: of the curve [s].
        velocity, acceleration: largest share of its limit on the curve that TOPP-RA returned.
        seconds: computing time [s].
    """

    duration: float
    velocity: float
    acceleration: float
    seconds: float


class Reference(NamedTuple):
    """One row of the table.

    Attributes:
        name: of the spline or curve.
        duration: total time [s].
        shares: largest velocity, acceleration and jerk on the whole curve over their limits;
            NaN where unknown.
    """

    name: str
    duration: float
    shares: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class SplineComparison:
    """Splines of the paper's case.

    Attributes:
        swing: our swing in least time.
        paper_cost: the spline of the paper's objective, eq. (7) with its weights 2 and 1.
        uniform: the spline with equal intervals, stretched until all limits are kept.
        rows: of the table.
        intervals: ours and the paper's ``(12, 2)`` [s].
    """

    swing: ObstacleSwing
    paper_cost: JointSpline
    uniform: JointSpline
    rows: tuple[Reference, ...]
    intervals: FloatArray

    def table(self) -> str:
        """The comparison as text."""
        ours = self.swing.spline.duration
        lines = [
            f"{'swing over the board':52}{'time [s]':>9}{'to ours':>9}"
            f"{'largest v, a, j / limit':>27}"
        ]
        for row in self.rows:
            shares = "".join(f"{'-' if np.isnan(s) else f'{s:.4f}':>9}" for s in row.shares)
            lines.append(f"{row.name:52}{row.duration:9.4f}{row.duration / ours:9.3f}{shares}")
        lines += ["", f"{'interval':>8}{'ours [s]':>10}{'paper [s]':>11}"]
        for k, (here, there) in enumerate(self.intervals):
            lines.append(f"{k + 1:8d}{here:10.4f}{there:11.4f}")
        lines.append(
            f"{'sum':>8}{self.intervals[:, 0].sum():10.4f}{self.intervals[:, 1].sum():11.4f}"
        )
        return "\n".join(lines)


def paper_swing(pattern: Pattern = "parabola", count: int = 13) -> ObstacleSwing:
    """The fastest swing of frog1's right front leg over the paper's board."""
    leg = _front_leg()
    board = rectangular_obstacle(BOARD_HEIGHT, BOARD_WIDTH)
    start, end = (np.array([x, 0.0, 0.0]) for x in (-STRIDE / 2.0, STRIDE / 2.0))
    return solve_obstacle_swing(
        leg, start, end, board, PAPER_LIMITS, position=np.array([0.0, 0.0, HIP_HEIGHT]) - leg.hip,
        margin=BOARD_MARGIN, pattern=pattern, count=count,
    )  # fmt: skip


def compare_splines(*, with_toppra: bool = True) -> SplineComparison:
    """Compute our spline, and all that it is compared with.

    Args:
        with_toppra: whether TOPP-RA is part of the comparison.

    Raises:
        MissingPackageError: it is, and is not installed.
    """
    swing = paper_swing()
    ours = swing.spline
    weighted = solve_spline(
        build_spline_problem(ours.angles, PAPER_LIMITS, time_weight=2.0, acceleration_weight=1.0)
    )
    uniform = uniform_spline(ours.angles, PAPER_LIMITS)
    proportions = uniform_spline(ours.angles, PAPER_LIMITS, PAPER_INTERVALS)
    unknown = float("nan"), float("nan"), float("nan")
    rows = [
        _row("ours, least time", ours),
        _row("ours, eq. (7) with the paper's weights", weighted),
        Reference("the paper's, on its own knots", float(PAPER_INTERVALS.sum()), unknown),
        _row("the paper's intervals on our knots, stretched", proportions),
        _row("equal intervals, stretched (by hand)", uniform),
    ]
    rows += [
        _row(f"ours, least time, {pattern} path", paper_swing(pattern).spline)
        for pattern in PATTERNS
        if pattern != "parabola"
    ]
    if with_toppra:
        dense = ours.evaluate(np.linspace(0.0, ours.duration, 401))
        rows += [
            _toppra_row("TOPP-RA, a spline through the same knots, no jerk", ours.angles),
            _toppra_row("TOPP-RA, along our own curve, no jerk", dense),
        ]
    floor = velocity_bound(ours.angles, PAPER_LIMITS)
    rows.append(Reference("no curve through these knots can be faster than", floor, unknown))
    return SplineComparison(
        swing, weighted, uniform, tuple(rows),
        frozen(np.column_stack([ours.intervals, PAPER_INTERVALS])),
    )  # fmt: skip


def toppra_reference(angles: ArrayLike, limits: JointLimits) -> ToppraResult:
    """The fastest timing of the spline by chord length through ``angles``, by TOPP-RA [Pham2018].

    It starts and ends at rest, and has limits of velocity and acceleration on a grid, but none of
    jerk. So its time is nearly a lower bound for that one curve.

    Args:
        angles: points to pass through ``(n, nj)`` [rad].
        limits: of the same joints.

    Raises:
        MissingPackageError: ``toppra`` is not installed.
        SolverError: TOPP-RA found no timing.
    """
    try:
        toppra, algorithm, constraint = (
            import_module(name) for name in ("toppra", "toppra.algorithm", "toppra.constraint")
        )
    except ImportError as error:
        raise MissingPackageError(
            "the TOPP-RA reference needs the package toppra: pip install toppra"
        ) from error
    q = checked_angles(angles, limits)
    begun = time.perf_counter()
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    bounds = [
        constraint.JointVelocityConstraint(_both_ways(limits.velocity)),
        constraint.JointAccelerationConstraint(_both_ways(limits.acceleration)),
    ]
    grid = np.linspace(0.0, along[-1], _GRID)
    solver = algorithm.TOPPRA(
        bounds, toppra.SplineInterpolator(along, np.array(q)), gridpoints=grid,
        parametrizer="ParametrizeConstAccel",
    )  # fmt: skip
    motion = solver.compute_trajectory(0.0, 0.0)
    seconds = time.perf_counter() - begun
    if motion is None:
        raise SolverError(
            f"TOPP-RA found no timing of the curve through {len(q)} knots; use fewer or smoother "
            "ones"
        )
    times = np.linspace(0.0, float(motion.duration), 20 * _GRID)
    return ToppraResult(
        float(motion.duration),
        float((np.abs(motion(times, 1)) / limits.velocity).max()),
        float((np.abs(motion(times, 2)) / limits.acceleration).max()),
        seconds,
    )


def velocity_bound(angles: ArrayLike, limits: JointLimits) -> float:
    """Lower bound of the time of any curve through ``angles (n, nj)`` [s], by velocity limits."""
    steps = np.abs(np.diff(checked_angles(angles, limits), axis=0))
    return float((steps / limits.velocity).max(axis=1).sum())


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table, without TOPP-RA when it is not installed."""
    try:
        comparison, note = compare_splines(), ""
    except MissingPackageError as missing:
        comparison, note = compare_splines(with_toppra=False), f"\n{missing}"
    print(comparison.table() + note)
    return 0


@cache
def _front_leg() -> Leg:
    return load_robot("frog1").legs["RF"]


def _row(name: str, spline: JointSpline) -> Reference:
    """The table's row of a joint spline."""
    velocity, acceleration, jerk = (float(kind.max()) for kind in spline.shares)
    return Reference(name, spline.duration, (velocity, acceleration, jerk))


def _toppra_row(name: str, angles: FloatArray) -> Reference:
    """The table's row of TOPP-RA's timing of a curve."""
    result = toppra_reference(angles, PAPER_LIMITS)
    shares = result.velocity, result.acceleration, float("nan")
    return Reference(name, result.duration, shares)


def _both_ways(limit: FloatArray) -> FloatArray:
    """Lower and upper limits ``(n, 2)``."""
    return np.column_stack([-limit, limit])


if __name__ == "__main__":
    raise SystemExit(main())
