"""Limbs in columns, found when the walk is planned."""

from __future__ import annotations

import warnings

import numpy as np
import pinocchio as pin
import pytest
from robot_loading import quiet

import gaitopt
from gaitopt import FootholdsWarning
from gaitopt.certificate.ground.solids import Solids
from gaitopt.plan.limbs_in_columns import LEAST_GAP, limb_in_column
from gaitopt.robots.collisions.limb_parts import limb_parts

WANG = gaitopt.load_robot("wang2020")
CHECK = "legs and trunk clear of the ground"


def test_walks_over_columns_that_are_certified_are_not_warned_of() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", FootholdsWarning)
        plan = gaitopt.plan_crawl(WANG, gaitopt.s_columns(3, columns=2), timing="velocity")
    assert limb_in_column(plan) is None
    assert gaitopt.verify(plan, collisions=False).ok


def test_a_column_planted_in_a_shank_is_told_with_its_depth_and_found_by_the_certificate() -> None:
    """Where the middle of the shank is, Pinocchio tells."""
    columns = gaitopt.s_columns(3, columns=3)
    plan = gaitopt.plan_crawl(WANG, columns, timing="velocity")
    data = WANG.model.createData()
    pin.forwardKinematics(WANG.model, data, plan.at([plan.swings[3].start]).q[0])
    shapes = pin.buildGeomFromUrdfString(WANG.model, WANG.urdf, pin.GeometryType.COLLISION)
    shank = next(s for s in shapes.geometryObjects if s.name.startswith("LF_SHANK"))
    middle = (data.oMi[shank.parentJoint] * shank.placement).translation
    points = {leg: places.copy() for leg, places in columns.points.items()}
    points["LH"][2] = middle
    height = plan.settings.body_height
    with pytest.warns(FootholdsWarning, match="the shank of LF goes .* mm into a column of LH"):
        planted = gaitopt.plan_crawl(
            WANG, columns.with_(points=points), timing="velocity", body_height=height
        )
    told = limb_in_column(planted)
    assert told is not None and np.allclose(told.place, middle[:2])
    worst = min(check.worst for check in gaitopt.verify(planted, collisions=False).violations)
    assert told.gap == pytest.approx(worst, abs=2e-3)


@pytest.mark.parametrize(("name", "seed"), [("go2", 0), ("wang2020", 0)])
def test_a_look_agrees_with_the_certificate_at_every_body_height(name: str, seed: int) -> None:
    """The two know nothing of one another; the look asks for 0.3 mm, the certificate for 0.01."""
    robot = quiet(name)
    columns = gaitopt.s_columns(seed, robot=robot, columns=4, height_jitter=0.05)
    own = gaitopt.plan_crawl(robot, columns, timing="velocity").settings.body_height
    found = []
    for share in (0.85, 1.0):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FootholdsWarning)
            plan = gaitopt.plan_crawl(
                robot, columns, timing="velocity", body_height=round(share * own, 3)
            )
        limb = limb_in_column(plan)
        worst = gaitopt.verify(plan, collisions=False)[CHECK].worst
        assert (limb is None) == (worst >= LEAST_GAP)
        if limb is not None:
            # Within a column both look now and then, for there is nothing left to prove.
            assert limb.gap == pytest.approx(worst, abs=5e-3)
        found.append(limb is None)
    assert len({*found}) == 2


def test_the_body_is_higher_where_limbs_would_go_into_columns() -> None:
    """At its own height a shank of go2 goes 1.7 mm into a column; 2 cm higher none does."""
    robot = quiet("go2")
    columns = gaitopt.s_columns(robot=robot, columns=6, height_jitter=0.05)
    with warnings.catch_warnings():
        warnings.simplefilter("error", FootholdsWarning)
        plan = gaitopt.plan_crawl(robot, columns)
    assert plan.settings.body_height == pytest.approx(0.29)
    assert gaitopt.verify(plan).outcome == "certified"
    with pytest.warns(
        FootholdsWarning, match=r"step \d+: the shank of RF goes 1\.\d mm into a col"
    ):
        gaitopt.plan_crawl(robot, columns, body_height=0.27)


def test_where_no_body_height_is_clear_the_walk_is_warned_of_with_what_helps() -> None:
    robot = quiet("a1")
    columns = gaitopt.s_columns(1, robot=robot, columns=4, height_jitter=0.08)
    with pytest.warns(
        FootholdsWarning, match=r"goes \d+\.\d mm into a column of .*thinner columns"
    ):
        plan = gaitopt.plan_crawl(robot, columns, timing="velocity")
    assert gaitopt.verify(plan, collisions=False)[CHECK].worst < 0.0


@pytest.mark.parametrize("name", ["go2", "solo12", "wang2020", "a1", "anymal_c"])
def test_parts_of_links_are_those_that_the_certificate_makes_for_itself(name: str) -> None:
    robot = quiet(name)
    parts = limb_parts(robot)
    assert parts is not None
    mine = sorted((s.joint, *s.middle.round(4), *s.half.round(4)) for s in parts.solids)
    own = sorted((s.joint, *s.centre.round(4), *s.half.round(4)) for s in Solids.of(robot).parts)
    assert np.allclose(mine, own, atol=2e-4)


def test_feet_are_no_parts_and_links_have_names() -> None:
    parts = limb_parts(WANG)
    assert parts is not None
    assert {*zip(parts.legs, parts.links, strict=True)} == {
        ("", "trunk"), *((leg, link) for leg in gaitopt.LEGS for link in ("hip", "thigh", "shank")),
    }  # fmt: skip
