"""How fast a path may be followed: known times, limits that are kept, and TOPP-RA's package."""

from __future__ import annotations

import numpy as np
import pytest
import toppra
from numpy.typing import NDArray
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

from gaitopt import MotionPath, Quadruped
from gaitopt.motion.pieces import stretched
from gaitopt.motion.retiming import (
    interval_times,
    legs_needed_stretch,
    needed_stretch,
    time_optimal_parametrisation,
)

Array = NDArray[np.float64]
toppra.setup_logging("ERROR")


def taken(squares: NDArray[np.float64], grid: NDArray[np.float64]) -> NDArray[np.float64]:
    """Times of all intervals ``(N, L)`` [s]."""
    return interval_times(squares[:-1], squares[1:], np.diff(grid)[:, None])


def cosine_grid(count: int) -> Array:
    """Parameters from 0 to 1, dense at both ends."""
    return np.asarray((1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, count + 1))) / 2.0)


@pytest.mark.parametrize("seed", range(8))
def test_speeds_along_random_paths_are_those_of_toppra(seed: int) -> None:
    """The package leaves a little of each limit unused, so it is slower by up to 5e-6."""
    rng = np.random.default_rng(seed)
    joints = int(rng.integers(1, 7))
    knots = rng.normal(size=(int(rng.integers(2, 6)), joints))
    path = toppra.SplineInterpolator(np.linspace(0.0, 1.0, len(knots)), knots)
    grid = cosine_grid(int(rng.integers(10, 120)))
    velocity, acceleration = rng.uniform(0.5, 3.0, joints), float(rng.uniform(0.5, 10.0))
    most = np.full(joints, acceleration)
    limits = [
        JointVelocityConstraint(np.column_stack([-velocity, velocity])),
        JointAccelerationConstraint(np.column_stack([-most, most])),
    ]
    _, speeds, _ = TOPPRA(limits, path, gridpoints=grid).compute_parameterization(0.0, 0.0)
    first, second = (path(grid, order)[:, None] for order in (1, 2))
    ours = time_optimal_parametrisation(first, second, grid, velocity, acceleration)
    assert ours[:, 0] == pytest.approx(speeds**2, abs=1e-4 * (speeds**2).max())
    times = [taken(squares, grid).sum() for squares in (ours, speeds[:, None] ** 2)]
    assert times[0] == pytest.approx(times[1], rel=2e-5)


def test_many_paths_at_a_time_are_each_on_their_own() -> None:
    rng, grid = np.random.default_rng(3), cosine_grid(40)
    first, second = rng.normal(size=(2, 41, 5, 3))
    together = time_optimal_parametrisation(first, second, grid, np.ones(3), 2.0)
    for k in range(5):
        alone = time_optimal_parametrisation(first[:, [k]], second[:, [k]], grid, np.ones(3), 2.0)
        np.testing.assert_array_equal(together[:, k], alone[:, 0])


def test_a_straight_joint_goes_by_the_trapezoid() -> None:
    """Time from rest to rest: way / v + v / a, or 2 sqrt(way / a) when it gets to no full speed."""
    grid, rate, limit = cosine_grid(100), 1.3, 2.5
    ways = np.linspace(0.1, 3.0, 50)
    first = np.broadcast_to(ways[:, None], (101, 50, 1))
    squares = time_optimal_parametrisation(
        first, np.zeros_like(first), grid, np.array([rate]), limit
    )
    durations = taken(squares, grid).sum(axis=0)
    full = ways >= rate**2 / limit
    known = np.where(full, ways / rate + rate / limit, 2.0 * np.sqrt(ways / limit))
    assert full.any() and not full.all()
    assert (durations >= known * (1 - 1e-6)).all() and (durations <= known * 1.03).all()


def test_a_curved_path_keeps_its_limits_and_uses_one_everywhere() -> None:
    """Two joints along half a circle."""
    grid = cosine_grid(200)
    angle = np.pi * grid[:, None, None]
    first = np.pi * np.concatenate([-np.sin(angle), np.cos(angle)], axis=2)
    second = -(np.pi**2) * np.concatenate([np.cos(angle), np.sin(angle)], axis=2)
    squares = time_optimal_parametrisation(first, second, grid, np.ones(2), 2.0)
    path_acceleration = np.diff(squares, axis=0) / (2.0 * np.diff(grid)[:, None])
    assert squares[0] == squares[-1] == 0.0
    velocity = np.abs(first) * np.sqrt(squares)[..., None]
    begins, ends = (
        np.abs(first[side] * path_acceleration[..., None] + second[side] * squares[side, :, None])
        for side in (slice(None, -1), slice(1, None))
    )
    acceleration = np.maximum(begins, ends) / 2.0
    assert velocity.max() <= 1.0 + 1e-9
    assert acceleration.max() <= 1.0 + 1e-6
    # At every place a joint is at its limit of velocity or acceleration, or the limit changes.
    use = np.maximum(velocity[:-1].max(axis=2), acceleration.max(axis=2))
    assert use.min() > 0.95 and np.median(use) > 0.999


def test_a_joint_that_turns_round_bounds_the_speed_there() -> None:
    """One joint goes on; the other has q' = 0 half-way, where only q'' x is its acceleration."""
    grid = np.linspace(0.0, 1.0, 41)
    first = np.stack([np.full(41, 0.01), 2.0 * (grid - 0.5)], axis=1)[:, None]
    second = np.stack([np.zeros(41), np.full(41, 2.0)], axis=1)[:, None]
    squares = time_optimal_parametrisation(first, second, grid, np.full(2, 1e3), 1.0)
    assert squares[20, 0] == pytest.approx(0.5, rel=1e-4) and squares[20, 0] <= 0.5


def test_needed_stretch_makes_the_worst_share_one() -> None:
    assert needed_stretch(0.5, 0.81, 0.729) == pytest.approx(0.9)
    assert needed_stretch(2.0, 1.0) == pytest.approx(2.0)
    assert needed_stretch(0.1, 4.0) == pytest.approx(2.0)
    assert needed_stretch(0.1, 1.0, 27.0) == pytest.approx(3.0)


def test_legs_keep_their_limits_in_the_needed_time(wang: Quadruped) -> None:
    """Sampled densely; what lies before the given time does not count."""
    rng = np.random.default_rng(0)
    columns = 6 + len(wang.joint_names)
    coefficients = rng.normal(size=(6, 4, columns))
    coefficients[:, 0] *= 100.0
    path = MotionPath(np.array([0.0, 0.3, 0.5, 1.1, 1.2]), coefficients)
    limits = rng.uniform(1.0, 2.0, 12)
    factor = legs_needed_stretch(wang, path, 0.3, limits, 3.0)
    slower = stretched(path, factor)
    times = np.linspace(0.3 * factor, slower.duration, 20001)
    legs = 6 + wang.leg_joint_columns
    velocity = (np.abs(slower.evaluate(times, 1)[:, legs]) / limits).max()
    acceleration = np.abs(slower.evaluate(times, 2)[:, legs]).max() / 3.0
    assert 0.95 < max(velocity, acceleration) <= 1.0 + 1e-9
    coarse = legs_needed_stretch(wang, path, 0.3, limits, 3.0, parts=1)
    assert coarse >= factor * (1 - 1e-12)
    assert legs_needed_stretch(wang, path, 0.0, limits, 3.0) > 2.0 * factor
