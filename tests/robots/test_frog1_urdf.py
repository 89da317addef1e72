"""FROG-I of [Shao2011]: what its URDF says must be what the paper says, and possible."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaitopt.conventions import LEGS
from gaitopt.robots.catalog import OWN_ROBOTS, load_robot
from gaitopt.robots.quadruped import Quadruped

pin = pytest.importorskip("pinocchio")
yourdfpy = pytest.importorskip("yourdfpy")

URDF = Path(__file__).parents[2] / "urdf" / "frog1.urdf"
HIPS = {
    "LF": (0.45, 0.28, 0), "LH": (-0.45, 0.28, 0), "RH": (-0.45, -0.28, 0), "RF": (0.45, -0.28, 0),
}  # fmt: skip
LINK = 0.40
STANDING = 0.72  # hips above the foot frames
BALL = 0.02
WEIGHT = 55 * 9.81
PARTS = ("THIGH", "SHANK", "FOOT")
LINKS = ("base", *(f"{leg}_{part}" for leg in LEGS for part in PARTS))

each_leg = pytest.mark.parametrize("leg", LEGS)
each_link = pytest.mark.parametrize("link", LINKS)


@pytest.fixture(scope="module")
def frog() -> Quadruped:
    return load_robot("frog1")


@pytest.fixture(scope="module")
def urdf() -> Any:
    """The robot as yourdfpy reads it."""
    return yourdfpy.URDF.load(str(URDF))


@pytest.fixture(scope="module")
def fixed() -> Any:
    """The robot with its body held at the origin."""
    return pin.buildModelFromUrdf(str(URDF))


def joints_for(frog: Quadruped, feet: Mapping[str, Any]) -> dict[str, float]:
    """Joint angles by name that put each foot at a place seen from its hip."""
    angles: dict[str, float] = {}
    for name, foot in feet.items():
        leg = frog.legs[name]
        q = leg.inverse(np.array(HIPS[name]) + foot)
        assert leg.shortfall(np.array(HIPS[name]) + foot) < 1e-9
        assert np.all(q >= leg.position_limits[0]) and np.all(q <= leg.position_limits[1])
        angles.update(zip(leg.joints, q, strict=True))
    return angles


def half_extent(shape: Any, turn: np.ndarray) -> np.ndarray:
    """Half sizes along the world's axes of a primitive turned by ``turn``."""
    if shape.box is not None:
        return np.asarray(np.abs(turn) @ (np.array(shape.box.size) / 2))
    if shape.cylinder is not None:
        along = np.abs(turn[:, 2])
        around = shape.cylinder.radius * np.sqrt(np.maximum(1 - along**2, 0))
        return np.asarray(along * shape.cylinder.length / 2 + around)
    return np.full(3, shape.sphere.radius)


def placement(origin: np.ndarray | None) -> np.ndarray:
    return np.eye(4) if origin is None else origin


# --- what the paper gives -----------------------------------------------------------------------


def test_frog1_is_one_of_our_own_robots(frog: Quadruped) -> None:
    assert "frog1" in OWN_ROBOTS
    assert repr(frog) == "Quadruped('frog1', 55 kg, 8 joints, legs LF LH RH RF)"


def test_robot_standing_is_as_long_wide_and_tall_as_the_paper_says(
    frog: Quadruped, urdf: Any
) -> None:
    """1150 x 700 x 950 mm, hips 0.72 m above the foot frames."""
    urdf.update_cfg(joints_for(frog, {leg: (0.0, 0.0, -STANDING) for leg in LEGS}))
    low, high = [], []
    for link in LINKS:
        for shape in urdf.link_map[link].collisions:
            place = urdf.get_transform(link, "base") @ placement(shape.origin)
            half = half_extent(shape.geometry, place[:3, :3])
            low.append(place[:3, 3] - half)
            high.append(place[:3, 3] + half)
    size = np.max(high, axis=0) - np.min(low, axis=0)
    np.testing.assert_allclose(size, [1.15, 0.70, 0.95], rtol=0, atol=1e-9)


def test_paint_does_not_make_the_robot_larger(urdf: Any) -> None:
    """Drawn shapes lie within 2 mm of what can be touched."""
    for link in LINKS:
        reach = []
        for shapes in (urdf.link_map[link].visuals, urdf.link_map[link].collisions):
            ends = [
                s.origin[:3, 3] + sign * half_extent(s.geometry, s.origin[:3, :3])
                for s in shapes
                for sign in (-1, 1)
            ]
            reach.append(np.concatenate([np.min(ends, axis=0), np.max(ends, axis=0)]))
        np.testing.assert_allclose(reach[0], reach[1], rtol=0, atol=0.0021)


def test_robot_weighs_55_kg(frog: Quadruped, urdf: Any) -> None:
    assert frog.mass == pytest.approx(55, rel=0, abs=1e-12)
    total = sum(link.inertial.mass for link in urdf.link_map.values())
    assert total == pytest.approx(55, rel=0, abs=1e-12)


