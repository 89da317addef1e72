"""Footholds of walks whose bodies turn or tilt, built by hand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gaitopt import LEGS, Footholds, Quadruped
from gaitopt.gait.crawl import WANG_SEQUENCE

Array = NDArray[np.float64]


def about_z(angle: float) -> Array:
    """Rotation about the vertical."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def nose_up(angle: float) -> Array:
    """Rotation about y that raises the front."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def corners(robot: Quadruped) -> dict[str, Array]:
    """Places of the feet below the hips, from the middle."""
    length, width = robot.stance_size
    signs = {"LF": (1, 1), "LH": (-1, 1), "RH": (-1, -1), "RF": (1, -1)}
    return {leg: np.array([x * length / 2, y * width / 2, 0.0]) for leg, (x, y) in signs.items()}


def on_the_spot(robot: Quadruped, cycles: int, turn: float, first: float = 0.0) -> Footholds:
    """A walk that turns on the spot, by ``turn`` [rad] in each cycle, from the yaw ``first``."""
    at = corners(robot)
    steps = 4 * cycles
    postures = np.zeros((steps + 1, 4))
    postures[:, 0] = robot.standing_height
    # While the first foot of a cycle flies the others have still to follow.
    postures[1:, 3] = turn * (np.arange(steps) + 0.5) / 4
    postures[:, 3] += first
    points = {leg: [about_z(first + turn * k) @ at[leg] for k in range(cycles + 1)] for leg in LEGS}
    return Footholds(points, order=WANG_SEQUENCE * cycles, postures=postures)


def up_a_ramp(
    robot: Quadruped,
    angle: float,
    cycles: int,
    *,
    yaw: float = 0.0,
    friction: float | None = None,
    falsify: float = 0.0,
) -> Footholds:
    """A walk up a plane that rises by ``angle`` [rad] in the direction ``yaw``, the body along it.

    Centres of the feet are raised along the normal by their radius.

    Args:
        robot, angle, cycles, yaw, friction: the walk.
        falsify: the normals that are told are those of a plane that rises by so much more [rad].
    """
    at, turn = corners(robot), about_z(yaw)
    length = 0.15 * robot.stance_size[0]
    onto, told = turn @ nose_up(angle), turn @ nose_up(angle + falsify)
    lift = robot.foot_radius * onto[:, 2]
    points = {
        leg: [onto @ (at[leg] + np.array([length * k, 0.0, 0.0])) + lift for k in range(cycles + 1)]
        for leg in LEGS
    }
    postures = np.tile([0.0, 0.0, -angle, yaw], (4 * cycles + 1, 1))
    taken = dict.fromkeys(LEGS, 0)
    for s, leg in enumerate((None, *WANG_SEQUENCE * cycles)):
        if leg is not None:
            taken[leg] += 1
        middle = np.mean([points[other][taken[other]] for other in LEGS], axis=0)
        postures[s, 0] = middle[2] + robot.standing_height / np.cos(angle)
    normals = {leg: np.tile(told[:, 2], (cycles + 1, 1)) for leg in LEGS}
    return Footholds(
        points, order=WANG_SEQUENCE * cycles, postures=postures, normals=normals, friction=friction
    )
