"""Gaits with contact forces: on two feet the ZMP is on their line, and forces exist everywhere."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import (
    LEGS,
    ForceLimits,
    GaitSchedule,
    InfeasibleSpeedError,
    InputError,
    Plan,
    pace,
    plan_gait,
    quasi_static,
    trot,
    walk,
)
from gaitopt.certificate.forces import contact_forces
from gaitopt.conventions import GRAVITY
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.motion.path import MotionPath
from gaitopt.planners.by_velocity.attempt import FOOT_TOLERANCE, INTERVALS_A_SWING, attempt
from gaitopt.planners.by_velocity.reaction import linearised, reaction
from gaitopt.stability.zmp import whole_body_zmp

LIMITS = ForceLimits()


@pytest.fixture(scope="module")
def trots() -> dict[str, Plan]:
    return {
        name: plan_gait(
            gaitopt.load_robot(name), trot(0.5), velocity=0.5, duration=0.5, timing="forces"
        )
        for name in ("a1", "go2")
    }


def off_line(plan: Plan, times: np.ndarray) -> np.ndarray:
    """Distance of the whole robot's ZMP from the line between two standing feet, at ``times``."""
    motion, robot = plan.at(times), plan.robot
    moved = motion_of_path(robot, *(plan.path.evaluate(times, k) for k in range(3)))
    zmp = whole_body_zmp(robot.model, *moved, -robot.foot_radius)
    out = np.zeros(len(times))
    for i, (stands, feet) in enumerate(zip(motion.contacts, motion.feet, strict=True)):
        if stands.sum() == 2:
            a, b = feet[stands][:, :2]
            along = (b - a) / np.linalg.norm(b - a)
            out[i] = along[0] * (zmp[i, 1] - a[1]) - along[1] * (zmp[i, 0] - a[0])
    return out


@pytest.mark.parametrize("name", ["a1", "go2"])
def test_a_trot_is_certified_with_forces(trots: dict[str, Plan], name: str) -> None:
    certificate = gaitopt.verify(trots[name])
    assert certificate.outcome == "certified", certificate.report()
    assert certificate["contact forces"].status == "ok"
    assert trots[name].record.zmp_margin == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize("name", ["a1", "go2"])
def test_the_zmp_of_a_trot_is_on_the_line_of_its_feet(trots: dict[str, Plan], name: str) -> None:
    plan = trots[name]
    times = np.random.default_rng(0).uniform(0.0, plan.duration, 400)
    allowed = LIMITS.balance_tolerance * plan.robot.stance_size[0] / 2.0
    assert np.abs(off_line(plan, times)).max() < allowed
    # Along its straight way the trot without forces is beside the line by centimetres.
    plain = plan_gait(plan.robot, trot(0.5), velocity=0.5, duration=0.5, timing="velocity")
    assert np.abs(off_line(plain, np.clip(times, 0.0, plain.duration))).max() > 0.02


def test_a_trot_s_body_hardly_leaves_its_way(trots: dict[str, Plan]) -> None:
    """Continuous accelerations: forward speed is even, and the body sways by millimetres."""
    plan = trots["a1"]
    settings = plan.settings
    ramp = (plan.duration - settings.plateau) / 2.0
    motion = plan.at(np.linspace(ramp, ramp + settings.plateau, 200))
    assert np.abs(motion.v[:, 0] - 0.5).max() < 0.05
    assert 0.002 < np.ptp(motion.cog[:, 1]) < 0.02
    assert np.ptp(plan.path.jumps(2)[:, :2]) < 1e-6


def test_a_trot_whose_body_is_moved_by_5_mm_is_found(trots: dict[str, Plan]) -> None:
    plan = trots["go2"]
    assert contact_forces(plan, LIMITS).status == "ok"
    motion = attempt(plan.robot, plan.settings).motion
    assert motion.sway is not None
    for shift in ((0.005, 0.0), (0.0, 0.005)):
        moved = motion.sway.coefficients.copy()
        moved[-1] += shift
        other = replace(motion, sway=MotionPath(motion.sway.times, moved))
        knots = other.knots(plan.settings.schedule.swing_time / INTERVALS_A_SWING)
        faulty = replace(plan, path=other.path(knots, FOOT_TOLERANCE))
        check = contact_forces(faulty, LIMITS)
        assert check.status == "violated" and "cannot make" in check.where
        # The moment that is missing is about the weight times the distance from the line.
        robot = plan.robot
        length, width = robot.stance_size
        beside = abs(shift[0] * width - shift[1] * length) / np.hypot(length, width)
        reach = max(leg.reach for leg in robot.legs.values())
        assert -check.worst == pytest.approx(robot.mass * GRAVITY * beside / reach, rel=0.5)