@each_leg
def test_legs_are_pitch_pitch_at_the_speeds_of_table_1(frog: Quadruped, leg: str) -> None:
    of = frog.legs[leg]
    assert of.joints == (f"{leg}_HFE", f"{leg}_KFE") and not of.has_roll
    np.testing.assert_allclose(np.degrees(of.velocity_limits), [10, 20], rtol=1e-12)
    assert (of.upper, of.lower, of.lateral) == (LINK, LINK, 0.0)
    np.testing.assert_array_equal(of.hip, HIPS[leg])
    assert of.knee == (-1 if leg.endswith("F") else 1)


@each_leg
def test_standing_leaves_reach_for_the_stride(frog: Quadruped, leg: str) -> None:
    """The header's 0.34 m; the board is crossed with less."""
    of = frog.legs[leg]
    assert of.shortfall(of.hip + np.array([[0.34, 0, -STANDING], [-0.34, 0, -STANDING]])).max() == 0
    assert of.shortfall(of.hip + np.array([0.36, 0, -STANDING])) > 0


# --- kinematics: eqs. (1)-(6) -------------------------------------------------------------------


def cross_matrix(a: np.ndarray) -> np.ndarray:
    """The matrix that the paper writes ``a x l``: its product with p is the cross product."""
    x, y, z = a
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def rodrigues(axis: np.ndarray, angle: float) -> np.ndarray:
    """Eq. (1)."""
    k = cross_matrix(axis)
    return np.asarray(np.eye(3) + k * math.sin(angle) + k @ k * (1 - math.cos(angle)))


def foot_by_eqs_5_and_6(leg: str, place: np.ndarray, turn: np.ndarray, q: Any) -> np.ndarray:
    """Foot in the world, from body to hip, hip to knee, knee to foot."""
    pitch, down = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, -LINK])
    p, r = place, turn
    for b, angle in ((np.array(HIPS[leg]), q[0]), (down, q[1])):
        p = p + r @ b
        r = r @ rodrigues(pitch, angle)
    return np.asarray(p + r @ down)


def test_eq_1_turns_as_pinocchio_does() -> None:
    rng = np.random.default_rng(1)
    for _ in range(50):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        angle = rng.uniform(-np.pi, np.pi)
        np.testing.assert_allclose(rodrigues(axis, angle), pin.exp3(axis * angle), atol=1e-14)


def test_eqs_2_to_4_are_one_cross_product() -> None:
    rng = np.random.default_rng(4)
    axis, p, speed = rng.normal(size=3), rng.normal(size=3), 0.7
    np.testing.assert_allclose(cross_matrix(axis * speed), cross_matrix(axis) * speed, rtol=1e-15)
    np.testing.assert_allclose(cross_matrix(axis) @ p, np.cross(axis, p), atol=1e-15)


@each_leg
def test_rodrigues_chain_is_pinocchio_and_the_closed_form(frog: Quadruped, leg: str) -> None:
    """Eqs. (5), (6) with any pose of the body."""
    rng = np.random.default_rng(2011)
    model, data = frog.model, frog.model.createData()
    columns = list(frog.leg_columns[leg])
    for _ in range(50):
        q = pin.neutral(model)
        q[:3], q[3:7] = rng.normal(size=3), pin.Quaternion(pin.exp3(rng.normal(size=3))).coeffs()
        q[7:] = rng.uniform(model.lowerPositionLimit[7:], model.upperPositionLimit[7:])
        turn = pin.Quaternion(q[3:7]).matrix()
        pin.framesForwardKinematics(model, data, q)
        by_pinocchio = data.oMf[model.getFrameId(f"{leg}_FOOT")].translation
        angles = q[7:][columns]
        by_rodrigues = foot_by_eqs_5_and_6(leg, q[:3], turn, angles)
        ours = q[:3] + turn @ frog.legs[leg].forward(angles)
        np.testing.assert_allclose(by_rodrigues, by_pinocchio, rtol=0, atol=1e-9)
        np.testing.assert_allclose(by_rodrigues, ours, rtol=0, atol=1e-9)


@each_leg
def test_inverse_brings_every_angle_within_limits_back(frog: Quadruped, leg: str) -> None:
    """On the side where the foot is below the hip; the paper solves this numerically."""
    of = frog.legs[leg]
    rng = np.random.default_rng(7)
    bend = of.knee * rng.uniform(0.05, 2.4, 200)
    q = np.column_stack([-bend / 2 + rng.uniform(-0.7, 0.7, 200), bend])
    np.testing.assert_allclose(of.inverse(of.forward(q)), q, rtol=0, atol=1e-9)


# --- masses -------------------------------------------------------------------------------------


