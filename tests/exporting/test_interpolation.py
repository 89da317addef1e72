"""Points for trajectory controllers, of any path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, CubicSpline

from gaitopt import Plan
from gaitopt.exporting.at_rest import at_rest
from gaitopt.exporting.interpolation import INTERPOLATIONS, choose_points, hermite, velocity_bounds
from gaitopt.exporting.joint_order import joint_order
from gaitopt.exporting.sampled import Source
from gaitopt.motion.path import MotionPath


def values_of(points: object, order: int) -> list[np.ndarray]:
    names = ("positions", "velocities", "accelerations")[: order + 1]
    return [getattr(points, name) for name in names]


@pytest.mark.parametrize("order", [0, 1, 2])
def test_curves_and_bounds_are_those_of_scipys_polynomials(order: int) -> None:
    rng = np.random.default_rng(0)
    lengths = rng.uniform(0.01, 1.0, 40)
    ends, other = ([rng.normal(size=(40, 3)) for _ in range(order + 1)] for _ in range(2))
    share = np.linspace(0.0, 1.0, 60)
    bounds = velocity_bounds(tuple(ends), tuple(other), lengths)
    for gap, length in enumerate(lengths):
        values = [np.array([a[gap], b[gap]]) for a, b in zip(ends, other, strict=True)]
        curve = BPoly.from_derivatives([0.0, length], np.stack(values, axis=1))
        mine = np.array([hermite(tuple(ends), tuple(other), lengths, s)[gap] for s in share])
        assert mine == pytest.approx(curve(share * length), abs=1e-9)
        assert (np.abs(curve(share * length, 1)).max(axis=0) <= bounds[gap] + 1e-9).all()


def path_of(kind: str, seed: int, knots: int, limits: np.ndarray) -> MotionPath:
    """A random path whose fastest joint is just as fast as it may be."""
    rng = np.random.default_rng(seed)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.002, 0.5, knots))])
    values = 0.03 * rng.normal(size=(knots + 1, 6 + len(limits)))
    if kind == "polyline":
        path = MotionPath.polyline(times, values)
    else:
        curve = CubicSpline(times, values, bc_type="clamped")
        path = MotionPath(times, curve.c)
    fine = np.linspace(0.0, path.duration, 4000)
    rates = np.abs(path.evaluate(np.union1d(fine, path.times), 1)[:, 6:]) / limits
    return path.slowed(float(rates.max()))


@pytest.mark.parametrize("kind", ["polyline", "smooth"])
@settings(max_examples=8)
@given(seed=st.integers(0, 10_000), knots=st.integers(1, 8))
def test_any_path_is_kept_within_limits_and_error(
    short_plan: Plan, kind: str, seed: int, knots: int
) -> None:
    limits = short_plan.robot.velocity_limits
    path = path_of(kind, seed, knots, limits)
    plan = at_rest(replace(short_plan, path=path, phases=()), min(0.2, 0.5 * path.duration))
    source = Source(plan, joint_order(plan.robot.joint_names), False, 0.2)
    for order, name in enumerate(INTERPOLATIONS):
        points = choose_points(source, name, 1e-3, 0.1, 0.0, plan.duration)
        assert (np.diff(points.times) > 1e-6).all()
        curve = BPoly.from_derivatives(points.times, np.stack(values_of(points, order), axis=1))
        share = np.linspace(0.0, 1.0, 23)
        inside = points.times[:-1, None] + share[1:-1] * np.diff(points.times)[:, None]
        there = points.plan_times[:-1, None] + share[1:-1] * np.diff(points.plan_times)[:, None]
        off = np.abs(curve(inside.ravel()) - source.joints(there.ravel()))
        assert off.max() <= 1e-3
        assert (np.abs(curve(inside.ravel(), 1)) / limits).max() <= 1.0 + 2e-6
        assert points.slowed <= 1.01
        assert not points.velocities[[0, -1]].any()
