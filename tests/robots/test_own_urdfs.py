"""Masses of our own robots: possible, and those of the solids that their URDFs show."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaitopt.robots.catalog import OWN_ROBOTS

pin = pytest.importorskip("pinocchio")
yourdfpy = pytest.importorskip("yourdfpy")

URDFS = Path(__file__).parents[2] / "urdf"
LEGS = ("LF", "LH", "RH", "RF")
# The masses of the solids a link is made of, in the order of its collision shapes.
SOLIDS: dict[str, dict[str, tuple[float, ...]]] = {
    "wang2020": {
        "base": (8, 0.5, 0.5, 1, 1, 1, 1),
        "HIP": (1,),
        "THIGH": (0.05, 0.50, 1),
        "SHANK": (0.4,),
        "FOOT": (0.05,),
    },
    "frog1": {
        "base": (14, 7, 0.5, 0.5, 2.25, 2.25, 2.25, 2.25),
        "THIGH": (0.7, 1.0, 2.5),
        "SHANK": (1.6,),
        "FOOT": (0.2,),
    },
}

each_robot = pytest.mark.parametrize("robot", SOLIDS)
each_link = pytest.mark.parametrize(
    ("robot", "link"),
    [
        (robot, link)
        for robot, parts in SOLIDS.items()
        for link in ("base", *(f"{leg}_{part}" for leg in LEGS for part in parts if part != "base"))
    ],
)


@cache
def links_of(robot: str) -> dict[str, Any]:
    """Links by name, as yourdfpy reads them."""
    return dict(yourdfpy.URDF.load(str(URDFS / f"{robot}.urdf")).link_map)


def size_and_inertia(shape: Any, mass: float) -> tuple[np.ndarray, np.ndarray]:
    """Half sizes along the axes of a primitive, and its principal moments when solid."""
    if shape.box is not None:
        x, y, z = shape.box.size
        moments = mass / 12 * np.array([y**2 + z**2, x**2 + z**2, x**2 + y**2])
        return np.array([x, y, z]) / 2, moments
    if shape.cylinder is not None:
        r, length = shape.cylinder.radius, shape.cylinder.length
        across = mass * (3 * r**2 + length**2) / 12
        return np.array([r, r, length / 2]), np.array([across, across, mass * r**2 / 2])
    r = shape.sphere.radius
    return np.full(3, r), np.full(3, 2 / 5 * mass * r**2)


def placement(origin: np.ndarray | None) -> np.ndarray:
    return np.eye(4) if origin is None else origin


def test_all_our_own_robots_are_judged_with_all_their_links() -> None:
    assert set(SOLIDS) == set(OWN_ROBOTS)
    for robot, parts in SOLIDS.items():
        named = {"base", *(f"{leg}_{part}" for leg in LEGS for part in parts if part != "base")}
        assert set(links_of(robot)) == named


@each_robot
def test_centre_of_mass_of_the_straight_robot_is_on_the_vertical_axis(robot: str) -> None:
    model = pin.buildModelFromUrdf(str(URDFS / f"{robot}.urdf"), pin.JointModelFreeFlyer())
    com = pin.centerOfMass(model, model.createData(), pin.neutral(model))
    np.testing.assert_allclose(com[:2], 0, atol=1e-12)


@each_link
def test_inertia_is_possible(robot: str, link: str) -> None:
    inertial = links_of(robot)[link].inertial
    np.testing.assert_array_equal(inertial.inertia, inertial.inertia.T)
    small, middle, large = np.linalg.eigvalsh(inertial.inertia)
    assert inertial.mass > 0 and small > 0
    assert small + middle > large


@each_link
def test_inertia_is_that_of_the_shapes(robot: str, link: str) -> None:
    shapes = links_of(robot)[link].collisions
    masses = SOLIDS[robot][link.split("_")[-1]]
    places = [placement(s.origin) for s in shapes]
    assert len(masses) == len(shapes)
    com = sum(m * p[:3, 3] for m, p in zip(masses, places, strict=True)) / sum(masses)
    inertia = np.zeros((3, 3))
    for mass, place, shape in zip(masses, places, shapes, strict=True):
        _, moments = size_and_inertia(shape.geometry, mass)
        arm, turn = place[:3, 3] - com, place[:3, :3]
        inertia += turn @ np.diag(moments) @ turn.T
        inertia += mass * (arm @ arm * np.eye(3) - np.outer(arm, arm))
    stated = links_of(robot)[link].inertial
    assert stated.mass == pytest.approx(sum(masses), rel=1e-12)
    np.testing.assert_allclose(placement(stated.origin)[:3, 3], com, rtol=0, atol=1e-8)
    np.testing.assert_allclose(stated.inertia, inertia, rtol=1e-7, atol=1e-12)


@each_link
def test_centre_of_mass_lies_within_the_shapes(robot: str, link: str) -> None:
    corners = []
    for shape in links_of(robot)[link].collisions:
        place = placement(shape.origin)
        half, _ = size_and_inertia(shape.geometry, 1.0)
        reach = np.abs(place[:3, :3]) @ half
        corners += [place[:3, 3] - reach, place[:3, 3] + reach]
    com = placement(links_of(robot)[link].inertial.origin)[:3, 3]
    assert np.all(np.min(corners, axis=0) < com) and np.all(com < np.max(corners, axis=0))
