"""Memory of CasADi and ProxQP that is reused from one COG problem to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.cog.formulation import CogFormulation

if TYPE_CHECKING:
    from gaitopt.optimize.quadratic import QuadraticSolver

VECTORS = ("gradient", "constraints")
"""Results of a formulation's derivatives that are no matrices."""


class CogWorkspace:
    """Memory of CasADi and ProxQP that is reused from problem to problem, by one thread."""

    def __init__(self) -> None:
        self._solvers: dict[tuple[int, int], QuadraticSolver] = {}
        self._calls: dict[CogFormulation, BufferedCall] = {}

    def solver(self, variables: int, constraints: int) -> QuadraticSolver:
        """The QP solver for problems of this size."""
        from gaitopt.optimize.quadratic import QuadraticSolver  # late: most problems do without

        key = variables, constraints
        if key not in self._solvers:
            self._solvers[key] = QuadraticSolver(*key)
        return self._solvers[key]

    def call(self, formulation: CogFormulation) -> BufferedCall:
        """The formulation's derivatives as a function of NumPy arrays."""
        if formulation not in self._calls:
            self._calls[formulation] = BufferedCall(formulation.derivatives)
        return self._calls[formulation]


class BufferedCall:
    """A CasADi function that reads and writes NumPy memory directly.

    A call takes 1 us, an ordinary call of CasADi 60 us. The arrays that a call returns are
    overwritten by the next call.

    Attributes:
        inputs: the arrays that it reads. Who fills them one by one calls :meth:`again`.
    """

    def __init__(self, function: Any) -> None:
        self._buffer, self._evaluate = function.buffer()
        self.inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self._outputs: list[FloatArray] = []
        for i, array in enumerate(self.inputs):
            self._buffer.set_arg(i, memoryview(array.data))
        for i in range(function.n_out()):
            rows, columns = function.size_out(i)
            flat = np.zeros(rows * columns)
            self._buffer.set_res(i, memoryview(flat.data))
            # CasADi stores columns one after another.
            is_vector = function.name_out(i) in VECTORS
            self._outputs.append(flat if is_vector else flat.reshape(columns, rows).T)

    def __call__(self, *values: FloatArray | tuple[float, ...]) -> list[FloatArray]:
        for array, value in zip(self.inputs, values, strict=True):
            array[:] = value
        return self.again()

    def again(self) -> list[FloatArray]:
        """The results for what :attr:`inputs` hold now."""
        self._evaluate()
        return self._outputs
