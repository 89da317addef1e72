"""Body and feet of a gait as functions of time, and the joints that follow from them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.gait.step_timing import SwingEvent
from gaitopt.motion.body_and_feet import body_and_feet_path
from gaitopt.motion.path import MotionPath
from gaitopt.motion.pieces import States
from gaitopt.planners.by_velocity.body_route import BodyRoute
from gaitopt.planners.by_velocity.contacts import flights_at, stances_at
from gaitopt.robots.quadruped import Quadruped
from gaitopt.swing.catalogue import swing_curve
from gaitopt.swing.curve import SwingCurve
from gaitopt.terrain.footholds import Footholds


@dataclass(frozen=True, eq=False)
class GaitMotion:
    """A gait's motion, before it is put into joints.

    Attributes:
        robot: who walks.
        route: the nominal way of the body's centre.
        sway: the centre's own path, two columns x and y, where it is not the route.
        height: of the body's centre [m].
        footholds: where the feet stand.
        events: all swings, in the order of lift-offs.
        swing: name of the swing curve.
        swing_height: [m].
        duration: of the whole motion [s].
    """

    robot: Quadruped
    route: BodyRoute
    sway: MotionPath | None
    height: float
    footholds: Footholds
    events: tuple[SwingEvent, ...]
    swing: str
    swing_height: float
    duration: float

    @cached_property
    def curves(self) -> SwingCurve | None:
        """All swings as one array of curves, in the order of ``events``."""
        if not self.events:
            return None
        ends = np.array([
            [self.footholds[e.leg][e.step], self.footholds[e.leg][e.step + 1]] for e in self.events
        ])  # fmt: skip
        lasting = [e.touch_down - e.lift_off for e in self.events]
        return swing_curve(self.swing, ends[:, 0], ends[:, 1], self.swing_height, lasting)

    def centre(self, times: FloatArray) -> States:
        """Place, velocity and acceleration of the body's centre ``(N, 2)`` in the world."""
        if self.sway is None:
            return self.route.motion(times)
        values = tuple(self.sway.evaluate(times, k) for k in range(3))
        return values[0], values[1], values[2]

    def base(self, times: FloatArray) -> States:
        """x, y, z, roll, pitch, yaw of the base ``(N, 6)`` and two derivatives."""
        place, speed, change = self.centre(times)
        yaw, turn, spin = self.route.yaw(times)
        c, s = np.cos(yaw), np.sin(yaw)
        x, y, z = self.robot.centre.tolist()
        arm = np.stack([c * x - s * y, s * x + c * y], axis=-1)
        across = np.stack([-arm[:, 1], arm[:, 0]], axis=-1)
        out = [np.zeros((len(times), 6)) for _ in range(3)]
        out[0][:, :2] = place - arm
        out[1][:, :2] = speed - across * turn[:, None]
        out[2][:, :2] = change - across * spin[:, None] + arm * (turn**2)[:, None]
        out[0][:, 2] = self.height - z
        ahead = self.robot.body_axes[:, 0]
        out[0][:, 5] = yaw - float(np.arctan2(ahead[1], ahead[0]))
        out[1][:, 5], out[2][:, 5] = turn, spin
        return out[0], out[1], out[2]

    def feet(self, times: FloatArray) -> States:
        """Feet in the world ``(N, 4, 3)`` and two derivatives, a flying foot by its curve."""
        place = stances_at(self.footholds, self.events, times)
        speed, change = np.zeros_like(place), np.zeros_like(place)
        flights = flights_at(self.events, times)
        rows, legs = np.nonzero(flights >= 0)
        if self.curves is not None and rows.size:
            which = flights[rows, legs]
            since = times[rows] - np.array([e.lift_off for e in self.events])[which]
            flown = type(self.curves)(
                self.curves.start[which], self.curves.end[which], self.curves.height[which],
                self.curves.duration[which],
            )  # fmt: skip
            place[rows, legs] = flown.position(since)
            speed[rows, legs] = flown.velocity(since)
            change[rows, legs] = flown.acceleration(since)
        return place, speed, change

    def path(self, knots: FloatArray, tolerance: float) -> MotionPath:
        """The motion as a path; see :func:`gaitopt.motion.body_and_feet.body_and_feet_path`.

        Args:
            knots: times between which the motion is analytic, of :meth:`knots`.
            tolerance: largest distance of a foot from its place [m].

        Raises:
            InputError: a foot is out of reach.
            SolverError: feet depart from their places however short the intervals are.
        """
        return body_and_feet_path(self.robot, knots, self.base, self.feet, tolerance)

    def knots(self, longest: float) -> FloatArray:
        """Times ``(K + 1,)`` between which it is analytic, at most ``longest`` [s] apart."""
        ends = [0.0, self.duration, *self.route.breaks]
        if self.curves is not None:
            lifts = np.array([e.lift_off for e in self.events])
            lands = np.array([e.touch_down for e in self.events])
            inner = lifts[:, None] + self.curves.breaks * (lands - lifts)[:, None]
            ends += [*lifts.tolist(), *lands.tolist(), *inner.ravel().tolist()]
        if self.sway is not None:
            ends += self.sway.times.tolist()
        return refined(np.clip(ends, 0.0, self.duration), longest)


def refined(times: FloatArray, longest: float) -> FloatArray:
    """``times`` without doubles, and more in between, so that none are ``longest`` [s] apart."""
    ordered = np.sort(times)
    kept = ordered[np.concatenate([[True], np.diff(ordered) > 1e-7])]
    kept[-1] = ordered[-1]
    counts = np.maximum(np.ceil(np.diff(kept) / longest - 1e-9).astype(int), 1)
    pieces = [np.linspace(a, b, n, endpoint=False)
              for a, b, n in zip(kept[:-1], kept[1:], counts, strict=True)]  # fmt: skip
    return np.concatenate([*pieces, kept[-1:]])
