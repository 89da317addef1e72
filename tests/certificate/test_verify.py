"""Good plans keep their promises; each planted fault is found by the check that should find it."""

from __future__ import annotations

import dataclasses
import itertools
import pickle
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import (
    LEGS,
    CertificateError,
    Footholds,
    InputError,
    MotionPath,
    Plan,
    Quadruped,
    RobotError,
)
from gaitopt.certificate.certificate import Certificate
from gaitopt.certificate.verify import verify
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.terrain.columns import s_columns

Array = NDArray[np.float64]


def with_path(plan: Plan, times: Array, values: Array) -> Plan:
    return dataclasses.replace(plan, path=MotionPath.polyline(times, values))


def with_settings(plan: Plan, **changes: Any) -> Plan:
    return dataclasses.replace(plan, settings=dataclasses.replace(plan.settings, **changes))


def with_phase(plan: Plan, index: int, **changes: Any) -> Plan:
    phases = list(plan.phases)
    phases[index] = dataclasses.replace(phases[index], **changes)
    return dataclasses.replace(plan, phases=tuple(phases))


def column(plan: Plan, joint: str) -> int:
    return 6 + plan.robot.joint_names.index(joint)


def knot_in(plan: Plan, phase: int, share: float = 0.5) -> int:
    """Index of a knot inside a phase."""
    p = plan.phases[phase]
    return int(np.searchsorted(plan.path.times, p.start + share * p.duration))


def bent(plan: Plan, knot: int, joint: str, by: float) -> Plan:
    """The plan with one joint moved at one knot."""
    values = plan.path.knots().copy()
    values[knot, column(plan, joint)] += by
    return with_path(plan, plan.path.times, values)


def foot_moved_by_a_millimetre(plan: Plan) -> Plan:
    # LF stands while RH swings; its foot is about 0.4 m below the roll axis.
    return bent(plan, knot_in(plan, 1), "LF_HAA", 0.001 / 0.4)


def limit_exceeded_for_a_millisecond(plan: Plan) -> Plan:
    times, values = plan.path.times, plan.path.knots()
    gaps = np.diff(times)
    i = int(np.argmax(gaps))
    assert gaps[i] > 4e-3
    ahead = times[i] + np.array([1e-3, 2e-3])
    inserted = plan.path.evaluate(ahead).copy()
    joint = column(plan, "RF_HFE")
    inserted[1, joint] = inserted[0, joint] + 1.02 * plan.robot.velocity_limits[0] * 1e-3
    return with_path(plan, np.insert(times, i + 1, ahead), np.insert(values, i + 1, inserted, 0))


def margin_short_by_a_tenth_of_a_millimetre(plan: Plan) -> Plan:
    return with_settings(plan, stability_margin=plan.settings.stability_margin + 1e-4)


def contact_swapped(plan: Plan) -> Plan:
    # LF is said to stand, and RF to fly, while it is LF that flies.
    index = next(i for i, p in enumerate(plan.phases) if p.kind == "swing" and p.leg == "LF")
    return with_phase(plan, index, support=("LF", "LH", "RH"))


def legs_in_another_order(plan: Plan) -> Plan:
    return with_settings(plan, sequence=("RF", "RH", "LH", "LF"))


def two_feet_only(plan: Plan) -> Plan:
    return with_phase(plan, 1, support=("LF", "RF"))


def path_cut_short(plan: Plan) -> Plan:
    keep = int(0.8 * len(plan.path.times))
    return with_path(plan, plan.path.times[:keep], plan.path.knots()[:keep])


def phase_longer_than_its_motion(plan: Plan) -> Plan:
    return with_phase(plan, 1, duration=plan.phases[1].duration + 1e-3)


def joint_beyond_its_limit(plan: Plan) -> Plan:
    knot = knot_in(plan, 1)
    bend = plan.path.knots()[knot, column(plan, "RH_KFE")]
    return bent(plan, knot, "RH_KFE", -bend - 0.01)


