"""Body and feet of a gait as functions of time, and the joints that follow from them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.gait.step_timing import SwingEvent
from gaitopt.motion.path import MotionPath
from gaitopt.motion.smooth_path import States
from gaitopt.planners.by_velocity.body_route import BodyRoute
from gaitopt.planners.by_velocity.contacts import flights_at, stances_at
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import feet_from_joints, joints_from_feet
from gaitopt.robots.whole_body_rates import (
    base_twist,
    base_twist_rate,
    joint_accelerations,
    joint_rates,
)
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

    def state(self, times: FloatArray, inside: FloatArray) -> States:
        """Path columns and two derivatives ``(N, 6 + nj)``, for :func:`smooth_path`."""
        base = self.base(times)[0]
        joints = joints_from_feet(self.robot, base[:, :3], base[:, 3:], self.feet(times)[0])
        _, speed, change = self.base(inside)
        _, foot_speed, foot_change = self.feet(inside)
        rpy = base[:, 3:]
        twist = base_twist(rpy, speed[:, :3], speed[:, 3:])
        rate = base_twist_rate(rpy, speed[:, :3], speed[:, 3:], change[:, :3], change[:, 3:])
        rates = joint_rates(self.robot, rpy, joints, twist, foot_speed)
        accelerations = joint_accelerations(
            self.robot, rpy, joints, twist, rates, rate, foot_change
        )
        return (
            np.concatenate([base, joints], axis=1),
            np.concatenate([speed, rates], axis=1),
            np.concatenate([change, accelerations], axis=1),
        )

    def foot_error(self, times: FloatArray, values: FloatArray) -> FloatArray:
        """How far the feet are from their places at path values ``(N, 6 + nj)``: ``(N,)`` [m]."""
        feet = feet_from_joints(self.robot, values[:, :3], values[:, 3:6], values[:, 6:])
        return np.asarray(np.linalg.norm(feet - self.feet(times)[0], axis=2).max(axis=1))

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
