"""Time-optimal joint splines: bounds on the whole curve, optimality, and swings over obstacles."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gaitopt
from gaitopt.errors import InputError, SolverError, UnsolvedSplineError
from gaitopt.motion.foot_curve import FootCurve
from gaitopt.motion.path import MotionPath
from gaitopt.optimize.spline import solver as spline_module
from gaitopt.optimize.spline.joint_spline import KINDS, JointSpline, uniform_spline
from gaitopt.optimize.spline.limits import JointLimits
from gaitopt.optimize.spline.obstacle_swing import (
    ObstacleSwing,
    solve_obstacle_swing,
    swing_angles,
)
from gaitopt.optimize.spline.problem import (
    VELOCITY_RESERVE,
    build_spline_problem,
    spline_formulation,
)
from gaitopt.optimize.spline.solver import solve_spline
from gaitopt.robots.quadruped import Quadruped
from gaitopt.studies import swing_study as reference
from gaitopt.swing.obstacle_paths import PATTERNS
from gaitopt.terrain.obstacles import rectangular_obstacle, round_obstacle, triangular_obstacle

TABLE_1 = reference.PAPER_LIMITS


def random_case(seed: int, largest: int = 14) -> tuple[np.ndarray, JointLimits]:
    """Knots of a random walk for one to three joints, and limits of very different sizes."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(2, largest)), int(rng.integers(1, 4))
    angles = np.cumsum(rng.normal(scale=10 ** rng.uniform(-2, 0), size=(n, m)), axis=0)
    limits = JointLimits(
        10 ** rng.uniform(-1, 1.5, m), 10 ** rng.uniform(-1, 2, m), 10 ** rng.uniform(-1, 3, m)
    )
    return angles, limits


def by_scipy(spline: JointSpline) -> Any:
    from scipy.interpolate import CubicSpline

    return CubicSpline(spline.times, spline.angles, bc_type="clamped")


def scipy_shares(spline: JointSpline) -> np.ndarray:
    """Largest velocity, acceleration, jerk of SciPy's spline over the limits ``(3, nj)``.

    At all knots, and wherever the next derivative is zero between them.
    """
    from scipy.interpolate import PPoly

    curve = by_scipy(spline)
    out = np.zeros((3, spline.angles.shape[1]))
    for joint in range(spline.angles.shape[1]):
        one = PPoly(curve.c[:, :, joint], curve.x)
        for order, kind in enumerate(KINDS, start=1):
            turns = one.derivative(order + 1).roots(discontinuity=False, extrapolate=False)
            times = np.concatenate([curve.x, turns[np.isfinite(turns)]])
            size = np.abs(one.derivative(order)(times)).max()
            out[order - 1, joint] = size / getattr(spline.limits, kind)[joint]
    return out


@pytest.fixture(scope="module")
def paper() -> ObstacleSwing:
    """The paper's case: frog1 over its board, 13 waypoints, Table I."""
    return reference.paper_swing()


@pytest.fixture(scope="module")
def frog() -> Quadruped:
    return gaitopt.load_robot("frog1")


# --- known answers ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("limits", "time"),
    [((1.5, 1e3, 1e6), 1.0), ((1e3, 6.0, 1e6), 1.0), ((1e3, 1e3, 12.0), 1.0), ((0.75, 6, 12), 2.0)],
)
def test_one_cubic_from_rest_to_rest(limits: tuple[float, float, float], time: float) -> None:
    """One radian in time T: peaks 1.5 / T, 6 / T^2 and 12 / T^3."""
    problem = build_spline_problem([[0.0], [1.0]], JointLimits(*([x] for x in limits)))
    spline = solve_spline(problem)
    assert spline.duration == pytest.approx(time, rel=2 * VELOCITY_RESERVE)
    assert spline.violation <= 1e-12


