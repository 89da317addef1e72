"""The time-optimal swing over the paper's board: how long it takes to find, and to fly."""

from __future__ import annotations

from collections.abc import Callable

from benchmarks.measuring import Result, Timing, timed
from gaitopt.errors import MissingPackageError
from gaitopt.optimize.spline import joint_spline
from gaitopt.optimize.spline import problem as spline_problem
from gaitopt.optimize.spline import solver as spline
from gaitopt.studies import swing_study as reference

GOAL, LIMIT = 50.0, 100.0
"""Tens of milliseconds for the spline of one swing [ms]."""


def measure_spline(quick: bool) -> list[Result]:
    """Splines through the paper's 13 waypoints, the whole swing, and references beside them."""
    rounds = 5 if quick else 50
    swing = reference.paper_swing()
    angles, limits = swing.spline.angles, reference.PAPER_LIMITS
    both, one = (timed(_solving(starts), rounds) for starts in (2, 1))
    whole = timed(reference.paper_swing, max(rounds // 5, 2))
    uniform = joint_spline.uniform_spline(angles, limits)
    ours = swing.spline.duration
    return [
        both.result("spline", "one spline, 13 knots, built and solved (2 starts)", "ms",
                    goal=GOAL, limit=LIMIT),
        one.result("spline-one-start", "the same from 1 start", "ms",
                   ratio=one.median / both.median),
        whole.result("spline-swing", "a swing over the board: path, splines, clearance", "ms"),
        timed(_fresh, 2 if quick else 5, warm_up=0).result(
            "spline-formulation", "formulation and IPOPT for a new number of knots", "ms"
        ),
        Result("spline-flight", "that swing's duration", "s", (ours,)),
        Result("spline-flight-uniform", "equal intervals, stretched: duration", "s",
               (uniform.duration,), ratio=uniform.duration / ours),
        *_toppra(both, ours, rounds),
    ]  # fmt: skip


def _solving(starts: int) -> Callable[[], joint_spline.JointSpline]:
    angles = reference.paper_swing().spline.angles

    def call() -> joint_spline.JointSpline:
        problem = spline_problem.build_spline_problem(angles, reference.PAPER_LIMITS)
        return spline.solve_spline(problem, starts)

    return call


def _fresh() -> None:
    """What the first spline of its size pays."""
    spline_problem.spline_formulation.cache_clear()
    spline._ipopt.cache_clear()
    spline._ipopt(13, 2)


def _toppra(solving: Timing, duration: float, rounds: int) -> list[Result]:
    """TOPP-RA through the same knots, where it is installed."""
    angles = reference.paper_swing().spline.angles
    try:
        found = reference.toppra_reference(angles, reference.PAPER_LIMITS)
    except MissingPackageError:
        return []
    timing = timed(
        lambda: reference.toppra_reference(angles, reference.PAPER_LIMITS), max(rounds // 5, 2)
    )
    return [
        timing.result("spline-toppra", "TOPP-RA through the same knots (no jerk bound)", "ms",
                      ratio=timing.median / solving.median),
        Result("spline-flight-toppra", "TOPP-RA: duration", "s", (found.duration,),
               ratio=found.duration / duration),
    ]  # fmt: skip
