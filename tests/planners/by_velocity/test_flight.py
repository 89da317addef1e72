"""Gaits with flight, and others whose body has to rise and turn: forces, falls and momentum.

Centre of mass and angular momentum are Pinocchio's, which the planner does not ask for them.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import ForceLimits, InfeasibleSpeedError, Plan, plan_gait
from gaitopt.certificate.forces import contact_forces
from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.dynamics.contacts import pyramid_rows
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.motion.path import MotionPath
from gaitopt.planners.by_velocity.attempt import attempt, nominal_motion
from gaitopt.planners.by_velocity.balance_rows import friction_rows
from gaitopt.planners.by_velocity.motion import centre_of_base
from gaitopt.planners.by_velocity.reaction import linearised, reaction

LIMITS = ForceLimits()
NAMES = ("trot", "pronk", "bound")


@pytest.fixture(scope="module")
def plans(flying: Callable[[str], Plan]) -> dict[str, Plan]:
    return {name: flying(name) for name in NAMES}


class Momentum(NamedTuple):
    """Place, velocity and acceleration of the centre of mass, and the spin about it ``(N, 3)``."""

    place: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    spin: FloatArray


def momentum(plan: Plan, times: FloatArray) -> Momentum:
    model = plan.robot.model
    data = model.createData()
    moved = motion_of_path(plan.robot, *(plan.path.evaluate(times, k) for k in range(3)))
    out = np.empty((4, len(times), 3))
    for i, (q, v, a) in enumerate(zip(*moved, strict=True)):
        pin.centerOfMass(model, data, q, v, a)
        out[:3, i] = data.com[0], data.vcom[0], data.acom[0]
        out[3, i] = pin.computeCentroidalMomentum(model, data, q, v).angular
    return Momentum(*out)


def flights(plan: Plan) -> list[FloatArray]:
    """Times inside each flight."""
    return [
        p.start + p.duration * np.linspace(1e-6, 1.0 - 1e-6, 20)
        for p in plan.phases if not p.support
    ]  # fmt: skip


def slower(plan: Plan, factor: float) -> Plan:
    """The same course at a lower speed: everything takes ``factor`` times as long."""
    coefficients = plan.path.coefficients
    powers = np.arange(len(coefficients) - 1, -1, -1.0)
    path = MotionPath(factor * plan.path.times, coefficients / factor ** powers[:, None, None])
    phases = tuple(
        replace(p, start=factor * p.start, duration=factor * p.duration) for p in plan.phases
    )
    return replace(plan, path=path, phases=phases)


def elsewhere(plan: Plan) -> Plan:
    """The same 100 m away."""
    coefficients = plan.path.coefficients.copy()
    coefficients[-1, :, 0] += 100.0
    return replace(plan, path=MotionPath(plan.path.times, coefficients))


@pytest.mark.parametrize("name", NAMES)
def test_gaits_of_a_free_body_are_certified(plans: dict[str, Plan], name: str) -> None:
    certificate = gaitopt.verify(plans[name])
    assert certificate.outcome == "certified", certificate.report()
    assert certificate["contact forces"].status == "ok"


@pytest.mark.parametrize("name", ["trot", "pronk"])
def test_in_flight_the_robot_falls_freely(plans: dict[str, Plan], name: str) -> None:
    plan = plans[name]
    assert plan.record.flight > 0.1
    for times in flights(plan):
        found = momentum(plan, times)
        fall = np.broadcast_to([0.0, 0.0, -GRAVITY], found.acceleration.shape)
        assert found.acceleration == pytest.approx(fall, abs=5e-3)
        # A parabola of known curvature through the first place.
        t = (times - times[0])[:, None]
        parabola = found.place[0] + t * found.velocity[0] + 0.5 * t**2 * fall[0]
        assert found.place == pytest.approx(parabola, abs=1e-6)
        # What legs gain, the body loses: alone it does not keep its spin.
        scale = plan.robot.mass * GRAVITY * plan.robot.stance_size[0] / 2.0 * float(np.ptp(times))
        assert np.ptp(found.spin, axis=0).max() < 5e-4 * scale
        rates = plan.path.evaluate(times, 1)[:, 3:6]
        assert np.ptp(rates, axis=0).max() > 0.05


@pytest.mark.parametrize("name", NAMES)
def test_forces_carry_the_weight_on_average(plans: dict[str, Plan], name: str) -> None:
    """From rest to rest the impulse of all forces is that of the weight."""
    plan = plans[name]
    ends = np.array([p.start for p in plan.phases] + [plan.duration])
    places, weights = np.polynomial.legendre.leggauss(40)
    half = np.diff(ends)[:, None] / 2.0
    times = ends[:-1, None] + half * (1.0 + places)
    moved = motion_of_path(plan.robot, *(plan.path.evaluate(times.ravel(), k) for k in range(3)))
    found = gaitopt.contact_forces(plan, LIMITS, dt=0.01)
    assert found.feasible.all()
    assert found.forces[~found.standing].any() == np.False_
    weight = plan.robot.mass * GRAVITY
    lifts = np.array([
        pin.rnea(plan.robot.model, plan.robot.model.createData(), q, v, a)[:3]
        @ pin.Quaternion(*q[[6, 3, 4, 5]]).toRotationMatrix()[2]
        for q, v, a in zip(*moved, strict=True)
    ])  # fmt: skip
    impulse = float((half * weights * lifts.reshape(times.shape)).sum())
    assert impulse == pytest.approx(weight * plan.duration, rel=1e-4)
    # In stance the feet push more than the weight.
    assert found.forces[..., 2].sum(axis=1).max() > 1.2 * weight


@pytest.mark.parametrize("name", ["trot", "pronk"])
def test_a_body_that_falls_at_nine_tenths_of_g_is_found(plans: dict[str, Plan], name: str) -> None:
    """Played more slowly by the root of it, everything accelerates at nine tenths."""
    plan = plans[name]
    falling = slower(plan, 0.9**-0.5)
    middle = flights(falling)[0]
    assert momentum(falling, middle).acceleration[:, 2] == pytest.approx(-0.9 * GRAVITY, abs=5e-3)
    check = contact_forces(falling, LIMITS)
    assert check.status == "violated" and "cannot make" in check.where
    # A tenth of the weight has nothing that carries it.
    assert check.worst == pytest.approx(-0.1 * plan.robot.mass * GRAVITY, rel=0.1)
    found = gaitopt.contact_forces(falling, LIMITS)
    aloft = ~found.standing.any(axis=1)
    assert aloft.any() and not found.feasible[aloft].any()
    # It counts the same far from the world's origin.
    assert contact_forces(elsewhere(falling), LIMITS).worst == pytest.approx(check.worst, rel=1e-6)
    assert contact_forces(elsewhere(plan), LIMITS).status == "ok"
    # A tenth of a per cent is found as well.
    assert contact_forces(slower(plan, 0.999**-0.5), LIMITS).status == "violated"


def test_a_body_that_keeps_its_pitch_in_flight_is_found(plans: dict[str, Plan]) -> None:
    """The legs' momentum has to come from somewhere."""
    plan = plans["trot"]
    motion = attempt(plan.robot, plan.settings).motion
    assert motion.sway is not None and motion.is_free
    level = motion.sway.coefficients.copy()
    level[:, :, 4] = 0.0
    other = replace(motion, sway=MotionPath(motion.sway.times, level))
    faulty = replace(plan, path=other.path(plan.path.times, 1e-6))
    assert contact_forces(faulty, LIMITS).status == "violated"


