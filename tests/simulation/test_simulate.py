"""Walks in physics: what succeeds, what falls, and that each is told from the other."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import (
    LEGS,
    Footholds,
    InputError,
    MissingPackageError,
    MotionPath,
    Plan,
    Quadruped,
    RobotWarning,
)
from gaitopt.simulation.result import (
    MissedFoothold,
    MissReason,
    SimulationResult,
    SimulationStatus,
)
from gaitopt.simulation.settings import SimulationSettings
from gaitopt.simulation.simulate import simulate
from gaitopt.studies.disturbances import push_settings, static_push

pytest.importorskip("mujoco")


@pytest.fixture(scope="module")
def four_steps(wang: Quadruped) -> Plan:
    """One step of each leg: half of the time of the short plan."""
    return gaitopt.plan_crawl(wang, gaitopt.s_columns(3, columns=2), timing="velocity")


@pytest.fixture(scope="module")
def walk(short_plan: Plan) -> SimulationResult:
    return simulate(short_plan)


def test_notebooks_show_the_verdict_in_colour_and_words(
    short_plan: Plan, walk: SimulationResult
) -> None:
    steps = len(short_plan.swings)
    assert repr(walk) == f"SimulationResult(passed, {steps} of {steps} steps)"
    shown = walk._repr_html_()
    assert shown.startswith('<b style="color:#1b7f4b">passed</b>') and "missed footholds" in shown
    fallen = replace(walk, status=SimulationStatus.FELL)
    assert "failed, fell" in repr(fallen) and "#b3261e" in fallen._repr_html_()


def test_a_short_walk_finishes_with_every_foot_on_its_column(
    short_plan: Plan, walk: SimulationResult
) -> None:
    assert walk.succeeded, str(walk)
    assert walk.steps_done == walk.steps == 8
    radius = short_plan.footholds.radius
    assert radius is not None and walk.landing_error < 0.25 * radius
    assert walk.tilt < np.radians(1.0)
    assert walk.body_error < 0.01
    assert walk.smallest_margin > 0.0
    assert walk.rates_within and walk.torque_use < 1.0


def test_the_record_says_so_too(short_plan: Plan, walk: SimulationResult) -> None:
    """The verdict again, from the motion and the footholds alone."""
    motion = walk.motion
    last = motion.feet[-1]
    for leg, foot in zip(LEGS, last, strict=True):
        assert np.linalg.norm(foot - short_plan.footholds[leg][-1]) < 0.01
    assert motion.contacts[-1].all()
    end = short_plan.duration + 0.5 + walk.waited
    assert motion.t[-1] == pytest.approx(end, abs=0.02)
    assert walk.waited < 0.03 * short_plan.duration
    for i, leg in enumerate(LEGS):
        columns = list(short_plan.robot.leg_columns[leg])
        ours = short_plan.robot.legs[leg].forward(motion.q[-1, 7:][columns])
        turn = np.linalg.norm(motion.feet[-1, i] - motion.q[-1, :3] - ours)
        assert turn < 0.01  # the body is all but level


def test_the_same_walk_twice_is_the_same_walk() -> None:
    quick = gaitopt.load_robot("wang2020-fast")
    plan = gaitopt.plan_crawl(quick, gaitopt.s_columns(1, columns=2), speed=0.2, timing="velocity")
    first, second = simulate(plan), simulate(plan)
    assert np.array_equal(first.motion.q, second.motion.q)
    assert np.array_equal(first.peak_torques, second.peak_torques)
    assert first.energy == second.energy


def test_standing_still_nothing_moves(wang: Quadruped) -> None:
    plan = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=1), timing="velocity")
    result = simulate(plan, SimulationSettings(watch_time=2.0))
    assert result.finished and result.steps == 0
    assert result.body_error < 1e-3 and result.slip < 1e-4
    assert result.peak_rates.max() < 0.01


def test_standing_still_the_ground_carries_the_weight(wang: Quadruped) -> None:
    """The simulator's own contact forces, after the robot has settled."""
    import mujoco

    from gaitopt.control.tracking import TrackingController
    from gaitopt.simulation.model import build_sim_model
    from gaitopt.simulation.simulate import _Run

    plan = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=1), timing="velocity")
    settings = SimulationSettings(stand_time=1.0)
    controller = TrackingController(plan, dt=settings.control_interval)
    sim = build_sim_model(wang, plan.footholds, settings)
    data = _Run(mujoco, plan, sim, controller, settings)._start()
    mujoco.mj_forward(sim.model, data)
    total, force = np.zeros(3), np.zeros(6)
    for i in range(data.ncon):
        mujoco.mj_contactForce(sim.model, data, i, force)
        total += data.contact.frame[i].reshape(3, 3).T @ force[:3]
    assert abs(total[2]) == pytest.approx(9.81 * wang.mass, rel=1e-3)
    assert np.abs(total[:2]).max() < 0.1


