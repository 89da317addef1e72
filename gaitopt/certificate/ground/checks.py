"""All checks of the ground, for plans that know it: a height map, or columns."""

from __future__ import annotations

import numpy as np

from gaitopt.certificate.check import Check, Verdict, judged
from gaitopt.certificate.clearance import NAME as CLEARANCE
from gaitopt.certificate.clearance import ON_EDGE, has_free_swing
from gaitopt.certificate.contacts import SINKING
from gaitopt.certificate.enclosure import Pieces
from gaitopt.certificate.ground.feet import (
    feet_on_the_ground,
    normals_of_footholds,
    normals_on_columns,
)
from gaitopt.certificate.ground.flights import Flights, Ground, looked_at_again
from gaitopt.certificate.ground.limbs import legs_and_trunk_clear
from gaitopt.certificate.ground.pillars import Pillars
from gaitopt.certificate.ground.rolling import rolling_feet
from gaitopt.certificate.ground.solids import Solids, farthest
from gaitopt.certificate.ground.surface import Surface
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import LEGS, BoolArray
from gaitopt.plan.plan import Plan
from gaitopt.terrain.height_map import HeightMap


def ground_checks(plan: Plan, motion: Motion) -> list[Check | None]:
    """The checks of feet, legs and trunk with the ground; none on open ground without a map."""
    footholds = plan.footholds
    if footholds.ground is None and footholds.radius is None:
        return []
    solids = Solids.of(plan.robot)
    if footholds.ground is not None:
        surface = _surface(plan, footholds.ground, solids)
        return [
            *_on(plan, motion, surface, solids),
            normals_of_footholds(plan, surface),
            rolling_feet(plan, motion),
        ]
    pillars = Pillars.of(footholds, plan.robot.foot_radius)
    return [
        *_on(plan, motion, pillars, solids),
        normals_on_columns(plan),
        rolling_feet(plan, motion),
    ]


def _on(
    plan: Plan, motion: Motion, ground: Surface | Pillars, solids: Solids
) -> list[Check | None]:
    """The checks that feet are on the ground, and that feet, legs and trunk are clear of it."""
    flights = Flights.of(plan, motion, ground)
    return [
        feet_on_the_ground(plan, motion, ground),
        flying_feet_clear(flights, motion),
        swing_room(plan, flights, motion, ground),
        legs_and_trunk_clear(plan, ground, solids),
    ]


def flying_feet_clear(flights: Flights, motion: Motion) -> Check:
    """Flying feet are above the ground; at both ends of their swings they may sink a little."""
    # Away from the ends nothing may sink: there the gap counts as that much less.
    counted = np.where(flights.near, flights.gaps, flights.gaps - SINKING)
    piece, leg = (int(i) for i in np.unravel_index(int(counted.argmin()), counted.shape))
    worst, where = float(counted[piece, leg]), LEGS[leg]
    if worst == np.inf:
        return judged("flying feet clear of the ground", 0.0, -SINKING, "m", ">=")
    if worst == -np.inf:
        where = f"{where} above ground that is unknown or off the map"
    elif not flights.near[piece, leg]:
        where = f"{where} away from both ends of its swing, less {SINKING:g} m"
    return judged("flying feet clear of the ground", worst, -SINKING, "m", ">=",
                  when=motion.pieces.starts[piece], where=where)  # fmt: skip


def swing_room(plan: Plan, flights: Flights, motion: Motion, ground: Ground) -> Check | None:
    """How high feet are above the ground wherever they are outside the radius of both footholds.

    ``None`` for swings on a free curve, whose clearance is a promise of its own
    (:mod:`gaitopt.certificate.clearance`).
    """
    if has_free_swing(plan):
        return None
    heights = np.where(motion.standing | ~_outside(plan, motion), np.inf, flights.gaps)
    heights = looked_at_again(plan, motion, heights, np.zeros(heights.shape), ground, _outside)
    piece, leg = (int(i) for i in np.unravel_index(int(heights.argmin()), heights.shape))
    worst = float(heights[piece, leg])
    if worst == np.inf:
        return Check(CLEARANCE, Verdict.OK, 0.0, 0.0, "m", ">=",
                     note="no foot leaves its footholds")  # fmt: skip
    return judged(CLEARANCE, worst, 0.0, "m above the ground", ">=",
                  when=motion.pieces.starts[piece], where=LEGS[leg])  # fmt: skip


def _outside(plan: Plan, motion: Motion) -> BoolArray:
    """Whether a flying foot may be outside the radius of both its footholds ``(P, 4)``."""
    out = np.zeros(motion.standing.shape, dtype=np.bool_)
    for swing in plan.swings:
        leg, (first, last) = LEGS.index(swing.leg), swing.phases
        flight = slice(*np.searchsorted(motion.phase, [first, last + 1]).tolist())
        ends = np.stack([swing.foot_start, swing.foot_end])[:, :2]
        away = np.linalg.norm(motion.feet[:, flight, leg, None, :2] - ends, axis=-1).min(axis=-1)
        least = plan.footholds.landing_radius - motion.feet_deviation[flight, leg]
        out[flight, leg] = (away >= least - ON_EDGE).any(axis=0)
    return out


def _surface(plan: Plan, ground: HeightMap, solids: Solids) -> Surface:
    """The part of the map that the robot can be above."""
    pieces = Pieces.of(plan.path)
    low, high = (each[:, :2] for each in pieces.enclosure(0))
    # A base that stays within these corners is nowhere farther from their middle than this.
    wide = float(np.linalg.norm(high - low, axis=1).max()) / 2.0
    return Surface.around(ground, (low + high) / 2.0, farthest(plan.robot.model, solids) + wide)
