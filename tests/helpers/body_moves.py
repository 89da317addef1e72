"""A move of the body on four feet as a path, for the tests of timings with forces."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import gaitopt
from gaitopt import ForceLimits, Quadruped
from gaitopt.dynamics.path_intervals import PathIntervals, TimingLimits
from gaitopt.dynamics.small_programs import NO_BOUND, solve_linear
from gaitopt.dynamics.whole_body import PathDynamics, path_dynamics
from gaitopt.robots.whole_body import joints_from_feet

Array = NDArray[np.float64]
GRID = (1.0 - np.cos(np.pi * np.arange(13) / 12)) / 2.0
COUNT = len(GRID) - 1
INTERVALS = PathIntervals(
    begin=np.arange(COUNT),
    end=np.arange(1, COUNT + 1),
    lengths=np.diff(GRID),
    standing=np.ones((COUNT, 4), dtype=np.bool_),
    first=np.array([0, COUNT]),
)


class Move(NamedTuple):
    """The body moves straight ahead on four feet."""

    robot: Quadruped
    dynamics: PathDynamics
    timing: TimingLimits


def move(name: str, distance: float, top: float = np.inf) -> Move:
    """A move of the body by ``distance`` along x, in its own share as the parameter."""
    robot = gaitopt.load_robot(name)
    length, width = robot.stance_size
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])
    feet = np.column_stack([corners * [length / 2, width / 2], np.zeros(4)])
    h = 1e-3

    def values(s: Array) -> Array:
        base = np.zeros((len(s), 6))
        base[:, 0] = distance * (s - 0.5) - robot.centre[0]
        base[:, 1], base[:, 2] = -robot.centre[1], robot.standing_height - robot.centre[2]
        feet_at = np.broadcast_to(feet, (len(s), 4, 3))
        joints = joints_from_feet(robot, base[:, :3], base[:, 3:], feet_at)
        return np.concatenate([base, joints], axis=1)

    far = [values(GRID + k * h) for k in (-1, 0, 1)]
    first, second = (far[2] - far[0]) / (2 * h), (far[2] - 2 * far[1] + far[0]) / h**2
    dynamics = path_dynamics(robot, far[1], first, second)
    squares = np.full(len(GRID), top)
    squares[[0, -1]] = 0.0
    return Move(robot, dynamics, TimingLimits(squares, first[:, 6:], second[:, 6:]))


def has_forces(given: Move, limits: ForceLimits, i: int, u: float, x: float) -> bool:
    """Whether forces exist at a place, by another program: all twelve forces are unknowns."""
    robot, dynamics = given.robot, given.dynamics
    weight = robot.mass * 9.81
    total = dynamics.acceleration[i] * u + dynamics.speed[i] * x + dynamics.gravity[i]
    jacobians = dynamics.contacts.jacobians[i].reshape(12, -1)
    base = jacobians[:, :6].T
    side = limits.friction * np.cos(np.pi / 4)
    pyramid = np.array([[1, 0, side], [-1, 0, side], [0, 1, side], [0, -1, side]])
    rows = [base, np.kron(np.eye(4), pyramid), np.kron(np.eye(4), [[0.0, 0.0, 1.0]])]
    low = [total[:6] / weight, np.zeros(16), np.full(4, limits.reserve / 2.0)]
    high = [total[:6] / weight, np.full(20, NO_BOUND)]
    effort = limits.torque_share * robot.model.effortLimit[6:]
    rows.append(-jacobians[:, 6:].T * weight / effort[:, None])
    speeds = given.timing.first[i] * np.sqrt(max(x, 0.0)) / robot.velocity_limits
    left = np.ones(len(effort))
    if (line := limits.torque_line) is not None:
        left = np.clip((line.no_load - np.abs(speeds)) / (line.no_load - line.knee), 0.0, 1.0)
    low.append(-np.where(speeds < 0.0, left, 1.0) - total[6:] / effort)
    high.append(np.where(speeds > 0.0, left, 1.0) - total[6:] / effort)
    matrix = np.concatenate(rows)
    program = (np.zeros(12), matrix, np.concatenate(low) - 1e-7, np.concatenate(high) + 1e-7)
    return solve_linear(*program, by_highs=True) is not None
