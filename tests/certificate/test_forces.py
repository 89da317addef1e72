"""The check of forces: bounds that hold, forces that exist, and planted faults that are found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from shaken_paths import shaken

import gaitopt
from gaitopt import Plan, Quadruped
from gaitopt.certificate.check import Verdict
from gaitopt.certificate.derivative_bounds import LinkBounds
from gaitopt.certificate.enclosure import Pieces
from gaitopt.certificate.force_judge import ForceJudge
from gaitopt.certificate.force_margins import Stances
from gaitopt.certificate.force_samples import chain_model, sample_ends, sample_forces
from gaitopt.certificate.forces import contact_forces
from gaitopt.certificate.inertial_deviations import InertialDeviations
from gaitopt.certificate.phase_forces import ground_in_phases, times_of_stances
from gaitopt.certificate.trace import owners
from gaitopt.dynamics.contacts import ForceLimits, TorqueLine
from gaitopt.dynamics.whole_body import equations_of_motion, motion_of_path
from gaitopt.motion.path import MotionPath
from gaitopt.robots.rotations import rpy_to_matrix

Array = NDArray[np.float64]
LIMITS = ForceLimits()


def random_piece(robot: Quadruped, length: float = 0.2, degree: int = 5) -> Pieces:
    """One piece of a random motion."""
    rng = np.random.default_rng(4)
    size = 6 + len(robot.joint_names)
    scale = np.array([3.0**k for k in range(degree, -1, -1)])[:, None, None]
    coefficients = 0.1 * rng.normal(size=(degree + 1, 1, size)) * scale
    return Pieces(np.zeros(1), np.array([length]), coefficients)


def along(pieces: Pieces, times: Array, derivative: int = 0) -> Array:
    path = MotionPath(np.array([0.0, pieces.lengths[0]]), pieces.coefficients)
    return path.evaluate(times, derivative)


@pytest.mark.parametrize("name", ["wang2020", "a1", "anymal_c"])
def test_no_link_moves_by_more_than_its_bounds(name: str) -> None:
    """Second derivatives of every link's inertial force, by differences, stay below the bound."""
    robot = gaitopt.load_robot(name)
    pieces, model = random_piece(robot), chain_model(robot)
    bounds, data, h = LinkBounds.of(model, pieces), model.createData(), 1e-3
    times = np.linspace(h, pieces.lengths[0] - h, 25)
    order = [0, 1, 2, 5, 4, 3, *range(6, model.nv)]

    def force(t: Array) -> Array:
        """Inertial force of every link ``(N, njoints, 3)``."""
        out = np.zeros((len(t), model.njoints, 3))
        rows = [along(pieces, t, k)[:, order] for k in (0, 1, 2)]
        for i, (q, v, a) in enumerate(zip(*rows, strict=True)):
            pin.forwardKinematics(model, data, q, v, a)
            for j in range(1, model.njoints):
                # The classical acceleration of the link's centre of mass.
                lever, turn = model.inertias[j].lever, data.oMi[j].rotation
                spin, twist = data.v[j].angular, data.a[j]
                linear = twist.linear + np.cross(twist.angular, lever)
                linear += np.cross(spin, data.v[j].linear + np.cross(spin, lever))
                out[i, j] = model.inertias[j].mass * (turn @ linear + [0.0, 0.0, 9.81])
        return out

    second = (force(times + h) - 2.0 * force(times) + force(times - h)) / h**2
    seen = np.linalg.norm(second, axis=2).max(axis=0)
    for j in range(1, model.njoints):
        assert seen[j] <= bounds.inertial_force(j)[2, 0] * (1.0 + 1e-3) + 1e-3
    # Nor are the bounds empty words: some link comes within a factor of fifty.
    limit = np.array([bounds.inertial_force(j)[2, 0] for j in range(1, model.njoints)])
    assert (seen[1:] / limit).max() > 0.02


@pytest.mark.parametrize("name", ["wang2020-fast", "a1", "anymal_c"])
def test_samples_are_the_robot_s_own_dynamics(name: str) -> None:
    """The other model's torques and wrench are those of a free-flying base."""
    robot = gaitopt.load_robot(name)
    plan = gaitopt.plan_gait(
        robot, gaitopt.trot(0.5), velocity=(0.1, 0.05), yaw_rate=0.3, duration=0.3
    )
    times = np.linspace(0.1, plan.duration - 0.1, 7)
    rows = [plan.path.evaluate(times, k) for k in (0, 1, 2)]
    found = sample_forces(robot, *rows)
    equations = equations_of_motion(robot, motion_of_path(robot, *rows))
    whole = equations.forces
    theirs = equations.contacts.jacobians[..., 6:]
    for k, leg in enumerate(gaitopt.LEGS):
        own = theirs[:, k][:, :, list(robot.leg_columns[leg])]
        assert own == pytest.approx(found.jacobians[:, k], abs=1e-9)
    turn = rpy_to_matrix(rows[0][:, 3:6])
    assert np.einsum("nij,nj->ni", turn, whole[:, :3]) == pytest.approx(found.force, abs=1e-9)
    assert np.einsum("nij,nj->ni", turn, whole[:, 3:6]) == pytest.approx(found.moment, abs=1e-9)
    assert whole[:, 6:] == pytest.approx(found.torques, abs=1e-9)
    assert found.feet == pytest.approx(plan.at(times).feet, abs=1e-9)


