"""Shanks in other legs' columns, told when the walk is planned."""

from __future__ import annotations

import warnings

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import FootholdsWarning
from gaitopt.plan.shanks import shank_in_column

WANG = gaitopt.load_robot("wang2020")


def test_walks_over_columns_that_are_certified_are_not_warned_of() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error", FootholdsWarning)
        plan = gaitopt.plan_crawl(WANG, gaitopt.s_columns(3, columns=2), timing="velocity")
    assert shank_in_column(plan) is None
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
    with pytest.warns(FootholdsWarning, match="the shank of LF goes .* mm into a column of LH"):
        planted = gaitopt.plan_crawl(WANG, columns.with_(points=points), timing="velocity")
    told = shank_in_column(planted)
    assert told is not None and np.allclose(told.place, middle[:2])
    worst = min(check.worst for check in gaitopt.verify(planted, collisions=False).violations)
    assert told.below == pytest.approx(-worst, abs=5e-3)
