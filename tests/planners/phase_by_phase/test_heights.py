"""Body heights that ``plan_crawl`` chooses: legs do not touch there. The certificate judges."""

from __future__ import annotations

import dataclasses
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh

import gaitopt
from gaitopt.certificate.collisions.self_collision import self_collision
from gaitopt.planners.phase_by_phase.fitting_height import plan_touches, with_fitting_height
from gaitopt.planners.phase_by_phase.planner import BENT
from gaitopt.robots.catalog import load_robot, own_urdf
from gaitopt.robots.collisions.pairs import CollisionPairs
from gaitopt.robots.quadruped import Quadruped

TOUCHED_WHEN_LOW, ALWAYS_TOUCHED = 0.12, 0.16
"""Widths of a plate between the knees of wang2020 [m]. Standing legs do not touch it."""


def with_plate(width: float, geometry: str = "") -> str:
    """wang2020 with a plate below its trunk, 0.2 m below the hips."""
    geometry = geometry or f'<box size="0.06 {width} 0.06"/>'
    plate = f'<collision><origin xyz="0 0 -0.2"/><geometry>{geometry}</geometry></collision>'
    text = own_urdf("wang2020").read_text("utf-8")
    return text.replace('<link name="base">', f'<link name="base">{plate}', 1)


@pytest.fixture(params=["box", "mesh"])
def plated(request: pytest.FixtureRequest, tmp_path: Path) -> Quadruped:
    """The robot with a plate that legs touch at some heights; the plate is a box, or a mesh."""
    mesh = ""
    if request.param == "mesh":
        trimesh.creation.box(extents=[0.06, TOUCHED_WHEN_LOW, 0.06]).export(tmp_path / "plate.stl")
        mesh = '<mesh filename="plate.stl"/>'
    (tmp_path / "plated.urdf").write_text(with_plate(TOUCHED_WHEN_LOW, mesh))
    return load_robot(tmp_path / "plated.urdf")


def test_a_height_is_taken_at_which_legs_do_not_touch(plated: Quadruped) -> None:
    places = gaitopt.s_columns(0, columns=3, robot=plated)
    low = gaitopt.plan_crawl(plated, places, body_height=plated.standing_height)
    assert self_collision(low).status == "violated"
    chosen = gaitopt.plan_crawl(plated, places)
    assert self_collision(chosen).status == "ok"
    assert chosen.settings.body_height > plated.standing_height
    assert plan_touches(low) and not plan_touches(chosen)


def test_where_legs_touch_at_every_height_the_first_one_is_taken() -> None:
    robot = load_robot(with_plate(ALWAYS_TOUCHED))
    with pytest.warns(
        gaitopt.FootholdsWarning, match="touch each other or the trunk at every body"
    ):
        plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot))
    assert plan.settings.body_height == pytest.approx(robot.standing_height)
    assert self_collision(plan).status == "violated"


def test_a_free_order_tells_it_once_of_the_plan_that_is_returned() -> None:
    """Looking for a height alone tells nothing: what is planned at it may be another walk."""
    robot = load_robot(with_plate(ALWAYS_TOUCHED))
    places = gaitopt.s_columns(0, columns=2, robot=robot)
    with pytest.warns(gaitopt.FootholdsWarning, match="legs touch") as told:
        plan = gaitopt.plan_crawl(robot, places, timing="velocity", sequence="free")
    assert len(told) == 1 and plan_touches(plan)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with_fitting_height(robot, places, gaitopt.CrawlSettings.for_robot(robot))