def test_a_gentle_walk_has_forces_at_every_instant(slow: Plan) -> None:
    check = contact_forces(slow, LIMITS)
    assert check.status is Verdict.OK and 0.0 < check.worst < 0.1 * slow.robot.mass * 9.81


def test_a_polyline_in_joint_space_has_none(short_plan: Plan) -> None:
    check = contact_forces(short_plan, LIMITS)
    assert check.status is Verdict.VIOLATED and "jumps by" in check.where


def test_many_small_jumps_are_a_force(slow: Plan) -> None:
    """Each is rounding, and together they move the body without any force."""
    times = np.linspace(0.0, slow.duration, 4001)
    edges = np.union1d(times, slow.path.times)
    owner = np.clip(np.searchsorted(slow.path.times, edges[:-1], side="right") - 1, 0, None)
    cut = Pieces.of(slow.path).cut(np.bincount(owner, minlength=len(slow.path.times) - 1))
    moved = cut.coefficients.copy()
    moved[-2, :, 0] += 9e-7 * np.arange(moved.shape[1])
    moved[-1, 1:, 0] += np.cumsum(9e-7 * np.arange(moved.shape[1] - 1) * cut.lengths[:-1])
    path = MotionPath(np.append(cut.starts, slow.duration), moved)
    assert path.jumps(1).max() < 1e-6 and path.jumps().max() < 1e-9
    check = contact_forces(replace(slow, path=path), LIMITS)
    assert check.status is Verdict.VIOLATED and "a second" in check.where


def test_a_little_less_friction_than_is_needed_is_found(slow: Plan) -> None:
    """What is left at the ends of a bisection differs by one per cent of friction."""
    low, high = 1e-3, LIMITS.friction
    while high > 1.01 * low:
        middle = np.sqrt(low * high)
        good = contact_forces(slow, replace(LIMITS, friction=middle)).status is Verdict.OK
        low, high = (low, middle) if good else (middle, high)
    check = contact_forces(slow, replace(LIMITS, friction=low))
    # Forces that spare the friction may be held back by the least normal force as much.
    assert check.status is Verdict.VIOLATED
    assert check.where.startswith(("friction", "normal force"))


def test_one_per_cent_less_torque_than_is_needed_is_found(slow: Plan) -> None:
    low, high = 1e-3, LIMITS.torque_share
    while high > 1.01 * low:
        middle = np.sqrt(low * high)
        good = contact_forces(slow, replace(LIMITS, torque_share=middle)).status is Verdict.OK
        low, high = (low, middle) if good else (middle, high)
    check = contact_forces(slow, replace(LIMITS, torque_share=low))
    # Forces that spare the torques may be held back by friction as much.
    assert check.status is Verdict.VIOLATED and check.where.startswith(("torque", "friction"))


def test_a_reserve_that_no_foot_can_keep_is_found(slow: Plan) -> None:
    check = contact_forces(slow, replace(LIMITS, reserve=0.3))
    assert check.status is Verdict.VIOLATED and check.where.startswith("normal force")


def test_a_jerk_of_five_milliseconds_between_samples_is_found(slow: Plan) -> None:
    """A joint shakes by a tenth of a millimetre's worth of angle: none of the knots show it."""
    path, length = slow.path, 5e-3
    piece = int(np.argmax(np.diff(path.times)))
    start = path.times[piece] + 0.3 * (path.times[piece + 1] - path.times[piece])
    joint = 6 + slow.robot.leg_columns["LF"][2]
    check = contact_forces(replace(slow, path=shaken(path, start, length, joint, 1e-3)), LIMITS)
    assert check.status is Verdict.VIOLATED
    assert start - 1e-2 <= check.when <= start + length + 1e-2


def test_a_torque_that_falls_with_the_speed_is_judged_as_at_dense_samples(slow: Plan) -> None:
    """At the ends of a bisection dense samples have forces, and have none where a bit less is."""
    low, high = 0.5, 2.0
    while high > 1.02 * low:
        middle = np.sqrt(low * high)
        good = contact_forces(slow, falling(middle)).status is Verdict.OK
        low, high = (low, middle) if good else (middle, high)
    check = contact_forces(slow, falling(low))
    assert check.status is Verdict.VIOLATED and check.where.startswith("torque")
    for no_load, good in ((high, True), (0.97 * low, False)):
        dense = gaitopt.contact_forces(slow, limits=falling(no_load), dt=0.05)
        assert (dense.feasible_share == 1.0) is good


