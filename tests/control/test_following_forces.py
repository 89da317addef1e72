"""Following a plan that promises forces: its reference, the planned forces, feet that roll."""

from __future__ import annotations

from itertools import pairwise
from math import comb

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, ForceLimits, Plan
from gaitopt.control.build import build_reference
from gaitopt.control.exact_reference import _with_feet_at
from gaitopt.control.forces import ForceStatus
from gaitopt.control.gains import ControlGains
from gaitopt.control.nearest_forces import LIGHT_FRICTION, LegTorques, NearestForces
from gaitopt.control.planned_forces import planned_forces
from gaitopt.control.reference import Reference, legs_in_base
from gaitopt.control.tracking import RobotState, TrackingController
from gaitopt.dynamics.whole_body import equations_of_motion, motion_of_path
from gaitopt.motion.rolling import rolled_away

DT = 0.006


@pytest.fixture(scope="module")
def reference(a1_walk: Plan) -> Reference:
    return build_reference(a1_walk, ControlGains.for_plan(a1_walk), DT)


def middles(reference: Reference) -> np.ndarray:
    """Instants of the plan that the reference's entries are of, while its clock runs."""
    ticks = np.arange(len(reference)) - reference.lead
    times = (ticks + 0.5) * reference.dt
    return np.where(reference.clock.pausing(times), np.nan, reference.clock.plan_time(times))


def test_the_reference_is_the_plan_in_the_middle_of_every_tick(
    a1_walk: Plan, reference: Reference
) -> None:
    times = middles(reference)
    own = np.flatnonzero((times > 0.0) & (times < a1_walk.duration))
    motion = a1_walk.at(times[own])
    assert len(own) > 0.9 * a1_walk.duration / DT
    assert reference.position[own] == pytest.approx(motion.q[:, :3], abs=1e-12)
    assert (reference.standing[own] == motion.contacts).all()
    assert reference.velocity[own] == pytest.approx(motion.v, abs=1e-12)
    assert reference.ahead == DT / 2.0


def test_legs_have_their_feet_where_balls_roll_to(a1_walk: Plan, reference: Reference) -> None:
    """Also where that is far from where the plan has them."""
    offsets = reference.feet - reference.position[:, None]
    places = np.einsum("nfi,nij->nfj", offsets, reference.rotation)
    feet, _ = legs_in_base(a1_walk.robot, reference.joints)
    assert feet == pytest.approx(places, abs=1e-6)
    assert reference.feet_in_base == pytest.approx(feet, abs=1e-15)


def test_joints_that_move_feet_by_centimetres_have_them_there(a1_walk: Plan) -> None:
    a1 = a1_walk.robot
    joints = np.tile(a1.standing_joints(), (5, 1))
    before, _ = legs_in_base(a1, joints)
    away = np.zeros((5, 4, 3))
    away[:, :, 0] = np.linspace(-0.03, 0.03, 5)[:, None]
    feet, _ = legs_in_base(a1, _with_feet_at(a1, joints, away))
    assert feet == pytest.approx(before + away, abs=3e-5)


def test_accelerations_add_up_to_rest(reference: Reference) -> None:
    """It begins and ends at rest, and no part of a jump of the acceleration is lost."""
    speeds = np.cumsum(reference.acceleration, axis=0) * DT
    assert np.abs(speeds[-1]).max() < 1e-9
    middle = speeds - 0.5 * DT * reference.acceleration
    # Within a tick the velocity bends by less than a tick's change of it.
    bends = 0.5 * DT * np.abs(np.diff(reference.acceleration, axis=0)).max(axis=0)
    assert (np.abs(middle - reference.velocity).max(axis=0) <= bends + 1e-9).all()