def test_less_balance_tolerance_is_a_stricter_promise(trots: dict[str, Plan]) -> None:
    strict = replace(LIMITS, balance_tolerance=1e-6)
    assert gaitopt.contact_forces(trots["a1"], LIMITS).feasible.all()
    worst = gaitopt.contact_forces(trots["a1"], strict).worst()
    assert worst is not None and worst.kind.name == "BALANCE"


def test_a_walk_whose_zmp_must_jump_is_planned() -> None:
    """The critical walk: one foot lands when another lifts off, and each keeps its reserve."""
    robot = gaitopt.load_robot("go2")
    plan = plan_gait(robot, walk(1.2), velocity=0.1, duration=0.6, timing="forces")
    assert gaitopt.verify(plan, collisions=False)["contact forces"].status == "ok"
    assert plan.record.zmp_margin > 0.0
    found = gaitopt.contact_forces(plan, dt=0.01, objective="largest reserve")
    assert found.feasible.all()
    standing = found.standing & (found.standing.sum(axis=1, keepdims=True) < 4)
    assert (found.forces[..., 2][standing] >= LIMITS.reserve * found.weight - 1e-6).all()


@pytest.mark.parametrize(
    ("schedule", "friction"), [(quasi_static(1.0), 0.6), (pace(0.5), 0.8)],
    ids=["quasi-static", "pace"],
)  # fmt: skip
def test_other_gaits_on_two_feet_are_planned(schedule: Any, friction: float) -> None:
    limits = replace(LIMITS, friction=friction)
    plan = plan_gait(
        gaitopt.load_robot("a1"),
        schedule,
        velocity=0.1,
        duration=0.0,
        forces=limits,
        timing="forces",
    )
    assert contact_forces(plan, limits).status == "ok"


def test_a_turning_and_sideways_trot_is_planned() -> None:
    robot = gaitopt.load_robot("wang2020-fast")
    plan = plan_gait(
        robot,
        trot(0.5),
        velocity=(0.1, 0.1),
        yaw_rate=0.3,
        duration=0.2,
        swing="cycloid",
        timing="forces",
    )
    assert contact_forces(plan, LIMITS).status == "ok"


def test_mirrored_commands_give_mirrored_motions() -> None:
    """Of a symmetric robot, with a trot that begins with the other pair of feet."""
    robot = gaitopt.load_robot("wang2020-fast")
    mirror = {"LF": "RF", "RF": "LF", "LH": "RH", "RH": "LH"}
    one = trot(0.5)
    other = replace(one, phase_offsets={mirror[leg]: x for leg, x in one.phase_offsets.items()})
    left = plan_gait(robot, one, velocity=(0.1, 0.1), duration=0.2, timing="forces")
    right = plan_gait(robot, other, velocity=(0.1, -0.1), duration=0.2, timing="forces")
    times = np.linspace(0.0, left.duration, 50)
    flipped = right.at(times).cog * [1.0, -1.0, 1.0]
    assert left.at(times).cog == pytest.approx(flipped, abs=2e-5)


def test_the_derivatives_of_the_reaction_are_right() -> None:
    """Against central differences, and for the acceleration against the point mass's h / g."""
    robot = gaitopt.load_robot("a1")
    settings = gaitopt.GaitSettings.for_robot(
        robot, schedule=trot(0.5), velocity=0.4, duration=0.5, timing="forces"
    )
    motion = attempt(robot, settings).motion
    times = np.linspace(0.3, 1.5, 7)
    centre = np.stack(motion.centre(times), axis=1)
    slope = linearised(motion, times, centre).slope
    step = 1e-4
    for order in range(3):
        for axis in range(2):
            ends = []
            for sign in (1.0, -1.0):
                moved = centre.copy()
                moved[:, order, axis] += sign * step
                ends.append(reaction(motion, times, moved))
            central = (ends[0] - ends[1]) / (2.0 * step)
            assert slope[:, :, order, axis] == pytest.approx(central, abs=2e-4)
    pendulum = (settings.body_height + robot.foot_radius) / GRAVITY
    assert slope[:, 3, 2, 0] == pytest.approx(-pendulum, rel=0.25)


