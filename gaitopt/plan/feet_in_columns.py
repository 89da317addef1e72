"""Feet of a planned walk that go into columns beside their own, found when the walk is planned.

A foot is a ball, which may be thicker than the gap between two columns. Where one of them is
higher, the foot on the other one is within it; and a foot that flies over a third column may hit
it, because swings rise above the higher one of their own two footholds. The certificate finds both.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.plan.columns import Columns, stands_on_columns
from gaitopt.plan.plan import Plan

SUNK = 4e-4
"""Depth within a column that still counts as clear where a foot stands, lifts off or lands [m]: the
certificate takes 0.5 mm."""
LEAST_GAP = 3e-4
"""Distance from columns that a flying foot keeps elsewhere [m]. Chosen: over a rim a ball with a
radius of 15 mm comes nearer by 0.2 mm at most between two of the samples."""
SAMPLES = 49
"""Instants of each flight that are looked at: a foot moves by some 5 mm between two of them."""


class FootInColumn(NamedTuple):
    """A foot that is within a column beside its own.

    Attributes:
        step: in which it flies; -1 where it stands.
        leg: whose foot it is.
        number: of its foothold, from 0 on: on which it stands, or to which it flies.
        column: leg whose foothold the column is.
        place: x and y of the column's middle ``(2,)`` [m].
        depth: how deep it is [m].
    """

    step: int
    leg: str
    number: int
    column: str
    place: FloatArray
    depth: float

    def in_words(self) -> str:
        """What is in the way, and what helps."""
        x, y = np.round(self.place, 3).tolist()
        if self.step < 0:
            where, helps = f"foothold {self.number} of {self.leg}: the foot stands", ""
        else:
            where, helps = (
                f"step {self.step} ({self.leg}): the foot flies",
                "a larger swing_height, ",
            )
        return (
            f"{where} {1e3 * self.depth:.1f} mm within a column of {self.column}, at x = {x:g} m, "
            f"y = {y:g} m, and the certificate will call the plan violated; what helps: {helps}"
            "moving one of the two footholds, or thinner columns (radius)"
        )


def foot_in_column(plan: Plan) -> FootInColumn | None:
    """The foot that is deepest within a column beside its own; ``None`` without one.

    A foot that stands in one comes first, for it lands there, too.

    Args:
        plan: any. Without columns nothing is found.
    """
    found = feet_in_columns(plan)
    return max(found, key=lambda each: (each.step < 0, each.depth), default=None)


def feet_in_columns(plan: Plan) -> list[FootInColumn]:
    """The feet that are within columns beside their own: standing ones, and one for each flight.

    Args:
        plan: any. Without columns nothing is found.
    """
    if not stands_on_columns(plan) or not plan.robot.foot_radius > 0.0:
        return []
    columns = Columns.of(plan)
    # Feet are nowhere lower than columns that are level.
    if columns.spread <= SUNK:
        return []
    return [*_standing(plan, columns), *_flying(plan, columns)]


def _standing(plan: Plan, columns: Columns) -> list[FootInColumn]:
    """Feet that stand within a column."""
    out = []
    for leg in LEGS:
        gaps = columns.distances(plan.footholds[leg]) - plan.robot.foot_radius
        for number in np.flatnonzero(gaps.min(axis=1) < -SUNK).tolist():
            which = int(gaps[number].argmin())
            out.append(_found(columns, -1, leg, number, which, -float(gaps[number, which])))
    return out


def _flying(plan: Plan, columns: Columns) -> list[FootInColumn]:
    """Feet that fly through a column, each in its deepest place."""
    swings = plan.swings
    if not swings:
        return []
    shares = np.linspace(0.0, 1.0, SAMPLES)
    starts, ends = (np.array([getattr(s, x) for s in swings]) for x in ("start", "end"))
    times = starts[:, None] + shares * (ends - starts)[:, None]
    # Rounding may go beyond the end.
    times = np.minimum(times, plan.duration)
    feet = plan.at(times.ravel()).feet.reshape(len(swings), SAMPLES, len(LEGS), 3)
    legs = np.array([LEGS.index(s.leg) for s in swings])
    own = feet[np.arange(len(swings)), :, legs]
    gaps = columns.distances(own) - plan.robot.foot_radius
    ends_of = np.stack([[s.foot_start for s in swings], [s.foot_end for s in swings]], axis=1)
    away = np.linalg.norm(own[:, :, None] - ends_of[:, None], axis=3).min(axis=2)
    least = np.where(away <= plan.robot.foot_radius, -SUNK, LEAST_GAP)
    short = least[..., None] - gaps
    out = []
    for swing, missing, gap in zip(swings, short, gaps, strict=True):
        at, which = np.unravel_index(int(missing.argmax()), missing.shape)
        if missing[at, which] > 0.0:
            depth = -float(gap[at, which])
            number = swing.index + 1
            out.append(_found(columns, swing.step, swing.leg, number, int(which), depth))
    return out


def _found(
    columns: Columns, step: int, leg: str, number: int, which: int, depth: float
) -> FootInColumn:
    """What was found, in a column by its number."""
    place = frozen(columns.tops[which, :2])
    return FootInColumn(step, leg, number, columns.owners[which], place, depth)
