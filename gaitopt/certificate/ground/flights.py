"""How far flying feet are above the ground, at every instant.

A foot is a ball, and its centre leaves the chord between two samples by a known bound. A piece of a
chord is settled by the distance of its middle from the ground; where that is not enough, it is cut
in halves.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from gaitopt.certificate.closer import SETTLED, looked_at_closely
from gaitopt.certificate.contacts import SINKING
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.plan.plan import Plan

KNOWN = 0.2
"""A gap is known well enough when half the piece of chord that it belongs to is no longer than this
share of it. Chosen: reports are then true to 20 %."""
SHORTEST = 2e-5
"""Shortest piece of a chord that is looked at [m]. Chosen: a fifth of how far a foot may leave its
chord."""
MOST_ROUNDS = 16
"""Most times that a piece is cut in halves. Chosen: 1 m in 2^16 parts is less than
:data:`SHORTEST`."""
POINT = 0.01
"""How far a foot that is a point is from the end of its swing where it counts as there [m]; one
that is a ball, by its radius. Chosen: the radius of a small foot."""
ROOM = 0.01
"""Distances are computed up to this one beyond a foot's radius [m]. Chosen: a larger one says no
more than that a foot is well above the ground."""


class Ground(Protocol):
    """What feet fly above."""

    def highest(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Upper bound on its height under rectangles; infinite where it is not known."""

    def distances(self, points: FloatArray, reach: float) -> FloatArray:
        """Distances of points, negative below it; those beyond ``reach`` are told as this."""


@dataclass(frozen=True, eq=False)
class Flights:
    """The gaps between flying feet and the ground.

    Attributes:
        gaps: lower bound on each foot's height above the ground on each piece of the motion
            ``(P, 4)`` [m]; infinite for feet that stand, and minus infinity above unknown ground.
        near: whether the foot is at one of the two ends of its swing ``(P, 4)``.
    """

    gaps: FloatArray
    near: BoolArray

    @classmethod
    def of(cls, plan: Plan, motion: Motion, ground: Ground) -> Flights:
        """The gaps of all swings of a plan."""
        gaps = np.full(motion.standing.shape, np.inf)
        near = np.zeros(motion.standing.shape, dtype=np.bool_)
        radius = plan.robot.foot_radius
        for swing in plan.swings:
            leg = LEGS.index(swing.leg)
            first, last = np.searchsorted(motion.phase, [swing.phases[0], swing.phases[1] + 1])
            flight = slice(int(first), int(last))
            ends = np.stack([swing.foot_start, swing.foot_end])
            away = np.linalg.norm(motion.feet[:, flight, leg, None] - ends, axis=-1)
            near[flight, leg] = (away <= max(radius, POINT)).all(axis=0).any(axis=-1)
        flying = np.nonzero(~motion.standing)
        limits = np.where(near, -SINKING, 0.0)
        start, end = motion.feet[0][flying], motion.feet[1][flying]
        leaves = motion.feet_deviation[flying]
        gaps[flying] = _gaps(start, end, leaves, radius, limits[flying], ground)
        return cls(looked_at_again(plan, motion, gaps, limits, ground), near)


def looked_at_again(
    plan: Plan,
    motion: Motion,
    gaps: FloatArray,
    limits: FloatArray,
    ground: Ground,
    counts: Callable[[Plan, Motion], BoolArray] | None = None,
) -> FloatArray:
    """Gaps ``(P, 4)`` that may be short only because feet may leave their chords, made better.

    Args:
        plan, motion: the plan and its motion.
        gaps: lower bounds on each foot's gap on each piece ``(P, 4)`` [m].
        limits: gaps that are to be shown ``(P, 4)`` [m].
        ground: below the feet.
        counts: where a gap counts, by plan and motion; everywhere by default.
    """
    out = np.array(gaps)
    for leg in range(len(LEGS)):

        def unsettled(
            gaps: FloatArray, part: Motion, owner: np.ndarray, leg: int = leg
        ) -> BoolArray:
            leaves, limit = part.feet_deviation[:, leg], limits[owner, leg]
            # The middle of a chord is up to one bound away from the foot, and counts with another.
            return np.asarray((gaps < limit) & (gaps + 2.0 * leaves >= limit) & (leaves > SETTLED))

        def look(part: Motion, owner: np.ndarray, leg: int = leg) -> tuple[FloatArray, BoolArray]:
            start, end = part.feet[:, :, leg]
            found = _gaps(start, end, part.feet_deviation[:, leg], plan.robot.foot_radius,
                          limits[owner, leg], ground)  # fmt: skip
            if counts is not None:
                found = np.asarray(np.where(counts(plan, part)[:, leg], found, np.inf))
            return found, unsettled(found, part, owner)

        short = np.flatnonzero(unsettled(gaps[:, leg], motion, np.arange(len(gaps))))
        if len(short):
            better = looked_at_closely(plan, motion, short, look)
            out[short, leg] = np.maximum(out[short, leg], better)
    return out


def _gaps(
    start: FloatArray, end: FloatArray, leaves: FloatArray, radius: float, limits: FloatArray,
    ground: Ground,
) -> FloatArray:  # fmt: skip
    """Lower bounds on the gaps of balls along chords ``(N,)`` [m].

    Args:
        start, end: of the chords of the balls' middles ``(N, 3)`` [m].
        leaves: how far the middles leave their chords ``(N,)`` [m].
        radius: of the balls [m].
        limits: gaps that are to be shown ``(N,)`` [m].
        ground: below them.
    """
    around = (radius + leaves)[:, None]
    low, high = np.minimum(start, end) - around, np.maximum(start, end) + around
    room = low[:, 2] - ground.highest(low[:, :2], high[:, :2])
    out = np.where((room >= ROOM) | np.isneginf(room), room, np.inf)
    owner = np.flatnonzero(~(room >= ROOM) & ~np.isneginf(room))
    a, b = start[owner], end[owner]
    for left in range(MOST_ROUNDS, -1, -1):
        if not len(owner):
            break
        half = np.linalg.norm(b - a, axis=1) / 2.0
        reach = radius + ROOM + float(half.max())
        middle = (a + b) / 2.0
        bound = ground.distances(middle, reach) - radius - half - leaves[owner]
        seen = bound + half
        known = (bound >= ROOM / 2.0) | (half <= np.maximum(KNOWN * seen, 2.0 * SHORTEST))
        again = ~((bound >= limits[owner]) & known) & (half > SHORTEST / 2.0) & (left > 0)
        # A point that is too low settles the piece.
        again &= seen >= limits[owner]
        np.minimum.at(out, owner[~again], np.where(seen < limits[owner], seen, bound)[~again])
        a, b, owner = (
            np.concatenate([a[again], middle[again]]), np.concatenate([middle[again], b[again]]),
            np.concatenate([owner[again], owner[again]]),
        )  # fmt: skip
    return out