def test_a_missing_column_is_missed(short_plan: Plan, wang: Quadruped) -> None:
    points = {leg: short_plan.footholds[leg].copy() for leg in LEGS}
    points["RF"][1] += [0.0, -0.3, 0.0]
    planted = replace(short_plan, footholds=Footholds(points, short_plan.footholds.radius))
    result = simulate(planted, SimulationSettings(column_height=0.4))
    assert not result.succeeded
    assert result.missed and result.missed[0].leg == "RF" and result.missed[0].step == 1
    assert result.missed[0].reason == "no contact"


def test_columns_five_millimetres_too_low_are_found(four_steps: Plan) -> None:
    """The plan's clock waits for each foot, which reaches down."""
    errors = tuple((leg, 1, -0.005) for leg in LEGS)
    result = simulate(four_steps, SimulationSettings(column_errors=errors))
    assert result.succeeded, str(result)
    for i, leg in enumerate(LEGS):
        lowest = result.motion.feet[:, i, 2].min()
        assert lowest == pytest.approx(four_steps.footholds[leg][1, 2] - 0.005, abs=1.5e-3)


def test_a_body_outside_the_support_triangle_falls(short_plan: Plan) -> None:
    result = simulate(leaning(short_plan, np.array([0.0, 0.10, 0.0])))
    assert result.status == "fell"
    assert not result.finished and not result.succeeded
    assert result.end < short_plan.duration
    assert result.steps_done < result.steps
    assert "fell at" in str(result)
    assert str(result).startswith("failed: the robot fell")
    # What was never reached is missed, and every step is either done or missed.
    never = result.never_reached
    assert len(never) == result.steps - result.steps_done == np.isnan(result.landing_errors).sum()
    assert f"footholds never reached: {len(never)}" in result.verdict
    assert f"{len(never)} never reached, from step {never[0].step + 1} on" in str(result)
    assert "missed footholds: none" not in str(result)


def test_recorded_forces_and_torques_hold_the_robot(
    walk: SimulationResult, short_plan: Plan, wang: Quadruped
) -> None:
    """At the end it stands: the feet bear its weight, and the legs J^T f and their own weight."""
    assert walk.forces.shape == (len(walk.motion), 4, 3)
    assert walk.forces[-1].sum(axis=0)[2] == pytest.approx(9.81 * wang.mass, rel=5e-3)
    assert not walk.forces[~walk.motion.contacts].any()
    model, data = wang.model, wang.model.createData()
    q = walk.motion.q[-1]
    weight = pin.computeGeneralizedGravity(model, data, q)
    for i, leg in enumerate(LEGS):
        frame = model.getFrameId(wang.legs[leg].foot)
        jacobian = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
        weight = weight - jacobian[:3].T @ walk.forces[-1, i]
    assert np.abs(weight[6:] - walk.torques[-1]).max() < 0.05 * np.abs(walk.torques[-1]).max()
    assert walk.plan_times[-1] >= short_plan.duration
    assert (np.diff(walk.plan_times) >= 0.0).all()


