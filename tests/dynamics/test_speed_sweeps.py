"""The sweeps in closed form against linear programs, one for each interval."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog

from gaitopt.dynamics import speed_sweeps
from gaitopt.dynamics.speed_sweeps import SweptIntervals, swept

Array = NDArray[np.float64]


def some_intervals(seed: int, even: bool = False) -> SweptIntervals:
    """Two chains of 5 and 3 intervals, with random half-planes around (0, 0)."""
    rng = np.random.default_rng(seed)
    first = np.array([0, 5, 8])
    sides = rng.normal(size=(8, 2, 6, 2))
    # From both sides at least, so that no acceleration is without bound.
    sides[:, :, 0] = rng.uniform(0.2, 1.0, (8, 2, 2)) * [1.0, 0.3]
    sides[:, :, 1] = rng.uniform(0.2, 1.0, (8, 2, 2)) * [-1.0, 0.3]
    top = rng.uniform(0.5, 2.0, (2, 8))
    top[0, [0, 5]] = top[1, [4, 7]] = 0.0
    steps = rng.uniform(0.1, 0.6, 8)
    if even:
        steps[[2, 6]] = 0.0
    return SweptIntervals(sides[:, 0], sides[:, 1], steps, top[0], top[1], first)


def best(given: SweptIntervals, i: int, costs: list[float], begin: tuple[float, float],
         end: tuple[float, float]) -> Array:  # fmt: skip
    """Minimise ``costs @ (u, x)`` on an interval, with bounds on ``x`` at both ends."""
    step = given.steps[i]
    reach = np.array([[1.0, 0.0], [step, 1.0]])
    if step == 0.0:
        reach[0, 0] = 0.0
    here = given.begin[i] @ np.array([[reach[0, 0], 0.0], [0.0, 1.0]])
    there = given.end[i] @ np.array([[reach[0, 0], 0.0], [step, 1.0]])
    rows = np.vstack([here, there, [[step, 1.0], [-step, -1.0]]])
    high = np.concatenate([np.ones(12), [end[1], -end[0]]])
    found = linprog(costs, rows, high, bounds=[(-1e6, 1e6), begin], method="highs")
    assert found.status == 0
    return np.asarray(found.x)


@pytest.mark.parametrize("even", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_sweeps_are_those_of_linear_programs(seed: int, even: bool) -> None:
    given = some_intervals(seed, even)
    begin, end = swept(given, 1.0)
    for first, last in ((0, 5), (5, 8)):
        most = np.zeros(last + 1)
        most[last] = np.inf
        for i in reversed(range(first, last)):
            high = min(most[i + 1], given.top_end[i])
            most[i] = best(given, i, [0.0, -1.0], (0.0, given.top[i]), (0.0, high))[1]
        x = most[first]
        for i in range(first, last):
            assert begin[i] == pytest.approx(x, abs=1e-8)
            high = min(most[i + 1], given.top_end[i])
            slack = 1e-10
            u = best(given, i, [-1.0, 0.0], (x - slack, x), (0.0, high + slack))[0]
            x = x + given.steps[i] * u
            assert end[i] == pytest.approx(x, abs=1e-7)


def test_chains_do_not_depend_on_each_other() -> None:
    given = some_intervals(0)
    alone = SweptIntervals(*(array[5:] for array in given[:5]), np.array([0, 3]))
    for both, one in zip(swept(given, 1.0), swept(alone, 1.0), strict=True):
        assert np.array_equal(both[5:], one)


def test_without_sides_only_the_largest_speeds_count() -> None:
    none = np.zeros((3, 0, 2))
    given = SweptIntervals(
        none, none, np.ones(3), np.array([0.0, 2.0, 1.0]), np.array([2.0, 1.0, 0.0]),
        np.array([0, 3]),
    )  # fmt: skip
    begin, end = swept(given, 1.0)
    assert begin.tolist() == [0.0, 2.0, 1.0] and end.tolist() == [2.0, 1.0, 0.0]


@pytest.mark.parametrize("seed", range(4))
def test_guesses_lead_to_the_numbers_of_place_by_place(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(seed)
    count = 300
    parts = [some_intervals(1000 * seed + i) for i in range(count)]
    joined = [np.concatenate([getattr(p, name) for p in parts]) for name in SweptIntervals._fields]
    begin, end, steps, top, top_end = joined[:5]
    top = top + rng.uniform(0.0, 0.3, len(top))
    top[0] = top_end[-1] = 0.0
    given = SweptIntervals(begin, end, steps, top, top_end + 0.2, np.array([0, 700, len(top)]))
    guessed = swept(given, 0.99)
    monkeypatch.setattr(speed_sweeps, "FEW_CHAINS", 0)
    plain = swept(given, 0.99)
    assert all(np.array_equal(a, b) for a, b in zip(guessed, plain, strict=True))
    # And where guessing is given up.
    monkeypatch.setattr(speed_sweeps, "FEW_CHAINS", 1e9)
    monkeypatch.setattr(speed_sweeps, "MOST_GUESSES", 1)
    assert all(np.array_equal(a, b) for a, b in zip(swept(given, 0.99), plain, strict=True))
