"""Rounds of a smooth walk: solve, measure the motion between knots, change rows, solve again."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.solver import VIOLATION, Solution, minimise
from gaitopt.motion.path import MotionPath
from gaitopt.motion.retiming import legs_needed_stretch
from gaitopt.optimize.route.carried import carried_multipliers
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.planners.time_optimal.collision import touching_pairs, with_distance_rows
from gaitopt.planners.time_optimal.failure import Reason, route_error
from gaitopt.planners.time_optimal.smooth.between import (
    MOST_STRETCH,
    sampled_stretch,
    with_body_moved_inward,
    with_corrected_limits,
    with_corrected_margins,
    with_tightened_limits,
)
from gaitopt.planners.time_optimal.smooth.clearance import clearance_is_kept, with_raised_heights
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.smooth.window import SmoothWindow

MOST_SMOOTH_ROUNDS = 12
"""Most rounds."""
TOLERANCES = (3e-2, 1e-2, 2e-3)
"""Tolerances of the solver in the first rounds; in all later rounds it is the last of them. Only
motions from rounds with the last one are kept."""
FORCE_TOLERANCES, POSTURE_TOLERANCES, DYNAMIC_TOLERANCES = (3e-2, 1e-2), (8e-2, 2e-2), (7e-2, 1e-2)
"""The same where forces set the timing, which is found anew: with a level body, with one that
tilts, and in dynamic walks. With 0.07 walks with a level body came out 0.2 % slower, and others
equal; with 0.05 and 0.02 up to 0.3 % slower. The first one of ``posture`` makes the barrier
parameter fall 12 times (from 1e-3 to 8.5e-5). A fall of 11 times or less counts as solved without a
Newton step at the new parameter: so it was with 0.12, and the second round had to do that work."""
CORRECTING_ROUNDS = 3
"""Rounds that correct all limits in rows; those after them only tighten limits."""
ENOUGH = 1.001
"""A motion that needs no more stretch than this ends the rounds."""
COLD_BARRIER_SHARE, WARM_BARRIER_SHARE = 0.1, 0.01
"""First barrier parameters without multipliers, and from the last solution with its multipliers, as
shares of that from a poor first guess."""
FORCE_WARM_BARRIER_SHARE, POSTURE_WARM_BARRIER_SHARE, DYNAMIC_WARM_BARRIER_SHARE = (
    0.003,
    0.01,
    0.005,
)
"""The same from the last solution where forces set the timing, also where rows that keep legs apart
are new: about the barrier parameter with which that ended. With 0.1, and without multipliers, eight
walks of wang2020 over 16 steps took 574 Newton steps; with 0.003 they took 338. Four of ``posture``
took 117 with 0.01 and tolerances of 0.12 and 0.02, and 167 with the values of dynamic walks."""
FORCE_STATIONARY = 1e-3
"""Gradient of the Lagrangian that counts as zero where forces set the timing. Without it the last
digits, which the timing forgets, took up to 40 of 86 Newton steps."""
LAST_RESORT_STRETCH = 1.5
"""Most that time is stretched where no round gives a motion that needs less."""
NEARLY_STATIONARY = 1e-3
"""Largest gradient of the Lagrangian with which an answer is used although it is not solved."""
SPLINE_STRETCH_RESERVE = 1e-4
"""Share of time that is added where a motion is stretched, so that its new path keeps its limits,
too: its polynomials are fitted anew."""

DynamicSolution = Solution[DynamicRouteProblem]


@dataclass(frozen=True, eq=False)
class FoundMotion:
    """A motion that keeps all limits.

    Attributes:
        motion, path: the motion, and the path through it.
        solutions: those that it comes from, window by window.
    """

    motion: SplineMotion
    path: MotionPath
    solutions: tuple[DynamicSolution, ...]


def best_motion(window: SmoothWindow) -> tuple[FoundMotion, list[DynamicSolution]]:
    """The fastest motion of all rounds that keeps all limits, and the solutions of all rounds.

    Raises:
        RouteError: no round gives one.
        SolverError: standing feet cannot be kept on their footholds between knots.
    """
    guess = _Start(window.problem.pack(window.problem.poses, window.guessed_spans))
    problem, start, found = window.problem, guess, _Candidates(window)
    solutions: list[DynamicSolution] = []
    forces = window.route.settings.forces is not None
    tolerances, warm = _accuracy(window)
    for n in range(MOST_SMOOTH_ROUNDS):
        tolerance = tolerances[min(n, len(tolerances) - 1)]
        solution = _solve(window, problem, start, tolerance)
        solutions.append(solution)
        nearly = start.multipliers is None and found.best is None and _is_nearly_solved(solution)
        if not (solution.solved or nearly):
            if start is guess:
                break
            start = guess
            continue
        motion = window.motion(solution.x)
        last = tolerance == tolerances[-1]
        # The first solution for forces is rough: whether legs touch in it says little.
        apart = _with_legs_apart(window, solution) if last or not forces else None
        if last and apart is None and found.add(solution, _mended(window, solution, motion)):
            break
        cold = apart is not None and not forces
        start = _Start(solution.x) if cold else _next_start(solution, apart or problem, warm)
        problem = _with_stricter_rows(apart or problem, window, motion, n >= CORRECTING_ROUNDS)
    best = found.best or found.stretched()
    if best is None:
        reason = Reason.LIMITS_BETWEEN_KNOTS if solution.solved else None
        raise route_error(window.route, solution, reason)
    return best, solutions


class _Start(NamedTuple):
    """Where the solver begins.

    Attributes:
        x: unknowns ``(n,)``.
        multipliers: where they are known ``(m,)``.
        barrier_share: first barrier parameter, as a share of that from a poor first guess.
    """

    x: FloatArray
    multipliers: FloatArray | None = None
    barrier_share: float = COLD_BARRIER_SHARE


def _accuracy(window: SmoothWindow) -> tuple[tuple[float, ...], float]:
    """Tolerances of the rounds, and the barrier's share after the first of them."""
    settings = window.route.settings
    if settings.forces is None:
        return TOLERANCES, WARM_BARRIER_SHARE
    if settings.free.dynamic:
        return DYNAMIC_TOLERANCES, DYNAMIC_WARM_BARRIER_SHARE
    if settings.free.posture:
        return POSTURE_TOLERANCES, POSTURE_WARM_BARRIER_SHARE
    return FORCE_TOLERANCES, FORCE_WARM_BARRIER_SHARE