def swing_too_low(plan: Plan) -> Plan:
    return with_settings(plan, swing_height=plan.settings.swing_height + 1e-4)


def foot_through_the_ground(plan: Plan) -> Plan:
    index = 1
    phase = plan.phases[index]
    leg = plan.robot.legs[phase.leg]
    knot = knot_in(plan, index)
    values = plan.path.knots().copy()
    place = plan.at([plan.path.times[knot]])
    foot = place.feet[0, LEGS.index(phase.leg)].copy()
    foot[2] = -0.01
    columns = [column(plan, j) for j in leg.joints]
    values[knot, columns] = leg.inverse(foot - place.cog[0])
    return with_path(plan, plan.path.times, values)


def joint_that_jumps(plan: Plan) -> Plan:
    coefficients = plan.path.coefficients.copy()
    coefficients[1, 100:, column(plan, "LH_HFE")] += 1e-6
    return dataclasses.replace(plan, path=MotionPath(plan.path.times, coefficients))


def foothold_moved_off_the_column(plan: Plan) -> Plan:
    moved = {leg: p.copy() for leg, p in plan.footholds.points.items()}
    moved["RF"][1] += [0.021, 0.0, 0.0]
    return dataclasses.replace(plan, footholds=Footholds(moved, plan.footholds.radius))


def foothold_of_another_height(plan: Plan) -> Plan:
    moved = {leg: p.copy() for leg, p in plan.footholds.points.items()}
    moved["RF"][1] += [0.0, 0.0, 0.0011]
    return dataclasses.replace(plan, footholds=Footholds(moved, plan.footholds.radius))


def legs_too_straight(plan: Plan) -> Plan:
    return with_settings(plan, reach_fraction=0.7)


def phase_that_ends_elsewhere(plan: Plan) -> Plan:
    return with_phase(plan, 1, cog_end=plan.phases[1].cog_end + 1e-6)


def foot_that_is_said_to_land_elsewhere(plan: Plan) -> Plan:
    return with_phase(plan, 1, foot_end=plan.phases[1].foot_end + 1e-6)


def phase_of_no_time_that_is_elsewhere(plan: Plan) -> Plan:
    index = next(i for i, p in enumerate(plan.phases) if p.duration == 0.0)
    return with_phase(plan, index, cog_start=plan.phases[index].cog_start + 1e-6)


def leg_through_the_body(plan: Plan) -> Plan:
    # LF stands to the left; rolled far to the right its thigh goes through the trunk.
    return bent(plan, knot_in(plan, 1), "LF_HAA", -1.4)


FAULTS: list[tuple[Callable[[Plan], Plan], str]] = [
    (foot_moved_by_a_millimetre, "slip of standing feet"),
    (limit_exceeded_for_a_millisecond, "joint velocities"),
    (margin_short_by_a_tenth_of_a_millimetre, "margin of the body centre"),
    (contact_swapped, "contact sequence"),
    (contact_swapped, "slip of standing feet"),
    (legs_in_another_order, "contact sequence"),
    (two_feet_only, "contact sequence"),
    (path_cut_short, "contact sequence"),
    (phase_longer_than_its_motion, "contact sequence"),
    (joint_beyond_its_limit, "joint positions"),
    (swing_too_low, "swing height"),
    (foot_through_the_ground, "flying feet above ground"),
    (joint_that_jumps, "continuity"),
    (foothold_moved_off_the_column, "feet on their footholds"),
    (foothold_of_another_height, "feet on their footholds"),
    (legs_too_straight, "reach"),
    (phase_that_ends_elsewhere, "phases agree with the path"),
    (foot_that_is_said_to_land_elsewhere, "phases agree with the path"),
    (phase_of_no_time_that_is_elsewhere, "phases agree with the path"),
    (leg_through_the_body, "self-collision"),
]


