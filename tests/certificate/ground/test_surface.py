"""The certificate's own geometry of a height map: distances, heights and highest points."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pinocchio import coal

from gaitopt import HeightMap
from gaitopt.certificate.ground.block_maxima import BlockMaxima
from gaitopt.certificate.ground.solids import Solid
from gaitopt.certificate.ground.surface import Surface
from gaitopt.certificate.ground.unknown import Footprints

Array = NDArray[np.float64]
EVERYWHERE = np.zeros((1, 2)), 100.0


def surface(
    z: Array, resolution: float = 0.02, origin: tuple[float, float] = (0.0, 0.0)
) -> Surface:
    return Surface.around(HeightMap(z, resolution, origin), *EVERYWHERE)


def rough(seed: int, shape: tuple[int, int] = (12, 9)) -> Array:
    return np.random.default_rng(seed).uniform(-0.03, 0.03, shape)


def ramp(slope: float, shape: tuple[int, int] = (60, 60), resolution: float = 0.02) -> Array:
    """Heights that rise along x."""
    return np.broadcast_to(slope * resolution * np.arange(shape[0])[:, None], shape).copy()


@pytest.mark.parametrize("slope", [0.0, 0.3, -1.0, 5.0])
def test_distance_to_a_plane(slope: float) -> None:
    ground = surface(ramp(slope))
    points = np.array([[0.6, 0.6, 0.6 * slope + 0.05], [0.55, 0.61, 0.55 * slope - 0.02]])
    found = ground.nearest(points, 0.2)
    along = np.hypot(1.0, slope)
    np.testing.assert_allclose(found.distances, np.array([0.05, -0.02]) / along, atol=1e-12)
    normal = np.array([-slope, 0.0, 1.0]) / along
    np.testing.assert_allclose(points - found.points, found.distances[:, None] * normal, atol=1e-12)


def test_distance_to_a_ridge_and_to_the_foot_of_a_cliff() -> None:
    """Above a ridge the nearest point is on it; beside a wall it is on the wall."""
    x = 0.02 * np.arange(41)
    roof = surface(np.broadcast_to(-np.abs(x - 0.4)[:, None], (41, 41)).copy())
    assert roof.distances(np.array([[0.4, 0.413, 0.1]]), 0.5)[0] == pytest.approx(0.1, abs=1e-12)
    step = surface(np.broadcast_to(np.where(x > 0.41, 0.5, 0.0)[:, None], (41, 41)).copy())
    # The wall rises from x = 0.40 to 0.42 m, by 0.5 m.
    beside = step.distances(np.array([[0.39, 0.4, 0.1]]), 0.5)[0]
    lean = np.hypot(0.02, 0.5)
    assert beside == pytest.approx((0.01 * 0.5 + 0.1 * 0.02) / lean, abs=1e-12)


@given(seed=st.integers(0, 10_000))
@example(seed=131)  # an edge on the border of the map, whose only triangle is unknown
@settings(max_examples=30)
def test_distances_are_those_of_coal(seed: int) -> None:
    """Coal's ball and triangles, against the formulas here."""
    z = rough(seed)
    z[seed % 10, seed % 7] = np.nan
    ground = surface(z)
    rng = np.random.default_rng(seed)
    points = rng.uniform([0.0, 0.0, -0.02], [0.22, 0.16, 0.1], (20, 3))
    found = ground.distances(points, 0.2)
    radius = 1e-4
    ball = Solid.of("ball", 1, coal.Sphere(radius), pin.SE3.Identity())
    for point, distance in zip(points, found, strict=True):
        gap = ground.gap(ball, np.eye(3), point)
        if distance > 1e-3:
            assert gap + radius == pytest.approx(distance, abs=2e-6)
        elif distance < -1e-3:
            assert gap <= 0.0


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30)
def test_heights_are_those_of_the_map(seed: int) -> None:
    """The planners' formula for the surface and the certificate's own."""
    z = rough(seed)
    z[3, 4] = np.nan
    ground = HeightMap(z, 0.02, (0.1, -0.2))
    places = np.random.default_rng(seed).uniform([0.08, -0.22], [0.34, -0.02], (200, 2))
    own = Surface.around(ground, *EVERYWHERE).heights(places)
    np.testing.assert_allclose(own, ground.height(places), atol=1e-12)
    assert np.isnan(own).any() and np.isfinite(own).any()


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30)
def test_nothing_under_a_rectangle_is_higher_than_the_highest(seed: int) -> None:
    z = rough(seed, (30, 25))
    z[seed % 30, seed % 25] = np.nan
    ground = surface(z)
    rng = np.random.default_rng(seed)
    low = rng.uniform([-0.05, -0.05], [0.6, 0.5], (40, 2))
    high = low + rng.uniform(0.0, 0.3, (40, 2))
    found = ground.highest(low, high)
    for a, b, top in zip(low, high, found, strict=True):
        x, y = (np.linspace(a[k], b[k], 30) for k in (0, 1))
        seen = ground.heights(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))
        if np.isnan(seen).any():
            assert top == np.inf
        else:
            assert top >= seen.max() - 1e-12


