"""Where the ground can push in every phase of a gait, as rows on its reaction.

The reaction is that of :class:`gaitopt.planners.by_velocity.reaction.Reaction`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits, pyramid_rows
from gaitopt.optimize.balanced_path import Conditions
from gaitopt.planners.by_velocity.contacts import contacts_at, stances_at, support_changes
from gaitopt.planners.by_velocity.motion import GaitMotion, refined
from gaitopt.planners.by_velocity.reaction import Reaction
from gaitopt.planners.by_velocity.sway import support_sides

RESERVE = 0.005
"""What every foot carries beyond its least normal force, as a share of the weight, for what
happens between the instants."""
FRICTION_LEFT = 0.01
"""What the sides of friction pyramids leave, as a share of the weight."""
REACTIONS = 6
"""Numbers of a reaction."""


def friction_rows(feet: FloatArray, pyramid: FloatArray, *, each: bool) -> FloatArray:
    """Rows on the reaction that friction needs, all to be positive ``(r, 6)``.

    Args:
        feet: that stand ``(k, 2)`` [m].
        pyramid: rows of the friction pyramid ``(s, 3)``.
        each: whether they are also asked of each of two feet. What acts along their line is halved
            between them: they share it as they like.
    """
    if not len(feet):
        return np.empty((0, REACTIONS))
    whole = np.eye(3, REACTIONS)
    if len(feet) != 2 or not each:
        return np.asarray(pyramid @ whole)
    along = feet[1] - feet[0]
    length = float(np.hypot(*along))
    unit = along / length
    across = np.array([-unit[1], unit[0]])
    rows = []
    for one, sign in ((feet[0], -1.0), (feet[1], 1.0)):
        # The moments about the other foot, of what is normal and of what acts across the line.
        other = feet[0] + feet[1] - one
        normal = sign / length * np.array([0.0, 0.0, -other @ unit, *unit, 0.0])
        aside = sign / length * np.array([other[1], -other[0], 0.0, 0.0, 0.0, 1.0])
        force = np.outer([*across, 0.0], aside) + np.outer([0.0, 0.0, 1.0], normal)
        force[:2, :2] += np.outer(unit, unit) / 2.0
        rows.append(pyramid @ force)
    return np.concatenate([pyramid @ whole, *rows])


class PhaseRows(NamedTuple):
    """What is asked of the ZMP in one phase: ``low <= rows @ reaction <= high``.

    Attributes:
        rows: ``(r, 6)``; each is the distance from a side times the vertical force, or in flight
            one number of the reaction.
        low, high: ``(r,)``; equal for equations.
    """

    rows: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, feet: FloatArray, share: float, *, free: bool) -> PhaseRows:
        """Of one phase.

        Args:
            feet: that stand ``(k, 2)`` [m].
            share: of the weight that each of them carries at least.
            free: whether the body may rise and turn. A single foot then has rows of its own: it
                carries its share, and makes no moment about the vertical.
        """
        if not len(feet):
            # Nothing pushes: the robot falls freely, and its angular momentum is constant.
            return cls(np.eye(REACTIONS), np.zeros(REACTIONS), np.zeros(REACTIONS))
        sides = support_sides(feet)
        nothing = np.zeros((len(sides), 1))
        rows = np.column_stack([nothing, nothing, -sides[:, 2], sides[:, :2], nothing])
        extent = (feet @ sides[:, :2].T - sides[:, 2]).max(axis=0, initial=0.0)
        if len(feet) > 2:
            # A side of four feet is left by two of them together.
            low = (2.0 if len(feet) > 3 else 1.0) * share * extent
            return cls(rows, low, np.full(len(rows), np.inf))
        # Two sides at the ends of the line between two feet, and the line itself, whose two sides
        # are one equation. A single foot has two equations.
        kept = [0, 1, 2] if len(feet) == 2 else [0, 2]
        ends = np.array([len(feet) == 2 and k < 2 for k in kept], dtype=np.bool_)
        low, high = np.where(ends, share * extent[kept], 0.0), np.where(ends, np.inf, 0.0)
        rows = rows[kept]
        if free and len(feet) == 1:
            (x, y), up = feet[0], np.eye(1, REACTIONS, 2)
            rows = np.concatenate([rows, [[y, -x, 0.0, 0.0, 0.0, 1.0]], up])
            low, high = np.append(low, [0.0, share]), np.append(high, [0.0, np.inf])
        return cls(rows, low, high)

    @property
    def is_flight(self) -> bool:
        """Whether no foot stands."""
        return len(self.rows) == REACTIONS

    def meets(self, other: PhaseRows) -> bool:
        """Whether a ZMP can be where both ask for it."""
        from scipy.optimize import linprog

        if self.is_flight or other.is_flight:
            return False
        rows = np.concatenate([self.rows, other.rows])
        equal = np.isfinite(np.concatenate([self.high, other.high]))
        # The vertical force is about the weight, so the third number of a reaction is one.
        low = np.concatenate([self.low, other.low]) - rows[:, 2]
        found = linprog(
            np.zeros(2), -rows[~equal][:, 3:5], -low[~equal], rows[equal][:, 3:5], low[equal],
            (None, None),
        )  # fmt: skip
        return bool(found.status == 0)


@dataclass(frozen=True, eq=False)
class Phases:
    """The phases of a gait.

    Attributes:
        edges: their ends ``(E + 1,)`` [s].
        standing: which feet stand ``(E, 4)``.
        rows: what is asked of the ZMP in each.
        friction: rows on the reaction in each that are to be positive.
        jumping: inner edges at which it cannot be where the phases on both sides ask for it
            ``(E - 1,)``.
    """

    edges: FloatArray
    standing: BoolArray
    rows: tuple[PhaseRows, ...]
    friction: tuple[FloatArray, ...]
    jumping: BoolArray

    @classmethod
    def of(cls, motion: GaitMotion, limits: ForceLimits, *, free: bool) -> Phases:
        """Those of a motion, within limits on forces.

        Args:
            motion: the gait.
            limits: on forces.
            free: whether the body may rise and turn. Friction is then asked of each of two feet,
                beside that of all forces together.
        """
        events = motion.events
        edges = refined(support_changes(events, motion.duration), np.inf)
        middles = (edges[1:] + edges[:-1]) / 2.0
        standing = contacts_at(events, middles)
        places = stances_at(motion.footholds, events, middles)[..., :2]
        shares = limits.least_normal_shares(standing).max(axis=1) + RESERVE
        feet = [place[stands] for place, stands in zip(places, standing, strict=True)]
        rows = tuple(
            PhaseRows.of(stand, share, free=free)
            for stand, share in zip(feet, shares.tolist(), strict=True)
        )
        pyramid = pyramid_rows(limits)
        friction = tuple(friction_rows(stand, pyramid, each=free) for stand in feet)
        meeting = [one.meets(other) for one, other in pairwise(rows)]
        return cls(edges, standing, rows, friction, ~np.array(meeting, dtype=np.bool_))

    @property
    def wide(self) -> BoolArray:
        """Phases in which the ZMP has a margin: three feet or more stand ``(E,)``."""
        return np.asarray(self.standing.sum(axis=1) > 2)


@dataclass(frozen=True, eq=False)
class BalanceRows:
    """The rows of all phases at all instants, with those of friction.

    Attributes:
        samples: the instant of each ``(R,)``.
        rows: ``(R, 6)``.
        low, high: ``(R,)``.
        wishes: number of the wished margin that a row is part of ``(R,)``; -1 for none.
    """

    samples: np.ndarray
    rows: FloatArray
    low: FloatArray
    high: FloatArray
    wishes: np.ndarray

    @classmethod
    def of(cls, phases: Phases, owner: np.ndarray) -> BalanceRows:
        """Each phase's rows at each of its instants.

        Args:
            phases: of the gait.
            owner: the phase of every instant ``(N,)``, in order.
        """
        numbers = np.where(phases.wide, np.cumsum(phases.wide) - 1, -1)
        parts = []
        for phase, (own, push) in enumerate(zip(phases.rows, phases.friction, strict=True)):
            mine = np.flatnonzero(owner == phase)
            count = len(own.rows)
            low = np.concatenate([own.low, np.full(len(push), FRICTION_LEFT)])
            high = np.concatenate([own.high, np.full(len(push), np.inf)])
            wishes = np.repeat([numbers[phase], -1], [count, len(push)])
            table = np.tile(np.concatenate([own.rows, push]), (len(mine), 1))
            parts.append((np.repeat(mine, len(low)), table,
                          *(np.tile(x, len(mine)) for x in (low, high, wishes))))  # fmt: skip
        samples, rows, low, high, wishes = (
            np.concatenate(part) for part in zip(*parts, strict=True)
        )
        return cls(samples, rows, low, high, wishes)

    def missed(self, value: FloatArray) -> tuple[FloatArray, FloatArray]:
        """How far equations are from zero, and other conditions from what they need ``(R,)``.

        Args:
            value: the reaction ``(N, 6)``.
        """
        found = np.einsum("ri,ri->r", self.rows, value[self.samples])
        equal = self.low == self.high
        off = np.where(equal, np.abs(found - self.low), 0.0)
        return off, np.where(equal, 0.0, np.maximum(self.low - found, 0.0))

    def conditions(self, found: Reaction, centre: FloatArray) -> Conditions:
        """The same as linear conditions on the body's path, at what it is now.

        Args:
            found: the reaction there, with its derivatives.
            centre: place, velocity and acceleration of the body ``(N, 3, d)``.
        """
        factors = np.einsum("ri,rikj->rkj", self.rows, found.slope[self.samples])
        now = np.einsum("ri,ri->r", self.rows, found.value[self.samples])
        offset = now - np.einsum("rkj,rkj->r", factors, centre[self.samples])
        # What is wished for on top needs its own rows; the margin itself is always needed.
        wished = np.flatnonzero(self.wishes >= 0)
        again = np.concatenate([np.arange(len(now)), wished])
        low = np.concatenate([self.low - offset, -offset[wished]])
        high = np.concatenate([self.high - offset, np.full(len(wished), np.inf)])
        wishes = np.concatenate([np.full(len(now), -1), self.wishes[wished]])
        return Conditions(self.samples[again], factors[again], low, high, wishes)
