"""Shanks in other legs' columns, told when the walk is planned."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from pinocchio import coal
from robot_loading import quiet
from scipy.spatial import ConvexHull

import gaitopt
from gaitopt import FootholdsWarning
from gaitopt.plan.shanks import _bars, shank_in_column
from gaitopt.robots.collisions.pairs import CollisionPairs

Array = NDArray[np.float64]

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


@pytest.mark.parametrize("name", ["go2", "solo12", "wang2020", "a1", "anymal_c"])
def test_what_is_looked_at_is_within_the_shape(name: str) -> None:
    """Of hulls (go2, solo12) by the planes of their faces, of others by their lengths."""
    robot = quiet(name)
    pairs = CollisionPairs.of(robot)
    assert pairs is not None
    knee = robot.model.getJointId(robot.legs["LF"].joints[-1])
    shapes = [s for s in pairs.geometry.geometryObjects if s.parentJoint == knee]
    bars = _bars(robot, "LF")
    assert bars
    for bar in bars:
        beyond = [farthest_beyond(shape, bar.line, bar.radii) for shape in shapes]
        assert min(beyond) < 2e-6 and len(bar.radii) > 6
        assert bar.radii.max() > 5e-3


def farthest_beyond(shape: Any, middles: Array, radii: Array) -> float:
    """How far balls reach beyond a shape at most [m]."""
    local = (middles - shape.placement.translation) @ shape.placement.rotation
    solid = shape.geometry
    if isinstance(solid, coal.Sphere):
        return float((np.linalg.norm(local, axis=1) + radii - solid.radius).max())
    if isinstance(solid, coal.Box):
        return float((np.abs(local) + radii[:, None] - solid.halfSide).max())
    if isinstance(solid, coal.Cylinder):
        aside = np.linalg.norm(local[:, :2], axis=1) - solid.radius
        return float((np.maximum(aside, np.abs(local[:, 2]) - solid.halfLength) + radii).max())
    faces = ConvexHull(np.array(solid.points())).equations
    return float((local @ faces[:, :3].T + faces[:, 3] + radii[:, None]).max())