@pytest.mark.parametrize(("plant", "check"), FAULTS, ids=lambda x: getattr(x, "__name__", x))
def test_a_planted_fault_is_found(
    short_plan: Plan, plant: Callable[[Plan], Plan], check: str
) -> None:
    certificate = verify(plant(short_plan), collisions=check == "self-collision")
    assert not certificate.ok
    assert check in {c.name for c in certificate.violations}, certificate.report()


@pytest.fixture(scope="module")
def free_order(wang: Quadruped) -> Plan:
    """A walk in which feet touch down and lift off again at once."""
    columns = gaitopt.s_columns(0, columns=3)
    plan = gaitopt.plan_crawl(wang, columns, sequence="free", timing="velocity")
    assert any(a.leg == b.leg for a, b in itertools.pairwise(plan.swings))
    return plan


def without_stances_that_take_no_time(plan: Plan) -> Plan:
    kept = tuple(p for p in plan.phases if p.duration > 0.0 or p.kind == "swing")
    return dataclasses.replace(plan, phases=kept)


@pytest.mark.parametrize("alter", [lambda plan: plan, without_stances_that_take_no_time])
def test_a_foothold_between_two_swings_of_a_leg_is_looked_at(
    free_order: Plan, alter: Callable[[Plan], Plan]
) -> None:
    """The foot stands there for 0 s, so no sample of a standing foot shows it."""
    plan = alter(free_order)
    assert verify(plan, collisions=False).ok
    first = next(a for a, b in itertools.pairwise(plan.swings) if a.leg == b.leg)
    moved = {leg: p.copy() for leg, p in plan.footholds.points.items()}
    moved[first.leg][first.index + 1, 0] += 0.3
    elsewhere = dataclasses.replace(plan, footholds=plan.footholds.with_(points=moved))
    found = verify(elsewhere, collisions=False)["feet on their footholds"]
    assert found.status == "violated"
    assert found.worst == pytest.approx(0.3 / 0.02, rel=1e-3)
    assert found.where == first.leg


def test_an_order_that_does_not_fit_the_footholds_is_a_fault(short_plan: Plan) -> None:
    points = {leg: p.copy() for leg, p in short_plan.footholds.points.items()}
    points["LF"] = points["LF"][:-1]
    order = [swing.leg for swing in short_plan.swings]
    order.remove("LF")
    fewer = dataclasses.replace(short_plan, footholds=Footholds(points, 0.02, order=order))
    found = verify(fewer, collisions=False)["contact sequence"]
    assert found.status == "violated"
    assert "the footholds ask for 7 steps" in found.where


def test_the_main_job_keeps_its_promises(plan: Plan) -> None:
    certificate = verify(plan)
    assert certificate.ok, certificate.report()
    assert [c.name for c in certificate if c.status != "ok"] == ["contact forces", "not judged"]
    assert certificate["joint velocities"].worst == pytest.approx(1.0)
    assert certificate["margin of the body centre"].worst == pytest.approx(0.02, abs=1e-6)
    assert certificate.raise_for_violations() is certificate


def test_the_true_com_may_tip_where_the_plans_does_not(wang: Quadruped) -> None:
    """[Wang2020], II.C (2): with no margin the body centre stands, and the true COM falls."""
    edge = gaitopt.plan_crawl(
        wang, gaitopt.s_columns(1, columns=5), stability_margin=0.0, timing="velocity"
    )
    certificate = verify(edge, collisions=False)
    assert [c.name for c in certificate.violations] == ["margin of the true COM"]
    assert certificate["margin of the true COM"].worst < -1e-3


