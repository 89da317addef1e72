"""Maps of points, triangles and columns."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

import gaitopt
from gaitopt import Footholds, GroundError, HeightMap, InputError
from gaitopt.conventions import LEGS

RNG = np.random.default_rng(0)


def test_points_go_to_the_nearest_point_of_the_grid() -> None:
    cloud = [[0.0, 0.0, 1.0], [0.04, -0.04, 3.0], [0.02, 0.03, 2.0], [0.12, 0.11, 7.0],
             [0.3, 0.1, 5.0], [np.nan, 0.0, 9.0], [0.0, 0.0, np.inf]]  # fmt: skip
    highest = HeightMap.from_points(cloud, 0.1)
    assert highest.shape == (4, 2) and highest.origin == (0.0, 0.0)
    assert highest.z[0, 0] == 3.0 and highest.z[1, 1] == 7.0 and highest.z[3, 1] == 5.0
    assert np.count_nonzero(highest.known) == 3
    median = HeightMap.from_points(cloud, 0.1, method="median")
    assert median.z[0, 0] == 2.0 and median.z[1, 1] == 7.0
    even = HeightMap.from_points([*cloud, [0.0, 0.01, 2.5]], 0.1, method="median")
    assert even.z[0, 0] == 2.25


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 1000), method=st.sampled_from(["highest", "median"]))
def test_each_height_is_that_of_the_cloud_around_it(seed: int, method: str) -> None:
    rng = np.random.default_rng(seed)
    cloud = rng.uniform([-1.0, 2.0, 0.0], [0.5, 3.0, 1.0], (300, 3))
    ground = HeightMap.from_points(cloud, 0.13, method=method)
    choose = np.max if method == "highest" else np.median
    for i, x in enumerate(ground.x):
        for j, y in enumerate(ground.y):
            near = cloud[np.abs(cloud[:, :2] - [x, y]).max(axis=1) < 0.065, 2]
            if len(near):
                assert ground.z[i, j] == pytest.approx(choose(near))
            else:
                assert np.isnan(ground.z[i, j])


def test_clouds_that_make_no_map_are_refused() -> None:
    for points, words in (
        (np.zeros((0, 3)), "no points"),
        ([[np.nan] * 3], "no points"),
        (np.zeros((4, 2)), r"shape \(n, 3\)"),
        ("dust", "no array"),
        ([[0, 0, 0], [1e4, 1e4, 0]], "coarser resolution"),
        ([[0, 0, 0], [1e9, 0, 0]], "below 1e"),
        ([[0, 0, 0], [0, 1, 0]], "finer resolution"),
    ):
        with pytest.raises(GroundError, match=words):
            HeightMap.from_points(points, 0.01)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="highest, median"):
        HeightMap.from_points(np.zeros((4, 3)), 0.01, method="mean")
    with pytest.raises(InputError, match="resolution"):
        HeightMap.from_points(np.zeros((4, 3)), 0.0)


def test_the_top_of_a_box_and_nothing_beside_it() -> None:
    box = trimesh.creation.box((0.4, 0.2, 0.1))
    box.apply_translation([1.0, 0.0, 0.0])
    ground = HeightMap.from_triangles(box.triangles, 0.02)
    assert ground.extent == pytest.approx(np.array([[0.8, 1.2], [-0.1, 0.1]]))
    assert np.allclose(ground.z, 0.05, atol=1e-12)
    other = trimesh.creation.box((0.1, 0.1, 0.3))
    other.apply_translation([0.5, 0.0, 0.0])
    both = HeightMap.from_triangles(np.concatenate([box.triangles, other.triangles]), 0.02)
    assert both.height([0.5, 0.0]) == pytest.approx(0.15)
    assert both.height([1.0, 0.0]) == pytest.approx(0.05)
    assert np.isnan(both.height([0.7, 0.0])) and np.isnan(both.height([0.5, 0.09]))


@pytest.mark.parametrize("seed", range(3))
def test_the_top_of_a_crumpled_ball_is_where_rays_from_above_meet_it(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.3)
    ball.vertices += rng.uniform(-0.02, 0.02, ball.vertices.shape)
    turn = trimesh.transformations.random_rotation_matrix(rng.uniform(size=3))
    ball.apply_transform(turn)
    ground = HeightMap.from_triangles(ball.triangles, 0.017)
    x, y = np.meshgrid(ground.x, ground.y, indexing="ij")
    above = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 5.0)])
    places, rays, _ = ball.ray.intersects_location(above, np.tile([0.0, 0.0, -1.0], (x.size, 1)))
    top = np.full(x.size, -np.inf)
    np.maximum.at(top, rays, places[:, 2])
    seen = np.isfinite(top)
    assert seen.mean() > 0.6 and (ground.known.ravel() == seen).all()
    assert np.allclose(ground.z.ravel()[seen], top[seen], atol=1e-9)


def test_triangles_that_stand_upright_have_no_top() -> None:
    wall = [[[0.0, 0.0, 0.0], [1.0, 0.3, 0.0], [0.5, 0.15, 9.0]]]
    floor = [[[-1.0, -1.0, 0.0], [2.0, -1.0, 0.0], [0.0, 2.0, 0.0]]]
    ground = HeightMap.from_triangles(np.array(wall + floor), 0.05)
    assert ground.height_range == (0.0, 0.0)
    with pytest.raises(GroundError, match="no height of the map is known"):
        HeightMap.from_triangles(wall, 0.05)


def test_meshes_that_make_no_map_are_refused() -> None:
    triangle = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])
    for triangles, words in (
        (np.zeros((0, 3, 3)), "shape"),
        (np.zeros((4, 3)), "shape"),
        ("mesh", "no array"),
        (triangle * np.nan, "finite"),
        (triangle * 1e4, "coarser"),
        (triangle * 1e-4, "finer"),
        # A fan of large triangles would keep a computer busy for hours.
        (np.repeat(triangle * 30.0, 100_000, axis=0), "points would have to be looked at"),
    ):
        with pytest.raises(GroundError, match=words):
            HeightMap.from_triangles(triangles, 0.01)  # type: ignore[arg-type]


def test_columns_stand_on_a_floor_below_the_feet() -> None:
    footholds = gaitopt.s_columns(seed=0, height_jitter=0.04)
    ground = HeightMap.from_columns(footholds, 0.015, 0.004, depth=0.2)
    tops = footholds.touching(0.015).reshape(-1, 3)
    assert np.allclose(ground.height(tops[:, :2]), tops[:, 2], atol=1e-12)
    assert ground.height_range[0] == pytest.approx(tops[:, 2].min() - 0.2)
    high = ground.z > ground.height_range[0] + 1e-9
    # 68 columns with a radius of 2 cm.
    assert high.sum() * 0.004**2 == pytest.approx(68 * np.pi * 0.02**2, rel=0.02)
    assert not high[[0, -1]].any() and not high[:, [0, -1]].any()


def test_columns_that_overlap_and_footholds_without_columns() -> None:
    points = {leg: [[0.3 * k, 0.0, 0.1]] for k, leg in enumerate(LEGS)}
    points["RF"] = [[0.01, 0.0, 0.2]]
    ground = HeightMap.from_columns(Footholds(points, radius=0.02), 0.0, 0.005)
    assert ground.height([0.0, 0.0]) == 0.2
    assert ground.height([-0.015, 0.0]) == pytest.approx(0.1)
    with pytest.raises(GroundError, match=r"with_\(radius=0.02\)"):
        HeightMap.from_columns(Footholds(points), 0.0, 0.005)
    for options in ({"resolution": 0.0}, {"foot_radius": -1.0}, {"depth": -1.0}):
        with pytest.raises(InputError, match=next(iter(options))):
            HeightMap.from_columns(
                Footholds(points, radius=0.02),
                **{"foot_radius": 0.0, "resolution": 0.01, **options},
            )  # type: ignore[arg-type]
