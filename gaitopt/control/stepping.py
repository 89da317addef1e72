"""Footholds that are moved sideways, so that a body on two feet does not fall over.

Two feet make no moment about the line through them. So an error of the body's place across this
line grows like the tilt of an inverted pendulum: ``place + speed / w``, the error of its capture
point, is multiplied by ``e^(w T)`` in the time ``T``, with ``w^2 = g / h`` and the height ``h`` of
the centre of mass. In a pace the next line is parallel to this one, so nothing makes up for it but
the place of the next line. If the feet land beside their footholds by ``p``, an error ``e`` is
``p + (e - p) e^(w T)`` at the end of the next step, and with

    p = e / (1 - e^(-w T))

it is gone. [Pratt2006] calls the place that makes a robot stop its capture point.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.control.reference import Reference
from gaitopt.conventions import GRAVITY, LEGS, BoolArray, FloatArray
from gaitopt.robots.quadruped import Quadruped

SETTLED = 0.03
"""How long before its landing a foot's place is not changed any more [s], so that it lands without
speed along the ground."""
SHIFT_TIME = 0.02
"""Time constant with which a flying foot goes over to another place [s]."""


class Stepping:
    """How far flying feet are to land beside their footholds, and are now.

    Args:
        robot: the robot.
        reference: what is followed; with velocities and forces.
        largest: how far feet may land beside their footholds [m]; with 0 nothing is moved.
    """

    def __init__(self, robot: Quadruped, reference: Reference, largest: float) -> None:
        self._reference, self._largest = reference, largest
        self._model: Any = robot.model
        self._data: Any = robot.model.createData()
        self._frames = [robot.model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
        self._radius = robot.foot_radius
        standing = reference.standing
        changes = np.flatnonzero((standing[1:] != standing[:-1]).any(axis=1)) + 1
        self._begins = np.append(changes, len(standing))
        self._decay = float(np.exp(-reference.dt / SHIFT_TIME))
        self._goal = np.zeros((len(LEGS), 3))
        self._shift = np.zeros((len(LEGS), 3))

    def shifts(self, tick: int, q: FloatArray, v: FloatArray) -> FloatArray:
        """Where the flying feet are to be beside the reference ``(4, 3)`` [m], in the world.

        What is said of standing feet is where they have landed. Call it at every tick, in order.

        Args:
            tick: of the reference.
            q, v: Pinocchio's configuration and velocity at the instant of the reference's entry.
        """
        if self._largest <= 0.0:
            return self._shift
        flying = ~self._reference.standing[tick]
        if flying.sum() == 2:
            self._aim(tick, flying, q, v)
        change = self._goal - self._shift
        self._shift[flying] = (self._goal - self._decay * change)[flying]
        return self._shift

    def _aim(self, tick: int, flying: BoolArray, q: FloatArray, v: FloatArray) -> None:
        """Where the two flying feet are to land."""
        ref = self._reference
        number = int(np.searchsorted(self._begins, tick, side="right"))
        landing = int(self._begins[number])
        left = (landing - tick) * ref.dt - ref.ahead
        if number + 1 >= len(self._begins) or left < SETTLED:
            return
        after, last = ref.standing[landing], int(self._begins[number + 1])
        if (after == ref.standing[tick]).any():
            # Feet change one after the other, or all feet stand next: then errors shrink by
            # themselves.
            return
        across = self._across(tick, ~flying)
        error, off, rate = self._errors(tick, across, q, v)
        then = off + (error - off) * np.exp(rate * left)
        next_line = self._across(landing, after)
        lasts = (last - landing) * ref.dt
        wanted = landing_shift(float(then * (across @ next_line)), rate, lasts)
        self._goal[flying] = np.clip(wanted, -self._largest, self._largest) * next_line

    def _across(self, tick: int, feet: BoolArray) -> FloatArray:
        """Horizontal unit vector square to the line of two feet of the reference ``(3,)``."""
        first, second = self._reference.feet[tick, feet]
        line = second - first
        return np.array([-line[1], line[0], 0.0]) / float(np.hypot(line[0], line[1]))

    def _errors(
        self, tick: int, across: FloatArray, q: FloatArray, v: FloatArray
    ) -> tuple[float, float, float]:
        """Error of the capture point, and of the line of the standing feet, each across it [m].

        The third number is the rate of their growth [1/s].
        """
        ref, feet = self._reference, np.flatnonzero(self._reference.standing[tick])
        wanted, speed, _ = self._state(_configuration(ref, tick), ref.velocity[tick])
        there, moving, places = self._state(q, v)
        height = float(there[2] - places[feet, 2].mean()) + self._radius
        rate = float(np.sqrt(GRAVITY / height))
        error = float(across @ (there - wanted + (moving - speed) / rate))
        off = float(across @ (places[feet] - ref.feet[tick, feet]).mean(axis=0))
        return error, off, rate

    def _state(self, q: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Place and velocity of the centre of mass ``(3,)``, and the feet ``(4, 3)``."""
        import pinocchio as pin

        model, data = self._model, self._data
        pin.centerOfMass(model, data, q, v)
        feet = [pin.updateFramePlacement(model, data, frame).translation for frame in self._frames]
        return np.array(data.com[0]), np.array(data.vcom[0]), np.array(feet)


def _configuration(reference: Reference, tick: int) -> FloatArray:
    """Pinocchio's configuration of an entry of the reference ``(nq,)``."""
    import pinocchio as pin

    turn = pin.Quaternion(reference.rotation[tick]).coeffs()
    return np.concatenate([reference.position[tick], turn, reference.joints[tick]])


def landing_shift(error: float, rate: float, lasts: float) -> float:
    """How far beside its place a line has to be so that an error is gone after a step [m].

    Args:
        error: of the capture point across the line when the step begins [m].
        rate: of its growth [1/s].
        lasts: how long the step lasts [s].
    """
    return error / -float(np.expm1(-rate * lasts))
