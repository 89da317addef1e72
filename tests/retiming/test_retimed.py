"""The same course in another timing: where it goes, what it keeps, and that it is the fastest."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from timings import ROBOTS, Pair, by_velocity, slower

import gaitopt
from gaitopt import ForceLimits, InfeasibleStepError, InputError, Plan, Quadruped, retimed
from gaitopt.dynamics.contacts import TorqueLine
from gaitopt.retiming.smooth import smooth_course

Array = NDArray[np.float64]


def places(plan: Plan, times: Array) -> Array:
    """Body centre and all feet ``(N, 5, 3)``."""
    motion = plan.at(times)
    return np.concatenate([motion.cog[:, None], motion.feet], axis=1)


def distance_from_course(new: Plan, old: Plan) -> float:
    """Largest distance of body or feet from the old plan's curve, phase by phase [m].

    Body and feet are compared with one place of the curve, so they move together as before. At the
    knots of a polyline feet are on their lines; between them, where joints go evenly, they are not
    quite. So only its knots are taken.
    """
    worst = 0.0
    for now, before in zip(new.phases, old.phases, strict=True):
        if before.duration == 0.0:
            continue
        knots, rounding = old.path.times, 1e-12
        times = knots[(knots >= before.start - rounding) & (knots <= before.end + rounding)]
        if old.path.degree > 1:
            times = np.linspace(before.start, before.end, 1501)
        curve = places(old, times).reshape(-1, 15)
        inside = np.linspace(now.start, now.end, 61)
        points = places(new, inside).reshape(-1, 1, 15)
        begin, way = curve[:-1], np.diff(curve, axis=0)
        length = np.maximum((way**2).sum(axis=1), 1e-30)
        share = np.clip(((points - begin) * way).sum(axis=2) / length, 0.0, 1.0)
        off = points - begin - share[..., None] * way
        nearest = np.take_along_axis(
            off, (off**2).sum(axis=2).argmin(axis=1)[:, None, None], axis=1
        )
        worst = max(worst, float(np.linalg.norm(nearest.reshape(-1, 5, 3), axis=2).max()))
    return worst


def assert_certified(plan: Plan) -> None:
    """All that the plan promises holds; self-collisions are not looked at."""
    certificate = gaitopt.verify(plan, collisions=False)
    certificate.raise_for_violations()
    assert certificate["contact forces"].status == "ok" and certificate["contact forces"].promised
    assert certificate["contact sequence"].status == "ok"


@pytest.fixture(scope="module", params=ROBOTS)
def pair(request: pytest.FixtureRequest, pairs: dict[str, Pair]) -> Pair:
    return pairs[request.param]


# ---------------------------------------------------------------- the course


def test_body_and_feet_go_where_they_went(pair: Pair) -> None:
    assert distance_from_course(pair.new, pair.old) < 2e-5


def test_a_smooth_course_is_kept_too(smooth: Pair) -> None:
    assert distance_from_course(smooth.new, smooth.old) < 2e-5


def test_the_test_of_courses_sees_a_tenth_of_a_millimetre(pair: Pair) -> None:
    path = pair.new.path
    coefficients = path.coefficients.copy()
    coefficients[-1, :, 1] += 1e-4
    moved = replace(pair.new, path=gaitopt.MotionPath(path.times, coefficients))
    assert distance_from_course(moved, pair.old) > 5e-5


def test_the_plan_promises_forces_and_keeps_them(pair: Pair) -> None:
    assert pair.new.settings.timing == "forces" and pair.new.settings.forces == ForceLimits()
    assert_certified(pair.new)


def test_more_steps_on_another_terrain() -> None:
    plan = by_velocity(gaitopt.load_robot("anymal_c"), seed=5, columns=3)
    new = retimed(plan)
    assert distance_from_course(new, plan) < 2e-5
    assert_certified(new)


def test_joints_keep_their_velocities(pair: Pair) -> None:
    times = np.linspace(0.0, pair.new.duration, 20_001)
    speeds = np.abs(pair.new.path.evaluate(times, 1)[:, 6:])
    assert (speeds <= pair.new.robot.velocity_limits * (1.0 + 1e-9)).all()


def test_phases_follow_each_other_and_are_the_old_ones(pair: Pair) -> None:
    new, old = pair.new, pair.old
    ends = np.cumsum([p.duration for p in new.phases])
    np.testing.assert_allclose([p.end for p in new.phases], ends, atol=1e-12)
    np.testing.assert_allclose([p.start for p in new.phases[1:]], ends[:-1], atol=1e-12)
    assert new.phases[0].start == 0.0 and ends[-1] == pytest.approx(new.duration, abs=1e-12)
    assert np.isin([p.start for p in new.phases], new.path.times).all()
    for now, before in zip(new.phases, old.phases, strict=True):
        assert (now.kind, now.leg, now.step) == (before.kind, before.leg, before.step)
        assert (now.support, now.margin) == (before.support, before.margin)
        assert not {x.kind for x in now.limited_by} & {"joint velocity", "speed"}


def test_a_walk_phase_by_phase_stops_at_the_ends_of_its_phases(pair: Pair) -> None:
    at_ends = pair.new.path.evaluate(np.array([p.start for p in pair.new.phases]), 1)
    assert np.abs(at_ends).max() < 1e-6


# ---------------------------------------------------------------- the fastest timing


def test_a_little_faster_is_too_fast(pair: Pair) -> None:
    """Limits are planned with 2 % in reserve, which is 1 % of time."""
    certificate = gaitopt.verify(slower(pair.new, 0.97), collisions=False)
    assert {c.name for c in certificate.violations} & {"contact forces", "joint velocities"}


def test_a_slower_plan_of_the_same_course_gets_the_same_timing(pair: Pair) -> None:
    for factor in (0.7, 3.0):
        again = retimed(slower(pair.old, factor))
        # Speeds are 1e-9 less than the largest ones on each interval, and there are many.
        assert again.duration == pytest.approx(pair.new.duration, rel=1e-7)


def test_a_second_time_changes_nothing(pair: Pair) -> None:
    """A retimed plan is smooth, so its course is known in another way."""
    again = retimed(pair.new)
    assert again.duration == pytest.approx(pair.new.duration, rel=1e-3)
    assert_certified(again)


def test_a_slower_smooth_plan_gets_the_same_timing(pair: Pair) -> None:
    again = retimed(slower(pair.new, 2.5))
    assert again.duration == pytest.approx(pair.new.duration, rel=1e-3)


@pytest.mark.parametrize("name", ["go2", "wang2020"])
@pytest.mark.parametrize(
    ("field", "values"),
    [
        ("friction", (0.4, 0.6, 1.0)),
        ("torque_share", (0.5, 0.9, 1.0)),
        ("reserve", (0.05, 0.02, 0.0)),
    ],
)
def test_looser_limits_are_never_slower(
    pairs: dict[str, Pair], name: str, field: str, values: tuple[float, ...]
) -> None:
    given = [replace(ForceLimits(), **{field: value}) for value in values]
    times = np.array([retimed(pairs[name].old, limits).duration for limits in given])
    # Where a limit holds nothing back, rounding of the programs is all that differs.
    assert (np.diff(times) <= 1e-9 * times[:-1]).all()
    if name == "go2":
        assert times[0] > 1.005 * times[-1]


@pytest.mark.parametrize("name", ["anymal_c", "wang2020"])
def test_torques_that_fall_with_the_speed_are_kept(pairs: dict[str, Pair], name: str) -> None:
    """The same plan without the line does not keep it, at instants and by the certificate."""
    limits = ForceLimits(torque_line=TorqueLine(knee=0.1, no_load=0.6))
    plain, slow = pairs[name].new, retimed(pairs[name].old, limits)
    assert gaitopt.contact_forces(slow, dt=0.005, limits=limits).feasible.all()
    assert not gaitopt.contact_forces(plain, dt=0.005, limits=limits).feasible.all()
    assert_certified(slow)
    assert slow.settings.promised_forces == limits
    assert slow.duration > 1.03 * plain.duration
    if name == "wang2020":
        # Its joints turn at their velocity limits, and now at the speed without load.
        assert slow.duration == pytest.approx(plain.duration / 0.6, rel=0.08)


def test_motors_whose_torque_falls_slow_a_plan_of_their_robot(pairs: dict[str, Pair]) -> None:
    """The limits say nothing of it; certificate and forces look at it all the same."""
    old = pairs["wang2020"].old
    limit = float(old.robot.velocity_limits[0])
    robot = gaitopt.load_robot("wang2020", torque_line=(0.1 * limit, 0.6 * limit))
    slow = retimed(replace(old, robot=robot), ForceLimits())
    asked = ForceLimits(torque_line=TorqueLine(knee=0.1, no_load=0.6))
    assert slow.duration == pytest.approx(retimed(old, asked).duration, rel=1e-6)
    assert slow.settings.promised_forces == ForceLimits()
    assert_certified(slow)
    assert gaitopt.contact_forces(slow, dt=0.005).feasible.all()
    plain = pairs["wang2020"].new
    assert not gaitopt.contact_forces(replace(plain, robot=robot), dt=0.005).feasible.all()


def test_joint_velocities_alone_are_the_bound_of_all_timings(pair: Pair) -> None:
    """The old plan has no accelerations to make, so it is faster."""
    assert pair.new.duration > pair.old.duration


def test_which_way_the_walk_goes_does_not_matter(pairs: dict[str, Pair]) -> None:
    robot, straight = pairs["go2"].old.robot, pairs["go2"]
    angle = 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0],
                     [0.0, 0.0, 1.0]])  # fmt: skip
    footholds = straight.old.footholds
    turned = gaitopt.Footholds(
        {leg: footholds.array[i] @ turn.T for i, leg in enumerate(gaitopt.LEGS)}, footholds.radius
    )
    plan = gaitopt.plan_crawl(
        robot, turned, com="model", timing="velocity", heading=angle,
        stability_margin=straight.old.settings.stability_margin,
    )  # fmt: skip
    # Friction pyramids turn with the feet's friction directions, which stay along the world's axes.
    round_cone = replace(ForceLimits(), sides=64)
    here, there = retimed(straight.old, round_cone), retimed(plan, round_cone)
    assert there.duration == pytest.approx(here.duration, rel=1e-3)


# ---------------------------------------------------------------- other limits


@pytest.mark.parametrize("name", ["go2", "wang2020"])
def test_a_given_speed_is_not_exceeded(pairs: dict[str, Pair], name: str) -> None:
    old = pairs[name].old
    capped = retimed(replace(old, settings=replace(old.settings, speed=0.05)))
    motion = capped.sample(1e-3)
    moved = np.linalg.norm(np.diff(places(capped, motion.t), axis=0), axis=2)
    speeds = moved / np.diff(motion.t)[:, None]
    assert speeds.max() <= 0.05 * (1.0 + 1e-6) and speeds.max() > 0.0499
    assert capped.duration > pairs[name].new.duration
    assert_certified(capped)


def test_a_given_speed_is_planned_with(wang: Quadruped) -> None:
    plan = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=2), speed=0.03)
    moved = np.linalg.norm(np.diff(plan.sample(1e-2).cog, axis=0), axis=1)
    assert moved.max() <= 0.03 * 1e-2 * (1.0 + 1e-6)


def test_a_limit_of_accelerations_is_kept(pairs: dict[str, Pair]) -> None:
    old, new = pairs["go2"]
    for limit in (20.0, 5.0):
        settings = gaitopt.RouteSettings(
            free="route", acceleration_limit=limit, timing="velocity", com="model",
            stability_margin=old.settings.stability_margin, body_height=old.settings.body_height,
            swing_height=old.settings.swing_height,
        )  # fmt: skip
        plan = retimed(replace(old, settings=settings))
        times = np.linspace(0.0, plan.duration, 20_001)
        largest = np.abs(plan.path.evaluate(times, 2)[:, 6:]).max()
        assert 0.99 * limit < largest <= limit * (1.0 + 1e-9)
        assert plan.duration > new.duration
        assert_certified(plan)


def test_a_limit_of_accelerations_is_kept_along_a_spline(smooth: Pair) -> None:
    times = np.linspace(0.0, smooth.new.duration, 20_001)
    assert np.abs(smooth.new.path.evaluate(times, 2)[:, 6:]).max() <= 5.0 * (1.0 + 1e-9)


def test_a_jerk_limit_is_refused(smooth: Pair) -> None:
    asked = replace(smooth.old, settings=replace(smooth.old.settings, jerk_limit=100.0))
    with pytest.raises(InputError, match="keeps no jerk limit"):
        retimed(asked)


def test_what_is_no_plan_and_what_are_no_limits_is_refused(smooth: Pair) -> None:
    with pytest.raises(InputError, match="plan must be a Plan, got a NoneType"):
        retimed(None)  # type: ignore[arg-type]
    for limits in (0, "forces"):
        with pytest.raises(InputError, match="forces must be a ForceLimits, got"):
            retimed(smooth.old, limits)  # type: ignore[arg-type]


# ---------------------------------------------------------------- smooth plans


def test_a_smooth_walk_is_followed_without_stops(smooth: Pair) -> None:
    """Through every lift-off and touchdown the body moves on."""
    changes = np.array([p.start for p in smooth.new.phases[1:]])
    speeds = np.linalg.norm(smooth.new.path.evaluate(changes, 1)[:, :3], axis=1)
    assert speeds.min() > 0.05
    assert np.abs(smooth.new.path.jumps(1)).max() < 1e-6
    assert_certified(smooth.new)


def test_a_smooth_walk_is_retimed_to_the_same_again(smooth: Pair) -> None:
    assert retimed(smooth.new).duration == pytest.approx(smooth.new.duration, rel=1e-3)
    assert retimed(slower(smooth.old, 2.0)).duration == pytest.approx(smooth.new.duration, rel=1e-3)


def test_the_speed_of_a_path_is_linear_between_places_where_slow_joints_set_it(
    smooth: Pair,
) -> None:
    """Where another joint becomes the slowest the least speed has a corner, and is looked at."""
    course = smooth_course(smooth.old)
    path, limits = course.path, smooth.old.robot.velocity_limits
    lengths = np.diff(path.times)
    least = [
        np.abs(path.evaluate(path.times[:-1] + share * lengths, 1)[:, 6:] / limits).max(axis=1)
        for share in np.linspace(1e-9, 1.0 - 1e-9, 11)
    ]
    below = (least[0] + least[-1]) / 2.0 - least[5]
    # Without those places it is 0.018.
    assert (below / least[5]).max() < 1e-2
    # At both ends of the walk all joints rest: none is the slowest there.
    assert lengths.min() > 1e-5
    # Knots of a path that was timed are such places already.
    again = smooth_course(smooth.new)
    kinks = [len(c.path.times) for c in (course, again)]
    assert kinks[1] < 1.2 * kinks[0]


# ---------------------------------------------------------------- what cannot be


def test_a_plan_without_motion_stays(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(0, columns=2)
    first = {leg: footholds.array[i, :1] for i, leg in enumerate(gaitopt.LEGS)}
    plan = gaitopt.plan_crawl(wang, gaitopt.Footholds(first), timing="velocity")
    still = retimed(plan)
    assert still.duration == plan.duration == 0.0 and still.settings.timing == "forces"
    np.testing.assert_array_equal(still.path.knots(), plan.path.knots())
    assert_certified(still)


def test_impossible_limits_name_the_step_and_what_is_in_the_way(pair: Pair) -> None:
    with pytest.raises(InfeasibleStepError, match="not even at rest: normal force LF") as caught:
        retimed(pair.old, replace(ForceLimits(), reserve=0.3))
    assert caught.value.step == 0 and caught.value.leg == "RH"
    assert caught.value.conflicts == ("normal force LF",)


def test_too_little_torque_is_named(pair: Pair) -> None:
    with pytest.raises(InfeasibleStepError, match="not even at rest") as caught:
        retimed(pair.old, replace(ForceLimits(), torque_share=0.02))
    assert any(name.startswith("torque ") for name in caught.value.conflicts)


def test_a_trot_cannot_be_followed_with_forces() -> None:
    """Two feet on one line hold a robot at no speed along a path made for joint velocities."""
    trot = gaitopt.plan_gait(
        gaitopt.load_robot("go2"), gaitopt.trot(0.5), velocity=0.2, duration=1.0, timing="velocity"
    )
    with pytest.raises(InfeasibleStepError, match=r"neither at rest \(balance LH-RF\)") as caught:
        retimed(trot)
    assert caught.value.conflicts == ("balance LH-RF",) and "could rest" not in str(caught.value)
    assert caught.value.leg in gaitopt.LEGS and caught.value.step is not None


def test_the_limits_that_a_plan_promises_are_used_again(pairs: dict[str, Pair]) -> None:
    low = replace(ForceLimits(), friction=0.4)
    plan = retimed(pairs["go2"].old, low)
    assert plan.settings.forces == low
    assert retimed(plan).settings.forces == low
    assert retimed(plan).duration == pytest.approx(plan.duration, rel=1e-3)


# ---------------------------------------------------------------- files


def test_a_retimed_plan_survives_its_file(pairs: dict[str, Pair], tmp_path: Path) -> None:
    plan = pairs["go2"].new
    plan.save(tmp_path / "plan.npz")
    loaded = gaitopt.load_plan(tmp_path / "plan.npz")
    assert loaded.settings == plan.settings and loaded.settings.timing == "forces"
    assert [(p.kind, p.leg, p.start, p.duration) for p in loaded.phases] == [
        (p.kind, p.leg, p.start, p.duration) for p in plan.phases
    ]
    np.testing.assert_array_equal(loaded.path.coefficients, plan.path.coefficients)


def test_a_robot_without_masses_is_told_what_to_do() -> None:
    """Some files have no inertias. Joint velocities are all that bounds such a robot."""
    urdf = re.sub(r"<inertial>.*?</inertial>", "", gaitopt.load_robot("wang2020").urdf, flags=re.S)
    robot = gaitopt.Quadruped.from_urdf(urdf, "bare")
    footholds = gaitopt.s_columns(0, columns=2)
    with pytest.raises(InputError, match=r"bare: its URDF has no masses.*timing='velocity'"):
        gaitopt.plan_crawl(robot, footholds)
    plan = gaitopt.plan_crawl(robot, footholds, timing="velocity")
    with pytest.raises(InputError, match="no masses"):
        retimed(plan)
