"""Checks of feet that stand: whether they touch the ground, and the normals of footholds."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from gaitopt.certificate.check import Check, judged
from gaitopt.certificate.contacts import LANDING_HEIGHT
from gaitopt.certificate.ground.surface import REACH, Surface
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan

NORMAL = 0.05
"""Largest angle between a foothold's normal and the ground's [rad]. Chosen: a tenth of the half
angle of the friction cone of a coefficient of 0.6."""
SAME = 1e-5
"""Difference of distances below which a ball touches two places at once [m]. Chosen: on flat ground
it makes a ball of 20 mm touch within 0.6 mm, so that the normal is known to 0.03 rad."""
SMALL = 1e-3
"""Smallest radius of a ball that a normal is looked for with [m]. Chosen: far below a foot's."""


class Ground(Protocol):
    """What feet stand on."""

    def off(self, middles: FloatArray, radius: float) -> FloatArray:
        """How far balls are from touching it; infinite where it is unknown ``(N,)`` [m]."""


def feet_on_the_ground(plan: Plan, motion: Motion, ground: Ground) -> Check:
    """The balls of standing feet touch the ground, at touch-down and as long as they stand.

    A column beside the foot's own that reaches into the ball is ground as well. Ground that is
    unknown or off the map carries no foot.
    """
    radius = plan.robot.foot_radius
    worst, when, where = 0.0, np.nan, ""
    for k, leg in enumerate(LEGS):
        begins = _begins(motion.standing[:, k])
        owner = np.maximum.accumulate(np.where(begins, np.arange(len(begins)), 0))
        first = np.flatnonzero(begins)
        off = np.full(len(begins), np.nan)
        off[first] = ground.off(motion.feet[0, first, k], radius)
        moved = np.linalg.norm(motion.feet[:, :, k] - motion.feet[0, owner, k], axis=2).max(axis=0)
        standing = off[owner] + moved + motion.feet_deviation[:, k]
        standing = np.where(motion.standing[:, k], standing, 0.0)
        # A foot that lifts off as it touches down stands on no piece.
        ends = _ends_of_flights(plan, motion, leg)
        landing = ground.off(motion.feet[1, ends, k], radius)
        for found, pieces in ((standing, np.arange(len(begins))), (landing, ends)):
            if len(found) and not found.max() <= worst:
                piece = int(pieces[found.argmax()])
                worst, when, where = float(found.max()), float(motion.pieces.starts[piece]), leg
    if np.isinf(worst):
        where = f"{where} on ground that is unknown or off the map"
    return judged("feet on the ground", worst, LANDING_HEIGHT, "m", when=when, where=where)


def _begins(standing: np.ndarray) -> np.ndarray:
    """The pieces on which a foot begins to stand, or to fly."""
    return np.concatenate([[True], standing[1:] != standing[:-1]])


def _ends_of_flights(plan: Plan, motion: Motion, leg: str) -> np.ndarray:
    """The last piece of each flight of a leg."""
    last = [swing.phases[1] + 1 for swing in plan.swings if swing.leg == leg]
    ends = np.searchsorted(motion.phase, last) - 1
    return ends[ends >= 0]


def normals_of_footholds(plan: Plan, surface: Surface) -> Check:
    """The normals of the footholds are those of the ground where the balls of feet touch it.

    A ball in a hollow touches the ground at several places. Then every direction between their
    normals will do.
    """
    # A foot that is a point touches the ground as a small ball above it does.
    more = max(SMALL - plan.robot.foot_radius, 0.0)
    radius = plan.robot.foot_radius + more
    worst, where = 0.0, ""
    normals = plan.footholds.normal_array
    for k, leg in enumerate(LEGS):
        own = normals[k, : len(plan.footholds[leg])]
        middles = plan.footholds[leg] + more * own
        distances = surface.distances(middles, radius + REACH)
        known = (distances > 0.0) & (distances < radius + REACH)
        reaches = np.where(known, distances + SAME, 0.0)
        for n, touched in enumerate(surface.contacts(middles, reaches)):
            angle = _angle(touched, own[n]) if known[n] else np.inf
            if not angle <= worst:
                worst, where = angle, f"{leg}, foothold {n}"
    return judged("normals of footholds", worst, NORMAL, "rad", where=where)


def normals_on_columns(plan: Plan) -> Check | None:
    """The tops of columns are level, and so normals of footholds on them are vertical.

    ``None`` where they are, or where the footholds have none, which then count as vertical.
    """
    if plan.footholds.normals is None:
        return None
    worst, where = 0.0, ""
    for leg, normals in plan.footholds.normals.items():
        for index, normal in enumerate(normals):
            angle = float(np.arctan2(np.hypot(normal[0], normal[1]), normal[2]))
            # What is no number is no normal.
            if not angle <= worst:
                worst, where = angle, f"{leg}, foothold {index}"
    if worst == 0.0:
        return None
    return judged("normals of footholds", worst, NORMAL, "rad", where=where)


def _angle(touched: FloatArray, normal: FloatArray) -> float:
    """Angle between a normal and those of the ground at a ball [rad].

    Args:
        touched: from the ball's middle to where it touches the ground ``(k, 3)`` [m].
        normal: as a foothold has it ``(3,)``.
    """
    from scipy.optimize import nnls  # late: it is only for walks over maps

    lengths = np.linalg.norm(touched, axis=1)
    _, rest = nnls(-(touched / lengths[:, None]).T, normal)
    return float(np.arcsin(min(float(rest), 1.0)))
