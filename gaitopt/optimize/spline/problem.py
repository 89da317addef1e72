"""Time-optimal joint splines through given knots: the problem of eq. (7), and its instances.

Unknown are the intervals ``h`` between the knots. At each knot the spline has velocities and
accelerations; between knots accelerations are linear in time, so that velocities are parabolas and
angles cubics. With both as unknowns too, all of the problem is short and sparse:

* over each interval, angle and velocity at its end follow from the values at its start;
* accelerations are largest at knots, and jerk is constant in between: both bounds are exact there;
* a velocity may peak between knots. With the Bernstein coefficients ``p0, p1, p2`` of ``limit -
  velocity`` it stays within its bound if and only if ``p0 >= 0, p2 >= 0, p1 >= -sqrt(p0 p2)``.

The spline is "clamped": twice continuously differentiable, velocities zero at both ends,
accelerations free there. The paper's 12 intervals for 13 waypoints show that it is so there too:
accelerations that are zero at the ends would need two more knots, hence 14 intervals.

Everything is in units of the limits and of a typical interval, so that numbers are of order one for
any robot. Problems are only built here; :mod:`gaitopt.optimize.spline.solver` solves them.

Source: [Shao2011], Section III.B, eqs. (7)-(10), with bounds on the whole curve where
the paper has them at the knots (``docs/papers.md``, errata).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.motion.retiming import needed_stretch
from gaitopt.robots.leg import Leg

VELOCITY_RESERVE = 1e-4
"""Share of a velocity limit given away to make the bound between knots smooth."""
MOST_KNOTS = 1000
"""Most knots of a spline: the formulation's size grows with them."""
ROUNDING_RESERVE = 1.0 + 1e-13
"""Factor on stretched intervals, so that rounding breaks no bound.

Intervals are differences of times: with 1000 of them each is rounded by 1e-13 of itself.
"""


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Bounds on the size of each joint's motion.

    Attributes:
        velocity: ``(nj,)`` [rad/s].
        acceleration: ``(nj,)`` [rad/s^2].
        jerk: ``(nj,)`` [rad/s^3]; infinite for no bound.

    Raises:
        InputError: shapes differ, or a limit is not positive.
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    def __post_init__(self) -> None:
        for name in ("velocity", "acceleration", "jerk"):
            try:
                values = np.asarray(getattr(self, name), dtype=np.float64)
            except (TypeError, ValueError):
                raise InputError(
                    f"{name} limits must be numbers, got {getattr(self, name)!r}"
                ) from None
            largest = np.inf if name == "jerk" else np.finfo(float).max
            if (
                values.ndim != 1
                or not values.size
                or not ((values > 0) & (values <= largest)).all()
            ):
                raise InputError(
                    f"{name} limits must be positive{'' if name == 'jerk' else ' and finite'}, one "
                    f"for each joint, got {getattr(self, name)!r}"
                )
            object.__setattr__(self, name, frozen(values))
        if not self.velocity.shape == self.acceleration.shape == self.jerk.shape:
            raise InputError(
                f"limits must be of the same joints, got {len(self.velocity)} of velocity, "
                f"{len(self.acceleration)} of acceleration and {len(self.jerk)} of jerk"
            )

    @classmethod
    def of_leg(cls, leg: Leg, acceleration: ArrayLike, jerk: ArrayLike) -> JointLimits:
        """A leg's velocity limits with accelerations and jerks that a URDF does not hold.

        Args:
            leg: the leg.
            acceleration, jerk: for each joint, or one for all [rad/s^2], [rad/s^3].
        """
        size = leg.velocity_limits.shape
        try:
            both = [
                np.broadcast_to(np.asarray(a, dtype=np.float64), size) for a in (acceleration, jerk)
            ]
        except (TypeError, ValueError):
            raise InputError(
                f"acceleration and jerk must be one number or {size[0]}, for {leg.name}'s joints, "
                f"got {acceleration!r} and {jerk!r}"
            ) from None
        return cls(leg.velocity_limits, *both)


