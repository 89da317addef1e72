"""The smooth motion of a dynamic route, and what it asks of joints and ground.

Body centre, orientation and flying feet are quadratic B-splines in time, with the poses at knots as
control points: piecewise parabolas, whose velocity is continuous and whose acceleration is constant
on each span. Joints follow by inverse kinematics, so standing feet stand.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.differences import time_derivatives
from gaitopt.optimize.route.legs import BODY, FOOT
from gaitopt.planners.time_optimal.foothold_motion import Contacts, FootholdMotion
from gaitopt.stability.margins import static_stability_margin
from gaitopt.stability.zmp import point_mass_zmp

SAMPLES = 7
"""Samples of each span at which a motion is judged."""


@dataclass(frozen=True, eq=False)
class RouteMotion(FootholdMotion):
    """A smooth motion; all but the robot's base is in the heading frame.

    Attributes:
        robot, heading: of the walk.
        legs: constants of the legs.
        knots: who flies when. The foot that lifts off at a knot flies from the beginning of that
            knot's span, and the one that lands at a knot until the end of its span.
        poses: control points ``(K, 9)``.
        spans: length of every knot's span ``(K,)`` [s].
    """

    poses: FloatArray
    spans: FloatArray

    def slower(self, stretch: float) -> RouteMotion:
        """The same motion in ``stretch`` times the time."""
        return replace(self, spans=self.spans * stretch)

    @cached_property
    def times(self) -> FloatArray:
        """Begin of every span, and the end ``(K + 1,)`` [s]."""
        return np.concatenate([[0.0], np.cumsum(self.spans)])

    @cached_property
    def flying(self) -> tuple[np.ndarray, np.ndarray]:
        """Whether a foot flies on each span ``(K,)``, and the leg that does, or will."""
        flies, leg = np.zeros(len(self.spans), dtype=bool), np.zeros(len(self.spans), dtype=int)
        for a, b in zip(self.knots.ends[1::2].tolist(), self.knots.ends[2::2].tolist(),
                        strict=True):  # fmt: skip
            flies[a : b + 1], leg[a : b + 1] = True, self.knots.leg[a]
        return flies, leg

    @cached_property
    def pieces(self) -> FloatArray:
        """Parabolas of all pose entries on every span ``(3, K, 9)``, highest power first."""
        _, leg = self.flying
        feet = np.where(self.knots.flying[..., None] > 0, self.poses[:, None, FOOT],
                        self.knots.feet)  # fmt: skip
        body, foot = _parabolas(self.poses[:, :6], self.spans), _parabolas(feet, self.spans)
        return np.concatenate([body, foot[:, np.arange(len(leg)), leg]], axis=2)

    def pose(self, times: FloatArray, span: np.ndarray, order: int = 0) -> FloatArray:
        """Poses, or their derivatives, by the parabolas of given spans ``(N, 9)``."""
        t = (times - self.times[span])[:, None]
        a, b, c = self.pieces[:, span]
        if order == 0:
            return np.asarray((a * t + b) * t + c)
        return np.asarray(2.0 * a * t + b if order == 1 else 2.0 * a)

    def joints(self, times: FloatArray, interval: np.ndarray) -> FloatArray:
        """Joint angles leg by leg ``(N, 12)`` [rad]."""
        return self.angles(self.pose(times, interval), self.contacts(interval))

    def poses_at(self, times: FloatArray, piece: np.ndarray) -> FloatArray:
        """Poses by the parabolas of given spans ``(N, 9)``."""
        return self.pose(times, piece)

    def contacts(self, piece: np.ndarray) -> Contacts:
        """Which feet stand on given spans."""
        flies, leg = self.flying
        return Contacts(piece, flies[piece], leg[piece])

    def samples(self) -> tuple[FloatArray, np.ndarray]:
        """Times within all intervals ``(N,)``, :data:`SAMPLES` each, and the interval of each."""
        share = np.linspace(0.0, 1.0, SAMPLES)
        lengths = np.diff(self.times)[:, None]
        times = self.times[:-1, None] + lengths * share
        return times.ravel(), np.repeat(np.arange(len(lengths)), SAMPLES)

    @cached_property
    def asked(self) -> tuple[FloatArray, FloatArray]:
        """Most that joints are asked for, up and down, at samples of the motion.

        Returns:
            Velocities from the middle of each span to that of the next ``(2, K - 1, 12)``
            [rad/s], and accelerations on every span ``(2, K, 12)`` [rad/s^2].
        """
        times, interval = self.samples()
        found = time_derivatives(lambda t: self.joints(t, interval), times)
        rates, bends = (f.reshape(-1, SAMPLES, 12) for f in found)
        half = SAMPLES // 2
        between = np.concatenate([rates[:-1, half:], rates[1:, : half + 1]], axis=1)
        return (np.stack([between.max(axis=1), -between.min(axis=1)]),
                np.stack([bends.max(axis=1), -bends.min(axis=1)]))  # fmt: skip

    def zero_moment_points(self) -> FloatArray:
        """ZMP at samples of each span ``(K, SAMPLES, 2)`` [m].

        Of a point mass at the body centre, on the mean height of the ground below standing feet.
        """
        times, span = self.samples()
        flies, leg = self.flying
        stands = ~(flies[span, None] & (np.arange(4) == leg[span, None]))
        ground = (self.knots.feet[span][..., 2] * stands).sum(axis=1) / stands.sum(axis=1)
        ground -= self.robot.foot_radius
        centre, pull = (self.pose(times, span, k)[:, BODY] for k in (0, 2))
        return point_mass_zmp(centre, pull, ground).reshape(-1, SAMPLES, 2)

    def margins(self, dynamic: bool) -> FloatArray:
        """Least margin at samples of each span over the feet that stand ``(K,)`` [m].

        Args:
            dynamic: of the zero moment point; else of the body centre's projection.
        """
        times, span = self.samples()
        feet = self.knots.feet[span]
        swings, leg = (part[span] for part in self.flying)
        point = self.pose(times, span)[:, :2]
        if dynamic:
            point = self.zero_moment_points().reshape(-1, 2)
        out = np.empty(len(times))
        for i in range(4):
            mine = swings & (leg == i)
            others = [j for j in range(4) if j != i]
            out[mine] = static_stability_margin(feet[mine][:, others], point[mine])
        out[~swings] = static_stability_margin(feet[~swings], point[~swings])
        return np.asarray(out.reshape(-1, SAMPLES).min(axis=1))


def _parabolas(points: FloatArray, spans: FloatArray) -> FloatArray:
    """Quadratic B-spline in powers of the time since each span's start ``(3, K, ...)``.

    Args:
        points: control points ``(K, ...)``; the first and the last count twice.
        spans: ``(K,)`` [s].
    """
    shape = (-1,) + (1,) * (points.ndim - 1)
    d = spans.reshape(shape)
    speed = np.diff(points, axis=0) / ((d[1:] + d[:-1]) / 2.0)
    rest = np.zeros_like(points[:1])
    before, after = np.concatenate([rest, speed]), np.concatenate([speed, rest])
    start = points - before * d / 2.0
    return np.stack([(after - before) / (2.0 * d), before, start])
