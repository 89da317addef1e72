"""Exact quadratic programs in the plane, and the COG problem by them beside ProxQP."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

import gaitopt
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.optimize.cog import solver
from gaitopt.optimize.cog.plane_program import solve_in_plane
from gaitopt.optimize.cog.solver import CogSolution, build_cog_problem, solve_cog


def best_of_all_candidates(
    hessian: FloatArray, gradient: FloatArray, rows: FloatArray, slacks: FloatArray
) -> FloatArray | None:
    """The best feasible one of all points with no, one or two active constraints."""
    best, least = None, np.inf
    for count in (0, 1, 2):
        for chosen in combinations(range(len(rows)), count):
            a = rows[list(chosen)]
            system = np.block([[hessian, -a.T], [a, np.zeros((count, count))]])
            wanted = np.concatenate([-gradient, -slacks[list(chosen)]])
            try:
                x = np.linalg.solve(system, wanted)[:2]
            except np.linalg.LinAlgError:
                continue
            value = x @ hessian @ x / 2.0 + gradient @ x
            if (rows @ x + slacks).min() > -1e-9 and value < least:
                best, least = x, value
    return best


@pytest.mark.parametrize("seed", range(4))
def test_the_minimiser_is_the_best_of_all_candidate_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = possible = 0
    for _ in range(60):
        half = rng.normal(size=(2, 2))
        hessian, gradient = half @ half.T + 0.1 * np.eye(2), rng.normal(size=2)
        rows, slacks = rng.normal(size=(8, 2)), rng.normal(0.3, 0.5, size=8)
        wanted = best_of_all_candidates(hessian, gradient, rows, slacks)
        answer = solve_in_plane(hessian.tolist(), gradient.tolist(), rows.tolist(), slacks.tolist())
        if wanted is None:
            assert answer is None
            continue
        possible += 1
        if answer is None:  # which may be: ProxQP is asked then
            continue
        x, y, active = answer
        assert [x, y] == pytest.approx(wanted.tolist(), abs=1e-7)
        pull = hessian @ [x, y] + gradient - sum(m * rows[k] for k, m in active)
        assert np.abs(pull).max() < 1e-9 * (1.0 + sum(m for _, m in active))
        assert all(m >= 0.0 for _, m in active)
        found += 1
    assert found > 0.8 * possible > 12


def test_opposite_constraints_without_room_have_no_solution() -> None:
    unit = [[1.0, 0.0], [0.0, 1.0]]
    assert solve_in_plane(unit, [0.0, 0.0], [[1.0, 0.0], [-1.0, 0.0]], [-1.0, 0.5]) is None


def test_a_hessian_that_is_not_positive_is_refused() -> None:
    assert solve_in_plane([[1.0, 2.0], [2.0, 1.0]], [0.0, 0.0], [], []) is None


def random_step(rng: np.random.Generator, robot: gaitopt.Quadruped, spread: float) -> dict:
    """A step with random feet."""
    feet = {
        leg: np.append(robot.legs[leg].hip[:2] + rng.uniform(-spread, spread, 2), 0.0)
        for leg in LEGS
    }
    leg = LEGS[int(rng.integers(4))]
    return {
        "feet": feet, "height": 0.4, "start": rng.uniform(-0.1, 0.1, 2), "swing": leg,
        "foothold": feet[leg] + np.append(rng.uniform(-spread, spread, 2), 0.0),
    }  # fmt: skip


@pytest.mark.parametrize("name", ["wang2020", "hyq"])
def test_proxqp_finds_the_same_places(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, rng = gaitopt.load_robot(name), np.random.default_rng(5)
    problems = [build_cog_problem(robot, **random_step(rng, robot, 0.12)) for _ in range(60)]
    exact = [solve_cog(problem) for problem in problems]
    monkeypatch.setattr(solver, "solve_nearest", lambda call, problem: None)
    by_proxqp = [solve_cog(problem) for problem in problems]
    active = set()
    for one, other in zip(exact, by_proxqp, strict=True):
        assert one.status is other.status
        if not one.solved:
            continue
        assert one.position == pytest.approx(other.position, abs=1e-9)
        assert one.margin == pytest.approx(other.margin, abs=1e-9)
        assert one.active == other.active
        assert one.multipliers == pytest.approx(other.multipliers, abs=1e-8)
        active.add(len(one.active))
    assert {0, 1} <= active


def test_a_wrong_answer_of_the_plane_program_is_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """Planted fault: its point is 1 mm off. ProxQP gives the right one."""
    from gaitopt.optimize.cog import in_plane

    robot = gaitopt.load_robot("wang2020")
    problem = build_cog_problem(robot, **random_step(np.random.default_rng(4), robot, 0.1))
    right: CogSolution = solve_cog(problem)
    assert right.active

    def wrong(*arguments: list[float]) -> tuple[float, float, tuple[tuple[int, float], ...]]:
        x, y, active = solve_in_plane(*arguments)
        return x + 1e-3, y, active

    monkeypatch.setattr(in_plane, "solve_in_plane", wrong)
    assert solve_cog(problem).position == pytest.approx(right.position, abs=1e-9)
