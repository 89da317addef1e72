"""The smallest clearance between shapes: bounds against coal, and the search against samples."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from pinocchio import coal

from gaitopt.certificate.collisions.pair_search import CONTACT, KEPT, PairSearch
from gaitopt.certificate.collisions.self_collision import self_collision
from gaitopt.certificate.collisions.shape_bounds import RoundedBoxes
from gaitopt.certificate.placements import Placements, configurations
from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.motion.path import MotionPath
from gaitopt.plan.plan import Plan

COAL = 1e-6
"""What distances of coal's may be off [m]: its solver begins where it stopped before."""


def shapes() -> list[Any]:
    """A box, a cylinder, a capsule, a ball and a hull."""
    corners = np.random.default_rng(5).uniform(-0.1, 0.1, (12, 3))
    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(corners))
    return [coal.Box(0.1, 0.2, 0.03), coal.Cylinder(0.05, 0.3), coal.Capsule(0.04, 0.2),
            coal.Sphere(0.07), coal.Convex(points, faces)]  # fmt: skip


def test_bounds_enclose_the_distances_of_coal() -> None:
    """All kinds of shapes with each other, turned and placed at random."""
    rng, count = np.random.default_rng(0), 40
    pairs = [(a, b) for a in shapes() for b in shapes()[:4]]
    for one, other in pairs:
        turns = np.linalg.qr(rng.standard_normal((2, count, 3, 3)))[0]
        turns *= np.sign(np.linalg.det(turns))[..., None, None]
        places = rng.uniform(-0.25, 0.25, (2, count, 3))
        placed = Placements({1: turns[0], 2: turns[1]}, {1: places[0], 2: places[1]})
        objects = [pin.GeometryObject(f"{k}", k, pin.SE3.Identity(), shape)
                   for k, shape in ((1, one), (2, other))]  # fmt: skip
        boxes = RoundedBoxes.of(objects, placed)
        numbers = np.zeros(count, dtype=int), np.ones(count, dtype=int)
        low, high = boxes.apart(*numbers, np.arange(count))
        for k in range(count):
            found = coal.distance(
                one, coal.Transform3s(turns[0, k], places[0, k]),
                other, coal.Transform3s(turns[1, k], places[1, k]),
                coal.DistanceRequest(), coal.DistanceResult(),
            )  # fmt: skip
            if found > COAL:
                assert low[k] <= found + COAL
                assert isinstance(one, coal.Convex) or found <= high[k] + COAL
            else:
                assert low[k] <= COAL
        assert (low > 0.0).any()


def test_bounds_of_round_shapes_side_by_side_are_their_distances() -> None:
    turn = np.eye(3)[None]
    placed = Placements({1: turn, 2: turn}, {1: np.zeros((1, 3)), 2: np.array([[0.3, 0.1, 0.0]])})
    capsules = [pin.GeometryObject(f"{k}", k, pin.SE3.Identity(), coal.Capsule(0.05, 0.2))
                for k in (1, 2)]  # fmt: skip
    one, other, first = np.array([0]), np.array([1]), np.array([0])
    low, high = RoundedBoxes.of(capsules, placed).apart(one, other, first)
    assert low[0] == pytest.approx(np.hypot(0.3, 0.1) - 0.1, abs=1e-12)
    assert high[0] == pytest.approx(np.hypot(0.3, 0.1), abs=1e-12)


def swayed(plan: Plan, size: float, seed: int) -> Plan:
    """The plan with leg joints that wander off by up to ``size`` [rad]: many of them touch."""
    rng = np.random.default_rng(seed)
    knots = plan.path.knots()
    waves = rng.uniform(-size, size, (12, 12)) @ np.sin(
        np.outer(np.arange(1, 13), np.linspace(0.0, 3.0, len(knots)))
    )
    knots = knots.copy()
    knots[:, 6:] += waves.T / 6.0
    return dataclasses.replace(plan, path=MotionPath.polyline(plan.path.times, knots))


