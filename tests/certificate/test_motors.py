"""Motors in the check of forces: inertia, torque that falls, and plans that forgot them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from shaken_paths import shaken

import gaitopt
from gaitopt import Plan, Quadruped
from gaitopt.certificate.check import Verdict
from gaitopt.certificate.enclosure import Pieces
from gaitopt.certificate.force_samples import sample_forces
from gaitopt.certificate.forces import contact_forces
from gaitopt.certificate.inertial_deviations import InertialDeviations
from gaitopt.dynamics.contacts import ForceLimits, TorqueLine
from gaitopt.dynamics.whole_body import equations_of_motion, motion_of_path
from gaitopt.motion.path import MotionPath

LIMITS = ForceLimits()
INERTIA = np.linspace(0.01, 0.3, 12)


def with_motors(robot: Quadruped, inertia: float, **options: object) -> Quadruped:
    return gaitopt.load_robot(robot.urdf, motor_inertia=inertia, **options)  # type: ignore[arg-type]


def test_torques_of_the_other_model_have_motors_as_well(a1_walk: Plan) -> None:
    named = dict(zip(a1_walk.robot.joint_names, INERTIA.tolist(), strict=True))
    robot = gaitopt.load_robot("a1", motor_inertia=named)
    rows = [a1_walk.path.evaluate(np.linspace(0.05, 0.7, 9), k) for k in range(3)]
    found = sample_forces(robot, *rows).torques
    whole = equations_of_motion(robot, motion_of_path(robot, *rows)).joint_forces
    np.testing.assert_allclose(found, whole, rtol=0, atol=1e-9)
    plain = sample_forces(a1_walk.robot, *rows).torques
    assert np.abs(found - plain).max() > 1.0


def test_torques_of_motors_leave_their_chords_by_no_more_than_is_said(a1_walk: Plan) -> None:
    robot = with_motors(a1_walk.robot, 0.2)
    coefficients = np.random.default_rng(1).normal(size=(6, 1, 18))
    coefficients *= np.array([3.0**k for k in range(5, -1, -1)])[:, None, None]
    pieces = Pieces(np.zeros(1), np.array([0.2]), coefficients)
    said = InertialDeviations.of(robot, pieces, np.zeros(1)).motors[:, 0]
    path, times = MotionPath(np.array([0.0, 0.2]), coefficients), np.linspace(0.0, 0.2, 201)
    torque = 0.2 * path.evaluate(times, 2)[:, 6:]
    chord = torque[0] + (times / 0.2)[:, None] * (torque[-1] - torque[0])
    seen = np.abs(torque - chord).max(axis=0)
    assert (seen <= said * (1.0 + 1e-12)).all() and (seen > 0.3 * said).any()


def test_a_plan_that_forgot_its_motors_is_found(a1_walk: Plan) -> None:
    heavy = with_motors(a1_walk.robot, 0.5)
    certificate = gaitopt.verify(replace(a1_walk, robot=heavy), collisions=False)
    check = certificate["contact forces"]
    assert check.status is Verdict.VIOLATED and check.where.startswith("torque")
    assert "motors of up to 0.5 kg m²" in check.note
    # Small motors, whose torque the reserve of ten per cent covers, do no harm.
    light = replace(a1_walk, robot=with_motors(a1_walk.robot, 1e-4))
    assert gaitopt.verify(light, collisions=False)["contact forces"].status is Verdict.OK


def test_a_model_that_forgot_its_motors_in_memory_is_judged_by_its_file() -> None:
    robot = gaitopt.load_robot("a1", motor_inertia=0.3)
    robot.model.armature[:] = 0.0
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot))
    assert gaitopt.verify(plan, collisions=False)["contact forces"].status is Verdict.VIOLATED


@pytest.mark.parametrize(("share", "good"), [(0.985, True), (1.01, False)])
def test_one_per_cent_too_much_for_a_motor_that_shakes_between_samples_is_found(
    slow: Plan, share: float, good: bool
) -> None:
    """A flying hip shakes for 5 ms, and nearly all of its torque turns its motor."""
    swing, length = slow.swings[1], 5e-3
    column = slow.robot.leg_columns[swing.leg][0]
    name = slow.robot.joint_names[column]
    start = swing.start + 0.3 * swing.duration
    plan = replace(slow, path=shaken(slow.path, start, length, 6 + column, 1e-5))
    times = np.linspace(start, start + length, 201)
    peaks = [
        np.abs(gaitopt.contact_forces(each, times=times).torques[:, column]).max()
        for each in (plan, replace(plan, robot=with_motors(plan.robot, 1.5)))
    ]
    assert peaks[1] > 2.0 * peaks[0]
    limit = peaks[1] / share / LIMITS.torque_share
    weak = with_motors(plan.robot, 1.5, effort_limits={name: limit})
    check = contact_forces(replace(plan, robot=weak), LIMITS)
    assert (check.status is Verdict.OK) is good, check
    if not good:
        assert start <= check.when <= start + length and check.where.startswith(f"torque {name}")


def test_a_plan_that_forgot_how_its_motors_fade_is_found(slow: Plan) -> None:
    """The same plan is judged by lines that its joints keep, and by lines that they leave."""
    limit = float(slow.robot.velocity_limits[0])
    for line, good in (((0.9 * limit, 1.5 * limit), True), ((0.05 * limit, 0.5 * limit), False)):
        robot = gaitopt.load_robot("wang2020", torque_line=line)
        check = contact_forces(replace(slow, robot=robot), LIMITS)
        assert (check.status is Verdict.OK) is good, check
        assert "90 % of the torque, which falls with the speed" in check.note
    assert check.where.startswith("torque")


def test_lines_of_motors_and_those_of_limits_are_one_check(slow: Plan) -> None:
    """Speeds in rad/s, or as shares of the velocity limits, which all joints of wang2020 share."""
    limit = float(slow.robot.velocity_limits[0])
    for no_load in (0.75, 1.1):
        line = TorqueLine(no_load / 2.0, no_load)
        robot = gaitopt.load_robot("wang2020", torque_line=(limit * line.knee, limit * no_load))
        own = contact_forces(replace(slow, robot=robot), LIMITS)
        asked = contact_forces(slow, replace(LIMITS, torque_line=line))
        assert own.worst == pytest.approx(asked.worst, abs=1e-9) and own.where == asked.where
