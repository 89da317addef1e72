"""Ways from a state to rest on four feet: the body brakes along its velocity, and feet land.

Braking is a family of polynomials: with the time ``T`` and the power ``n`` the velocity is that of
the state times ``(1 - t/T)^n``. The larger ``n`` is, the more of the braking comes first; a robot
on its feet that moves towards the border of its support is stopped best in this way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.entering.begin import Begin
from gaitopt.entering.flights import Flight, landings, some_times
from gaitopt.motion.pieces import ROUNDING, States

POWERS = (2, 3, 4, 1)
"""Powers that are tried. With 2 and more the body ends without acceleration."""
WHILE_FLYING = (2, 4)
"""The same where feet are in the air, which come down in many ways."""
STILL = 1e-9
"""A base that moves less fast is at rest [m/s, rad/s]."""
INTERVALS = 16
"""Least number of intervals of an entry."""
LOWERED = (0.05, 0.12)
"""How far the body sinks while it brakes, in standing heights, where legs are too straight for any
other way."""
SAME_INSTANT = 1e-9
"""Times that differ by less are one [s]."""


@dataclass(frozen=True, eq=False)
class Braking:
    """How the body comes to rest.

    Attributes:
        base: its columns, and their rates, at the begin ``(2, 6)``.
        time: how long it takes from when it begins [s]; 0 for a body at rest.
        power: of the share of the time that is left, with which the velocity falls.
        coast: time in which the body goes on as it does, before [s].
        sinks: how far it moves down meanwhile [m].
    """

    base: FloatArray
    time: float
    power: int
    coast: float = 0.0
    sinks: float = 0.0

    @property
    def duration(self) -> float:
        """When the body is at rest [s]."""
        return self.coast + self.time

    @property
    def edges(self) -> list[float]:
        """Times between which it is one polynomial [s]."""
        return [0.0, self.coast, self.duration]

    def at(self, times: FloatArray) -> States:
        """Columns of the base ``(N, 6)`` and two derivatives."""
        (place, rates), n, total = self.base, self.power, self.time
        still = np.zeros((len(times), len(place)))
        if not total > 0.0:
            return still + place, still, still
        left = np.clip(1.0 - (times - self.coast) / total, 0.0, 1.0)[:, None]
        brakes = ((times >= self.coast) & (times < self.duration))[:, None]
        gone = np.minimum(times, self.coast)[:, None]
        values = (
            place + rates * (gone + total / (n + 1) * (1.0 - left ** (n + 1))),
            rates * left**n,
            np.where(brakes, -n / total * rates * left ** (n - 1), 0.0),
        )
        if self.sinks > 0.0:
            # From the first instant to the last: 10 t^3 - 15 t^4 + 6 t^5.
            end, t = self.duration, np.clip(times / self.duration, 0.0, 1.0)
            values[0][:, 2] -= self.sinks * t**3 * (10.0 - 15.0 * t + 6.0 * t**2)
            values[1][:, 2] -= self.sinks * 30.0 * t**2 * (1.0 - t) ** 2 / end
            values[2][:, 2] -= self.sinks * 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t) / end**2
        return values


class Body(Protocol):
    """How the body comes to rest."""

    @property
    def duration(self) -> float:
        """When it is at rest [s]."""

    @property
    def edges(self) -> list[float]:
        """Times between which it is one polynomial [s]."""

    def at(self, times: FloatArray) -> States:
        """Columns of the base ``(N, 6)`` and two derivatives."""


@dataclass(frozen=True, eq=False)
class Entry:
    """One way to rest on four feet.

    Attributes:
        begin: the state.
        body: how it comes to rest.
        down: the flights of all feet that are in the air.
    """

    begin: Begin
    body: Body
    down: tuple[Flight, ...]

    @property
    def duration(self) -> float:
        """When the robot is at rest on four feet [s]."""
        return max([self.body.duration, *(flight.duration for flight in self.down)])

    @property
    def landings(self) -> dict[str, float]:
        """When each foot lands [s]."""
        return {LEGS[flight.leg]: flight.duration for flight in self.down}

    def feet(self, times: FloatArray) -> States:
        """Feet in the world and two derivatives ``(N, 4, 3)`` each."""
        place = np.repeat(self.begin.feet[:1], len(times), axis=0)
        velocity, acceleration = np.zeros_like(place), np.zeros_like(place)
        for flight in self.down:
            for order, out in enumerate((place, velocity, acceleration)):
                out[:, flight.leg] = flight.at(times, order)
        return place, velocity, acceleration

    def knots(self) -> FloatArray:
        """Times between which it is analytic ``(K + 1,)`` [s]."""
        end = self.duration
        ends = [end, *self.body.edges]
        edges = np.unique(np.concatenate([ends, *(flight.edges for flight in self.down)]))
        edges = edges[np.append(np.diff(edges) > SAME_INSTANT, True)]
        counts = np.ceil(np.diff(edges) / (end / INTERVALS) - ROUNDING).astype(int)
        pieces = [np.linspace(a, b, n, endpoint=False)
                  for a, b, n in zip(edges[:-1], edges[1:], counts, strict=True)]  # fmt: skip
        return np.concatenate([*pieces, edges[-1:]])


def body_rests(begin: Begin) -> bool:
    """Whether the body of a state does not move."""
    return bool(np.abs(begin.base[1]).max() <= STILL)


def entries(
    begin: Begin, swing_height: float, *, all_ways: bool, lowered: bool = False
) -> list[Entry]:
    """Ways to brake and to land, the quickest ones first.

    Args:
        begin: the state.
        swing_height: how far feet may rise on their way down [m].
        all_ways: whether feet land in all ways, and the body brakes in fewer.
        lowered: whether the body sinks while it brakes.
    """
    sinks = np.array(LOWERED) * begin.robot.standing_height if lowered else np.zeros(1)
    found = []
    for down in landings(begin, swing_height, all_ways=all_ways):
        landing = max((flight.duration for flight in down), default=0.0)
        found += [
            Entry(begin, replace(way, sinks=far), down)
            for way in brakings(begin, landing, all_ways=all_ways)
            for far in sinks.tolist()
        ]
    return sorted(found, key=lambda entry: entry.duration)


def brakings(begin: Begin, landing: float, *, all_ways: bool) -> list[Braking]:
    """Ways in which the body comes to rest.

    Args:
        begin: the state.
        landing: when the last foot lands [s]; until then the body may go on as it does, as on three
            feet there may be no forces that brake it.
        all_ways: whether feet land in all ways, and the body brakes in fewer.
    """
    if body_rests(begin):
        return [Braking(begin.base, 0.0, 1)]
    if not begin.flying:
        return [Braking(begin.base, time, power) for time in some_times() for power in POWERS]
    times = some_times()[:: 4 if all_ways else 2]
    return [
        Braking(begin.base, time, power, coast)
        for time in times
        for power in WHILE_FLYING
        for coast in (0.0, landing)
    ]
