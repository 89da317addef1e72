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
from gaitopt.planners.phase_by_phase.planner import plan_touches
from gaitopt.robots.catalog import load_robot, own_urdf
from gaitopt.robots.collision_shapes import CollisionPairs
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
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot))
    assert plan.settings.body_height == pytest.approx(robot.standing_height)
    assert self_collision(plan).status == "violated"


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
