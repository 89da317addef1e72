"""What a gait's motion asks of the ground, and how that follows where its body is.

Joints follow from body and feet at each instant. So the reaction of the ground at an instant
depends on the place, velocity and acceleration of the body's centre at this instant alone, and
differences of six numbers give its derivatives.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.motion.body_and_feet import path_states
from gaitopt.planners.by_velocity.motion import GaitMotion
from gaitopt.stability.zmp import ground_wrench

STEPS = (1e-5, 1e-4, 1e-3)
"""Steps of the differences of place [m], velocity [m/s] and acceleration [m/s^2], and of angles:
errors of the derivatives are below a millionth, and Newton's method needs far less."""
BLOCK = 4096
"""Most samples of which the reaction is found at once, where one move of the body has fewer."""


class Reaction(NamedTuple):
    """The force of the ground in units of the weight, and its place, at ``N`` instants.

    Attributes:
        value: ``Fx, Fy, Fz, Fz px, Fz py, Mz`` ``(N, 6)`` with the ZMP ``p`` on the ground [m], and
            the moment about the world's vertical axis [m].
        slope: its derivatives by the body's place, velocity and acceleration ``(N, 6, 3, d)``.
    """

    value: FloatArray
    slope: FloatArray


def reaction(motion: GaitMotion, times: FloatArray, centre: FloatArray) -> FloatArray:
    """The reaction of the ground ``(N, 6)``; see :class:`Reaction`.

    Args:
        motion: whose feet are taken, and for a level body its yaw.
        times: ``(N,)`` [s].
        centre: place, velocity and acceleration of a level body's centre ``(N, 3, 2)``, of its way
            along a straight route ``(N, 3, 1)``, or of the base's six coordinates ``(N, 3, 6)``.

    Raises:
        InputError: a foot is out of reach.
    """
    robot = motion.robot
    if centre.shape[2] == 1:
        centre = centre * motion.ahead
    base = centre[:, 0], centre[:, 1], centre[:, 2]
    if centre.shape[2] == 2:
        base = motion.base_of(times, base)
    moved = motion_of_path(robot, *path_states(robot, base, motion.feet(times)))
    wrench = ground_wrench(robot.model, *moved) / (robot.mass * GRAVITY)
    force, moment = wrench[:, :3], wrench[:, 3:]
    # Feet are balls on level ground at the height of minus their radius.
    depth = -robot.foot_radius - base[0][:, 2]
    across = np.stack([-moment[:, 1], moment[:, 0]], axis=1)
    places = base[0][:, :2] * force[:, 2:] + depth[:, None] * force[:, :2] + across
    x, y = base[0][:, :2].T
    turning = moment[:, 2] + x * force[:, 1] - y * force[:, 0]
    return np.column_stack([force, places, turning])


def linearised(motion: GaitMotion, times: FloatArray, centre: FloatArray) -> Reaction:
    """The reaction and its derivatives; arguments are those of :func:`reaction`."""
    value = reaction(motion, times, centre)
    count = centre.shape[2]
    slope = np.empty((*value.shape, 3, count))
    moves = [(order, axis) for order in range(3) for axis in range(count)]
    # Many short calls of NumPy take longer than few long ones.
    together = max(1, BLOCK // max(len(times), 1))
    for first in range(0, len(moves), together):
        some = moves[first : first + together]
        moved = np.repeat(centre[None], len(some), axis=0)
        for one, (order, axis) in zip(moved, some, strict=True):
            one[:, order, axis] += STEPS[order]
        found = reaction(motion, np.tile(times, len(some)), moved.reshape(-1, 3, count))
        for one, (order, axis) in zip(np.split(found, len(some)), some, strict=True):
            slope[:, :, order, axis] = (one - value) / STEPS[order]
    return Reaction(value, slope)


def whole_zmp(motion: GaitMotion, times: FloatArray) -> FloatArray:
    """ZMP of the whole robot on the ground ``(N, 2)`` [m] at ``times (N,)``."""
    states = motion.base(times) if motion.is_free else motion.centre(times)
    value = reaction(motion, times, np.stack(states, axis=1))
    # In flight there is no force, and no ZMP.
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(value[:, 3:5] / value[:, 2:3])
