"""Sharing a wrench out over the feet that stand: a small QP with friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray

TOLERANCE = 1e-6
"""Violation of the friction pyramid, as a share of the weight, that is let pass."""

EFFORT = 1e-4
"""Weight of the forces themselves against the error of the wrench; of order one to scale."""


@dataclass(frozen=True, eq=False)
class ForceShare:
    """Contact forces and how one knows that they are right.

    Attributes:
        forces: on each foot, in the world's axes ``(4, 3)`` [N].
        residual: largest error of the wrench, as a share of weight (force) and of weight times
            half the stance (torque).
        violation: how far a force lies outside its friction pyramid, as a share of the weight.
        status: ``"free"`` (no foot at its friction limit: solved directly), ``"limited"`` (by
            ProxQP), or ``"kept"`` (no good answer: the last good forces).
    """

    forces: FloatArray
    residual: float
    violation: float
    status: str


class ForceDistribution:
    """Distributes wrenches over four feet; keeps memory from call to call, for one thread.

    Minimises the error of the wrench, and with a small weight the forces, over the pyramid
    ``|fx|, |fy| <= mu / sqrt(2) fz`` that lies inside the friction cone of each foot.

    Args:
        weight: of the robot [N], the unit of force.
        length: half the stance [m]; with ``weight`` the unit of torque.
        friction: coefficient ``mu``.
    """

    def __init__(self, weight: float, length: float, friction: float) -> None:
        from scipy.linalg.lapack import dposv

        self._weight = weight
        self._scale = np.array([1.0] * 3 + [1.0 / length] * 3) / weight
        self._rows = _pyramids(friction / np.sqrt(2.0))
        self._solve = dposv
        self._solver: Any = None
        self._last = np.zeros(12)

    def reset(self) -> None:
        """Forget the last forces, so that the next answers do not depend on earlier ones."""
        self._solver = None
        self._last = np.zeros(12)

    def share(self, grasp: FloatArray, wrench: FloatArray, load: FloatArray) -> ForceShare:
        """Forces on the feet that make up ``wrench``.

        Args:
            grasp: wrench of unit forces on the feet ``(6, 12)``: force rows, then torque rows.
            wrench: force [N] and torque [N m] that the feet are to exert together ``(6,)``.
            load: share of a full load for each foot ``(4,)``; 0 for feet in the air.

        Returns:
            The forces; where they cannot make up the wrench, those that come nearest.
        """
        spread = np.repeat(load, 3)
        matrix = (self._scale * self._weight)[:, None] * grasp * spread
        target = self._scale * wrench
        square = matrix @ matrix.T
        square.flat[::7] += EFFORT
        # The minimiser without friction limits; where it keeps them it is the answer.
        # LAPACK itself: NumPy's wrapper costs more than the six equations.
        x = matrix.T @ self._solve(square, target)[1]
        status = "free"
        violation = float((self._rows @ x).min())
        if violation < -TOLERANCE:
            x, status = self._limited(matrix, target), "limited"
            violation = float((self._rows @ x).min())
        if not violation >= -10.0 * TOLERANCE:
            # Forces of a moment ago are better than wrong ones; feet in the air push nothing.
            x, status = self._last, "kept"
            violation = float((self._rows @ x).min())
        self._last = x
        return ForceShare(
            forces=(self._weight * spread * x).reshape(4, 3),
            residual=float(np.abs(matrix @ x - target).max()),
            violation=max(-violation, 0.0),
            status=status,
        )

    def _limited(self, matrix: FloatArray, target: FloatArray) -> FloatArray:
        hessian = matrix.T @ matrix
        hessian.flat[::13] += EFFORT
        gradient = -(matrix.T @ target)
        first = self._solver is None
        if first:
            self._solver = _workspace(len(self._rows))
        low = np.zeros(len(self._rows))
        high = np.full(len(self._rows), 1e20)
        load = self._solver.init if first else self._solver.update
        load(hessian, gradient, None, None, self._rows, low, high)
        self._solver.solve()
        # The last bits depend on where its memory lies. Rounded, walks can be repeated.
        return np.asarray(np.round(self._solver.results.x, 7))


def _pyramids(slope: float) -> FloatArray:
    """Rows of ``J f >= 0`` for four feet ``(16, 12)``; together they make ``fz >= 0``."""
    one = np.array([[1, 0, slope], [-1, 0, slope], [0, 1, slope], [0, -1, slope]])
    return np.kron(np.eye(4), one)


def _workspace(rows: int) -> Any:
    from proxsuite import proxqp

    qp = proxqp.dense.QP(12, 0, rows)
    qp.settings.eps_abs = 1e-8
    qp.settings.eps_rel = 0.0
    # With its tests for infeasibility off (this QP always has an answer) it stops at max_iter.
    qp.settings.eps_primal_inf = 0.0
    qp.settings.eps_dual_inf = 0.0
    qp.settings.max_iter = 200
    qp.settings.max_iter_in = 100
    qp.settings.initial_guess = proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
    qp.settings.compute_timings = False
    return qp
