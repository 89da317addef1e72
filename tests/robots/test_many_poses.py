"""Joints and shapes at many poses at once, against Pinocchio and its distances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt.robots.at_many_poses.boxes import ShapeBoxes
from gaitopt.robots.at_many_poses.chain import Chain
from gaitopt.robots.at_many_poses.four_legs import FourLegs
from gaitopt.robots.collisions.along_paths import path_touches
from gaitopt.robots.collisions.pairs import CollisionPairs
from gaitopt.robots.whole_body import feet_in_body, joints_from_feet_in_body

ROBOTS = ("wang2020", "a1", "anymal_c", "go2")


def poses(robot: gaitopt.Quadruped, count: int, seed: int = 0) -> np.ndarray:
    """Angles of all joints around those of standing ``(count, nj)`` [rad]."""
    random = np.random.default_rng(seed)
    standing = robot.standing_joints()
    return standing + random.normal(scale=0.5, size=(count, len(standing)))


@pytest.mark.parametrize("name", ROBOTS)
def test_joints_are_where_pinocchio_says(name: str) -> None:
    robot = gaitopt.load_robot(name)
    chain, joints = Chain.of(robot.model), poses(robot, 5)
    assert chain is not None
    rotations, places = chain.places(joints)
    data, q = robot.model.createData(), pin.neutral(robot.model)
    for k, angles in enumerate(joints):
        q[7:] = angles
        pin.forwardKinematics(robot.model, data, q)
        for i in range(1, robot.model.njoints):
            np.testing.assert_allclose(rotations[k, i], data.oMi[i].rotation, atol=1e-12)
            np.testing.assert_allclose(places[k, i], data.oMi[i].translation, atol=1e-12)


@pytest.mark.parametrize("name", [*ROBOTS, "laikago"])
@pytest.mark.parametrize("count", [1, 3, 400])
def test_four_legs_at_once_bend_as_each_by_itself(name: str, count: int) -> None:
    """To the last bit, also where a leg does not reach its foot, and for one pose alone."""
    robot, random = gaitopt.load_robot(name), np.random.default_rng(count)
    standing = feet_in_body(robot, robot.standing_joints())
    feet = standing + random.normal(scale=0.2, size=(count, 4, 3))
    for given in (feet, feet[0], standing):
        found = joints_from_feet_in_body(robot, given)
        for i, leg in enumerate(gaitopt.LEGS):
            own = robot.legs[leg].inverse(given[..., i, :])
            np.testing.assert_array_equal(found[..., list(robot.leg_columns[leg])], own)


def test_legs_that_differ_in_kind_are_bent_one_after_the_other() -> None:
    legs = [gaitopt.load_robot(name).legs["LF"] for name in ("a1", "wang2020")]
    assert FourLegs.of([*legs, *legs]) is not None
    assert FourLegs.of([legs[0], replace(legs[1], joints=legs[1].joints[1:])]) is None


@pytest.mark.parametrize("name", ROBOTS)
def test_no_pair_is_closer_than_its_boxes_or_balls(name: str) -> None:
    robot = gaitopt.load_robot(name)
    pairs, joints = CollisionPairs.of(robot), poses(robot, 12)
    assert pairs is not None
    boxes = ShapeBoxes.of(pairs.model, pairs.geometry)
    assert boxes is not None
    distances = pairs.distances(joints[:, pairs.columns]).min(axis=0)
    for enough, close in ((np.inf, 0.0), (0.05, 0.0), (np.inf, np.inf), (0.05, 0.02)):
        least = boxes.least_gaps(joints, pairs._numbers, enough, close)
        # Where shapes overlap, the distance is the negative depth, and the bound says nothing.
        assert (least <= np.maximum(distances, 0.0) + 1e-6).all()
        assert (least > 0.0).any()


def test_rods_that_cross_are_apart_across_both() -> None:
    """Neither box has an axis along which two crossing rods are apart; their distance is known."""
    text = (
        '<robot name="rods"><link name="a"><collision><geometry><cylinder radius="0.01" '
        'length="0.4"/></geometry></collision></link><link name="b"><collision>'
        '<origin xyz="0 0.05 0" rpy="0 1 0"/><geometry><box size="0.02 0.02 0.4"/></geometry>'
        '</collision></link><joint name="j" type="revolute"><parent link="a"/><child link="b"/>'
        '<axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>'
    )
    model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    shapes = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    boxes = ShapeBoxes.of(model, shapes)
    assert boxes is not None
    # Turned by minus a radian, the rods are parallel, and their sides tell how far they are apart.
    for angle in (0.0, 0.7, -1.0):
        (gap,) = boxes.least_gaps(np.array([[angle]]), np.array([[0, 1]]), close=np.inf)
        assert gap == pytest.approx(0.03, abs=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_what_is_up_is_what_places_say(name: str) -> None:
    robot = gaitopt.load_robot(name)
    chain, joints = Chain.of(robot.model), poses(robot, 9)
    assert chain is not None
    up = np.random.default_rng(1).normal(size=(3, 9))
    ups, heights = chain.ups(joints, up)
    rotations, places = chain.rows_of_places(joints)
    np.testing.assert_allclose(ups, np.einsum("ijkn,in->jkn", rotations, up), atol=1e-12)
    np.testing.assert_allclose(heights, np.einsum("ikn,in->kn", places, up), atol=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_a_path_touches_where_the_distance_of_any_pair_says_so(name: str) -> None:
    robot = gaitopt.load_robot(name)
    pairs = CollisionPairs.of(robot)
    assert pairs is not None
    found = []
    for seed in range(12):
        # At fewer than twice 50 poses all pairs are looked at at all of them.
        joints = robot.standing_joints() + (seed / 6.0) * (
            poses(robot, 1, seed) - robot.standing_joints()
        ) * np.linspace(0.0, 1.0, 30)[:, None]  # fmt: skip
        touches = bool((pairs.distances(joints[:, pairs.columns]) < 2e-4).any())
        assert path_touches(robot, joints) == touches
        found.append(touches)
    assert True in found and False in found


def test_a_short_touch_is_found_with_enough_looks_at_all_pairs() -> None:
    """Two legs cross for a hundredth of a long path, between two of fifty looks at all pairs."""
    robot = gaitopt.load_robot("wang2020")
    pairs, count = CollisionPairs.of(robot), 20_000
    assert pairs is not None
    away = np.zeros(count)
    away[5300:5500] = np.sin(np.linspace(0.0, np.pi, 200)) ** 2
    standing = robot.standing_joints()
    front, hind = (robot.leg_columns[leg][1] for leg in ("LF", "LH"))
    joints = np.tile(standing, (count, 1))
    joints[:, front] -= 1.6 * away
    joints[:, hind] += 1.6 * away
    assert (pairs.distances(joints[5400:5401, pairs.columns]) < 0.0).any()
    assert not path_touches(robot, joints)
    assert path_touches(robot, joints, 400)


def test_a_sliding_joint_has_no_chain() -> None:
    model = pin.buildModelFromXML(
        '<robot name="slide"><link name="a"/><link name="b"/>'
        '<joint name="j" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>'
        '<limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>',
        pin.JointModelFreeFlyer(),
    )
    assert Chain.of(model) is None