def test_the_report_begins_with_the_verdict_and_all_its_reasons(walk: SimulationResult) -> None:
    """Joint velocities beyond the tolerance fail a walk of which all else is right."""
    assert walk.passed and str(walk).startswith("passed\n")
    fast = replace(walk, rate_use=1.304)
    assert not fast.missed and not fast.passed
    assert str(fast).startswith("failed: a joint velocity reached 130.4% of its limit")
    beside = MissedFoothold(1, "RF", 0.03, MissReason.BESIDE)
    both = replace(fast, missed=(beside,))
    assert both.verdict.startswith("failed: footholds missed: 1; a joint velocity reached")
    assert len(both.failures) == 2 and walk.failures == ()
    left = replace(walk, missed=(MissedFoothold(1, "RF", 0.03, MissReason.LEFT),))
    assert "footholds missed: 1; no inertia of its motors is known" in left.verdict
    assert replace(left, known_motors=True).verdict == "failed: footholds missed: 1"
    warned = replace(both, doubts=("joints that rub",))
    assert warned.verdict.endswith("(--motor-inertia); joints that rub")
    # What helps is told once, also where feet lose their places and joints are too fast.
    assert replace(fast, missed=left.missed).verdict.count("no inertia of its motors") == 1
    assert walk.doubts == () and replace(walk, doubts=("joints that rub",)).verdict == "passed"
    assert "missed footholds: RF in step 2 stood beside its foothold\n" in str(both)
    assert all(reason.words for reason in MissReason)


def leaning(plan: Plan, offset: np.ndarray) -> Plan:
    """The same feet, with the body ``offset`` to the side all the time."""
    times = plan.path.times
    motion, values = plan.at(times), plan.path.knots()
    values[:, :3] += offset
    for i, leg in enumerate(LEGS):
        columns = 6 + np.array(plan.robot.leg_columns[leg])
        values[:, columns] = plan.robot.legs[leg].inverse(motion.feet[:, i] - values[:, :3])
    return replace(plan, path=MotionPath.polyline(times, values))


def test_a_push_far_beyond_the_static_limit_tips_it(four_steps: Plan) -> None:
    swing = next(p for p in four_steps.phases if p.kind == "swing" and p.step == 2)
    result = simulate(four_steps, push_settings(swing, "+y", 10.0 * static_push(four_steps)))
    assert not result.succeeded
    assert result.status == "fell" or result.missed


def test_a_push_well_below_it_does_not(four_steps: Plan) -> None:
    swing = next(p for p in four_steps.phases if p.kind == "swing" and p.step == 2)
    assert simulate(four_steps, push_settings(swing, "+y", 0.4 * static_push(four_steps))).succeeded


def test_numbers_that_run_away_are_a_fall_not_an_error(short_plan: Plan) -> None:
    gains = gaitopt.control.gains.ControlGains.for_robot(
        short_plan.robot, joint_damping=0.0, joint_stiffness=1e9
    )
    result = simulate(short_plan, gains=gains)
    assert result.status in ("fell", "diverged")
    assert np.isfinite(result.motion.q).all()


