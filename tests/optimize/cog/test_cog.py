"""The COG problem, held against an exact solution that shares nothing with it."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import LinearConstraint, NonlinearConstraint, linprog, minimize

import gaitopt
from gaitopt import LEGS, InputError, Quadruped, SolverError, build_cog_problem, solve_cog
from gaitopt.optimize.cog import solver
from gaitopt.optimize.cog.solver import CogProblem, CogSolution, require_solved
from gaitopt.optimize.quadratic import QuadraticSolver

Array = NDArray[np.float64]
REACH = 0.57


def nearest_exactly(
    start: Array, normals: Array, offsets: Array, centres: Array, radii: Array
) -> Array | None:
    """Nearest point to ``start`` with ``normals p >= offsets`` and ``|p - centre| <= radius``.

    In the plane the optimum is the start, or on one constraint's boundary nearest to the start, or
    a corner of two boundaries: try all of them.
    """
    found = [start]
    found += [start + (b - n @ start) * n for n, b in zip(normals, offsets, strict=True)]
    for c, r in zip(centres, radii, strict=True):
        away = start - c
        if np.hypot(*away) > 0:
            found.append(c + away / np.hypot(*away) * r)
    for i, j in itertools.combinations(range(len(offsets)), 2):
        if abs(np.linalg.det(normals[[i, j]])) > 1e-12:
            found.append(np.linalg.solve(normals[[i, j]], offsets[[i, j]]))
    for n, b in zip(normals, offsets, strict=True):
        for c, r in zip(centres, radii, strict=True):
            height = b - n @ c
            if abs(height) <= r:
                half = np.sqrt(r**2 - height**2) * np.array([-n[1], n[0]])
                found += [c + height * n + half, c + height * n - half]
    for i, j in itertools.combinations(range(len(radii)), 2):
        between = centres[j] - centres[i]
        length = np.hypot(*between)
        if length < 1e-12:
            continue
        along = (length**2 + radii[i] ** 2 - radii[j] ** 2) / (2 * length)
        if abs(along) <= radii[i]:
            unit = between / length
            half = np.sqrt(radii[i] ** 2 - along**2) * np.array([-unit[1], unit[0]])
            found += [centres[i] + along * unit + half, centres[i] + along * unit - half]
    points = np.array(found)
    inside = (points @ normals.T >= offsets - 1e-9).all(axis=1)
    gaps = np.hypot(*(points[:, None] - centres).transpose(2, 0, 1)) - radii
    inside &= (gaps <= 1e-9).all(axis=1)
    if not inside.any():
        return None
    distances = np.where(inside, np.hypot(*(points - start).T), np.inf)
    return np.asarray(points[distances.argmin()])


def random_step(rng: np.random.Generator, robot: Quadruped, spread: float) -> dict[str, Any]:
    feet = {
        leg: np.append(robot.legs[leg].hip[:2] + rng.uniform(-spread, spread, 2), 0.0)
        for leg in LEGS
    }
    swing = LEGS[rng.integers(4)]
    return {
        "feet": feet,
        "height": rng.uniform(0.3, 0.5),
        "start": rng.uniform(-0.12, 0.12, 2),
        "swing": swing,
        "foothold": feet[swing] + np.append(rng.uniform(-0.15, 0.15, 2), 0.0),
        "stability_margin": float(rng.choice([0.0, 0.01, 0.02, 0.05])),
        "reach_fraction": float(rng.choice([1.0, 0.95])),
    }


def geometry(robot: Quadruped, step: dict[str, Any]) -> tuple[Array, Array, Array, Array]:
    """Half-planes and discs of a step, from the paper's text rather than from our code."""
    feet, swing = step["feet"], step["swing"]
    corners = np.array([feet[leg][:2] for leg in LEGS if leg != swing])
    middle = corners.mean(axis=0)
    normals, offsets = [], []
    for i in range(3):
        a, b = corners[i], corners[(i + 1) % 3]
        n = np.array([a[1] - b[1], b[0] - a[0]])
        n = n / np.hypot(*n)
        n = n if n @ (middle - a) > 0 else -n
        normals.append(n)
        offsets.append(n @ a + step["stability_margin"])
    legs = (*LEGS, swing)
    places = [*(feet[leg] for leg in LEGS), step["foothold"]]
    centres = [p[:2] - robot.legs[leg].hip[:2] for leg, p in zip(legs, places, strict=True)]
    radius = np.sqrt((step["reach_fraction"] * REACH) ** 2 - step["height"] ** 2)
    return np.array(normals), np.array(offsets), np.array(centres), np.full(5, radius)


