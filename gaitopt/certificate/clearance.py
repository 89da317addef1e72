"""Check of free swings: how high feet are wherever they are outside their columns."""

from __future__ import annotations

import numpy as np

from gaitopt.certificate.check import SHORT, Check, Verdict, judged
from gaitopt.certificate.closer import SETTLED, looked_at_closely
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.time_optimal import RouteSettings

NAME = "swing clearance"
ON_EDGE = 1e-9
"""How far inside a column a place counts as outside [m], as those on the edge may come out inside
by rounding (1e-13 m for places 100 m away). To count too many places as outside is safe."""


def swing_clearance(plan: Plan, motion: Motion) -> Check | None:
    """Feet on a free swing keep the clearance wherever they are outside both columns' radius.

    The clearance is a height above the higher of the two footholds. ``None`` for plans whose swing
    curve is not free: theirs is judged with the ground (:mod:`gaitopt.certificate.ground.checks`).
    """
    settings = plan.settings
    if not (isinstance(settings, RouteSettings) and has_free_swing(plan)):
        return None
    asked = settings.clearance
    heights = _heights(plan, motion)
    for leg in range(len(LEGS)):

        def look(part: Motion, owner: np.ndarray, leg: int = leg) -> tuple[FloatArray, BoolArray]:
            found, leaves = _heights(plan, part)[:, leg], part.feet_deviation[:, leg]
            return found, _is_short(found, leaves, asked)

        found, leaves = heights[:, leg], motion.feet_deviation[:, leg]
        short = np.flatnonzero(_is_short(found, leaves, asked))
        if len(short):
            better = looked_at_closely(plan, motion, short, look)
            heights[short, leg] = np.maximum(heights[short, leg], better)
    piece, leg = (int(i) for i in np.unravel_index(int(heights.argmin()), heights.shape))
    worst = float(heights[piece, leg])
    if not np.isfinite(worst):
        return Check(NAME, Verdict.OK, asked, asked - SHORT, "m", ">=",
                     note="no foot leaves its columns")  # fmt: skip
    return judged(NAME, worst, asked - SHORT, "m", ">=", bound=motion.feet_deviation[piece, leg],
                  when=motion.pieces.starts[piece], where=LEGS[leg])  # fmt: skip


def _is_short(heights: FloatArray, leaves: FloatArray, asked: float) -> BoolArray:
    """Whether a bound is short of what is asked, and a closer look could tell more ``(P,)``.

    Args:
        heights: lower bounds on heights ``(P,)`` [m].
        leaves: how far the foot leaves its chords ``(P,)`` [m].
        asked: the clearance [m].
    """
    short = (heights < asked - SHORT) & (heights + 2.0 * leaves >= asked - SHORT)
    return np.asarray(short & (leaves > SETTLED))


def _heights(plan: Plan, motion: Motion) -> FloatArray:
    """Lower bounds on feet's heights above the higher one of their footholds ``(P, 4)`` [m].

    Infinite for feet that stand or are within the footholds' radius.
    """
    heights = np.full((len(motion.phase), len(LEGS)), np.inf)
    # A flight that begins in the air: how high the foot is there is none of the planner's choice.
    swings = [swing for swing in plan.swings if swing.index >= 0]
    if not swings:
        return heights
    phases = np.array([swing.phases for swing in swings])
    first, end = np.searchsorted(motion.phase, [phases[:, 0], phases[:, 1] + 1])
    number = np.repeat(np.arange(len(swings)), end - first)
    piece = np.concatenate([np.arange(*flight) for flight in zip(first, end, strict=True)])
    leg = np.array([LEGS.index(swing.leg) for swing in swings])[number]
    ends = np.array([(swing.foot_start, swing.foot_end) for swing in swings])
    heights[piece, leg] = lowest_outside(
        motion.feet[:, piece, leg], motion.feet_deviation[piece, leg], ends[number][..., :2],
        plan.footholds.landing_radius,
    ) - ends[..., 2].max(axis=1)[number]  # fmt: skip
    return heights


def has_free_swing(plan: Plan) -> bool:
    """Whether feet fly on free curves, with a clearance that the plan promises."""
    return isinstance(plan.settings, RouteSettings) and plan.settings.free.swing


def lowest_outside(
    foot: FloatArray, deviation: FloatArray, centres: FloatArray, radius: float
) -> FloatArray:
    """Lower bound of a foot's height while it is outside all columns, on each piece ``(P,)`` [m].

    It is infinite on pieces on which the foot is nowhere outside.

    A foot that is outside a column is at least ``radius - deviation`` away from its axis on its
    chord. The part of a chord that is so far away from every axis ends where the chord ends, or
    where it crosses one of these smaller circles; and a chord is lowest at an end of a part.

    Args:
        foot: its places at the start and the end of every piece ``(2, P, 3)`` [m].
        deviation: how far it leaves its chords ``(P,)`` [m].
        centres: axes of the columns ``(c, 2)``, or of those of each piece ``(P, c, 2)`` [m].
        radius: of the columns [m].
    """
    # Arrays with the pieces last are faster: (3, P), (c, 2, P).
    start, chord = foot[0].T, (foot[1] - foot[0]).T
    axes = np.moveaxis(np.broadcast_to(centres, (len(deviation), *centres.shape[-2:])), 0, -1)
    edge = np.maximum(radius - deviation, 0.0)
    away = start[:2] - axes
    # |away + share * chord| = edge, a quadratic equation in the share of the chord.
    a = (chord[:2] ** 2).sum(axis=0)
    b = (away * chord[:2]).sum(axis=1)
    c = (away**2).sum(axis=1) - edge**2
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b**2 - a * c)
        crossings = np.concatenate([(-b - root) / a, (-b + root) / a])
    share = np.concatenate([np.zeros((1, len(edge))), np.ones((1, len(edge))), crossings])
    lowest = np.full(len(edge), np.inf)
    for part in share:
        on_chord = (part >= 0.0) & (part <= 1.0)
        x, y, z = start + chord * np.where(on_chord, part, 0.0)
        nearest = ((x - axes[:, 0]) ** 2 + (y - axes[:, 1]) ** 2).min(axis=0)
        outside = on_chord & (np.sqrt(nearest) >= edge - ON_EDGE)
        # What is no number stays no number.
        lowest = np.minimum(lowest, np.where(outside, z, np.inf))
    return np.asarray(lowest - deviation)