@pytest.mark.parametrize("name", ["go2", "anymal", "hyq"])
def test_planners_and_certificate_look_at_the_same_shapes(name: str) -> None:
    """Both leave out shapes that overlap when the robot stands; their least distances agree."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gaitopt.RobotWarning)
        robot = load_robot(name)
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot))
    shapes = CollisionPairs.of(robot)
    assert shapes is not None
    joints = plan.path.coefficients[-1][:, 6:][:, shapes.columns]
    found = float(shapes.distances(joints).min())
    assert found == pytest.approx(self_collision(plan).worst, abs=2e-4)
    # Balls around the shapes tell which pairs need a look: no pair that comes near is left out.
    some = joints[::20]
    gaps, near = shapes.distances(some).min(axis=0), shapes.near(some, 0.05)
    assert set(np.flatnonzero(gaps < 0.05).tolist()) <= set(near)
    assert len(near) < len(gaps) and shapes.distances(some, near).shape[1] == len(near)


def test_robots_whose_hulls_are_not_known_count_as_free_of_touching() -> None:
    go2 = load_robot("go2")
    raw = dataclasses.replace(go2, notes=dataclasses.replace(go2.notes, hulls=()))
    assert CollisionPairs.of(go2) is not None and CollisionPairs.of(raw) is None
    plan = gaitopt.plan_crawl(go2, gaitopt.s_columns(0, columns=1, robot=go2))
    assert np.isfinite(plan.duration) and not plan_touches(dataclasses.replace(plan, robot=raw))


def test_feet_of_legs_that_fold_by_little_rise_by_less_than_that() -> None:
    """Legs of 0.57 m whose knees bend by 1.1 rad at most, by the law of cosines 84 mm."""
    text = own_urdf("wang2020").read_text("utf-8")
    text = text.replace('lower="-2.8"', 'lower="-1.1"').replace('upper="2.8"', 'upper="1.1"')
    robot = load_robot(text)
    places = gaitopt.s_columns(0, columns=2, robot=robot)
    plan = gaitopt.plan_crawl(robot, places)
    fold = 0.57 - np.sqrt(0.3**2 + 0.27**2 + 2.0 * 0.3 * 0.27 * np.cos(1.1))
    assert plan.settings.swing_height == pytest.approx(0.3 * fold, abs=1e-4)
    with pytest.raises(gaitopt.InfeasibleStepError):
        gaitopt.plan_crawl(robot, places, swing_height=0.175 * robot.standing_height)


def far(robot: Quadruped, share: float, bumps: float = 0.0, seed: int = 0) -> gaitopt.Footholds:
    """Twelve steps of ``share`` of the standing height, over columns that differ by ``bumps``."""
    height = robot.standing_height
    return gaitopt.s_columns(
        seed, columns=4, robot=robot, forward=3 * share * height, height_jitter=bumps * height
    )


def test_legs_are_not_quite_straight_where_forces_time_the_walk() -> None:
    """The body of anymal_c would go to the end of its reach, where velocities have no bound."""
    robot = load_robot("anymal_c")
    places = far(robot, 0.72)
    plan = gaitopt.plan_crawl(robot, places)
    assert plan.settings.reach_fraction == BENT[0]
    assert gaitopt.verify(plan).outcome == "certified"
    velocity = gaitopt.plan_crawl(robot, places, timing="velocity")
    assert velocity.settings.reach_fraction == 1.0


def test_the_error_of_a_straight_leg_names_it_and_a_way_out_that_works() -> None:
    robot = load_robot("anymal_c")
    places, height = far(robot, 0.72), robot.standing_height
    plan = gaitopt.plan_crawl(robot, places, timing="velocity", body_height=height)
    with pytest.raises(gaitopt.InfeasibleStepError, match="leg RH would be quite straight") as told:
        gaitopt.retimed(plan, rounding=0.4)
    assert told.value.conflicts == ("straight or folded leg RH",)
    assert "take a smaller reach_fraction, 0.95 for example" in str(told.value)
    bent = gaitopt.plan_crawl(robot, places, reach_fraction=0.95, body_height=height)
    assert gaitopt.verify(bent).outcome == "certified"


def test_feet_rise_less_where_joint_limits_leave_no_other_walk() -> None:
    robot = load_robot("hyq")
    places = far(robot, 0.54, bumps=0.15, seed=1)
    usual = gaitopt.CrawlSettings.for_robot(robot)
    plan = gaitopt.plan_crawl(robot, places)
    assert plan.settings.swing_height == pytest.approx(0.7 * usual.swing_height)
    assert gaitopt.verify(plan).outcome == "certified"
    with pytest.raises(gaitopt.InfeasibleStepError, match="body heights from"):
        gaitopt.plan_crawl(robot, places, swing_height=usual.swing_height)


def test_what_was_tried_is_told_where_there_is_no_walk() -> None:
    robot = load_robot("hyq")
    with pytest.raises(gaitopt.InfeasibleStepError) as told:
        gaitopt.plan_crawl(robot, far(robot, 1.08, bumps=0.1, seed=2))
    assert "body heights from 0.42 to 0.66 m and swing heights down to 0.04725 m were tried" in str(
        told.value
    )