def test_a_robot_that_only_stands_does_not_pass_where_physics_breaks_down(
    wang: Quadruped, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Torques that MuJoCo takes for none: it warns (in a file, too), and goes on without them."""
    monkeypatch.chdir(tmp_path)
    text = wang.urdf.replace("</joint>", '<dynamics friction="1e12"/></joint>')
    with pytest.warns(RobotWarning, match="joints that rub"):
        rubbing = gaitopt.load_robot(text)
    stand = gaitopt.plan_crawl(rubbing, gaitopt.s_columns(0, columns=1), timing="velocity")
    result = simulate(stand)
    assert not result.passed and result.status is SimulationStatus.DIVERGED
    assert result.verdict.startswith("failed: the robot diverged; joints that rub")


def test_without_mujoco_the_error_says_what_to_install(
    short_plan: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "mujoco", None)
    with pytest.raises(MissingPackageError, match=r"pip install 'gaitopt\[sim\]'"):
        simulate(short_plan)


@pytest.mark.parametrize(
    ("row", "margin"), [("swing", 0.02), pytest.param("height", 0.03, marks=pytest.mark.slow)]
)
def test_time_optimal_walks_cross_within_the_servos_limits(
    wang: Quadruped, row: str, margin: float
) -> None:
    """Joints at their limits most of the time, velocities that jump: no joint is 20 % too fast."""
    plan = gaitopt.plan_crawl(
        wang,
        gaitopt.s_columns(3, columns=3),
        objective="time",
        free=row,
        stability_margin=margin,
        timing="velocity",
    )
    result = simulate(plan)
    assert result.succeeded, str(result)
    assert result.rate_use < 1.2
    assert result.landing_error < 4e-3
    # The handover of loads takes its time, and that is all that is added.
    assert result.waited < 0.08 * plan.duration


@pytest.mark.slow
def test_the_dynamic_row_is_walked_without_a_stop(wang: Quadruped) -> None:
    """Its body leaves the support triangle; the ground's forces push it as planned."""
    plan = gaitopt.plan_crawl(
        wang,
        gaitopt.s_columns(3, columns=5),
        objective="time",
        free="dynamic",
        stability_margin=0.03,
        timing="velocity",
    )
    result = simulate(plan)
    assert result.passed, str(result)
    assert result.waited == 0.0
    assert result.body_error < 4e-3


def test_servos_without_a_speed_limit_correct_faster_than_joints_may(wang: Quadruped) -> None:
    plan = gaitopt.plan_crawl(
        wang,
        gaitopt.s_columns(3, columns=2),
        objective="time",
        free="height",
        stability_margin=0.03,
        timing="velocity",
    )
    free = simulate(plan, SimulationSettings(rate_limits=False))
    assert free.rate_use > simulate(plan).rate_use


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_the_papers_walk_crosses_all_columns(wang: Quadruped, seed: int) -> None:
    result = simulate(gaitopt.plan_crawl(wang, gaitopt.s_columns(seed), timing="velocity"))
    assert result.succeeded, str(result)
    assert result.rates_within
    assert result.real_time_factor > 10


@pytest.mark.parametrize(("name", "margin"), [("a1", 0.03), ("anymal_c", 0.04)])
def test_other_robots_walk_on_flat_ground(name: str, margin: float) -> None:
    from gaitopt.terrain.columns import s_columns

    robot = gaitopt.load_robot(name)
    footholds = Footholds(dict(s_columns(0, columns=3, robot=robot).points), None)
    plan = gaitopt.plan_crawl(
        robot, footholds, speed=0.2, stability_margin=margin,
        body_height=robot.standing_height, swing_height=0.04,
        timing="velocity",
    )  # fmt: skip
    result = simulate(plan)
    assert result.passed, str(result)


@pytest.mark.parametrize("name", ["wang2020-fast", pytest.param("a1", marks=pytest.mark.slow)])
def test_the_trot_of_the_second_paper_is_walked(name: str) -> None:
    """0.3 m/s over 1.5 m on two feet at a time, from standing to standing."""
    plan = gaitopt.plan_gait(
        gaitopt.load_robot(name), gaitopt.trot(0.5), velocity=0.3, distance=1.5
    )
    result = simulate(plan)
    assert result.passed, str(result)
    assert result.waited == 0.0
    assert result.motion.q[-1, 0] == pytest.approx(plan.distance, abs=0.03)


def test_a_walk_by_velocity_and_a_turn_are_walked() -> None:
    robot = gaitopt.load_robot("wang2020-fast")
    for schedule, velocity, rate in ((gaitopt.walk(1.6, 0.85), 0.08, 0.0),
                                     (gaitopt.trot(0.5), 0.0, 0.4)):  # fmt: skip
        result = simulate(
            gaitopt.plan_gait(robot, schedule, velocity=velocity, yaw_rate=rate, duration=1.0)
        )
        assert result.passed, str(result)


def test_arguments_of_other_kinds_are_refused(short_plan: Plan) -> None:
    for arguments, words in (
        ((None,), "plan must be a Plan, got a NoneType"),
        ((short_plan, "fast"), "settings must be a SimulationSettings, got a str"),
        ((short_plan, None, 3.0), "gains must be a ControlGains, got a float"),
    ):
        with pytest.raises(InputError, match=words):
            simulate(*arguments)  # type: ignore[arg-type]


def test_a_robot_without_masses_is_refused(short_plan: Plan) -> None:
    urdf = re.sub("<inertial>.*?</inertial>", "", short_plan.robot.urdf, flags=re.DOTALL)
    weightless = replace(short_plan, robot=Quadruped.from_urdf(urdf, "weightless"))
    with pytest.raises(InputError, match="weightless: its URDF has no masses"):
        simulate(weightless)
