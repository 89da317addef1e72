"""Body and feet of a gait as functions of time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.gait.step_timing import SwingEvent
from gaitopt.motion.body_and_feet import body_and_feet_path
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import ROUNDING, States
from gaitopt.planners.by_velocity.body_route import BodyRoute
from gaitopt.planners.by_velocity.contacts import flights_at, stances_at
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body_rates import base_twist, base_twist_rate
from gaitopt.swing.catalogue import swing_curve
from gaitopt.swing.curve import SwingCurve
from gaitopt.terrain.footholds import Footholds


@dataclass(frozen=True, eq=False)
class GaitMotion:
    """The motion of a gait's body and feet.

    Attributes:
        robot: the robot.
        route: the nominal route of the body's centre.
        sway: the body's own path; ``None`` where its centre follows the route. Two columns are x
            and y of the centre of a level body, six are those of the base of a free one: x, y, z,
            roll, pitch, yaw.
        height: of the body's centre; that of the route of a free body [m].
        footholds: where the feet stand.
        events: all swings, in the order of lift-offs.
        swing: name of the swing curve.
        swing_height: how far a foot rises [m].
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

    @property
    def ahead(self) -> FloatArray:
        """The direction in which a straight route begins ``(2,)``, a unit vector."""
        return np.array([np.cos(self.route.heading), np.sin(self.route.heading)])

    def centre(self, times: FloatArray) -> States:
        """Positions, velocities and accelerations of the body's centre ``(N, 2)`` in the world."""
        if self.sway is None:
            return self.route.motion(times)
        states = self._swayed(self.sway, times)
        if not self.is_free:
            return states
        place, velocity, acceleration = centre_of_base(self.robot, states)
        return place[:, :2], velocity[:, :2], acceleration[:, :2]

    def centre_places(self, times: FloatArray) -> FloatArray:
        """Positions of the body's centre in the world ``(N, 3)`` [m]."""
        if self.is_free:
            return centre_of_base(self.robot, self.base(times))[0]
        return np.column_stack([self.centre(times)[0], np.full(len(times), self.height)])

    @property
    def is_free(self) -> bool:
        """Whether the body moves in all six directions; otherwise it is level, at one height."""
        return self.sway is not None and self.sway.coefficients.shape[2] == BASE_COLUMNS

    def _swayed(self, sway: MotionPath, times: FloatArray) -> States:
        place, velocity, acceleration = (sway.evaluate(times, k) for k in range(3))
        return place, velocity, acceleration

    def base(self, times: FloatArray) -> States:
        """x, y, z, roll, pitch, yaw of the base ``(N, 6)`` and two derivatives."""
        if self.sway is not None and self.is_free:
            return self._swayed(self.sway, times)
        return self.base_of(times, self.centre(times))

    def base_of(self, times: FloatArray, centre: States) -> States:
        """The same for a level body, with its centre elsewhere.

        Args:
            times: ``(N,)`` [s]; they give the yaw.
            centre: positions, velocities and accelerations of the centre ``(N, 2)``.
        """
        place, velocity, acceleration = centre
        yaw, yaw_rate, yaw_acceleration = self.route.yaw(times)
        c, s = np.cos(yaw), np.sin(yaw)
        x, y, z = self.robot.centre.tolist()
        # From the base's origin to the body's centre, and the same turned left by a quarter turn.
        arm = np.stack([c * x - s * y, s * x + c * y], axis=-1)
        across = np.stack([-arm[:, 1], arm[:, 0]], axis=-1)
        out = [np.zeros((len(times), BASE_COLUMNS)) for _ in range(3)]
        out[0][:, :2] = place - arm
        out[1][:, :2] = velocity - across * yaw_rate[:, None]
        out[2][:, :2] = (
            acceleration - across * yaw_acceleration[:, None] + arm * (yaw_rate**2)[:, None]
        )
        out[0][:, 2] = self.height - z
        ahead = self.robot.body_axes[:, 0]
        out[0][:, 5] = yaw - float(np.arctan2(ahead[1], ahead[0]))
        out[1][:, 5], out[2][:, 5] = yaw_rate, yaw_acceleration
        return out[0], out[1], out[2]

    def feet(self, times: FloatArray) -> States:
        """Feet in the world ``(N, 4, 3)`` and two derivatives."""
        place = stances_at(self.footholds, self.events, times)
        velocity, acceleration = np.zeros_like(place), np.zeros_like(place)
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
            velocity[rows, legs] = flown.velocity(since)
            acceleration[rows, legs] = flown.acceleration(since)
        return place, velocity, acceleration

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
        """Times ``(K + 1,)`` between which the motion is analytic, at most ``longest`` [s] apart.

        Args:
            longest: longest interval of the result [s].
        """
        ends = [0.0, self.duration, *self.route.breaks]
        if self.curves is not None:
            lifts = np.array([e.lift_off for e in self.events])
            lands = np.array([e.touch_down for e in self.events])
            inner = lifts[:, None] + self.curves.breaks * (lands - lifts)[:, None]
            ends += [*lifts.tolist(), *lands.tolist(), *inner.ravel().tolist()]
        if self.sway is not None:
            ends += self.sway.times.tolist()
        return refined(np.clip(ends, 0.0, self.duration), longest)


def centre_of_base(robot: Quadruped, base: States) -> States:
    """Positions, velocities and accelerations of the body's centre ``(N, 3)`` in the world.

    Args:
        robot: the robot.
        base: x, y, z, roll, pitch, yaw of its base ``(N, 6)`` and two derivatives.
    """
    places, rates, changes = base
    rpy, arm = places[:, 3:], robot.body_axes @ robot.centre
    linear, spin = np.split(base_twist(rpy, rates[:, :3], rates[:, 3:]), 2, axis=1)
    change = base_twist_rate(rpy, rates[:, :3], rates[:, 3:], changes[:, :3], changes[:, 3:])
    velocity = linear + np.cross(spin, arm)
    acceleration = change[:, :3] + np.cross(change[:, 3:], arm) + np.cross(spin, velocity)
    # Rows times the transposed rotation: from the base's axes to the world's.
    back = np.swapaxes(rpy_to_matrix(rpy), 1, 2)
    arm_, velocity, acceleration = (
        (row[:, None] @ back)[:, 0]
        for row in (np.broadcast_to(arm, linear.shape), velocity, acceleration)
    )
    return places[:, :3] + arm_, velocity, acceleration


SAME_INSTANT = 1e-7
"""Two instants that are no farther apart are one [s], for rounding: derivatives over a shorter
interval would be noise."""


def refined(times: FloatArray, longest: float) -> FloatArray:
    """``times`` in order, without equal ones, with more between them, at most ``longest`` apart.

    Args:
        times: instants in any order ``(N,)`` [s].
        longest: longest interval of the result [s].
    """
    ordered = np.sort(times)
    kept = ordered[np.concatenate([[True], np.diff(ordered) > SAME_INSTANT])]
    kept[-1] = ordered[-1]
    counts = np.maximum(np.ceil(np.diff(kept) / longest - ROUNDING).astype(int), 1)
    pieces = [np.linspace(a, b, n, endpoint=False)
              for a, b, n in zip(kept[:-1], kept[1:], counts, strict=True)]  # fmt: skip
    return np.concatenate([*pieces, kept[-1:]])