def _next_start(solution: DynamicSolution, problem: DynamicRouteProblem, warm: float) -> _Start:
    """Where the next round begins, from the solution of the last one.

    Args:
        solution: of the last round.
        problem: one with the rows of the next round.
        warm: first barrier parameter then, as a share of that from a poor first guess.
    """
    multipliers = carried_multipliers(solution.problem, problem, solution.multipliers)
    return _Start(solution.x, multipliers, warm)


def _solve(
    window: SmoothWindow, problem: DynamicRouteProblem, start: _Start, tolerance: float
) -> DynamicSolution:
    """Solve the problem of a round."""
    barrier, settings = start.barrier_share * problem.first_barrier, window.route.settings
    return minimise(problem, start.x, tolerance=tolerance, barrier=barrier,
                    iteration_limit=settings.iterations,
                    multipliers=start.multipliers, reduce_curvature=True,
                    stationary=FORCE_STATIONARY if settings.forces else 0.0)  # fmt: skip


def _is_nearly_solved(solution: DynamicSolution) -> bool:
    """Whether an answer keeps its inequalities and is nearly stationary."""
    return solution.violation() <= VIOLATION and solution.stationarity() <= NEARLY_STATIONARY


def _with_legs_apart(window: SmoothWindow, solution: DynamicSolution) -> DynamicRouteProblem | None:
    """The problem with rows that keep legs apart; ``None`` where no legs touch."""
    shapes, problem = window.route.shapes, solution.problem
    if shapes is None:
        return None
    poses = problem.unpack(solution.x)[0]
    close = touching_pairs(shapes, problem, poses)
    return None if close is None else with_distance_rows(shapes, problem, poses, close)


def _mended(window: SmoothWindow, solution: DynamicSolution, motion: SplineMotion) -> SplineMotion:
    """The motion of a whole walk whose timing forces set, with the little margin that it misses."""
    settings = window.route.settings
    if settings.forces is None or settings.free.dynamic or not window.is_whole:
        return motion
    return with_body_moved_inward(solution.problem, window, motion)


