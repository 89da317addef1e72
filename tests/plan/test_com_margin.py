"""Stability judged with the true centre of mass."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull

import gaitopt
from gaitopt import LEGS, Plan
from gaitopt.plan.com_margin import margins_over, true_com


def test_the_true_com_is_the_mass_weighted_mean_of_the_links(short_plan: Plan) -> None:
    import pinocchio as pin

    model = short_plan.robot.model
    data = model.createData()
    motion = short_plan.sample(1.0)
    ours = true_com(short_plan.robot, motion.q)
    for q, com in zip(motion.q, ours, strict=True):
        pin.forwardKinematics(model, data, q)
        total, moment = 0.0, np.zeros(3)
        for inertia, placement in zip(model.inertias, data.oMi, strict=True):
            total += inertia.mass
            moment += inertia.mass * placement.act(inertia.lever)
        assert com == pytest.approx(moment / total, abs=1e-12)


def test_legs_of_three_kilograms_move_the_com_by_millimetres(plan: Plan) -> None:
    """[Wang2020], II.C (2): the paper takes the COM for the body's centre; it wanders by 1-2 cm."""
    motion = plan.sample(0.2)
    wander = np.hypot(*(true_com(plan.robot, motion.q) - motion.cog)[:, :2].T)
    assert 0.003 < wander.max() < 0.03


def test_the_margin_of_the_cog_is_the_one_the_phases_tell(plan: Plan) -> None:
    motion = plan.at(plan.path.times)
    margins = margins_over(motion, motion.cog)
    for phase in plan.phases:
        inside = (motion.t >= phase.start) & (motion.t < phase.end)
        if inside.any():
            assert margins[inside].min() >= phase.margin - 1e-6


def test_the_true_margin_against_scipys_hull(short_plan: Plan) -> None:
    times, margins = gaitopt.com_margin(short_plan)
    motion = short_plan.at(times)
    coms = true_com(short_plan.robot, motion.q)
    for i in range(0, len(times), 37):
        feet = motion.feet[i][motion.contacts[i]][:, :2]
        planes = ConvexHull(feet).equations
        outside = (planes[:, :2] @ coms[i, :2] + planes[:, 2]).max()
        assert margins[i] == pytest.approx(-outside, abs=1e-9)


def test_two_feet_support_no_area(short_plan: Plan) -> None:
    import dataclasses

    motion = short_plan.sample(1.0)
    contacts = np.zeros_like(motion.contacts)
    contacts[:, [LEGS.index("LF"), LEGS.index("RH")]] = True
    trotting = dataclasses.replace(motion, contacts=contacts)
    assert np.isnan(margins_over(trotting, motion.cog)).all()
