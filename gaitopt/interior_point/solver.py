"""A primal-dual interior-point method for inequalities with banded Newton matrices.

It solves :class:`gaitopt.interior_point.problem.Problem`. Every inequality gets a slack, and a
logarithmic barrier keeps slacks positive; for a falling sequence of barrier parameters Newton's
method solves the barrier problem. Without equalities each Newton step condenses to one banded
system in the unknowns alone, so the time of a step grows linearly with their number. Globalisation
is the filter line search of IPOPT [Waechter2006]; its feasibility restoration is left out. In its
place a problem may tell how to meet its first inequalities at any point
(:meth:`~gaitopt.interior_point.problem.Problem.restore`).

The minimum is a local one. Where the problem is convex it is global.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.iterate import Iterate
from gaitopt.interior_point.line_search import advance
from gaitopt.interior_point.newton import NewtonSystem
from gaitopt.interior_point.problem import Linearisation, Problem, objective, objective_gradient
from gaitopt.interior_point.status import Status

ITERATION_LIMIT = 300
"""Most Newton steps, by default. Walks of 512 steps took at most 76 where joint accelerations are
free, and of 12 steps up to 300 where they are limited and joints fast. IPOPT allows 3000."""
VIOLATION = 1e-6
"""Most that a solution may violate an inequality that cannot be restored, in its own unit (for
routes: a micrometre or a microradian)."""
_LEAST_SLACK = 1e-3
"""Slacks begin with at least this much (IPOPT: ``bound_push``, 1e-2). Six time-optimal walks of 16
steps with acceleration limits took 624 iterations with 1e-3, 845 with 1e-2, and 706 with 1e-4."""
_MULTIPLIER_START = 100.0
"""Factor by which multipliers that are given may differ at first from mu over their slack. Three
time-optimal walks of 16 steps, variant ``dynamic``, took 298 iterations with it, 295 with 1e6, and
374 with 1, by which given multipliers are ignored."""
_VIOLATION_GROWTH = 10.0
"""The violation may grow to so many times that of the start, or to 1 (IPOPT: ``theta_max_fact``,
1e4: ours starts near to feasible)."""
_ERROR_SHARE = 10.0
"""The barrier parameter falls when the error of its problem is at most so many times as large
[kappa_eps in [Waechter2006], section 2.1; IPOPT: ``barrier_tol_factor``]."""
_LINEAR_FALL, _SUPERLINEAR_FALL = 0.2, 1.5
"""It falls to the smaller one of this factor times it and this power of it [kappa_mu, theta_mu in
[Waechter2006], eq. (7)]."""
LEAST_BARRIER = 1e-11
"""The least barrier parameter (IPOPT: ``mu_min``)."""

P_co = TypeVar("P_co", bound=Problem, covariant=True)
P = TypeVar("P", bound=Problem)


class Iteration(NamedTuple):
    """What is kept of an iteration.

    Attributes:
        barrier: barrier parameter.
        linear_objective: linear part of the objective.
        stationarity: largest entry of the Lagrangian's gradient.
        residual: largest difference of an inequality's value and its slack.
        damping: what was added to the Newton matrix's diagonal in the iteration before.
    """

    barrier: float
    linear_objective: float
    stationarity: float
    residual: float
    damping: float


@dataclass(frozen=True, eq=False)
class Solution(Generic[P_co]):
    """What the solver found. Residuals are computed from the problem when they are asked for.

    Attributes:
        problem: what was solved.
        x: unknowns ``(n,)``.
        multipliers: of the inequalities ``(m,)``, all positive.
        status: how the solver ended.
        history: the start and every Newton step.
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

    def objective(self) -> float:
        """The objective."""
        return objective(self.problem, self.x)

    def violation(self) -> float:
        """Largest violation of an inequality; 0 where all are met."""
        return float(np.maximum(-self.problem.values(self.x), 0.0).max(initial=0.0))

    def lagrangian_gradient(self) -> FloatArray:
        """Gradient of ``objective - multipliers . values`` by the unknowns ``(n,)``."""
        here = self.problem.linearise(self.x)
        return objective_gradient(self.problem, self.x) - here.jacobian_transpose_times(
            self.multipliers
        )

    def stationarity(self) -> float:
        """Largest entry of the Lagrangian's gradient."""
        return float(np.abs(self.lagrangian_gradient()).max(initial=0.0))

    def complementarity(self) -> float:
        """Sum of multiplier times value over all inequalities.

        Where the problem is convex, and the Lagrangian's gradient zero, the objective is at most
        so far above its minimum.
        """
        return float(np.abs(self.multipliers * self.problem.values(self.x)).sum())