def test_efforts_hold_half_the_weight_on_one_foot(fixed: Any, frog: Quadruped) -> None:
    """Foot up to 0.30 m before or behind the hip, 0.50 to 0.76 m below; factor 1.5 to 2."""
    data, frame = fixed.createData(), fixed.getFrameId("RF_FOOT")
    start = fixed.joints[fixed.getJointId("RF_HFE")].idx_q
    part = slice(start, start + 2)
    worst = np.zeros(2)
    for x, z in itertools.product(np.linspace(-0.3, 0.3, 25), np.linspace(-0.76, -0.5, 14)):
        foot = np.array(HIPS["RF"]) + np.array([x, 0, z])
        if frog.legs["RF"].shortfall(foot) > 0:
            continue
        q = pin.neutral(fixed)
        q[part] = frog.legs["RF"].inverse(foot)
        jacobian = pin.computeFrameJacobian(fixed, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
        own_weight = pin.computeGeneralizedGravity(fixed, data, q)[part]
        worst = np.maximum(worst, abs(own_weight - jacobian[2, part] * WEIGHT / 2))
    factor = fixed.effortLimit[part] / worst
    assert np.all(factor > 1.5) and np.all(factor < 2)


# --- shapes -------------------------------------------------------------------------------------


@each_link
def test_shapes_are_primitives_in_named_colours(urdf: Any, link: str) -> None:
    colours = {m.name for m in urdf.robot.materials if m.color is not None}
    visuals, collisions = urdf.link_map[link].visuals, urdf.link_map[link].collisions
    assert visuals and collisions
    for shape in (*visuals, *collisions):
        geometry = shape.geometry
        assert any(kind is not None for kind in (geometry.box, geometry.cylinder, geometry.sphere))
    assert {v.material.name for v in visuals} <= colours


@each_leg
def test_foot_is_a_ball_around_the_foot_frame(frog: Quadruped, urdf: Any, leg: str) -> None:
    foot = urdf.link_map[f"{leg}_FOOT"]
    assert frog.foot_radius == BALL
    for shape in (*foot.visuals, *foot.collisions):
        assert shape.geometry.sphere.radius == BALL
        np.testing.assert_array_equal(placement(shape.origin), np.eye(4))
    (visual,) = foot.visuals
    assert visual.material.name.startswith(leg)


def test_no_leg_touches_another_or_the_body_in_the_stated_range(frog: Quadruped) -> None:
    """Left out are pairs within a leg, and the body with the upper legs that hang on it."""
    model = pin.buildModelFromUrdf(str(URDF))
    geometry = pin.buildGeomFromUrdf(model, str(URDF), pin.GeometryType.COLLISION)
    links = [model.frames[shape.parentFrame].name for shape in geometry.geometryObjects]
    for (i, one), (j, other) in itertools.combinations(enumerate(links), 2):
        mounted = "base" in (one, other) and "THIGH" in one + other
        if one.split("_")[0] != other.split("_")[0] and not mounted:
            geometry.addCollisionPair(pin.CollisionPair(i, j))
    data, placed = model.createData(), pin.GeometryData(geometry)
    rng = np.random.default_rng(2011)
    nearest = np.inf
    for _ in range(300):
        height = rng.uniform(0.55, 0.76)
        feet = {leg: np.array([rng.uniform(-0.25, 0.25), 0, -height]) for leg in LEGS}
        feet[LEGS[rng.integers(4)]][2] += rng.uniform(0, 0.20)
        feet = {leg: f * min(1.0, 0.7999 / np.linalg.norm(f)) for leg, f in feet.items()}
        q = pin.neutral(model)
        for name, angle in joints_for(frog, feet).items():
            q[model.joints[model.getJointId(name)].idx_q] = angle
        pin.updateGeometryPlacements(model, data, geometry, placed, q)
        pin.computeDistances(geometry, placed)
        nearest = min(nearest, *(r.min_distance for r in placed.distanceResults))
    assert nearest > 0.02, nearest


def test_mujoco_compiles_the_same_robot(frog: Quadruped, fixed: Any) -> None:
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(URDF))
    data, reader = mujoco.MjData(model), fixed.createData()
    assert model.njnt == 8
    rng = np.random.default_rng(0)
    for _ in range(5):
        q = rng.uniform(fixed.lowerPositionLimit, fixed.upperPositionLimit)
        for name, angle in zip(list(fixed.names)[1:], q, strict=True):
            data.joint(name).qpos = angle
        mujoco.mj_kinematics(model, data)
        pin.framesForwardKinematics(fixed, reader, q)
        for leg in LEGS:
            shank = data.body(f"{leg}_SHANK")
            foot = shank.xpos + shank.xmat.reshape(3, 3) @ [0, 0, -LINK]
            theirs = reader.oMf[fixed.getFrameId(f"{leg}_FOOT")].translation
            np.testing.assert_allclose(foot, theirs, rtol=0, atol=1e-12)