@pytest.mark.parametrize("spread", [0.03, 0.1, 0.18])
def test_the_optimum_is_the_exact_one_on_random_steps(wang: Quadruped, spread: float) -> None:
    rng = np.random.default_rng(int(1000 * spread))
    solved = refused = on_a_disc = 0
    for _ in range(400):
        step = random_step(rng, wang, spread)
        exact = nearest_exactly(step["start"], *geometry(wang, step))
        solution = solve_cog(build_cog_problem(wang, **step))
        if exact is None:
            refused += 1
            assert not solution.solved
            continue
        solved += 1
        on_a_disc += any(name.startswith("reach") for name in solution.active)
        assert solution.solved, step
        assert np.hypot(*(solution.position - exact)) <= 1e-6
        assert np.hypot(*(solution.position - exact)) <= solution.error_bound + 1e-9
        assert solution.primal <= 1e-9
        normals, offsets, centres, radii = geometry(wang, step)
        assert (normals @ solution.position - offsets).min() >= -1e-9
        assert (radii - np.hypot(*(solution.position - centres).T)).min() >= -1e-9
    assert solved > 100
    if spread > 0.1:
        assert refused > 10 and on_a_disc > 10


def test_further_half_planes_are_kept_without_a_margin(wang: Quadruped) -> None:
    """The exact optimum with one to ten more half-planes, through random places."""
    rng = np.random.default_rng(3)
    active = solved = 0
    for _ in range(150):
        step = random_step(rng, wang, 0.08)
        angles = rng.uniform(-np.pi, np.pi, rng.integers(1, 11))
        more = np.column_stack([np.cos(angles), np.sin(angles)])
        offsets = rng.uniform(-0.08, 0.02, len(angles))
        problem = build_cog_problem(wang, **step, further=np.column_stack([more, offsets]))
        solution = solve_cog(problem)
        sides, margins, centres, radii = geometry(wang, step)
        exact = nearest_exactly(
            step["start"], np.vstack([sides, more]), np.append(margins, offsets), centres, radii
        )
        assert solution.solved == (exact is not None)
        if exact is not None:
            solved += 1
            active += any(name.startswith("forces") for name in solution.active)
            assert np.hypot(*(solution.position - exact)) <= 1e-6
            assert problem.names[3] == "forces side 1"
            assert problem.constraint_values(exact)[3] == pytest.approx(
                more[0] @ exact - offsets[0], abs=1e-12
            )
    assert solved > 50 and active > 30


def test_a_start_inside_the_area_stays(wang: Quadruped) -> None:
    feet = {leg: np.append(wang.legs[leg].hip[:2], 0.0) for leg in LEGS}
    start = np.array([0.06, 0.0])
    solution = solve_cog(build_cog_problem(wang, feet, 0.4, start, swing="RH", foothold=feet["RH"]))
    assert solution.solved
    assert np.abs(solution.position - start).max() <= 1e-9
    assert solution.active == ()


def test_by_hand_the_nearest_point_of_a_side(wang: Quadruped) -> None:
    # Feet on a rectangle; without RH the triangle's long side is the diagonal from LH to RF, and
    # the middle lies on it. The nearest point with margin S0 is S0 along the diagonal's normal.
    feet = {"LF": [0.2, 0.15, 0], "LH": [-0.2, 0.15, 0], "RH": [-0.2, -0.15, 0],
            "RF": [0.2, -0.15, 0]}  # fmt: skip
    solution = solve_cog(
        build_cog_problem(
            wang,
            feet,
            0.4,
            (0.0, 0.0),
            swing="RH",
            foothold=[-0.1, -0.15, 0],
            stability_margin=0.03,
        )
    )
    assert solution.position == pytest.approx([0.03 * 0.6, 0.03 * 0.8], abs=1e-12)
    assert solution.distance == pytest.approx(0.03, abs=1e-12)
    assert solution.active == ("margin LH-RF",)
    # The cost is d^2 / 2, so the multiplier of the margin is d itself.
    assert solution.multipliers["margin LH-RF"] == pytest.approx(0.03, abs=1e-9)


def test_multipliers_are_the_derivatives_of_the_cost(wang: Quadruped) -> None:
    rng = np.random.default_rng(5)
    checked = 0
    while checked < 20:
        step = random_step(rng, wang, 0.1)
        base = solve_cog(build_cog_problem(wang, **step))
        sides = [n for n in base.active if n.startswith("margin")]
        if not base.solved or not sides or base.distance < 1e-3:
            continue
        delta = 1e-6
        moved = []
        for sign in (1, -1):
            margin = step["stability_margin"] + sign * delta
            moved.append(solve_cog(build_cog_problem(wang, **{**step, "stability_margin": margin})))
        slope = (moved[0].distance ** 2 - moved[1].distance ** 2) / 2 / (2 * delta)
        if moved[0].active == moved[1].active:
            assert slope == pytest.approx(sum(base.multipliers[n] for n in sides), rel=1e-3)
            checked += 1


