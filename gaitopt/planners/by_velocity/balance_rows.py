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
"""What the sides of the friction pyramid of all forces together leave, as a share of the weight."""
REACTIONS = 5
"""Numbers of a reaction."""


class PhaseRows(NamedTuple):
    """What is asked of the ZMP in one phase: ``low <= rows @ reaction <= high``.

    Attributes:
        rows: ``(r, 5)``; each is the distance from a side times the vertical force.
        low, high: ``(r,)``; equal for equations.
    """

    rows: FloatArray
    low: FloatArray
    high: FloatArray

    @classmethod
    def of(cls, feet: FloatArray, share: float) -> PhaseRows:
        """Of one phase.

        Args:
            feet: that stand ``(k, 2)`` [m].
            share: of the weight that each of them carries at least.
        """
        sides = support_sides(feet)
        rows = np.column_stack([np.zeros((len(sides), 2)), -sides[:, 2], sides[:, :2]])
        extent = (feet @ sides[:, :2].T - sides[:, 2]).max(axis=0, initial=0.0)
        if len(feet) > 2:
            # A side of four feet is left by two of them together.
            low = (2.0 if len(feet) > 3 else 1.0) * share * extent
            return cls(rows, low, np.full(len(rows), np.inf))
        # Two sides at the ends of the line between two feet, and the line itself, whose two sides
        # are one equation. A single foot has two equations.
        kept = [0, 1, 2] if len(feet) == 2 else [0, 2][: len(rows)]
        ends = np.array([len(feet) == 2 and k < 2 for k in kept], dtype=np.bool_)
        return cls(rows[kept], np.where(ends, share * extent[kept], 0.0),
                   np.where(ends, np.inf, 0.0))  # fmt: skip

    def meets(self, other: PhaseRows) -> bool:
        """Whether a ZMP can be where both ask for it."""
        from scipy.optimize import linprog

        rows = np.concatenate([self.rows, other.rows])
        equal = np.isfinite(np.concatenate([self.high, other.high]))
        # The vertical force is about the weight, so the third number of a reaction is one.
        low = np.concatenate([self.low, other.low]) - rows[:, 2]
        found = linprog(
            np.zeros(2), -rows[~equal][:, 3:], -low[~equal], rows[equal][:, 3:], low[equal],
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
        jumping: inner edges at which it cannot be where the phases on both sides ask for it
            ``(E - 1,)``.
    """

    edges: FloatArray
    standing: BoolArray
    rows: tuple[PhaseRows, ...]
    jumping: BoolArray

    @classmethod
    def of(cls, motion: GaitMotion, limits: ForceLimits) -> Phases:
        """Those of a motion, within limits on forces."""
        events = motion.events
        edges = refined(support_changes(events, motion.duration), np.inf)
        middles = (edges[1:] + edges[:-1]) / 2.0
        standing = contacts_at(events, middles)
        places = stances_at(motion.footholds, events, middles)[..., :2]
        shares = limits.least_normal_shares(standing).max(axis=1) + RESERVE
        rows = tuple(PhaseRows.of(places[k][standing[k]], float(shares[k]))
                     for k in range(len(middles)))  # fmt: skip
        meeting = [one.meets(other) for one, other in pairwise(rows)]
        return cls(edges, standing, rows, ~np.array(meeting, dtype=np.bool_))

    @property
    def wide(self) -> BoolArray:
        """Phases in which the ZMP has a margin: three feet or more stand ``(E,)``."""
        return np.asarray(self.standing.sum(axis=1) > 2)


@dataclass(frozen=True, eq=False)
class BalanceRows:
    """The rows of all phases at all instants, with those of friction.

    Attributes:
        samples: the instant of each ``(R,)``.
        rows: ``(R, 5)``.
        low, high: ``(R,)``.
        wishes: number of the wished margin that a row is part of ``(R,)``; -1 for none.
    """

    samples: np.ndarray
    rows: FloatArray
    low: FloatArray
    high: FloatArray
    wishes: np.ndarray

    @classmethod
    def of(cls, phases: Phases, owner: np.ndarray, limits: ForceLimits) -> BalanceRows:
        """Each phase's rows at each of its instants.

        Args:
            phases: of the gait.
            owner: the phase of every instant ``(N,)``, in order.
            limits: on forces; friction is asked of the sum of all forces.
        """
        push = np.zeros((limits.sides, REACTIONS))
        push[:, :3] = pyramid_rows(limits)
        numbers = np.where(phases.wide, np.cumsum(phases.wide) - 1, -1)
        parts = []
        for phase, own in enumerate(phases.rows):
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
            value: the reaction ``(N, 5)``.
        """
        found = np.einsum("ri,ri->r", self.rows, value[self.samples])
        equal = self.low == self.high
        off = np.where(equal, np.abs(found - self.low), 0.0)
        return off, np.where(equal, 0.0, np.maximum(self.low - found, 0.0))

    def conditions(self, found: Reaction, centre: FloatArray) -> Conditions:
        """The same as linear conditions on the body's path, at what it is now.

        Args:
            found: the reaction there, with its derivatives.
            centre: place, velocity and acceleration of the body's centre ``(N, 3, 2)``.
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
