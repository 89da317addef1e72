"""Gaits by velocity: they do what was commanded, are certified, and say so when they cannot.

Gaits with contact forces are tested in ``test_gaits_with_forces.py``; here only joints limit them.
"""

from __future__ import annotations

import dataclasses
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import (
    LEGS,
    GaitSchedule,
    InfeasibleSpeedError,
    InputError,
    Plan,
    Quadruped,
    swing_curve,
    trot,
    walk,
)
from gaitopt.gait.state_machine import GaitStateMachine, LegState
from gaitopt.robots.rotations import rpy_to_matrix

plan_gait = partial(gaitopt.plan_gait, timing="velocity")


@pytest.fixture(scope="module")
def fast() -> Quadruped:
    return gaitopt.load_robot("wang2020-fast")


@pytest.fixture(scope="module")
def straight(fast: Quadruped) -> Plan:
    """The trot of [Wang2024], Section 6, on the catalogue's robot."""
    return plan_gait(fast, trot(0.5), velocity=0.3, distance=1.5, swing="cycloid")


@pytest.mark.parametrize("name", ["wang2020-fast", "a1", "anymal_c", "solo12"])
@pytest.mark.parametrize(
    ("schedule", "velocity", "yaw_rate"),
    [
        (trot(0.5), (0.3, 0.0), 0.0),
        (walk(1.6), (0.08, 0.0), 0.0),
        (trot(0.5), (0.1, 0.0), 0.4),
        (walk(1.6, 0.85), (0.03, 0.03), -0.1),
    ],
    ids=["trot", "walk", "turn", "diagonal walk"],
)
def test_gaits_are_certified(
    name: str, schedule: GaitSchedule, velocity: Any, yaw_rate: float
) -> None:
    plan = plan_gait(
        gaitopt.load_robot(name), schedule, velocity=velocity, yaw_rate=yaw_rate, duration=1.5
    )
    certificate = gaitopt.verify(plan)
    assert certificate.ok, certificate.report()
    assert certificate["ZMP of the body centre"].status == "ok"
    assert certificate["slip of standing feet"].worst < 1e-5


def test_the_plateau_is_walked_at_the_command(straight: Plan) -> None:
    settings = straight.settings
    assert settings.plateau == pytest.approx(5.0)
    ramp = (straight.duration - settings.plateau) / 2.0
    assert ramp >= 2.0 * settings.schedule.cycle_time
    inside = straight.at(np.linspace(ramp, ramp + 5.0, 300))
    np.testing.assert_allclose(inside.v[:, 0], 0.3, atol=1e-9)
    assert inside.cog[-1, 0] - inside.cog[0, 0] == pytest.approx(1.5, abs=1e-9)


def test_it_starts_and_ends_at_rest_on_four_feet_below_the_hips(straight: Plan) -> None:
    ends = straight.at([0.0, straight.duration])
    np.testing.assert_allclose(ends.v[:, :6], 0.0, atol=1e-9)
    under = [straight.robot.legs[leg].hip[:2] + straight.robot.legs[leg].axes[:2, 1]
             * straight.robot.legs[leg].lateral for leg in LEGS]  # fmt: skip
    for row in range(2):
        np.testing.assert_allclose(ends.feet[row, :, :2] - ends.q[row, :2], under, atol=1e-6)
        assert ends.contacts[1].all()


def test_roll_joints_stay_at_zero_on_a_straight_line(straight: Plan) -> None:
    """[Wang2024], Section 6: the lateral joint does not move."""
    for plan in (
        straight,
        plan_gait(gaitopt.load_robot("a1"), trot(0.5), velocity=0.3, distance=0.5),
    ):
        values = plan.path.evaluate(np.linspace(0, plan.duration, 2000))
        for leg in LEGS:
            roll = values[:, 6 + plan.robot.leg_columns[leg][0]]
            assert np.abs(roll).max() < 1e-9


def test_roll_joints_do_move_when_the_body_sways(fast: Quadruped) -> None:
    plan = plan_gait(fast, walk(1.6), velocity=0.05, duration=1.0)
    values = plan.path.evaluate(np.linspace(0, plan.duration, 500))
    assert np.abs(values[:, 6 + fast.leg_columns["LF"][0]]).max() > 0.02