def test_plans_with_flight_survive_their_files_and_are_drawn(
    plans: dict[str, Plan], tmp_path: Path
) -> None:
    plan = plans["pronk"]
    plan.save(tmp_path / "pronk.npz")
    loaded = gaitopt.load_plan(tmp_path / "pronk.npz")
    assert [p.margin for p in loaded.phases] == [p.margin for p in plan.phases]
    assert [p.margin == -np.inf for p in plan.phases] == [not p.support for p in plan.phases]
    np.testing.assert_array_equal(loaded.path.coefficients, plan.path.coefficients)
    gaitopt.replay(plan, tmp_path / "pronk.html")
    assert (tmp_path / "pronk.html").stat().st_size > 1e5


def test_feet_land_without_speed(plans: dict[str, Plan]) -> None:
    for plan in plans.values():
        assert plan.path.jumps(1).max() < 1e-6
        for swing in plan.swings:
            near = plan.at(np.array([swing.end - 1e-5, swing.end])).feet
            leg = gaitopt.LEGS.index(swing.leg)
            assert np.linalg.norm(near[1, leg] - near[0, leg]) < 1e-5 * 1e-2


def test_a_bound_pitches_and_a_level_body_cannot(plans: dict[str, Plan]) -> None:
    """Its centre of mass is never above the line of the standing feet."""
    plan = plans["bound"]
    rpy = plan.path.evaluate(np.linspace(0.0, plan.duration, 400))[:, 3:6]
    assert np.radians(5.0) < np.ptp(rpy[:, 1]) < np.radians(20.0)
    assert np.ptp(rpy[:, [0, 2]], axis=0).max() < np.radians(0.5)
    assert plan.record.flight == 0.0


