"""Distances from support polygons, held against scipy's hulls and a dense search."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from gaitopt.certificate.supports.polygons import Polygons
from gaitopt.conventions import FloatArray

RNG = np.random.default_rng(17)
GROUPS = [c for size in (3, 4) for c in combinations(range(4), size)]


def by_hull(feet: FloatArray, points: FloatArray) -> FloatArray:
    """Signed distance from scipy's hull, and from its sides where points lie outside."""
    hull = ConvexHull(feet)
    inside = (points @ hull.equations[:, :2].T + hull.equations[:, 2]).max(axis=1)
    share = np.linspace(0.0, 1.0, 2001)[:, None, None]
    corners = feet[hull.vertices]
    border = corners + share * (np.roll(corners, -1, axis=0) - corners)
    away = np.linalg.norm(points[:, None, None] - border, axis=3).min(axis=(1, 2))
    return np.where(inside > 0.0, away, inside)


@pytest.mark.parametrize("group", GROUPS, ids=str)
def test_it_is_the_distance_from_the_hull(group: tuple[int, ...]) -> None:
    """Also where one of four feet stands inside of the triangle of the others."""
    standing = np.isin(np.arange(4), group)
    sets, points = RNG.uniform(-1.0, 1.0, (6, 4, 2)), RNG.uniform(-1.5, 1.5, (6, 8, 2))
    polygons = Polygons.of(sets, np.tile(standing, (6, 1)))
    found = polygons.outside(points.reshape(1, -1, 2), np.repeat(np.arange(6), 8)).reshape(6, 8)
    for feet, own, distances in zip(sets, points, found, strict=True):
        assert distances == pytest.approx(by_hull(feet[standing], own), abs=2e-6)


def test_two_feet_and_three_in_a_line_are_a_line() -> None:
    feet = np.array([[[0.0, 0.0], [1.0, 0.0], [0.5, 0.0], [9.0, 9.0]]] * 2)
    standing = np.array([[True, True, False, False], [True, True, True, False]])
    points = np.array([[0.5, 0.2], [0.5, 0.0], [2.0, 0.0], [-0.3, -0.4]])
    for owner in (0, 1):
        found = Polygons.of(feet, standing).outside(points, np.full(4, owner))
        assert found == pytest.approx([0.2, 0.0, 1.0, 0.5], abs=1e-12)


def test_one_foot_and_feet_at_one_place_are_a_point() -> None:
    feet = np.array([[[1.0, 2.0], [1.0, 2.0], [5.0, 5.0], [7.0, 7.0]]] * 2)
    standing = np.array([[True, False, False, False], [True, True, False, False]])
    points = np.array([[1.0, 2.0], [4.0, 6.0]])
    for owner in (0, 1):
        found = Polygons.of(feet, standing).outside(points, np.full(2, owner))
        assert found == pytest.approx([0.0, 5.0], abs=1e-12)


def test_what_is_no_number_has_no_margin() -> None:
    square = np.array([[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]])
    found = Polygons.of(square, np.ones((1, 4), dtype=bool)).outside(
        np.array([[np.nan, 0.5], [0.5, 0.5]]), np.zeros(2, dtype=int)
    )
    assert np.isnan(found[0]) and found[1] == pytest.approx(-0.5)
