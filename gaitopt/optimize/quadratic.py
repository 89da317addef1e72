"""Small convex QPs through ProxQP, with settings that were measured.

ProxQP's own verdict is not used: on some inputs it calls feasible problems infeasible, on others
it answers "solved" to what is not. Answers are judged by their residuals; iterations are capped.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from proxsuite import proxqp

from gaitopt.conventions import FloatArray

UNBOUNDED = 1e20
TOLERANCE = 1e-9
"""Violation and |dual x slack| above which an answer is tried again with other settings."""


class QuadraticSolver:
    """ProxQP memory for problems of one size, kept from call to call; for one thread.

    Args:
        variables: number of unknowns ``n``.
        constraints: number of inequalities ``m``.
    """

    def __init__(self, variables: int, constraints: int) -> None:
        # Measured on two-variable problems: 13 us a solve with these settings, 93 us with the
        # defaults, which solve what these cannot.
        quick: dict[str, float] = {
            "default_mu_in": 1e-6,
            "default_rho": 1e-9,
            "max_iter": 60,
            "max_iter_in": 60,
        }
        patient: dict[str, float] = {"max_iter": 200, "max_iter_in": 100}
        self._attempts = [_workspace(variables, constraints, s) for s in (quick, patient)]
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
            has no solution they are the last iterate: look at ``J x - low``.
        """
        for attempt, qp in enumerate(self._attempts):
            self._load(attempt, hessian, gradient, jacobian, low)
            qp.solve()
            x = qp.results.x
            # ProxQP's multipliers of J x >= low are negative by its sign convention.
            duals = np.maximum(-qp.results.z, 0.0)
            slack = jacobian @ x - low
            if slack.min() > -TOLERANCE and abs(duals @ slack) < TOLERANCE:
                break
        return x, duals

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
        # Without this, points that are feasible but not complementary pass for solved.
        "check_duality_gap": True,
        "eps_duality_gap_abs": 1e-11,
        "eps_duality_gap_rel": 0.0,
        # With its tests for infeasibility off, ProxQP stops at max_iter instead of guessing.
        "eps_primal_inf": 0.0,
        "eps_dual_inf": 0.0,
        "initial_guess": proxqp.InitialGuess.NO_INITIAL_GUESS,
        "compute_timings": False,
    }
    for name, value in {**common, **settings}.items():
        setattr(qp.settings, name, value)
    return qp
