"""A primal-dual interior-point method for problems of inequalities with banded matrices.

Minimise ``cost . x + sum(even * x**2) / 2`` subject to ``values(x) >= 0``. Without equalities each
Newton step condenses to one symmetric positive definite banded system in the unknowns alone, whose
Cholesky factor costs size times width squared: the time of a step grows linearly with the length
of a route.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.line_search import advance
from gaitopt.interior_point.newton import Newton, State
from gaitopt.interior_point.problem import Problem, slope_of
from gaitopt.interior_point.status import Status

P_co = TypeVar("P_co", bound=Problem, covariant=True)
P = TypeVar("P", bound=Problem)
MOST_ITERATIONS = 300
VIOLATION = 1e-6
"""Most that a solution may violate an inequality which more time does not mend."""
_NEAR_DUALS = 100.0


class Iteration(NamedTuple):
    """What is kept of an iteration.

    Attributes:
        barrier: barrier parameter.
        objective: linear part of the objective.
        gradient: largest entry of the Lagrangian's gradient.
        gap: largest difference of an inequality's value and its slack.
        damping: what was added to the Newton matrix's diagonal in the iteration before.
    """

    barrier: float
    objective: float
    gradient: float
    gap: float
    damping: float


@dataclass(frozen=True, eq=False)
class Solution(Generic[P_co]):
    """What the solver found; residuals are computed from the problem where they are asked for.

    Attributes:
        problem: what was solved.
        x: unknowns ``(n,)``.
        multipliers: of the inequalities ``(m,)``, all positive.
        status: how the solver ended.
        history: every iteration; the last one is the solution.
    """

    problem: P_co
    x: FloatArray
    multipliers: FloatArray
    status: Status
    history: tuple[Iteration, ...] = ()

    @property
    def solved(self) -> bool:
        """Whether the solver reached its tolerance."""
        return self.status is Status.SOLVED

    @property
    def iterations(self) -> int:
        """Number of Newton steps."""
        return max(len(self.history) - 1, 0)

    def violation(self) -> float:
        """Largest violation of an inequality; 0 where all are met."""
        return float(np.maximum(-self.problem.values(self.x), 0.0).max(initial=0.0))

    def stationarity(self) -> float:
        """Largest entry of the Lagrangian's gradient."""
        here = self.problem.linearise(self.x)
        slope = slope_of(self.problem, self.x) - here.jacobian_transpose_times(self.multipliers)
        return float(np.abs(slope).max(initial=0.0))

    def complementarity(self) -> float:
        """Sum of multiplier times value over all inequalities.

        For a convex problem the objective is at most so far above the minimum.
        """
        return float(np.abs(self.multipliers * self.problem.values(self.x)).sum())


def minimise(
    problem: P,
    start: FloatArray,
    *,
    tolerance: float = 1e-3,
    barrier: float = 1e-2,
    iteration_limit: int = MOST_ITERATIONS,
    multipliers: FloatArray | None = None,
    reduce_curvature: bool = False,
) -> Solution[P]:
    """Solve a route problem from ``start``.

    Args:
        problem: see :class:`gaitopt.optimize.route.problem.RouteProblem`.
        start: first guess; it need not be feasible, but its values must be finite.
        tolerance: complementarity, relative to the objective, at which to stop.
        barrier: first barrier parameter.
        iteration_limit: most Newton steps.
        multipliers: multipliers of a problem nearby, to begin with.
        reduce_curvature: where the inequalities' curvature makes the Newton matrix indefinite,
            take less of it (down to none: sequential linear programming), rather than damp the
            step. Better where many inequalities are strongly curved.
    """
    here = problem.linearise(start)
    slack = np.maximum(here.values, 1e-3)
    dual = barrier / slack
    if multipliers is not None:
        dual = np.clip(multipliers, dual / _NEAR_DUALS, dual * _NEAR_DUALS)
    state = State(np.array(start), slack, dual, barrier,
                   max(1.0, 10.0 * float(np.abs(here.values - slack).sum())),
                   reduce_curvature=reduce_curvature)  # fmt: skip
    history: list[Iteration] = []
    status = Status.ITERATION_LIMIT
    for _ in range(iteration_limit):
        final = max(tolerance * abs(float(problem.linear_cost @ state.x)) / len(slack), 1e-11)
        gradient = slope_of(problem, state.x) - here.jacobian_transpose_times(state.dual)
        gap = here.values - state.slack
        while True:
            error = _error(state, gradient, gap)
            if error > 10.0 * state.barrier or state.barrier <= final:
                break
            state.filter.clear()
            state.barrier = max(final, min(0.2 * state.barrier, state.barrier**1.5))
        history.append(
            Iteration(
                state.barrier,
                float(problem.linear_cost @ state.x),
                float(np.abs(gradient).max()),
                float(np.abs(gap).max()),
                state.shift,
            )
        )
        broken = float(-here.values[problem.restorable :].min(initial=0.0))
        if state.barrier <= final and error <= 10.0 * state.barrier and broken <= VIOLATION:
            status = Status.SOLVED
            break
        if not advance(problem, state, Newton(problem, state, here), gap):
            status = Status.NO_PROGRESS
            break
        here = problem.linearise(state.x)
    return Solution(problem, state.x, state.dual, status, tuple(history))


def _error(state: State, gradient: FloatArray, gap: FloatArray) -> float:
    """Residual of the barrier problem, in units of its parameter."""
    product = np.abs(state.dual * state.slack - state.barrier).max()
    scale = max(1.0, float(np.abs(state.dual).mean()))
    return float(max(np.abs(gradient).max() / scale, np.abs(gap).max(), product / scale))
