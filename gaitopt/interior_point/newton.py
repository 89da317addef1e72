"""What an interior-point method for routes works on, and its Newton system.

Without equalities a Newton step condenses to one symmetric positive definite banded system in the
unknowns alone, whose Cholesky factor costs size times width squared. Where the problem is not
convex, the matrix is damped or takes less of the inequalities' curvature.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.problem import Problem, slope_of

_LEAST_BEND = 0.1
_MOST_SHIFTS = 60


@dataclass
class State:
    x: FloatArray
    slack: FloatArray
    dual: FloatArray
    barrier: float
    largest_miss: float
    shift: float = 0.0
    reduce_curvature: bool = False
    bend: float = 1.0
    filter: list[tuple[float, float]] = field(default_factory=list)


class Step(NamedTuple):
    """A Newton step of unknowns, slacks and multipliers."""

    dx: FloatArray
    ds: FloatArray
    dz: FloatArray


class Newton:
    """The Newton system at a point, damped until its matrix is positive definite."""

    def __init__(self, problem: Problem, state: State, here: Any) -> None:
        self._problem, self._here = problem, here
        self._x, self._slack, self._dual = state.x, state.slack, state.dual
        self._barrier = state.barrier
        self._matrix = here.newton_matrix(state.dual / state.slack, state.dual)
        self._matrix[0] += problem.quadratic_cost
        self._factor = self._unbent(state) if state.reduce_curvature else self._factorised(state)

    def _unbent(self, state: State) -> FloatArray | None:
        """A factor with as much of the curvature as leaves the matrix positive definite."""
        from scipy.linalg import LinAlgError, cholesky_banded

        curved, bend, flat = self._matrix, state.bend, None
        if not np.isfinite(curved).all():
            return None
        tiny = 1e-9 * float(np.abs(curved[0]).mean())
        while bend > 0.0:
            if bend < 1.0 and flat is None:
                flat = self._here.newton_matrix(self._dual / self._slack, np.zeros_like(self._dual))
                flat[0] += self._problem.quadratic_cost
            self._matrix = curved.copy() if flat is None else bend * curved + (1.0 - bend) * flat
            self._matrix[0] += tiny
            try:
                factor = cholesky_banded(self._matrix, lower=True, check_finite=False)
            except LinAlgError:
                bend = 0.5 * bend if bend > _LEAST_BEND else 0.0
                continue
            state.bend = min(1.0, 2.0 * bend)
            return np.asarray(factor)
        # Without its curvature the matrix is positive definite but for rounding.
        state.bend = 2.0 * _LEAST_BEND
        assert flat is not None
        self._matrix = flat
        return self._factorised(state)

    def _factorised(self, state: State) -> FloatArray | None:
        from scipy.linalg import LinAlgError, cholesky_banded

        diagonal = float(np.abs(self._matrix[0]).mean())
        shift = state.shift if state.shift > 1e-12 * diagonal else 0.0
        for _ in range(_MOST_SHIFTS if np.isfinite(diagonal) else 0):
            damped = self._matrix.copy()
            damped[0] += shift
            try:
                factor = cholesky_banded(damped, lower=True, overwrite_ab=True, check_finite=False)
            except LinAlgError:
                shift = max(4.0 * shift, 1e-8 * diagonal)
                continue
            state.shift = shift
            return np.asarray(factor)
        return None

    def step(self, gap: FloatArray) -> Step | None:
        """The step that closes the ``gap`` between inequalities and slacks."""
        from scipy.linalg import cho_solve_banded

        if self._factor is None:
            return None
        target = self._here.jacobian_transpose_times(
            (self._barrier - self._dual * gap) / self._slack
        )
        target -= slope_of(self._problem, self._x)
        dx = cho_solve_banded((self._factor, True), target, check_finite=False)
        if not np.isfinite(dx).all():
            return None
        ds = self._here.jacobian_times(dx) + gap
        return Step(dx, ds, (self._barrier - self._dual * ds) / self._slack - self._dual)
