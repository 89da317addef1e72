"""Which foothold each foot stands on, with its normal and its friction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Plan
from gaitopt.dynamics.contacts import LEVEL_GROUND
from gaitopt.plan.contact_ground import foothold_indices, ground_below


def test_standing_feet_are_on_the_footholds_where_they_are(short_plan: Plan) -> None:
    """By their places: the foothold that is nearest to the foot."""
    times = np.linspace(0.0, short_plan.duration, 500)
    motion, indices = short_plan.at(times), foothold_indices(short_plan, times)
    for i, leg in enumerate(LEGS):
        away = np.linalg.norm(motion.feet[:, i, None] - short_plan.footholds[leg], axis=-1)
        stands = motion.contacts[:, i]
        assert stands.any() and (indices[stands, i] == away[stands].argmin(axis=1)).all()
    for swing in short_plan.swings:
        leg = LEGS.index(swing.leg)
        edges = [swing.start, 0.5 * (swing.start + swing.end), swing.end]
        found = foothold_indices(short_plan, np.array(edges))[:, leg]
        assert found.tolist() == [swing.index, swing.index + 1, swing.index + 1]


def test_a_foot_that_lifts_off_as_it_lands_is_on_the_foothold_between() -> None:
    robot = gaitopt.load_robot("go2")
    columns = gaitopt.s_columns(seed=1, columns=3, robot=robot)
    plan = gaitopt.plan_crawl(robot, columns, sequence="free", timing="velocity")
    pairs = zip(plan.swings, plan.swings[1:], strict=False)
    again = [(a, b) for a, b in pairs if a.leg == b.leg and b.start - a.end < 1e-9]
    assert again
    for before, after in again:
        found = foothold_indices(plan, np.array([after.start]))[0, LEGS.index(after.leg)]
        assert found == before.index + 1 == after.index


def test_normals_and_friction_are_those_of_the_foothold(short_plan: Plan) -> None:
    rng = np.random.default_rng(0)
    counts, times = short_plan.footholds.counts, np.linspace(0.0, short_plan.duration, 50)
    normals = {leg: rng.normal([0, 0, 5], 1.0, (n, 3)) for leg, n in counts.items()}
    normals = {leg: n / np.linalg.norm(n, axis=1, keepdims=True) for leg, n in normals.items()}
    friction = {leg: rng.uniform(0.3, 0.9, n) for leg, n in counts.items()}
    footholds = short_plan.footholds.with_(normals=normals, friction=friction)
    plan = replace(short_plan, footholds=footholds)
    indices = foothold_indices(plan, times)
    ground = ground_below(plan, times, 0.6)
    for i, leg in enumerate(LEGS):
        np.testing.assert_array_equal(ground.normals[:, i], footholds.normals[leg][indices[:, i]])
        theirs = np.minimum(friction[leg][indices[:, i]], 0.6)
        assert 0.6 * ground.grip[:, i] == pytest.approx(theirs)
    assert ground_below(short_plan, times, 0.6) is LEVEL_GROUND
