"""Joint splines: the fastest through given knots within limits, and swings made of them.

IPOPT chooses the intervals; everything that a :class:`JointSpline` says of itself is computed anew
from its knots and intervals alone. The solver's answer is stretched in time by the part in a
million or less by which it breaks a bound, so that a solved spline breaks none.

Other solvers were tried: Fatrop took a third of IPOPT's time, but on one of 60 random problems it
did not come to an end; CasADi's sqpmethod did not converge with any of seven QP solvers.

Source: 004_6eabd5aa21217b1c.txt, Section III.B; the problem is in
:mod:`gaitopt.optimize.spline_problem`.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError, SolverError
from gaitopt.optimize.spline_problem import (
    JointLimits,
    SplineProblem,
    build_spline_problem,
    checked_angles,
    clamped_coefficients,
    knot_values,
    peaks,
    spline_formulation,
    stretch,
)
from gaitopt.robots.leg import Leg
from gaitopt.swing.obstacle_paths import (
    PAPER_COUNT,
    Clearance,
    ObstaclePath,
    Pattern,
    Section,
    clear_path,
)

KINDS = ("velocity", "acceleration", "jerk")

FEASIBILITY = 1e-6
"""Largest share by which a solver's answer may break a bound before it is stretched."""
OPTIMALITY = 1e-6
"""Largest residual of the optimality conditions in an accepted answer, in shares of the cost."""
ACTIVE_SHARE = 0.999
"""Share of its limit from which a bound is said to be active."""
REACH_TOLERANCE = 1e-6
"""By how much a waypoint may lie out of a leg's reach [m]."""
_ITERATIONS = 300
_SECONDS = 10.0


class ActiveBound(NamedTuple):
    """A bound that is reached.

    Attributes:
        joint: its column.
        interval: which interval, from 0.
        kind: ``"velocity"``, ``"acceleration"`` or ``"jerk"``.
        share: the largest value there over its limit.
    """

    joint: int
    interval: int
    kind: str
    share: float


@dataclass(frozen=True)
class SolverReport:
    """What IPOPT said of the run that counts, and how its answer was found to be.

    Attributes:
        message: IPOPT's own verdict.
        iterations: its iterations.
        seconds: time in it [s].
        violation: largest share by which its answer broke a bound, before it was stretched.
        stationarity: largest entry of the Lagrangian's gradient, the cost being of order one.
        complementarity: largest product of a multiplier and the slack of its bound.
    """

    message: str
    iterations: int
    seconds: float
    violation: float
    stationarity: float
    complementarity: float