def minimise(
    problem: P,
    start: FloatArray,
    *,
    tolerance: float = 1e-3,
    barrier: float = 1e-2,
    iteration_limit: int = ITERATION_LIMIT,
    multipliers: FloatArray | None = None,
    reduce_curvature: bool = False,
    least_barrier: float = LEAST_BARRIER,
    stationary: float = 0.0,
) -> Solution[P]:
    """Minimise the objective of a problem under its inequalities.

    Args:
        problem: what is to be solved.
        start: first guess ``(n,)``. It need not be feasible, but its values must be finite.
        tolerance: the complementarity at which to stop, as a share of the objective's linear part.
            That of a solution may be ten times as large, as Newton steps are not exact.
        barrier: first barrier parameter. From a good guess a small one saves iterations.
        iteration_limit: most Newton steps.
        multipliers: those of a similar problem, to begin with ``(m,)``; 0 where none is known.
        reduce_curvature: where the inequalities' curvature makes the Newton matrix indefinite, take
            less of it (down to none: sequential linear programming), rather than damp the step.
            That is better where many inequalities are strongly curved: of nine walks, variant
            ``dynamic``, on wang2020-fast, anymal_c and a1 six were found so, and none with damping.
            On wang2020 it saves 7 % of the iterations.
        least_barrier: the barrier parameter is not lowered below this one, for objectives whose
            linear part may vanish at the minimum.
        stationary: a Lagrangian's gradient whose entries are not above this counts as zero. Where
            the Newton matrix needs less than the whole curvature, steps come near to a minimum
            slowly, and the last digits are most of the work.

    Returns:
        The solution; its status tells whether it is one.
    """
    here = problem.linearise(start)
    iterate = _first_iterate(here, start, barrier, multipliers)
    if not np.isfinite(here.values).all():
        return Solution(problem, iterate.x, iterate.multipliers, Status.UNDEFINED_START)
    history: list[Iteration] = []
    status = Status.ITERATION_LIMIT
    for taken in range(iteration_limit + 1):
        gradient = objective_gradient(problem, iterate.x)
        gradient = gradient - here.jacobian_transpose_times(iterate.multipliers)
        residual = here.values - iterate.slack
        linear = float(problem.linear_cost @ iterate.x)
        final = max(tolerance * abs(linear) / len(residual), least_barrier)
        converged = _lower_barrier(iterate, gradient, residual, final, stationary)
        history.append(Iteration(
            iterate.barrier, linear, float(np.abs(gradient).max()), float(np.abs(residual).max()),
            iterate.damping,
        ))  # fmt: skip
        violation = float(-here.values[problem.restorable :].min(initial=0.0))
        if converged and violation <= VIOLATION:
            status = Status.SOLVED
            break
        if taken == iteration_limit:
            break
        newton = NewtonSystem(problem, iterate, here, reduce_curvature)
        if not advance(problem, iterate, newton, residual):
            status = Status.NO_PROGRESS
            break
        here = problem.linearise(iterate.x)
    return Solution(problem, iterate.x, iterate.multipliers, status, tuple(history))


def _first_iterate(
    here: Linearisation, start: FloatArray, barrier: float, multipliers: FloatArray | None
) -> Iterate:
    """Slacks and multipliers to begin with, near to the central path."""
    slack = np.maximum(here.values, _LEAST_SLACK)
    central = barrier / slack
    if multipliers is None:
        multipliers = central
    else:
        near = np.clip(multipliers, central / _MULTIPLIER_START, central * _MULTIPLIER_START)
        multipliers = np.where(multipliers > 0.0, near, central)
    violation = float(np.abs(here.values - slack).sum())
    limit = max(1.0, _VIOLATION_GROWTH * violation)
    return Iterate(np.array(start), slack, multipliers, barrier, limit)


def _lower_barrier(
    iterate: Iterate, gradient: FloatArray, residual: FloatArray, final: float, stationary: float
) -> bool:
    """Lower the barrier parameter as long as the barrier problem is solved well enough.

    Args:
        iterate: its parameter is lowered; a new one begins with an empty filter.
        gradient: of the Lagrangian ``(n,)``.
        residual: ``values - slack`` ``(m,)``.
        final: the parameter is not lowered below this one.
        stationary: a gradient with no larger entry counts as zero.

    Returns:
        Whether the barrier problem of the final parameter is solved.
    """
    while True:
        solved = _error(iterate, gradient, residual, stationary) <= _ERROR_SHARE * iterate.barrier
        if not solved or iterate.barrier <= final:
            return solved
        iterate.filter.clear()
        lower = min(_LINEAR_FALL * iterate.barrier, iterate.barrier**_SUPERLINEAR_FALL)
        iterate.barrier = max(final, lower)


def _error(
    iterate: Iterate, gradient: FloatArray, residual: FloatArray, stationary: float
) -> float:
    """How far the barrier problem's optimality conditions are from met.

    This is E_mu of [Waechter2006], eq. (5). Large multipliers scale it down from their mean of 1
    on; in IPOPT they do so from 100 on (``s_max``).
    """
    centrality = np.abs(iterate.multipliers * iterate.slack - iterate.barrier).max()
    scale = max(1.0, float(np.abs(iterate.multipliers).mean()))
    steepest = float(np.abs(gradient).max())
    steepest = 0.0 if steepest <= stationary else steepest / scale
    return float(max(steepest, np.abs(residual).max(), centrality / scale))