def test_the_planned_forces_make_the_motion_within_the_limits(
    a1_walk: Plan, reference: Reference
) -> None:
    limits = a1_walk.settings.promised_forces
    assert limits is not None
    times = middles(reference)
    # Between two planned instants with an even acceleration.
    still = np.abs(np.diff(reference.acceleration, axis=0)).max(axis=1) < 1.0
    inside = (times[1:-1] > DT) & (times[1:-1] < a1_walk.duration - DT)
    own = np.flatnonzero(inside & still[1:] & still[:-1]) + 1
    assert len(own) > 20
    values, first, second = (a1_walk.path.evaluate(times[own], order) for order in range(3))
    equations = equations_of_motion(
        a1_walk.robot, motion_of_path(a1_walk.robot, values, first, second)
    )
    left = equations.residuals(reference.forces[own])
    weight = 9.81 * a1_walk.robot.mass
    assert np.abs(left[:, :3]).max() < 0.01 * weight
    normal, standing = reference.forces[..., 2], reference.standing
    assert (normal[~standing] == 0.0).all()
    assert normal[standing].min() > 0.009 * weight
    along = np.linalg.norm(reference.forces[..., :2], axis=-1)
    assert (along[standing] <= 0.6 * normal[standing] * (1.0 + 1e-6)).all()


def test_planned_forces_hand_loads_over_in_the_time_that_the_plan_promises(a1_walk: Plan) -> None:
    """Also while the clock stands still: there loads go over, too."""
    time = 0.1
    plan = gaitopt.retimed(a1_walk, ForceLimits(transfer_time=time))
    reference = build_reference(plan, ControlGains.for_plan(plan), DT)
    standing, normal = reference.standing, reference.forces[..., 2] / (9.81 * plan.robot.mass)
    # Changes are seen at ticks, which are up to one off.
    for leg in range(4):
        for tick in np.flatnonzero(np.diff(standing[:, leg].astype(int))) + 1:
            ticks = np.arange(len(standing))
            near = DT * np.where(ticks < tick, tick - ticks, ticks + 1 - tick)
            assert (normal[:, leg] <= 0.07 + (near + DT) / time + 1e-6).all()
    assert (normal[standing] >= 0.01 - 1e-6).all()


def test_jumps_of_slow_robots_take_some_ticks(wang: gaitopt.Quadruped) -> None:
    """Nothing comes late. Where a foot with a load changes, the tick on more feet takes a share."""
    plan = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=2))
    gains = ControlGains.for_plan(plan)
    assert gains.jump_share == 0.25
    sharp = build_reference(plan, ControlGains.for_plan(plan, jump_share=0.0), DT)
    eased = build_reference(plan, gains, DT)
    assert (eased.standing == sharp.standing).all()
    assert (eased.forces[~eased.standing] == 0.0).all()
    steps = [np.abs(np.diff(r.acceleration, axis=0)).max() for r in (sharp, eased)]
    assert steps[1] < 0.4 * steps[0]
    # The first entry holds while the robot stands before it walks, and the last one after that.
    assert not eased.acceleration[[0, -1]].any()
    # Where nothing changes, six rounds are the binomial numbers of the twelfth order.
    changes = np.flatnonzero((sharp.standing[1:] != sharp.standing[:-1]).any(axis=1)) + 1
    kernel = np.array([comb(12, k) for k in range(13)]) / 2.0**12
    for first, last in pairwise([0, *changes.tolist(), len(sharp)]):
        for now, before in (
            (eased.forces, sharp.forces), (eased.acceleration, sharp.acceleration)
        ):  # fmt: skip
            own = now[first:last].reshape(last - first, -1)
            was = before[first:last].reshape(last - first, -1)
            inner = np.array([np.convolve(c, kernel, mode="valid") for c in was.T]).T
            if last - first > 24:
                assert own[6:-6] == pytest.approx(inner, abs=1e-9)
    loads = np.linalg.norm(sharp.forces, axis=2)
    changing = np.where(sharp.standing[1:] != sharp.standing[:-1],
                        np.maximum(loads[1:], loads[:-1]), 0.0)  # fmt: skip
    heavy = np.flatnonzero(changing.max(axis=1) > 0.2 * 9.81 * wang.mass) + 1
    feet = sharp.standing.sum(axis=1)
    kept = 0
    for first, last in pairwise([0, *heavy.tolist(), len(sharp)]):
        # On three feet nothing comes from a tick on four; from three to three nothing does at all.
        if (first == 0 or feet[first] <= feet[first - 1]) and (
            last == len(sharp) or feet[last - 1] <= feet[last]
        ):
            own, was = eased.acceleration[first:last].sum(axis=0), sharp.acceleration[first:last]
            assert own == pytest.approx(was.sum(axis=0), abs=1e-8)
            kept += 1
    assert kept
    leaving = [
        (tick - 1, leg)
        for tick in heavy.tolist()
        for leg in np.flatnonzero(sharp.standing[tick - 1] & ~sharp.standing[tick])
        if (sharp.standing[tick - 1] >= sharp.standing[tick]).all()
    ]
    eased_loads = np.linalg.norm(eased.forces, axis=2)
    for place in leaving:
        assert eased_loads[place] < loads[place]