def test_worst_values_are_no_better_than_any_sample(short_plan: Plan) -> None:
    """Against a dense brute-force sampling, which can only see less."""
    certificate = verify(short_plan, collisions=False)
    times = np.linspace(0, short_plan.duration, 20_000)
    motion = short_plan.at(times)
    com = gaitopt.com_margin(short_plan, times)[1]
    assert certificate["margin of the true COM"].worst <= com.min() + 1e-9
    assert certificate["margin of the true COM"].worst == pytest.approx(com.min(), abs=3e-4)
    rates = np.abs(motion.v[:, 6:]) / short_plan.robot.velocity_limits
    assert certificate["joint velocities"].worst >= rates.max() - 1e-12
    drift = 0.0
    for phase in short_plan.phases:
        inside = (times >= phase.start) & (times < phase.end)
        for leg in phase.support if inside.any() else ():
            feet = motion.feet[inside, LEGS.index(leg)]
            drift = max(drift, float(np.linalg.norm(feet - feet[0], axis=1).max()))
    assert drift <= certificate["slip of standing feet"].worst <= drift + 1e-5


@pytest.mark.parametrize("name", ["a1", "anymal_c", "solo12", "hyq"])
def test_other_robots_plans_keep_their_promises(name: str) -> None:
    robot = gaitopt.load_robot(name)
    # hyq's hips do not bend far enough for a lower body.
    height = 0.65 if name == "hyq" else robot.standing_height
    plan = gaitopt.plan_crawl(robot, s_columns(2, columns=3, robot=robot), body_height=height,
                              swing_height=0.1 * height, timing="velocity")  # fmt: skip
    certificate = verify(plan)
    assert certificate.ok, certificate.report()


@pytest.mark.parametrize("objective", [pytest.param("distance", marks=pytest.mark.slow), "margin"])
def test_random_terrains_are_walked_as_promised(wang: Quadruped, objective: Any) -> None:
    for seed in range(10):
        plan = gaitopt.plan_crawl(
            wang, gaitopt.s_columns(100 + seed, columns=5), objective=objective, timing="velocity"
        )
        assert verify(plan, collisions=False).ok


def test_uneven_ground_and_turned_walks_keep_their_promises(wang: Quadruped) -> None:
    rough = gaitopt.s_columns(5, columns=5, height_jitter=0.03)
    assert verify(gaitopt.plan_crawl(wang, rough, follow_terrain=True, timing="velocity")).ok
    turn = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1.0]])
    turned = Footholds({leg: rough[leg] @ turn.T for leg in LEGS}, rough.radius)
    assert verify(gaitopt.plan_crawl(wang, turned, heading=np.pi / 2, timing="velocity")).ok


def test_standing_still_is_certified_once_forces_are_looked_for(wang: Quadruped) -> None:
    still = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=1), timing="velocity")
    assert verify(still).ok and verify(still).outcome == "kinematics only"
    assert verify(still, forces=ForceLimits()).outcome == "certified"


def test_a_walk_without_forces_is_not_certified_but_breaks_no_promise(short_plan: Plan) -> None:
    """Joint velocities jump at the knots of a polyline: no forces make that."""
    certificate = verify(short_plan, collisions=False, forces=ForceLimits())
    assert certificate.ok and certificate.outcome == "kinematics only"
    check = certificate["contact forces"]
    assert check.status == "violated" and not check.promised and "not promised" in str(check)


def test_a_robot_without_masses_has_no_true_centre_of_mass(short_plan: Plan) -> None:
    urdf = re.sub("<inertial>.*?</inertial>", "", short_plan.robot.urdf, flags=re.DOTALL)
    weightless = dataclasses.replace(short_plan, robot=Quadruped.from_urdf(urdf, "weightless"))
    certificate = verify(weightless, collisions=False, forces=ForceLimits())
    assert certificate.ok and certificate.outcome == "kinematics only"
    for name in ("margin of the true COM", "contact forces"):
        assert certificate[name].status == "unchecked" and "no mass" in certificate[name].note


def test_what_is_unchecked_is_never_certified(wang: Quadruped) -> None:
    still = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=1), timing="velocity")
    certificate = verify(still, collisions=False, forces=ForceLimits())
    assert certificate.ok and certificate.outcome == "not all checked"


