"""The robot of [Wang2020]: what its URDF says must be what the paper says, and possible."""

from __future__ import annotations

import colorsys
import itertools
import math
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gaitopt.robots.catalog import load_robot

pin = pytest.importorskip("pinocchio")
yourdfpy = pytest.importorskip("yourdfpy")

URDF = Path(__file__).parents[2] / "urdf" / "wang2020.urdf"
LEGS = ("LF", "LH", "RH", "RF")
HIPS = {"LF": (0.2, 0.15, 0), "LH": (-0.2, 0.15, 0), "RH": (-0.2, -0.15, 0), "RF": (0.2, -0.15, 0)}
UPPER, LOWER = 0.30, 0.27
WEIGHT = 25 * 9.81
LEG_LINKS = ("HIP", "THIGH", "SHANK", "FOOT")
LINKS = ("base", *(f"{leg}_{part}" for leg in LEGS for part in LEG_LINKS))
CRANK = {"LF": 0.090, "RF": -0.090, "LH": -0.044, "RH": 0.044}  # upper leg beside the hip's plane
LEAN = math.radians(8)  # front leg may lean this much further inward than its hind neighbour
HUES = {"LF": 0, "RF": 220, "LH": 50, "RH": 130}  # degrees: red, blue, yellow, green

each_leg = pytest.mark.parametrize("leg", LEGS)
each_link = pytest.mark.parametrize("link", LINKS)


@pytest.fixture(scope="module")
def fixed() -> Any:
    """The robot with its body held at the origin."""
    return pin.buildModelFromUrdf(str(URDF))


@pytest.fixture(scope="module")
def floating() -> Any:
    """The robot with a free body."""
    return pin.buildModelFromUrdf(str(URDF), pin.JointModelFreeFlyer())


@pytest.fixture(scope="module")
def urdf() -> Any:
    """The robot as yourdfpy reads it."""
    return yourdfpy.URDF.load(str(URDF))


def is_front(leg: str) -> bool:
    return leg.endswith("F")


def leg_slice(model: Any, leg: str) -> slice:
    """Where the angles HAA, HFE, KFE of a leg are in the configuration."""
    start = model.joints[model.getJointId(f"{leg}_HAA")].idx_q
    return slice(start, start + 3)


def leg_angles(leg: str, foot: np.ndarray) -> np.ndarray:
    """HAA, HFE, KFE for a foot position seen from the hip, by the law of cosines."""
    x, y, z = foot
    drop = math.hypot(y, z)
    cosine = (x**2 + drop**2 - UPPER**2 - LOWER**2) / (2 * UPPER * LOWER)
    knee = math.acos(cosine) * (-1 if is_front(leg) else 1)
    bend = math.atan2(LOWER * math.sin(knee), UPPER + LOWER * math.cos(knee))
    return np.array([math.atan2(y, -z), math.atan2(-x, drop) - bend, knee])


def feet_below_hips(height: float) -> dict[str, np.ndarray]:
    """Where the feet are, seen from their hips, when they stand right below them."""
    return {leg: np.array([0.0, 0.0, -height]) for leg in LEGS}


