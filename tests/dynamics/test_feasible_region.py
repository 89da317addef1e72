"""Where a robot can stand: closed forms, symmetries, and brute force by another formulation."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from scipy.spatial.transform import Rotation

import gaitopt
from gaitopt import Quadruped
from gaitopt.conventions import GRAVITY, LEGS, FloatArray, rotation_z
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.feasible_region import feasible_region, feasible_regions
from gaitopt.dynamics.region.result import FeasibleRegion, RegionStatus
from gaitopt.dynamics.torque_limits import effort_limits
from gaitopt.errors import InputError
from gaitopt.robots.whole_body import base_of_body, configuration, joints_from_feet
from gaitopt.stability.support import support_half_planes

THREE = ("LF", "LH", "RH")
FREE = ForceLimits(friction=0.5, reserve=0.0)
COMMON = ForceLimits(friction=0.5, reserve=0.05, torque_share=0.8)


@cache
def loaded(name: str) -> Quadruped:
    """A robot, read once."""
    return gaitopt.load_robot(name)


def own_stance(robot: Quadruped, heights: object = 0.0) -> FloatArray:
    """Foot frames straight below the hips `(4, 3)`, the body's middle over the origin."""
    legs = [robot.legs[name] for name in LEGS]
    feet = np.array([leg.hip + leg.axes[:, 1] * leg.lateral for leg in legs]) - robot.centre
    feet[:, 2] = heights
    return feet


def shares_area(region: FeasibleRegion, robot: Quadruped, feet: FloatArray) -> float:
    """Area of the region as a share of the support polygon."""
    whole = feasible_region(robot, feet, limits=FREE, support=region.legs, torques=False)
    return region.area / whole.area


def same_polygon(first: FloatArray, second: FloatArray, tolerance: float) -> bool:
    """Whether both have the same corners, wherever their order starts."""
    apart = np.linalg.norm(first[:, None] - second, axis=-1)
    return len(first) == len(second) and bool((apart.min(axis=1) <= tolerance).all())


# --- another formulation ----------------------------------------------------------------------


class Rows(NamedTuple):
    """Inequalities `A f <= b` of all forces [N]."""

    matrix: FloatArray
    bounds: FloatArray