def test_symmetric_knots_have_symmetric_intervals() -> None:
    half = np.array([[0.0, 0.3], [0.1, 0.5], [0.4, 0.6], [0.5, 0.4]])
    knots = np.concatenate([half, 2 * half[-1] - half[-2::-1]])
    spline = solve_spline(build_spline_problem(knots, JointLimits([1, 1], [3, 2], [20, 9])))
    np.testing.assert_allclose(spline.intervals, spline.intervals[::-1], rtol=1e-5)


@settings(max_examples=25)
@given(st.integers(0, 10_000), st.floats(0.2, 5.0), st.floats(0.2, 5.0))
def test_time_and_angle_have_no_unit_of_their_own(seed: int, pace: float, turn: float) -> None:
    """Angles in other units and time in other units: the same spline."""
    angles, limits = random_case(seed, largest=6)
    scaled = JointLimits(
        limits.velocity * turn * pace,
        limits.acceleration * turn * pace**2,
        limits.jerk * turn * pace**3,
    )
    here = solve_spline(build_spline_problem(angles, limits))
    there = solve_spline(build_spline_problem(angles * turn, scaled))
    assert there.duration * pace == pytest.approx(here.duration, rel=1e-5)


# --- bounds on the whole curve ------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(40))
def test_scipy_finds_no_violation_and_the_same_extremes(seed: int) -> None:
    spline = solve_spline(build_spline_problem(*random_case(seed)))
    theirs = scipy_shares(spline)
    assert theirs.max() <= 1 + 1e-6
    assert theirs.max() >= 1 - 2 * VELOCITY_RESERVE  # some bound is reached
    np.testing.assert_allclose(spline.shares.max(axis=1), theirs, rtol=1e-6, atol=1e-9)
    assert spline.status == "solved" and spline.violation <= 1e-12


@pytest.mark.parametrize("seed", range(10))
def test_coefficients_are_in_the_time_since_each_interval_starts(seed: int) -> None:
    """By Horner's method on each interval; times outside are moved to the ends."""
    angles, limits = random_case(seed)
    intervals = np.random.default_rng(seed).uniform(0.1, 2.0, len(angles) - 1)
    spline = JointSpline(angles, intervals, limits)
    np.testing.assert_allclose(spline.evaluate(spline.times), angles, rtol=1e-9, atol=1e-9)
    for k, start in enumerate(spline.times[:-1]):
        local = np.linspace(0.0, intervals[k], 11)[:-1]
        here = np.array([np.polyval(spline.coefficients[:, k], t) for t in local])
        found = spline.evaluate(start + local)
        np.testing.assert_allclose(found, here, rtol=1e-9, atol=1e-9)
    outside = spline.evaluate([-0.5, spline.duration + 0.5])
    np.testing.assert_allclose(outside, angles[[0, -1]], rtol=1e-9, atol=1e-9)
    assert spline.evaluate(spline.times, 4).max() == 0.0


@pytest.mark.parametrize("seed", range(10))
def test_curve_is_twice_differentiable_and_at_rest_at_its_ends(seed: int) -> None:
    spline = solve_spline(build_spline_problem(*random_case(seed)))
    scale = np.abs(spline.evaluate(spline.times, 2)).max() + 1.0
    assert spline.jumps.max() < 1e-9 * scale
    np.testing.assert_allclose(spline.evaluate(spline.times), spline.angles, atol=1e-12)
    ends = spline.evaluate([0.0, spline.duration], 1)
    np.testing.assert_allclose(ends, 0, atol=1e-9 * scale)


@given(st.integers(0, 10_000))
def test_position_range_is_that_of_the_whole_curve(seed: int) -> None:
    """Against 20,000 samples: never less, and no more than the curve bends between two."""
    angles, limits = random_case(seed)
    spline = uniform_spline(angles, limits)
    low, high = spline.position_range()
    samples = spline.evaluate(np.linspace(0, spline.duration, 20_001))
    slack = limits.acceleration * (spline.duration / 20_000) ** 2 / 8 + 1e-12
    assert (low <= samples.min(axis=0) + 1e-12).all() and (
        high >= samples.max(axis=0) - 1e-12
    ).all()
    assert (low >= samples.min(axis=0) - slack).all() and (
        high <= samples.max(axis=0) + slack
    ).all()


