"""Projections of polytopes with known images, and solvers that fail or lie."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from gaitopt.conventions import FloatArray
from gaitopt.dynamics.region import programs, projection
from gaitopt.dynamics.region.balance import balanced_forces, orthogonal_complement, zero_sum_basis
from gaitopt.dynamics.region.polygon import (
    SAME_PLACE,
    hull_indices,
    polygon_area,
    polygon_half_planes,
    polygon_margin,
)
from gaitopt.dynamics.region.programs import (
    Daqp,
    Highs,
    Optimum,
    Polytope,
    has_slack,
    largest_slack,
)
from gaitopt.dynamics.region.projection import project
from gaitopt.errors import SolverError

numbers = st.floats(-1.0, 1.0)


def simplex_onto(corners: FloatArray) -> Polytope:
    """All shares that add up to one at most; the first corner gets the rest. Its image is the hull
    of `corners (n + 1, 2)`."""
    n = len(corners) - 1
    return Polytope(
        rows=np.vstack([-np.eye(n), np.ones((1, n))]),
        bounds=np.append(np.zeros(n), 1.0),
        place=corners[0],
        map=(corners[1:] - corners[0]).T,
        radius=1.0,
    )


def image(polytope: Polytope, points: FloatArray) -> FloatArray:
    return np.asarray(polytope.place + points @ polytope.map.T)


def corners_of(polytope: Polytope, tolerance: float = 1e-4) -> FloatArray:
    projection = project(polytope, tolerance)
    assert projection is not None
    places = image(polytope, projection.points)
    return places[hull_indices(places)]


# --- projection -------------------------------------------------------------------------------


@given(st.integers(3, 9), st.integers(0, 10**6))
def test_image_of_a_simplex_is_the_hull_of_its_corners(n: int, seed: int) -> None:
    corners = np.random.default_rng(seed).uniform(-1.0, 1.0, (n, 2))
    polytope = simplex_onto(corners)
    projection = project(polytope, 1e-4)
    assert projection is not None
    places = image(polytope, projection.points)
    hull = ConvexHull(corners)
    assert (polytope.rows @ projection.points.T <= polytope.bounds[:, None] + 1e-15).all()
    assert projection.gap <= 1e-4
    # Every corner lies within the tolerance of the inner polygon, and not outside the outer one.
    inner = places[hull_indices(places)]
    assert (polygon_margin(inner, corners[hull.vertices]) >= -1e-4).all()
    outer = projection.outer[hull_indices(projection.outer)]
    assert (polygon_margin(outer, corners) >= -2e-6).all()
    # And every corner of the inner polygon is one of the true ones, or on a side.
    away = np.linalg.norm(inner[:, None] - corners, axis=-1).min(axis=1)
    on_side = np.abs(polygon_margin(corners[hull.vertices], inner))
    assert (np.minimum(away, on_side) < 1e-6).all()


def test_square_is_found_exactly() -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    found = corners_of(simplex_onto(square))
    assert len(found) == 4
    np.testing.assert_allclose(polygon_area(found), 1.0, atol=1e-8)


def test_segment_and_point_have_no_area() -> None:
    segment = np.array([[0.0, 0.0], [0.3, 0.4], [0.15, 0.2]])
    found = corners_of(simplex_onto(segment))
    assert len(found) == 2
    assert np.linalg.norm(found[0] - found[1]) == pytest.approx(0.5, abs=1e-8)
    assert len(corners_of(simplex_onto(np.zeros((3, 2))))) == 1


def test_empty_polytope_has_no_image() -> None:
    nothing = Polytope(
        np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]),
        np.array([-0.1, -0.1, 1.0, 1.0]), np.zeros(2), np.eye(2), 2.0,
    )  # fmt: skip
    assert largest_slack(nothing) == pytest.approx(-0.1)
    assert project(nothing, 1e-4) is None


def test_what_is_said_of_slack_is_what_highs_says(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of 60 random polytopes in a cube, some of them empty; HiGHS is not needed for any."""
    random, cube = np.random.default_rng(3), np.vstack([np.eye(4), -np.eye(4)])
    cases = []
    for _ in range(60):
        rows = np.vstack([cube, random.normal(size=(8, 4))])
        bounds = np.append(np.ones(8), random.normal(scale=0.5, size=8))
        polytope = Polytope(rows, bounds, np.zeros(2), np.eye(2, 4), 2.0)
        cases.append((polytope, largest_slack(polytope)))
    monkeypatch.setattr(programs, "largest_slack", None)
    assert {slack > 0.0 for _, slack in cases} == {True, False}
    for polytope, slack in cases:
        assert has_slack(polytope, 1e-9) == (slack > 1e-9)
        assert has_slack(polytope, 0.05) == (slack > 0.05)


# --- solvers ----------------------------------------------------------------------------------

PENTAGON = np.array([[np.cos(a), np.sin(a)] for a in 2.0 * np.pi / 5.0 * np.arange(5)])


