"""The body's sway: its ZMP is where the solution says, and no path does better."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from gaitopt import InputError
from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.optimize.sway import SwaySolution, build_sway_problem, solve_sway

SQUARE = np.array([[1.0, 0.0, -0.1], [-1.0, 0.0, -0.1], [0.0, 1.0, -0.1], [0.0, -1.0, -0.1]])
"""Sides of a square of 0.2 m about the origin."""


def zmp(solution: SwaySolution, height: float, count: int = 200) -> tuple[FloatArray, FloatArray]:
    """Piece and ZMP at dense samples, by the polynomials' own derivatives."""
    pieces, points = [], []
    for k, length in enumerate(np.diff(solution.times)):
        t = np.linspace(0.0, length, count)[:, None]
        c3, c2, c1, c0 = solution.coefficients[:, k]
        place, bend = ((c3 * t + c2) * t + c1) * t + c0, 6 * c3 * t + 2 * c2
        pieces.append(np.full(count, k))
        points.append(place - height / GRAVITY * bend)
    return np.concatenate(pieces), np.concatenate(points)


def worst_margin(solution: SwaySolution, sides: list[FloatArray], height: float) -> float:
    owner, points = zmp(solution, height)
    return min(
        float((points[owner == k] @ s[:, :2].T - s[:, 2]).min())
        for k, s in enumerate(sides) if len(s)
    )  # fmt: skip


def stepping(height: float = 0.4, period: float = 2.0) -> SwaySolution:
    """Load on the left, then on the right, twice, with four feet before, between and after."""
    times = np.linspace(0.0, 5 * period / 2, 41)
    middles = (times[1:] + times[:-1]) / 2
    left = np.array([[0.0, 1.0, 0.05], [0.0, -1.0, -0.1]])
    right = left * [1, -1, 1]
    sides = []
    for t in middles:
        phase = t / period
        chosen = {0: None, 1: left, 2: None, 3: right, 4: None}[int(phase * 2)]
        sides.append(np.zeros((0, 3)) if chosen is None else chosen)
    solution = solve_sway(
        build_sway_problem(times, sides, np.zeros((41, 2)), height, period, 0.3, 0.02)
    )
    assert worst_margin(solution, sides, height) >= solution.margin - 1e-9
    return solution


def test_the_margin_told_is_a_lower_bound_of_the_sampled_one_and_the_target_is_reached() -> None:
    solution = stepping()
    # The strip is 5 cm wide: 2.5 cm is its middle.
    assert solution.largest_margin == pytest.approx(0.025, abs=1e-6)
    assert solution.margin == pytest.approx(0.02, abs=1e-5)
    assert solution.residual < 1e-6


def test_it_is_at_rest_at_both_ends_and_twice_differentiable() -> None:
    solution = stepping()
    lengths = np.diff(solution.times)[:, None]
    c3, c2, c1, c0 = solution.coefficients
    ends = (((c3 * lengths + c2) * lengths + c1) * lengths + c0,
            (3 * c3 * lengths + 2 * c2) * lengths + c1, 6 * c3 * lengths + 2 * c2)  # fmt: skip
    for end, start in zip(ends, (c0, c1, 2 * c2), strict=True):
        np.testing.assert_allclose(end[:-1], start[1:], atol=1e-8)
        np.testing.assert_allclose(start[0], 0.0, atol=1e-8)
        np.testing.assert_allclose(end[-1], 0.0, atol=1e-8)


def test_a_wide_square_needs_no_sway() -> None:
    times = np.linspace(0, 3, 13)
    problem = build_sway_problem(times, [SQUARE] * 12, np.zeros((13, 2)), 0.4, 1.0, 0.2, 0.02)
    solution = solve_sway(problem)
    np.testing.assert_allclose(solution.coefficients, 0.0, atol=1e-7)
    assert solution.margin == pytest.approx(0.1, abs=1e-6)


def test_a_line_of_support_is_followed_by_the_zmp_not_by_the_body() -> None:
    """Two feet: the ZMP moves along y = 0.02 while the body swings less, as a pendulum's does."""
    times = np.linspace(0, 4, 65)
    line = np.array([[0.0, 1.0, 0.02], [0.0, -1.0, -0.02]])
    sides = [line if 1.5 < (a + b) / 2 < 2.5 else np.zeros((0, 3))
             for a, b in pairwise(times)]  # fmt: skip
    solution = solve_sway(build_sway_problem(times, sides, np.zeros((65, 2)), 0.4, 1.0, 0.2, 0.02))
    owner, points = zmp(solution, 0.4)
    inside = np.isin(owner, np.flatnonzero([len(s) for s in sides]))
    assert np.abs(points[inside, 1] - 0.02).max() < 2e-5
    assert solution.largest_margin == pytest.approx(0.0, abs=1e-9)


def test_mirrored_supports_give_the_mirrored_sway() -> None:
    times = np.linspace(0, 4, 33)
    one = np.array([[0.0, 1.0, 0.03]])
    sides = [one if 1.5 < t < 2.5 else np.zeros((0, 3)) for t in (times[1:] + times[:-1]) / 2]
    mirrored = [s * [1, -1, 1] for s in sides]
    found = [
        solve_sway(build_sway_problem(times, s, np.zeros((33, 2)), 0.4, 1.0, 0.2, 0.02))
        for s in (sides, mirrored)
    ]
    np.testing.assert_allclose(
        found[0].coefficients[..., 1], -found[1].coefficients[..., 1], atol=1e-6
    )


def test_flight_asks_for_nothing() -> None:
    times = np.linspace(0, 1, 5)
    problem = build_sway_problem(
        times, [np.zeros((0, 3))] * 4, np.zeros((5, 2)), 0.4, 1.0, 0.2, 0.02
    )
    assert solve_sway(problem).margin == np.inf


def test_shapes_that_do_not_fit_are_refused() -> None:
    with pytest.raises(InputError, match="K polygons"):
        build_sway_problem(np.linspace(0, 1, 5), [SQUARE], np.zeros((5, 2)), 0.4, 1, 0.2, 0.02)
    with pytest.raises(InputError, match="times must increase"):
        build_sway_problem(np.zeros(2), [SQUARE], np.zeros((2, 2)), 0.4, 1.0, 0.2, 0.02)
