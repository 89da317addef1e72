"""What joints must be able to do where contact forces are promised."""

from __future__ import annotations

import itertools

import numpy as np
import pinocchio as pin
import pytest
from robot_loading import quiet
from robot_texts import robot

from gaitopt import plan_crawl, plan_gait, retimed, s_columns, trot
from gaitopt.conventions import GRAVITY
from gaitopt.errors import RobotError
from gaitopt.robots.abilities import _catches


def test_forces_are_not_planned_for_joints_that_do_not_feel_them() -> None:
    """Dry friction above the weight, and motors so heavy that a foot falls more slowly than the
    body; a walk by velocities promises no forces, and is planned."""
    rubs = robot().replace('velocity="12"/>', 'velocity="12"/><dynamics friction="500"/>')
    heavy = {"motor_inertia": 3.0, "effort_limits": 100.0}
    found = ((quiet(rubs), "joints rub .* 500 of "), (quiet(robot(), **heavy), "times gravity"))
    for made, words in found:
        columns = s_columns(0, columns=2, robot=made)
        with pytest.raises(RobotError, match=words):
            plan_crawl(made, columns)
        with pytest.raises(RobotError, match=words):
            plan_gait(made, trot(0.5), velocity=0.1, distance=0.2)
        plan = plan_crawl(made, columns, timing="velocity")
        with pytest.raises(RobotError, match=words):
            retimed(plan)


def test_a_foot_under_all_torques_falls_as_by_forward_dynamics() -> None:
    """Gravity is left out, and the body is so heavy that it stands still."""
    made = quiet(robot(), motor_inertia=0.5, effort_limits=40.0)
    model = made.model.copy()
    model.inertias[1] = pin.Inertia(1e9, np.zeros(3), 1e9 * np.eye(3))
    model.gravity.setZero()
    data, q = model.createData(), pin.neutral(model)
    q[7:] = made.standing_joints()
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    for name, found in _catches(made):
        columns = 6 + np.array(made.leg_columns[name])
        frame = model.getFrameId(made.legs[name].foot)
        up = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[2]
        best = 0.0
        for signs in itertools.product((-40.0, 40.0), repeat=3):
            torques = np.zeros(model.nv)
            torques[columns] = signs
            moved = pin.aba(model, model.createData(), q, np.zeros(model.nv), torques)
            best = max(best, -float(up @ moved))
        assert found == pytest.approx(best / GRAVITY, rel=1e-6)
