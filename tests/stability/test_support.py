"""Support polygons: known triangles, symmetries, and the paper's own equations."""

from __future__ import annotations

from itertools import combinations, permutations

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from gaitopt.conventions import FloatArray, rotation_z
from gaitopt.errors import InputError
from gaitopt.robots.numbering import NUMBERINGS
from gaitopt.stability.support import (
    pair_lines,
    shrunken_polygon,
    support_half_planes,
    triangle_half_planes,
)

RIGHT_ANGLE = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]])  # incircle: radius 1, centre (1, 1)
SQUARE = np.array([[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]])
coordinate = st.floats(-1.0, 1.0)


@st.composite
def triangles(draw: st.DrawFn) -> FloatArray:
    corners = np.array([[draw(coordinate), draw(coordinate)] for _ in range(3)])
    assume(incircle_radius(corners) > 1e-3)
    return corners


def incircle_radius(corners: FloatArray) -> float:
    """Twice the area over the perimeter."""
    first, second = corners[1] - corners[0], corners[2] - corners[0]
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1)
    return float(abs(first[0] * second[1] - first[1] * second[0]) / max(sides.sum(), 1e-9))


def distances(corners: FloatArray, point: FloatArray) -> dict[frozenset[int], float]:
    """Signed distance of `point` from each side, by the corners that the side joins."""
    planes = support_half_planes(corners)
    found = planes.normals @ point - planes.offsets
    return {frozenset(e): float(d) for e, d in zip(planes.edges, found, strict=True)}


# --- half-planes ------------------------------------------------------------------------------


@pytest.mark.parametrize("order", list(permutations(range(3))))
def test_right_angle_has_the_distances_of_its_incircle(order: tuple[int, ...]) -> None:
    """Whatever the order, and so the orientation, of the feet."""
    found = distances(RIGHT_ANGLE[list(order)], np.array([1.0, 1.0]))
    assert len(found) == 3
    np.testing.assert_allclose(list(found.values()), 1.0, rtol=0, atol=1e-15)


def test_distances_are_negative_outside_the_side_that_is_crossed() -> None:
    found = distances(RIGHT_ANGLE, np.array([1.0, -0.5]))
    assert found[frozenset({0, 1})] == -0.5
    assert found[frozenset({0, 2})] == 1.0


@pytest.mark.parametrize("order", list(permutations(range(4)))[::5])
def test_square_has_four_sides_and_no_diagonals(order: tuple[int, ...]) -> None:
    corners = SQUARE[list(order)]
    planes = support_half_planes(corners)
    assert sorted(map(tuple, np.round(planes.normals, 12) + 0.0)) == [
        (-1, 0), (0, -1), (0, 1), (1, 0),
    ]  # fmt: skip
    np.testing.assert_allclose(planes.offsets, -1.0, rtol=0, atol=1e-15)
    for i, j in planes.edges:
        assert np.linalg.norm(corners[i] - corners[j]) == 2.0


def test_foot_inside_the_others_bears_no_side() -> None:
    corners = np.vstack([RIGHT_ANGLE, [[1.0, 1.0]]])
    assert {i for edge in support_half_planes(corners).edges for i in edge} == {0, 1, 2}


def test_heights_of_the_feet_do_not_count() -> None:
    lifted = np.column_stack([RIGHT_ANGLE, [0.1, -0.3, 7.0]])
    flat, raised = support_half_planes(RIGHT_ANGLE), support_half_planes(lifted)
    np.testing.assert_array_equal(flat.normals, raised.normals)
    np.testing.assert_array_equal(flat.offsets, raised.offsets)
    assert flat.edges == raised.edges


@given(triangles(), coordinate, coordinate)
def test_normals_are_units_and_every_foot_is_inside(c: FloatArray, x: float, y: float) -> None:
    planes = support_half_planes(c)
    np.testing.assert_allclose(np.linalg.norm(planes.normals, axis=1), 1.0, rtol=0, atol=1e-14)
    assert (planes.normals @ c.T - planes.offsets[:, None] >= -1e-14).all()
    weights = np.array([1 + x, 1 + y, 0.1])
    inside = weights @ c / weights.sum()
    assert (planes.normals @ inside - planes.offsets >= -1e-14).all()


@given(triangles())
def test_many_triangles_at_once_are_the_triangles_one_by_one(corners: FloatArray) -> None:
    normals, offsets = triangle_half_planes(np.stack([corners, corners[::-1]]))
    for k, triangle in enumerate((corners, corners[::-1])):
        planes = support_half_planes(triangle)
        sides = [{0, 1}, {1, 2}, {2, 0}]
        order = [sides.index(set(edge)) for edge in planes.edges]
        np.testing.assert_allclose(normals[k][order], planes.normals, rtol=0, atol=1e-13)
        np.testing.assert_allclose(offsets[k][order], planes.offsets, rtol=0, atol=1e-13)


