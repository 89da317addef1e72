"""Paths on which the robot cannot rest: momentum carries it over an edge, or through the air."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import ForceLimits, Quadruped
from gaitopt.conventions import GRAVITY
from gaitopt.dynamics.force_timing import ForceTiming, fastest_with_forces
from gaitopt.dynamics.path_intervals import PathIntervals, TimingLimits
from gaitopt.dynamics.small_programs import NO_BOUND, solve_linear
from gaitopt.dynamics.whole_body import PathDynamics, path_dynamics
from gaitopt.motion.body_and_feet import path_states

Array = NDArray[np.float64]
ROBOTS = ("go2", "anymal_c", "wang2020")
LIMITS = ForceLimits()
RF = 3
"""Column of the right front foot."""
WAY = 0.10
"""Length of the body's move across the edge [m]."""
COUNT = 40


class Chain(NamedTuple):
    """One chain of intervals."""

    robot: Quadruped
    dynamics: PathDynamics
    intervals: PathIntervals
    timing: TimingLimits

    def fastest(self, stop: int | None = None, top: float = np.inf) -> ForceTiming:
        """The fastest timing, with a stop at a sample, or below a squared speed."""
        squares = np.minimum(self.timing.squares, top)
        if stop is not None:
            squares[stop] = 0.0
        timing = TimingLimits(squares, self.timing.first, self.timing.second)
        return fastest_with_forces(self.robot, self.dynamics, self.intervals, LIMITS, timing)

    def times(self, found: ForceTiming) -> Array:
        """How long each interval takes [s]."""
        return 2.0 * self.intervals.lengths / (np.sqrt(found.begin) + np.sqrt(found.end))


def stance(name: str) -> tuple[Quadruped, Array, Array]:
    """A robot, its base as it stands ``(6,)``, and its feet ``(4, 3)`` on a rectangle."""
    robot = gaitopt.load_robot(name)
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * np.array(robot.stance_size) / 2.0
    place = np.array([0.0, 0.0, robot.standing_height]) - robot.centre
    return robot, np.concatenate([place, np.zeros(3)]), np.column_stack([corners, np.zeros(4)])


def across(name: str, beyond: float) -> Chain:
    """The body goes ahead by 10 cm; RF is in the air from 1 cm before to ``beyond`` the diagonal.

    Without RF the edge of the support is the diagonal through the middle. So over a way of
    ``beyond`` the centre of mass is outside.
    """
    robot, base, feet = stance(name)
    s = np.linspace(0.0, 1.0, COUNT + 1)
    bases, change = np.tile(base, (len(s), 1)), np.zeros((len(s), 6))
    bases[:, 0] += WAY * (s - 0.5)
    change[:, 0] = WAY
    still = np.zeros((len(s), 4, 3))
    values, first, second = path_states(
        robot, (bases, change, 0.0 * change), (still + feet, still, still)
    )
    ahead = WAY * ((s[1:] + s[:-1]) / 2.0 - 0.5)
    standing = np.ones((COUNT, 4), dtype=np.bool_)
    standing[(ahead > -0.01) & (ahead < beyond), RF] = False
    intervals = PathIntervals(
        np.arange(COUNT), np.arange(1, COUNT + 1), np.diff(s), standing, np.array([0, COUNT])
    )
    squares = np.full(len(s), np.inf)
    squares[[0, -1]] = 0.0
    timing = TimingLimits(squares, first[:, 6:], second[:, 6:])
    return Chain(robot, path_dynamics(robot, values, first, second), intervals, timing)


def has_forces(chain: Chain, i: int, standing: Array, u: float, x: float) -> bool:
    """Whether forces on standing feet exist at a sample, with all of them as unknowns."""
    robot, dynamics = chain.robot, chain.dynamics
    feet, weight = np.flatnonzero(standing), robot.mass * GRAVITY
    total = dynamics.acceleration[i] * u + dynamics.speed[i] * x + dynamics.gravity[i]
    jacobians = dynamics.contacts.jacobians[i][feet].reshape(3 * len(feet), -1)
    side = LIMITS.friction * np.cos(np.pi / 4)
    pyramid = np.array([[1, 0, side], [-1, 0, side], [0, 1, side], [0, -1, side]])
    effort = LIMITS.torque_share * robot.model.effortLimit[6:]
    eye = np.eye(len(feet))
    rows = np.concatenate([
        jacobians[:, :6].T, np.kron(eye, pyramid), np.kron(eye, [[0.0, 0.0, 1.0]]),
        -jacobians[:, 6:].T * weight / effort[:, None],
    ])  # fmt: skip
    least = LIMITS.least_normal_shares(standing)[feet]
    low = np.concatenate(
        [total[:6] / weight, np.zeros(4 * len(feet)), least, -1.0 - total[6:] / effort]
    )
    high = np.concatenate(
        [total[:6] / weight, np.full(5 * len(feet), NO_BOUND), 1.0 - total[6:] / effort]
    )
    program = (np.zeros(3 * len(feet)), rows, low - 1e-6, high + 1e-6)
    return solve_linear(*program, by_highs=True) is not None


