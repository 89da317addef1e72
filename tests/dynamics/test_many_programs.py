"""Many small programs at once give what they give one by one."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitopt.dynamics import many_programs, small_programs
from gaitopt.dynamics.many_programs import (
    last_points,
    solve_linear_programs,
    solve_quadratic_programs,
)
from gaitopt.dynamics.small_programs import NO_BOUND, solve_linear

Array = NDArray[np.float64]
COUNT, ROWS, SIZE = 30, 20, 4


def programs(seed: int) -> tuple[Array, Array, Array]:
    """Rows around 0, so that each program has a solution; half of them from one side only."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(COUNT, ROWS, SIZE))
    low, high = -rng.uniform(0.1, 1.0, (COUNT, ROWS)), rng.uniform(0.1, 1.0, (COUNT, ROWS))
    high[:, : ROWS // 2] = NO_BOUND
    return rows, low, high


@pytest.mark.parametrize("seed", range(3))
def test_linear_programs_are_those_of_highs(seed: int) -> None:
    rows, low, high = programs(seed)
    costs = np.eye(SIZE)[0]
    found = solve_linear_programs(costs, rows, low, high)
    assert found.proven.all()
    for i in range(COUNT):
        one = solve_linear(costs, rows[i], low[i], high[i], by_highs=True)
        assert one is not None
        assert costs @ found.points[i] == pytest.approx(costs @ one.point, abs=1e-7)
        assert found.multipliers[i] == pytest.approx(one.multipliers, abs=1e-6)


def test_last_points_are_minimisers_where_there_are_any() -> None:
    rows, low, high = programs(3)
    rows, low = np.concatenate([rows, -rows], axis=1), np.concatenate([low, -high], axis=1)
    costs = np.eye(SIZE)[0]
    # Two rows contradict each other.
    rows[7, 1], low[7, :2], rows[7, 0] = -rows[7, 0], 1.0, rows[7, 0]
    found = last_points(costs, rows, low)
    for i in (k for k in range(COUNT) if k != 7):
        one = solve_linear(costs, rows[i], low[i], np.full(2 * ROWS, NO_BOUND), by_highs=True)
        assert one is not None and costs @ found[i] == pytest.approx(costs @ one.point, abs=1e-6)


@pytest.mark.parametrize("place", [0, 7, COUNT - 1])
def test_a_program_without_solution_is_told_and_spoils_no_other(place: int) -> None:
    rows, low, high = programs(0)
    costs = np.eye(SIZE)[0]
    alone = solve_linear_programs(costs, rows, low, high)
    rows[place, 1], low[place, :2], high[place, :2] = rows[place, 0], [0.5, -2.0], [1.0, -1.0]
    found = solve_linear_programs(costs, rows, low, high)
    others = np.arange(COUNT) != place
    assert not found.proven[place]
    assert found.proven[others].all()
    assert found.points[others] == pytest.approx(alone.points[others], abs=1e-7)
    rest, kept = solve_quadratic_programs(
        np.repeat(np.eye(SIZE)[None], COUNT, axis=0), np.zeros((COUNT, SIZE)), rows, low, high
    )
    assert kept.tolist() == others.tolist() and np.abs(rest[others]).max() < 1e-9


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_answers_that_are_no_numbers_are_no_solutions(
    monkeypatch: pytest.MonkeyPatch, bad: float
) -> None:
    """The solver's last point can be anything where rows contradict each other."""
    rows, low, high = programs(2)
    rows[:, 0, 0] = 0.0
    answer = np.full(SIZE, bad), np.full(ROWS, bad)
    monkeypatch.setattr(many_programs, "_answers", lambda *_: [answer] * COUNT)
    monkeypatch.setattr(small_programs, "_daqp", lambda *_: answer)
    found = solve_linear_programs(np.eye(SIZE)[0], rows, low, high)
    assert not found.proven.any()
    hessians = np.repeat(np.eye(SIZE)[None], COUNT, axis=0)
    assert not solve_quadratic_programs(hessians, np.zeros((COUNT, SIZE)), rows, low, high)[1].any()
    assert solve_linear(np.eye(SIZE)[0], rows[0], low[0], high[0]) is None


def test_contradicting_limits_of_one_row_are_no_solution() -> None:
    rows, low, high = programs(1)
    low[0, 0], high[0, 0] = 0.5, -0.5
    found = solve_linear_programs(np.eye(SIZE)[0], rows, low, high)
    assert not found.proven[0] and found.proven[1:].all()


def test_quadratic_programs_keep_the_conditions_of_optimality() -> None:
    """The gradient at the minimiser has no part along directions in which no row holds it back."""
    rng = np.random.default_rng(5)
    rows, low, high = programs(5)
    roots = rng.normal(size=(COUNT, SIZE, SIZE))
    hessians = roots @ np.swapaxes(roots, 1, 2) + np.eye(SIZE)
    gradients = 3.0 * rng.normal(size=(COUNT, SIZE))
    points, kept = solve_quadratic_programs(hessians, gradients, rows, low, high)
    assert kept.all()
    for i in range(COUNT):
        values = rows[i] @ points[i]
        held = np.flatnonzero((values < low[i] + 1e-8) | (values > high[i] - 1e-8))
        slope = hessians[i] @ points[i] + gradients[i]
        pushes, *_ = np.linalg.lstsq(rows[i, held].T, -slope, rcond=None)
        assert rows[i, held].T @ pushes == pytest.approx(-slope, abs=1e-6)
        upper = values[held] > high[i, held] - 1e-8
        assert (pushes[upper] >= -1e-9).all() and (pushes[~upper] <= 1e-9).all()
