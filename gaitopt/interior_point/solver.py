"""A primal-dual interior-point method for problems of inequalities with banded matrices.

Minimise ``cost . x + sum(even * x**2) / 2`` subject to ``values(x) >= 0``. Without equalities each
Newton step condenses to one symmetric positive definite banded system in the unknowns alone, whose
Cholesky factor costs size times width squared: the time of a step grows linearly with the length
of a route.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.line_search import advance
from gaitopt.interior_point.newton import Newton, State
from gaitopt.interior_point.problem import Problem, slope_of

MOST_ITERATIONS = 300
VIOLATION = 1e-6
"""Most that an answer may violate an inequality which more time does not mend."""
_NEAR_DUALS = 100.0


@dataclass(frozen=True, eq=False)
class Answer:
    """What the solver found, with residuals worked out anew at the end.

    Attributes:
        x: unknowns.
        duals: multipliers of the inequalities.
        status: ``"solved"``, or why it stopped.
        iterations: Newton steps.
        primal: largest violation of an inequality.
        stationarity: largest entry of the Lagrangian's gradient.
        complementarity: sum of multiplier times value: how far the objective can be from that of
            the linearised problem's optimum.
        history: barrier parameter, merit, residuals of every iteration.
    """

    x: FloatArray
    duals: FloatArray
    status: str
    iterations: int
    primal: float
    stationarity: float
    complementarity: float
    history: tuple[tuple[float, ...], ...] = ()


def solve_route(
    problem: Problem,
    start: FloatArray,
    *,
    tolerance: float = 1e-3,
    barrier: float = 1e-2,
    iterations: int = MOST_ITERATIONS,
    duals: FloatArray | None = None,
    eased: bool = False,
) -> Answer:
    """Solve a route problem from ``start``.

    Args:
        problem: see :class:`gaitopt.optimize.route.problem.RouteProblem`.
        start: first guess; it need not be feasible, but its values must be finite.
        tolerance: complementarity, relative to the objective, at which to stop.
        barrier: first barrier parameter.
        iterations: most Newton steps.
        duals: multipliers of a problem nearby, to begin with.
        eased: where the inequalities' curvature makes the Newton matrix indefinite, take less of
            it (down to none: sequential linear programming), rather than damp the step. Better
            where many inequalities are strongly bent.
    """
    here = problem.linearised(start)
    slack = np.maximum(here.values, 1e-3)
    dual = barrier / slack
    if duals is not None:
        dual = np.clip(duals, dual / _NEAR_DUALS, dual * _NEAR_DUALS)
    state = State(np.array(start), slack, dual, barrier,
                   max(1.0, 10.0 * float(np.abs(here.values - slack).sum())),
                   eased=eased)  # fmt: skip
    history: list[tuple[float, ...]] = []
    status = "most iterations"
    for _ in range(iterations):
        final = max(tolerance * abs(float(problem.cost @ state.x)) / len(slack), 1e-11)
        gradient = slope_of(problem, state.x) - here.pull(state.dual)
        gap = here.values - state.slack
        while True:
            error = _error(state, gradient, gap)
            if error > 10.0 * state.barrier or state.barrier <= final:
                break
            state.filter.clear()
            state.barrier = max(final, min(0.2 * state.barrier, state.barrier**1.5))
        history.append((state.barrier, float(problem.cost @ state.x), float(np.abs(gradient).max()),
                        float(np.abs(gap).max()), state.shift))  # fmt: skip
        broken = float(-here.values[problem.settled :].min(initial=0.0))
        if state.barrier <= final and error <= 10.0 * state.barrier and broken <= VIOLATION:
            status = "solved"
            break
        if not advance(problem, state, Newton(problem, state, here), gap):
            status = "no progress"
            break
        here = problem.linearised(state.x)
    return _answer(problem, state, status, history)


def _error(state: State, gradient: FloatArray, gap: FloatArray) -> float:
    """Residual of the barrier problem, in units of its parameter."""
    product = np.abs(state.dual * state.slack - state.barrier).max()
    scale = max(1.0, float(np.abs(state.dual).mean()))
    return float(max(np.abs(gradient).max() / scale, np.abs(gap).max(), product / scale))


def _answer(
    problem: Problem, state: State, status: str, history: list[tuple[float, ...]]
) -> Answer:
    """Residuals from scratch, whatever the iteration believed."""
    here = problem.linearised(state.x)
    slope = slope_of(problem, state.x) - here.pull(state.dual)
    return Answer(
        x=state.x, duals=state.dual, status=status, iterations=len(history) - 1,
        primal=float(np.maximum(-here.values, 0.0).max(initial=0.0)),
        stationarity=float(np.abs(slope).max(initial=0.0)),
        complementarity=float(np.abs(state.dual * here.values).sum()), history=tuple(history),
    )  # fmt: skip
