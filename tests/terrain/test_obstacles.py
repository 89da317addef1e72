"""Obstacles across the way: exact distances to round, rectangular and triangular prisms."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.conventions import rotation_z
from gaitopt.errors import InputError
from gaitopt.terrain.obstacles import (
    Obstacle,
    rectangular_obstacle,
    round_obstacle,
    triangular_obstacle,
)

BOARD = rectangular_obstacle(0.11, 0.04)
LOG = round_obstacle(0.2)
RIDGE = triangular_obstacle(0.15, 0.3, apex=0.05)
PLACED = {"position": (1.0, -0.5, 0.2), "yaw": 0.7}
EACH = {
    "board": BOARD,
    "log": LOG,
    "ridge": RIDGE,
    "board placed": rectangular_obstacle(0.11, 0.04, **PLACED),  # type: ignore[arg-type]
    "log placed": round_obstacle(0.2, length=0.5, **PLACED),  # type: ignore[arg-type]
    "ridge inflated": triangular_obstacle(0.15, 0.3, **PLACED).inflated(0.03),  # type: ignore[arg-type]
}

each = pytest.mark.parametrize("name", EACH)
coordinate = st.floats(-1.0, 1.0)


def surface(obstacle: Obstacle, count: int) -> np.ndarray:
    """Points on the section's surface ``(n, 2)``: of arcs and flat sides, found one by one."""
    corners = np.array(obstacle.core)
    turn = np.linspace(0, 2 * np.pi, count)
    ring = obstacle.rounding * np.column_stack([np.cos(turn), np.sin(turn)])
    points = [corner + ring for corner in corners]
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        side = end - start
        if not side.any():
            continue
        outward = np.array([side[1], -side[0]]) / np.hypot(*side)
        share = np.linspace(0, 1, count)[:, None]
        points.append(start + share * side + obstacle.rounding * outward)
    found = np.concatenate(points)
    # Arcs inside the section are no surface.
    return found[obstacle.section_distance(found[:, 0], found[:, 1]) > -1e-9]


# --- known answers ------------------------------------------------------------------------------


def test_the_papers_board() -> None:
    """1500 mm long, 110 mm high, 40 mm wide, with a margin of 30 mm."""
    assert (BOARD.height, BOARD.width, BOARD.length) == (0.11, 0.04, 1.5)
    grown = BOARD.inflated(0.03)
    assert grown.height == pytest.approx(0.14) and grown.width == pytest.approx(0.10)
    assert grown.extent == pytest.approx((-0.05, 0.05)) and grown.length == pytest.approx(1.56)
    assert grown.shape == "rectangular" and grown.core == BOARD.core


@pytest.mark.parametrize(
    ("obstacle", "point", "distance"),
    [
        (BOARD, (0.0, 0.0, 0.21), 0.10),
        (BOARD, (0.32, 0.0, 0.05), 0.30),
        (BOARD, (0.05, 0.0, 0.15), 0.05),  # 3-4-5 from the corner
        (BOARD, (0.0, 0.0, 0.10), -0.01),
        (BOARD, (0.01, 0.3, 0.05), -0.01),
        (BOARD, (0.0, 1.05, 0.05), 0.30),  # beyond its end
        (BOARD, (0.32, 1.15, 0.05), 0.50),  # 3-4-5 from its edge
        (BOARD, (0.0, 0.745, 0.05), -0.005),
        (LOG, (0.0, 0.0, 0.1), -0.1),
        (LOG, (0.3, 0.0, 0.5), 0.4),
        (LOG, (0.0, 0.0, 0.0), 0.0),
        (RIDGE, (0.05, 0.0, 0.15), 0.0),
        (RIDGE, (0.05, 0.0, 0.25), 0.1),
        (RIDGE, (0.0, 0.0, -0.1), 0.1),
    ],
)
def test_distance_is_known(obstacle: Obstacle, point: Any, distance: float) -> None:
    assert obstacle.distance(point) == pytest.approx(distance, abs=1e-12)


def test_height_is_known() -> None:
    places = np.array([[0.0, 0.0], [0.02, 0.7], [0.021, 0.0], [0.0, 0.76]])
    assert BOARD.height_at(places).tolist() == [0.11, 0.11, 0.0, 0.0]
    np.testing.assert_allclose(LOG.height_at([[0.0, 0], [0.06, 0], [0.1, 0]]), [0.2, 0.18, 0.1])
    np.testing.assert_allclose(RIDGE.height_at([[0.05, 0], [-0.05, 0], [0.1, 0]]),
                               [0.15, 0.075, 0.075])  # fmt: skip
    raised = rectangular_obstacle(0.11, 0.04, position=(0.0, 0.0, 0.5))
    assert raised.height_at([[0.0, 0.0, 9.0], [1.0, 0.0, 9.0]]).tolist() == [0.61, 0.5]


# --- distances against the surface itself -------------------------------------------------------


