"""The servos of a simulated robot: no faster and no stronger than their joints may be."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import ArrayLike

import gaitopt
from gaitopt import Quadruped
from gaitopt.control.forces import ForceShare, ForceStatus
from gaitopt.control.gains import FED_FORWARD_SERVO_TIME, ControlGains
from gaitopt.control.tracking import Command
from gaitopt.simulation.model import build_sim_model, to_mujoco
from gaitopt.simulation.servos import Servos, speed_torques
from gaitopt.simulation.settings import SimulationSettings

mujoco = pytest.importorskip("mujoco")

NOTHING = ForceShare(np.zeros((4, 3)), 0.0, 0.0, ForceStatus.FREE)


def hung_up(
    robot: Quadruped, settings: SimulationSettings, seconds: float, start: ArrayLike = 0.0,
    torque: float = 0.0,
) -> tuple[float, Servos]:  # fmt: skip
    """A robot in the air without gravity, its joints told to turn by one radian at once.

    They start at the angles ``start`` [rad], and get ``torque`` [N m] fed forward.

    Returns the largest joint velocity as a share of its limit, and the servos.
    """
    import mujoco

    gains = ControlGains.for_robot(robot)
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=1), timing="velocity")
    sim = build_sim_model(robot, plan.footholds, settings)
    sim.model.opt.gravity[:] = 0.0
    data = mujoco.MjData(sim.model)
    data.qpos[:3] = [0.0, 0.0, 3.0]
    data.qpos[3] = 1.0
    data.qpos[sim.qpos] = start
    mujoco.mj_forward(sim.model, data)
    servos = Servos(sim, robot, gains, settings)
    command = Command(np.full(12, torque), start + np.ones(12), np.zeros(12), NOTHING)
    for _ in range(round(seconds / settings.timestep)):
        servos.drive(data, command, 1)
    return float((servos.peak_rates / robot.velocity_limits).max()), servos


def test_a_servo_turns_no_faster_than_its_limit(wang: Quadruped) -> None:
    """Told to be elsewhere at once, it goes there at its limit; legs pull at one another a bit."""
    fastest, _ = hung_up(wang, SimulationSettings(), 0.5)
    assert 0.95 < fastest < 1.05


def test_a_torque_for_a_load_that_is_not_there_turns_no_joint_far_beyond_its_limit(
    wang: Quadruped,
) -> None:
    """It is fed forward for a foot that has left the ground. Damping alone lets it turn the knees
    by its quotient with it: 8 N m at three times the limit or more."""
    gains = ControlGains.for_robot(wang)
    knees = wang.leg_joint_columns[2::3]
    assert (2.0 * gains.joint_damping * wang.velocity_limits[knees] < 8.0).all()
    fastest, _ = hung_up(wang, SimulationSettings(), 0.1, torque=8.0)
    free, _ = hung_up(wang, SimulationSettings(rate_limits=False), 0.1, torque=8.0)
    assert fastest < 1.3 < 3.0 < free


def test_a_speed_is_held_also_where_the_torque_is_beyond_its_limit(wang: Quadruped) -> None:
    """More is fed forward than the joints can give. Those that stayed at that limit, and were not
    held, turned at eight times their limits."""
    most = 2.0 * float(wang.effort_limits.max())
    fastest, servos = hung_up(wang, SimulationSettings(), 0.02, torque=most)
    assert fastest < 2.5
    assert (servos.peak_torques <= wang.effort_limits * (1.0 + 1e-12)).all()


def test_friction_of_a_joint_does_not_hold_a_slow_servo(wang: Quadruped) -> None:
    """At its speed limit a servo of wang2020 has 3.8 N m for errors; joints that rub with 10 N m
    stood still before friction was fed forward."""
    text = wang.urdf.replace("</joint>", '<dynamics friction="10"/></joint>')
    rubbing = gaitopt.load_robot(text)
    limit = speed_torques(
        rubbing.velocity_limits, ControlGains.for_robot(rubbing), SimulationSettings()
    )
    assert limit.max() < 10.0
    fastest, servos = hung_up(rubbing, SimulationSettings(), 0.5)
    assert 0.9 < fastest < 1.05
    assert (servos.peak_rates > 0.5 * rubbing.velocity_limits).all()


def test_joints_do_not_move_under_less_torque_than_they_rub_with(wang: Quadruped) -> None:
    """They rub with 5 N m and get 4 N m. By default MuJoCo lets a tenth of it through."""
    text = wang.urdf.replace("</joint>", '<dynamics friction="5"/></joint>')
    rubbing = gaitopt.load_robot(text)
    columns = gaitopt.s_columns(0, columns=1)
    sim = build_sim_model(rubbing, columns, SimulationSettings())
    sim.model.opt.gravity[:] = 0.0

    def speed() -> float:
        """Of the fastest joint after 20 ms [rad/s]."""
        data = mujoco.MjData(sim.model)
        data.qpos[2], data.qpos[3] = 3.0, 1.0
        data.ctrl[sim.ctrl] = 4.0
        mujoco.mj_step(sim.model, data, 10)
        return float(np.abs(data.qvel[sim.qvel]).max())

    with_friction = speed()
    sim.model.dof_frictionloss[:] = 0.0
    assert with_friction < 1e-4 * speed()


def test_damping_of_a_joint_does_not_hold_a_servo_back(wang: Quadruped) -> None:
    """Joints of Bittle's file are damped five times as much as its servos damp."""
    settings = SimulationSettings(rate_limits=False, torque_limits=False)
    text = wang.urdf.replace("</joint>", '<dynamics damping="20"/></joint>')
    damped = gaitopt.load_robot(text)

    def error(robot: Quadruped) -> float:
        """How far joints that are to turn at 0.2 rad/s are behind after 0.5 s [rad]."""
        gains = ControlGains.for_robot(robot)
        plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=1), timing="velocity")
        sim = build_sim_model(robot, plan.footholds, settings)
        sim.model.opt.gravity[:] = 0.0
        data = mujoco.MjData(sim.model)
        data.qpos[2], data.qpos[3] = 3.0, 1.0
        servos = Servos(sim, robot, gains, settings)
        rates = np.full(12, 0.2)
        for tick in range(250):
            servos.drive(data, Command(np.zeros(12), rates * tick * 2e-3, rates, NOTHING), 1)
        return float(np.abs(data.qpos[sim.qpos] - 0.1).max())

    assert error(damped) < 1.2 * error(wang) + 1e-3