def test_triangle_without_area_among_others_is_nan_alone() -> None:
    line = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]])
    normals, offsets = triangle_half_planes(np.stack([RIGHT_ANGLE, line, np.ones((3, 2))]))
    assert np.isfinite(normals[0]).all() and np.isfinite(offsets[0]).all()
    assert np.isnan(normals[1:]).all() and np.isnan(offsets[1:]).all()


@pytest.mark.parametrize("angle", np.linspace(0, np.pi, 12))
@pytest.mark.parametrize("places", [(0, 1, 2), (2, 0, 1), (0, 1, 2, 3), (0, 0, 1)])
def test_feet_in_one_line_are_refused(angle: float, places: tuple[int, ...]) -> None:
    feet = np.array([0.3, -0.2]) + np.outer(places, rotation_z(angle)[:2, 0])
    with pytest.raises(InputError, match=r"stand in one line, and support no area$"):
        support_half_planes(feet)


def test_refusal_names_the_feet() -> None:
    with pytest.raises(InputError) as caught:
        support_half_planes(np.array([[0.0, 0.0], [0.1, 0.0], [0.33333333, 0.0]]))
    assert str(caught.value) == (
        "the feet at [[0.0, 0.0], [0.1, 0.0], [0.3333, 0.0]] stand in one line, and support no area"
    )


@pytest.mark.parametrize("feet", [np.empty((0, 2)), RIGHT_ANGLE[:1], RIGHT_ANGLE[:2]])
def test_fewer_than_three_feet_support_no_area(feet: FloatArray) -> None:
    with pytest.raises(InputError, match="support no area"):
        support_half_planes(feet)


@pytest.mark.parametrize("away", [1e2, 1e4, 1e6])
@given(triangles(), st.floats(0, 2 * np.pi))
def test_sides_are_found_as_well_far_from_the_origin(
    away: float, corners: FloatArray, bearing: float
) -> None:
    feet = corners + away * rotation_z(bearing)[:2, 0]
    assert set(support_half_planes(feet).edges) == set(support_half_planes(corners).edges)
    assert pair_lines(feet)[2].sum() == 3


# --- the shrunken polygon ---------------------------------------------------------------------


def test_shrunken_right_angle_is_known() -> None:
    """Moving each side of 3-4-5 in by half the incircle's radius halves it about its centre."""
    corners = shrunken_polygon(RIGHT_ANGLE, 0.5)
    np.testing.assert_allclose(
        sorted(map(tuple, corners)), [(0.5, 0.5), (0.5, 2.0), (2.5, 0.5)], rtol=0, atol=1e-14
    )


@given(triangles(), st.floats(0.0, 0.95))
def test_shrunken_triangle_is_the_triangle_drawn_towards_its_incentre(
    corners: FloatArray, share: float
) -> None:
    """A homothety: independent of any half-plane."""
    opposite = np.linalg.norm(np.roll(corners, -1, axis=0) - np.roll(corners, 1, axis=0), axis=1)
    incentre = opposite @ corners / opposite.sum()
    expected = incentre + (1 - share) * (corners - incentre)
    found = shrunken_polygon(corners, share * incircle_radius(corners))
    assert len(found) == 3
    for corner in expected:
        assert np.linalg.norm(found - corner, axis=1).min() < 1e-9


@given(triangles())
def test_shrunken_triangle_is_empty_exactly_beyond_the_incircle(corners: FloatArray) -> None:
    radius = incircle_radius(corners)
    assert len(shrunken_polygon(corners, radius * (1 - 1e-6))) == 3
    assert shrunken_polygon(corners, radius * (1 + 1e-6)).shape == (0, 2)


@given(triangles(), st.floats(0.05, 0.9))
def test_every_shrunken_corner_lies_the_margin_off_two_sides(c: FloatArray, share: float) -> None:
    margin = share * incircle_radius(c)
    for corner in shrunken_polygon(c, margin):
        found = sorted(distances(c, corner).values())
        np.testing.assert_allclose(found[:2], margin, rtol=0, atol=1e-10)
        assert found[2] > margin


@given(triangles())
def test_no_margin_gives_back_the_feet_counter_clockwise(corners: FloatArray) -> None:
    found = shrunken_polygon(corners, 0.0)
    (x0, y0), (x1, y1), (x2, y2) = found
    assert (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0) > 0
    assert {min(range(3), key=lambda i: np.linalg.norm(c - corners[i])) for c in found} == {0, 1, 2}
    np.testing.assert_allclose(np.sort(found, axis=0), np.sort(corners, axis=0), atol=1e-9)


def test_shrunken_square_is_a_square() -> None:
    corners = shrunken_polygon(SQUARE[[0, 2, 1, 3]], 0.25)
    np.testing.assert_allclose(np.abs(corners), 0.75, rtol=0, atol=1e-15)
    turned = np.arctan2(corners[:, 1], corners[:, 0])
    np.testing.assert_allclose(np.diff(turned), np.pi / 2, rtol=0, atol=1e-12)


