"""The Newton step of the barrier problem, from one banded Cholesky factor.

The barrier problem is ``min objective(x) - mu sum(log(s))`` subject to ``values(x) = s``. Newton's
method on its optimality conditions gives a linear system in unknowns, slacks and multipliers.
Slacks and multipliers are eliminated row by row ([Nocedal2006], section 19.3), which leaves

    (Q - sum_i z_i Hessian_i + J' diag(z / s) J) dx = right-hand side

with multipliers ``z`` and slacks ``s``. The step leads downhill when this matrix is positive
definite. Where the problem is not convex it may not be: then it is changed until its Cholesky
factor exists, either by damping (a multiple of the identity is added), or by leaving out a part of
the inequalities' curvature ``z_i Hessian_i``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.iterate import Iterate
from gaitopt.interior_point.problem import Linearisation, Problem, objective_gradient

_LEAST_SHARE = 0.1
"""A share of the curvature that is not above this is not halved again: none is taken then. So a
step costs at most five factors with curvature."""
_DIAGONAL_REGULARISATION = 1e-9
"""Added to the diagonal, as a share of its mean, where curvature may be left out. Without
curvature the matrix is positive semidefinite, and its factor fails for rounding alone."""
_FIRST_DAMPING = 1e-8
"""Least damping after a failed factor, as a share of the diagonal's mean. IPOPT begins with 1e-4
whatever the matrix (``first_hessian_perturbation``; [Waechter2006], algorithm IC)."""
_DAMPING_GROWTH = 4.0
"""Factor from one try of damping to the next; IPOPT's is 8 (``perturb_inc_fact``)."""
_NO_DAMPING = 1e-12
"""Damping that has fallen below this share of the diagonal's mean is left out: it is not far from
the rounding of the diagonal."""
_MOST_TRIES = 60
"""Tries of damping. The last adds 1e27 times the diagonal's mean, more than is ever needed."""


class Step(NamedTuple):
    """A Newton step.

    Attributes:
        x: of the unknowns ``(n,)``.
        slack: of the slacks ``(m,)``.
        multipliers: of the multipliers ``(m,)``.
    """

    x: FloatArray
    slack: FloatArray
    multipliers: FloatArray


class NewtonSystem:
    """The factorised Newton matrix at an iterate; it gives steps for several residuals."""

    def __init__(
        self,
        problem: Problem,
        iterate: Iterate,
        linearisation: Linearisation,
        reduce_curvature: bool,
    ) -> None:
        """Factorise the matrix, and note in ``iterate`` how it had to be changed.

        Args:
            problem, iterate: where the step begins.
            linearisation: of the problem there.
            reduce_curvature: leave out curvature first, and damp only what then still fails.
        """
        self._linearisation, self._barrier = linearisation, iterate.barrier
        self._slack, self._multipliers = iterate.slack, iterate.multipliers
        self._scale = iterate.multipliers / iterate.slack
        self._gradient = objective_gradient(problem, iterate.x)
        self._quadratic_cost = problem.quadratic_cost
        matrix = self._matrix(iterate.multipliers)
        factorise = self._factor_of_less_curvature if reduce_curvature else _damped_factor
        self._factor = factorise(matrix, iterate)

    def step(self, residual: FloatArray) -> Step | None:
        """The step after which ``values - slack`` is 0 to first order.

        Args:
            residual: ``values - slack`` before it ``(m,)``.

        Returns:
            ``None`` where the matrix has no factor, or the step would not be finite.
        """
        from scipy.linalg import cho_solve_banded

        if self._factor is None:
            return None
        slack, multipliers = self._slack, self._multipliers
        right = self._linearisation.jacobian_transpose_times(
            (self._barrier - multipliers * residual) / slack
        )
        right -= self._gradient
        dx = cho_solve_banded((self._factor, True), right, check_finite=False)
        if not np.isfinite(dx).all():
            return None
        dslack = self._linearisation.jacobian_times(dx) + residual
        return Step(dx, dslack, (self._barrier - multipliers * dslack) / slack - multipliers)

    def _matrix(self, curvature_weights: FloatArray) -> FloatArray:
        """The Newton matrix in banded form, with the curvature of so weighted inequalities."""
        matrix = self._linearisation.newton_matrix(self._scale, curvature_weights)
        # A diagonal is a band of one row.
        cost = np.atleast_2d(self._quadratic_cost)
        matrix[: len(cost)] += cost
        return matrix

    def _factor_of_less_curvature(self, full: FloatArray, iterate: Iterate) -> FloatArray | None:
        """A factor with as much of the curvature as leaves the matrix positive definite.

        The share is halved until it does; the next step begins with twice the share that did.
        """
        if not np.isfinite(full).all():
            return None
        regularisation = _DIAGONAL_REGULARISATION * float(np.abs(full[0]).mean())
        share, flat = iterate.curvature_share, None
        while share > 0.0:
            if share < 1.0 and flat is None:
                flat = self._matrix(np.zeros_like(self._multipliers))
            matrix = full.copy() if flat is None else share * full + (1.0 - share) * flat
            matrix[0] += regularisation
            factor = _cholesky(matrix)
            if factor is not None:
                iterate.curvature_share = min(1.0, 2.0 * share)
                return factor
            share = 0.5 * share if share > _LEAST_SHARE else 0.0
        iterate.curvature_share = 2.0 * _LEAST_SHARE
        assert flat is not None
        return _damped_factor(flat, iterate)


def _damped_factor(matrix: FloatArray, iterate: Iterate) -> FloatArray | None:
    """A factor of the matrix with as much damping as makes it positive definite."""
    diagonal = float(np.abs(matrix[0]).mean())
    if not np.isfinite(diagonal):
        return None
    damping = iterate.damping if iterate.damping > _NO_DAMPING * diagonal else 0.0
    for _ in range(_MOST_TRIES):
        damped = matrix.copy()
        damped[0] += damping
        factor = _cholesky(damped)
        if factor is not None:
            iterate.damping = damping
            return factor
        damping = max(_DAMPING_GROWTH * damping, _FIRST_DAMPING * diagonal)
    return None


def _cholesky(matrix: FloatArray) -> FloatArray | None:
    """The Cholesky factor of a lower band, which is overwritten; ``None`` if it has none."""
    from scipy.linalg import LinAlgError, cholesky_banded

    try:
        factor = cholesky_banded(matrix, lower=True, overwrite_ab=True, check_finite=False)
    except LinAlgError:
        return None
    return np.asarray(factor)