def raw_rows(
    robot: Quadruped,
    feet: FloatArray,
    normals: FloatArray,
    limits: ForceLimits,
    support: tuple[str, ...],
    posture: FloatArray | None,
) -> tuple[FloatArray, Rows]:
    """Contact points `(m, 3)`, and what is asked of the forces, written another way.

    Tangents by SciPy's rotations, Jacobians by Pinocchio's frames.
    """
    weight = robot.mass * GRAVITY
    chosen = [LEGS.index(leg) for leg in support]
    share = limits.reserve if len(chosen) < 4 else limits.reserve / 2.0
    points, blocks, bounds = [], [], []
    if posture is not None:
        joints = joints_from_feet(robot, posture[:3], posture[3:], feet)
        q = configuration(robot, posture[:3], posture[3:], joints)
        data = robot.model.createData()
        pin.computeJointJacobians(robot.model, data, q)
        pin.updateFramePlacements(robot.model, data)
        hanging = pin.computeGeneralizedGravity(robot.model, robot.model.createData(), q)
    for leg, index in zip(support, chosen, strict=True):
        normal = normals[index] / np.linalg.norm(normals[index])
        points.append(feet[index] - robot.foot_radius * normal)
        turn = np.cross([0.0, 0.0, 1.0], normal)
        angle = np.arctan2(np.linalg.norm(turn), normal[2])
        axis = turn / max(np.linalg.norm(turn), 1e-300)
        tilt = Rotation.from_rotvec(axis * angle).as_matrix()
        slope = limits.friction * np.cos(np.pi / limits.sides)
        around = 2.0 * np.pi * np.arange(limits.sides) / limits.sides
        local = np.column_stack([np.cos(around), np.sin(around), -slope * np.ones(limits.sides)])
        block, bound = [local @ tilt.T, -normal[None]], [np.zeros(limits.sides), [-share * weight]]
        block.append(normal[None])
        bound.append([10.0 * weight])
        if posture is not None:
            frame = robot.model.getFrameId(robot.legs[leg].foot)
            jacobian = pin.getFrameJacobian(robot.model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            arm = pin.skew(-robot.foot_radius * normal)
            moved = (jacobian[:3] - arm @ jacobian[3:])[:, 6:]
            columns = list(robot.leg_columns[leg])
            largest = limits.torque_share * effort_limits(robot).limits[columns]
            own = hanging[6:][columns]
            known = np.isfinite(largest)
            for sign in (1.0, -1.0):
                block.append(-sign * moved[:, columns].T[known])
                bound.append(largest[known] - sign * own[known])
        blocks.append(np.vstack(block))
        bounds.append(np.concatenate(bound))
    rows = np.zeros((sum(map(len, blocks)), 3 * len(chosen)))
    start = 0
    for k, block in enumerate(blocks):
        rows[start : start + len(block), 3 * k : 3 * k + 3] = block
        start += len(block)
    return np.array(points), Rows(rows, np.concatenate(bounds))


def can_rest(robot: Quadruped, points: FloatArray, rows: Rows, com: FloatArray) -> bool:
    """Whether forces exist that hold the robot with its COM at `com (2,)`: a linear program."""
    weight = robot.mass * GRAVITY
    place = np.append(com, 0.0)
    grasp = np.hstack([np.vstack([np.eye(3), pin.skew(p - place)]) for p in points])
    result = linprog(
        np.zeros(grasp.shape[1]),
        rows.matrix / weight,
        rows.bounds / weight,
        grasp,
        [0.0, 0.0, weight, 0.0, 0.0, 0.0],
        bounds=(None, None),
    )
    return bool(result.status == 0)


def border(vertices: FloatArray, middle: FloatArray, outward: float) -> FloatArray:
    """`vertices` and middles of sides, moved away from `middle` [m]."""
    places = np.vstack([vertices, (vertices + np.roll(vertices, 1, axis=0)) / 2.0])
    away = places - middle
    return places + outward * away / np.linalg.norm(away, axis=1, keepdims=True)


def assert_brute_force_agrees(
    robot: Quadruped,
    region: FeasibleRegion,
    feet: FloatArray,
    normals: FloatArray,
    limits: ForceLimits,
) -> None:
    """Just inside the inner polygon the robot can rest, just outside the outer one it cannot."""
    points, rows = raw_rows(robot, feet, normals, limits, region.legs, region.posture)
    middle = region.vertices.mean(axis=0)
    if region.status is RegionStatus.SEGMENT:
        # Without an inside: its ends hold, and no place on a circle around it does.
        reach = np.linalg.norm(region.vertices - middle, axis=1).max() + 1e-4
        angles = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
        assert all(can_rest(robot, points, rows, place) for place in region.vertices)
        for place in middle + reach * np.column_stack([np.cos(angles), np.sin(angles)]):
            assert not can_rest(robot, points, rows, place)
        return
    for place in border(region.vertices, middle, -1e-7):
        assert can_rest(robot, points, rows, place)
    # HiGHS takes violations of 1e-7 of the weight, so places a micrometre outside, too.
    for place in border(region.outer_vertices, middle, 2e-5)[len(region.outer_vertices) :]:
        assert not can_rest(robot, points, rows, place)


# --- level ground -----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["wang2020", "go2", "anymal_c"])
@pytest.mark.parametrize("friction", [0.01, 0.6, 10.0])
def test_without_torque_limits_and_reserve_it_is_the_support_triangle(
    name: str, friction: float
) -> None:
    robot = loaded(name)
    feet = own_stance(robot)
    limits = ForceLimits(friction=friction, reserve=0.0)
    region = feasible_region(robot, feet, limits=limits, support=THREE, torques=False)
    assert region.status is RegionStatus.SOLVED
    assert same_polygon(region.vertices, feet[:3, :2], 1e-12)
    np.testing.assert_array_equal(region.vertices, region.outer_vertices)
    ours, theirs = region.half_planes, support_half_planes(feet[:3])
    for normal, offset in zip(theirs.normals, theirs.offsets, strict=True):
        match = np.abs(ours.normals - normal).max(axis=1).argmin()
        np.testing.assert_allclose(ours.normals[match], normal, atol=1e-12)
        assert ours.offsets[match] == pytest.approx(offset, abs=1e-12)


def test_on_four_feet_it_is_their_hull(wang: Quadruped) -> None:
    feet = own_stance(wang)
    region = feasible_region(wang, feet, limits=FREE, torques=False)
    assert same_polygon(region.vertices, feet[:, :2], 1e-12)
    # A foot inside the triangle of the others is no corner.
    feet[0, :2] = feet[1:, :2].mean(axis=0)
    region = feasible_region(wang, feet, limits=FREE, torques=False)
    assert same_polygon(region.vertices, feet[1:, :2], 1e-12)


def test_linear_programs_find_the_triangle_as_well(wang: Quadruped) -> None:
    """Heights that differ by a nanometre are not level any more."""
    feet = own_stance(wang, [0.0, 1e-9, 0.0, 0.0])
    region = feasible_region(wang, feet, limits=FREE, support=THREE, torques=False)
    assert not np.array_equal(region.vertices, region.outer_vertices)
    assert same_polygon(region.vertices, feet[:3, :2], 1e-8)
    assert region.gap < 1e-7


@pytest.mark.parametrize("reserve", [0.02, 0.05, 0.2])
def test_reserve_leaves_the_triangle_of_mixed_corners(wang: Quadruped, reserve: float) -> None:
    """At a corner two feet keep their share, and the third carries the rest."""
    feet = own_stance(wang)
    limits = ForceLimits(reserve=reserve)
    region = feasible_region(wang, feet, limits=limits, support=THREE, torques=False)
    shares = np.full((3, 3), reserve) + (1.0 - 3.0 * reserve) * np.eye(3)
    assert same_polygon(region.vertices, shares @ feet[:3, :2], 1e-12)
    assert shares_area(region, wang, feet) == pytest.approx((1.0 - 3.0 * reserve) ** 2)


def test_whole_weight_in_reserve_leaves_a_point(wang: Quadruped) -> None:
    feet = own_stance(wang)
    limits = ForceLimits(reserve=1.0 / 3.0)
    region = feasible_region(wang, feet, limits=limits, support=THREE, torques=False)
    assert region.status is RegionStatus.SEGMENT
    np.testing.assert_allclose(region.vertices, feet[:3, :2].mean(axis=0)[None], atol=1e-12)
    assert region.contains(region.vertices[0])
    assert not region.contains(region.vertices[0] + [0.0, 1e-6])


def test_two_feet_leave_the_segment_between_them(wang: Quadruped) -> None:
    feet = own_stance(wang)
    region = feasible_region(wang, feet, limits=FREE, support=("LF", "RH"), torques=False)
    assert region.status is RegionStatus.SEGMENT
    assert "third foot" in str(region.status)
    assert same_polygon(region.vertices, feet[[0, 2], :2], 1e-12)
    assert region.area == 0.0
    planes = region.half_planes
    middle = feet[[0, 2], :2].mean(axis=0)
    assert (planes.normals @ middle >= planes.offsets - 1e-12).all()
    assert not (planes.normals @ (middle + np.array([0.0, 1e-6])) >= planes.offsets - 1e-12).all()


# --- tilted contacts --------------------------------------------------------------------------


@pytest.mark.parametrize(("slope", "friction"), [(30.0, 0.1), (20.0, 0.3), (45.0, 0.5)])
def test_two_feet_in_a_ditch_keep_the_com_near_its_middle(
    wang: Quadruped, slope: float, friction: float
) -> None:
    """By hand: both forces have the same horizontal part, and lean inward by the slope, give or
    take the friction angle; so one foot carries at most tan(slope + angle) / tan(slope - angle)
    times what the other one does."""
    tilt, angle = np.radians(slope), np.arctan(friction * np.cos(np.pi / 4.0))
    feet, normals = own_stance(wang), np.tile([0.0, 0.0, 1.0], (4, 1))
    feet[:2] = [[-0.3, 0.0, 0.0], [0.3, 0.0, 0.0]]
    normals[:2] = [[np.sin(tilt), 0.0, np.cos(tilt)], [-np.sin(tilt), 0.0, np.cos(tilt)]]
    limits = ForceLimits(friction=friction, reserve=0.0)
    region = feasible_region(wang, feet, normals, limits, ("LF", "LH"), torques=False)
    most = np.tan(tilt + angle) / np.tan(tilt - angle)
    lever = 0.3 + wang.foot_radius * np.sin(tilt)
    reach = lever * (most - 1.0) / (most + 1.0)
    assert region.status is RegionStatus.SEGMENT
    assert same_polygon(region.vertices, np.array([[-reach, 0.0], [reach, 0.0]]), 1e-7)


def test_two_feet_between_walls_hold_the_com_beside_them(wang: Quadruped) -> None:
    """By hand: each foot presses with up to ten times the weight, and friction then carries one
    foot's end down with what it carries the other one up."""
    feet, normals = own_stance(wang), np.tile([0.0, 0.0, 1.0], (4, 1))
    feet[:2] = [[-0.3, 0.0, 0.2], [0.3, 0.0, 0.2]]
    normals[:2] = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]]
    limits = ForceLimits(friction=0.5, reserve=0.0)
    region = feasible_region(wang, feet, normals, limits, ("LF", "LH"), torques=False)
    lever = 0.3 + wang.foot_radius
    up = 10.0 * 0.5 * np.cos(np.pi / 4.0)
    reach = lever * (up - (1.0 - up))
    assert region.status is RegionStatus.FORCE_LIMITED
    assert same_polygon(region.vertices, np.array([[-reach, 0.0], [reach, 0.0]]), 1e-5)