def test_a_joint_that_moves_as_it_is_told_is_hardly_pushed_between_two_calls(
    wang: Quadruped,
) -> None:
    """A heavy knee that turns at 1 rad/s; a set-point that stands still for 6 ms is 3 ms away from
    it at the begin. Steps of the physics are 2 ms long, and the middle of one is half of that away.
    """
    settings, gains = SimulationSettings(rate_limits=False), ControlGains.for_robot(wang)
    sim = build_sim_model(wang, gaitopt.s_columns(0, columns=1), settings)
    sim.model.opt.gravity[:] = 0.0
    knee, rates = wang.leg_columns["LF"][2], np.zeros(12)
    rates[knee] = 1.0
    sim.model.dof_armature[sim.qvel] = 1e3
    data = mujoco.MjData(sim.model)
    data.qpos[2], data.qpos[3] = 3.0, 1.0
    data.qvel[sim.qvel] = rates
    mujoco.mj_forward(sim.model, data)
    servos = Servos(sim, wang, gains, settings)
    half = settings.control_interval / 2.0
    servos.drive(data, Command(np.zeros(12), half * rates, rates, NOTHING, ahead=half), 3)
    away = servos.peak_torques[knee] / gains.joint_stiffness
    assert away < 1.3e-3


def test_servos_leave_nothing_behind_for_the_next_ones_of_a_model(wang: Quadruped) -> None:
    """A step adds the damping as an inertia; what it adds is no inertia of the motors."""
    settings, gains = SimulationSettings(), ControlGains.for_robot(wang)
    columns = gaitopt.s_columns(0, columns=1)
    sim = build_sim_model(wang, columns, settings)

    def moved() -> np.ndarray:
        """Where the joints are after 30 ms towards an angle of 0.1 rad ``(nj,)`` [rad]."""
        data = mujoco.MjData(sim.model)
        data.qpos[2], data.qpos[3] = 3.0, 1.0
        servos = Servos(sim, wang, gains, settings)
        servos.drive(data, Command(np.zeros(12), np.full(12, 0.1), np.zeros(12), NOTHING), 15)
        return np.array(data.qpos[sim.qpos])

    first = moved()
    assert np.abs(first).max() > 1e-3
    np.testing.assert_array_equal(moved(), first)


def test_small_robots_are_simulated_in_finer_steps() -> None:
    usual = SimulationSettings()
    assert usual.for_reach(0.2) is usual
    small = usual.for_reach(0.1)
    assert (small.timestep, small.contact_time) == pytest.approx((0.001 / 1.8, 0.005 / 1.8))
    assert small.control_interval == pytest.approx(0.003, rel=0.1)
    fine = SimulationSettings(timestep=0.0005, control_every=2).for_reach(0.1)
    assert fine.timestep == 0.0005 and fine.control_interval == pytest.approx(0.001)


def test_without_limits_it_is_much_faster(wang: Quadruped) -> None:
    fastest, _ = hung_up(wang, SimulationSettings(rate_limits=False), 0.5)
    assert fastest > 5.0


