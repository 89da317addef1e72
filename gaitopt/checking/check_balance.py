"""Checks of balance: static margins of the body's centre and of the true centre of mass."""

from __future__ import annotations

from math import nan

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from gaitopt.checking.certificate import Check
from gaitopt.checking.judging import SHORT, judged, phase_name
from gaitopt.checking.motion import Motion
from gaitopt.conventions import FloatArray
from gaitopt.planning.plan import Plan

DYNAMIC = "a dynamic gait promises no static margin: see its ZMP"


def margin_of_cog(plan: Plan, motion: Motion) -> Check:
    """While a foot flies, the body centre keeps the stability margin that was asked for."""
    if not plan.settings.static:
        return Check("margin of the body centre", "unchecked", nan, nan, "m", note=DYNAMIC)
    margins = _margins(motion, motion.cog, motion.cog_bulge)
    flying = np.asarray(~motion.standing.all(axis=1))
    short = np.where(flying, margins - plan.settings.stability_margin, margins)
    piece = int(short.argmin())
    asked = plan.settings.stability_margin if flying[piece] else 0.0
    return judged("margin of the body centre", float(margins[piece]), asked - SHORT, "m", ">=",
                   bound=motion.cog_bulge[piece], when=motion.pieces.starts[piece],
                   where=phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def margin_of_com(plan: Plan, motion: Motion) -> Check:
    """The model's true centre of mass never leaves the support polygon."""
    if not plan.settings.static:
        return Check("margin of the true COM", "unchecked", nan, nan, "m", note=DYNAMIC)
    margins = _margins(motion, motion.com, motion.com_bulge)
    piece = int(margins.argmin())
    return judged("margin of the true COM", float(margins[piece]), 0.0, "m", ">=",
                   bound=motion.com_bulge[piece], when=motion.pieces.starts[piece],
                   where=phase_name(plan, int(motion.phase[piece])))  # fmt: skip


def _margins(motion: Motion, points: FloatArray, bulges: FloatArray) -> FloatArray:
    """Lower bound of the margin on every piece: hulls of the feet where the piece starts."""
    out = np.full(len(bulges), np.inf)
    for index in np.unique(motion.phase):
        mine = np.flatnonzero(motion.phase == index)
        standing = np.flatnonzero(motion.standing[mine[0]])
        feet = motion.feet[0, mine[0], standing, :2]
        moved = np.linalg.norm(
            (motion.feet[:, mine][:, :, standing, :2] - feet).reshape(-1, len(standing), 2), axis=2
        )
        try:
            sides = ConvexHull(feet).equations
        except (QhullError, ValueError):
            out[mine] = -np.inf
            continue
        # Qhull's distances are positive outside; the worse end of each piece counts.
        outside = (points[:, mine, :2] @ sides[:, :2].T + sides[:, 2]).max(axis=(0, 2))
        shift = moved.max() + motion.feet_bulge[mine][:, standing].max(axis=1)
        out[mine] = -outside - bulges[mine] - shift
    return out