def falling(no_load: float) -> ForceLimits:
    """Limits with a torque that falls from half the speed without load."""
    return replace(LIMITS, torque_line=TorqueLine(no_load / 2.0, no_load))


@pytest.mark.parametrize("no_load", [0.3, 0.6, 5.0])
def test_a_limit_that_falls_with_the_speed_is_not_below_its_bound(
    wang: Quadruped, no_load: float
) -> None:
    """Dense samples of random motions, slow ones and some that are faster than without load."""
    piece = random_piece(wang, length=0.02)
    level = np.tile([0.0, 0.0, 1.0], (1, 4, 1))
    stances = Stances(wang, falling(no_load), np.arange(4)[None], np.eye(4)[None, :, :3], level,
                      np.full((1, 4), 0.6), np.zeros((1, 3)))  # fmt: skip
    largest = np.abs(along(piece, np.zeros(1), 1)[:, 6:]).max()
    for share in (0.2, 0.5, 0.9, 1.1):
        scale = share * no_load * wang.velocity_limits.max() / largest
        moved = Pieces(piece.starts, piece.lengths, scale * piece.coefficients)
        times = np.linspace(0.0, piece.lengths[0], 101)
        limits = stances.torque_limits(along(moved, times, 1)[:, 6:])
        ends = tuple(each[:, 6:] for each in moved.at_ends(1))
        loss = stances.torque_loss(ends, *(e[:, 6:] for e in moved.enclosure(1)),
                                   moved.largest(3)[:, 6:], moved.lengths)  # fmt: skip
        part = (times / piece.lengths[0])[:, None]
        for limit in (limits.high, -limits.low):
            chord = limit[0] + part * (limit[-1] - limit[0])
            assert (limit >= chord - loss - 1e-12).all()


def test_a_robot_without_mass_is_not_judged(slow: Plan) -> None:
    weightless = gaitopt.Quadruped.from_urdf(
        slow.robot.urdf.replace('mass value="', 'mass value="0.0" was="'), "weightless"
    )
    check = contact_forces(replace(slow, robot=weightless), LIMITS)
    assert check.status is Verdict.UNCHECKED and "no mass" in check.note


def test_three_feet_on_one_line_leave_a_moment_between_samples_too(slow: Plan) -> None:
    """As two feet do: nothing makes the moment about the line."""
    phase, standing = owners(slow, Pieces.of(slow.path))
    mine = np.flatnonzero(phase == next(i for i, p in enumerate(slow.phases) if p.flying))
    pieces, ground = Pieces.of(slow.path).chosen(mine), ground_in_phases(slow, 0.6)
    samples, at = sample_ends(slow.robot, pieces, ground.normals[phase[mine]], phase[mine])
    judge = ForceJudge.of(slow, LIMITS, pieces, phase[mine], standing[mine], samples, at, ground,
                          times_of_stances(slow))  # fmt: skip
    assert judge.stances.makes_any_wrench
    points = judge.stances.points.copy()
    points[:, 1] = (points[:, 0] + points[:, 2]) / 2.0
    aligned = replace(judge, stances=replace(judge.stances, points=points))
    assert not aligned.stances.makes_any_wrench
    found = aligned.left()
    wrench = found.column == found.column.max()
    off = np.linalg.norm(samples.base[at[0]] - judge.stances.centres[judge.owner], axis=1)
    least = InertialDeviations.of(slow.robot, pieces, off).force
    assert wrench.any() and (found.bound[wrench] > least[wrench]).all()


def test_one_sample_stands_for_both_sides_where_nothing_jumps(slow: Plan) -> None:
    """Where the acceleration jumps, or a phase ends, both sides have a sample of their own."""
    robot, count = slow.robot, 6
    whole = random_piece(robot)
    pieces = whole.cut(np.array([count]))
    level = np.tile([0.0, 0.0, 1.0], (count, 4, 1))
    phase = np.array([0, 0, 0, 0, 1, 1])
    bent = pieces.coefficients.copy()
    # From the second piece to the third the acceleration changes by a millionth.
    step = pieces.lengths[0]
    bent[-3, 2] += 1e-6
    bent[-2, 3:] += 2e-6 * step
    bent[-1, 3:] += 1e-6 * step**2 * np.array([1.0, 3.0, 5.0])[:, None]
    samples, at = sample_ends(robot, replace(pieces, coefficients=bent), level, phase)
    assert (at[1, :-1] == at[0, 1:]).tolist() == [True, False, False, False, True]
    assert len(samples.torques) == count + 4
    plain, both = sample_ends(robot, pieces, level, np.zeros(count, dtype=int))
    assert len(plain.torques) == count + 1
    for number, ends in enumerate(both):
        rows = [pieces.at_ends(k)[number] for k in (0, 1, 2)]
        theirs = sample_forces(robot, *rows)
        assert theirs.torques == pytest.approx(plain.torques[ends], abs=1e-9)
        assert theirs.moment == pytest.approx(plain.moment[ends], abs=1e-9)
