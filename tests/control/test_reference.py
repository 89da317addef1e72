"""What a controller follows: a plan, smoothed, at rest before and after."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import Plan, Quadruped
from gaitopt.control.averaged_reference import smoothed
from gaitopt.control.build import build_reference
from gaitopt.control.gains import ControlGains
from gaitopt.control.reference import ramped
from gaitopt.errors import InputError

DT = 0.004


def test_smoothing_is_the_mean_of_a_window() -> None:
    values = np.random.default_rng(0).normal(size=(50, 3))
    ours = smoothed(values, 5)
    assert ours[20] == pytest.approx(values[18:23].mean(axis=0))
    assert smoothed(np.ones((7, 2)), 3) == pytest.approx(np.ones((7, 2)))


def test_loads_fall_before_a_foot_leaves() -> None:
    standing = np.ones((100, 4), dtype=bool)
    standing[40:60, 1] = False
    load = ramped(standing, 10.0)
    assert (load[:, [0, 2, 3]] == 1.0).all()
    assert (load[40:60, 1] == 0.0).all()
    assert (load[:30, 1] == 1.0).all() and (load[60:, 1] == 1.0).all()
    assert (np.diff(load[29:40, 1]) < 0).all() and load[39, 1] > 0


def test_a_foot_keeps_its_load_until_all_stand() -> None:
    standing = np.ones((100, 4), dtype=bool)
    standing[40:60, 1] = False
    standing[60:80, 2] = False  # leaves as the other lands
    standing[84:95, 3] = False  # a short while after that
    load = ramped(standing, 10.0)
    assert (load[:60, 2] == 1.0).all()
    assert (load[:80, 3] == 1.0).all() and (load[80:84, 3] < 1.0).all()


def test_the_reference_is_the_plan_within_the_smoothing(short_plan: Plan) -> None:
    reference = build_reference(short_plan, ControlGains.for_robot(short_plan.robot), DT)
    times = np.arange(0.5, short_plan.duration - 0.5, 0.137)
    motion = short_plan.at(reference.clock.plan_time(times))
    ticks = [reference.tick(t) for t in times]
    # A mean over a window rounds a corner off by an eighth of the window and of the jump.
    corner = np.linalg.norm(short_plan.path.jumps(1)[:, :3], axis=1).max()
    rounding = corner * ControlGains.for_robot(short_plan.robot).body_smoothing / 8.0
    assert np.linalg.norm(reference.position[ticks] - motion.q[:, :3], axis=1).max() < rounding
    assert np.abs(reference.feet[ticks] - motion.feet).max() < 4e-3


def test_a_plan_without_jumps_is_followed_more_closely(wang: Quadruped) -> None:
    """The ZMP of a smooth gait is planned: no body of it is smoothed as one that jumps."""
    robot = gaitopt.load_robot("wang2020-fast")
    plan = gaitopt.plan_gait(
        robot, gaitopt.trot(0.5), velocity=0.3, distance=1.0, timing="velocity"
    )
    reference = build_reference(plan, ControlGains.for_robot(robot), DT)
    times = np.arange(0.0, plan.duration, 0.013)
    ticks = [reference.tick(t) for t in times]
    assert np.abs(reference.position[ticks] - plan.at(times).q[:, :3]).max() < 1e-3
    assert reference.clock.paused == 0.0


def test_in_a_pause_all_feet_stand_and_nothing_moves_that_stands(short_plan: Plan) -> None:
    reference = build_reference(short_plan, ControlGains.for_robot(short_plan.robot), DT)
    ticks = np.arange(len(reference))
    pausing = reference.clock.pausing((ticks - reference.lead) * DT)
    assert 0.8 < pausing.sum() * DT / reference.clock.paused < 1.2
    assert reference.standing[pausing].all()


def test_no_foot_leaves_before_another_has_stood_for_a_while(short_plan: Plan) -> None:
    gains = ControlGains.for_robot(short_plan.robot)
    standing = build_reference(short_plan, gains, DT).standing.astype(int)
    changes = np.diff(standing, axis=0)
    landings, leavings = (np.flatnonzero((changes == s).any(axis=1)) for s in (1, -1))
    assert len(landings) == len(leavings) == 8
    assert ((leavings[1:] - landings[:-1]) * DT >= gains.handover_time - 2 * DT).all()


def test_it_begins_and_ends_at_rest(short_plan: Plan) -> None:
    reference = build_reference(short_plan, ControlGains.for_robot(short_plan.robot), DT)
    for tick in (reference.tick(-1.0), reference.tick(short_plan.duration + 3.0)):
        for name in ("linear", "angular", "rates", "acceleration"):
            assert np.abs(getattr(reference, name)[tick]).max() < 1e-9, name


def test_joint_velocities_stay_within_their_limits(short_plan: Plan) -> None:
    reference = build_reference(short_plan, ControlGains.for_robot(short_plan.robot), DT)
    limits = short_plan.robot.velocity_limits
    assert (np.abs(reference.rates) <= limits * (1 + 1e-6)).all()
    moved = np.diff(reference.joints, axis=0) / DT
    assert (np.abs(moved) <= limits * (1 + 1e-6)).all()


def test_the_inverse_undoes_the_jacobian_of_finite_differences(short_plan: Plan) -> None:
    robot = short_plan.robot
    reference = build_reference(short_plan, ControlGains.for_robot(robot), DT)
    tick = len(reference) // 2
    for i, name in enumerate(gaitopt.LEGS):
        angles = reference.joints[tick][list(robot.leg_columns[name])]
        step = reference.inverse[tick, i] @ np.array([1e-3, -2e-3, 1e-3])
        moved = robot.legs[name].forward(angles + step) - robot.legs[name].forward(angles)
        assert robot.body_axes @ moved == pytest.approx([1e-3, -2e-3, 1e-3], abs=5e-5)


@pytest.mark.parametrize("dt", [0.0, -1.0, np.nan, 1e-9, np.inf, "6 ms"])
def test_bad_intervals_are_refused(short_plan: Plan, dt: Any) -> None:
    with pytest.raises(InputError, match="control interval"):
        build_reference(short_plan, ControlGains.for_robot(short_plan.robot), dt)


def test_gains_scale_with_weight_and_size(wang: Quadruped) -> None:
    big, small = ControlGains.for_robot(wang), ControlGains.for_robot(gaitopt.load_robot("solo12"))
    assert big.joint_stiffness > 10 * small.joint_stiffness
    assert ControlGains.for_robot(wang, friction=0.3).friction == 0.3


def test_bad_gains_are_refused(wang: Quadruped) -> None:
    with pytest.raises(InputError, match="unknown gain 'kp'"):
        ControlGains.for_robot(wang, kp=3.0)
    with pytest.raises(InputError, match="joint_damping"):
        ControlGains.for_robot(wang, joint_damping=-1.0)
    with pytest.raises(InputError, match="friction and loading_time must be positive"):
        ControlGains.for_robot(wang, friction=0.0)
