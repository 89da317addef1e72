"""Contact forces on the feet that stand, for a wanted force and torque on the body: a small QP."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray, TextEnum
from gaitopt.dynamics.contacts import tangents, unit_normals

TOLERANCE = 1e-6
"""Violation of a friction pyramid that counts as rounding, as a share of the weight: a hundred
times the tolerance that ProxQP is given."""
EFFORT = 1e-4
"""Weight of the squared forces against the squared error of the wrench, both in units of the
weight. It makes the forces unique, and shifts the wrench by about 1e-4 of the weight."""
PROXQP_TOLERANCE = 1e-8
"""Absolute tolerance of ProxQP, with forces in units of the weight."""
DIGITS = 7
"""Decimals to which ProxQP's forces are rounded, in units of the weight. Its last bits depend on
where its memory lies; rounded, walks can be repeated bit for bit."""
NO_LIMIT = 1e20
"""What ProxQP takes for infinity."""


class ForceStatus(TextEnum):
    """How contact forces were found. Members equal their texts."""

    FREE = "free"
    """No foot is at a limit: solved directly."""
    LIMITED = "limited"
    """A foot is at a limit of its force: solved by a program for QPs."""
    KEPT = "kept"
    """No valid forces were found: the last valid ones are kept."""


@dataclass(frozen=True, eq=False)
class ForceShare:
    """Contact forces, with the residuals that show whether they are right.

    Attributes:
        forces: on each foot, in the world's axes ``(4, 3)`` [N].
        residual: largest error of the wrench, as a share of the weight (force) and of the weight
            times half the stance (torque).
        violation: how far a force lies outside its friction pyramid, as a share of the weight.
        status: how they were found.
    """

    forces: FloatArray
    residual: float
    violation: float
    status: ForceStatus


class ForceDistribution:
    """Distributes wrenches over four feet.

    It minimises the squared error of the wrench and, with a small weight, the squared forces. Each
    force keeps to the pyramid ``|fx|, |fy| <= mu / sqrt(2) fz``, which lies inside its friction
    cone; on a slope x, y and z are two tangents and the normal of the ground
    (:meth:`stand_on`). An instance remembers its last forces, so it serves one thread.

    Args:
        weight: of the robot [N], the unit of force.
        length: half the stance [m]; with ``weight`` the unit of torque.
        friction: coefficient ``mu``.
    """

    def __init__(self, weight: float, length: float, friction: float) -> None:
        from scipy.linalg.lapack import dposv

        self._weight = weight
        self._scale = np.array([1.0] * 3 + [1.0 / length] * 3) / weight
        self.stand_on(np.tile([0.0, 0.0, 1.0], (4, 1)), np.full(4, friction))
        self._solve = dposv
        self._solver: Any = None
        self._last = np.zeros(12)

    def stand_on(self, normals: FloatArray, friction: FloatArray) -> None:
        """From now on feet stand on ground with these normals ``(4, 3)`` and friction ``(4,)``."""
        self._rows = _pyramids(normals, friction / np.sqrt(2.0))

    def reset(self) -> None:
        """Forget the last forces, so that the next ones do not depend on earlier ones."""
        self._solver = None
        self._last = np.zeros(12)

    def share(self, grasp: FloatArray, wrench: FloatArray, load: FloatArray) -> ForceShare:
        """Forces on the feet that make up ``wrench``.

        Args:
            grasp: wrench of unit forces on the feet ``(6, 12)``: force rows, then torque rows.
            wrench: force [N] and torque [N m] that the feet are to exert together ``(6,)``.
            load: share of a full load for each foot ``(4,)``; 0 for feet in the air.

        Returns:
            The forces; where no forces make up the wrench, those that come nearest to it.
        """
        spread = np.repeat(load, 3)
        matrix = (self._scale * self._weight)[:, None] * grasp * spread
        target = self._scale * wrench
        square = matrix @ matrix.T
        square.flat[::7] += EFFORT
        # The minimum without friction limits; where it keeps them it is that of the QP.
        # LAPACK is called directly: NumPy's wrapper costs more than the six equations.
        x = matrix.T @ self._solve(square, target)[1]
        status = ForceStatus.FREE
        least = float((self._rows @ x).min())
        if least < -TOLERANCE:
            x, status = self._limited(matrix, target), ForceStatus.LIMITED
            least = float((self._rows @ x).min())
        # A comparison with NaN is false: forces that are no numbers are not valid, either.
        if not least >= -10.0 * TOLERANCE:
            # The forces of the last call are better than wrong ones.
            x, status = self._last, ForceStatus.KEPT
            least = float((self._rows @ x).min())
        self._last = x
        return ForceShare(
            forces=(self._weight * spread * x).reshape(4, 3),
            residual=float(np.abs(matrix @ x - target).max()),
            violation=max(-least, 0.0),
            status=status,
        )

    def _limited(self, matrix: FloatArray, target: FloatArray) -> FloatArray:
        """The solution of the QP by ProxQP ``(12,)``, in units of the weight."""
        hessian = matrix.T @ matrix
        hessian.flat[::13] += EFFORT
        gradient = -(matrix.T @ target)
        first = self._solver is None
        if first:
            self._solver = _workspace(len(self._rows))
        low = np.zeros(len(self._rows))
        high = np.full(len(self._rows), NO_LIMIT)
        load = self._solver.init if first else self._solver.update
        load(hessian, gradient, None, None, self._rows, low, high)
        self._solver.solve()
        return np.asarray(np.round(self._solver.results.x, DIGITS))


def _pyramids(normals: FloatArray, slopes: FloatArray) -> FloatArray:
    """Rows ``J (16, 12)`` of the constraints ``J f >= 0`` of four friction pyramids.

    Two opposite ones add up to a normal force of at least 0.

    Args:
        normals: of the ground below each foot ``(4, 3)``.
        slopes: largest ratio of each tangential component to the normal one ``(4,)``.
    """
    up, out = unit_normals(normals), np.zeros((16, 12))
    for i, (normal, along) in enumerate(zip(up, tangents(up), strict=True)):
        sides = np.repeat(along, 2, axis=0) * [[1.0], [-1.0], [1.0], [-1.0]]
        out[4 * i : 4 * i + 4, 3 * i : 3 * i + 3] = sides + slopes[i] * normal
    return out


def _workspace(rows: int) -> Any:
    """A ProxQP solver for 12 forces and this number of constraints."""
    from proxsuite import proxqp

    qp = proxqp.dense.QP(12, 0, rows)
    qp.settings.eps_abs = PROXQP_TOLERANCE
    qp.settings.eps_rel = 0.0
    # Zero forces are feasible, so this QP has a solution: tests for infeasibility are off.
    qp.settings.eps_primal_inf = 0.0
    qp.settings.eps_dual_inf = 0.0
    # Of 1174 random wrenches half took 12 iterations, and none more than 30.
    qp.settings.max_iter = 200
    qp.settings.max_iter_in = 100
    qp.settings.initial_guess = proxqp.InitialGuess.WARM_START_WITH_PREVIOUS_RESULT
    qp.settings.compute_timings = False
    return qp
