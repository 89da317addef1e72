"""What holds of contact forces all through a phase: the ground, and when feet land and lift off."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan


class PhaseGround(NamedTuple):
    """The ground under four feet in each phase; what is said of feet that fly means nothing.

    Attributes:
        normals: unit normals ``(P, 4, 3)``.
        friction: coefficients of friction ``(P, 4)``.
    """

    normals: FloatArray
    friction: FloatArray


def ground_in_phases(plan: Plan, friction: float) -> PhaseGround:
    """The ground under the feet in all phases of a plan; a plan without phases has one.

    Planners have a function for this as well (:mod:`gaitopt.plan.contact_ground`). This one counts
    the swings that have ended, so that an error in one of them is seen by the other.

    Args:
        plan: the plan.
        friction: of the limits. A foothold has no more than this, and it may have less.
    """
    phases, footholds = max(len(plan.phases), 1), plan.footholds
    landed = np.zeros((phases, len(LEGS)), dtype=int)
    for swing in plan.swings:
        if swing.index < 0:
            # The plan begins with this foot in the air: it lands on its first foothold.
            continue
        landed[swing.phases[1] + 1 :, LEGS.index(swing.leg)] += 1
    normals = np.zeros((phases, len(LEGS), 3))
    normals[..., 2] = 1.0
    least = np.full((phases, len(LEGS)), friction)
    for i, leg in enumerate(LEGS):
        on = np.minimum(landed[:, i], footholds.counts[leg] - 1)
        if footholds.normals is not None:
            normals[:, i] = footholds.normals[leg][on]
        if footholds.friction is not None:
            least[:, i] = np.minimum(footholds.friction[leg][on], friction)
    return PhaseGround(normals, least)


def times_of_stances(plan: Plan) -> FloatArray:
    """When each foot that stands in a phase has landed, and when it lifts off ``(P, 4, 2)`` [s].

    Infinite for a foot that stands from the begin, or to the end; NaN for feet in the air. Planners
    have a function for this as well (:mod:`gaitopt.plan.load_transfer`). This one goes through the
    phases, so that an error in one of them is seen by the other.
    """
    found = np.full((max(len(plan.phases), 1), len(LEGS), 2), np.nan)
    for i, leg in enumerate(LEGS):
        begin, landed, stood = 0, -np.inf, True
        for number, phase in enumerate(plan.phases):
            stands = leg in phase.support
            if stood and not stands:
                found[begin:number, i] = landed, phase.start
            elif stands and not stood:
                begin, landed = number, phase.start
            stood = stands
        if stood:
            found[begin:, i] = landed, np.inf
    return found