def test_foot_on_the_side_of_others_adds_no_corner() -> None:
    corners = shrunken_polygon(np.vstack([SQUARE, [[0.0, -1.0]]]), 0.25)
    assert corners.shape == (4, 2)


def test_square_shrunk_by_half_its_width_is_one_point() -> None:
    np.testing.assert_allclose(shrunken_polygon(SQUARE, 1.0), [[0.0, 0.0]], rtol=0, atol=1e-12)


@given(triangles(), st.floats(0, 2 * np.pi), st.floats(-1e5, 1e5), st.floats(-1e5, 1e5))
def test_shrinking_does_not_depend_on_where_the_robot_stands(
    corners: FloatArray, angle: float, x: float, y: float
) -> None:
    turn, move = rotation_z(angle)[:2, :2], np.array([x, y])
    margin = 0.5 * incircle_radius(corners)
    here = shrunken_polygon(corners, margin) @ turn.T + move
    there = shrunken_polygon(corners @ turn.T + move, margin)
    assert len(here) == len(there) == 3
    for corner in here:
        assert np.linalg.norm(there - corner, axis=1).min() < 1e-6


# --- the paper's equations --------------------------------------------------------------------


def usual_feet(rng: np.random.Generator) -> dict[int, FloatArray]:
    """Feet by the paper's numbers, each in its own quarter around the body's centre."""
    quarter = {"F": 1.0, "H": -1.0, "L": 1.0, "R": -1.0}
    return {
        i: np.array([quarter[leg[1]], quarter[leg[0]]]) * rng.uniform(0.1, 0.4, 2)
        for i, leg in NUMBERINGS["wang2020"].items()
    }


def eq_3(feet: dict[int, FloatArray], i: int, j: int, p: FloatArray) -> float:
    """The fraction of eqs. (2)-(7), with the sign it has before any mu."""
    (xi, yi), (xj, yj) = feet[i], feet[j]
    a, b, c = yi - yj, xj - xi, xi * (yj - yi) + yi * (xi - xj)
    return float((a * p[0] + b * p[1] + c) / np.sqrt(a**2 + b**2))


def printed_sign(feet: dict[int, FloatArray], i: int, j: int, swing: int) -> float:
    """The sign that eqs. (4)-(7) print before the fraction."""
    if (i, j) in ((1, 2), (3, 4)):
        return {(1, 2): 1.0, (3, 4): -1.0}[i, j]
    if (i, j) in ((1, 3), (2, 4)):
        mu = {(1, 3): 1.0, (2, 4): -1.0}[i, j]
        return mu if feet[i][0] >= feet[j][0] else -mu
    return {(1, 4): {2: 1.0, 3: -1.0}, (2, 3): {1: 1.0, 4: -1.0}}[i, j][swing]


def misprinted(feet: dict[int, FloatArray], i: int, j: int) -> bool:
    """Eq. (5) where x_i >= x_j and eq. (7) hold the triangle's outside."""
    return (i, j) == (2, 3) or ((i, j) in ((1, 3), (2, 4)) and feet[i][0] >= feet[j][0])


@pytest.mark.parametrize("swing", [1, 2, 3, 4])
def test_half_planes_are_eqs_4_to_7_with_two_signs_put_right(swing: int) -> None:
    """For the usual arrangement of the feet; eqs. (5) (first case) and (7) print the wrong sign."""
    rng = np.random.default_rng(swing)
    seen = set()
    for _ in range(200):
        feet, p = usual_feet(rng), rng.uniform(-0.3, 0.3, 2)
        standing = [i for i in NUMBERINGS["wang2020"] if i != swing]
        ours = distances(np.array([feet[i] for i in standing]), p)
        for i, j in combinations(standing, 2):
            sign = printed_sign(feet, i, j, swing) * (-1 if misprinted(feet, i, j) else 1)
            side = frozenset({standing.index(i), standing.index(j)})
            assert ours[side] == pytest.approx(sign * eq_3(feet, i, j, p), abs=1e-14)
            seen.add(misprinted(feet, i, j))
    assert seen == {False, True}


def test_eq_5_and_eq_7_as_printed_exclude_the_middle_of_the_triangle() -> None:
    """Why the signs are put right: with level feet the printed ones hold no point inside."""
    feet = {
        i: np.array([0.2 if leg[1] == "F" else -0.2, 0.15 if leg[0] == "L" else -0.15])
        for i, leg in NUMBERINGS["wang2020"].items()
    }
    middle_234 = (feet[2] + feet[3] + feet[4]) / 3
    assert printed_sign(feet, 2, 3, 1) * eq_3(feet, 2, 3, middle_234) < 0
    assert printed_sign(feet, 2, 4, 1) * eq_3(feet, 2, 4, middle_234) < 0
    assert all(d > 0 for d in distances(np.array([feet[2], feet[3], feet[4]]), middle_234).values())
