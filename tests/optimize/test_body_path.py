"""The smoothest path of a body: its spline, its derivatives, known solutions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from derivatives import check_derivatives

from gaitopt.interior_point.solver import minimise
from gaitopt.optimize.body_path import BodyPathProblem, DiscRows, LineRows

KNOTS = 9
SPANS = np.random.default_rng(0).uniform(0.1, 0.3, KNOTS)
NO_DISCS = DiscRows(np.zeros(0, dtype=int), np.zeros((0, 2)), np.zeros(0))


def lines(span: list[int], normal: list[list[float]], offset: list[float], soft: bool) -> LineRows:
    """Rows on the middle control point of spans alone."""
    weights = np.tile([0.0, 1.0, 0.0], (len(span), 1))
    return LineRows(
        np.array(span), weights, np.array(normal, dtype=np.float64), np.array(offset),
        np.full(len(span), soft),
    )  # fmt: skip


def solved(problem: BodyPathProblem) -> tuple[np.ndarray, np.ndarray]:
    """Control points, and what soft rows are missed by."""
    start = problem.pack(np.zeros((problem.knots, 2)))
    solution = minimise(problem, start, barrier=1.0, least_barrier=1e-9)
    assert solution.solved
    return problem.points(solution.x), problem.missed(solution.x)


def test_derivatives_are_those_of_differences() -> None:
    rng = np.random.default_rng(2)
    weights = rng.uniform(0.1, 1.0, size=(20, 3))
    rows = LineRows(
        np.sort(rng.integers(0, KNOTS, 20)), weights / weights.sum(axis=1, keepdims=True),
        rng.normal(size=(20, 2)), rng.normal(size=20), rng.random(20) < 0.5,
    )  # fmt: skip
    discs = DiscRows(
        np.sort(rng.integers(0, KNOTS, 7)), rng.normal(size=(7, 2)), rng.uniform(1.0, 2.0, 7)
    )
    problem = BodyPathProblem(
        rng.normal(size=2), SPANS, rng.uniform(0.02, 0.04, KNOTS), rows, discs, 0.1
    )
    x = problem.pack(rng.normal(size=(KNOTS, 2)))
    check_derivatives(problem, x, rng, products=1e-6, matrix=1e-6)


def test_a_free_body_stays_where_it_is() -> None:
    problem = BodyPathProblem(
        np.array([1.0, -2.0]), SPANS, np.full(KNOTS, 0.03), lines([4], [[1, 0]], [0.5], False),
        NO_DISCS, 0.1,
    )  # fmt: skip
    assert solved(problem)[0] == pytest.approx(np.tile([1.0, -2.0], (KNOTS, 1)), abs=1e-4)


def test_the_body_reaches_a_line_with_least_accelerations() -> None:
    """Against the closed form: least of ``p' Q p`` with one equality."""
    problem = BodyPathProblem(
        np.zeros(2), SPANS, np.full(KNOTS, 0.03), lines([KNOTS - 1], [[0, 1]], [0.2], False),
        NO_DISCS, 0.1,
    )  # fmt: skip
    points = solved(problem)[0]
    band, size = problem.quadratic_cost, len(problem.linear_cost)
    full = np.zeros((size, size))
    for below, row in enumerate(band):
        for column in range(size - below):
            full[column + below, column] = full[column, column + below] = row[column]
    # Unknowns: what is missed at the first knot, then x, y and what is missed of each other one.
    of_y = full[2::3, 2::3]
    wanted = np.linalg.solve(of_y, np.eye(KNOTS - 1)[-1])
    wanted *= 0.2 / wanted[-1]
    assert points[1:, 1] == pytest.approx(wanted, abs=1e-5)
    assert points[:, 0] == pytest.approx(0.0, abs=1e-5)


def test_soft_rows_are_missed_only_where_they_must() -> None:
    opposed = lines([4, 4], [[1, 0], [-1, 0]], [0.1, 0.1], True)
    problem = BodyPathProblem(np.zeros(2), SPANS, np.full(KNOTS, 0.03), opposed, NO_DISCS, 0.1)
    missed = solved(problem)[1]
    assert missed[4] == pytest.approx(0.1, abs=1e-4)
    assert np.delete(missed, 4) == pytest.approx(0.0, abs=1e-4)


def test_discs_hold_control_points_back() -> None:
    wanted = lines([4], [[1, 0]], [0.3], True)
    disc = DiscRows(np.array([4]), np.zeros((1, 2)), np.array([0.2]))
    problem = BodyPathProblem(np.zeros(2), SPANS, np.full(KNOTS, 0.03), wanted, disc, 0.1)
    points, missed = solved(problem)
    assert np.linalg.norm(points[4]) <= 0.2 + 1e-6
    assert missed[4] == pytest.approx(0.3 - points[4, 0], abs=1e-4)


def test_lengths_and_places_do_not_matter() -> None:
    """A problem in other units, and elsewhere, has the same path there."""
    rows = lines([4, 7], [[1, 0], [0.6, 0.8]], [0.1, 0.2], False)
    problem = BodyPathProblem(np.zeros(2), SPANS, np.full(KNOTS, 0.03), rows, NO_DISCS, 0.1)
    shift = np.array([3.0, -1.0])
    elsewhere = replace(
        problem, start=shift, lines=rows._replace(offset=rows.offset + rows.normal @ shift)
    )
    assert solved(elsewhere)[0] - shift == pytest.approx(solved(problem)[0], abs=1e-6)
    twice = replace(problem, lines=rows._replace(offset=2.0 * rows.offset), unit=0.2)
    assert solved(twice)[0] == pytest.approx(2.0 * solved(problem)[0], abs=1e-5)
