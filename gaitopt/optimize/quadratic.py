"""Small convex quadratic programs (QPs), solved by ProxQP [Bambade2022].

ProxQP's own status is not used: it calls some feasible problems infeasible, and some unsolved ones
solved. Solutions are judged by their residuals, and iterations are limited.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from proxsuite import proxqp

from gaitopt.conventions import FloatArray

UNBOUNDED = 1e20
"""Upper bound that stands for none: ProxQP takes bounds of this size for infinite."""
TOLERANCE = 1e-9
"""Violation, and |multiplier x slack|, above which other settings are tried: 1 nm in a QP in
metres, and a hundred times ProxQP's own tolerance below."""


class QuadraticSolver:
    """Solver for QPs of one size, whose memory is kept from call to call; for one thread.

    Args:
        variables: number of unknowns ``n``.
        constraints: number of inequalities ``m``.
    """

    def __init__(self, variables: int, constraints: int) -> None:
        # Measured on problems of two variables: 13 us a solution with the quick settings, 93 us
        # with the slow ones, which also solve what the quick ones do not.
        quick: dict[str, float] = {
            "default_mu_in": 1e-6,
            "default_rho": 1e-9,
            "max_iter": 60,
            "max_iter_in": 60,
        }
        slow: dict[str, float] = {"max_iter": 200, "max_iter_in": 100}
        self._attempts = [_workspace(variables, constraints, s) for s in (quick, slow)]
        self._started = [False, False]
        self._upper = np.full(constraints, UNBOUNDED)

    def solve(
        self, hessian: FloatArray, gradient: FloatArray, jacobian: FloatArray, low: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Minimise ``x H x / 2 + g x`` over ``J x >= low``.

        Args:
            hessian: ``(n, n)``, positive definite and of order one.
            gradient: ``(n,)``.
            jacobian: ``(m, n)``.
            low: ``(m,)``.

        Returns:
            The minimiser ``(n,)`` and the multipliers ``(m,)``, none negative. Where the problem
            has no solution they are the last iterate, which ``J x - low`` shows.
        """
        for attempt, qp in enumerate(self._attempts):
            self._load(attempt, hessian, gradient, jacobian, low)
            qp.solve()
            x = qp.results.x
            # ProxQP's multipliers of J x >= low are negative by its sign convention.
            multipliers = np.maximum(-qp.results.z, 0.0)
            slack = jacobian @ x - low
            if slack.min() > -TOLERANCE and abs(multipliers @ slack) < TOLERANCE:
                break
        return x, multipliers

    def _load(self, attempt: int, *problem: FloatArray) -> None:
        hessian, gradient, jacobian, low = problem
        matrices = (hessian, gradient, None, None, jacobian, low, self._upper)
        if self._started[attempt]:
            self._attempts[attempt].update(*matrices, update_preconditioner=False)
        else:
            self._attempts[attempt].init(*matrices, compute_preconditioner=False)
            self._started[attempt] = True


def _workspace(variables: int, constraints: int, settings: dict[str, float]) -> Any:
    backend = proxqp.dense.DenseBackend.PrimalDualLDLT
    qp = proxqp.dense.QP(variables, 0, constraints, False, dense_backend=backend)
    common = {
        "eps_abs": 1e-11,
        "eps_rel": 0.0,
        # Without this, ProxQP accepts points that are feasible but do not satisfy complementarity.
        "check_duality_gap": True,
        "eps_duality_gap_abs": 1e-11,
        "eps_duality_gap_rel": 0.0,
        # These switch off its tests for infeasibility, which are wrong at times.
        "eps_primal_inf": 0.0,
        "eps_dual_inf": 0.0,
        "initial_guess": proxqp.InitialGuess.NO_INITIAL_GUESS,
        "compute_timings": False,
    }
    for name, value in {**common, **settings}.items():
        setattr(qp.settings, name, value)
    return qp