@pytest.mark.parametrize(("name", "knees"), [("a1", None), ("solo12", "backward")])
def test_diagonal_legs_have_identical_curves(name: str, knees: str | None) -> None:
    """[Wang2024], Section 6: LF and RH, RF and LH; angles, velocities and accelerations."""
    robot = gaitopt.load_robot(name, knees and dict.fromkeys(LEGS, knees))
    plan = plan_gait(robot, trot(0.5), velocity=0.3, distance=0.6, swing="cycloid")
    times = np.linspace(0, plan.duration, 1777)
    for order, tolerance in ((0, 1e-9), (1, 1e-6), (2, 1e-3)):
        values = plan.path.evaluate(times, derivative=order)
        for one, other in (("LF", "RH"), ("RF", "LH")):
            a, b = (6 + np.array(robot.leg_columns[leg][1:]) for leg in (one, other))
            np.testing.assert_allclose(values[:, a], values[:, b], atol=tolerance)


def test_knees_that_point_at_each_other_are_no_identical_curves(straight: Plan) -> None:
    """The claim of [Wang2024] needs legs of one kind; wang2020's front and hind knees differ."""
    values = straight.path.evaluate(np.linspace(0, straight.duration, 500))
    a, b = (6 + np.array(straight.robot.leg_columns[leg][1:]) for leg in ("LF", "RH"))
    assert np.abs(values[:, a] - values[:, b]).max() > 0.1


def test_joint_velocities_and_accelerations_are_those_of_the_exact_motion(straight: Plan) -> None:
    """Against inverse kinematics of the analytic feet, differenced to high order."""
    swing = next(s for s in straight.swings if s.leg == "LF" and s.start > 2.0)
    leg, robot = straight.robot.legs["LF"], straight.robot
    curve = swing_curve("cycloid", swing.foot_start, swing.foot_end,
                        straight.settings.swing_height, swing.duration)  # fmt: skip

    def joints(t: np.ndarray) -> np.ndarray:
        base = straight.path.evaluate(t)[:, :6]
        local = np.einsum("nij,ni->nj", rpy_to_matrix(base[:, 3:]) @ robot.body_axes,
                          curve.position(t - swing.start) - base[:, :3])  # fmt: skip
        return np.asarray(leg.inverse(local))

    t = np.linspace(swing.start + 0.02, swing.end - 0.02, 60)
    t = t[np.abs(t - swing.start - swing.duration / 2) > 0.005]
    h, columns = 1e-3, 6 + np.array(robot.leg_columns["LF"])
    rate = (8 * (joints(t + h) - joints(t - h)) - joints(t + 2 * h) + joints(t - 2 * h)) / (12 * h)
    bend = (-joints(t + 2 * h) + 16 * joints(t + h) - 30 * joints(t) + 16 * joints(t - h)
            - joints(t - 2 * h)) / (12 * h * h)  # fmt: skip
    np.testing.assert_allclose(straight.path.evaluate(t, 1)[:, columns], rate, atol=2e-3)
    np.testing.assert_allclose(straight.path.evaluate(t, 2)[:, columns], bend, atol=1.0)
    assert np.abs(bend).max() > 50.0


def test_a_turn_on_the_spot_leads_the_feet_round_the_centre(fast: Quadruped) -> None:
    plan = plan_gait(fast, trot(0.5), velocity=0.0, yaw_rate=0.5, duration=2.0)
    feet = plan.footholds.array
    radii = np.linalg.norm(feet[..., :2], axis=2)
    np.testing.assert_allclose(radii, radii[:, :1] * np.ones(feet.shape[1]), atol=1e-9)
    turned = plan.path.evaluate([plan.duration])[0, 5] - plan.path.evaluate([0.0])[0, 5]
    ramp = (plan.duration - 2.0) / 2.0
    assert turned == pytest.approx(0.5 * (2.0 + ramp))


def test_sideways_is_forward_turned_by_a_quarter(fast: Quadruped) -> None:
    """A robot that walks left has its COG where one that faces left and walks ahead has it."""
    left = plan_gait(fast, trot(0.5), velocity=(0.0, 0.1), distance=0.3)
    ahead = plan_gait(fast, trot(0.5), velocity=0.1, distance=0.3, heading=np.pi / 2)
    t = np.linspace(0, left.duration, 50)
    np.testing.assert_allclose(left.at(t).cog, ahead.at(t).cog, atol=1e-9)


