"""Balls that rest on the ground: the foothold of a ball foot, and where it touches."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaitopt import HeightMap, InputError
from gaitopt.conventions import FloatArray

CELL = 0.02


def rough(seed: int, height: float = 0.05, shape: tuple[int, int] = (20, 16)) -> HeightMap:
    return HeightMap(np.random.default_rng(seed).uniform(0.0, height, shape), CELL, (-0.1, 0.3))


def inner(ground: HeightMap, count: int, border: float, seed: int = 1) -> FloatArray:
    (x0, x1), (y0, y1) = ground.extent
    low, high = [x0 + border, y0 + border], [x1 - border, y1 - border]
    return np.random.default_rng(seed).uniform(low, high, (count, 2))


def test_on_a_plane_the_ball_is_raised_along_the_normal() -> None:
    x, y = np.meshgrid(np.arange(20) * CELL, np.arange(12) * CELL, indexing="ij")
    plane = HeightMap(0.5 * x - 0.2 * y, CELL)
    places = inner(plane, 50, 0.03)
    contact = plane.ball(places, 0.025)
    stretch = np.sqrt(1.0 + 0.5**2 + 0.2**2)
    normal = np.array([-0.5, 0.2, 1.0]) / stretch
    assert np.allclose(contact.normals, normal, atol=1e-12)
    assert np.allclose(contact.centres[:, :2], places, atol=0)
    assert np.allclose(contact.centres[:, 2], places @ [0.5, -0.2] + 0.025 * stretch, atol=1e-14)
    assert np.allclose(contact.touches, contact.centres - 0.025 * normal, atol=1e-14)


def test_over_a_single_spike_it_rests_on_the_point_until_it_is_a_radius_away() -> None:
    z = np.zeros((21, 21))
    z[10, 10] = 1.0
    ground = HeightMap(z, CELL, (-10 * CELL, -10 * CELL))
    # The flanks are steeper than 88 degrees, so that the ball touches them only farther away.
    contact = ground.ball([[0.0, 0.0], [0.01, 0.0], [0.1, 0.1]], 0.015)
    assert np.allclose(contact.touches[0], [0.0, 0.0, 1.0], atol=1e-15)
    assert contact.centres[0, 2] == pytest.approx(1.015, abs=1e-15)
    assert contact.centres[1, 2] == pytest.approx(1.0 + np.sqrt(0.015**2 - 0.01**2), abs=1e-3)
    assert np.allclose(contact.centres[2], [0.1, 0.1, 0.015], atol=1e-15)


def test_in_a_furrow_it_rests_on_the_flanks_and_not_on_the_bottom() -> None:
    x = (np.arange(31) - 15) * CELL
    ground = HeightMap(np.tile(np.abs(x)[:, None], (1, 20)), CELL, (x[0], 0.0))
    contact = ground.ball([0.0, 0.2], 0.025)
    # A ball between two planes of 45 degrees is sqrt(2) radii above where they meet.
    assert contact.centres[2] == pytest.approx(0.025 * np.sqrt(2.0), abs=1e-15)
    assert np.abs(contact.normals[0]) == pytest.approx(np.sqrt(0.5), abs=1e-12)


def test_on_a_ridge_it_rests_on_the_edge() -> None:
    x = (np.arange(31) - 15) * CELL
    ground = HeightMap(np.tile(-np.abs(x)[:, None], (1, 20)), CELL, (x[0], 0.0))
    contact = ground.ball([0.01, 0.2], 0.025)
    assert np.allclose(contact.touches, [0.0, 0.2, 0.0], atol=1e-15)
    assert contact.centres[2] == pytest.approx(np.sqrt(0.025**2 - 0.01**2), abs=1e-15)


@pytest.mark.parametrize("radius", [0.004, 0.02, 0.03, 0.07])
def test_no_sampled_point_of_the_ground_is_in_the_ball_and_one_touches_it(radius: float) -> None:
    ground = rough(0)
    places = inner(ground, 40, radius)
    contact = ground.ball(places, radius)
    rng = np.random.default_rng(2)
    around = radius * rng.uniform(-1.0, 1.0, (20_000, 2))
    samples = (places[:, None] + around[(around**2).sum(axis=1) < radius**2]).reshape(40, -1, 2)
    points = np.concatenate([samples, ground.height(samples)[..., None]], axis=-1)
    distances = np.linalg.norm(points - contact.centres[:, None], axis=-1)
    assert distances.min() > radius - 1e-12
    # Nor is it higher than it must be: it touches a point of the ground.
    assert np.allclose(ground.height(contact.touches[:, :2]), contact.touches[:, 2], atol=1e-12)
    assert np.allclose(np.linalg.norm(contact.normals, axis=1), 1.0, atol=1e-12)
    touched = contact.centres - radius * contact.normals
    assert np.allclose(touched, contact.touches, atol=1e-15)


def test_mujoco_sees_the_balls_touch_the_ground() -> None:
    mujoco = pytest.importorskip("mujoco")
    ground, radius = rough(4, 0.03), 0.025
    contact = ground.ball(inner(ground, 60, radius + CELL), radius)
    (x0, x1), (y0, y1) = ground.extent
    low, high = ground.height_range
    spec = mujoco.MjSpec()
    spec.option.ccd_tolerance = 1e-9
    spec.add_hfield(
        name="g", nrow=ground.shape[1], ncol=ground.shape[0],
        size=[(x1 - x0) / 2.0, (y1 - y0) / 2.0, high - low, 0.1],
        userdata=((ground.z - low) / (high - low)).T.ravel().tolist(),
    )  # fmt: skip
    middle = [(x0 + x1) / 2.0, (y0 + y1) / 2.0, low]
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="g", pos=middle)
    ball = spec.worldbody.add_body(name="ball")
    ball.add_freejoint()
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[radius, 0, 0], margin=2e-3)
    model = spec.compile()
    data = mujoco.MjData(model)
    for centre in contact.centres:
        data.qpos[:3] = centre
        mujoco.mj_forward(model, data)
        # MuJoCo keeps heights as floats of 32 bits, and finds contacts by iteration.
        assert data.contact.dist.min() == pytest.approx(0.0, abs=1e-5)


def test_without_a_radius_it_is_the_ground_itself() -> None:
    ground = rough(5)
    places = inner(ground, 30, 0.0).reshape(5, 6, 2)
    contact = ground.ball(places, 0.0)
    assert contact.centres.shape == contact.normals.shape == (5, 6, 3)
    assert np.array_equal(contact.centres[..., 2], ground.height(places))
    assert np.array_equal(contact.normals, ground.normal(places))
    # A small ball rests beside it: a face below, unless an edge is nearer.
    small = ground.ball(places, 1e-7)
    assert np.allclose(small.centres, contact.centres, atol=1e-6)


def test_nothing_is_told_where_ground_within_the_radius_is_unknown() -> None:
    z = np.zeros((21, 21))
    z[10, 10] = np.nan
    ground = HeightMap(z, 0.1)
    radius = 0.05
    # Its six triangles reach to x = 0.9 at y = 1, and to x + y = 1.9 ... 2.1 beside the diagonals.
    far = [[0.9 - 0.0501, 1.0], [1.0, 1.1501], [0.1, 0.1], [0.05, 1.95]]
    assert np.isfinite(ground.ball(far, radius).centres).all()
    near = [[0.9 - 0.0499, 1.0], [1.0, 1.1499], [1.0, 1.0], [0.049, 1.0], [1.0, 1.951],
            [-0.2, 1.0], [99.0, 1.0], [np.nan, 1.0], [np.inf, 0.0]]  # fmt: skip
    contact = ground.ball(near, radius)
    for array in (contact.centres, contact.touches, contact.normals):
        assert np.isnan(array).all()
    # Cells have a diagonal: two corners of the square around the point are half a diagonal away.
    for radius, unknown in ((0.0706, False), (0.0708, True)):
        corners = ground.ball([[0.9, 1.1], [1.1, 0.9], [0.9, 0.9], [1.1, 1.1]], radius)
        assert np.isnan(corners.centres[:, 2]).tolist() == [unknown, unknown, True, True]
    assert np.isnan(ground.ball([-0.1, 0.5], 0.0).centres).all()


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), radius=st.floats(0.001, 0.06))
def test_a_ball_on_higher_ground_is_higher_and_a_mirrored_ground_mirrors_it(
    seed: int, radius: float
) -> None:
    ground = rough(seed)
    places = inner(ground, 20, radius, seed)
    contact = ground.ball(places, radius)
    rng = np.random.default_rng(seed)
    raised = ground.with_heights(ground.z + rng.uniform(0.0, 0.02, ground.shape))
    assert (raised.ball(places, radius).centres[:, 2] >= contact.centres[:, 2] - 1e-12).all()
    # Cells keep their diagonal when x and y change places, and when both are turned around.
    swapped = HeightMap(ground.z.T, CELL, ground.origin[::-1])
    turned = swapped.ball(places[:, ::-1], radius)
    assert np.allclose(turned.centres[:, [1, 0, 2]], contact.centres, atol=1e-12)
    (_, x1), (_, y1) = ground.extent
    back = HeightMap(ground.z[::-1, ::-1], CELL, (-x1, -y1)).ball(-places, radius)
    assert np.allclose(back.centres * [-1, -1, 1], contact.centres, atol=1e-12)
    smaller = ground.ball(places, radius * 0.9)
    assert (smaller.centres[:, 2] - 0.9 * radius <= contact.centres[:, 2] - radius + 1e-12).all()


def test_what_is_no_radius_or_no_place_is_refused() -> None:
    ground = rough(0)
    for radius in (-0.01, np.nan, 10.0):
        with pytest.raises(InputError, match="radius"):
            ground.ball([0.0, 0.4], radius)
    with pytest.raises(InputError, match="places"):
        ground.ball([0.0, 0.4, 0.1], 0.02)