@given(st.tuples(*[st.floats(-3.0, 3.0)] * 3))
def test_bernstein_condition_is_exact(p: tuple[float, float, float]) -> None:
    """A parabola with coefficients p0, p1, p2 is not negative on [0, 1] if and only if
    p0 >= 0, p2 >= 0 and p1 >= -sqrt(p0 p2)."""
    s = np.linspace(0, 1, 20_001)
    least = (p[0] * (1 - s) ** 2 + 2 * p[1] * s * (1 - s) + p[2] * s**2).min()
    holds = p[0] >= 0 and p[2] >= 0 and p[1] >= -math.sqrt(p[0] * p[2])
    if abs(least) > 1e-7:
        assert holds == (least > 0)


def test_bounds_at_knots_alone_are_broken_between_them() -> None:
    """[Shao2011], eqs. (8)-(10) as printed: limits at the knots only, without those between."""
    import casadi as ca

    knots = np.array([[0.0], [0.2], [0.8], [1.0]])
    problem = build_spline_problem(knots, JointLimits([1.0], [50.0], [1e4]))
    form, rows = problem.formulation, 3
    low = np.zeros(form.nlp["g"].numel())
    for sign in range(2):
        between = form.equalities + (2 * sign + 1) * rows
        low[between : between + rows] = -np.inf
    solver = ca.nlpsol("printed", "ipopt", form.nlp,
                       {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes"}})  # fmt: skip
    least, most = problem.bounds
    least[:3] = 1e-3  # our bound on the mean velocity would help as well
    most_rows = np.where(np.arange(len(low)) < form.equalities, 0.0, np.inf)
    found = solver(x0=problem.start, p=problem.parameters, lbx=least, ubx=most, lbg=low,
                   ubg=most_rows)  # fmt: skip
    printed = JointSpline(knots, np.asarray(found["x"]).ravel()[:3] * problem.unit, problem.limits)
    at_knots = np.abs(printed.evaluate(printed.times, 1)).max()
    assert at_knots <= 1 + 1e-6
    assert printed.violation > 0.05
    assert scipy_shares(printed)[0, 0] == pytest.approx(1 + printed.violation, rel=1e-9)
    ours = solve_spline(problem)
    assert ours.violation == pytest.approx(0, abs=1e-12) and ours.duration > printed.duration


# --- optimality ---------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(8))
def test_no_other_intervals_nearby_or_far_are_faster(seed: int) -> None:
    """500 random ones, each stretched until it is feasible; from 0.1 % to a factor of ten off."""
    angles, limits = random_case(seed)
    best = solve_spline(build_spline_problem(angles, limits))
    rng, least = np.random.default_rng(seed), best.duration * (1 - 2 * VELOCITY_RESERVE)
    for size in 10 ** rng.uniform(-3, 0.4, 500):
        other = best.intervals * np.exp(rng.normal(scale=size, size=len(best.intervals)))
        assert uniform_spline(angles, limits, other).duration >= least


def test_every_start_leads_to_the_same_optimum(paper: ObstacleSwing) -> None:
    problem = build_spline_problem(paper.spline.angles, TABLE_1)
    rng = np.random.default_rng(0)
    for _ in range(10):
        start = uniform_spline(problem.angles, TABLE_1, np.exp(rng.normal(scale=0.7, size=12)))
        other = solve_spline(replace(problem, intervals=start.intervals))
        assert other.duration == pytest.approx(paper.spline.duration, rel=1e-6)


@pytest.mark.parametrize("seed", range(10))
def test_answer_fulfils_the_conditions_of_optimality(seed: int) -> None:
    report = solve_spline(build_spline_problem(*random_case(seed))).report
    assert report is not None
    assert report.stationarity <= 1e-6 and report.complementarity <= 1e-6
    assert report.violation <= 1e-6 and report.iterations > 0 and report.seconds > 0


def test_derivatives_are_exact() -> None:
    """Against central differences of the Lagrangian at a random point."""
    problem = build_spline_problem(*random_case(3))
    form, rng = problem.formulation, np.random.default_rng(3)
    x = problem.start + rng.uniform(-0.01, 0.01, len(problem.start))
    duals = rng.normal(size=form.nlp["g"].numel())

    def lagrangian(at: np.ndarray) -> float:
        cost, rows = form.expressions(at, problem.parameters)
        return float(cost) + float(duals @ np.asarray(rows).ravel())

    slope = np.asarray(form.gradient(x, problem.parameters, duals)[0]).ravel()
    step = 1e-6 * np.eye(len(x))
    numeric = [(lagrangian(x + e) - lagrangian(x - e)) / 2e-6 for e in step]
    np.testing.assert_allclose(slope, numeric, rtol=1e-6, atol=1e-6 * np.abs(slope).max())


def test_start_is_feasible_and_on_the_equations() -> None:
    for seed in range(10):
        problem = build_spline_problem(*random_case(seed))
        form = problem.formulation
        rows = np.asarray(form.expressions(problem.start, problem.parameters)[1]).ravel()
        np.testing.assert_allclose(rows[: form.equalities], 0, atol=1e-9)
        low, high = problem.bounds
        # But for the reserve, which the start does not know of.
        assert rows[form.equalities :].min() > -1.01 * VELOCITY_RESERVE
        assert (problem.start >= low - 1e-9).all() and (problem.start <= high + 1e-9).all()
        scaled = JointSpline(problem.angles, problem.intervals, problem.limits)
        assert scaled.violation <= 1e-12 and scaled.shares.max() >= 1 - 1e-12


def test_equation_7_weighs_time_against_acceleration(paper: ObstacleSwing) -> None:
    """Its optimum costs least among the optima of other weights, and they are ordered."""
    angles = paper.spline.angles
    weights = (0.0, 1.0, 10.0, 100.0)
    splines = [
        solve_spline(build_spline_problem(angles, TABLE_1, time_weight=2.0, acceleration_weight=w))
        for w in weights
    ]
    durations = [s.duration for s in splines]
    squares = [s.cost(0.0, 1.0) for s in splines]
    assert durations == sorted(durations) and durations[-1] > 1.05 * durations[0]
    assert squares == sorted(squares, reverse=True)
    for w, best in zip(weights, splines, strict=True):
        for other in splines:
            assert best.cost(2.0, w) <= other.cost(2.0, w) * (1 + 1e-4)
    spline = splines[1]
    knots = by_scipy(spline)(spline.times, 2)
    assert spline.cost(2.0, 0.3) == pytest.approx(2 * spline.duration + 0.3 * (knots**2).sum())


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("kind", KINDS)
def test_looser_limits_are_not_slower(kind: str, seed: int) -> None:
    """On these: where there are several local optima it could happen."""
    angles, limits = random_case(seed, largest=6)
    factor = 1.0 + seed / 10
    looser = replace(limits, **{kind: getattr(limits, kind) * factor})
    tight = solve_spline(build_spline_problem(angles, limits)).duration
    loose = solve_spline(build_spline_problem(angles, looser)).duration
    assert loose <= tight * (1 + 1e-4)


def test_jerk_may_be_unbounded() -> None:
    angles, limits = random_case(5)
    free = replace(limits, jerk=np.full(len(limits.jerk), np.inf))
    spline = solve_spline(build_spline_problem(angles, free))
    assert spline.shares[2].max() == 0.0 and spline.violation <= 1e-12
    assert spline.duration <= solve_spline(build_spline_problem(angles, limits)).duration


def test_uniform_scaling_is_feasible_and_slower(paper: ObstacleSwing) -> None:
    uniform = uniform_spline(paper.spline.angles, TABLE_1)
    assert np.ptp(uniform.intervals) == 0.0 and uniform.status == "scaled"
    assert 1 - 1e-12 <= scipy_shares(uniform).max() <= 1 + 1e-12
    assert uniform.duration > 2 * paper.spline.duration


def test_stretching_scales_every_derivative() -> None:
    spline = uniform_spline(*random_case(2))
    slower = spline.stretched(2.0)
    np.testing.assert_allclose(slower.shares * np.array([2, 4, 8])[:, None, None], spline.shares)


def test_active_bounds_are_those_at_their_limits(paper: ObstacleSwing) -> None:
    spline = paper.spline
    active = spline.active()
    assert {a.kind for a in active} == set(KINDS)
    for bound in active:
        order = KINDS.index(bound.kind) + 1
        times = np.linspace(*spline.times[bound.interval : bound.interval + 2], 2001)[:-1]
        largest = np.abs(spline.evaluate(times, order)[:, bound.joint]).max()
        limit = getattr(TABLE_1, bound.kind)[bound.joint]
        assert largest / limit == pytest.approx(bound.share, abs=2e-3) and bound.share > 0.999
    # Fewer would leave an interval free to shrink.
    assert len(active) >= len(spline.intervals)
    assert spline.active(0.0)[0].interval == 0
    assert len(spline.active(0.0)) == spline.shares.size


def test_layout_is_that_of_a_motion_path(paper: ObstacleSwing) -> None:
    spline = paper.spline
    zero = np.zeros((4, len(spline.intervals), 6))
    path = MotionPath(spline.times, np.concatenate([zero, spline.coefficients], axis=2))
    times = np.linspace(0, spline.duration, 301)
    for order in range(3):
        np.testing.assert_array_equal(
            path.evaluate(times, order)[:, 6:], spline.evaluate(times, order)
        )


# --- what is refused, and what fails ------------------------------------------------------------


def test_unsolved_problem_offers_the_scaled_spline(monkeypatch: pytest.MonkeyPatch) -> None:
    """IPOPT with one iteration."""
    problem = build_spline_problem(*random_case(4))
    monkeypatch.setattr(spline_module, "_ITERATIONS", 1)
    spline_module._ipopt.cache_clear()
    try:
        with pytest.raises(UnsolvedSplineError) as caught:
            solve_spline(problem)
    finally:
        spline_module._ipopt.cache_clear()
    error = caught.value
    assert isinstance(error, SolverError)
    assert "was not solved within 1 iterations of IPOPT (Maximum Iterations Exceeded)" in str(error)
    assert error.spline.violation <= 1e-12 and error.spline.status == "scaled"
    copy = pickle.loads(pickle.dumps(error))
    assert str(copy) == str(error) and copy.spline.duration == error.spline.duration


LIMITS = JointLimits([1.0, 1.0], [2.0, 2.0], [9.0, 9.0])


@pytest.mark.parametrize(
    ("angles", "weights", "words"),
    [
        ([[0, 0], [1, 1], [1, 1]], {}, "knots 1 and 2 are the same"),
        ([[0, 0]], {}, r"shape \(n, 2\)"),
        ([[0, 0, 0], [1, 1, 1]], {}, r"got \(2, 3\)"),
        ([[0, 0], [1, math.nan]], {}, "angles of knot 1 are not finite"),
        ("straight", {}, "no array of numbers"),
        (np.random.default_rng(0).normal(size=(1001, 2)), {}, "2 to 1000 rows"),
        ([[0, 0], [1, 1]], {"time_weight": 0.0}, "slower splines are always better"),
        ([[0, 0], [1, 1]], {"time_weight": math.inf}, "time_weight must be finite"),
        ([[0, 0], [1, 1]], {"acceleration_weight": -1.0}, "acceleration_weight must be finite"),
    ],
)
def test_bad_problem_is_refused(angles: Any, weights: dict[str, float], words: str) -> None:
    with pytest.raises(InputError, match=words):
        build_spline_problem(angles, LIMITS, **weights)


@pytest.mark.parametrize(
    ("limits", "words"),
    [
        (([0.0], [1.0], [1.0]), "velocity limits must be positive and finite"),
        (([1.0], [math.inf], [1.0]), "acceleration limits must be positive and finite"),
        (([1.0], [1.0], [math.nan]), "jerk limits must be positive, one"),
        (([1.0], [1.0, 2.0], [1.0]), "got 1 of velocity, 2 of acceleration and 1 of jerk"),
        (("fast", [1.0], [1.0]), "velocity limits must be numbers"),
        ((1.0, [1.0], [1.0]), "one for each joint"),
    ],
)
def test_bad_limits_are_refused(limits: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        JointLimits(*limits)


def test_limits_of_a_leg(frog: Quadruped) -> None:
    limits = JointLimits.of_leg(frog.legs["RF"], math.radians(20), np.radians([40, 50]))
    for kind in KINDS:
        np.testing.assert_allclose(getattr(limits, kind), getattr(TABLE_1, kind), rtol=1e-15)
    with pytest.raises(InputError, match="one number or 2, for RF's joints"):
        JointLimits.of_leg(frog.legs["RF"], [1, 2, 3], 1)


@pytest.mark.parametrize("bad", [[1.0], [1.0, -1.0], [1.0, math.nan]])
def test_bad_intervals_are_refused(bad: list[float]) -> None:
    with pytest.raises(InputError, match="3 knots needs 2 positive intervals"):
        JointSpline(np.array([[0.0, 0], [1, 1], [2, 0]]), np.array(bad), LIMITS)


@pytest.mark.parametrize("bad", [0, 5, 1.5, None])
def test_bad_number_of_starts_is_refused(bad: Any) -> None:
    problem = build_spline_problem([[0.0], [1.0]], JointLimits([1], [1], [1]))
    with pytest.raises(InputError, match="starts must be 1, 2, 3 or 4"):
        solve_spline(problem, bad)


def test_more_starts_never_find_a_slower_spline() -> None:
    """Knots with two optima, 2.13 s and 2.97 s: from three starts the better one is found."""
    angles = np.array([[0.26612785], [-0.21033024], [-0.24753311], [-0.2525928], [0.13950352]])
    limits = JointLimits([23.54], [15.85], [4.499])
    problem = build_spline_problem(angles, limits)
    times = [solve_spline(problem, starts).duration for starts in (1, 2, 3, 4)]
    assert times == sorted(times, reverse=True)
    assert times[-1] == pytest.approx(2.1316, abs=1e-3)
    slow = solve_spline(replace(problem, intervals=problem.intervals * 1.3), 1)
    assert slow.duration == pytest.approx(2.9686, abs=1e-3)


def test_problems_of_one_size_share_one_formulation() -> None:
    one, two = (build_spline_problem(random_case(s)[0], random_case(s)[1]) for s in (1, 1))
    assert one.formulation is two.formulation is spline_formulation(*one.angles.shape)


# --- the paper's case ---------------------------------------------------------------------------


def test_papers_intervals_sum_to_its_total() -> None:
    assert reference.PAPER_INTERVALS.sum() == pytest.approx(8.4982, abs=1e-12)
    assert len(reference.PAPER_INTERVALS) == 12


def test_papers_case_takes_about_the_papers_time(paper: ObstacleSwing) -> None:
    """Link lengths, stride and waypoints are ours; an independent solution took 7.7 to 8.6 s for
    strides from 0.3 to 0.4 m."""
    assert len(paper.path.waypoints) == 13
    assert paper.spline.duration == pytest.approx(8.4982, rel=0.01)
    assert scipy_shares(paper.spline).max() <= 1 + 1e-6


def test_mixed_parabola_is_faster_than_trapezoid_and_box() -> None:
    times = [reference.paper_swing(pattern).spline.duration for pattern in PATTERNS]
    assert PATTERNS == ("box", "trapezoid", "parabola")
    assert times[0] > 1.05 * times[1] > 1.1 * times[2]


def test_papers_objective_is_nearly_that_of_least_time(paper: ObstacleSwing) -> None:
    """In radians: accelerations weigh little. In degrees the total would be far from 8.5 s."""
    angles = paper.spline.angles
    in_radians = solve_spline(
        build_spline_problem(angles, TABLE_1, time_weight=2.0, acceleration_weight=1.0)
    )
    in_degrees = solve_spline(
        build_spline_problem(
            angles, TABLE_1, time_weight=2.0, acceleration_weight=math.degrees(1) ** 2
        )
    )
    assert in_radians.duration == pytest.approx(paper.spline.duration, rel=2e-3)
    assert in_degrees.duration > 20


# --- swings of a leg ----------------------------------------------------------------------------


def pinocchio_foot(robot: Quadruped, leg: str, place: np.ndarray, turn: np.ndarray,
                   angles: np.ndarray) -> np.ndarray:  # fmt: skip
    """The foot frame in the world ``(N, 3)``."""
    model, data = robot.model, robot.model.createData()
    q = pin.neutral(model)
    q[:3], q[3:7] = place, pin.Quaternion(turn @ robot.body_axes.T).coeffs()
    columns = [7 + c for c in robot.leg_columns[leg]]
    out = []
    for row in angles:
        q[columns] = row
        pin.framesForwardKinematics(model, data, q)
        out.append(data.oMf[model.getFrameId(robot.legs[leg].foot)].translation.copy())
    return np.array(out)


@pytest.mark.parametrize(
    ("name", "leg", "obstacle", "stride"),
    [
        ("frog1", "RF", rectangular_obstacle(0.11, 0.04), 0.40),
        ("frog1", "LH", round_obstacle(0.11), 0.40),
        ("wang2020", "LF", triangular_obstacle(0.06, 0.06), 0.24),
        ("wang2020", "RH", rectangular_obstacle(0.05, 0.03, yaw=0.2), 0.22),
        ("anymal_c", "RF", rectangular_obstacle(0.08, 0.05), 0.34),
    ],
)
@pytest.mark.parametrize("pattern", PATTERNS)
def test_flown_swing_keeps_the_margin_by_pinocchio(
    name: str, leg: str, obstacle: Any, stride: float, pattern: Any
) -> None:
    robot = gaitopt.load_robot(name)
    of = robot.legs[leg]
    height = 0.72 if name == "frog1" else robot.standing_height
    place = np.array([0.0, 0.0, height]) - of.hip - of.axes[:, 1] * of.lateral
    limits = JointLimits.of_leg(of, of.velocity_limits * 4, of.velocity_limits * 40)
    ends = np.array([[-stride / 2, 0, 0], [stride / 2, 0, 0]])
    swing = solve_obstacle_swing(
        of, *ends, obstacle, limits, position=place, margin=0.02, pattern=pattern
    )
    times = np.linspace(0, swing.spline.duration, 4001)
    angles = swing.spline.evaluate(times)
    feet = pinocchio_foot(robot, leg, place, np.eye(3), angles)
    clearance = obstacle.distance(feet) - 0.02
    assert 0 <= swing.clearance.proven <= clearance.min() + 1e-9
    np.testing.assert_allclose(feet[[0, -1]], ends, rtol=0, atol=1e-9)
    np.testing.assert_allclose(swing.curve.place(times), feet, rtol=0, atol=1e-9)
    assert scipy_shares(swing.spline).max() <= 1 + 1e-6
    low, high = of.position_limits
    assert (angles >= low - 1e-9).all() and (angles <= high + 1e-9).all()


@pytest.mark.parametrize("name", ["frog1", "anymal_c"])
def test_foot_is_never_faster_than_its_bound(name: str) -> None:
    robot = gaitopt.load_robot(name)
    of, rng = robot.legs["LH"], np.random.default_rng(6)
    knots = rng.uniform(-0.5, 0.5, (7, len(of.joints)))
    one = np.ones(len(of.joints))
    spline = uniform_spline(knots, JointLimits(one, one, one))
    curve = FootCurve(of, spline, np.zeros(3), np.eye(3))
    for k in range(6):
        times = np.linspace(spline.times[k], spline.times[k + 1], 2001)
        steps = np.linalg.norm(np.diff(curve.place(times), axis=0), axis=1)
        assert (steps / np.diff(times)).max() <= curve.speeds[k] * (1 + 1e-9)


def test_tilted_body_swings_the_same_foot(frog: Quadruped) -> None:
    """Pitch and height of the body are free; the foot's way in the world is not changed."""
    of = frog.legs["RF"]
    turn = np.asarray(pin.utils.rotate("y", 0.15))
    place = np.array([0.0, 0.0, 0.70]) - turn @ of.hip
    swing = solve_obstacle_swing(of, [-0.2, 0, 0], [0.15, 0, 0], rectangular_obstacle(0.11, 0.04),
                                 TABLE_1, position=place, rotation=turn)  # fmt: skip
    feet = pinocchio_foot(frog, "RF", place, turn, swing.spline.angles)
    np.testing.assert_allclose(feet, swing.path.waypoints, rtol=0, atol=1e-9)
    assert swing.clearance.proven >= 0


def test_waypoint_out_of_reach_is_named(frog: Quadruped) -> None:
    of = frog.legs["RF"]
    place = np.array([0.0, 0.0, 0.72]) - of.hip
    with pytest.raises(InputError, match=r"waypoint 1 is 0\.2 m out of the reach of leg RF"):
        swing_angles(of, [[0, 0, 0], [0, 0, -0.28]], place)
    with pytest.raises(InputError, match=r"waypoint 0 is 0\.01 m out of the reach of leg RF"):
        swing_angles(of, [[0, 0.01, 0]], place)  # no roll joint


def test_joint_beyond_its_limits_is_named(frog: Quadruped) -> None:
    of = frog.legs["RF"]
    place = np.array([0.0, 0.0, 0.72]) - of.hip
    narrow = replace(of, position_limits=np.array([[-0.2, -2.4], [0.2, 0.0]]))
    with pytest.raises(InputError, match=r"a waypoint takes joint RF_HFE .* beyond its limits"):
        swing_angles(narrow, [[-0.1, 0, 0.1]], place)


@pytest.mark.parametrize("seed", range(6))
def test_the_formula_without_a_number_is_the_mean_acceleration_and_not_the_knot_s(
    seed: int,
) -> None:
    """[Shao2011] prints ``(v[j+1] - v[j]) / h[j]`` for the acceleration at the j-th knot.

    On a cubic piece the acceleration is linear in time, so this is the mean of both its knots.
    """
    angles, limits = random_case(seed)
    cubic = by_scipy(uniform_spline(angles, limits))
    knots, h = cubic.x, np.diff(cubic.x)[:, None]
    printed = np.diff(cubic(knots, 1), axis=0) / h
    at_knots = cubic(knots, 2)
    np.testing.assert_allclose(printed, (at_knots[1:] + at_knots[:-1]) / 2.0, atol=1e-9 *
                               np.abs(at_knots).max())  # fmt: skip
    # It is the knot's own acceleration minus half of what the jerk adds over the interval.
    jerks = cubic.c[0] * 6.0
    np.testing.assert_allclose(at_knots[:-1], printed - h * jerks / 2.0,
                               atol=1e-9 * np.abs(at_knots).max())  # fmt: skip


def test_limits_on_the_printed_accelerations_let_the_knots_exceed_them() -> None:
    """With the paper's own intervals they are about three times what the formula says."""
    board = reference.compare_splines(with_toppra=False)
    spline = uniform_spline(board.swing.spline.angles, TABLE_1, reference.PAPER_INTERVALS)
    cubic = by_scipy(spline)
    printed = np.abs(np.diff(cubic(cubic.x, 1), axis=0) / np.diff(cubic.x)[:, None]).max(axis=0)
    true = np.abs(cubic(cubic.x, 2)).max(axis=0)
    assert (true > 2.5 * printed).all(), true / printed
