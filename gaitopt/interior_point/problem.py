"""What the interior-point method asks of a problem."""

from __future__ import annotations

from typing import Any, Protocol

from gaitopt.conventions import FloatArray


class Local(Protocol):
    """Values and derivatives of a problem at a point."""

    values: FloatArray

    def jacobian_transpose_times(self, v: FloatArray) -> FloatArray: ...

    def jacobian_times(self, dx: FloatArray) -> FloatArray: ...

    def newton_matrix(self, scale: FloatArray, multipliers: FloatArray) -> FloatArray: ...


class Problem(Protocol):
    """What the solver needs of a problem."""

    @property
    def linear_cost(self) -> FloatArray: ...

    @property
    def quadratic_cost(self) -> FloatArray: ...

    @property
    def restorable(self) -> int: ...

    def values(self, x: FloatArray) -> FloatArray: ...

    def restore(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]: ...

    def linearise(self, x: FloatArray) -> Any: ...


def slope_of(problem: Problem, x: FloatArray) -> FloatArray:
    """Gradient of the objective ``cost . x + sum(even * x**2) / 2``."""
    return problem.linear_cost + problem.quadratic_cost * x