def test_forces_of_slow_robots_grow_within_some_ticks(wang: gaitopt.Quadruped) -> None:
    """What is fed forward for a foot grows by a quarter of the weight in a tick of 6 ms."""
    plan = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=1))
    weight = 9.81 * wang.mass
    assert ControlGains.for_plan(plan).growth_time == 0.024
    most = {}
    for growth in (0.0, 0.024):
        controller = TrackingController(plan, ControlGains.for_plan(plan, growth_time=growth), DT)
        none, whole = np.zeros((4, 3)), np.zeros((4, 3))
        whole[0] = [0.0, 0.0, weight]
        all_touch = np.ones(4, dtype=bool)
        controller._filtered(none, all_touch)
        first = controller._filtered(whole, all_touch).reshape(4, 3)
        second = controller._filtered(whole, all_touch).reshape(4, 3)
        most[growth] = first[0, 2] / weight, second[0, 2] / weight
        # A force that falls does so at once.
        assert not controller._filtered(none, all_touch).any()
    assert most[0.0] == pytest.approx((1.0, 1.0))
    assert most[0.024] == pytest.approx((0.25, 0.5))


def test_a_jump_share_that_is_none_is_refused(a1_walk: Plan) -> None:
    with pytest.raises(gaitopt.InputError, match=r"jump_share must be at most 0\.25"):
        ControlGains.for_plan(a1_walk, jump_share=0.3)
    assert ControlGains.for_plan(a1_walk).jump_share == 0.0


def test_with_full_loads_they_are_the_smoothest_forces(a1_walk: Plan) -> None:
    limits = a1_walk.settings.promised_forces
    assert limits is not None
    times = np.linspace(0.01, a1_walk.duration - 0.01, 40)
    values, first, second = (a1_walk.path.evaluate(times, order) for order in range(3))
    motion = motion_of_path(a1_walk.robot, values, first, second)
    standing = a1_walk.at(times).contacts
    ours = planned_forces(a1_walk.robot, motion, standing, standing.astype(float), limits)
    theirs = gaitopt.contact_forces(a1_walk, limits, times=times)
    assert ours == pytest.approx(theirs.forces, abs=1e-4 * theirs.weight)


def test_at_rest_a_foot_with_a_small_share_carries_little() -> None:
    robot = gaitopt.load_robot("a1")
    still = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=1, robot=robot))
    values = still.path.evaluate([0.0])
    motion = motion_of_path(robot, values, 0.0 * values, 0.0 * values)
    all_stand, limits = np.ones((1, 4), dtype=bool), ForceLimits()
    even = planned_forces(robot, motion, all_stand, np.ones((1, 4)), limits)[0, :, 2]
    load = np.array([[1.0, 0.1, 1.0, 1.0]])
    little = planned_forces(robot, motion, all_stand, load, limits)[0, :, 2]
    assert even.min() > 0.15 * 9.81 * robot.mass
    assert little[1] < 0.25 * even[1] and little.sum() == pytest.approx(even.sum())


def test_a_ball_rolls_by_its_radius_times_the_turn_of_the_leg(a1_walk: Plan) -> None:
    """The legs of a1 turn in planes: a foot's pitch is that of the body and of its two joints."""
    robot = a1_walk.robot
    times = np.arange(0.0, a1_walk.swings[0].start, 1e-3)
    motion = a1_walk.at(times)
    rolled = rolled_away(robot, motion.q, motion.v, motion.contacts, 1e-3)
    for i, leg in enumerate(LEGS):
        roll, hip, knee = motion.q[:, 7:][:, list(robot.leg_columns[leg])].T
        assert np.ptp(roll) < 0.1  # nearly upright planes
        turned = (hip + knee)[-1] - (hip + knee)[0]
        assert rolled[-1, i, 0] == pytest.approx(robot.foot_radius * turned, abs=3e-4)
        assert (rolled[:, i, 2] == 0.0).all()
    assert np.abs(rolled[-1, :, 0]).max() > 1e-3