def test_footholds_lie_half_the_stance_s_way_ahead(straight: Plan) -> None:
    """[Wang2024], eqs. (15) and (16), corrected: with the time of the stance, not the swing."""
    ramp = (straight.duration - 5.0) / 2.0
    schedule = straight.settings.schedule
    hip = straight.robot.legs["RF"].hip[0]
    checked = 0
    for swing in straight.swings:
        if swing.leg == "RF" and ramp < swing.end < ramp + 5.0 - schedule.stance_time:
            base = straight.at([swing.end]).q[0, 0]
            ahead = swing.foot_end[0] - base - hip
            assert ahead == pytest.approx(0.3 * schedule.stance_time / 2.0, abs=1e-6)
            checked += 1
    assert checked > 5


def test_swings_are_those_of_the_state_machine(straight: Plan) -> None:
    machine = GaitStateMachine(straight.settings.schedule, straight.settings.cycles)
    events = machine.advance(straight.duration)
    for state, attribute in ((LegState.LIFT_OFF, "start"), (LegState.TOUCHDOWN, "end")):
        told = sorted((e.time, e.leg) for e in events if e.state is state)
        flown = sorted((getattr(s, attribute), s.leg) for s in straight.swings)
        assert [leg for _, leg in told] == [leg for _, leg in flown]
        np.testing.assert_allclose([t for t, _ in told], [t for t, _ in flown], atol=1e-9)


def test_the_paper_s_robot_is_too_slow_and_says_what_would_do(wang: Quadruped) -> None:
    with pytest.raises(
        InfeasibleSpeedError, match=r"a trot of 0\.5 s a cycle are too much"
    ) as caught:
        plan_gait(wang, trot(0.5), velocity=0.3, distance=1.5)
    error = caught.value
    assert error.limit.startswith("velocity ") and error.needed > 5.0
    assert error.limit.split()[1] in str(error) and error.fastest is None
    assert error.cycle_time is not None
    plan_gait(wang, trot(error.cycle_time), velocity=0.0, duration=0.0)


def test_the_fastest_velocity_works_and_hardly_more_does_not(fast: Quadruped) -> None:
    command = dict(yaw_rate=0.3, duration=1.0)
    with pytest.raises(InfeasibleSpeedError) as caught:
        plan_gait(fast, trot(0.5), velocity=(1.2, 0.2), **command)
    error = caught.value
    assert error.velocity is not None and error.yaw_rate is not None
    assert error.velocity[0] == pytest.approx(1.2 * error.fastest)
    found = plan_gait(
        fast, trot(0.5), velocity=error.velocity, yaw_rate=error.yaw_rate, duration=1.0
    )
    assert gaitopt.verify(found, collisions=False).ok
    more = tuple(1.01 * v for v in error.velocity)
    with pytest.raises(InfeasibleSpeedError):
        plan_gait(fast, trot(0.5), velocity=more, yaw_rate=1.01 * error.yaw_rate, duration=1.0)


def test_a_velocity_in_other_units_is_told_one_that_works(fast: Quadruped) -> None:
    """300 mm/s, given as m/s: a thousandth of it is found, too."""
    with pytest.raises(InfeasibleSpeedError) as caught:
        plan_gait(fast, trot(0.5), velocity=300.0, duration=1.0, timing="velocity")
    error = caught.value
    assert error.velocity is not None and 0.3 < error.velocity[0] < 1.5
    assert f"({error.velocity[0]:.4g}, 0) m/s" in str(error)
    plan_gait(fast, trot(0.5), velocity=error.velocity, duration=1.0, timing="velocity")


def test_a_stride_beyond_the_legs_reach_is_refused_by_leg(fast: Quadruped) -> None:
    with pytest.raises(InfeasibleSpeedError, match="the foot of L") as caught:
        plan_gait(fast, trot(4.0), velocity=0.5, duration=8.0)
    assert caught.value.limit.startswith("reach") and 0 < (caught.value.fastest or 0) < 1


def test_accelerations_are_limited_where_asked(fast: Quadruped) -> None:
    free = plan_gait(fast, trot(0.5), velocity=0.2, duration=1.0)
    peak = np.abs(free.path.evaluate(np.linspace(0, free.duration, 5000), 2)[:, 6:]).max()
    kept = plan_gait(fast, trot(0.5), velocity=0.2, duration=1.0, acceleration_limit=1.2 * peak)
    check = gaitopt.verify(kept, collisions=False)["joint accelerations"]
    assert check.status == "ok" and peak <= check.worst <= 1.2 * peak
    with pytest.raises(InfeasibleSpeedError, match=r"rad/s\^2") as caught:
        plan_gait(fast, trot(0.5), velocity=0.2, duration=1.0, acceleration_limit=0.5 * peak)
    assert caught.value.limit.startswith("acceleration")
    with pytest.raises(InfeasibleSpeedError, match=r"would jump by .*'sine arch'"):
        plan_gait(
            fast, trot(0.5), velocity=0.2, duration=1.0, acceleration_limit=1e4, swing="sine arch"
        )


