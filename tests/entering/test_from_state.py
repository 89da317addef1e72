"""Plans that begin in a state: they continue it without a jump, and keep every limit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from continuing import assert_certified, assert_continues

import gaitopt
from gaitopt import LEGS, InputError, Plan, State, load_plan, plan_crawl, plan_route, verify
from gaitopt.conventions import GRAVITY


@pytest.mark.parametrize("share", [0.05, 0.31, 0.62, 0.93])
def test_a_crawl_goes_on_from_any_instant(a1_walk: Plan, share: float) -> None:
    time = share * a1_walk.duration
    state = a1_walk.state(time)
    plan = plan_crawl(a1_walk.robot, a1_walk.footholds_ahead(time), start=state)
    assert plan.entry > 0
    assert_continues(plan, state)
    assert_certified(plan)
    flown = [swing.leg for swing in plan.swings if swing.index >= 0]
    assert flown == [swing.leg for swing in a1_walk.swings if swing.start > time]


# At 0.8133 and 0.8159 of the time a foot lands in 10 ms, and another hardly carries anything.
@pytest.mark.parametrize("share", [0.2, 0.55, 0.8, 0.8133, 0.8159])
def test_a_walk_whose_body_moves_while_feet_fly_goes_on(a1_route: Plan, share: float) -> None:
    time = share * a1_route.duration
    state = a1_route.state(time)
    plan = plan_route(a1_route.robot, a1_route.footholds_ahead(time), start=state)
    assert_continues(plan, state)
    assert_certified(plan)


def test_slow_joints_at_their_limits_go_on(wang_walk: Plan) -> None:
    """wang2020's feet fly as fast as its joints turn: none may turn faster than before."""
    swing = wang_walk.swings[1]
    time = swing.start + 0.4 * swing.duration
    state = wang_walk.state(time)
    use = np.abs(state.v[6:]) / wang_walk.robot.velocity_limits
    assert use.max() > 0.9
    plan = plan_crawl(wang_walk.robot, wang_walk.footholds_ahead(time), start=state)
    assert_continues(plan, state)
    times = np.linspace(0.0, plan.phases[plan.entry - 1].end, 2000)
    rates = np.abs(plan.path.evaluate(times, 1)[:, 6:]) / plan.robot.velocity_limits
    assert rates.max() <= 1.0 + 1e-6


def test_forces_of_the_entry_make_its_motion_by_pinocchio(a1_walk: Plan) -> None:
    """Pinocchio's inverse dynamics with the plan's contact forces leave no force on the base."""
    swing = a1_walk.swings[2]
    time = (swing.start + swing.end) / 2.0
    plan = plan_crawl(a1_walk.robot, a1_walk.footholds_ahead(time), start=a1_walk.state(time))
    end = plan.phases[plan.entry - 1].end
    times = np.linspace(1e-6, end - 1e-6, 25)
    found = gaitopt.contact_forces(plan, times=times)
    assert found.feasible.all()
    robot, data = plan.robot, plan.robot.model.createData()
    motion, step = plan.at(times), 1e-7
    ahead, behind = plan.at(times + step).v, plan.at(times - step).v
    for k in range(len(times)):
        acceleration = (ahead[k] - behind[k]) / (2.0 * step)
        pin.forwardKinematics(robot.model, data, motion.q[k])
        wrench = np.zeros(6)
        for i in range(len(LEGS)):
            point = motion.feet[k, i] - [0.0, 0.0, robot.foot_radius]
            wrench += np.concatenate([
                found.forces[k, i], np.cross(point - motion.q[k, :3], found.forces[k, i])
            ])  # fmt: skip
        turned = pin.Quaternion(motion.q[k, 3:7]).matrix().T
        local = np.concatenate([turned @ wrench[:3], turned @ wrench[3:]])
        asked = pin.rnea(robot.model, data, motion.q[k], motion.v[k], acceleration)[:6]
        assert np.abs(asked - local).max() < 2e-3 * 9.81 * robot.mass


def test_from_rest_where_the_walk_begins_nothing_is_added(a1_walk: Plan) -> None:
    again = plan_crawl(
        a1_walk.robot, a1_walk.footholds, start=a1_walk.state(0.0),
        cog_start=tuple(a1_walk.at([0.0]).cog[0, :2]), body_height=a1_walk.settings.body_height,
    )  # fmt: skip
    assert again.entry in (0, 1)
    assert again.duration == pytest.approx(a1_walk.duration, rel=0.02)


def test_a_robot_that_sits_stands_up_and_walks(a1_walk: Plan) -> None:
    robot, footholds = a1_walk.robot, a1_walk.footholds
    feet = np.array([footholds[leg][0] for leg in LEGS])
    low = State.standing(robot, feet, height=0.5 * robot.standing_height)
    plan = plan_crawl(robot, footholds, start=low)
    assert_continues(plan, low)
    assert_certified(plan)
    assert plan.entry == 1 and plan.phases[0].support == LEGS
    rise = plan.phases[0].cog_end[2] - plan.phases[0].cog_start[2]
    assert rise > 0.3 * robot.standing_height