def test_torque_limits_bound_what_feet_press_against_each_other(wang: Quadruped) -> None:
    """Walls of 60 degrees and friction beyond that."""
    feet = own_stance(wang)
    normals = np.column_stack([np.zeros(4), -np.sign(feet[:, 1]), np.full(4, 0.6)])
    limits = ForceLimits(friction=5.0, reserve=0.0)
    unbounded = feasible_region(wang, feet, normals, limits, torques=False)
    bounded = feasible_region(wang, feet, normals, limits)
    assert unbounded.status is RegionStatus.FORCE_LIMITED
    assert bounded.status is RegionStatus.SOLVED
    assert 0.0 < bounded.area < unbounded.area / 4.0


def test_feet_at_other_heights_hold_the_com_outside_the_support_polygon(wang: Quadruped) -> None:
    """As in [Bretl2008]: horizontal forces at different heights have a moment."""
    feet = own_stance(wang, [0.2, 0.0, -0.1, 0.0])
    normals = np.column_stack([-0.7 * np.sign(feet[:, :2]), np.ones(4)])
    limits = ForceLimits(friction=0.8, reserve=0.0)
    region = feasible_region(wang, feet, normals, limits, THREE, torques=False)
    flat = feasible_region(wang, feet, limits=limits, support=THREE, torques=False)
    beyond = region.vertices[flat.margin(region.vertices) < -0.02]
    assert len(beyond) > 0
    assert_brute_force_agrees(wang, region, feet, normals, limits)


