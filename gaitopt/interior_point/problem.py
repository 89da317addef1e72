"""What the interior-point method asks of a problem.

The problem is ``min linear_cost . x + x' Q x / 2`` over the unknowns ``x (n,)``, with a diagonal or
banded matrix ``Q`` that is positive semidefinite, subject to ``values(x) >= 0`` with ``m >= 1``
inequalities. They may be curved, and need not be convex. There are no equalities: what is fixed is
no unknown.

The method is made for problems whose Newton matrix is banded: every inequality looks at unknowns
that have neighbouring numbers.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.band import symmetric_times


class Linearisation(Protocol):
    """Values and derivatives of a problem's inequalities at one point.

    The Jacobian ``J (m, n)`` itself is never asked for, only products with it.
    """

    @property
    def values(self) -> FloatArray:
        """All inequalities ``(m,)``."""
        ...

    def jacobian_times(self, dx: FloatArray) -> FloatArray:
        """``J dx (m,)``: the change of all values, to first order."""
        ...

    def jacobian_transpose_times(self, v: FloatArray) -> FloatArray:
        """``J' v (n,)``: the gradient of ``v . values``."""
        ...

    def newton_matrix(self, scale: FloatArray, multipliers: FloatArray) -> FloatArray:
        """``J' diag(scale) J`` minus the Hessian of ``multipliers . values``.

        Args:
            scale: ``(m,)``, not negative.
            multipliers: ``(m,)``; with zeros the matrix is positive semidefinite.

        Returns:
            The lower band in LAPACK's form ``(width, n)``: row ``d`` holds the entries ``d`` below
            the diagonal, column by column. The caller may write into it.
        """
        ...


class Problem(Protocol):
    """A problem that :func:`gaitopt.interior_point.solver.minimise` solves."""

    @property
    def linear_cost(self) -> FloatArray:
        """Linear part of the objective ``(n,)``."""
        ...

    @property
    def quadratic_cost(self) -> FloatArray:
        """The objective's quadratic part ``Q``: its diagonal ``(n,)``, or its lower band.

        A band has LAPACK's form ``(width, n)``, and is no wider than the Newton matrix.
        """
        ...

    @property
    def restorable(self) -> int:
        """How many of the first inequalities :meth:`restore` can meet at any point; 0 for none."""
        ...

    def values(self, x: FloatArray) -> FloatArray:
        """All inequalities ``(m,)``, not negative where they are met; NaN where undefined."""
        ...

    def restore(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Change some unknowns so that the first inequalities are at least their slacks.

        Args:
            x: unknowns ``(n,)``.
            values: of all inequalities at ``x`` ``(m,)``.
            slack: ``(m,)``; the first :attr:`restorable` are asked for.

        Returns:
            Unknowns and values after the change, which must not change the other inequalities.
        """
        ...

    def linearise(self, x: FloatArray) -> Linearisation:
        """Values and derivatives at ``x``."""
        ...


def objective(problem: Problem, x: FloatArray) -> float:
    """``linear_cost . x + x' Q x / 2``."""
    return float((problem.linear_cost + _quadratic_gradient(problem, x) / 2.0) @ x)


def objective_gradient(problem: Problem, x: FloatArray) -> FloatArray:
    """Gradient of the objective ``(n,)``."""
    return problem.linear_cost + _quadratic_gradient(problem, x)


def _quadratic_gradient(problem: Problem, x: FloatArray) -> FloatArray:
    """``Q x (n,)``. A diagonal is a band of one row."""
    return symmetric_times(np.atleast_2d(problem.quadratic_cost), x)