@pytest.mark.parametrize("name", ROBOTS)
def test_momentum_carries_the_robot_over_the_edge(name: str) -> None:
    chain = across(name, beyond=0.02)
    found = chain.fastest()
    assert not found.stuck.any()
    three = np.flatnonzero(~chain.intervals.standing[:, RF])
    assert (found.begin[three] > 0.0).all() and found.begin[0] == found.end[-1] == 0.0
    assert np.array_equal(found.begin[1:], found.end[:-1])
    for k in range(COUNT):
        u = (found.end[k] - found.begin[k]) / (2.0 * chain.intervals.lengths[k])
        standing = chain.intervals.standing[k]
        assert has_forces(chain, k, standing, u, found.begin[k])
        assert has_forces(chain, k + 1, standing, u, found.end[k])
    # It could not rest there.
    assert not has_forces(chain, int(three[-1]), chain.intervals.standing[three[-1]], 0.0, 0.0)


@pytest.mark.parametrize("name", ROBOTS)
def test_who_stops_beyond_the_edge_does_not_get_on(name: str) -> None:
    chain = across(name, beyond=0.02)
    stop = 24  # 1 cm beyond the edge
    assert not chain.intervals.standing[stop - 1 : stop + 1, RF].any()
    found = chain.fastest(stop)
    assert found.stuck.all() and found.places[0] in (stop - 1, stop)
    # With all feet on the ground, before and after it, it may stop.
    assert not chain.fastest(stop=14).stuck.any()
    assert not chain.fastest(stop=32).stuck.any()


@pytest.mark.parametrize("name", ROBOTS)
def test_who_is_too_slow_does_not_get_over_the_edge(name: str) -> None:
    """Between the least and the largest speed every speed will do, and below the least none."""
    chain = across(name, beyond=0.02)
    fastest = chain.fastest()
    largest = float(fastest.begin.max())
    shares = np.geomspace(1e-3, 0.9, 8)
    stuck = np.array([chain.fastest(top=share * largest).stuck[0] for share in shares])
    assert stuck[0] and not stuck[-1]
    assert (np.diff(stuck.astype(int)) <= 0).all()
    place = int(chain.fastest(top=shares[0] * largest).places[0])
    assert not chain.intervals.standing[place, RF] and place >= COUNT // 2


def test_the_farther_beyond_the_edge_the_faster_one_has_to_be() -> None:
    """As for an inverted pendulum that falls towards its next support."""
    least = []
    for beyond in (0.01, 0.02, 0.03):
        chain = across("go2", beyond)
        low, high = 0.0, float(chain.fastest().begin.max())
        for _ in range(12):
            middle = (low + high) / 2.0
            low, high = (middle, high) if chain.fastest(top=middle).stuck[0] else (low, middle)
        least.append(WAY * np.sqrt(high))
    # To rest at the edge again after d takes v = d * sqrt(g / h) of a point mass: some of it.
    slowest = np.array([0.01, 0.02, 0.03]) * np.sqrt(GRAVITY / chain.robot.standing_height)
    assert (np.diff(least) > 0.0).all()
    assert (np.array(least) < 2.0 * slowest).all() and (np.array(least) > slowest / 8.0).all()


# ---------------------------------------------------------------- flight


def flight(name: str, duration: float, gravity: float = GRAVITY, count: int = 20) -> Chain:
    """A robot in the air that goes ahead by 0.3 m/s along a parabola, and moves no joint."""
    robot, base, feet = stance(name)
    s = np.linspace(0.0, 1.0, count + 1)
    bases, change, bend = np.tile(base, (len(s), 1)), *np.zeros((2, len(s), 6))
    fall = gravity * duration**2
    bases[:, 0] += 0.3 * duration * s
    bases[:, 2] += fall * (s - s**2) / 2.0
    change[:, 0], change[:, 2] = 0.3 * duration, fall * (0.5 - s)
    bend[:, 2] = -fall
    moved, speed, acceleration = (
        np.repeat(x[:, None, :3], 4, axis=1) for x in (bases - base, change, bend)
    )
    values, first, second = path_states(
        robot, (bases, change, bend), (feet + moved, speed, acceleration)
    )
    intervals = PathIntervals(
        np.arange(count), np.arange(1, count + 1), np.diff(s),
        np.zeros((count, 4), dtype=np.bool_), np.array([0, count]),
    )  # fmt: skip
    timing = TimingLimits(np.full(len(s), 1e6), first[:, 6:], second[:, 6:])
    return Chain(robot, path_dynamics(robot, values, first, second), intervals, timing)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("duration", [0.1, 0.3])