class Dense(PairSearch):
    """Looks at samples only: an independent, slow and incomplete search."""

    def distances_at(self, times: FloatArray) -> FloatArray:
        """Distances of all pairs ``(T, n)`` [m]."""
        model, data = self.plan.robot.model, self.plan.robot.model.createData()
        placed, out = self.geometry.createData(), []
        for q in configurations(self.plan.path.evaluate(times)):
            pin.updateGeometryPlacements(model, data, self.geometry, placed, q)
            pin.computeDistances(self.geometry, placed)
            out.append([r.min_distance for r in placed.distanceResults])
        return np.array(out)


@pytest.mark.parametrize(("size", "seed"), [(0.0, 0), (0.2, 1), (0.6, 2), (0.6, 3), (1.2, 4)])
def test_no_sample_is_nearer_than_the_search_says(
    short_plan: Plan, monkeypatch: pytest.MonkeyPatch, size: float, seed: int
) -> None:
    searches: list[PairSearch] = []
    run = PairSearch.run

    def noted(search: PairSearch) -> Any:
        searches.append(search)
        return run(search)

    monkeypatch.setattr(PairSearch, "run", noted)
    plan = swayed(short_plan, size, seed)
    check, search = self_collision(plan), searches[0]
    dense = Dense(plan, search.geometry, search.pieces, search.pairs, search.moved)
    times = np.linspace(0.0, plan.duration, 500)
    seen = dense.distances_at(times)[:, [pair.number for pair in search.pairs]].min(axis=1)
    touching = np.flatnonzero(seen < CONTACT)
    if check.status == "violated":
        assert check.when is not None and check.worst < CONTACT
        assert not touching.size or check.when <= times[touching[0]]
        assert dense.distances_at(np.array([check.when])).min() < CONTACT + COAL
        assert (seen[times < check.when - 1e-9] >= CONTACT - COAL).all()
    else:
        assert not touching.size
        assert seen.min() >= KEPT * check.worst - 1e-9
        assert seen[[0, -1]].min() >= check.worst * KEPT


def test_a_contact_between_knots_that_are_clear_is_found(short_plan: Plan) -> None:
    """Two knots at the standing pose, and a cubic in between that folds two shanks together."""
    robot = short_plan.robot
    values = short_plan.path.knots()[0]
    cubic = np.zeros((4, 1, len(values)))
    cubic[3, 0] = values
    for leg, turn in (("LF", -3.0), ("RF", 3.0)):
        column = 6 + int(robot.leg_columns[leg][0])
        # A bump that is 0 at both ends, and largest in the middle.
        cubic[1, 0, column], cubic[2, 0, column] = -turn * 2.0, turn * 2.0
    bumped = dataclasses.replace(short_plan, path=MotionPath([0.0, 1.0], cubic))
    check = self_collision(bumped)
    assert check.status == "violated" and check.when is not None
    assert 0.0 < check.when < 0.5
    cubic[:3] = 0.0
    still = dataclasses.replace(short_plan, path=MotionPath([0.0, 1.0], cubic))
    assert self_collision(still).status == "ok"


def test_places_are_held_against_pinocchio(short_plan: Plan) -> None:
    """The planted fault: one joint is elsewhere by 0.1 rad."""
    values = short_plan.path.knots()
    model = short_plan.robot.model
    placed = Placements.of(model, values)
    data = model.createData()
    for row in (3, len(values) // 2):
        pin.forwardKinematics(model, data, configurations(values[row : row + 1])[0])
        for joint in range(1, model.njoints):
            assert placed.origins[joint][row] == pytest.approx(
                data.oMi[joint].translation, abs=1e-12
            )
            assert placed.rotations[joint][row] == pytest.approx(
                data.oMi[joint].rotation, abs=1e-12
            )
    other = values.copy()
    other[:, 6] += 0.1
    with pytest.raises(RobotError, match="from where Pinocchio does"):
        placed._compare(model, other)