@given(seed=st.integers(0, 10_000), nx=st.integers(1, 40), ny=st.integers(1, 40))
@settings(max_examples=50)
def test_block_maxima_are_maxima(seed: int, nx: int, ny: int) -> None:
    rng = np.random.default_rng(seed)
    table = rng.normal(size=(nx, ny))
    first = np.stack([rng.integers(0, nx, 20), rng.integers(0, ny, 20)], axis=1)
    end = np.stack([rng.integers(first[:, 0], nx), rng.integers(first[:, 1], ny)], axis=1) + 1
    found = BlockMaxima.of(table).over(first, end)
    for (i, j), (k, m), largest in zip(first, end, found, strict=True):
        assert largest == table[i:k, j:m].max()


def test_a_part_of_a_map_is_the_same_ground() -> None:
    whole = HeightMap(rough(7, (60, 50)), 0.02, (-0.3, 0.2))
    part = Surface.around(whole, np.array([[0.25, 0.65]]), 0.15)
    assert part.z.size < whole.z.size / 3 and not part.cut_short
    points = np.random.default_rng(0).uniform([0.15, 0.55, -0.05], [0.35, 0.75, 0.1], (100, 3))
    everything = Surface.around(whole, *EVERYWHERE)
    assert everything.cut_short
    np.testing.assert_allclose(
        part.distances(points, 0.03), everything.distances(points, 0.03), atol=1e-12
    )


@given(seed=st.integers(0, 10_000))
@settings(max_examples=50)
def test_unknown_ground_is_found_under_boxes_that_are_turned(seed: int) -> None:
    """Against points within the box, and within the box grown by a cell's diagonal."""
    rng = np.random.default_rng(seed)
    z = np.zeros((30, 30))
    z[rng.integers(5, 25, 6), rng.integers(5, 25, 6)] = np.nan
    ground = surface(z)
    turn = pin.rpy.rpyToMatrix(*rng.uniform(-3.0, 3.0, 3))
    half, middle = rng.uniform(0.005, 0.08, 3), rng.uniform(0.2, 0.38, 2)
    boxes = Footprints(middle[None], (turn * half).T[None, :, :2], np.array([0.0]))
    shares = rng.uniform(-1.0, 1.0, (4000, 3))
    inside = middle + (shares * half @ turn.T)[:, :2]
    (found,) = ground.unknown_under(boxes)
    if np.isnan(ground.heights(inside)).any():
        assert found
    if found:
        grown = np.concatenate([
            middle + (shares * half @ turn.T)[:, :2] + shift
            for shift in rng.uniform(-0.03, 0.03, (40, 2))
        ])  # fmt: skip
        assert np.isnan(ground.heights(grown)).any()


def test_ground_beside_a_turned_box_does_not_count() -> None:
    """A corner of the rectangle around a plank that lies at 45 degrees is free."""
    z = np.zeros((60, 60))
    z[50, 10] = np.nan
    ground = surface(z)
    along = 0.4 * np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
    across = 0.03 * np.array([-1.0, 1.0, 0.0]) / np.sqrt(2.0)
    axes = np.stack([along, across, [0.0, 0.0, 0.02]])[None, :, :2]
    for margin, found in ((0.0, False), (0.5, True)):
        boxes = Footprints(np.array([[0.6, 0.6]]), axes, np.array([margin]))
        assert ground.unknown_under(boxes)[0] == found
    low, high = np.array([[0.3, 0.3]]), np.array([[0.9, 0.9]])
    assert ground.highest(low - 0.13, high + 0.13)[0] == np.inf
    outside = Footprints(np.array([[0.1, 0.6]]), axes, np.zeros(1))
    assert ground.unknown_under(outside)[0]


def test_of_a_large_map_only_triangles_near_the_way_are_meshed() -> None:
    """A walk along the diagonal of a map of 14 m: gaps are the same, and most of it is left out."""
    x = np.linspace(1.0, 13.0, 300)
    way = np.column_stack([x, x])
    z = 0.03 * np.random.default_rng(2).random((700, 700))
    ground = Surface.around(HeightMap(z, 0.02), way, 0.3)
    assert 0.05 < len(ground.triangles()[1]) / (2 * 600**2) < 0.15
    box = Solid.of("box", 1, coal.Box(0.1, 0.3, 0.05), pin.SE3.Identity())
    for place in way[::60]:
        at = np.array([*place, 0.1])
        near = Surface.around(HeightMap(z, 0.02), place[None], 0.5)
        assert ground.gap(box, np.eye(3), at) == pytest.approx(near.gap(box, np.eye(3), at))


def test_what_lies_wholly_below_the_ground_is_in_it() -> None:
    ground = surface(np.zeros((40, 40)))
    box = Solid.of("box", 1, coal.Box(0.05, 0.05, 0.05), pin.SE3.Identity())
    for height, gap in ((0.125, 0.1), (-0.125, -0.1)):
        at = np.array([0.4, 0.4, height])
        assert ground.gap(box, np.eye(3), at) == pytest.approx(gap, abs=1e-6)
    assert ground.gap(box, np.eye(3), np.array([0.4, 0.4, 0.02])) < 0.0