@pytest.mark.parametrize("swing", list(gaitopt.SWING_CURVES))
def test_every_swing_curve_is_flown(fast: Quadruped, swing: str) -> None:
    plan = plan_gait(fast, trot(1.2), velocity=0.05, duration=1.2, swing=swing)
    assert gaitopt.verify(plan, collisions=False).ok
    flight = plan.swings[5]
    curve = swing_curve(swing, flight.foot_start, flight.foot_end, plan.settings.swing_height,
                        flight.duration)  # fmt: skip
    t = np.linspace(flight.start, flight.end, 50)
    flown = plan.at(t).feet[:, LEGS.index(flight.leg)]
    np.testing.assert_allclose(flown, curve.position(t - flight.start), atol=2e-6)


def test_a_swaying_walk_keeps_its_zmp_inside_and_a_straight_one_does_not(fast: Quadruped) -> None:
    sway = plan_gait(fast, walk(1.6, 0.85), velocity=0.08, duration=2.0)
    stiff = plan_gait(fast, walk(1.6, 0.85), velocity=0.08, duration=2.0, sway=False)
    assert sway.record.zmp_margin > 0.02 > 0.0 > stiff.record.zmp_margin


def test_slower_walks_get_a_larger_margin(fast: Quadruped) -> None:
    """Quasi-static gaits: as much margin as the speed allows, at equal steps."""
    margins = [
        plan_gait(
            fast, gaitopt.quasi_static(t, 0.7), velocity=0.1 / t, duration=2 * t
        ).record.zmp_margin
        for t in (1.0, 2.0)
    ]
    assert margins[1] >= margins[0] - 1e-6


def test_flight_is_reported_as_such(fast: Quadruped) -> None:
    plan = plan_gait(fast, trot(0.5, 0.4), velocity=0.1, duration=1.0)
    assert plan.record.flight > 0.1
    assert min(len(p.support) for p in plan.phases) == 0
    assert any(p.margin == -np.inf for p in plan.phases)
    assert gaitopt.verify(plan, collisions=False).ok


