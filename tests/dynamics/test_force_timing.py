"""The fastest timing that forces allow: feasible at every place, and no faster one is."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from body_moves import COUNT, GRID, INTERVALS, Array, Move, has_forces, move

from gaitopt import ForceLimits
from gaitopt.dynamics.chains import program_sequence
from gaitopt.dynamics.chains.interval_programs import interval_programs
from gaitopt.dynamics.chains.sweeps import ProgramSweeps
from gaitopt.dynamics.contacts import TorqueLine
from gaitopt.dynamics.force_timing import fastest_with_forces


class Found(NamedTuple):
    """Squared speeds at the grid, and whether the path can be followed."""

    squares: Array
    stuck: bool
    place: int


def found(given: Move, limits: ForceLimits) -> Found:
    out = fastest_with_forces(given.robot, given.dynamics, INTERVALS, limits, given.timing)
    assert np.array_equal(out.begin[1:], out.end[:-1])
    return Found(np.append(out.begin, out.end[-1]), bool(out.stuck[0]), int(out.places[0]))


def duration(timing: Found) -> float:
    speeds = np.sqrt(timing.squares)
    return float((2.0 * np.diff(GRID) / (speeds[1:] + speeds[:-1])).sum())


@pytest.mark.parametrize("name", ["a1", "anymal_c", "wang2020"])
def test_forces_exist_at_both_ends_of_every_interval(name: str) -> None:
    given, limits = move(name, 0.08), ForceLimits()
    squares = found(given, limits).squares
    assert squares[0] == squares[-1] == 0.0 and (squares[1:-1] > 0.0).all()
    for i, step in enumerate(np.diff(GRID).tolist()):
        u = (squares[i + 1] - squares[i]) / (2.0 * step)
        assert has_forces(given, limits, i, u, squares[i])
        assert has_forces(given, limits, i + 1, u, squares[i + 1])


@pytest.mark.parametrize("name", ["a1", "anymal_c"])
def test_no_interval_could_gain_five_per_cent_more(name: str) -> None:
    """Up to the largest speed the greatest acceleration is used, then the greatest braking."""
    given, limits = move(name, 0.08), ForceLimits()
    squares = found(given, limits).squares
    for i, step in enumerate(np.diff(GRID).tolist()):
        u = (squares[i + 1] - squares[i]) / (2.0 * step)
        more = [has_forces(given, limits, k, 1.05 * u, x) for k, x in
                ((i, squares[i]), (i + 1, squares[i] + 2.1 * step * u))]  # fmt: skip
        assert not all(more) or i == int(squares.argmax()) - 1


def test_twice_the_way_takes_about_the_square_root_of_two_times_as_long() -> None:
    """With a nearly constant greatest acceleration, from rest to rest."""
    limits = ForceLimits()
    times = [duration(found(move("a1", d), limits)) for d in (0.02, 0.04)]
    assert times[1] / times[0] == pytest.approx(np.sqrt(2.0), rel=0.05)


def test_less_friction_is_slower_and_none_is_no_rest() -> None:
    given = move("anymal_c", 0.06)
    times = [duration(found(given, ForceLimits(friction=mu))) for mu in (1.0, 0.6, 0.3)]
    assert times == sorted(times)
    without = found(given, ForceLimits(friction=1e-3, torque_share=0.3))
    assert without.stuck and without.place >= 0


def test_joint_velocities_hold_a_move_back() -> None:
    fast, slow = move("a1", 0.05), move("a1", 0.05, top=0.5)
    limits = ForceLimits()
    assert found(slow, limits).squares.max() == pytest.approx(0.5, rel=1e-6)
    assert duration(found(slow, limits)) > 1.5 * duration(found(fast, limits))


@pytest.mark.parametrize(("top", "acceleration"), [(np.inf, np.inf), (0.6, np.inf), (2.0, 8.0)])
@pytest.mark.parametrize("name", ["a1", "anymal_c"])
def test_polygons_give_what_a_program_for_each_interval_gives(
    name: str, top: float, acceleration: float
) -> None:
    given, limits = move(name, 0.08, top), ForceLimits()
    timing = replace(given.timing, acceleration=acceleration)
    rows = interval_programs(given.robot, given.dynamics, INTERVALS, limits, timing)
    programs = ProgramSweeps(rows, INTERVALS, timing, np.arange(COUNT)).fastest()
    assert not isinstance(programs, int)
    out = fastest_with_forces(given.robot, given.dynamics, INTERVALS, limits, timing)
    assert out.polygons.resting.all()
    for one, other in zip(programs, (out.begin, out.end), strict=True):
        assert other == pytest.approx(one, rel=1e-5, abs=1e-9)
    if np.isfinite(acceleration):
        u = (out.end - out.begin) / (2.0 * np.diff(GRID))
        joints = timing.first[:-1] * u[:, None] + timing.second[:-1] * out.begin[:, None]
        assert np.abs(joints).max() == pytest.approx(acceleration, rel=1e-3)


def test_what_was_learnt_holds_for_other_velocity_limits() -> None:
    limits, slow = ForceLimits(), move("a1", 0.05, top=0.5)
    before = fastest_with_forces(slow.robot, slow.dynamics, INTERVALS, limits, slow.timing)
    timing = move("a1", 0.05).timing
    after = fastest_with_forces(slow.robot, slow.dynamics, INTERVALS, limits, timing, before)
    anew = fastest_with_forces(slow.robot, slow.dynamics, INTERVALS, limits, timing)
    assert after.begin == pytest.approx(anew.begin, rel=1e-6)
    assert after.begin.max() > 1.5 * before.begin.max()


def test_where_the_robot_cannot_rest_each_interval_is_a_program() -> None:
    out = fastest_with_forces(
        *move("anymal_c", 0.06)[:2], INTERVALS, ForceLimits(friction=1e-3, torque_share=0.3),
        move("anymal_c", 0.06).timing,
    )  # fmt: skip
    assert not out.polygons.resting.all() and out.stuck.all()


def with_line(given: Move, limits: ForceLimits, rounds: int) -> list[Found]:
    """Timings with torques that fall, each near the speeds of the one before."""
    fast = found(given, replace(limits, torque_line=None))
    timings = []
    for _ in range(rounds):
        expected = timings[-1].squares if timings else fast.squares
        near = given._replace(timing=replace(given.timing, expected=expected))
        timings.append(found(near, limits))
    return timings


@pytest.mark.parametrize("name", ["a1", "anymal_c"])
def test_torques_that_fall_with_the_speed_are_kept_and_used(name: str) -> None:
    """By an independent formula, at the speeds that the joints have."""
    given = move(name, 0.12)
    fast = found(given, ForceLimits()).squares
    shares = np.abs(given.timing.first) * np.sqrt(fast)[:, None] / given.robot.velocity_limits
    largest = float(shares.max())
    line = TorqueLine(knee=0.3 * largest, no_load=0.8 * largest)
    limits = ForceLimits(torque_share=0.6, torque_line=line)
    timings = with_line(given, limits, 4)
    # A tangent is exact where it touches, so no timing is slower than the one before it.
    times = [duration(timing) for timing in timings]
    assert times[0] >= times[1] >= times[2] >= times[3] * (1.0 - 1e-9)
    assert times[2] == pytest.approx(times[3], rel=2e-3)
    plain = found(given, replace(limits, torque_line=None))
    assert times[3] > 1.01 * duration(plain)
    squares, exceeded = timings[3].squares, 0
    for i, step in enumerate(np.diff(GRID).tolist()):
        u = (squares[i + 1] - squares[i]) / (2.0 * step)
        assert has_forces(given, limits, i, u, squares[i])
        assert has_forces(given, limits, i + 1, u, squares[i + 1])
        more = (plain.squares[i + 1] - plain.squares[i]) / (2.0 * step)
        exceeded += not has_forces(given, limits, i + 1, more, plain.squares[i + 1])
    assert exceeded > 0


@pytest.mark.parametrize(("knee", "no_load"), [(0.005, 0.01), (0.0, 0.001)])
def test_a_line_that_ends_near_rest_is_followed_slowly(knee: float, no_load: float) -> None:
    """At a thousandth of the speed limit, too, the robot can go on."""
    given, limits = move("a1", 0.08), ForceLimits(torque_line=TorqueLine(knee, no_load))
    slow = with_line(given, limits, 2)[-1]
    assert not slow.stuck
    speeds = np.abs(given.timing.first) * np.sqrt(slow.squares)[:, None]
    shares = speeds / given.robot.velocity_limits
    assert 0.3 * no_load < shares.max() <= no_load


def test_polygons_give_what_exact_programs_give_where_rounding_counts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """All joints turn as fast as torques allow: rows that bound ``u`` are nearly parallel to it.

    With violations of 1e-7, which count as rounding otherwise, squared speeds differ by 2.5e-3.
    """
    monkeypatch.setattr(program_sequence, "PROGRAM_TOLERANCE", 1e-9)
    given, limits = move("wang2020", 0.12), ForceLimits(torque_line=TorqueLine(0.1, 0.6))
    expected = found(given, replace(limits, torque_line=None)).squares
    timing = replace(given.timing, expected=expected)
    rows = interval_programs(given.robot, given.dynamics, INTERVALS, limits, timing)
    programs = ProgramSweeps(rows, INTERVALS, timing, np.arange(COUNT)).fastest()
    assert not isinstance(programs, int)
    out = found(given._replace(timing=timing), limits)
    assert out.squares[:-1] == pytest.approx(programs[0], rel=1e-8)


def test_a_line_beyond_all_speeds_changes_nothing() -> None:
    given = move("a1", 0.08)
    line = TorqueLine(knee=50.0, no_load=100.0)
    plain, with_it = (found(given, ForceLimits(torque_line=x)).squares for x in (None, line))
    assert with_it == pytest.approx(plain, rel=1e-6)
