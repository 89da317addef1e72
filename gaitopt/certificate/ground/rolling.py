"""Check that the balls of standing feet do not roll farther than they may land off their footholds.

A plan keeps the middle of a foot in its place while it stands. The ball of a real foot rolls as its
leg turns: the middle moves by the radius times the angle. Half of the way is left at either side of
the foothold if the foot lands beside it by the other half.
"""

from __future__ import annotations

import numpy as np

from gaitopt.certificate.check import Check, judged
from gaitopt.certificate.placements import Placements
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan

NAME = "rolling of standing feet"


def rolling_feet(plan: Plan, motion: Motion) -> Check:
    """Half of the way that each ball rolls on a foothold, from one touch-down to the next lift-off.

    The rotations of the feet's links at the ends of all pieces are Pinocchio's. Between two of them
    a foot rolls farther than at both by less than on the longest piece.
    """
    model, places = plan.robot.model, motion.pieces.places()
    placed = Placements.of(model, places.values)
    worst, when, where = 0.0, 0.0, ""
    for k, leg in enumerate(LEGS):
        frame = model.frames[model.getFrameId(plan.robot.legs[leg].foot)]
        turns = placed.rotations[int(frame.parentJoint)][places.ends]
        angles = _rotation_vectors(turns[1] @ np.swapaxes(turns[0], -1, -2))
        for swing in (s for s in plan.swings if s.leg == leg):
            normals = plan.footholds.normals
            up = np.array([0.0, 0.0, 1.0]) if normals is None else normals[leg][swing.index + 1]
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


def _rotation_vectors(turns: FloatArray) -> FloatArray:
    """Rotation vectors ``(P, 3)`` [rad] of small rotations ``(P, 3, 3)``."""
    across = np.stack([turns[:, 2, 1] - turns[:, 1, 2], turns[:, 0, 2] - turns[:, 2, 0],
                       turns[:, 1, 0] - turns[:, 0, 1]], axis=1)  # fmt: skip
    sine = 0.5 * np.linalg.norm(across, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(turns, axis1=1, axis2=2) - 1.0))
    return np.asarray(0.5 * across * (angle / np.maximum(sine, 1e-15))[:, None])