def test_a_turning_trot_with_flight_is_planned() -> None:
    robot = gaitopt.load_robot("a1")
    plan = plan_gait(robot, gaitopt.trot(0.4, 0.4), velocity=(0.2, 0.1), yaw_rate=0.5, duration=0.2)
    assert contact_forces(plan, LIMITS).status == "ok"
    assert gaitopt.verify(plan, collisions=False)["feet on their footholds"].status == "ok"


def test_a_gait_that_forces_do_not_allow_names_a_slower_one_that_works() -> None:
    robot, gait = gaitopt.load_robot("go2"), gaitopt.trot(0.5, 0.4)
    weak = replace(LIMITS, torque_share=0.47)
    with pytest.raises(InfeasibleSpeedError, match="of it works") as caught:
        plan_gait(robot, gait, velocity=0.8, duration=0.0, ramp=0.2, forces=weak)
    error = caught.value
    assert error.limit.split()[0] in ("torque", "friction")
    assert error.fastest is not None and error.velocity is not None
    assert 0.1 < error.fastest < 1.0
    slow = plan_gait(robot, gait, velocity=error.velocity, duration=0.0, ramp=0.2, forces=weak)
    assert contact_forces(slow, weak).status == "ok"


def test_the_centre_of_a_turning_body_moves_as_its_place_does() -> None:
    """Against central differences, for a base that rises, rolls, pitches and turns."""
    robot = gaitopt.load_robot("anymal_c")
    rng = np.random.default_rng(0)
    start, rate, change = rng.normal(size=(3, 1, 6))
    step = 1e-4

    def place(t: float) -> FloatArray:
        states = (start + rate * t + change * t**2 / 2.0, rate + change * t, change)
        return centre_of_base(robot, states)[0]

    _, velocity, acceleration = centre_of_base(robot, (start, rate, change))
    before, now, after = (place(t) for t in (-step, 0.0, step))
    assert velocity == pytest.approx((after - before) / (2.0 * step), abs=1e-6)
    assert acceleration == pytest.approx((after - 2.0 * now + before) / step**2, abs=1e-5)


def test_the_derivatives_of_a_free_body_s_reaction_are_right() -> None:
    """Against central differences, and by what all links weigh."""
    robot = gaitopt.load_robot("a1")
    settings = gaitopt.GaitSettings.for_robot(
        robot, schedule=gaitopt.trot(0.5, 0.4), velocity=0.4, duration=0.3
    )
    motion = nominal_motion(robot, settings)
    times = np.linspace(0.3, 1.5, 7)
    base = np.stack(motion.base(times), axis=1)
    slope = linearised(motion, times, base).slope
    for order, step in enumerate((1e-4, 1e-4, 1e-3)):
        for axis in range(6):
            ends = []
            for sign in (1.0, -1.0):
                moved = base.copy()
                moved[:, order, axis] += sign * step
                ends.append(reaction(motion, times, moved))
            central = (ends[0] - ends[1]) / (2.0 * step)
            assert slope[:, :, order, axis] == pytest.approx(central, abs=2e-3)
    # Legs that stand move less than the body that rises above them.
    assert slope[:, 2, 2, 2] == pytest.approx(1.0 / GRAVITY, rel=0.25)


def test_friction_of_each_of_two_feet_follows_from_the_reaction() -> None:
    rng = np.random.default_rng(1)
    pyramid = pyramid_rows(LIMITS)
    for _ in range(20):
        feet = rng.uniform(-1.0, 1.0, (2, 2))
        forces = rng.uniform([-0.3, -0.3, 0.2], [0.3, 0.3, 1.0], (2, 3))
        along = (feet[1] - feet[0]) / np.linalg.norm(feet[1] - feet[0])
        # What acts along the line is shared evenly.
        shift = 0.5 * (forces[1, :2] - forces[0, :2]) @ along * along
        forces[0, :2] += shift
        forces[1, :2] -= shift
        pressed = (forces[:, 2:] * feet).sum(axis=0)
        turned = (feet[:, 0] * forces[:, 1] - feet[:, 1] * forces[:, 0]).sum()
        value = np.concatenate([forces.sum(axis=0), pressed, [turned]])
        expected = np.concatenate([pyramid @ f for f in (forces.sum(axis=0), *forces)])
        rows = friction_rows(feet, pyramid, each=True)
        assert rows @ value == pytest.approx(expected, abs=1e-12)
        assert rows[:4] == pytest.approx(friction_rows(feet, pyramid, each=False))