@each
def test_distance_is_to_the_nearest_point_of_the_surface(name: str) -> None:
    obstacle = EACH[name]
    rng = np.random.default_rng(3)
    points = rng.uniform((-0.4, -0.3), (0.4, 0.5), (300, 2))
    on = surface(obstacle, 4000)
    nearest = np.linalg.norm(points[:, None] - on, axis=-1).min(axis=1)
    ours = obstacle.section_distance(points[:, 0], points[:, 1])
    # The nearest of points 0.16 mm apart is farther away by an offset of at most half of that.
    excess = nearest**2 - ours**2
    assert excess.min() > -1e-12 and excess.max() < 2 * 1.6e-4**2
    assert (ours < 0).any() and (ours > 0).any()


@each
@given(x=coordinate, z=coordinate, margin=st.floats(0.0, 0.3))
def test_inflating_takes_the_margin_from_every_distance(
    name: str, x: float, z: float, margin: float
) -> None:
    obstacle = EACH[name]
    before, after = (
        obstacle.section_distance(x, z),
        obstacle.inflated(margin).section_distance(x, z),
    )
    assert after == pytest.approx(before - margin, abs=1e-12)


@each
def test_inflated_obstacle_holds_all_points_within_the_margin(name: str) -> None:
    """Also beyond its ends, where it holds a little more."""
    obstacle, rng = EACH[name], np.random.default_rng(4)
    points = np.array(obstacle.position) + rng.uniform(-1.1, 1.1, (4000, 3))
    near = obstacle.distance(points) <= 0.05
    grown = obstacle.inflated(0.05)
    assert near.any() and grown.contains(points[near]).all()
    extra = grown.contains(points) & ~near
    assert (obstacle.distance(points[extra]) <= 0.05 * np.sqrt(2)).all()


@each
@given(a=st.tuples(coordinate, coordinate, coordinate),
       b=st.tuples(coordinate, coordinate, coordinate))  # fmt: skip
def test_distance_changes_no_faster_than_the_point_moves(name: str, a: Any, b: Any) -> None:
    """What proofs between samples lean on."""
    one, two = np.array(a), np.array(b)
    change = abs(EACH[name].distance(one) - EACH[name].distance(two))
    assert change <= np.linalg.norm(one - two) + 1e-12


def test_pinocchios_collision_library_agrees_on_boards_and_logs() -> None:
    coal = pytest.importorskip("coal")
    rng = np.random.default_rng(5)
    shapes = {
        "board": (coal.Box(0.04, 1.5, 0.11), np.eye(3), 0.055),
        "log": (coal.Cylinder(0.1, 1.5), np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]]), 0.1),
    }
    point = coal.Sphere(1e-3)
    for name, (shape, turn, up) in shapes.items():
        at = coal.Transform3s(turn.astype(float), np.array([0.0, 0.0, up]))
        for p in rng.uniform(-1.0, 1.0, (100, 3)):
            result = coal.DistanceResult()
            there = coal.Transform3s(np.eye(3), p)
            theirs = coal.distance(shape, at, point, there, coal.DistanceRequest(), result)
            ours = float(EACH[name].distance(p)) - 1e-3
            if ours > 0.0:
                assert theirs == pytest.approx(ours, abs=1e-5)


# --- frames, heights, meshes --------------------------------------------------------------------


@each
def test_world_and_own_frame_are_a_round_trip(name: str) -> None:
    obstacle, points = EACH[name], np.random.default_rng(6).normal(size=(5, 4, 3))
    back = obstacle.to_world(obstacle.to_local(points))
    np.testing.assert_allclose(back, points, rtol=0, atol=1e-14)


@given(yaw=st.floats(-7.0, 7.0), x=coordinate, y=coordinate, z=coordinate)
def test_turned_and_moved_obstacle_is_as_far_from_turned_and_moved_points(
    yaw: float, x: float, y: float, z: float
) -> None:
    shift = np.array([0.4, -0.2, 0.1])
    moved = triangular_obstacle(0.15, 0.3, apex=0.05, position=(0.4, -0.2, 0.1), yaw=yaw)
    point = np.array([x, y, z])
    there = rotation_z(yaw) @ point + shift
    assert moved.distance(there) == pytest.approx(float(RIDGE.distance(point)), abs=1e-12)


@each
def test_surface_is_where_height_says(name: str) -> None:
    obstacle, rng = EACH[name], np.random.default_rng(7)
    low, high = obstacle.extent
    local = np.column_stack([
        rng.uniform(low, high, 200), rng.uniform(-0.5, 0.5, 200) * obstacle.length, np.zeros(200),
    ])  # fmt: skip
    places = obstacle.to_world(local)
    places[:, 2] = obstacle.height_at(places)
    up = np.array([0.0, 0.0, 1e-9])
    just_above, just_below = places + up, places - up
    np.testing.assert_allclose(obstacle.distance(places), 0.0, atol=1e-9)
    assert not obstacle.contains(just_above).any()
    inside = places[:, 2] > obstacle.position[2]
    assert inside.mean() > 0.9 and obstacle.contains(just_below[inside]).all()