def _with_stricter_rows(
    problem: DynamicRouteProblem, window: SmoothWindow, motion: SplineMotion, only_tighten: bool
) -> DynamicRouteProblem:
    """The problem of the next round, by what the motion through the last solution asks for.

    Args:
        problem: of the last round, perhaps with new rows that keep legs apart.
        window: what is planned.
        motion: through the last solution.
        only_tighten: never make a row less strict.
    """
    change = with_tightened_limits if only_tighten else with_corrected_limits
    stricter = change(problem, window, motion)
    stricter = with_corrected_margins(stricter, window, motion, only_upward=only_tighten)
    return with_raised_heights(stricter, window, motion, only_upward=only_tighten)


@dataclass
class _Candidates:
    """The best motions of the rounds so far.

    Attributes:
        window: what is planned.
        best: the fastest motion that keeps all limits, if any.
        fallback: for a whole walk, the motion and solution that would be fastest if it was
            stretched as much as its joints need, with this time [s].
    """

    window: SmoothWindow
    best: FoundMotion | None = field(default=None, init=False)
    fallback: tuple[float, SplineMotion, DynamicSolution] | None = field(default=None, init=False)

    def add(self, solution: DynamicSolution, motion: SplineMotion) -> bool:
        """Look at the motion of a round; tells whether further rounds are not worth their time."""
        judged = judge(self.window, motion)
        duration = judged.stretch * float(motion.times[-1])
        usable = self.window.is_whole and clearance_is_kept(self.window, motion)
        if usable and (self.fallback is None or duration < self.fallback[0]):
            self.fallback = duration, motion, solution
        if judged.kept is None:
            return False
        kept, path = judged.kept
        if self.best is None or kept.times[-1] < self.best.motion.times[-1]:
            self.best = FoundMotion(kept, path, (solution,))
        return judged.stretch <= ENOUGH

    def stretched(self) -> FoundMotion | None:
        """The fallback, stretched as much as it needs; ``None`` where it then loses its margin."""
        if self.fallback is None:
            return None
        _, motion, solution = self.fallback
        kept = judge(self.window, motion, LAST_RESORT_STRETCH).kept
        return None if kept is None else FoundMotion(*kept, (solution,))


class Judgement(NamedTuple):
    """Whether a motion keeps all limits.

    Attributes:
        kept: the motion, stretched as its joints need it, and its path; ``None`` where it needs too
            much stretch, or loses its margin or clearance.
        stretch: how much stretch the joints need.
    """

    kept: tuple[SplineMotion, MotionPath] | None
    stretch: float


def judge(
    window: SmoothWindow, motion: SplineMotion, most_stretch: float = MOST_STRETCH
) -> Judgement:
    """Whether a motion keeps the limits of all joints at every instant, its margin and clearance.

    Args:
        window: what is planned.
        motion: one of its motions.
        most_stretch: factor by which the motion may be stretched at the most; it keeps the margin
            with and without this factor.

    Raises:
        SolverError: feet that stand leave their footholds.
    """
    if window.route.settings.forces:
        return Judgement((motion, motion.path()) if _path_is_kept(window, motion) else None, 1.0)
    first = window.first_knot
    stretch = sampled_stretch(window, motion)
    if stretch > most_stretch or not clearance_is_kept(window, motion):
        return Judgement(None, stretch)
    # The ZMP of a stretched motion lies on the line between that of the motion itself and the
    # centre of mass, and a margin is a concave function of the point: so both ends are enough.
    wanted, dynamic = window.wanted_margins(motion), window.route.settings.free.dynamic
    for one in (motion, motion.slower(most_stretch))[: 2 if dynamic else 1]:
        if (one.margins(dynamic)[first:] < wanted).any():
            return Judgement(None, stretch)
    path = motion.path()
    stretch = legs_needed_stretch(
        window.route.robot, path, float(motion.times[first]), window.problem.velocity_limits,
        window.acceleration_limit,
    )  # fmt: skip
    if stretch > most_stretch:
        return Judgement(None, stretch)
    if stretch > 1.0:
        motion = motion.slower(stretch * (1.0 + SPLINE_STRETCH_RESERVE))
        path = motion.path()
    return Judgement((motion, path), stretch)


def _path_is_kept(window: SmoothWindow, motion: SplineMotion) -> bool:
    """Whether a motion whose timing forces will set keeps its clearance and its static margin.

    Its own times do not count. In a dynamic walk forces are what keeps balance.
    """
    if not clearance_is_kept(window, motion):
        return False
    if window.route.settings.free.dynamic:
        return True
    margins = motion.margins(dynamic=False)[window.first_knot :]
    return bool((margins >= window.wanted_margins(motion)).all())