# --- forces -----------------------------------------------------------------------------------


@pytest.mark.parametrize("support", [LEGS, THREE])
@pytest.mark.parametrize("name", ["wang2020", "go2", "anymal_c"])
def test_forces_at_the_vertices_prove_them(name: str, support: tuple[str, ...]) -> None:
    """They balance the weight, and keep friction, reserve, and torques: recomputed otherwise."""
    robot = loaded(name)
    feet = own_stance(robot, [0.02, -0.03, 0.05, 0.0])
    normals = np.array([[0.1, 0.0, 1.0], [0.0, -0.2, 1.0], [0.0, 0.0, 1.0], [0.2, 0.1, 1.0]])
    region = feasible_region(robot, feet, normals, COMMON, support)
    points, rows = raw_rows(robot, feet, normals, COMMON, support, region.posture)
    np.testing.assert_allclose(region.points, points, atol=1e-12)
    weight = robot.mass * GRAVITY
    for vertex, forces in zip(region.vertices, region.forces, strict=True):
        np.testing.assert_allclose(forces.sum(axis=0), [0.0, 0.0, weight], atol=1e-9 * weight)
        arms = points - np.append(vertex, 0.0)
        moment = np.cross(arms, forces).sum(axis=0)
        np.testing.assert_allclose(moment, 0.0, atol=1e-9 * weight)
        assert (rows.matrix @ forces.ravel() <= rows.bounds + 1e-9 * weight).all()
    assert region.residual <= 1e-14
    assert region.violation <= 0.0
    assert region.gap <= region.tolerance