def test_the_margin_objective_is_the_largest_margin(wang: Quadruped) -> None:
    """Where no disc is in the way the SSM point is the incentre, a linear program's optimum."""
    rng = np.random.default_rng(8)
    bounded = free = 0
    for _ in range(150):
        step = {**random_step(rng, wang, 0.15), "height": rng.uniform(0.42, 0.52)}
        normals, offsets, centres, radii = geometry(wang, {**step, "stability_margin": 0.0})
        program = linprog(
            [0, 0, -1], A_ub=np.column_stack([-normals, np.ones(3)]), b_ub=-offsets,
            bounds=[(None, None)] * 3, method="highs",
        )  # fmt: skip
        incentre, radius = program.x[:2], program.x[2]
        solution = solve_cog(build_cog_problem(wang, **step, objective="margin"))
        if (np.hypot(*(incentre - centres).T) <= radii - 1e-6).all():
            free += 1
            assert solution.solved
            assert solution.value == pytest.approx(radius, abs=1e-8)
            assert solution.position == pytest.approx(incentre, abs=1e-6)
        elif solution.solved:
            bounded += 1
            assert solution.value <= radius + 1e-9
            best = _largest_margin(normals, offsets, centres, radii, solution.position)
            assert solution.value == pytest.approx(best, abs=1e-6)
    assert free > 30 and bounded > 10


def _largest_margin(
    normals: Array, offsets: Array, centres: Array, radii: Array, guess: Array
) -> float:
    """The same by SciPy's SLSQP, from a start that is off the answer."""
    found = minimize(
        lambda w: -w[2], [*(guess + 0.003), 0.0], jac=lambda w: np.array([0.0, 0.0, -1.0]),
        method="SLSQP", options={"ftol": 1e-14, "maxiter": 500},
        constraints=[
            LinearConstraint(np.column_stack([normals, -np.ones(3)]), offsets, np.inf),
            NonlinearConstraint(
                lambda w: radii**2 - ((w[:2] - centres) ** 2).sum(axis=1), 0.0, np.inf,
                jac=lambda w: np.column_stack([-2 * (w[:2] - centres), np.zeros(5)]),
            ),
        ],
    )  # fmt: skip
    return float(found.x[2])


def test_the_reach_objective_is_where_the_step_becomes_possible(wang: Quadruped) -> None:
    rng = np.random.default_rng(11)
    for _ in range(30):
        step = {**random_step(rng, wang, 0.15), "stability_margin": 0.0}
        least = solve_cog(build_cog_problem(wang, **step, objective="reach"))
        assert least.solved
        for fraction, possible in ((least.value + 1e-5, True), (least.value - 1e-5, False)):
            step["reach_fraction"] = fraction
            exact = nearest_exactly(step["start"], *geometry(wang, step))
            assert (exact is not None) == possible


def test_ovals_of_a_leg_with_a_dropped_pitch_axis_are_kept() -> None:
    """hyq's pitch axes lie 8 cm below its roll axes, so that its reach areas are no discs."""
    hyq = gaitopt.load_robot("hyq")
    rng = np.random.default_rng(2)
    touched = 0
    for _ in range(60):
        feet = {
            leg: np.append(hyq.legs[leg].hip[:2] + rng.uniform(-0.2, 0.2, 2), 0.0) for leg in LEGS
        }
        height = 0.6
        foothold = feet["LF"] + np.append(rng.uniform(-0.15, 0.15, 2), 0)
        problem = build_cog_problem(hyq, feet, height, rng.uniform(-0.3, 0.3, 2), swing="LF",
                                    foothold=foothold)  # fmt: skip
        solution = solve_cog(problem)
        if not solution.solved:
            continue
        body = np.append(solution.position, height)
        slacks = []
        for leg, foot in [*feet.items(), ("LF", foothold)]:
            slack = hyq.legs[leg].reach ** 2 - hyq.legs[leg].straightness(*(foot - body))
            slacks.append(slack)
        assert min(slacks) >= -1e-9
        if any(name.startswith("reach") for name in solution.active):
            touched += 1
            assert min(slacks) <= 1e-8
    assert touched > 5


@settings(max_examples=60, deadline=None)
@given(
    angle=st.floats(-np.pi, np.pi), x=st.floats(-5, 5), y=st.floats(-5, 5),
    seed=st.integers(0, 10_000),
)  # fmt: skip
def test_moving_everything_moves_the_answer(x: float, y: float, angle: float, seed: int) -> None:
    robot = gaitopt.load_robot("wang2020")
    step = random_step(np.random.default_rng(seed), robot, 0.08)
    before = solve_cog(build_cog_problem(robot, **step))
    shift = np.array([x, y, 0.0])
    step["feet"] = {leg: p + shift for leg, p in step["feet"].items()}
    step["foothold"] = step["foothold"] + shift
    step["start"] = step["start"] + shift[:2]
    after = solve_cog(build_cog_problem(robot, **step))
    assert after.status == before.status
    if before.solved:
        assert after.position - shift[:2] == pytest.approx(before.position, abs=1e-6)


