"""The problem of the time-optimal joint spline through given knots, eq. (7), in CasADi.

The unknowns are the intervals ``h`` between the knots, and the velocities and accelerations at the
knots. Between knots accelerations are linear in time, velocities are parabolas and angles are
cubics. The problem is then sparse:

* angle and velocity at the end of each interval follow from the values at its start;
* accelerations are largest at knots, and the jerk is constant between them: bounds on both are
  exact;
* a velocity may be largest between knots. With the Bernstein coefficients ``p0, p1, p2`` of
  ``limit - velocity`` it stays within its limit if and only if ``p0 >= 0``, ``p2 >= 0`` and
  ``p1 >= -sqrt(p0 p2)``.

The spline is "clamped": twice continuously differentiable, velocities zero at both ends,
accelerations free there. The paper's spline is of this kind, too, since it has 12 intervals for 13
waypoints: accelerations of zero at the ends would need two more knots, hence 14 intervals.

All quantities are in units of the limits and of a typical interval, so that numbers are of order
one for any robot. Problems are built here and solved in :mod:`gaitopt.optimize.spline.solver`.

Source: [Shao2011], Section III.B, eqs. (7)-(10), with bounds on the whole curve where
the paper has them at the knots (``docs/papers.md``, errata).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, is_real
from gaitopt.optimize.spline.clamped import (
    ROUNDING_RESERVE,
    checked_angles,
    clamped_spline,
    stretch_to_limits,
)
from gaitopt.optimize.spline.limits import JointLimits

VELOCITY_RESERVE = 1e-4
"""Share of a velocity limit that is not used, so that the square root in the bound between knots is
smooth where a velocity is at its limit at a knot. Chosen here."""


@dataclass(frozen=True, eq=False)
class SplineFormulation:
    """The symbolic problem for one number of knots and of joints, built once.

    The unknowns ``x`` are the intervals as multiples of a typical one; then, joint by joint, the
    velocities at all knots as shares of their limits; then the accelerations in the same way.

    Attributes:
        knots, joints: their numbers.
        nlp: CasADi's ``x``, ``p``, ``f``, ``g``.
        equalities: how many of the constraints are equalities: the first ones; the others are
            ``>= 0``.
        expressions: CasADi function ``(x, p) -> (cost, constraints)``, for inspection.
        gradient: CasADi function ``(x, p, multipliers) -> (gradient of the Lagrangian,
            constraints)``.
    """

    knots: int
    joints: int
    nlp: dict[str, Any]
    equalities: int
    expressions: Any
    gradient: Any

    def packed(
        self, intervals: FloatArray, velocities: FloatArray, accelerations: FloatArray
    ) -> FloatArray:
        """Vector of unknowns from intervals ``(n - 1,)`` and shares of limits ``(n, nj)``."""
        return np.concatenate([intervals, velocities.T.ravel(), accelerations.T.ravel()])


@dataclass(frozen=True, eq=False)
class SplineProblem:
    """The problem with numbers: angles, limits and weights.

    Attributes:
        formulation: the symbolic problem.
        angles: angles to pass through ``(n, nj)`` [rad].
        limits: bounds that hold on the whole curve.
        time_weight: weight of the total time in eq. (7) [1/s].
        acceleration_weight: weight of the squared accelerations at the knots [s^4/rad^2].
        intervals: feasible intervals from which the solver starts ``(n - 1,)`` [s]; all are equal.
    """

    formulation: SplineFormulation
    angles: FloatArray
    limits: JointLimits
    time_weight: float
    acceleration_weight: float
    intervals: FloatArray

    @property
    def unit(self) -> float:
        """The unit of time: the mean of the starting intervals [s]."""
        return float(self.intervals.mean())

    @property
    def parameters(self) -> FloatArray:
        """Values of the formulation's parameters."""
        v, a, j = self.limits.velocity, self.limits.acceleration, self.limits.jerk
        steps = np.diff(self.angles, axis=0) / (v * self.unit)
        weights = np.append(self.time_weight * self.unit, self.acceleration_weight * a**2)
        return np.concatenate([
            steps.T.ravel(), a * self.unit / v, a / (j * self.unit), weights / weights.max(),
        ])  # fmt: skip

    @property
    def start(self) -> FloatArray:
        """The unknowns of the starting intervals."""
        spline = clamped_spline(self.angles, self.intervals)
        velocities, accelerations = spline(spline.x, 1), spline(spline.x, 2)
        return self.formulation.packed(
            self.intervals / self.unit,
            velocities / self.limits.velocity,
            accelerations / self.limits.acceleration,
        )

    @property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds of the unknowns."""
        # A joint's mean velocity over an interval is not above its limit.
        least = np.abs(np.diff(self.angles, axis=0) / self.limits.velocity).max(axis=1) / self.unit
        accelerations = np.ones(self.angles.shape)
        velocities = accelerations.copy()
        velocities[[0, -1]] = 0.0
        low = self.formulation.packed(least, -velocities, -accelerations)
        high = self.formulation.packed(np.full(len(least), np.inf), velocities, accelerations)
        return low, high


def build_spline_problem(
    angles: ArrayLike,
    limits: JointLimits,
    *,
    time_weight: float = 1.0,
    acceleration_weight: float = 0.0,
) -> SplineProblem:
    """Build the problem of eq. (7) for given angles and limits.

    By default the total time is minimised. The paper's objective has ``time_weight`` equal to the
    number of joints (its ``m`` is both) and ``acceleration_weight`` 1.

    Args:
        angles: joint angles to pass through ``(n, nj)`` [rad], ``2 <= n <= 1000``; no two in
            succession the same.
        limits: of the same joints.
        time_weight: weight of the total time [1/s], positive.
        acceleration_weight: weight of the squared accelerations at the knots [s^4/rad^2].

    Raises:
        InputError: shapes do not fit, a number is not finite or has the wrong sign, or two
            successive knots are the same.
    """
    q = checked_angles(angles, limits)
    for name, weight in (
        ("time_weight", time_weight),
        ("acceleration_weight", acceleration_weight),
    ):
        if not (is_real(weight) and 0.0 <= weight < np.inf):
            raise InputError(f"{name} must be finite and not negative, got {as_text(weight)}")
    if not time_weight > 0:
        raise InputError("time_weight must be positive: with 0 slower splines are always better")
    intervals = np.ones(len(q) - 1)
    intervals *= stretch_to_limits(clamped_spline(q, intervals), limits) * ROUNDING_RESERVE
    return SplineProblem(
        formulation=spline_formulation(*q.shape),
        angles=q,
        limits=limits,
        time_weight=float(time_weight),
        acceleration_weight=float(acceleration_weight),
        intervals=frozen(intervals),
    )


@lru_cache(maxsize=32)
def spline_formulation(knots: int, joints: int) -> SplineFormulation:
    """Write eqs. (7)-(10) in CasADi for one number of knots and of joints.

    The parameters are the steps of the angles in units of velocity limit times typical interval,
    joint by joint; for each joint ``acceleration limit x interval / velocity limit`` and
    ``acceleration limit / (jerk limit x interval)``; the weight of time and those of accelerations.
    """
    import casadi as ca

    ca.GlobalOptions.setNumpyMode(1)
    n, m = knots, joints
    eta, v, mu = ca.SX.sym("eta", n - 1), ca.SX.sym("v", n, m), ca.SX.sym("mu", n, m)
    steps, alpha, beta = ca.SX.sym("d", n - 1, m), ca.SX.sym("a", 1, m), ca.SX.sym("b", 1, m)
    weights = ca.SX.sym("w", 1 + m)
    cost = weights[0] * ca.sum1(eta) + ca.dot(ca.sum1(mu**2).T, weights[1:])
    each = ca.repmat(eta, 1, m)
    gain = each * ca.repmat(alpha, n - 1, 1)
    v0, v1, mu0, mu1 = v[:-1, :], v[1:, :], mu[:-1, :], mu[1:, :]
    rows = [
        steps - each * (v0 + gain * (2 * mu0 + mu1) / 6),
        v1 - v0 - gain * (mu0 + mu1) / 2,
    ]
    equalities = sum(row.numel() for row in rows)
    for sign in (1, -1):
        rows.append(each - sign * ca.repmat(beta, n - 1, 1) * (mu1 - mu0))
        root = ca.sqrt((1 - sign * v0) * (1 - sign * v1) + VELOCITY_RESERVE**2)
        rows.append(1 - sign * (v0 + gain * mu0 / 2) + root - VELOCITY_RESERVE)
    x, g = ca.veccat(eta, v, mu), ca.veccat(*rows)
    p = ca.veccat(steps, alpha, beta, weights)
    multipliers = ca.SX.sym("multipliers", g.numel())
    gradient = ca.gradient(cost, x) + ca.jtimes(g, x, multipliers, True)
    return SplineFormulation(
        knots=n,
        joints=m,
        nlp={"x": x, "p": p, "f": cost, "g": g},
        equalities=equalities,
        expressions=ca.Function("spline", [x, p], [cost, g], ["x", "p"], ["cost", "g"]),
        gradient=ca.Function("spline_gradient", [x, p, multipliers], [gradient, g]),
    )