def test_a_foot_lands_beside_its_foothold_by_half_of_its_way(
    a1_walk: Plan, reference: Reference
) -> None:
    times = middles(reference)
    for swing in a1_walk.swings:
        stance = np.flatnonzero(times > swing.end)
        later = [s.start for s in a1_walk.swings if s.leg == swing.leg and s.start > swing.end]
        stance = stance[times[stance] < min(later, default=np.inf)]
        off = reference.feet[stance, LEGS.index(swing.leg), :2] - swing.foot_end[:2]
        assert off.max(axis=0) == pytest.approx(-off.min(axis=0), abs=1e-6)


def test_a_robot_in_its_place_is_given_the_planned_forces_and_torques(
    a1_walk: Plan, reference: Reference
) -> None:
    """At planned places and velocities the whole-body inverse dynamics are fed forward."""
    controller = TrackingController(a1_walk, dt=DT)
    limits = a1_walk.settings.promised_forces
    assert limits is not None
    swing = a1_walk.swings[0]
    tick = reference.tick(0.5 * (swing.start + swing.end))
    time = (tick - reference.lead) * DT
    at = float(reference.clock.plan_time(time + DT / 2.0))
    motion = a1_walk.at([at])
    import pinocchio as pin

    # The controller looks half an interval ahead.
    q = pin.integrate(a1_walk.robot.model, motion.q[0], -0.5 * DT * motion.v[0])
    command = controller.command(time, RobotState(q, motion.v[0], motion.contacts[0]))
    found = gaitopt.contact_forces(a1_walk, limits, times=[at])
    weight = 9.81 * a1_walk.robot.mass
    assert command.share.residual < 1e-3
    assert command.share.forces == pytest.approx(found.forces[0], abs=0.02 * weight)
    reach = max(leg.reach for leg in a1_walk.robot.legs.values())
    assert command.torque == pytest.approx(found.torques[0], abs=0.02 * weight * reach)
    assert command.angles == pytest.approx(motion.q[0, 7:], abs=0.03)


def test_a_foot_that_touches_without_a_force_is_asked_for_little(
    a1_walk: Plan, reference: Reference
) -> None:
    """It would kick: it leaves the ground. Where forces are not measured, touching is bearing."""
    limits = a1_walk.settings.promised_forces
    assert limits is not None
    first = a1_walk.swings[0]
    tick = int(np.flatnonzero(middles(reference) < first.start)[-1])
    leg = int(reference.forces[tick, :, 2].argmax())
    motion = a1_walk.at([middles(reference)[tick]])
    weight = 9.81 * a1_walk.robot.mass
    asked = []
    for bearing in (None, np.ones(4, dtype=bool), np.arange(4) != leg):
        state = RobotState(motion.q[0], 0.0 * motion.v[0], motion.contacts[0], bearing)
        command = TrackingController(a1_walk, dt=DT).command((tick - reference.lead) * DT, state)
        asked.append(command.share.forces[leg, 2] / weight)
    assert asked[0] == asked[1] > 0.2
    assert asked[2] == pytest.approx(0.5 * limits.reserve, abs=1e-9)


@pytest.fixture
def grasp() -> np.ndarray:
    """Wrenches of unit forces on four feet around the body, 0.3 m below it."""
    feet = np.array(
        [[0.2, 0.15, -0.3], [-0.2, 0.15, -0.3], [-0.2, -0.15, -0.3], [0.2, -0.15, -0.3]]
    )
    columns = []
    for foot in feet:
        x, y, z = foot
        columns.append(np.vstack([np.eye(3), [[0, -z, y], [z, 0, -x], [-y, x, 0]]]))
    return np.hstack(columns)


ALL = np.ones(4, dtype=bool)


def test_planned_forces_that_make_the_wrench_are_kept(grasp: np.ndarray) -> None:
    nearest = NearestForces(100.0, 0.2, ForceLimits())
    planned = np.array([[3.0, 1.0, 20.0], [-2.0, 0.0, 40.0], [0.0, -2.0, 15.0], [1.0, 1.0, 25.0]])
    share = nearest.share(grasp, grasp @ planned.reshape(-1), np.ones(4), planned, ALL)
    assert share.forces == pytest.approx(planned) and share.status is ForceStatus.FREE
    assert share.residual < 1e-12