def test_a_problem_can_be_looked_at_without_solving_it(wang: Quadruped) -> None:
    step = random_step(np.random.default_rng(1), wang, 0.05)
    problem = build_cog_problem(wang, **step)
    assert len(problem.names) == problem.formulation.constraints == 8
    values = problem.constraint_values(step["start"])
    normals, offsets, centres, radii = geometry(wang, step)
    by_hand = [
        *(normals @ step["start"] - offsets),
        *((radii**2 - ((step["start"] - centres) ** 2).sum(axis=1)) / (2 * REACH)),
    ]
    assert sorted(values) == pytest.approx(sorted(by_hand), abs=1e-12)


def test_an_infeasible_step_ends_at_the_first_empty_linearisation(wang: Quadruped) -> None:
    # Without this, ProxQP works on an infeasible problem for tens of seconds.
    step = {**random_step(np.random.default_rng(4), wang, 0.02), "stability_margin": 0.3}
    solution = solve_cog(build_cog_problem(wang, **step))
    assert (solution.solved, solution.iterations) == (False, 1)


def test_nan_is_refused_before_it_reaches_the_solver(wang: Quadruped) -> None:
    step = random_step(np.random.default_rng(4), wang, 0.02)
    step["start"] = np.array([np.nan, 0.0])
    with pytest.raises(InputError, match="start must be finite numbers"):
        gaitopt.build_cog_problem(wang, **step)
    with pytest.raises(SolverError, match="NaN or infinite"):
        solve_cog(solver.build_cog_problem(wang, **step))


def test_feet_in_one_line_are_named(wang: Quadruped) -> None:
    feet = {"LF": [0.2, 0, 0], "LH": [-0.2, 0, 0], "RH": [0, -0.1, 0], "RF": [0.1, 0, 0]}
    with pytest.raises(InputError, match=r"step 0 \(RH\): the three feet .* in one line"):
        build_cog_problem(wang, feet, 0.4, (0, 0), swing="RH", foothold=[0, -0.1, 0])


def test_swing_and_foothold_go_together(wang: Quadruped) -> None:
    feet = {leg: np.append(wang.legs[leg].hip[:2], 0.0) for leg in LEGS}
    with pytest.raises(InputError, match="go together"):
        build_cog_problem(wang, feet, 0.4, (0, 0), swing="RH")


def test_an_unverified_solution_is_never_passed_on(wang: Quadruped) -> None:
    step = random_step(np.random.default_rng(4), wang, 0.02)
    step["stability_margin"] = 0.3
    solution = solve_cog(build_cog_problem(wang, **step))
    with pytest.raises(SolverError, match="step 7: not solved"):
        require_solved(solution, "step 7")


def test_a_wrong_result_of_the_qp_solver_is_noticed(
    wang: Quadruped, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Planted fault: the QP solver returns a point that is 1 mm off.

    It is asked where the program in the plane was not solved exactly.
    """
    monkeypatch.setattr(solver, "solve_nearest", lambda call, problem: None)
    step = random_step(np.random.default_rng(4), wang, 0.03)
    right = QuadraticSolver.solve

    def wrong(self: QuadraticSolver, *problem: Array) -> tuple[Array, Array]:
        x, multipliers = right(self, *problem)
        return x + 1e-3, multipliers

    problem: CogProblem = build_cog_problem(wang, **step)
    assert solve_cog(problem).solved
    monkeypatch.setattr(QuadraticSolver, "solve", wrong)
    solution: CogSolution = solve_cog(problem)
    assert not solution.solved


def test_a_hard_quadratic_problem_is_solved_by_the_slow_settings() -> None:
    """Two almost opposite constraints, on which ProxQP's quick settings stop short."""
    jacobian = np.array([[-0.60103857, 0.79922001], [0.15371442, -0.11184047]])
    low = np.array([0.0, 5.92199540e-05])
    hessian, gradient = 3.5918 * np.eye(2), np.array([0.07634271, 0.05077555])
    corner = np.linalg.solve(jacobian, low)
    x, multipliers = QuadraticSolver(2, 2).solve(hessian, gradient, jacobian, low)
    assert x == pytest.approx(corner, abs=1e-9)
    assert hessian @ x + gradient == pytest.approx(multipliers @ jacobian, abs=1e-9)