def test_highs_takes_over_where_daqp_finds_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    expected = corners_of(simplex_onto(PENTAGON))
    monkeypatch.setattr(Daqp, "maximise", lambda self, objective: None)
    found = corners_of(simplex_onto(PENTAGON))
    assert len(found) == 5
    assert (np.linalg.norm(found[:, None] - expected, axis=-1).min(axis=1) < 1e-8).all()


@pytest.mark.parametrize(
    ("points", "duals"),
    [(0.9, 1.0), (1.01, 1.0), (1.0, 0.9), (np.nan, 1.0), (1.0, np.nan)],
    ids=["not the farthest", "outside", "bad multipliers", "NaN", "NaN multipliers"],
)
def test_solver_that_is_wrong_is_not_believed(
    monkeypatch: pytest.MonkeyPatch, points: float, duals: float
) -> None:
    right = Daqp.maximise

    def wrong(self: Daqp, objective: FloatArray) -> Optimum | None:
        optimum = right(self, objective)
        return optimum and Optimum(points * optimum.point, duals * optimum.multipliers)

    monkeypatch.setattr(Daqp, "maximise", wrong)
    asked: list[FloatArray] = []
    highs = Highs.maximise

    def counted(self: Highs, objective: FloatArray) -> Optimum | None:
        asked.append(objective)
        return highs(self, objective)

    monkeypatch.setattr(Highs, "maximise", counted)
    assert len(corners_of(simplex_onto(PENTAGON))) == 5
    assert asked


def test_error_when_no_solver_finds_what_exists(monkeypatch: pytest.MonkeyPatch) -> None:
    for solver in (Daqp, Highs):
        monkeypatch.setattr(solver, "maximise", lambda self, objective: None)
    with pytest.raises(SolverError, match="neither DAQP nor HiGHS"):
        project(simplex_onto(PENTAGON), 1e-4)


def test_number_of_programs_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(projection, "MOST_PROGRAMS", 5)
    with pytest.raises(SolverError):
        project(simplex_onto(PENTAGON), 1e-4)


# --- balanced forces --------------------------------------------------------------------------


@given(st.integers(2, 6), st.integers(0, 10**6))
def test_balanced_forces_hold_the_weight(m: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1.0, 1.0, (5, m, 3)) + np.array([10.0, -20.0, 3.0])
    balanced = balanced_forces(points)
    x = rng.normal(size=(5, 3 * m - 4))
    forces = balanced.forces + np.einsum("bmij,bj->bmi", balanced.basis, x)
    com = balanced.com + np.einsum("baj,bj->ba", balanced.com_basis, x)
    np.testing.assert_allclose(forces.sum(axis=1), [[0.0, 0.0, 1.0]] * 5, atol=1e-13)
    arms = points - np.concatenate([com, np.zeros((5, 1))], axis=1)[:, None]
    np.testing.assert_allclose(np.cross(arms, forces).sum(axis=1), 0.0, atol=1e-11)
    flat = balanced.basis.reshape(5, 3 * m, -1)
    np.testing.assert_allclose(
        np.swapaxes(flat, 1, 2) @ flat, np.tile(np.eye(3 * m - 4), (5, 1, 1)), atol=1e-13
    )


def test_bases_are_orthonormal() -> None:
    basis = zero_sum_basis(5)
    np.testing.assert_allclose(basis.T @ basis, np.eye(4), atol=1e-15)
    np.testing.assert_allclose(basis.sum(axis=0), 0.0, atol=1e-15)
    for unit in ([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.6, -0.8]):
        rest = orthogonal_complement(np.array(unit))
        np.testing.assert_allclose(rest.T @ rest, np.eye(2), atol=1e-15)
        np.testing.assert_allclose(rest.T @ unit, 0.0, atol=1e-15)


# --- polygons ---------------------------------------------------------------------------------


@given(st.lists(st.tuples(numbers, numbers), min_size=3, max_size=12))
def test_hull_contains_all_points(given_points: list[tuple[float, float]]) -> None:
    points = np.array(given_points)
    corners = points[hull_indices(points)]
    assert (polygon_margin(corners, points) >= -12.0 * SAME_PLACE).all()
    if len(corners) >= 3:
        planes = polygon_half_planes(corners)
        assert polygon_area(corners) > 0.0
        assert (planes.normals @ points.T >= planes.offsets[:, None] - 12.0 * SAME_PLACE).all()
        np.testing.assert_allclose(np.linalg.norm(planes.normals, axis=1), 1.0, atol=1e-12)


def test_margin_of_segments_points_and_nothing() -> None:
    place = np.array([[3.0, 4.0]])
    assert polygon_margin(np.array([[0.0, 0.0]]), place)[0] == -5.0
    assert polygon_margin(np.array([[0.0, 0.0], [3.0, 0.0]]), place)[0] == -4.0
    assert polygon_margin(np.empty((0, 2)), place)[0] == -np.inf