def test_a_wrench_beyond_friction_is_come_near_to_within_the_limits(grasp: np.ndarray) -> None:
    nearest = NearestForces(100.0, 0.2, ForceLimits(friction=0.6, reserve_on_four=0.01))
    planned = np.tile([0.0, 0.0, 25.0], (4, 1))
    share = nearest.share(grasp, np.array([90.0, 0, 100.0, 0, 0, 0]), np.ones(4), planned, ALL)
    along = np.hypot(share.forces[:, 0], share.forces[:, 1])
    assert share.status is ForceStatus.LIMITED
    assert (along <= 0.6 * share.forces[:, 2] + 1e-6).all()
    assert (share.forces[:, 2] >= 0.01 * 100.0 - 1e-6).all()
    assert share.forces[:, 0].sum() > 45.0 and share.residual > 0.05


def test_forces_that_a_joint_is_too_weak_for_are_left_to_other_feet(grasp: np.ndarray) -> None:
    """One joint a leg, with a lever of 0.1 m: the first one has 2 N m, and carries 20 N."""
    nearest = NearestForces(100.0, 0.2, ForceLimits(reserve_on_four=0.01))
    planned = np.array([[0, 0, 30.0], [0, 0, 20.0], [0, 0, 30.0], [0, 0, 20.0]])
    levers = np.tile([[0.0], [0.0], [0.1]], (4, 1, 1))
    efforts = np.array([[2.0], [np.inf], [np.inf], [np.inf]])
    legs = LegTorques(levers, np.zeros((4, 1)), efforts)
    wrench = np.array([0.0, 0.0, 100.0, 0.0, 0.0, 0.0])
    share = nearest.share(grasp, wrench, np.ones(4), planned, ALL, legs)
    assert share.status is ForceStatus.LIMITED and share.residual < 1e-3
    assert share.forces[0, 2] == pytest.approx(20.0, abs=1e-4)
    assert share.forces[:, 2].sum() == pytest.approx(100.0, abs=0.1)
    # What the leg itself needs counts, and a joint that is strong enough changes nothing.
    heavy = LegTorques(levers, np.full((4, 1), -0.5), efforts)
    share = nearest.share(grasp, wrench, np.ones(4), planned, ALL, heavy)
    assert share.forces[0, 2] == pytest.approx(15.0, abs=1e-4)
    strong = LegTorques(levers, np.zeros((4, 1)), np.full((4, 1), 4.0))
    share = nearest.share(grasp, wrench, np.ones(4), planned, ALL, strong)
    assert share.forces == pytest.approx(planned) and share.status is ForceStatus.FREE


def test_a_foot_without_contact_presses_with_the_least_force(grasp: np.ndarray) -> None:
    nearest = NearestForces(100.0, 0.2, ForceLimits(reserve_on_four=0.01))
    planned = np.tile([0.0, 0.0, 25.0], (4, 1))
    contacts = np.array([True, True, True, False])
    share = nearest.share(grasp, np.array([0, 0, 100.0, 0, 0, 0]), np.ones(4), planned, contacts)
    assert share.forces[3] == pytest.approx([0.0, 0.0, 1.0])
    in_air = nearest.share(grasp, np.zeros(6), np.zeros(4), planned, contacts)
    assert not in_air.forces.any()


def test_gains_for_a_plan_with_forces_are_softer_and_quicker(
    a1_walk: Plan, short_plan: Plan
) -> None:
    ours, plain = ControlGains.for_plan(a1_walk), ControlGains.for_robot(a1_walk.robot)
    assert ours.joint_damping < 0.5 * plain.joint_damping
    assert ours.joint_stiffness == plain.joint_stiffness
    assert ours.handover_time < plain.handover_time
    assert ControlGains.for_plan(a1_walk, handover_time=0.2).handover_time == 0.2
    assert ControlGains.for_plan(short_plan) == ControlGains.for_robot(short_plan.robot)


