"""Where a body goes and how fast, as one problem: its derivatives, known solutions."""

from __future__ import annotations

import numpy as np
import pytest
from derivatives import check_derivatives

from gaitopt.dynamics.speed_sweeps import SweptIntervals, swept
from gaitopt.interior_point.solver import minimise
from gaitopt.motion.quadratic_spline import parabola_weights
from gaitopt.optimize.body_path import DiscRows
from gaitopt.optimize.paced_path import PacedPathProblem, PacedRows

KNOTS = 12
SPANS = np.random.default_rng(0).uniform(0.02, 0.04, KNOTS)
NO_DISCS = DiscRows(np.zeros(0, dtype=int), np.zeros((0, 2)), np.zeros(0))


def problem_of(
    rows: PacedRows, tops: float = 100.0, discs: DiscRows = NO_DISCS
) -> PacedPathProblem:
    points = np.cumsum(np.random.default_rng(1).uniform(0.0, 0.02, (KNOTS, 2)), axis=0)
    return PacedPathProblem(points, SPANS, rows, discs, np.full(KNOTS, tops), 0.02)


def random_rows(count: int, seed: int) -> PacedRows:
    rng = np.random.default_rng(seed)
    return PacedRows(
        np.sort(rng.integers(0, KNOTS, count)), rng.integers(0, 2, count),
        *rng.normal(size=(3, count)), *rng.normal(size=(3, count, 6)),
    )  # fmt: skip


def limited(largest: float) -> PacedRows:
    """The given path, whose shape does not matter: ``|u| + x / 10 <= largest``."""
    span = np.repeat(np.arange(KNOTS), 4)
    end, sign = np.tile([0, 0, 1, 1], KNOTS), np.tile([1.0, -1.0], 2 * KNOTS)
    none = np.zeros((len(span), 6))
    return PacedRows(span, end, 1e-2 * sign, np.full(len(span), -1e-3),
                     np.full(len(span), 1e-2 * largest), none, none, none)  # fmt: skip


def solved(problem: PacedPathProblem, squares: float = 1.0) -> np.ndarray:
    """Unknowns of the fastest motion."""
    start = problem.start(np.full(KNOTS, squares))
    solution = minimise(problem, start, tolerance=1e-6)
    assert solution.solved
    assert problem.values(solution.x).min() > -1e-6
    return solution.x


def test_derivatives_are_those_of_differences() -> None:
    rng = np.random.default_rng(2)
    discs = DiscRows(
        np.sort(rng.integers(0, KNOTS, 7)), rng.normal(size=(7, 2)), rng.uniform(1.0, 2.0, 7)
    )
    problem = problem_of(random_rows(40, 3), discs=discs)
    x = problem.start(np.full(KNOTS, 2.0))
    x += 0.1 * rng.normal(size=len(x))
    assert np.array_equal(problem.linearise(x).values, problem.values(x))
    check_derivatives(problem, x, rng, products=1e-4, matrix=1e-6)


def test_along_a_given_path_it_is_the_fastest_timing() -> None:
    """Against the two sweeps of the timing, which know nothing of an interior point."""
    problem = problem_of(limited(20.0), tops=9.0)
    found = problem.duration(solved(problem))
    sides = np.tile([[1.0 / 20.0, 0.1 / 20.0], [-1.0 / 20.0, 0.1 / 20.0]], (KNOTS, 1, 1))
    steps = 2.0 * SPANS
    steps[[0, -1]] = 0.0
    tops = np.full(KNOTS, 9.0)
    begin, end = swept(
        SweptIntervals(sides, sides, steps, tops, tops, np.array([0, KNOTS])), 1.0 - 1e-12
    )
    wanted = (2.0 * SPANS / (np.sqrt(begin) + np.sqrt(end))).sum()
    assert found == pytest.approx(wanted, rel=1e-3)
    assert found >= wanted * (1.0 - 1e-9)


def test_nothing_but_joints_bounds_a_free_motion() -> None:
    none = PacedRows(np.zeros(1, dtype=int), np.zeros(1, dtype=int), np.zeros(1), np.zeros(1),
                     np.ones(1), *np.zeros((3, 1, 6)))  # fmt: skip
    problem = problem_of(none, tops=4.0)
    x = solved(problem)
    assert problem.duration(x) == pytest.approx(SPANS.sum() / 2.0, rel=1e-3)
    # Where nothing holds it the path stays where it was given.
    assert problem.moved(x) == pytest.approx(problem.points, abs=1e-6)


def test_a_bend_is_straightened_where_that_is_faster() -> None:
    """The acceleration across the way is bounded by friction, so the fastest way has no bend."""
    second = 2.0 * parabola_weights(SPANS)[0]
    points = np.stack([np.arange(KNOTS), 0.01 * (np.arange(KNOTS) % 2)], axis=1)
    span = np.repeat(np.arange(KNOTS), 2)
    sign = np.tile([1.0, -1.0], KNOTS)
    by_second = np.zeros((2 * KNOTS, 6))
    by_second[:, 1::2] = sign[:, None] * second[span]
    padded = np.pad(points[:, 1], 1)
    across = np.stack([padded[:-2], padded[1:-1], padded[2:]], axis=1)[span]
    by_x = (by_second[:, 1::2] * across).sum(axis=1)
    none = np.zeros((2 * KNOTS, 6))
    rows = PacedRows(span, np.zeros(2 * KNOTS, dtype=int), np.zeros(2 * KNOTS), by_x,
                     np.full(2 * KNOTS, 5.0), none, none, by_second)  # fmt: skip
    problem = PacedPathProblem(points, SPANS, rows, NO_DISCS, np.full(KNOTS, 9.0), 0.02)
    start = 0.9 * (5.0 / np.abs(by_x).max())
    x = solved(problem, start)
    # As fast as the bound of joints, and as good as straight: 9 is less than 5 over the bend left.
    assert problem.duration(x) == pytest.approx(SPANS.sum() / 3.0, rel=1e-3)
    assert problem.duration(problem.start(np.full(KNOTS, start))) > 2.0 * problem.duration(x)
    left = second[:, 0] * np.pad(problem.moved(x)[:, 1], 1)[:-2] + (
        second[:, 1] * problem.moved(x)[:, 1] + second[:, 2] * np.pad(problem.moved(x)[:, 1], 1)[2:]
    )
    assert 9.0 * np.abs(left).max() <= 5.0 + 1e-6