def test_in_flight_there_is_one_speed(name: str, duration: float) -> None:
    chain = flight(name, duration)
    found = chain.fastest()
    assert not found.stuck.any()
    assert chain.times(found).sum() == pytest.approx(duration, rel=1e-7)
    np.testing.assert_allclose(found.begin, 1.0 / duration**2, rtol=1e-6)
    assert chain.fastest(top=0.9 / duration**2).stuck.all()


def test_a_flatter_arc_takes_the_time_that_gravity_gives_it() -> None:
    """An arc made for a quarter of the gravity is flown through in half the time."""
    chain = flight("go2", 0.2, gravity=GRAVITY / 4.0)
    assert chain.times(chain.fastest()).sum() == pytest.approx(0.1, rel=1e-7)


def test_along_a_straight_line_nobody_flies() -> None:
    assert flight("go2", 0.2, gravity=0.0).fastest().stuck.all()


def hop(name: str, rise: float, count: int = 20) -> tuple[Chain, slice]:
    """The body goes up by 6 cm, flies ``rise`` higher and down again, and down by 6 cm.

    In the air legs keep their posture.

    Returns:
        The chain from rest to rest, and the intervals of the flight.
    """
    robot, base, feet = stance(name)
    low, slope = 0.06, 0.06
    curve = slope**2 / (4.0 * rise)
    a, r = np.linspace(0.0, 1.0, count + 1), np.linspace(0.0, slope / curve, count + 1)
    ones, zeros = np.ones(count + 1), np.zeros(count + 1)
    s = np.concatenate([a, 1.0 + r, 1.0 + r[-1] + a])
    heights = (
        np.concatenate([low * (a - 1.0), slope * r - curve * r**2, -low * a]),
        np.concatenate([slope * ones, slope - 2.0 * curve * r, -slope * ones]),
        np.concatenate([zeros, -2.0 * curve * ones, zeros]),
    )
    air = np.zeros(len(s))
    air[count + 1 : 2 * count + 2] = 1.0
    bases, places = np.zeros((3, len(s), 6)), np.zeros((3, len(s), 4, 3))
    bases[0], places[0] = base, feet
    for k, height in enumerate(heights):
        bases[k, :, 2] += height
        places[k, :, :, 2] += (air * height)[:, None]
    b, p = list(bases), list(places)
    values, first, second = path_states(robot, (b[0], b[1], b[2]), (p[0], p[1], p[2]))
    begin = np.concatenate([k * (count + 1) + np.arange(count) for k in range(3)])
    standing = np.ones((3 * count, 4), dtype=np.bool_)
    standing[count : 2 * count] = False
    intervals = PathIntervals(
        begin, begin + 1, s[begin + 1] - s[begin], standing, np.array([0, 3 * count])
    )
    squares = np.full(len(s), np.inf)
    squares[[0, -1]] = 0.0
    timing = TimingLimits(squares, first[:, 6:], second[:, 6:])
    chain = Chain(robot, path_dynamics(robot, values, first, second), intervals, timing)
    return chain, slice(count, 2 * count)


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("rise", [0.002, 0.01])
def test_a_hop_takes_off_and_lands_with_the_speed_that_its_height_asks_for(
    name: str, rise: float
) -> None:
    chain, air = hop(name, rise)
    found = chain.fastest()
    assert not found.stuck.any()
    assert chain.times(found)[air].sum() == pytest.approx(2.0 * np.sqrt(2.0 * rise / GRAVITY))
    take_off = 0.06 * np.sqrt(found.end[air.start - 1])
    assert take_off == pytest.approx(np.sqrt(2.0 * GRAVITY * rise), rel=1e-6)
    # From rest to that speed within 6 cm it has to wait for nothing.
    assert chain.times(found)[: air.start].sum() < 0.5


@pytest.mark.parametrize("name", ["go2", "wang2020"])
def test_a_higher_hop(name: str) -> None:
    chain, _ = hop(name, 0.03)
    assert not chain.fastest().stuck.any()