def test_what_has_no_forces_is_refused_with_words() -> None:
    robot = gaitopt.load_robot("a1")
    asked: dict[str, Any] = {"velocity": 0.1, "duration": 0.2, "timing": "forces"}
    for schedule, changes, words in (
        (trot(0.5), {"sway": False}, "sway=False"),
        (trot(0.5), {"swing": "sine arch"}, "land at some speed"),
    ):
        with pytest.raises(InputError, match=words) as refused:
            plan_gait(robot, schedule, **asked, **changes)
        assert 'timing="velocity"' in str(refused.value)
    solo = gaitopt.load_robot("solo8")
    for schedule, changes, words in (
        (trot(0.5), {}, "needs phases of four feet"),
        (walk(2.0), {}, "needs phases of four feet"),
        (pace(0.5, 0.7), {}, "fall to the side"),
        (trot(0.5, 0.6), {"velocity": (0.1, 0.1)}, "straight ahead"),
        (trot(0.5, 0.6), {"yaw_rate": 0.1}, "straight ahead"),
    ):
        with pytest.raises(InputError, match=f"solo8 has legs without roll joint.*{words}"):
            plan_gait(solo, schedule, **{**asked, **changes})


@pytest.mark.parametrize("schedule", [trot(0.5, 0.6), walk(2.0, 0.85)], ids=lambda s: s.name)
def test_legs_without_roll_joints_walk_straight_ahead_with_forces(schedule: GaitSchedule) -> None:
    """The body's centre stays on the line ahead, wherever that points to."""
    robot, heading = gaitopt.load_robot("solo8"), 0.4
    plan = plan_gait(robot, schedule, velocity=0.2, distance=0.05, heading=heading)
    verdict = gaitopt.verify(plan, collisions=False)
    assert not verdict.violations and verdict["contact forces"].status == "ok"
    assert schedule.name == "walk" or gaitopt.simulate(plan).passed
    ahead = np.array([np.cos(heading), np.sin(heading)])
    base = plan.path.evaluate(np.linspace(0.0, plan.duration, 50), 0)[:, :2]
    assert np.abs((base - base[0]) @ [-ahead[1], ahead[0]]).max() < 1e-9
    feet = np.array(plan.footholds["LF"])
    assert (base[-1] - base[0]) @ ahead == pytest.approx((feet[-1] - feet[0])[:2] @ ahead)


def test_a_gait_without_forces_tells_where_and_what_would_do() -> None:
    """The line from the feet to the body must be within friction: a pace on ice has none."""
    with pytest.raises(InfeasibleSpeedError, match="no path of the body was found") as caught:
        plan_gait(
            gaitopt.load_robot("a1"), pace(0.5), velocity=0.1, duration=0.0, ramp=0.1,
            forces=replace(LIMITS, friction=0.1),
        )  # fmt: skip
    error = caught.value
    assert error.limit == "balance" and "friction" in str(error)
    assert any(f"{a} and {b}" in str(error) for a, b in (("LF", "LH"), ("RH", "RF")))


def test_too_little_torque_is_a_speed_that_is_too_high() -> None:
    weak = replace(LIMITS, torque_share=0.2)
    with pytest.raises(InfeasibleSpeedError, match="torque") as caught:
        plan_gait(
            gaitopt.load_robot("a1"), trot(0.5), velocity=0.5, duration=0.0, ramp=0.2,
            forces=weak, timing="forces",
        )  # fmt: skip
    assert caught.value.limit.startswith("torque") and caught.value.needed > 1.0


def test_where_nothing_works_the_way_out_is_one_of_forces() -> None:
    """Not another body height, which is the way out of legs that are too short."""
    robot = gaitopt.load_robot("a1")
    for limits, words in (
        (ForceLimits(torque_share=0.05), "torque of .*_calf_joint"),
        # The largest reserve leaves no choice, and nothing to keep back from it.
        (ForceLimits(reserve=1.0 / 3.0), "no path of the body was found"),
    ):
        with pytest.raises(InfeasibleSpeedError, match=words) as caught:
            plan_gait(
                robot, walk(0.8, 0.85), velocity=0.1, duration=0.0, ramp=0.1, forces=limits,
                timing="forces",
            )  # fmt: skip
        assert caught.value.fastest is None and "less reserve" in str(caught.value)
        assert "body_height" not in str(caught.value)


def test_the_legs_that_fly_are_those_of_the_schedule(trots: dict[str, Plan]) -> None:
    plan = trots["a1"]
    assert [s.leg for s in plan.swings] == plan.settings.swing_legs(len(plan.footholds))
    assert {s.leg for s in plan.swings} == set(LEGS)
    for phase in plan.phases:
        if len(phase.support) == 4:
            assert phase.margin > 0.0
        else:
            assert phase.margin == pytest.approx(0.0, abs=1e-4)