def test_arrays_are_read_only(wang: Quadruped) -> None:
    region = feasible_region(wang, own_stance(wang), limits=COMMON)
    for array in (region.vertices, region.outer_vertices, region.forces, region.points):
        assert not array.flags.writeable
    assert region.half_planes.normals.flags.writeable is False


# --- torque limits ----------------------------------------------------------------------------


def test_weaker_joints_shrink_the_region() -> None:
    robot = loaded("anymal_c")
    feet = own_stance(robot, [0.05, 0.0, -0.05, 0.0])
    before = None
    for share in (1.0, 0.8, 0.6, 0.5):
        limits = ForceLimits(friction=0.5, reserve=0.02, torque_share=share)
        region = feasible_region(robot, feet, limits=limits, support=THREE)
        if before is not None:
            assert region.area < before.area
            assert (before.margin(region.vertices) > -before.tolerance).all()
        before = region


def test_torques_that_do_not_bind_change_nothing() -> None:
    robot = loaded("go2")
    feet = own_stance(robot)
    strong = ForceLimits(friction=0.5, reserve=0.05, torque_share=1.0)
    with_torques = feasible_region(robot, feet, limits=strong)
    without = feasible_region(robot, feet, limits=strong, torques=False)
    assert same_polygon(with_torques.vertices, without.vertices, 0.0)
    assert with_torques.posture is not None
    assert without.posture is None


def test_region_says_for_which_posture_it_is_exact(wang: Quadruped) -> None:
    feet = own_stance(wang)
    posture = base_of_body(wang, [0.02, -0.01, wang.standing_height], np.eye(3))
    region = feasible_region(wang, feet, limits=COMMON, support=THREE, posture=posture)
    assert region.posture is not None
    assert region.posture_com is not None
    np.testing.assert_array_equal(region.posture, posture)
    q = configuration(
        wang, posture[:3], posture[3:], joints_from_feet(wang, posture[:3], posture[3:], feet)
    )
    com = pin.centerOfMass(wang.model, wang.model.createData(), q)
    np.testing.assert_allclose(region.posture_com, com[:2], atol=1e-12)
    away = region.posture_com + np.array([0.03, 0.04])
    assert region.distance_from_posture(away) == pytest.approx(0.05)
    free = feasible_region(wang, feet, limits=COMMON, torques=False)
    assert free.distance_from_posture(away) == 0.0


def test_default_posture_follows_the_feet(wang: Quadruped) -> None:
    feet = own_stance(wang) @ rotation_z(0.7).T + [1.0, 2.0, 0.3]
    region = feasible_region(wang, feet, limits=COMMON)
    expected = base_of_body(wang, [1.0, 2.0, 0.3 + wang.standing_height], rotation_z(0.7))
    np.testing.assert_allclose(region.posture, expected, atol=1e-12)


def test_foot_in_the_air_may_be_anywhere() -> None:
    robot = loaded("anymal_c")
    feet = own_stance(robot)
    first = feasible_region(robot, feet, limits=COMMON, support=THREE)
    feet[3] = np.nan
    second = feasible_region(robot, feet, limits=COMMON, support=THREE)
    np.testing.assert_allclose(second.vertices, first.vertices, atol=1e-9)


def test_robot_without_known_torque_limits_has_the_region_without_them() -> None:
    solo = gaitopt.load_robot("solo12")
    region = feasible_region(solo, own_stance(solo), limits=COMMON)
    assert region.posture is None
    assert region.status is RegionStatus.SOLVED


# --- symmetries -------------------------------------------------------------------------------

MIRRORED = np.array([3, 2, 1, 0])
"""The leg on the other side, for each of LF LH RH RF."""


def test_mirrored_feet_have_the_mirrored_region(wang: Quadruped) -> None:
    flip = np.array([1.0, -1.0, 1.0])
    feet = own_stance(wang, [0.03, 0.0, -0.05, 0.04])
    normals = np.array([[0.2, 0.1, 1.0], [0.0, -0.3, 1.0], [0.1, 0.1, 1.0], [0.0, 0.0, 1.0]])
    one = feasible_region(wang, feet, normals, COMMON, THREE)
    other = feasible_region(
        wang, (feet * flip)[MIRRORED], (normals * flip)[MIRRORED], COMMON, ("RF", "RH", "LH")
    )
    assert other.area == pytest.approx(one.area, rel=1e-3)
    reach = np.array([one.margin(v * [1.0, -1.0]) for v in other.vertices])
    assert np.abs(reach).max() <= one.tolerance


