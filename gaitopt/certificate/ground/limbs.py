"""Check that legs and trunk are clear of the ground at every instant."""

from __future__ import annotations

import numpy as np

from gaitopt.certificate.check import Check, Verdict, judged, unchecked
from gaitopt.certificate.collisions.self_collision import words_of_hulls
from gaitopt.certificate.enclosure import Pieces, chain_to
from gaitopt.certificate.ground.limb_gaps import CLEAR, Ground, LimbGaps
from gaitopt.certificate.ground.solids import Solids
from gaitopt.certificate.trace import deviations
from gaitopt.conventions import FloatArray
from gaitopt.plan.plan import Plan

NAME = "legs and trunk clear of the ground"
DEVIATION = 2e-4
"""Aim for how far points of the legs leave their chords at most [m]. Chosen: far below the gap of a
shank beside a foot that stands, some 5 mm."""
MOST_CUTS = 16
"""Most parts that a piece of the path is cut into for this."""


def legs_and_trunk_clear(plan: Plan, ground: Ground, solids: Solids) -> Check:
    """No part of the robot but its feet comes into the ground.

    Every shape of :class:`Solids` counts. Parts on which a robot lies where a plan enters from a
    state may touch the ground until it has entered, and are then clear of it. Ground that is
    unknown or off the map, under the box around a part, is a violation.
    """
    if not plan.robot.foot_radius > 0.0:
        words = "feet are points, so nobody knows where legs end; load the robot with foot_radius="
        return unchecked(NAME, "m", words, CLEAR)
    motion = LimbGaps(plan, ground, *_cut(plan, solids))
    for solid in solids.parts:
        motion.follow(solid)
    found = motion.found
    notes = [words_of_hulls(plan.robot)] * solids.hulls
    if solids.stand_ins:
        notes.append(f"lines stand for {', '.join(solids.stand_ins)}")
    feet = [plan.robot.model.frames[plan.robot.model.getFrameId(leg.foot)].parentJoint
            for leg in plan.robot.legs.values()]  # fmt: skip
    ends = {solid.name for solid in solids.parts if solid.joint in feet}
    if found.gap < CLEAR and found.where in ends:
        notes.append("if it is the end of the leg, the foot is larger than its ball: foot_radius=")
    if motion.resting:
        lies = ", ".join(dict.fromkeys(motion.resting))
        notes.append(f"on the ground at the begin, and never deeper: {lies}")
    where = "; ".join([found.where, *notes])
    check = judged(NAME, found.gap, CLEAR, "m", ">=", when=found.when, where=where)
    if check.status is Verdict.OK and found.unproven:
        words = f"{found.where} is so near that {CLEAR:g} m could not be shown between samples"
        return unchecked(NAME, "m", words, CLEAR)
    return check


def _cut(plan: Plan, solids: Solids) -> tuple[Pieces, dict[int, FloatArray]]:
    """The path in pieces, and how far the parts on each joint leave their chords on them [m]."""
    pieces = Pieces.of(plan.path)
    far: dict[int, float] = {}
    for solid in solids.parts:
        reach = float(np.linalg.norm(solid.corners, axis=1).max())
        far[solid.joint] = max(far.get(solid.joint, 0.0), reach)
    chains = [chain_to(plan.robot.model, joint, np.zeros(3), x) for joint, x in far.items()]
    most = deviations(chains, pieces).max(axis=1)
    pieces = pieces.cut(np.clip(np.ceil(np.sqrt(most / DEVIATION)), 1, MOST_CUTS).astype(int))
    return pieces, dict(zip(far, deviations(chains, pieces).T, strict=True))
