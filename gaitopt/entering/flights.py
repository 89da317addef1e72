"""How feet that are in the air come down: polynomials in time from where they are to a foothold."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.entering.begin import Begin
from gaitopt.motion.pieces import States, piece_values, quintic_hermite

SHORTEST, LONGEST = 0.04, 6.0
"""Shortest and longest time of a flight that is tried [s]: from below a fast robot's least, to
slow ones that take seconds for a step."""
GROWTH = 1.25
"""Ratio of a time that is tried to the one before."""
RISES = (0.0, 0.3, 1.0)
"""How far a foot rises above the higher end of its flight, in swing heights; with 0 it goes
straight to its foothold."""
EASES = (1.0, 0.5, 0.0)
"""First acceleration of a foot as a share of that of the cubic with the same ends. With less than
that it brakes later; what it then asks of the standing feet comes later, too."""
STOPS = (0.05, 0.15, 0.4)
"""Times in which a foot is stopped in the air before it goes on [s]: joints that are at their
velocity limit in the state need not turn faster then."""
NATURAL = (1.5, 2.0, 2.5, 3.0)
"""Times in which a foot comes down that is about to land, in those that it would take at its speed:
with 2 it slows down evenly."""
TOP = 0.45
"""Share of the time at which a foot that rises is highest."""
SAMPLES = 41
"""Instants at which a flight is held against the ground."""
SINKING = 2e-4
"""How far a ball may sink into a height map [m]: less than half of what the certificate allows."""
BESIDE = 1e-9
"""How far below an end a foot may be by rounding [m]."""


@dataclass(frozen=True, eq=False)
class Flight:
    """One foot on its way down.

    Attributes:
        leg: index of the leg.
        edges: begin of its pieces, and its end ``(P + 1,)`` [s].
        coefficients: of x, y, z, highest power first, since each piece's begin ``(6, P, 3)``.
    """

    leg: int
    edges: FloatArray
    coefficients: FloatArray

    @property
    def duration(self) -> float:
        """When it lands [s]."""
        return float(self.edges[-1])

    def at(self, times: FloatArray, order: int = 0) -> FloatArray:
        """Places or a derivative ``(N, 3)``; after its end the foot rests on its foothold."""
        inside = np.clip(times, 0.0, self.duration)
        piece = np.clip(np.searchsorted(self.edges, inside, side="right") - 1, 0,
                        len(self.edges) - 2)  # fmt: skip
        found = piece_values(self.coefficients, inside - self.edges[piece], piece, order)
        return found if order == 0 else np.where((times < self.duration)[:, None], found, 0.0)


class Way(NamedTuple):
    """Which of the flights.

    Attributes:
        duration: how long it takes after the stop [s].
        rise: how far the foot rises [m].
        ease: share of the first acceleration.
        stop: time in which the foot is stopped before [s]; 0 for a flight without a stop.
    """

    duration: float
    rise: float
    ease: float = 1.0
    stop: float = 0.0


def landings(
    begin: Begin, swing_height: float, *, all_ways: bool = False
) -> list[tuple[Flight, ...]]:
    """Flights of all feet in the air, all in one way, that are clear of the ground.

    Args:
        begin: where they begin.
        swing_height: how far feet rise [m].
        all_ways: whether to try those as well that brake later, or stop in the air.
    """
    if not begin.flying:
        return [()]
    first = [(EASES[0], 0.0)]
    more = [(ease, 0.0) for ease in EASES[1:]] + [(EASES[0], stop) for stop in STOPS]
    legs = [LEGS.index(leg) for leg in begin.flying]
    ways = [Way(time, 0.0) for leg in legs for time in _natural_times(begin, leg)] + [
        Way(time, rise * swing_height, ease, stop)
        for time in some_times()[::2]
        for rise in RISES
        for ease, stop in (first + more if all_ways else first)
    ]
    found = [tuple(_flight(begin, leg, way) for leg in legs) for way in ways]
    return [down for down in found if all(is_clear(begin, flight) for flight in down)]


def some_times() -> list[float]:
    """The times that are tried [s]."""
    count = int(np.log(LONGEST / SHORTEST) / np.log(GROWTH)) + 1
    return [SHORTEST * GROWTH**k for k in range(count)]


def _natural_times(begin: Begin, leg: int) -> list[float]:
    """Times in which a foot that moves comes straight down [s]."""
    far = float(np.linalg.norm(begin.footholds[LEGS[leg]][0] - begin.feet[0, leg]))
    speed = float(np.linalg.norm(begin.feet[1, leg]))
    return [share * far / speed for share in NATURAL] if far > BESIDE and speed > BESIDE else []


def _flight(begin: Begin, leg: int, way: Way) -> Flight:
    """A flight that lands at rest."""
    (place, velocity), goal = begin.feet[:, leg], begin.footholds[LEGS[leg]][0]
    edges, pieces = [0.0], []
    if way.stop > 0.0:
        # The velocity falls as (1 - t/T)^2.
        stopped = place + velocity * way.stop / 3.0
        pieces.append(_between(way.stop, (place, velocity, -2.0 * velocity / way.stop), stopped))
        edges.append(way.stop)
        place, velocity = stopped, np.zeros(3)
    far, even = 6.0 * (goal - place) / way.duration**2, 2.0 * velocity / way.duration
    # With the whole first acceleration a foot that goes straight to its foothold flies a cubic.
    end = even - far if way.rise <= 0.0 and way.ease == EASES[0] else 0.0 * goal
    whole = _between(way.duration, (place, velocity, way.ease * (far - 2.0 * even)), goal, end)
    if way.rise <= 0.0:
        pieces.append(whole)
    else:
        pieces += _over(whole, way, (place[2], velocity[2]), goal[2])
        edges.append(edges[-1] + TOP * way.duration)
    edges.append(edges[0 if way.stop <= 0.0 else 1] + way.duration)
    return Flight(leg, np.array(edges), np.stack(pieces, axis=1))


def _over(
    whole: FloatArray, way: Way, rising: tuple[float, float], goal: float
) -> list[FloatArray]:
    """The two pieces of a flight that rises.

    Args:
        whole: coefficients of the flight straight to its end ``(6, 3)``; x and y stay.
        way: which flight.
        rising: height and its rate at the begin [m], [m/s].
        goal: height at the end [m].
    """
    first, total = TOP * way.duration, way.duration
    top, none = np.array([max(rising[0], goal) + way.rise]), np.zeros(1)
    height, rate = np.array([rising[0]]), np.array([rising[1]])
    slowing = way.ease * (6.0 * (top - height) / first**2 - 4.0 * rate / first)
    up = _between(first, (height, rate, slowing), top)
    down = _between(total - first, (top, none, 6.0 * (goal - top) / (total - first) ** 2),
                    np.array([goal]))  # fmt: skip
    # The same polynomial of x and y, since the begin of the second piece.
    only = np.zeros(1, dtype=int)
    here, there = (
        (piece_values(whole[:, None, :2], t, only), piece_values(whole[:, None, :2], t, only, 1),
         piece_values(whole[:, None, :2], t, only, 2))
        for t in (np.array([first]), np.array([total]))
    )  # fmt: skip
    level = quintic_hermite(np.array([total - first]), here, there)[:, 0]
    return [np.concatenate([whole[:, :2], up], axis=1), np.concatenate([level, down], axis=1)]


def _between(
    duration: float, begin: States, goal: FloatArray, end: FloatArray | None = None
) -> FloatArray:
    """Coefficients ``(6, n)`` from a moving point to a point at rest.

    Args:
        duration: [s].
        begin: place, velocity and acceleration ``(n,)`` each.
        goal: where it comes to rest ``(n,)``.
        end: acceleration there ``(n,)``; none by default.
    """
    nothing = np.zeros_like(goal)[None]
    last = nothing if end is None else end[None]
    place, velocity, acceleration = (part[None] for part in begin)
    return quintic_hermite(np.array([duration]), (place, velocity, acceleration),
                           (goal[None], nothing, last))[:, 0]  # fmt: skip


def is_clear(begin: Begin, flight: Flight) -> bool:
    """Whether a foot stays above the ground.

    It is never below both ends of its way, and not below its foothold when it is near it. On a
    height map its ball is above the map.
    """
    footholds, leg = begin.footholds, LEGS[flight.leg]
    goal, radius = footholds[leg][0], begin.robot.foot_radius
    places = flight.at(np.linspace(0.0, flight.duration, SAMPLES))
    least = min(places[0, 2], goal[2])
    if places[:, 2].min() < least - BESIDE:
        return False
    if footholds.ground is not None:
        ground = footholds.ground.ball(places[:, :2], radius).centres[:, 2]
        # Comparisons with NaN, where the ground is not known, are false.
        return bool((places[:, 2] >= ground - SINKING).all())
    near = np.linalg.norm(places[:, :2] - goal[:2], axis=1) < footholds.landing_radius + radius
    return bool((places[near, 2] >= goal[2] - BESIDE).all())
