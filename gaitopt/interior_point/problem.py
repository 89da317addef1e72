"""What the interior-point method asks of a problem."""

from __future__ import annotations

from typing import Any, Protocol

from gaitopt.conventions import FloatArray


class Local(Protocol):
    """Values and derivatives of a problem at a point."""

    values: FloatArray

    def pull(self, v: FloatArray) -> FloatArray: ...

    def push(self, dx: FloatArray) -> FloatArray: ...

    def normal(self, scale: FloatArray, duals: FloatArray) -> FloatArray: ...


class Problem(Protocol):
    """What the solver needs of a problem."""

    @property
    def cost(self) -> FloatArray: ...

    @property
    def even(self) -> FloatArray: ...

    @property
    def settled(self) -> int: ...

    def values(self, x: FloatArray) -> FloatArray: ...

    def settle(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]: ...

    def linearised(self, x: FloatArray) -> Any: ...


def slope_of(problem: Problem, x: FloatArray) -> FloatArray:
    """Gradient of the objective ``cost . x + sum(even * x**2) / 2``."""
    return problem.cost + problem.even * x