def test_whole_turns_of_the_heading_count(a1_walk: Plan) -> None:
    """A robot that faces backwards walks along footholds that lie backwards."""
    half = np.diag([-1.0, -1.0, 1.0])
    turned = a1_walk.footholds.with_(points={leg: a1_walk.footholds[leg] @ half for leg in LEGS})
    feet = np.array([turned[leg][0] for leg in LEGS])
    for yaw, heading in ((np.pi - 0.01, -np.pi), (-np.pi + 0.01, np.pi)):
        state = State.standing(a1_walk.robot, feet, heading=yaw)
        plan = plan_crawl(a1_walk.robot, turned, start=state, heading=heading)
        turn = np.ptp(plan.path.evaluate(plan.path.times)[:, 5])
        assert turn == pytest.approx(0.01, abs=1e-6)


def test_such_a_plan_survives_its_file(a1_walk: Plan, tmp_path: Path) -> None:
    time = 0.5 * a1_walk.duration
    plan = plan_crawl(a1_walk.robot, a1_walk.footholds_ahead(time), start=a1_walk.state(time))
    plan.save(tmp_path / "plan.npz")
    again = load_plan(tmp_path / "plan.npz")
    assert again.entry == plan.entry
    assert np.array_equal(again.path.coefficients, plan.path.coefficients)
    assert [s.index for s in again.swings] == [s.index for s in plan.swings]
    with np.load(tmp_path / "plan.npz") as stored:
        assert b'"version": 3' in stored["header"].tobytes()


def test_what_changes_times_refuses_a_plan_that_begins_in_motion(a1_walk: Plan) -> None:
    time = a1_walk.swings[1].start + 0.3 * a1_walk.swings[1].duration
    plan = plan_crawl(a1_walk.robot, a1_walk.footholds_ahead(time), start=a1_walk.state(time))
    assert plan.begins_moving and not a1_walk.begins_moving
    with pytest.raises(InputError, match="begins in motion"):
        gaitopt.retimed(plan)
    with pytest.raises(InputError, match="begins in motion"):
        plan.slowed(2.0)


def test_the_certificate_sees_faults_of_an_entry(a1_walk: Plan) -> None:
    swing = a1_walk.swings[1]
    time = swing.start + 0.3 * swing.duration
    plan = plan_crawl(a1_walk.robot, a1_walk.footholds_ahead(time), start=a1_walk.state(time))
    assert plan.swings[0].index == -1 and plan.swings[0].leg == swing.leg

    def violated(changed: Plan) -> set[str]:
        return {check.name for check in verify(changed, collisions=False).checks
                if check.status == "violated"}  # fmt: skip

    assert not violated(plan)
    # Without an entry the flight that begins in the air is one step too many.
    assert "contact sequence" in violated(replace(plan, entry=0))
    # An entry that ends while the foot still flies.
    assert "contact sequence" in violated(replace(plan, entry=1))
    # Steps that are said to be part of the entry, and so keep no margin.
    assert "contact sequence" in violated(replace(plan, entry=plan.entry + 2))
    # A foot that lands beside its first foothold.
    points = {leg: np.array(plan.footholds[leg]) for leg in LEGS}
    points[swing.leg][0] += [0.05, 0.0, 0.0]
    aside = replace(plan, footholds=plan.footholds.with_(points=points))
    assert "feet on their footholds" in violated(aside)
    # A foot that is said to stand while it flies.
    phases = (replace(plan.phases[0], kind="stance", support=LEGS), *plan.phases[1:])
    assert violated(replace(plan, phases=phases)) & {"slip of standing feet", "contact forces"}


@pytest.mark.parametrize("share", [0.1, 0.5, 0.97])
def test_loads_are_handed_over_slowly_on_the_way_to_a_walk(a1_walk: Plan, share: float) -> None:
    """The foot that lands takes over its load, and four feet stand before the next lifts off."""
    limits = gaitopt.ForceLimits(transfer_time=0.05)
    swing = a1_walk.swings[1]
    time = swing.start + share * swing.duration
    ahead = a1_walk.footholds_ahead(time)
    plan = plan_crawl(a1_walk.robot, ahead, start=a1_walk.state(time), forces=limits)
    certificate = gaitopt.verify(plan)
    assert certificate.outcome == "certified", str(certificate)
    assert "50 ms" in str(certificate["contact forces"])
    landing, lift_off = plan.swings[0].end, plan.swings[1].start
    assert plan.swings[0].leg == swing.leg and lift_off - landing >= 0.05
    forces = gaitopt.contact_forces(plan, times=landing + np.array([0.005, 0.01]))
    weight = plan.robot.mass * GRAVITY
    loads = forces.forces[:, gaitopt.LEGS.index(swing.leg), 2] / weight
    assert (loads <= limits.reserve + 0.05 + np.array([0.1, 0.2]) + 1e-6).all()


def test_a_robot_that_rests_where_its_walk_begins_has_no_way_to_it(a1_walk: Plan) -> None:
    limits = gaitopt.ForceLimits(transfer_time=0.05)
    slow = plan_crawl(a1_walk.robot, a1_walk.footholds, start=a1_walk.state(0.0), forces=limits)
    assert slow.entry == 0 and slow.settings.promised_forces == limits


def test_walks_without_forces_refuse_a_start(a1_walk: Plan) -> None:
    with pytest.raises(InputError, match="timed by contact forces"):
        plan_crawl(a1_walk.robot, a1_walk.footholds, start=a1_walk.state(0.0), timing="velocity")
