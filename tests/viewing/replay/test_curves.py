"""Curves under the replay's scrubber, against the plan, the phases' margins, and mechanics."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from ground_walks import bumpy_walk

import gaitopt
from gaitopt import LEGS, Plan
from gaitopt.robots.collisions.shapes import robot_shapes
from gaitopt.viewing.replay.curves.clearance import clearance_over
from gaitopt.viewing.replay.curves.curves import curve_data
from gaitopt.viewing.replay.curves.of_plan import instants, plan_curves, stances
from gaitopt.viewing.replay.plan_page import plan_page
from gaitopt.viewing.replay.scene import joined


@pytest.fixture(scope="module")
def crawl() -> Plan:
    robot = gaitopt.load_robot("wang2020")
    return gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2))


@pytest.fixture(scope="module")
def trot() -> Plan:
    robot = gaitopt.load_robot("wang2020-fast")
    return gaitopt.plan_gait(robot, gaitopt.trot(0.5), velocity=0.3, duration=2.0)


def test_the_least_margin_of_a_phase_is_the_phase_s(crawl: Plan) -> None:
    curves = plan_curves(crawl)
    assert curves is not None and curves.margin is not None
    for phase in crawl.phases:
        if phase.duration > 0.0:
            during = (curves.times >= phase.start) & (curves.times < phase.end)
            assert curves.margin[during].min() == pytest.approx(phase.margin, abs=2e-4)
    assert curves.margin_name == "centre of mass"


def test_vertical_forces_bear_the_weight_and_torques_keep_their_promise(crawl: Plan) -> None:
    """The body's heights change little: the forces on all feet are the weight, to a tenth."""
    curves = plan_curves(crawl)
    assert curves is not None and curves.pressing is not None and curves.torque_use is not None
    assert np.median(np.abs(curves.pressing.sum(axis=1) / curves.weight - 1.0)) < 0.01
    limits = crawl.settings.promised_forces
    assert limits is not None
    assert curves.torque_use.max() <= limits.torque_share + 1e-6
    assert curves.velocity_use.max() <= 1.0 + 1e-9
    flying = ~crawl.at(curves.times).contacts
    assert np.abs(curves.pressing[flying]).max() < 1e-9


def test_feet_stand_when_the_plan_says_so(crawl: Plan, trot: Plan) -> None:
    for plan in (crawl, trot):
        found = stances(plan)
        for moment in np.random.default_rng(0).uniform(0.0, plan.duration, 200):
            contacts = plan.at([moment]).contacts[0]
            shown = [any(a <= moment < b for a, b in found[leg]) for leg in LEGS]
            assert shown == contacts.tolist()


def test_a_trot_s_bar_is_not_blank(trot: Plan) -> None:
    """Two feet fly at once: no caption has a colour, and the diagram shows who stands."""
    data = curve_data(plan_curves(trot))
    assert data is not None
    assert all(len(data["standing"][leg]) > 2 for leg in LEGS)
    assert data["marginName"] == "ZMP"


def test_on_two_feet_the_zmp_is_as_far_off_their_line_as_the_plan_says(trot: Plan) -> None:
    curves = plan_curves(trot)
    assert curves is not None and curves.margin is not None
    two = trot.at(curves.times).contacts.sum(axis=1) == 2
    assert two.mean() > 0.5 and np.isfinite(curves.margin[two]).all()
    worst = trot.record.zmp_margin
    assert worst is not None
    assert curves.margin[two].max() <= 0.0
    assert curves.margin[two].min() == pytest.approx(worst, abs=1e-3)


def test_without_a_motion_there_are_no_curves() -> None:
    assert curve_data(None) is None


def test_instants_hold_both_ends_of_every_phase(crawl: Plan) -> None:
    times = instants(crawl)
    assert (np.diff(times) >= 0.0).all() and times[0] == 0.0 and times[-1] == crawl.duration
    for phase in crawl.phases:
        if phase.duration > 0.0:
            assert np.abs(times - phase.start).min() < 1e-12
            before = times[times < phase.end]
            assert phase.end - before.max() < 1e-12


def test_joints_of_the_curves_are_frames_of_the_scene(crawl: Plan) -> None:
    page = plan_page(crawl)
    assert page.curves is not None
    frames = {"/".join(node.path) for node in joined([page.scene]).nodes}
    assert set(page.curves.joints.frames) <= frames
    assert page.curves.joints.names == crawl.robot.joint_names
    for name, leg in zip(page.curves.joints.names, page.curves.joints.legs, strict=True):
        assert name in crawl.robot.legs[leg].joints


# ---------------------------------------------------------------- legs and trunk above the ground


def test_the_gap_ends_on_the_ground() -> None:
    plan = bumpy_walk()
    curves, ground = plan_curves(plan), plan.footholds.ground
    assert curves is not None and curves.clearance is not None and ground is not None
    gap, place = curves.clearance.gap, curves.clearance.place
    at = np.flatnonzero(np.isfinite(ground.height(place[:, :2])))
    assert len(at) > 0.9 * len(gap)
    off = place[at, 2] - gap[at] - ground.height(place[at, :2])
    # The nearest point jumps, and its gap is interpolated between the instants looked at.
    assert np.median(np.abs(off)) < 1e-4
    assert "stick" in plan_page(plan).legend[-1][0]


def test_lower_ground_is_farther_away_and_a_block_below_the_trunk_is_measured() -> None:
    plan = bumpy_walk()
    ground = plan.footholds.ground
    assert ground is not None
    times = np.linspace(0.0, plan.duration, 7)
    q = plan.at(times).q
    near = clearance_over(plan.robot, ground, times, q)
    far = clearance_over(plan.robot, ground.with_heights(ground.z - 0.1), times, q)
    assert near is not None and far is not None
    np.testing.assert_allclose(far.gap, near.gap + 0.1, atol=1e-9)
    # One high point of a map that is far below otherwise, under the middle of the trunk.
    shapes, robot = robot_shapes(plan.robot), plan.robot
    body = [s for s in shapes.geometry.geometryObjects if s.parentJoint <= 1]
    data, placed = robot.model.createData(), shapes.geometry.createData()
    pin.updateGeometryPlacements(robot.model, data, shapes.geometry, placed, q[0])
    bottoms = []
    for shape in body:
        shape.geometry.computeLocalAABB()
        where = placed.oMg[shapes.geometry.getGeometryId(shape.name)]
        half = 0.5 * (shape.geometry.aabb_local.max_ - shape.geometry.aabb_local.min_)
        bottoms.append(where.translation[2] - np.abs(where.rotation[2]) @ half)
    x, y = np.meshgrid(ground.x, ground.y, indexing="ij")
    under = np.hypot(x - plan.at([0.0]).cog[0, 0], y - plan.at([0.0]).cog[0, 1]) < 0.08
    block = ground.with_heights(np.where(under, 0.1, -2.0))
    found = clearance_over(robot, block, times[:1], q[:1])
    assert found is not None
    assert found.gap[0] == pytest.approx(min(bottoms) - 0.1, abs=0.02)