def test_a_cubic_that_overshoots_between_its_knots_is_caught(wang: Quadruped) -> None:
    """At rest at every knot, within limits on average, too fast in between."""
    still = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=1), timing="velocity")
    values = still.path.knots()[0]
    limit, duration = float(wang.velocity_limits[0]), 1.0
    way = 0.8 * limit * duration
    cubic = np.zeros((4, 1, len(values)))
    cubic[3, 0] = values
    cubic[1, 0, 6], cubic[0, 0, 6] = 3 * way / duration**2, -2 * way / duration**3
    fast = dataclasses.replace(still, path=MotionPath([0.0, duration], cubic))
    ends = fast.at([0.0, duration]).v[:, 6]
    assert np.abs(ends).max() < 1e-12
    check = verify(fast, collisions=False)["joint velocities"]
    assert check.status == "violated" and check.worst == pytest.approx(1.2, rel=1e-6)


def test_flights_that_last_several_phases_agree_with_the_path() -> None:
    flying = gaitopt.plan_gait(gaitopt.load_robot("a1"), gaitopt.trot(0.5, 0.4),
                               velocity=0.3, distance=0.4, timing="velocity")  # fmt: skip
    assert verify(flying, collisions=False)["phases agree with the path"].status == "ok"


def test_what_is_not_judged_is_listed(short_plan: Plan) -> None:
    certificate = verify(short_plan, collisions=False)
    assert "margins of single phases" in certificate["not judged"].note
    assert "the robot's own file" not in {c.name for c in certificate}


def test_a_robot_that_nobody_knows_is_said_to_be_judged_by_its_own_file(
    short_plan: Plan,
) -> None:
    unknown = dataclasses.replace(short_plan.robot, name="my robot")
    plan = dataclasses.replace(short_plan, robot=unknown)
    assert "'my robot'" in verify(plan, collisions=False)["the robot's own file"].note
    compared = verify(plan, unknown, collisions=False)
    assert "the robot's own file" not in {c.name for c in compared}


def test_a_plan_for_another_urdf_is_refused(short_plan: Plan) -> None:
    heavier = Quadruped.from_urdf(short_plan.robot.urdf + "<!-- changed -->", "wang2020")
    with pytest.raises(RobotError, match="plan again for this robot"):
        verify(short_plan, heavier)
    with pytest.raises(RobotError, match="fingerprint"):
        verify(dataclasses.replace(short_plan, robot=heavier))


def test_what_is_no_plan_and_no_robot_is_refused(short_plan: Plan) -> None:
    with pytest.raises(InputError, match="plan must be a Plan, got a str"):
        verify("plan.npz")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="robot must be a Quadruped, got a str"):
        verify(short_plan, "wang2020")  # type: ignore[arg-type]


def test_a_violation_is_raised_with_its_numbers(short_plan: Plan) -> None:
    certificate = verify(foot_moved_by_a_millimetre(short_plan), collisions=False)
    with pytest.raises(CertificateError, match=r"slip of standing feet: violated, 0\.00\d+ <= 0"):
        certificate.raise_for_violations()
    assert "wang2020: violated" in certificate.report()
    error = pickle.loads(pickle.dumps(CertificateError("words", certificate)))
    assert isinstance(error.certificate, Certificate)
    with pytest.raises(KeyError, match="no check 'luck'"):
        certificate["luck"]


def test_what_is_not_followed_to_the_end_is_not_called_free_of_collisions(
    short_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    from gaitopt.certificate.collisions import pair_search
    from gaitopt.certificate.collisions.self_collision import self_collision

    # One piece that leads from the start to the end: its bounds on what moves are wide.
    ends = short_plan.path.knots()[[0, -1]]
    ends[1, 6:] = ends[0, 6:] + 0.05
    slow = dataclasses.replace(short_plan, path=MotionPath.polyline([0.0, 1.0], ends))
    assert self_collision(slow).status == "ok"
    monkeypatch.setattr(pair_search, "MOST_ROUNDS", 1)
    check = self_collision(slow)
    assert check.status == "unchecked" and "do not lead to the end" in check.note