@dataclass(frozen=True, eq=False)
class JointSpline:
    """A cubic spline through joint angles: twice differentiable, at rest at both ends.

    Attributes:
        angles: knots ``(n, nj)`` [rad].
        intervals: times between them ``(n - 1,)`` [s].
        limits: bounds it is meant to keep on the whole curve.
        status: ``"solved"`` for the optimum of eq. (7); ``"scaled"`` for intervals that were chosen
            by hand and stretched together until all bounds hold.
        report: the solver's report; ``None`` when none was asked.
    """

    angles: FloatArray
    intervals: FloatArray
    limits: JointLimits
    status: str = "scaled"
    report: SolverReport | None = None

    def __post_init__(self) -> None:
        angles, intervals = checked_angles(self.angles, self.limits), frozen(self.intervals)
        good = intervals.shape == (len(angles) - 1,) and np.isfinite(intervals).all()
        if not good or not (intervals > 0.0).all():
            raise InputError(
                f"a spline through {len(angles)} knots needs {len(angles) - 1} positive intervals, "
                f"got {self.intervals!r}"
            )
        object.__setattr__(self, "angles", angles)
        object.__setattr__(self, "intervals", intervals)

    @cached_property
    def times(self) -> FloatArray:
        """Times of the knots ``(n,)`` from 0 [s]."""
        return frozen(np.concatenate([[0.0], np.cumsum(self.intervals)]))

    @property
    def duration(self) -> float:
        """Total time [s]."""
        return float(self.times[-1])

    @cached_property
    def coefficients(self) -> FloatArray:
        """``(4, n - 1, nj)``, highest power first, in the time since each interval's start.

        The layout of :class:`gaitopt.planning.path.MotionPath`, for the joints alone.
        """
        return frozen(clamped_coefficients(self.angles, self.intervals))

    def evaluate(self, times: ArrayLike, derivative: int = 0) -> FloatArray:
        """Angles, or their ``derivative``-th time derivative, at ``times (N,)``: ``(N, nj)``.

        Times outside are moved to the ends; at a knot the later interval counts.
        """
        t = np.clip(np.asarray(times, dtype=np.float64), 0.0, self.duration)
        index = np.clip(np.searchsorted(self.times, t, "right") - 1, 0, len(self.intervals) - 1)
        local = (t - self.times[index])[..., None]
        out = np.zeros((*t.shape, self.angles.shape[1]))
        for power in range(3, derivative - 1, -1):
            factor = float(np.prod(np.arange(power - derivative + 1, power + 1)))
            out = out * local + factor * self.coefficients[3 - power][index]
        return out

    @cached_property
    def shares(self) -> FloatArray:
        """Largest velocity, acceleration, jerk on each interval over its limit ``(3, n - 1, nj)``.

        Exact for the whole curve: the extremes of a cubic's derivatives in closed form.
        """
        limits = np.stack([getattr(self.limits, kind) for kind in KINDS])
        return frozen(peaks(self.coefficients, self.intervals) / limits[:, None])

    @property
    def violation(self) -> float:
        """Largest share by which a bound is broken anywhere; 0 when all hold."""
        return max(float(self.shares.max()) - 1.0, 0.0)

    @property
    def jumps(self) -> FloatArray:
        """Largest jump of angle, velocity and acceleration at inner knots, and velocity left over
        at the end: ``(4,)`` [rad, rad/s, rad/s^2, rad/s]. Rounding, unless something is wrong.
        """
        cubic, square, slope, angle = self.coefficients
        h = self.intervals[:, None]
        ends = (
            ((cubic * h + square) * h + slope) * h + angle,
            (3.0 * cubic * h + 2.0 * square) * h + slope,
            6.0 * cubic * h + 2.0 * square,
        )
        inner = [
            np.abs(end[:-1] - start[1:]).max(initial=0.0)
            for end, start in zip(ends, (angle, slope, 2.0 * square), strict=True)
        ]
        return np.array([*inner, np.abs(ends[1][-1]).max()])

    def active(self, share: float = ACTIVE_SHARE) -> tuple[ActiveBound, ...]:
        """The bounds that are reached to at least ``share``, interval by interval."""
        kinds, intervals, joints = np.nonzero(self.shares >= share)
        found = [
            ActiveBound(int(j), int(i), KINDS[k], float(self.shares[k, i, j]))
            for k, i, j in zip(kinds, intervals, joints, strict=True)
        ]
        return tuple(sorted(found, key=lambda bound: (bound.interval, bound.joint)))

    def cost(self, time_weight: float, acceleration_weight: float) -> float:
        """Eq. (7): weighted total time, and squared accelerations at all knots."""
        accelerations = knot_values(self.coefficients, self.intervals)[2]
        return time_weight * self.duration + acceleration_weight * float((accelerations**2).sum())

    def position_range(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest angle of each joint on the whole curve ``(nj,)`` [rad], exact."""
        cubic, square, slope, _ = self.coefficients
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            root = np.sqrt(np.maximum(square**2 - 3.0 * cubic * slope, 0.0))
            big = -(square + np.copysign(root, square))
            turns = np.nan_to_num(
                np.stack([big / (3.0 * cubic), slope / big]), posinf=0.0, neginf=0.0
            )
        local = np.clip(turns, 0.0, self.intervals[:, None])
        curve = self.coefficients
        values = ((curve[0] * local + curve[1]) * local + curve[2]) * local + curve[3]
        every = np.concatenate([values.reshape(-1, self.angles.shape[1]), self.angles])
        return every.min(axis=0), every.max(axis=0)

    def stretched(self, factor: float) -> JointSpline:
        """The same curve in ``factor`` times the time; the result is ``"scaled"``."""
        return replace(self, intervals=self.intervals * factor, status="scaled", report=None)


class UnsolvedSplineError(SolverError):
    """No optimum was verified.

    Attributes:
        spline: a feasible spline through the same knots, uniformly scaled.
    """

    def __init__(self, message: str, spline: JointSpline) -> None:
        super().__init__(message)
        self.spline = spline

    def __reduce__(self) -> tuple[object, ...]:
        return (type(self), (str(self), self.spline))


def uniform_spline(
    angles: ArrayLike, limits: JointLimits, intervals: ArrayLike | None = None
) -> JointSpline:
    """The spline by hand: given intervals, all stretched until the tightest bound just holds.

    Args:
        angles: knots ``(n, nj)`` [rad].
        limits: of the same joints.
        intervals: proportions ``(n - 1,)``; all the same by default.

    Raises:
        InputError: shapes do not fit, or a number has no sensible value.
    """
    q = checked_angles(angles, limits)
    shares = np.ones(len(q) - 1) if intervals is None else np.asarray(intervals, dtype=np.float64)
    spline = JointSpline(q, shares, limits)
    return spline.stretched(stretch(spline.coefficients, spline.intervals, limits) * (1.0 + 1e-14))


def solve_spline(problem: SplineProblem, starts: int = 2) -> JointSpline:
    """The intervals that minimise eq. (7) with all bounds on the whole curve.

    The problem is not convex. IPOPT runs from several starts and the best verified answer counts.
    Of 355 problems with knots at random, one start found the best optimum known on 97.5 %, two on
    98.6 %, three on 99.2 %; the paper's swing has shown only one optimum. Not for several threads
    at a time: solvers are built once for each size, and kept.

    Args:
        problem: from :func:`gaitopt.optimize.spline_problem.build_spline_problem`.
        starts: from how many starts, 1 to 4; more are tried when none of these leads to an optimum.

    Raises:
        UnsolvedSplineError: a :class:`SolverError`; no answer's residuals are small enough. Its
            ``spline`` is feasible, if slow.
        InputError: ``starts`` is no such number.
    """
    if starts not in (1, 2, 3, 4):
        raise InputError(f"starts must be 1, 2, 3 or 4, got {starts!r}")
    found: list[JointSpline] = []
    refused: UnsolvedSplineError | None = None
    for run, intervals in enumerate(_starting_intervals(problem)):
        if run >= starts and found:
            break
        try:
            found.append(_solved(replace(problem, intervals=intervals)))
        except UnsolvedSplineError as error:
            refused = refused or error
    if not found and refused:
        raise refused
    weights = problem.time_weight, problem.acceleration_weight
    return min(found, key=lambda spline: spline.cost(*weights))


def _starting_intervals(problem: SplineProblem) -> list[FloatArray]:
    """All the same, fast and slow; in proportion to what each needs alone, very slow and fast."""
    limits, steps = problem.limits, np.abs(np.diff(problem.angles, axis=0))
    alone = np.maximum(steps / limits.velocity, np.sqrt(steps / limits.acceleration))
    needed = np.maximum(alone, np.cbrt(steps / limits.jerk)).max(axis=1)
    fast = uniform_spline(problem.angles, limits, needed).intervals
    return [problem.intervals, 5.0 * problem.intervals, 20.0 * fast, fast]


def _solved(problem: SplineProblem) -> JointSpline:
    """One run of IPOPT, and its answer when that is verified."""
    answer = _answer(problem)
    intervals = answer.x[: len(problem.intervals)] * problem.unit
    if not (np.isfinite(answer.x).all() and (intervals > 0.0).all()):
        by_hand = uniform_spline(problem.angles, problem.limits)
        raise UnsolvedSplineError(f"IPOPT found no spline ({answer.message})", by_hand)
    coefficients = clamped_coefficients(problem.angles, intervals)
    factor = stretch(coefficients, intervals, problem.limits)
    report = SolverReport(
        answer.message, answer.iterations, answer.seconds, max(factor - 1.0, 0.0),
        *_residuals(problem, answer),
    )  # fmt: skip
    optimality = max(report.stationarity, report.complementarity)
    if not (report.violation <= FEASIBILITY and optimality <= OPTIMALITY):
        raise UnsolvedSplineError(
            f"the spline through {len(problem.angles)} knots was not solved within "
            f"{report.iterations} iterations of IPOPT ({report.message}): a bound is broken by "
            f"{report.violation:.2g} of its limit, optimality by {optimality:.2g}; use more evenly "
            "spaced knots, or this error's uniformly scaled spline",
            uniform_spline(problem.angles, problem.limits),
        )
    # Where only time counts, what room the answer left is used up too.
    if factor > 1.0 or problem.acceleration_weight == 0.0:
        intervals = intervals * factor * (1.0 + 1e-14)
    return JointSpline(problem.angles, intervals, problem.limits, "solved", report)


class _Answer(NamedTuple):
    """IPOPT's answer: unknowns, multipliers of constraints and of bounds, and what it says."""

    x: FloatArray
    row_duals: FloatArray
    bound_duals: FloatArray
    message: str
    iterations: int
    seconds: float


def _answer(problem: SplineProblem) -> _Answer:
    form = problem.formulation
    call = _ipopt(form.knots, form.joints)
    low, high = problem.bounds
    most = np.where(np.arange(form.nlp["g"].numel()) < form.equalities, 0.0, np.inf)
    begun = time.perf_counter()
    found = call(x0=problem.start, p=problem.parameters, lbx=low, ubx=high, lbg=0.0, ubg=most)
    seconds = time.perf_counter() - begun
    x, rows, bounds = (np.asarray(found[k]).ravel() for k in ("x", "lam_g", "lam_x"))
    said = call.stats()
    words = str(said["return_status"]).replace("_", " ")
    return _Answer(x, rows, bounds, words, int(said["iter_count"]), seconds)


@lru_cache(maxsize=32)
def _ipopt(knots: int, joints: int) -> Any:
    """The solver for one size, built once."""
    import casadi as ca

    options: dict[str, Any] = {
        "print_level": 0, "sb": "yes", "tol": 1e-8,
        "max_iter": _ITERATIONS, "max_wall_time": _SECONDS,
        # Velocities at knots strictly within their bounds keep the square roots real.
        "bound_relax_factor": 0.0,
    }  # fmt: skip
    more: dict[str, Any] = {"print_time": False, "error_on_fail": False, "ipopt": options}
    return ca.nlpsol("spline", "ipopt", spline_formulation(knots, joints).nlp, more)


def _residuals(problem: SplineProblem, answer: _Answer) -> tuple[float, float]:
    """Stationarity and complementarity of IPOPT's answer, from exact derivatives."""
    form, (low, high) = problem.formulation, problem.bounds
    slope, rows = form.gradient(answer.x, problem.parameters, answer.row_duals)
    free = high > low
    stationarity = np.abs(np.asarray(slope).ravel() + answer.bound_duals)[free].max()
    # A multiplier is negative where a lower bound pushes, positive where an upper one does.
    slack = np.where(answer.bound_duals < 0.0, answer.x - low, high - answer.x)
    slack = np.where(answer.bound_duals == 0.0, 0.0, np.where(free, slack, 0.0))
    products = np.concatenate([
        answer.bound_duals * slack,
        (answer.row_duals * np.asarray(rows).ravel())[form.equalities :],
    ])  # fmt: skip
    return float(stationarity), float(np.abs(products).max())


# --- swings of a leg ----------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class FootCurve:
    """What a leg's foot flies when its joints follow a spline and the body stands still.

    Attributes:
        leg: the leg.
        spline: its joints' motion.
        position: of the body frame in the world ``(3,)`` [m].
        rotation: body axes in the world ``(3, 3)``.
    """

    leg: Leg
    spline: JointSpline
    position: FloatArray
    rotation: FloatArray

    @property
    def times(self) -> FloatArray:
        """Times of the knots ``(n,)`` [s]."""
        return self.spline.times

    @cached_property
    def speeds(self) -> FloatArray:
        """Bound on the foot's speed on each interval ``(n - 1,)`` [m/s]: rates times levers."""
        leg = self.leg
        levers = [leg.upper + leg.lower, leg.lower]
        if leg.has_roll:
            levers.insert(0, float(np.hypot(leg.lateral, leg.drop + leg.upper + leg.lower)))
        rates = peaks(self.spline.coefficients, self.spline.intervals)[0]
        return np.asarray(rates @ np.array(levers))

    def place(self, times: FloatArray) -> FloatArray:
        """The foot in the world ``(N, 3)`` [m] at ``times (N,)``."""
        foot = self.leg.forward(self.spline.evaluate(times))
        return np.asarray(self.position + foot @ self.rotation.T)


class ObstacleSwing(NamedTuple):
    """A swing over an obstacle.

    Attributes:
        path: waypoints, and the path they were taken from.
        curve: what the foot flies; ``curve.spline`` is the joints' motion.
        clearance: of the curve from the obstacle with its margin.
    """

    path: ObstaclePath
    curve: FootCurve
    clearance: Clearance

    @property
    def spline(self) -> JointSpline:
        """The joints' motion."""
        return self.curve.spline


def swing_angles(
    leg: Leg, waypoints: ArrayLike, position: ArrayLike, rotation: ArrayLike | None = None
) -> FloatArray:
    """Joint knots ``(n, nj)`` [rad] that take a foot to ``waypoints (n, 3)`` in the world [m].

    Args:
        leg: the leg.
        waypoints: places of the foot frame.
        position: of the body frame ``(3,)`` [m].
        rotation: body axes in the world ``(3, 3)``; the world's own by default.

    Raises:
        InputError: a waypoint is out of reach or needs a joint beyond its limits.
    """
    turn = np.eye(3) if rotation is None else np.asarray(rotation, dtype=np.float64)
    local = (
        np.asarray(waypoints, dtype=np.float64) - np.asarray(position, dtype=np.float64)
    ) @ turn
    short = leg.shortfall(local)
    worst = int(short.argmax())
    if not short[worst] <= REACH_TOLERANCE:
        raise InputError(
            f"waypoint {worst} is {short[worst]:.4g} m out of the reach of leg {leg.name}; move "
            "the body nearer, or take a lower or shorter path"
        )
    angles = leg.inverse(local)
    _check_positions(leg, angles, angles, "a waypoint")
    return angles


def solve_obstacle_swing(
    leg: Leg,
    start: ArrayLike,
    end: ArrayLike,
    obstacle: Section,
    limits: JointLimits,
    *,
    position: ArrayLike,
    rotation: ArrayLike | None = None,
    margin: float = 0.03,
    pattern: Pattern = "parabola",
    count: int = PAPER_COUNT,
    time_weight: float = 1.0,
    acceleration_weight: float = 0.0,
) -> ObstacleSwing:
    """The fastest swing of a leg over an obstacle, the body standing still.

    What the foot flies keeps ``margin`` from the obstacle at every instant, proven by
    :func:`gaitopt.swing.obstacle_paths.clear_path`. The foot is a point: add the radius of a foot's
    ball to the margin.

    Args:
        leg: the leg that swings.
        start, end: where the foot frame lifts off and touches down ``(3,)`` [m].
        obstacle: what is in the way.
        limits: of the leg's joints.
        position, rotation: of the body, as in :func:`swing_angles`.
        margin, pattern, count: as in :func:`gaitopt.swing.obstacle_paths.obstacle_path`.
        time_weight, acceleration_weight: as in :func:`build_spline_problem`.

    Raises:
        InputError: no path, a waypoint out of reach, or a joint beyond its limits.
        SolverError: no spline was verified, or none that clears the obstacle.
    """
    turn = frozen(np.eye(3) if rotation is None else rotation)
    place = frozen(position)

    def fly(waypoints: FloatArray) -> FootCurve:
        angles = swing_angles(leg, waypoints, place, turn)
        problem = build_spline_problem(
            angles, limits, time_weight=time_weight, acceleration_weight=acceleration_weight
        )
        spline = solve_spline(problem)
        _check_positions(leg, *spline.position_range(), "the swing between waypoints")
        return FootCurve(leg, spline, place, turn)

    return ObstacleSwing(
        *clear_path(fly, start, end, obstacle, margin, pattern=pattern, count=count)
    )


def _check_positions(leg: Leg, low: FloatArray, high: FloatArray, what: str) -> None:
    """Refuse angles beyond a leg's position limits."""
    least, most = leg.position_limits
    beyond = np.maximum(least - low, high - most).reshape(-1, len(leg.joints)).max(axis=0)
    joint = int(beyond.argmax())
    if beyond[joint] > 1e-9:
        raise InputError(
            f"{what} takes joint {leg.joints[joint]} {np.degrees(beyond[joint]):.3g} degrees "
            "beyond its limits; move the body, or take a lower or shorter path"
        )