@settings(max_examples=15)
@given(
    quarters=st.integers(0, 3),
    shift=st.tuples(st.floats(-100.0, 100.0), st.floats(-100.0, 100.0), st.floats(-3.0, 3.0)),
)
def test_region_moves_with_the_feet(quarters: int, shift: tuple[float, float, float]) -> None:
    """By quarter turns, which take a pyramid of four sides to itself."""
    robot = loaded("anymal_c")
    turn = np.round(rotation_z(quarters * np.pi / 2.0))
    feet = own_stance(robot, [0.03, 0.0, -0.05, 0.04])
    normals = np.array([[0.2, 0.1, 1.0], [0.0, -0.3, 1.0], [0.1, 0.1, 1.0], [0.0, 0.0, 1.0]])
    here = feasible_region(robot, feet, normals, COMMON, THREE)
    there = feasible_region(robot, feet @ turn.T + shift, normals @ turn.T, COMMON, THREE)
    moved = here.vertices @ turn[:2, :2].T + shift[:2]
    assert there.area == pytest.approx(here.area, rel=1e-2)
    assert np.abs(there.margin(moved)).max() <= here.tolerance


# --- brute force ------------------------------------------------------------------------------


@st.composite
def stances(draw: st.DrawFn) -> tuple[str, FloatArray, FloatArray, ForceLimits, tuple[str, ...]]:
    name = draw(st.sampled_from(["wang2020", "go2", "anymal_c"]))
    size = loaded(name).standing_height
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    moves = size * rng.uniform(-0.15, 0.15, (4, 3))
    normals = np.column_stack([rng.uniform(-0.4, 0.4, (4, 2)), np.ones(4)])
    limits = ForceLimits(
        friction=draw(st.floats(0.3, 1.0)),
        reserve=draw(st.floats(0.0, 0.1)),
        torque_share=draw(st.floats(0.5, 1.0)),
        sides=draw(st.integers(3, 8)),
    )
    support = draw(st.sampled_from([LEGS, THREE, ("LH", "RH", "RF")]))
    return name, moves, normals, limits, support


@settings(max_examples=30)
@given(stance=stances(), torques=st.booleans())
def test_brute_force_finds_the_same_region(
    stance: tuple[str, FloatArray, FloatArray, ForceLimits, tuple[str, ...]], torques: bool
) -> None:
    name, moves, normals, limits, support = stance
    robot = loaded(name)
    feet = own_stance(robot) + moves
    region = feasible_region(robot, feet, normals, limits, support, torques=torques)
    if region.empty:
        points, rows = raw_rows(robot, feet, normals, limits, support, region.posture)
        for place in points[:, :2].mean(axis=0) + 0.1 * np.random.default_rng(0).normal(
            size=(9, 2)
        ):
            assert not can_rest(robot, points, rows, place)
        return
    assert region.gap <= region.tolerance
    assert region.violation <= 1e-12
    assert (region.margin(region.vertices) >= -1e-12).all()
    assert region.outer_area >= region.area
    assert_brute_force_agrees(robot, region, feet, normals, limits)


def test_smaller_tolerance_finds_what_a_larger_one_leaves_out() -> None:
    robot = loaded("anymal_c")
    feet = own_stance(robot, [0.05, 0.0, -0.05, 0.0])
    coarse = feasible_region(robot, feet, limits=COMMON, tolerance=5e-3)
    fine = feasible_region(robot, feet, limits=COMMON, tolerance=1e-5)
    assert fine.gap <= 1e-5
    assert coarse.area <= fine.area <= fine.outer_area <= coarse.outer_area + 1e-12
    assert (fine.margin(coarse.vertices) >= -1e-9).all()


# --- many at once, and what is refused --------------------------------------------------------