def test_others_do_not_take_over_what_a_foot_bore_that_leaves_the_ground(grasp: np.ndarray) -> None:
    """Two feet on one side of the body cannot make what four make, nor need they try."""
    nearest = NearestForces(100.0, 0.2, ForceLimits(reserve_on_four=0.01))
    planned = np.array([[3.0, 1.0, 20.0], [-2.0, 0.0, 40.0], [0.0, -2.0, 15.0], [1.0, 1.0, 25.0]])
    front = np.array([True, False, False, True])
    share = nearest.share(grasp, grasp @ planned.reshape(-1), np.ones(4), planned, front)
    assert share.forces[front] == pytest.approx(planned[front])
    assert share.forces[~front] == pytest.approx(np.tile([0.0, 0.0, 1.0], (2, 1)))
    pushed = grasp @ planned.reshape(-1) + [0.0, 0.0, 10.0, 0.0, 0.0, 0.0]
    share = nearest.share(grasp, pushed, np.ones(4), planned, front)
    assert planned[front, 2].sum() < share.forces[front, 2].sum() < planned[front, 2].sum() + 10.5


def test_a_foot_with_the_least_load_does_without_half_of_its_friction() -> None:
    """Physics has a little less load there than planned; the others make up for it."""
    limits = ForceLimits(friction=0.6, reserve_on_four=0.02)
    nearest = NearestForces(100.0, 0.2, limits)
    light = [1.1, 0.0, 2.0]
    planned = np.array([light, [10.0, 0.0, 32.0], [10.0, 0.0, 34.0], [-21.1, 0.0, 32.0]])
    grasp = np.concatenate([np.tile(np.eye(3), 4), np.zeros((3, 12))])
    wrench = grasp @ planned.reshape(-1)
    found = nearest.share(grasp, wrench, np.ones(4), planned, np.ones(4, dtype=bool)).forces
    most = (1.0 - LIGHT_FRICTION) * 0.6 * 2.0
    assert np.hypot(*found[0, :2]) <= most + 1e-3
    assert found[0, 2] >= 2.0 - 1e-6
    assert np.abs(found.sum(axis=0) - planned.sum(axis=0)).max() < 0.05


def test_feet_that_land_are_to_be_a_little_below_the_ground(
    a1_walk: Plan, reference: Reference
) -> None:
    """They find it in time; in the middle of its flight a foot is where the plan has it."""
    ticks = np.arange(len(reference)) - reference.lead
    times = reference.clock.plan_time((ticks + 0.5) * DT)
    planned = a1_walk.at(np.clip(times, 0.0, a1_walk.duration)).feet[..., 2]
    below = planned - reference.feet[..., 2]
    depth = ControlGains.for_plan(a1_walk).landing_depth
    for swing in a1_walk.swings:
        leg = LEGS.index(swing.leg)
        flying = np.flatnonzero(~reference.standing[:, leg] & (times < swing.end + DT))
        last = int(flying[-1])
        assert below[last + 1, leg] == pytest.approx(depth, abs=1e-9)
        assert 0.0 < below[last - 2, leg] < below[last - 1, leg] < depth
        middle = int(np.argmin(np.abs(times - 0.5 * (swing.start + swing.end))))
        assert below[middle, leg] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("light", [True, False])
def test_a_leg_brings_the_body_to_its_place_unless_its_foot_bears_hardly_any_load(
    a1_walk: Plan, reference: Reference, light: bool
) -> None:
    """A light foot would be pushed along the ground: with the body it stays where it is."""
    robot, weight = a1_walk.robot, 9.81 * a1_walk.robot.mass
    normal = np.where(reference.standing, reference.forces[..., 2] / weight, np.nan)
    first = a1_walk.swings[0]
    ticks = np.flatnonzero(middles(reference) < first.start)
    leg = int(np.nanargmin(normal[ticks].min(axis=0)) if light else np.nanargmax(normal[ticks[-1]]))
    tick = int(ticks[normal[ticks, leg].argmin()] if light else ticks[-1])
    assert normal[tick, leg] < 0.02 if light else normal[tick, leg] > 0.2
    time = (tick - reference.lead) * DT
    motion = a1_walk.at([middles(reference)[tick]])
    q = np.array(motion.q[0])
    name = LEGS[leg]
    columns = 7 + np.array(robot.leg_columns[name])
    q[0] += 0.003
    controller = TrackingController(a1_walk, dt=DT)
    # Not a moment's way ahead.
    command = controller.command(time, RobotState(q, 0.0 * motion.v[0], motion.contacts[0]))
    now, wanted = robot.legs[name].forward(np.stack([q[columns], command.angles[columns - 7]]))
    ahead = float((robot.body_axes @ (wanted - now))[0])
    assert abs(ahead) < 0.0012 if light else ahead == pytest.approx(0.003, abs=3e-4)
