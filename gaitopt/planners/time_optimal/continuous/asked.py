"""What a continuous walk asks of the ground: a wrench, linear in acceleration and squared speed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS, FloatArray, rotation_z
from gaitopt.dynamics.whole_body import path_dynamics
from gaitopt.motion.differences import time_derivatives
from gaitopt.motion.path import BASE_COLUMNS
from gaitopt.optimize.route.centre_of_mass import MassDistribution
from gaitopt.optimize.route.legs import ORIENTATION
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.robots.rotations import rpy_to_matrix

SHIFT = 1e-3
"""Shift of the body by which the share of the mass that moves with it is measured [m]."""
LARGEST_SQUARE = 1e4
"""Largest squared speed where no joint bounds it."""


class Asked(NamedTuple):
    """What a motion asks of the ground at both ends of every span, by ``(u, x, 1)``.

    In shares of the weight, along the heading frame.

    Attributes:
        force: ``(2 K, 3, 3)``.
        moment: the zero moment point times the vertical force ``(2 K, 2, 3)`` [m].
        height: of the centre of mass above the ground ``(2 K,)`` [m].
        moved: share of the mass that moves with the body.
        tops: largest squared speeds by joint velocities ``(K, 2)``.
    """

    force: FloatArray
    moment: FloatArray
    height: FloatArray
    moved: float
    tops: FloatArray

    @classmethod
    def of(cls, route: Route, motion: SplineMotion) -> Asked | None:
        """What a motion asks for; ``None`` where a leg is straight, and its rates are not known."""
        robot = route.robot
        times = np.stack([motion.times[:-1], motion.times[1:]], axis=1).ravel()
        span = np.repeat(np.arange(len(motion.spans)), 2)
        values = motion.values_at(times, span)
        first, second = time_derivatives(lambda t: motion.values_at(t, span), times)
        if not np.isfinite(second).all():
            return None
        dynamics = path_dynamics(robot, values, first, second)
        terms = np.stack([dynamics.acceleration, dynamics.speed, dynamics.gravity], axis=2)
        terms = terms[:, :6] / (robot.mass * GRAVITY)
        poses = motion.poses_at(times, span)
        # From the axes of the base to those of the heading frame.
        turns = rpy_to_matrix(poses[:, ORIENTATION]) @ robot.body_axes.T
        force, about = turns @ terms[:, :3], turns @ terms[:, 3:]
        base = values[:, :3] @ rotation_z(motion.heading)
        ground = motion.knots.ground_on_spans[span] - robot.foot_radius
        up = (base[:, 2] - ground)[:, None]
        moment = np.stack([-about[:, 1] - up * force[:, 0], about[:, 0] - up * force[:, 1]], axis=1)
        moment += base[:, :2, None] * force[:, 2:]
        centre = _centres(motion, poses, span)
        beside = _centres(motion, poses + SHIFT * (np.arange(poses.shape[1]) == 0), span)
        with np.errstate(divide="ignore"):
            fastest = (robot.velocity_limits / np.abs(first[:, BASE_COLUMNS:])).min(axis=1)
        return cls(
            force, moment, centre[:, 2] - ground,
            float((beside - centre)[:, 0].mean()) / SHIFT,
            np.minimum(fastest**2, LARGEST_SQUARE).reshape(-1, 2),
        )  # fmt: skip


def _centres(motion: SplineMotion, poses: FloatArray, span: np.ndarray) -> FloatArray:
    """Centres of mass of all links ``(N, 3)`` [m] in poses ``(N, 9)`` on spans ``(N,)``."""
    joints = motion.joints_of(poses, motion.contacts(span)).reshape(-1, len(LEGS), 3)
    return MassDistribution.of(motion.robot).com(poses, joints)