def test_many_regions_are_those_of_each_one() -> None:
    robot = loaded("anymal_c")
    rng = np.random.default_rng(2)
    feet = own_stance(robot) + rng.uniform(-0.05, 0.05, (6, 4, 3))
    standing = np.ones((6, 4), dtype=bool)
    standing[[1, 4], [0, 2]] = False
    standing[5, [1, 3]] = False
    together = feasible_regions(robot, feet, limits=COMMON, standing=standing)
    for region, places, flags in zip(together, feet, standing, strict=True):
        support = [leg for leg, flag in zip(LEGS, flags, strict=True) if flag]
        alone = feasible_region(robot, places, limits=COMMON, support=support)
        assert region.legs == tuple(support)
        np.testing.assert_allclose(alone.vertices, region.vertices, atol=1e-9)


def test_slope_beyond_friction_leaves_nowhere_to_stand(wang: Quadruped) -> None:
    region = feasible_region(wang, own_stance(wang), (1.0, 0.0, 1.0), COMMON, torques=False)
    assert region.status is RegionStatus.NO_FORCES
    assert region.empty
    assert region.area == 0.0
    assert not region.contains([0.0, 0.0])
    assert region.margin([[0.0, 0.0]])[0] == -np.inf
    with pytest.raises(InputError, match="more friction or a smaller reserve"):
        _ = region.half_planes


def test_joints_that_are_too_weak_leave_nowhere_to_stand() -> None:
    robot = loaded("anymal_c")
    weak = ForceLimits(friction=0.5, reserve=0.05, torque_share=0.1)
    region = feasible_region(robot, own_stance(robot), limits=weak, support=THREE)
    assert region.status is RegionStatus.NO_TORQUES
    assert "torque_share" in str(region.status)


def test_margin_is_the_distance_from_the_border(wang: Quadruped) -> None:
    feet = own_stance(wang)
    feet[:3, :2] = [[0.0, 0.0], [0.3, 0.0], [0.0, 0.4]]
    region = feasible_region(wang, feet, limits=FREE, support=THREE, torques=False)
    places = [[0.1, 0.1], [0.1, -0.2], [-0.3, -0.4], [0.3, 0.4], [0.0, 0.2]]
    np.testing.assert_allclose(region.margin(places), [0.1, -0.2, -0.5, -0.24, 0.0], atol=1e-12)
    np.testing.assert_array_equal(region.contains(places), [True, False, False, False, True])
    assert region.margin([0.1, 0.1, 9.0]) == pytest.approx(0.1)
    with pytest.raises(InputError, match="place must be"):
        region.margin([0.0, 0.0, 0.0, 0.0])


def test_no_stances_have_no_regions(wang: Quadruped) -> None:
    assert feasible_regions(wang, np.zeros((0, 4, 3))) == ()


def test_wrong_inputs_are_refused(wang: Quadruped) -> None:
    feet = own_stance(wang)
    with pytest.raises(InputError, match="'XL' is unknown; legs are LF, LH, RH, RF"):
        feasible_region(wang, feet, support=("XL", "LH"))
    with pytest.raises(InputError, match="1 feet stand"):
        feasible_region(wang, feet, support=("LF",))
    with pytest.raises(InputError, match="feet must be finite"):
        feasible_region(wang, np.full((4, 3), np.nan))
    with pytest.raises(InputError, match=r"feet must be \(4, 3\)"):
        feasible_region(wang, feet[None])
    with pytest.raises(InputError, match=r"feet must be \(B, 4, 3\)"):
        feasible_regions(wang, feet)
    with pytest.raises(InputError, match="feet must be numbers"):
        feasible_region(wang, "feet")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="limits must be ForceLimits or None, got 0"):
        feasible_region(wang, feet, limits=0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"Quadruped \(from load_robot\), got 'wang2020'"):
        feasible_region("wang2020", feet)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="tolerance must be"):
        feasible_region(wang, feet, tolerance=0.0)
    with pytest.raises(InputError, match="at one horizontal place"):
        feasible_region(wang, np.zeros((4, 3)), torques=False)
    with pytest.raises(InputError, match="posture must be"):
        feasible_region(wang, feet, posture=np.zeros(3))
    with pytest.raises(InputError, match="posture must be finite"):
        feasible_region(wang, feet, posture=np.full(6, np.nan))


def test_foot_out_of_reach_is_named(wang: Quadruped) -> None:
    feet = own_stance(wang)
    feet[2, 0] -= 1.0
    with pytest.raises(InputError, match="leg RH does not reach its foot"):
        feasible_region(wang, feet)
    assert feasible_region(wang, feet, torques=False).status is RegionStatus.SOLVED
