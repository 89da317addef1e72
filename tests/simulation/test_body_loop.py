"""The body's spring and damper: stable at the rate at which the controller is called."""

from __future__ import annotations

import numpy as np
import pytest
from robot_loading import quiet
from robot_texts import robot

from gaitopt.control.gains import ControlGains
from gaitopt.robots.catalog import load_robot
from gaitopt.simulation.body_loop import LARGEST_GROWTH, BodyLoop, body_loop, called_in_time
from gaitopt.simulation.settings import SimulationSettings


def test_a_damper_alone_takes_the_velocity_by_a_known_factor() -> None:
    """A mass and a damper that is held between calls: ``v`` becomes ``v (1 - d t / m)``."""
    mass, damping, none = 2.0, 30.0, np.zeros((1, 1))
    loop = BodyLoop(mass * np.eye(1), none, none, damping * np.eye(1), none)
    for interval in (0.01, 0.1, 0.2, 1.0):
        # The other of the two motions is a place, which nothing brings back.
        expected = max(1.0, abs(1.0 - damping * interval / mass))
        assert loop.growth(interval) == pytest.approx(expected, rel=1e-6)


def test_growth_is_that_of_many_small_steps() -> None:
    made = load_robot("go2")
    gains = ControlGains.for_robot(made, rotation_damping=60.0)
    loop, interval, count = body_loop(made, gains), 0.006, 2000
    n, dt = len(loop.inertia), interval / count
    moved = np.zeros((2 * n, 2 * n))
    for k, start in enumerate(np.eye(2 * n)):
        z, v = start[:n].copy(), start[n:].copy()
        held = loop.holds @ z + loop.damps @ v
        for _ in range(count):
            v -= dt * np.linalg.solve(loop.inertia, loop.own @ v + loop.bends @ z + held)
            z += dt * v
        moved[:, k] = np.concatenate([z, v])
    expected = np.abs(np.linalg.eigvals(moved)).max()
    assert expected > 1.2
    assert loop.growth(interval) == pytest.approx(expected, rel=1e-2)


def test_gains_that_shake_the_body_are_called_more_often() -> None:
    made = quiet(robot())
    usual, gains = SimulationSettings(), ControlGains.for_robot(made)
    assert called_in_time(usual, made, gains) == usual
    strong = ControlGains.for_robot(made, rotation_damping=40.0 * gains.rotation_damping)
    loop = body_loop(made, strong)
    found = called_in_time(usual, made, strong)
    assert found.timestep == usual.timestep and found.control_every < usual.control_every
    assert loop.growth(usual.control_interval) > LARGEST_GROWTH
    assert found.control_every == 1 or loop.growth(found.control_interval) <= LARGEST_GROWTH


def test_gains_beyond_all_measure_are_called_at_every_step() -> None:
    """Numbers overflow with them; that is no error, and physics shows what happens."""
    made = quiet(robot())
    for absurd in ({"rotation_damping": 1e200}, {"joint_stiffness": 1e150}):
        gains = ControlGains.for_robot(made, **absurd)
        assert body_loop(made, gains).growth(0.006) == np.inf
        assert called_in_time(SimulationSettings(), made, gains).control_every == 1


def test_robots_of_the_list_are_called_as_usual() -> None:
    usual = SimulationSettings()
    for name in ("wang2020", "frog1", "a1", "go1", "go2", "b1", "anymal", "anymal_c", "hyq"):
        made = load_robot(name)
        assert called_in_time(usual, made, ControlGains.for_robot(made)) == usual