def walking_state(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Feet seen from their hips: each on its own in the range the URDF's header states."""
    height = rng.uniform(0.35, 0.45)
    feet = {
        leg: np.array([rng.uniform(-0.12, 0.12), rng.uniform(-0.10, 0.10), -height]) for leg in LEGS
    }
    feet[LEGS[rng.integers(4)]][2] += rng.uniform(0, 0.07)
    return feet


def inward_lean(feet: dict[str, np.ndarray]) -> float:
    """How much further inward a front leg leans than the hind leg of its side, at most."""
    roll = {leg: math.atan2(y, -z) for leg, (_, y, z) in feet.items()}
    return max(roll["LH"] - roll["LF"], roll["RF"] - roll["RH"])


def mirrored(feet: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    swap = {"L": "R", "R": "L"}
    return {swap[leg[0]] + leg[1]: foot * [1, -1, 1] for leg, foot in feet.items()}


def frame_positions(model: Any, q: np.ndarray) -> dict[str, np.ndarray]:
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return {f.name: m.translation.copy() for f, m in zip(model.frames, data.oMf, strict=True)}


def random_configurations(model: Any, count: int) -> list[np.ndarray]:
    rng = np.random.default_rng(2020)
    low, high = model.lowerPositionLimit, model.upperPositionLimit
    return [rng.uniform(low, high) for _ in range(count)]


def placement(origin: np.ndarray | None) -> np.ndarray:
    return np.eye(4) if origin is None else origin


class Clearances:
    """Distances of collision shapes of different legs, and of legs and body.

    Left out are pairs within a leg, and the body with the hip motors that are mounted on it.
    """

    def __init__(self) -> None:
        self.robot = load_robot(URDF)
        self.model = pin.buildModelFromUrdf(str(URDF))
        self.geometry = pin.buildGeomFromUrdf(self.model, str(URDF), pin.GeometryType.COLLISION)
        shapes = self.geometry.geometryObjects
        links = [self.model.frames[shape.parentFrame].name for shape in shapes]
        self.pairs = []
        for (i, one), (j, other) in itertools.combinations(enumerate(links), 2):
            owners = {one.split("_")[0], other.split("_")[0]}
            mounted = "base" in owners and (one.endswith("HIP") or other.endswith("HIP"))
            if len(owners) == 2 and not mounted:
                self.geometry.addCollisionPair(pin.CollisionPair(i, j))
                self.pairs.append((owners, shapes[i].name, shapes[j].name))
        self.data, self.results = self.model.createData(), pin.GeometryData(self.geometry)

    def distances(self, feet: dict[str, np.ndarray]) -> np.ndarray:
        """One distance a pair; negative where shapes are in one another."""
        q = pin.neutral(self.model)
        for leg, foot in feet.items():
            q[leg_slice(self.model, leg)] = self.robot.legs[leg].inverse(HIPS[leg] + foot)
        assert np.all(q >= self.model.lowerPositionLimit)
        assert np.all(q <= self.model.upperPositionLimit)
        pin.updateGeometryPlacements(self.model, self.data, self.geometry, self.results, q)
        pin.computeDistances(self.geometry, self.results)
        return np.array([result.min_distance for result in self.results.distanceResults])

    def front_with_hind_of_a_side(self) -> np.ndarray:
        return np.array([owners in ({"LF", "LH"}, {"RF", "RH"}) for owners, *_ in self.pairs])

    def with_the_body(self) -> np.ndarray:
        return np.array(["base" in owners for owners, *_ in self.pairs])

    def touching(self, feet: dict[str, np.ndarray], which: np.ndarray) -> list[tuple[str, str]]:
        """Names of the shapes among ``which`` pairs that touch."""
        hits = np.flatnonzero((self.distances(feet) <= 0) & which)
        return [self.pairs[hit][1:] for hit in hits]


@pytest.fixture(scope="module")
def clearances() -> Clearances:
    return Clearances()


# --- the file ---------------------------------------------------------------------------------


def test_file_stands_alone() -> None:
    text = URDF.read_text(encoding="utf-8")
    assert "<!DOCTYPE" not in text
    assert "BSD-2-Clause" in text
    root = ET.fromstring(text)
    assert not list(root.iter("mesh"))
    assert not [e.tag for e in root.iter() if "filename" in e.attrib]


def test_links_and_joints_have_the_expected_names(urdf: Any) -> None:
    assert sorted(urdf.link_map) == sorted(LINKS)
    assert urdf.base_link == "base"
    joints = {f"{leg}_{joint}" for leg in LEGS for joint in ("HAA", "HFE", "KFE")}
    assert set(urdf.actuated_joint_names) == joints


# --- geometry and joints ----------------------------------------------------------------------


@each_leg
def test_straight_legs_hang_down_from_hips_at_the_corners(fixed: Any, leg: str) -> None:
    at = frame_positions(fixed, pin.neutral(fixed))
    hip = np.array(HIPS[leg])
    np.testing.assert_allclose(at[f"{leg}_HIP"], hip, rtol=0, atol=1e-15)
    np.testing.assert_allclose(at[f"{leg}_SHANK"], hip - [0, 0, UPPER], rtol=0, atol=1e-15)
    np.testing.assert_allclose(at[f"{leg}_FOOT"], hip - [0, 0, UPPER + LOWER], rtol=0, atol=1e-15)


@each_leg
def test_hip_axes_meet_in_one_point_and_segments_keep_their_lengths(fixed: Any, leg: str) -> None:
    for q in random_configurations(fixed, 20):
        at = frame_positions(fixed, q)
        hip, knee, foot = (at[f"{leg}_{name}"] for name in ("THIGH", "SHANK", "FOOT"))
        np.testing.assert_allclose(hip, HIPS[leg], rtol=0, atol=1e-15)
        assert np.linalg.norm(knee - hip) == pytest.approx(UPPER, abs=1e-12)
        assert np.linalg.norm(foot - knee) == pytest.approx(LOWER, abs=1e-12)


@each_leg
def test_joints_turn_about_the_stated_axes_within_the_stated_limits(urdf: Any, leg: str) -> None:
    knee = (-2.8, 0) if is_front(leg) else (0, 2.8)
    expected = {
        "HAA": ([1, 0, 0], (-1.5707963, 1.5707963)),
        "HFE": ([0, 1, 0], (-3.1415926, 3.1415926)),
        "KFE": ([0, 1, 0], knee),
    }
    for name, (axis, limits) in expected.items():
        joint = urdf.joint_map[f"{leg}_{name}"]
        assert joint.type == "revolute"
        np.testing.assert_array_equal(joint.axis, axis)
        assert (joint.limit.lower, joint.limit.upper) == limits
        assert joint.limit.velocity == math.radians(17)


@each_leg
def test_positive_pitch_swings_the_leg_backward(fixed: Any, leg: str) -> None:
    q = pin.neutral(fixed)
    q[leg_slice(fixed, leg)] = [0, 0.3, 0]
    foot = frame_positions(fixed, q)[f"{leg}_FOOT"]
    assert foot[0] == pytest.approx(HIPS[leg][0] - (UPPER + LOWER) * math.sin(0.3), abs=1e-12)


@pytest.mark.parametrize("height", [0.3, 0.4, 0.5])
@pytest.mark.parametrize("offset", [-0.1, 0.0, 0.1])
@each_leg
def test_front_knees_point_backward_and_hind_knees_forward(
    fixed: Any, leg: str, offset: float, height: float
) -> None:
    q = pin.neutral(fixed)
    q[leg_slice(fixed, leg)] = leg_angles(leg, np.array([offset, 0.05, -height]))
    assert np.all(q >= fixed.lowerPositionLimit) and np.all(q <= fixed.upperPositionLimit)
    at = frame_positions(fixed, q)
    hip, knee, foot = (at[f"{leg}_{name}"] for name in ("HIP", "SHANK", "FOOT"))
    np.testing.assert_allclose(foot - hip, [offset, 0.05, -height], rtol=0, atol=1e-12)
    on_line = hip + (foot - hip) * (knee - hip)[2] / (foot - hip)[2]
    ahead = knee[0] - on_line[0]
    assert ahead < -0.05 if is_front(leg) else ahead > 0.05


# --- masses -----------------------------------------------------------------------------------


def test_robot_weighs_25_kg(floating: Any, urdf: Any) -> None:
    assert floating.nq == 19 and floating.nv == 18
    assert pin.computeTotalMass(floating) == pytest.approx(25, rel=0, abs=1e-12)
    total = sum(link.inertial.mass for link in urdf.link_map.values())
    assert total == pytest.approx(25, rel=0, abs=1e-12)


@each_leg
def test_legs_weigh_3_kg(urdf: Any, leg: str) -> None:
    total = sum(urdf.link_map[f"{leg}_{part}"].inertial.mass for part in LEG_LINKS)
    assert total == pytest.approx(3, rel=0, abs=1e-12)


@each_leg
def test_efforts_hold_half_the_weight_on_one_foot(fixed: Any, leg: str) -> None:
    """Hip 0.40 m high, foot anywhere within reach; the safety factor is 1.5 to 2."""
    part, height = leg_slice(fixed, leg), 0.40
    reach = math.sqrt((UPPER + LOWER) ** 2 - height**2)
    data, frame = fixed.createData(), fixed.getFrameId(f"{leg}_FOOT")
    worst = np.zeros(3)
    for radius in np.linspace(0, 0.999 * reach, 20):
        for bearing in np.linspace(0, 2 * np.pi, 32, endpoint=False):
            foot = np.array([radius * np.cos(bearing), radius * np.sin(bearing), -height])
            q = pin.neutral(fixed)
            q[part] = leg_angles(leg, foot)
            jacobian = pin.computeFrameJacobian(fixed, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
            own_weight = pin.computeGeneralizedGravity(fixed, data, q)[part]
            worst = np.maximum(worst, abs(own_weight - jacobian[2, part] * WEIGHT / 2))
    factor = fixed.effortLimit[part] / worst
    assert np.all(factor > 1.5) and np.all(factor < 2)


# --- shapes -----------------------------------------------------------------------------------


@each_link
def test_shapes_are_primitives_in_named_colours(urdf: Any, link: str) -> None:
    named = urdf.robot.materials
    colours = {m.name for m in named if m.color is not None}
    visuals, collisions = urdf.link_map[link].visuals, urdf.link_map[link].collisions
    assert visuals and collisions
    for shape in (*visuals, *collisions):
        geometry = shape.geometry
        assert any(kind is not None for kind in (geometry.box, geometry.cylinder, geometry.sphere))
    assert {v.material.name for v in visuals} <= colours


def test_front_of_the_body_is_marked(urdf: Any) -> None:
    marks = [v for v in urdf.link_map["base"].visuals if v.material.name == "front_white"]
    assert marks
    assert all(placement(m.origin)[0, 3] - m.geometry.box.size[0] / 2 > 0 for m in marks)


@each_leg
def test_foot_is_a_ball_around_the_foot_frame(urdf: Any, leg: str) -> None:
    foot = urdf.link_map[f"{leg}_FOOT"]
    assert len(foot.visuals) == len(foot.collisions) == 1
    for shape in (*foot.visuals, *foot.collisions):
        assert shape.geometry.sphere.radius == 0.015
        np.testing.assert_array_equal(placement(shape.origin), np.eye(4))


@each_leg
def test_foot_wears_the_colour_of_its_leg(urdf: Any, leg: str) -> None:
    (foot,) = urdf.link_map[f"{leg}_FOOT"].visuals
    colours = {m.name: m.color.rgba for m in urdf.robot.materials}
    hue, saturation, _ = colorsys.rgb_to_hsv(*colours[foot.material.name][:3])
    away = (360 * hue - HUES[leg] + 180) % 360 - 180
    assert abs(away) < 20 and saturation > 0.5


@each_leg
def test_upper_leg_and_knee_motor_stand_beside_the_plane_of_hip_and_foot(
    urdf: Any, leg: str
) -> None:
    outward = CRANK[leg] * HIPS[leg][1] > 0
    assert outward is is_front(leg)
    for shapes in (urdf.link_map[f"{leg}_THIGH"].visuals, urdf.link_map[f"{leg}_THIGH"].collisions):
        centres = np.array([shape.origin[:3, 3] for shape in shapes])
        np.testing.assert_array_equal(centres[:, :2], [[0, CRANK[leg]]] * len(shapes))
        assert centres[:, 2].min() == -UPPER


@each_leg
def test_lower_leg_runs_from_the_knee_motor_to_the_foot(urdf: Any, leg: str) -> None:
    knee, foot = np.array([0, CRANK[leg], 0]), np.array([0, 0, -LOWER])
    along = (knee - foot) / np.linalg.norm(knee - foot)
    link = urdf.link_map[f"{leg}_SHANK"]
    for shape in (*link.visuals, *link.collisions):
        np.testing.assert_allclose(shape.origin[:3, 2], along, rtol=0, atol=1e-8)
        np.testing.assert_allclose(np.cross(shape.origin[:3, 3] - foot, along), 0, atol=1e-8)
    (tube,) = link.collisions
    middle, half = (tube.origin[:3, 3] - foot) @ along, tube.geometry.cylinder.length / 2
    motor = urdf.link_map[f"{leg}_THIGH"].collisions[-1].geometry.cylinder
    assert middle - half < 0.015  # begins within the foot's ball
    assert 0 < np.linalg.norm(knee - foot) - (middle + half) < motor.radius
    inertia = link.inertial.inertia
    assert np.sign(inertia[1, 2]) == -np.sign(CRANK[leg])


@each_leg
def test_hip_motor_reaches_from_the_hip_to_the_upper_leg(urdf: Any, leg: str) -> None:
    (motor,) = urdf.link_map[f"{leg}_HIP"].collisions
    hub = urdf.link_map[f"{leg}_THIGH"].collisions[0]
    np.testing.assert_allclose(np.abs(motor.origin[:3, 2]), [0, 1, 0], rtol=0, atol=1e-12)
    middle, half = motor.origin[1, 3], motor.geometry.cylinder.length / 2
    ends = np.array([middle - half, middle + half])
    assert ends[0] < 0 < ends[1]
    face = CRANK[leg] - math.copysign(hub.geometry.cylinder.length / 2, CRANK[leg])
    assert np.min(np.abs(ends - face)) < 1e-12


def test_no_leg_touches_another_or_the_body_while_walking(clearances: Clearances) -> None:
    rng = np.random.default_rng(2020)
    everything, free = np.full(len(clearances.pairs), True), 0
    while free < 300:
        feet = walking_state(rng)
        if inward_lean(feet) <= LEAN:
            assert not clearances.touching(feet, everything), feet
            free += 1


def test_only_front_and_hind_leg_of_a_side_can_ever_touch(clearances: Clearances) -> None:
    """The same range without the condition on roll."""
    rng = np.random.default_rng(2021)
    others, touched = ~clearances.front_with_hind_of_a_side(), 0
    for _ in range(300):
        feet = walking_state(rng)
        distances = clearances.distances(feet)
        assert np.all(distances[others] > 0), feet
        touched += bool(np.any(distances <= 0))
    assert 0 < touched / 300 < 0.10


# Corners of the stated range; the first two came out nearest when it was searched [m].
NEAREST = {
    "front shank and hind knee motor, 8 degrees": (
        {"LF": (-0.120, -0.023, -0.28), "LH": (-0.014, 0.019, -0.35)},
        0.003,
    ),
    "hind knee motors": ({"LH": (-0.12, -0.10, -0.28), "RH": (-0.12, 0.10, -0.35)}, 0.003),
    "feet of a side close together": ({"LF": (-0.12, 0, -0.35), "LH": (0.12, 0, -0.35)}, 0.008),
    "feet of all legs inward": (
        {
            "LF": (0, -0.1, -0.35),
            "LH": (0, -0.1, -0.35),
            "RH": (0, 0.1, -0.35),
            "RF": (0, 0.1, -0.35),
        },
        0.005,
    ),
}


@pytest.mark.parametrize("case", NEAREST)
def test_nearest_walking_states_are_free(clearances: Clearances, case: str) -> None:
    special, least = NEAREST[case]
    feet = feet_below_hips(0.35) | {leg: np.array(foot) for leg, foot in special.items()}
    for state in (feet, mirrored(feet)):
        assert inward_lean(state) <= LEAN + 1e-9
        assert clearances.distances(state).min() > least


def test_front_leg_leaning_far_inside_its_hind_neighbour_touches_it(
    clearances: Clearances,
) -> None:
    """What the header warns of: 12 degrees instead of 8."""
    feet = feet_below_hips(0.35)
    feet["LF"], feet["LH"] = np.array([-0.12, -0.10, -0.28]), np.array([-0.02, -0.05, -0.35])
    assert math.radians(10) < inward_lean(feet) < math.radians(12)
    for state in (feet, mirrored(feet)):
        touching = clearances.touching(state, clearances.front_with_hind_of_a_side())
        assert touching


@pytest.mark.parametrize("height", [0.35, 0.40, 0.45])
@pytest.mark.parametrize("roll", [-20, 0, 20])
def test_legs_stay_clear_of_the_body_and_each_other_when_rolled(
    clearances: Clearances, roll: float, height: float
) -> None:
    """All to one side; or all inward or outward, where only the body is in question."""
    aside = height * math.tan(math.radians(roll))
    alike = feet_below_hips(height)
    for foot in alike.values():
        foot[1] = aside
    inward = {leg: foot * [1, np.sign(HIPS[leg][1]), 1] for leg, foot in alike.items()}
    assert clearances.distances(alike).min() > 0.008
    assert clearances.distances(inward)[clearances.with_the_body()].min() > 0.008


# --- other readers ----------------------------------------------------------------------------


def test_yourdfpy_and_pinocchio_agree_on_the_feet(fixed: Any, urdf: Any) -> None:
    names = list(fixed.names)[1:]
    for q in random_configurations(fixed, 20):
        urdf.update_cfg(dict(zip(names, q, strict=True)))
        at = frame_positions(fixed, q)
        for leg in LEGS:
            foot = urdf.get_transform(f"{leg}_FOOT", "base")[:3, 3]
            np.testing.assert_allclose(foot, at[f"{leg}_FOOT"], rtol=0, atol=1e-12)


def test_mujoco_compiles_the_same_robot(fixed: Any) -> None:
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_path(str(URDF))
    data = mujoco.MjData(model)
    assert model.njnt == 12
    assert sum(model.body_mass) == pytest.approx(12)  # MuJoCo welds the body to the world
    for q in random_configurations(fixed, 5):
        for name, angle in zip(list(fixed.names)[1:], q, strict=True):
            data.joint(name).qpos = angle
        mujoco.mj_kinematics(model, data)
        at = frame_positions(fixed, q)
        for leg in LEGS:
            shank = data.body(f"{leg}_SHANK")
            foot = shank.xpos + shank.xmat.reshape(3, 3) @ [0, 0, -LOWER]
            np.testing.assert_allclose(foot, at[f"{leg}_FOOT"], rtol=0, atol=1e-12)