def test_the_pace_adapts_to_the_margin(fast: Quadruped) -> None:
    """[XiLing], Section 4: cycles with less margin last longer."""
    even = plan_gait(fast, trot(0.5), velocity=0.3, duration=2.0)
    adapted = plan_gait(fast, trot(0.5), velocity=0.3, duration=2.0, adapt=10.0)
    times = np.array(adapted.settings.cycle_times)
    assert len(set(even.settings.cycle_times)) == 1
    assert np.ptp(times) > 0.01
    # Speeding up costs margin: those cycles are the slow ones.
    assert times[:2].max() > times[len(times) // 2]
    assert gaitopt.verify(adapted, collisions=False).ok


def test_it_survives_its_file(straight: Plan, tmp_path: Path) -> None:
    straight.save(tmp_path / "trot.npz")
    loaded = gaitopt.load_plan(tmp_path / "trot.npz")
    assert loaded.settings == straight.settings
    np.testing.assert_array_equal(loaded.path.coefficients, straight.path.coefficients)
    assert loaded.record == straight.record
    assert [p.support for p in loaded.phases] == [p.support for p in straight.phases]


def test_two_joint_legs_trot_straight_ahead_and_refuse_to_turn() -> None:
    solo = gaitopt.load_robot("solo8")
    plan = plan_gait(solo, trot(0.5), velocity=0.1, duration=1.0)
    assert gaitopt.verify(plan, collisions=False).ok
    with pytest.raises(InfeasibleSpeedError, match="beside its leg's plane"):
        plan_gait(solo, trot(0.5), velocity=0.1, yaw_rate=0.3, duration=1.0)


FAULTS = [
    ({"duration": None, "distance": None}, "either distance"),
    ({"distance": 1.0}, "either distance"),
    ({"duration": -1.0}, "duration must be"),
    ({"velocity": (0.1, 0.2, 0.3)}, "velocity must be"),
    ({"velocity": float("nan")}, "velocity must be"),
    ({"swing": "loop"}, "swing must be one of"),
    ({"ramp": 0.0}, "ramp must be"),
    ({"yaw_rate": float("inf")}, "yaw_rate must be"),
    ({"body_height": -0.1}, "body_height must be"),
    ({"body_height": "high"}, "body_height must be a number"),
    ({"cycle_times": ("slow",)}, "cycle_times must be numbers"),
    ({"duration": 1e5}, "cycles"),
    ({"acceleration_limit": 0.0}, "acceleration_limit must be"),
    ({"adapt": -1.0}, "adapt must be"),
]


@pytest.mark.parametrize(("changes", "words"), FAULTS)
def test_bad_settings_are_refused(fast: Quadruped, changes: dict[str, Any], words: str) -> None:
    arguments: dict[str, Any] = {"velocity": 0.1, "duration": 1.0, **changes}
    with pytest.raises(InputError, match=words):
        plan_gait(fast, trot(0.5), **arguments)


def test_a_distance_needs_a_speed(fast: Quadruped) -> None:
    with pytest.raises(InputError, match="never walked at no speed"):
        plan_gait(fast, trot(0.5), velocity=0.0, distance=1.0)
    with pytest.raises(InputError, match="robot must be a Quadruped, got a "):
        plan_gait("wang2020", trot(0.5), velocity=0.1, duration=1.0)  # type: ignore[arg-type]


def test_a_leg_that_falls_short_only_between_knots_is_a_speed_that_is_too_high() -> None:
    """Found by trying speeds: all knots are within reach, and a time between them is not."""
    with pytest.raises(InfeasibleSpeedError, match=r"the foot of .* m from the hip's") as caught:
        plan_gait(gaitopt.load_robot("solo12"), trot(0.4), velocity=2.0, duration=1.5)
    assert caught.value.limit.startswith("reach")
    assert caught.value.fastest is not None and 0.7 < caught.value.fastest < 1.0


def with_record(plan: Plan, **told: Any) -> Plan:
    return dataclasses.replace(plan, record=dataclasses.replace(plan.record, **told))


def test_planted_faults_of_moving_gaits_are_found(straight: Plan) -> None:
    """ZMP told 2 mm too deep; accelerations and jerks told lower than they are; a velocity jump."""
    told = with_record(straight, zmp_margin=straight.record.zmp_margin + 2e-3)
    check = gaitopt.verify(told, collisions=False)
    assert [c.name for c in check.violations] == ["ZMP of the body centre"]
    peaks = {n: np.abs(straight.path.evaluate(straight.path.times, n)[:, 6:]).max() for n in (2, 3)}
    for field, order, name in (("acceleration_limit", 2, "joint accelerations"),
                               ("jerk_limit", 3, "joint jerks")):  # fmt: skip
        settings = dataclasses.replace(straight.settings, **{field: 0.99 * peaks[order]})
        found = gaitopt.verify(dataclasses.replace(straight, settings=settings), collisions=False)
        assert name in [c.name for c in found.violations]
    corner = gaitopt.MotionPath.polyline(straight.path.times, straight.path.knots())
    settings = dataclasses.replace(straight.settings, acceleration_limit=1e6)
    jumping = dataclasses.replace(straight, path=corner, settings=settings)
    check = gaitopt.verify(jumping, collisions=False)["joint accelerations"]
    assert check.status == "violated" and check.worst == np.inf


@pytest.mark.parametrize("lower", [0.0, 1e-3])
def test_a_leg_that_is_straight_for_an_instant_only_is_named(lower: float) -> None:
    """RH lacks 0.08 um of its foot, for 3 ms: no look at knots sees it; 1 mm lower it reaches."""
    robot = gaitopt.load_robot("anymal_c")
    asked = {"velocity": (0.14503374803704724, 0.0), "yaw_rate": 0.2, "timing": "velocity",
             "duration": 1.4350724237877683}  # fmt: skip
    height, gait = 0.5843964977264403 - lower, trot(2.323741402459996)
    if lower:
        assert plan_gait(robot, gait, body_height=height, **asked).duration > 4.0
    else:
        with pytest.raises(InfeasibleSpeedError, match=r"foot of RH would be.*of it works"):
            plan_gait(robot, gait, body_height=height, **asked)
