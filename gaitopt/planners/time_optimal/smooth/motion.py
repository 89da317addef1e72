"""The motion of a smooth walk, and what it asks of joints and ground.

Body centre, orientation and flying feet follow quadratic B-splines in time whose control points are
the poses at knots. Each knot has a span of time, and on it these curves are parabolas: velocities
are continuous, and accelerations are constant on each span. Joints follow by inverse kinematics, so
the feet that stand do not slip.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, OTHER_LEGS, FloatArray, frozen, rotation_z
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.dynamics.zero_moment import zero_moment_points
from gaitopt.motion.differences import time_derivatives, values_and_derivatives
from gaitopt.motion.path import BASE_COLUMNS
from gaitopt.motion.pieces import States
from gaitopt.motion.quadratic_spline import spline_parabolas
from gaitopt.optimize.route.centre_of_mass import MassDistribution
from gaitopt.optimize.route.legs import BODY, FOOT, JOINTS
from gaitopt.planners.time_optimal.foothold_motion import Contacts, FootholdMotion
from gaitopt.stability.margins import static_stability_margin
from gaitopt.stability.zmp import point_mass_zmp

SAMPLES = 7
"""Samples on each span at which a motion is measured; an odd number, so that one is its middle."""


FAR_AWAY = 1e3
"""Place that stands for that of a ZMP that does not exist [m]."""


class JointDemand(NamedTuple):
    """Largest velocities and accelerations of the joints, upward and downward.

    Those downward are counted as positive numbers. All are in the order of the legs' joints.

    Attributes:
        velocities: from the middle of each span to the middle of the next ``(2, K - 1, 12)``
            [rad/s].
        accelerations: on each span ``(2, K, 12)`` [rad/s^2].
    """

    velocities: FloatArray
    accelerations: FloatArray

    def since(self, knot: int) -> JointDemand:
        """Those from a knot on."""
        return JointDemand(self.velocities[:, knot:], self.accelerations[:, knot:])


@dataclass(frozen=True, eq=False)
class SplineMotion(FootholdMotion):
    """A motion whose poses at knots are control points of quadratic B-splines.

    Its pieces are the spans of the knots.

    Attributes:
        robot, heading, legs, knots: of the walk.
        poses: control points ``(K, 9)``.
        spans: length of every knot's span ``(K,)`` [s].
        whole_body: whether the centre of mass and the ZMP are those of all links, and not of a
            point mass at the body centre.
    """

    poses: FloatArray
    spans: FloatArray
    whole_body: bool = False

    def slower(self, stretch: float) -> SplineMotion:
        """The same motion in ``stretch`` times the time."""
        return replace(self, spans=self.spans * stretch)

    @cached_property
    def times(self) -> FloatArray:
        """When each span begins, and when the last one ends ``(K + 1,)`` [s]."""
        return np.concatenate([[0.0], np.cumsum(self.spans)])

    @cached_property
    def parabolas(self) -> FloatArray:
        """Coefficients of all pose entries on every span ``(3, K, 9)``, highest power first.

        The foot is that of the leg that flies on the span.
        """
        leg = self.knots.flying_on_spans.leg
        feet = self.knots.feet_at_knots(self.poses[:, FOOT])
        body = spline_parabolas(self.poses[:, : FOOT.start], self.spans)
        foot = spline_parabolas(feet, self.spans)
        return np.concatenate([body, foot[:, np.arange(len(leg)), leg]], axis=2)

    def poses_at(self, times: FloatArray, piece: np.ndarray) -> FloatArray:
        """Poses ``(N, 9)`` by the parabolas of the given spans."""
        t = (times - self.times[piece])[:, None]
        a, b, c = self.parabolas[:, piece]
        return np.asarray((a * t + b) * t + c)

    def contacts(self, piece: np.ndarray) -> Contacts:
        """Which feet stand on the given spans."""
        return Contacts(piece, self.knots.flying_on_spans.at(piece))

    @property
    def samples(self) -> tuple[FloatArray, np.ndarray]:
        """Times ``(N,)`` of :data:`SAMPLES` on each span, both ends included, and their spans."""
        share = np.linspace(0.0, 1.0, SAMPLES)
        times = self.times[:-1, None] + np.diff(self.times)[:, None] * share
        return times.ravel(), np.repeat(np.arange(len(self.spans)), SAMPLES)

    @cached_property
    def joint_demand(self) -> JointDemand:
        """Largest joint velocities and accelerations at the samples."""
        times, span = self.samples
        if self.whole_body:
            legs = BASE_COLUMNS + self.robot.leg_joint_columns
            found = self._sampled[1][:, legs], self._sampled[2][:, legs]
        else:
            found = time_derivatives(lambda t: self.joints_at(t, span), times)
        velocity, acceleration = (f.reshape(-1, SAMPLES, JOINTS) for f in found)
        half = SAMPLES // 2
        between = np.concatenate([velocity[:-1, half:], velocity[1:, : half + 1]], axis=1)
        return JointDemand(
            np.stack([between.max(axis=1), -between.min(axis=1)]),
            np.stack([acceleration.max(axis=1), -acceleration.min(axis=1)]),
        )

    @cached_property
    def _sampled(self) -> States:
        """Columns of a path at the samples, and two derivatives of them ``(N, 6 + nj)``."""
        times, span = self.samples
        value, first, second = values_and_derivatives(lambda t: self.values_at(t, span), times)
        return frozen(value), frozen(first), frozen(second)

    @cached_property
    def centres_of_mass(self) -> FloatArray:
        """Centre of mass at the samples of each span ``(K, SAMPLES, 2)`` [m]."""
        times, span = self.samples
        poses = self.poses_at(times, span)
        if not self.whole_body:
            return frozen(poses[:, :2].reshape(-1, SAMPLES, 2))
        joints = self.joints_of(poses, self.contacts(span)).reshape(-1, len(LEGS), 3)
        found = MassDistribution.of(self.robot).com(poses, joints)
        return frozen(found[:, :2].reshape(-1, SAMPLES, 2))

    @cached_property
    def zero_moment_points(self) -> FloatArray:
        """ZMP at the samples of each span ``(K, SAMPLES, 2)`` [m].

        On the mean height of the ground below standing feet. NaN where the ground would have to
        pull.
        """
        times, span = self.samples
        if self.whole_body:
            return frozen(self._whole_body_zmp(span).reshape(-1, SAMPLES, 2))
        ground = self.knots.ground_on_spans[span] - self.robot.foot_radius
        centre = self.poses_at(times, span)[:, BODY]
        acceleration = 2.0 * self.parabolas[0, span][:, BODY]
        return frozen(point_mass_zmp(centre, acceleration, ground).reshape(-1, SAMPLES, 2))

    def _whole_body_zmp(self, span: np.ndarray) -> FloatArray:
        """ZMP of all links at the samples ``(N, 2)`` [m], in the heading frame."""
        ground = self.knots.ground_on_spans[span] - self.robot.foot_radius
        found = zero_moment_points(self.robot, motion_of_path(self.robot, *self._sampled), ground)
        return np.asarray(found @ rotation_z(self.heading)[:2, :2])

    def margins(self, dynamic: bool) -> FloatArray:
        """Least stability margin at the samples of each span ``(K,)`` [m].

        Args:
            dynamic: whether it is that of the zero moment point; else of the centre of mass.
        """
        span = self.samples[1]
        feet, flying = self.knots.feet[span], self.knots.flying_on_spans.at(span)
        points = self.zero_moment_points if dynamic else self.centres_of_mass
        point = np.nan_to_num(points.reshape(-1, 2), nan=FAR_AWAY)
        out = np.empty(len(span))
        for leg in range(len(LEGS)):
            three = flying.flies & (flying.leg == leg)
            out[three] = static_stability_margin(feet[three][:, OTHER_LEGS[leg]], point[three])
        four = ~flying.flies
        out[four] = static_stability_margin(feet[four], point[four])
        return np.asarray(out.reshape(-1, SAMPLES).min(axis=1))
