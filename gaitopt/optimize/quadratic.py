"""Small convex QPs through ProxQP, with settings that were measured.

ProxQP's own verdict is not used: on some inputs it calls feasible problems infeasible, and on
crossed bounds or NaN it answers "solved". Callers pass finite numbers, iterations are capped, and
callers judge the answer by residuals that they compute themselves.
"""

from __future__ import annotations

import numpy as np
from proxsuite import proxqp

from gaitopt.conventions import FloatArray

UNBOUNDED = 1e20
ITERATIONS = 200


class QuadraticSolver:
    """ProxQP memory for problems of one size, kept from call to call; for one thread.

    Args:
        variables: number of unknowns ``n``.
        constraints: number of inequalities ``m``.
    """

    def __init__(self, variables: int, constraints: int) -> None:
        self._qp = proxqp.dense.QP(variables, 0, constraints)
        settings = self._qp.settings
        settings.eps_abs = 1e-11
        settings.eps_rel = 0.0
        settings.max_iter = ITERATIONS
        # With the tests for infeasibility off, ProxQP stops at max_iter instead of guessing.
        settings.eps_primal_inf = 0.0
        settings.eps_dual_inf = 0.0
        # Measured on two-variable problems: 19 us a solve instead of 93 us with the defaults.
        settings.default_mu_in = 1e-5
        settings.default_rho = 1e-9
        settings.initial_guess = proxqp.InitialGuess.NO_INITIAL_GUESS
        settings.compute_timings = False
        self._upper = np.full(constraints, UNBOUNDED)
        self._started = False

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
            What ProxQP takes for the minimiser ``(n,)`` and the multipliers ``(m,)``, none
            negative. Nothing is promised of them: compute their residuals.
        """
        if self._started:
            self._qp.update(hessian, gradient, None, None, jacobian, low, self._upper,
                            update_preconditioner=False)  # fmt: skip
        else:
            self._qp.init(hessian, gradient, None, None, jacobian, low, self._upper,
                          compute_preconditioner=False)  # fmt: skip
            self._started = True
        self._qp.solve()
        results = self._qp.results
        # ProxQP's multipliers of J x >= low are negative by its sign convention.
        return results.x, np.maximum(-results.z, 0.0)
