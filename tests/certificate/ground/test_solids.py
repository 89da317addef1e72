"""What of a robot is held against the ground, where it is, and pillars as the ground."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from pinocchio import coal
from robot_loading import quiet
from robot_texts import LOWER, collision, robot
from scipy.spatial import ConvexHull

import gaitopt
from gaitopt import LEGS, Quadruped
from gaitopt.certificate.ground.pillars import Pillars
from gaitopt.certificate.ground.solids import FOOT_SHARE, Solid, Solids, _slabs
from gaitopt.certificate.placements import Placements, configurations, placement_of


def test_places_are_those_of_pinocchio(wang: Quadruped) -> None:
    values = np.random.default_rng(0).normal(size=(20, 6 + len(wang.joint_names)))
    placed, data = Placements.of(wang.model, values), wang.model.createData()
    for row, q in zip(values, configurations(values), strict=True):
        k = int(np.flatnonzero((values == row).all(axis=1))[0])
        pin.forwardKinematics(wang.model, data, q)
        for joint in range(1, wang.model.njoints):
            np.testing.assert_allclose(
                placed.rotations[joint][k], data.oMi[joint].rotation, atol=1e-12
            )
            np.testing.assert_allclose(
                placed.origins[joint][k], data.oMi[joint].translation, atol=1e-12
            )
        turn, origin = placement_of(wang.model, data, row, 4)
        np.testing.assert_allclose(turn, placed.rotations[4][k], atol=1e-12)
        np.testing.assert_allclose(origin, placed.origins[4][k], atol=1e-12)


def test_slabs_of_a_hull_make_up_the_whole() -> None:
    corners = np.random.default_rng(1).normal(size=(60, 3)) * [0.02, 0.02, 0.12]
    slabs = _slabs(corners, 2, 4)
    volumes = [ConvexHull(slab).volume for slab in slabs]
    assert sum(volumes) == pytest.approx(ConvexHull(corners).volume, rel=1e-9)


@pytest.mark.parametrize("shape", [
    coal.Box(0.02, 0.3, 0.03), coal.Cylinder(0.01, 0.25), coal.Capsule(0.02, 0.2),
])  # fmt: skip
def test_parts_of_a_shape_come_as_low_as_the_whole(shape: object, wang: Quadruped) -> None:
    """Lowest points of whole and parts, for many directions of "down"."""
    from gaitopt.certificate.ground.solids import _parts

    place = pin.SE3(pin.rpy.rpyToMatrix(0.3, -0.5, 1.0), np.array([0.1, 0.2, 0.3]))
    floor = coal.Halfspace(np.array([0.0, 0.0, 1.0]), -5.0)

    def lowest(solid: Solid, turn: np.ndarray) -> float:
        return float(coal.distance(
            solid.shape, solid.transform(turn, np.zeros(3)), floor, coal.Transform3s(),
            coal.DistanceRequest(), coal.DistanceResult(),
        ))  # fmt: skip

    parts = _parts("link", 1, shape, place)
    whole = Solid.of("link", 1, shape, place)
    assert len(parts) == (1 if isinstance(shape, coal.Capsule) else 4)
    for turn in (pin.rpy.rpyToMatrix(a, b, 0.0) for a in (0.0, 1.0, 2.5) for b in (0.3, -1.2)):
        assert min(lowest(p, turn) for p in parts) == pytest.approx(lowest(whole, turn), abs=1e-6)


@pytest.mark.parametrize("name", ["wang2020", "a1", "go2", "anymal", "hyq"])
def test_all_but_the_foot_counts(name: str) -> None:
    """Every leg has its shank, and nothing that counts lies within the foot."""
    robot = gaitopt.load_robot(name)
    solids = Solids.of(robot)
    for leg in LEGS:
        frame = robot.model.frames[robot.model.getFrameId(robot.legs[leg].foot)]
        shank = [p for p in solids.parts if p.joint == frame.parentJoint]
        assert shank
        for part in shank:
            away = np.linalg.norm(part.corners - frame.placement.translation, axis=1).max()
            assert away > FOOT_SHARE * robot.foot_radius
    assert {p.joint for p in solids.parts} >= set(range(1, robot.model.njoints)) - {0}


def test_lines_stand_for_meshes_without_hulls_and_end_at_the_foot(wang: Quadruped) -> None:
    """A line as thick as the foot would touch the ground of itself, where the foot stands."""
    import re

    text = re.sub(r"<geometry>\s*<cylinder[^>]*/>\s*</geometry>",
                  '<geometry><mesh filename="gone.stl"/></geometry>', wang.urdf)  # fmt: skip
    robot = Quadruped.from_urdf(text, "meshed")
    solids = Solids.of(robot)
    assert "LF_SHANK" in solids.stand_ins and not solids.hulls
    frame = robot.model.frames[robot.model.getFrameId(robot.legs["LF"].foot)]
    (line,) = [p for p in solids.parts if p.joint == frame.parentJoint]
    foot = frame.placement.translation
    for lean in (0.1, 0.8, 1.4):
        turn = pin.rpy.rpyToMatrix(0.0, lean, 0.0)
        floor = coal.Halfspace(
            np.array([0.0, 0.0, 1.0]), float((turn @ foot)[2]) - robot.foot_radius
        )
        gap = coal.distance(
            line.shape, line.transform(turn, np.zeros(3)), floor, coal.Transform3s(),
            coal.DistanceRequest(), coal.DistanceResult(),
        )  # fmt: skip
        assert gap == pytest.approx(robot.foot_radius * np.cos(lean), abs=1e-6)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=30)
def test_distances_to_pillars_are_those_of_coal(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tops = rng.uniform([0.0, 0.0, 0.0], [0.3, 0.3, 0.1], (6, 3))
    pillars = Pillars(tops, 0.02)
    points = rng.uniform([-0.1, -0.1, -0.1], [0.4, 0.4, 0.2], (20, 3))
    found = pillars.distances(points, 10.0)
    ball = Solid.of("ball", 1, coal.Sphere(1e-4), pin.SE3.Identity())
    for point, distance in zip(points, found, strict=True):
        if distance > 1e-3:
            gap = pillars.gap(ball, np.eye(3), point)
            assert gap + 1e-4 == pytest.approx(distance, abs=2e-6)
        inside = (np.hypot(*(tops[:, :2] - point[:2]).T) < 0.02) & (point[2] < tops[:, 2])
        assert (distance < 0.0) == inside.any()


def test_pillars_stand_under_the_balls_of_feet() -> None:
    columns = gaitopt.s_columns(0, columns=2)
    pillars = Pillars.of(columns, 0.015)
    assert pillars.top == pytest.approx(-0.015)
    assert len(pillars.tops) == 8 and pillars.radius == 0.02
    x, y = columns["LF"][0, :2]

    def highest(low: float, high: float) -> float:
        corners = np.array([[x + low, y - 0.001]]), np.array([[x + high, y + 0.001]])
        return float(pillars.highest(*corners)[0])

    assert highest(0.019, 0.03) == pytest.approx(-0.015)
    assert highest(0.021, 0.03) == -np.inf


def test_an_end_of_a_leg_that_is_wider_than_its_ball_names_the_cure(tmp_path: Path) -> None:
    """A cylinder's rim comes into the ground where the leg leans; a larger ball holds it.

    Such a ball is taken where no radius is given.
    """
    shank = trimesh.creation.cylinder(radius=0.02, height=LOWER)
    shank.apply_translation([0.0, 0.0, -LOWER / 2])
    shank.export(tmp_path / "shank.stl")
    file = tmp_path / "tester.urdf"
    file.write_text(robot(foot=None, shank=collision('<mesh filename="shank.stl"/>')))
    outcomes = {}
    (told,) = [text for text in quiet(file).notes.warnings if "is wider than the ball" in text]
    ball = float(told.split("give foot_radius=")[1].split()[0])
    for radius in (ball, None):
        made = quiet(file, foot_radius=radius)
        plan = gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=2, robot=made))
        (check,) = [c for c in gaitopt.verify(plan).checks if c.name.startswith("legs and trunk")]
        outcomes[radius] = check
    assert outcomes[ball].status == "violated" and "foot_radius=" in outcomes[ball].where
    assert outcomes[None].status != "violated" and "foot_radius=" not in outcomes[None].where