@each
@pytest.mark.parametrize("sides", [3, 8, 64])
def test_outline_contains_the_section_and_touches_it(name: str, sides: int) -> None:
    obstacle = EACH[name]
    rim = obstacle.outline(sides)
    step = np.roll(rim, -1, axis=0) - rim
    outward = np.stack([step[:, 1], -step[:, 0]], axis=-1)
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    beyond = ((surface(obstacle, 500)[:, None] - rim) * outward).sum(axis=-1)
    assert beyond.max() < 1e-9
    np.testing.assert_allclose(beyond.max(axis=0), 0.0, atol=1e-4)
    turn = np.cross(
        np.c_[step, np.zeros(len(step))], np.roll(np.c_[step, np.zeros(len(step))], -1, 0)
    )
    assert (turn[:, 2] > 0).all()


@each
def test_mesh_is_a_closed_prism_seen_from_outside(name: str) -> None:
    obstacle = EACH[name]
    vertices, faces = obstacle.mesh(48)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    there, back = {tuple(e) for e in edges.tolist()}, {tuple(e[::-1]) for e in edges.tolist()}
    assert len(there) == len(edges) and there == back  # every edge once in each sense
    assert len(vertices) - len(edges) // 2 + len(faces) == 2
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    rim = obstacle.outline(48)
    x, z = rim.T
    area = (x * np.roll(z, -1) - z * np.roll(x, -1)).sum() / 2.0
    assert volume == pytest.approx(area * obstacle.length, rel=1e-9) and volume > 0
    distance = obstacle.distance(vertices)
    assert distance.min() > -1e-12 and distance.max() < 0.01


def test_finer_meshes_come_nearer_to_the_round_section() -> None:
    areas = []
    for sides in (8, 32, 128):
        x, z = LOG.outline(sides).T
        areas.append((x * np.roll(z, -1) - z * np.roll(x, -1)).sum() / 2.0)
    assert areas[0] > areas[1] > areas[2] > np.pi * 0.1**2
    assert areas[2] == pytest.approx(np.pi * 0.1**2, rel=3e-4)


def test_many_points_at_once_are_the_points_one_by_one() -> None:
    points = np.random.default_rng(8).normal(size=(3, 4, 3))
    for obstacle in EACH.values():
        both = obstacle.distance(points), obstacle.height_at(points), obstacle.contains(points)
        for i in range(3):
            for j in range(4):
                # Products of matrices may round the last bit otherwise than those of vectors.
                assert both[0][i, j] == pytest.approx(obstacle.distance(points[i, j]), abs=1e-14)
                assert both[1][i, j] == pytest.approx(obstacle.height_at(points[i, j]), abs=1e-14)
                assert both[2][i, j] == obstacle.contains(points[i, j])


# --- values and refusals ------------------------------------------------------------------------


@each
def test_obstacles_are_values(name: str) -> None:
    obstacle = EACH[name]
    copy = pickle.loads(pickle.dumps(obstacle))
    assert copy == obstacle and hash(copy) == hash(obstacle)
    assert obstacle != obstacle.inflated(0.01)
    with pytest.raises(AttributeError):
        obstacle.yaw = 1.0  # type: ignore[misc]


@pytest.mark.parametrize("bad", [0.0, -0.1, float("nan"), float("inf"), "high", None, 1e7])
@pytest.mark.parametrize("name", ["height", "width", "length", "diameter"])
def test_bad_length_is_named(name: str, bad: Any) -> None:
    with pytest.raises(InputError) as caught:
        if name == "diameter":
            round_obstacle(bad)
        else:
            triangular_obstacle(**{"height": 0.1, "width": 0.1, name: bad})
    assert str(caught.value) == f"{name} must be a finite length of at least 1e-06 m, got {bad!r}"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"position": (0.0, 0.0)}, "position must be three finite lengths"),
        ({"position": (0.0, 0.0, float("nan"))}, "position must be three finite lengths"),
        ({"position": "here"}, "position must be three finite lengths"),
        ({"yaw": float("inf")}, "yaw must be a finite angle"),
        ({"yaw": "left"}, "yaw must be a finite angle"),
        ({"apex": float("nan")}, "apex must be a finite length"),
    ],
)
def test_bad_placement_is_refused(arguments: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        triangular_obstacle(0.1, 0.1, **arguments)


@pytest.mark.parametrize(
    ("shape", "core", "words"),
    [
        ("square", ((0, 0),), "shape must be one of round, rectangular, triangular, got 'square'"),
        ("round", ((0, 0), (1, 1)), "needs 1 finite corners"),
        ("triangular", ((0, 0), (0, 1), (1, 0)), "convex and counter-clockwise"),
        ("rectangular", ((0, 0), (1, 0), (0.2, 0.2), (0, 1)), "convex and counter-clockwise"),
    ],
)
def test_section_that_is_none_is_refused(shape: str, core: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Obstacle(shape, core, 0.0)


@pytest.mark.parametrize("bad", [-0.01, float("nan"), "wide"])
def test_bad_margin_is_named(bad: Any) -> None:
    with pytest.raises(InputError, match="margin must be a finite length of at least 0 m"):
        BOARD.inflated(bad)


@pytest.mark.parametrize("bad", [2, 3.5, None])
def test_bad_number_of_sides_is_named(bad: Any) -> None:
    with pytest.raises(InputError, match="sides must be a whole number from 3"):
        LOG.mesh(bad)
