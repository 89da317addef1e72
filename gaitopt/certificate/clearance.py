"""Check of free swings: how high feet are where they are away from their columns."""

from __future__ import annotations

import numpy as np

from gaitopt.certificate.check import SHORT, Check, judged
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan

CLOSE = 1e-4
"""How far outside the column's radius a foot counts as inside [m]."""
OPEN_COLUMN = 0.02
"""Radius that counts as a column's on open ground [m]."""


def swing_clearance(plan: Plan, motion: Motion) -> Check | None:
    """Feet on a free swing keep the clearance wherever they are outside both columns' radius.

    Over the higher of the two footholds; for plans whose swing curve is free. Between samples a
    foot is near its chord: a piece counts as outside unless both its ends are inside one column by
    the bound, as discs are convex; and its height is that of its lower end, less the bound.
    """
    settings = plan.settings
    asked = getattr(settings, "clearance", None)
    if asked is None or "swing" not in getattr(settings, "free", ()):
        return None
    name, radius = "swing clearance", (plan.footholds.radius or OPEN_COLUMN) + CLOSE
    high = np.full((len(motion.phase), len(LEGS)), np.inf)
    for swing in plan.swings:
        first, last = np.searchsorted(motion.phase, [swing.phases[0], swing.phases[1] + 1])
        leg, flight = LEGS.index(swing.leg), slice(int(first), int(last))
        ends = np.stack([swing.foot_start, swing.foot_end])
        high[flight, leg] = _over(motion.feet[:, flight, leg], motion.feet_bulge[flight, leg],
                                  ends, radius)  # fmt: skip
    piece, leg = (int(i) for i in np.unravel_index(int(high.argmin()), high.shape))
    worst = float(high[piece, leg])
    if not np.isfinite(worst):
        return Check(name, "ok", asked, asked - SHORT, "m", ">=", note="no foot leaves its columns")
    return judged(name, worst, asked - SHORT, "m", ">=", bound=motion.feet_bulge[piece, leg],
                  when=motion.pieces.starts[piece], where=LEGS[leg])  # fmt: skip


def _over(foot: FloatArray, bulge: FloatArray, ends: FloatArray, radius: float) -> FloatArray:
    """Least height over the higher foothold on each piece outside both columns ``(P,)`` [m].

    Args:
        foot: its places at both ends of the pieces ``(2, P, 3)`` [m].
        bulge: how far it leaves its chords ``(P,)`` [m].
        ends: the two footholds ``(2, 3)`` [m].
        radius: of the columns [m].
    """
    away = np.linalg.norm(foot[:, :, None, :2] - ends[:, :2], axis=3)
    # The ends of a chord that is inside one disc are both inside it.
    outside = away.max(axis=0).min(axis=1) + bulge > radius
    low = foot[..., 2].min(axis=0) - bulge - ends[:, 2].max()
    return np.asarray(np.where(outside, low, np.inf))