@dataclass(frozen=True, eq=False)
class SplineFormulation:
    """The symbolic problem for so many knots and joints, built once.

    Unknowns ``x``: the intervals as multiples of a typical one; then, joint by joint, the
    velocities at all knots as shares of their limits; then so the accelerations.

    Attributes:
        knots, joints: their numbers.
        nlp: CasADi's ``x``, ``p``, ``f``, ``g``.
        equalities: how many of the constraints, the first, are equalities; the rest read ``>= 0``.
        expressions: CasADi function ``(x, p) -> (cost, constraints)``, to look at.
        gradient: CasADi function ``(x, p, duals) -> (gradient of the Lagrangian, constraints)``.
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
        """Unknowns from intervals ``(n - 1,)`` and shares ``(n, nj)``."""
        return np.concatenate([intervals, velocities.T.ravel(), accelerations.T.ravel()])


@dataclass(frozen=True, eq=False)
class SplineProblem:
    """One instance: numbers for a formulation's parameters.

    Attributes:
        formulation: the symbolic problem.
        angles: angles to pass through ``(n, nj)`` [rad].
        limits: bounds that hold on the whole curve.
        time_weight: weight of the total time in eq. (7) [1/s].
        acceleration_weight: weight of the squared accelerations at the knots [s^4/rad^2].
        intervals: a feasible choice to start from ``(n - 1,)`` [s]: all the same.
    """

    formulation: SplineFormulation
    angles: FloatArray
    limits: JointLimits
    time_weight: float
    acceleration_weight: float
    intervals: FloatArray

    @property
    def unit(self) -> float:
        """The typical interval [s]."""
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
        """Unknowns of the feasible start."""
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
        # No joint's mean velocity is above its limit.
        least = np.abs(np.diff(self.angles, axis=0) / self.limits.velocity).max(axis=1) / self.unit
        one = np.ones(self.angles.shape)
        still = one.copy()
        still[[0, -1]] = 0.0
        low = self.formulation.packed(least, -still, -one)
        return low, self.formulation.packed(np.full(len(least), np.inf), still, one)


def build_spline_problem(
    angles: ArrayLike,
    limits: JointLimits,
    *,
    time_weight: float = 1.0,
    acceleration_weight: float = 0.0,
) -> SplineProblem:
    """Put numbers into the problem of eq. (7).

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
        if not (isinstance(weight, Real) and 0.0 <= weight < np.inf):
            raise InputError(f"{name} must be finite and not negative, got {weight!r}")
    if not time_weight > 0:
        raise InputError("time_weight must be positive: without it the best spline takes for ever")
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
    """Write eqs. (7)-(10) in CasADi for so many knots and joints.

    Parameters: steps of the angles in units of velocity limit times typical interval, joint by
    joint; for each joint ``limit of acceleration x interval / limit of velocity`` and ``limit of
    acceleration / (limit of jerk x interval)``; the weight of time and those of accelerations.
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
    duals = ca.SX.sym("duals", g.numel())
    slope = ca.gradient(cost, x) + ca.jtimes(g, x, duals, True)
    return SplineFormulation(
        knots=n,
        joints=m,
        nlp={"x": x, "p": p, "f": cost, "g": g},
        equalities=equalities,
        expressions=ca.Function("spline", [x, p], [cost, g], ["x", "p"], ["cost", "g"]),
        gradient=ca.Function("spline_gradient", [x, p, duals], [slope, g]),
    )


def checked_angles(angles: ArrayLike, limits: JointLimits) -> FloatArray:
    """Knots ``(n, nj)`` [rad] that a spline can pass through within limits.

    Raises:
        InputError: wrong shape, numbers that are not finite, or a knot like the one before it.
    """
    try:
        q = frozen(angles)
    except (TypeError, ValueError) as error:
        raise InputError(f"angles are no array of numbers: {error}") from error
    if q.ndim != 2 or not 2 <= len(q) <= MOST_KNOTS or q.shape[1] != len(limits.velocity):
        raise InputError(
            f"angles must have the shape (n, {len(limits.velocity)}), one column for each joint "
            f"with limits and 2 to {MOST_KNOTS} rows; got {q.shape}"
        )
    if not np.isfinite(q).all():
        raise InputError(f"angles of knot {np.argwhere(~np.isfinite(q))[0][0]} are not finite")
    same = np.flatnonzero(~np.diff(q, axis=0).any(axis=1))
    if same.size:
        raise InputError(f"knots {same[0]} and {same[0] + 1} are the same; leave one of them out")
    return q


def clamped_spline(angles: FloatArray, intervals: FloatArray) -> CubicSpline:
    """The clamped cubic spline through ``angles (n, nj)`` with ``intervals (n - 1,)`` [s].

    scipy's; its coefficients are ``(4, n - 1, nj)``, highest power first, in the time since each
    interval's start.
    """
    times = np.concatenate([[0.0], np.cumsum(intervals)])
    return CubicSpline(times, angles, bc_type="clamped")


def peaks(spline: CubicSpline) -> FloatArray:
    """Largest velocity, acceleration and jerk on each interval ``(3, n - 1, nj)``, exact.

    A cubic's velocity is a parabola, whose vertex may lie between the knots; its acceleration is
    largest at a knot, and its jerk is constant.
    """
    cubic, square, slope, _ = spline.c
    h = np.diff(spline.x)[:, None]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        when = -square / (3.0 * cubic)
        between = np.where((when > 0.0) & (when < h), slope + square * when, 0.0)
    end = slope + (2.0 * square + 3.0 * cubic * h) * h
    return np.stack([
        np.abs([slope, end, between]).max(axis=0),
        np.abs([2.0 * square, 2.0 * square + 6.0 * cubic * h]).max(axis=0),
        np.abs(6.0 * cubic),
    ])  # fmt: skip


def stretch_to_limits(spline: CubicSpline, limits: JointLimits) -> float:
    """Factor by which all intervals must be multiplied for the tightest bound just to hold."""
    velocity, acceleration, jerk = peaks(spline)
    return needed_stretch(
        (velocity / limits.velocity).max(),
        (acceleration / limits.acceleration).max(),
        (jerk / limits.jerk).max(),
    )
