"""Slope, roughness, edges, hollows, and where a foot may stand."""

from __future__ import annotations

import numpy as np
import pytest

import gaitopt
from gaitopt import Footing, HeightMap, InputError, ground_layers
from gaitopt.conventions import FloatArray

CELL = 0.02
X, Y = np.meshgrid(np.arange(60) * CELL, np.arange(40) * CELL, indexing="ij")
INNER = (slice(2, -2), slice(2, -2))


def of(z: FloatArray, **options: float) -> gaitopt.GroundLayers:
    return ground_layers(HeightMap(z, CELL), **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("slopes", [(0.0, 0.0), (0.3, -0.1), (-0.5, 0.2)])
@pytest.mark.parametrize("patch", [0.02, 0.03, 0.05])
def test_a_plane_has_its_slope_and_no_roughness(slopes: tuple[float, float], patch: float) -> None:
    layers = of(slopes[0] * X + slopes[1] * Y, patch=patch)
    inner = layers.codes != list(Footing).index(Footing.OFF_MAP)
    assert np.allclose(layers.slope[inner], np.arctan(np.hypot(*slopes)), atol=1e-12)
    assert np.allclose(layers.roughness[inner], 0.0, atol=1e-12)
    assert np.isnan(layers.slope[0, 0]) and np.isinf(layers.edge_distance).all()
    assert (layers.depth[inner] < 0.7 * 0.40).all()
    assert layers.steppable[inner].all() and not layers.steppable[0].any()


def test_slope_and_roughness_are_those_of_numpys_least_squares() -> None:
    z = np.random.default_rng(0).uniform(0.0, 0.01, X.shape)
    layers = of(z, patch=0.045)
    for i, j in ((10, 20), (30, 5), (57, 37)):  # Two cells are needed on each side.
        near = np.hypot(X - X[i, j], Y - Y[i, j]) <= 0.045 + 1e-9
        rows = np.column_stack([np.ones(near.sum()), X[near], Y[near]])
        fit, *_ = np.linalg.lstsq(rows, z[near], rcond=None)
        assert layers.slope[i, j] == pytest.approx(np.arctan(np.hypot(*fit[1:])), abs=1e-12)
        assert layers.roughness[i, j] == pytest.approx(np.abs(rows @ fit - z[near]).max())


def test_ground_is_too_steep_where_the_friction_says_so() -> None:
    z = 0.5 * X
    assert of(z, friction=0.501).steppable[INNER].all()
    layers = of(z, friction=0.499)
    assert not layers.steppable.any()
    assert layers.footing([0.5, 0.4]) is Footing.STEEP


def test_a_step_has_an_edge_on_both_sides_and_its_distance_is_known() -> None:
    z = np.where(X > 0.59, 0.1, 0.0)  # From index 29 to index 30.
    layers = of(z)
    away = np.minimum(np.abs(X - 29 * CELL), np.abs(X - 30 * CELL))
    assert np.allclose(layers.edge_distance, away, atol=1e-12)
    assert layers.footing([0.58, 0.4]) is layers.footing([0.6, 0.4]) is Footing.EDGE
    assert layers.steppable[28, 20] and layers.steppable[31, 20]
    wider = of(z, edge_margin=0.05)
    assert not wider.steppable[27:33].any()
    assert wider.steppable[26, 20] and wider.steppable[33, 20]
    assert np.isinf(of(z, edge_height=0.101).edge_distance).all()


def test_a_slope_that_holds_a_foot_is_no_edge_however_much_it_rises_in_a_cell() -> None:
    layers = ground_layers(HeightMap(0.5 * X * 10.0, 0.2), friction=0.6, foot_radius=0.015)
    assert np.isinf(layers.edge_distance).all()


def test_the_flat_floor_of_a_hole_is_no_place_to_stand_and_that_of_a_wide_basin_is() -> None:
    z = np.zeros((200, 60))
    z[20:35] = -1.0  # 16 cells between the rims.
    z[80:150] = -1.0  # 71 cells: 1.42 m.
    layers = of(z, pit_length=0.8, pit_width=0.8)
    assert layers.footing([27 * CELL, 0.5]) is Footing.PIT
    assert layers.depth[27, 20] == 1.0 and layers.depth[110, 20] == 0.0
    assert layers.steppable[110, 20] and layers.steppable[60, 20]
    assert (layers.depth[z == 0.0] == 0.0).all()
    shallow = of(np.where(z < 0.0, -0.2, 0.0), pit_length=0.8, pit_width=0.8)
    assert shallow.steppable[27, 20] and shallow.depth[27, 20] == pytest.approx(0.2)
    assert of(z, pit_length=1.5, pit_width=1.5).footing([110 * CELL, 0.5]) is Footing.PIT


def test_a_corridor_that_the_robot_fits_into_is_no_pit() -> None:
    z = np.ones((100, 60))
    z[:, 20:36] = 0.0  # 17 cells between the walls: 34 cm.
    for walls in (z, z.T):
        inside = of(walls, pit_length=0.5, pit_width=0.3).steppable[walls == 0.0]
        assert inside.mean() > 0.7
        narrow = of(walls, pit_length=0.5, pit_width=0.35)
        assert not narrow.steppable[walls == 0.0].any()


def test_ground_beside_a_wall_or_on_a_slope_is_no_pit() -> None:
    assert (of(np.where(X > 0.6, 2.0, 0.0)).depth == 0.0).all()
    assert (of(0.5 * X).depth < 0.28).all() and of(0.5 * X).steppable[INNER].all()
    stairs = np.floor(X / 0.28) * 0.17
    assert Footing.PIT not in set(np.array(list(Footing))[of(stairs).codes.ravel()])


def test_rough_ground_is_told() -> None:
    z = 0.02 * ((np.arange(60)[:, None] + np.arange(40)) % 2)
    layers = of(z, edge_height=0.05, max_roughness=0.015)
    # Four neighbours differ by 2 cm from the middle, whose mean is 1.6 or 0.4 cm.
    assert np.allclose(layers.roughness[INNER], 0.016, atol=1e-12)
    assert layers.footing([0.5, 0.4]) is Footing.ROUGH
    assert of(z, edge_height=0.05, max_roughness=0.0161).steppable[INNER].all()


@pytest.mark.filterwarnings("error")
def test_a_wide_area_of_unknown_ground_changes_nothing_far_from_it() -> None:
    """An area into which the rectangles of the pits fit."""
    known = HeightMap(np.zeros((150, 150)), CELL)
    z = np.array(known.z)
    z[:90, :90] = np.nan
    layers = ground_layers(HeightMap(z, CELL))
    assert not layers.steppable[:90, :90].any()
    far = (slice(95, None), slice(95, None))
    assert np.array_equal(layers.codes[far], ground_layers(known).codes[far])
    assert (layers.depth == 0.0).all()


def test_no_foot_stands_where_its_ball_has_unknown_ground_below() -> None:
    z = np.zeros(X.shape)
    z[20:23, 18] = np.nan
    ground = HeightMap(z, CELL)
    layers = ground_layers(ground, foot_radius=0.025)
    assert layers.counts[Footing.UNKNOWN] > 3
    ball = ground.ball(np.stack([X, Y], axis=-1), 0.025).centres[..., 2]
    unknown = list(Footing).index(Footing.UNKNOWN)
    assert not (layers.steppable & np.isnan(ball)).any()
    assert np.isnan(ball[layers.codes == unknown]).all()
    assert layers.footing([-0.5, 0.0]) is layers.footing([0.0, 0.4]) is Footing.OFF_MAP
    assert sum(layers.counts.values()) == z.size


def test_limits_fit_the_robot() -> None:
    robot = gaitopt.load_robot("wang2020")
    ground = HeightMap(np.zeros((9, 9)), CELL)
    limits = ground_layers(ground, robot=robot).limits
    assert limits["foot_radius"] == limits["edge_height"] == robot.foot_radius
    assert limits["pit_depth"] == pytest.approx(0.7 * robot.standing_height)
    room = limits["pit_length"], limits["pit_width"]
    assert room == pytest.approx(1.25 * np.array(robot.stance_size))
    assert limits["patch"] == CELL
    # Without a robot they fit wang2020.
    assert ground_layers(ground).limits == pytest.approx(limits)
    assert ground_layers(ground, robot=robot, pit_depth=0.1).limits["pit_depth"] == 0.1


def test_layers_are_not_written_into_and_limits_are_checked() -> None:
    layers = of(np.zeros((9, 9)))
    for array in (layers.slope, layers.depth, layers.codes, layers.steppable):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 0
    for name in ("friction", "patch", "foot_radius", "pit_width"):
        with pytest.raises(InputError, match=name):
            of(np.zeros((9, 9)), **{name: -1.0})
    with pytest.raises(InputError, match=r"HeightMap, got a ndarray; gaitopt.load_ground\(file\)"):
        ground_layers(np.zeros((9, 9)))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="place"):
        layers.footing([0.0])