def test_work_is_counted_from_the_start_of_the_record(wang: Quadruped) -> None:
    _, servos = hung_up(wang, SimulationSettings(), 0.1)
    assert servos.energy > 0.0
    servos.start_record()
    assert servos.energy == 0.0 and not servos.peak_rates.any()


def test_joints_without_a_limit_have_none(wang: Quadruped) -> None:
    gains, settings = ControlGains.for_robot(wang), SimulationSettings()
    limits = np.array([0.5, np.inf])
    torques = speed_torques(limits, gains, settings)
    assert torques[0] == pytest.approx(0.5 * gains.joint_damping) and np.isinf(torques[1])
    soft = ControlGains.for_robot(wang, joint_damping=0.0)
    assert np.isinf(speed_torques(limits, soft, settings)).all()
    free = SimulationSettings(rate_limits=False)
    assert np.isinf(speed_torques(limits, gains, free)).all()


def test_torques_keep_their_limits(wang: Quadruped) -> None:
    """Told to be elsewhere at once, without a speed limit, every joint uses its whole torque."""
    _, servos = hung_up(wang, SimulationSettings(rate_limits=False), 0.02)
    assert (servos.peak_torques <= wang.effort_limits * (1.0 + 1e-12)).all()
    assert servos.peak_torques == pytest.approx(wang.effort_limits)
    _, free = hung_up(wang, SimulationSettings(rate_limits=False, torque_limits=False), 0.02)
    assert (free.peak_torques > 1.5 * wang.effort_limits).all()


def test_torques_fall_with_the_speed(wang: Quadruped) -> None:
    """A motor without torque at a fifth of the joint's speed limit turns it no faster."""
    limit = float(wang.velocity_limits[0])
    weak = gaitopt.load_robot("wang2020", torque_line=(0.1 * limit, 0.2 * limit))
    fastest, _ = hung_up(weak, SimulationSettings(), 0.5)
    assert 0.18 < fastest < 0.22
    # With steps of a fifth of the length it is the same motion.
    fine, _ = hung_up(weak, SimulationSettings(timestep=4e-4), 0.5)
    assert fastest == pytest.approx(fine, rel=0.02)
    free, _ = hung_up(weak, SimulationSettings(torque_limits=False), 0.5)
    assert free > 0.95


def test_a_light_knee_at_its_torque_limit_does_not_shake() -> None:
    """Within one step of the physics hyq's servos could turn its knees by twice their speed limit.

    With steps of a tenth of the length the same motion is known ten times as finely: the peaks
    agree.
    """
    hyq = gaitopt.load_robot("hyq")
    limits = hyq.model.lowerPositionLimit[7:], hyq.model.upperPositionLimit[7:]
    start = np.mean(limits, axis=0) - 0.5
    coarse, _ = hung_up(hyq, SimulationSettings(), 0.1, start)
    fine, _ = hung_up(hyq, SimulationSettings(timestep=2e-4), 0.1, start)
    assert coarse == pytest.approx(fine, rel=0.03)
    assert coarse < 1.1


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0, 3.0])
def test_ground_stops_a_foot_in_the_same_time_whatever_its_servos_damp(share: float) -> None:
    """Contact forces know the damping: else a foot of a light leg sinks on, four times as long."""
    robot, settings = gaitopt.load_robot("anymal_c"), SimulationSettings()
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=1, robot=robot))
    q = plan.at([0.0]).q[0]
    plan_gains = FED_FORWARD_SERVO_TIME * ControlGains.for_robot(robot).joint_stiffness
    gains = ControlGains.for_robot(robot, joint_stiffness=0.0, joint_damping=share * plan_gains)
    sim = build_sim_model(robot, plan.footholds, settings)
    servos, data = Servos(sim, robot, gains, settings), mujoco.MjData(sim.model)
    data.qpos[:] = to_mujoco(sim, q)
    torques, weight = np.zeros(12), 9.81 * robot.mass
    for name in gaitopt.LEGS:
        own = list(robot.leg_columns[name])
        jacobian = robot.legs[name].jacobian(q[7:][own])
        torques[own] = -jacobian.T @ [0.0, 0.0, weight / 4.0]
        if name == "LF":
            data.qvel[sim.qvel[own]] = np.linalg.solve(jacobian, [0.0, 0.0, -0.3])
    command, speeds = Command(torques, q[7:], np.zeros(12), NOTHING), []
    for _ in range(5):
        servos.drive(data, command, 1)
        mujoco.mj_fwdPosition(sim.model, data)
        by_joints = np.zeros((3, sim.model.nv))
        mujoco.mj_jacSite(sim.model, data, by_joints, None, sim.sites[0])
        speeds.append(float((by_joints @ data.qvel)[2]))
    # In the first step the ground does not feel it yet.
    assert speeds[0] < -0.2
    assert abs(speeds[-1]) < 0.1 * abs(speeds[0])
