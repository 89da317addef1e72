"""Check that the balls of standing feet do not roll farther than they may land off their footholds.

A plan keeps the middle of a foot in its place while it stands. The ball of a real foot rolls as its
leg turns: the middle moves by the radius times the angle. Half of the way is left at either side of
the foothold if the foot lands beside it by the other half.
"""

from __future__ import annotations

import numpy as np

from gaitopt.certificate.check import Check, judged
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan

NAME = "rolling of standing feet"


def rolling_feet(plan: Plan, motion: Motion) -> Check:
    """Half of the way that each ball rolls on a foothold, from one touch-down to the next lift-off.

    The rotations of the feet's links at the ends of all pieces are Pinocchio's. Between two of them
    a foot rolls farther than at both by less than on the longest piece.
    """
    (start, end), worst, when, where = motion.places.ends, 0.0, 0.0, ""
    for k, leg in enumerate(LEGS):
        turns = motion.foot_turns[k]
        angles = _rotation_vectors(turns[start], turns[end])
        normals = None if plan.footholds.normals is None else plan.footholds.normals[leg]
        for swing in (s for s in plan.swings if s.leg == leg):
            up = np.array([0.0, 0.0, 1.0])
            if normals is not None:
                # A swing to a foothold that there is not is the contact sequence's fault.
                up = normals[min(max(swing.index + 1, 0), len(normals) - 1)]
            first = int(np.searchsorted(motion.phase, swing.phases[1] + 1))
            flying = np.flatnonzero(~motion.standing[first:, k])
            last = first + int(flying[0]) if len(flying) else len(angles)
            # A ball that turns by w moves its middle, at r n above its contact, by w x r n.
            steps = plan.robot.foot_radius * np.cross(angles[first:last], up)
            if not len(steps):
                continue
            way = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
            most = 0.5 * float(np.linalg.norm(np.ptp(way, axis=0)))
            most += float(np.linalg.norm(steps, axis=1).max())
            if not most <= worst:
                worst, when = most, float(motion.pieces.starts[first])
                where = f"{leg} after step {swing.step}"
    return judged(NAME, worst, plan.footholds.landing_radius, "m", when=when, where=where)


def _rotation_vectors(before: FloatArray, after: FloatArray) -> FloatArray:
    """Rotation vectors ``(P, 3)`` [rad] of the small rotations from some to others ``(P, 3, 3)``.

    Those by ``after before^T``. Rows of it are dot products of rows.
    """
    a, b = np.moveaxis(after, 0, -1), np.moveaxis(before, 0, -1)

    def entry(i: int, j: int) -> FloatArray:
        return np.asarray(a[i, 0] * b[j, 0] + a[i, 1] * b[j, 1] + a[i, 2] * b[j, 2])

    axis = np.stack([entry(2, 1) - entry(1, 2), entry(0, 2) - entry(2, 0),
                     entry(1, 0) - entry(0, 1)], axis=1)  # fmt: skip
    sine = 0.5 * np.linalg.norm(axis, axis=1)
    angle = np.arctan2(sine, 0.5 * (entry(0, 0) + entry(1, 1) + entry(2, 2) - 1.0))
    return np.asarray(0.5 * axis * (angle / np.maximum(sine, 1e-15))[:, None])
