"""Checks of feet and contacts: sequence, slip, footholds, swings, and that nothing jumps."""

from __future__ import annotations

import numpy as np

from gaitopt.certificate.check import JUMP, SHORT, Check, Verdict, column_name, judged, worst_place
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.swings import Swing

SLIP = 1e-4
"""Most that a standing foot may move [m]. Chosen: planners hold feet to a tenth of it or better
between knots, and a foot's rubber gives more."""
LANDING_HEIGHT = 1e-3
"""Most that a standing foot may be above or below its foothold [m]. Chosen: a millimetre is what
the ground under a real robot is known to, at best."""
SINKING = 5e-4
"""Most that a flying foot may sink below the lower end of its swing [m]. Chosen: half of what a
standing foot may."""
ROUNDING = 1e-9
"""Difference of times that counts as rounding [s]: times of long walks are known to 1e-12 s."""


def continuity(plan: Plan) -> Check:
    """Body and joints do not jump at knots."""
    path = plan.path
    jumps = path.jumps()
    if not len(jumps):
        return Check("continuity", Verdict.OK, 0.0, JUMP, "m or rad")
    segment, column = worst_place(jumps)
    return judged("continuity", float(jumps[segment, column]), JUMP, "m or rad",
                   when=path.times[segment + 1], where=column_name(plan, column))  # fmt: skip


def contact_sequence(plan: Plan) -> Check:
    """Phases follow one another, the legs step in order onto every foothold, enough feet stand."""
    wrong = _sequence_faults(plan)
    return judged("contact sequence", float(len(wrong)), 0.0, "faults",
                  where=wrong[0] if wrong else "")  # fmt: skip


def _sequence_faults(plan: Plan) -> list[str]:
    """What is wrong with the phases, one text for each fault."""
    faults = []
    expected = 0.0
    knots = plan.path.times
    for i, phase in enumerate(plan.phases):
        if abs(phase.start - expected) > ROUNDING:
            faults.append(f"phase {i} starts at {phase.start:.6f} s, not at {expected:.6f} s")
        expected = phase.start + phase.duration
        if np.abs(knots - expected).min() > ROUNDING:
            faults.append(f"phase {i} ends at {expected:.6f} s, where the path has no knot")
        in_entry = i < plan.entry
        faults += _support_faults(i, phase, 0 if in_entry else plan.settings.least_support)
    if abs(expected - plan.path.duration) > ROUNDING:
        faults.append(f"phases end at {expected:.6f} s, the path at {plan.path.duration:.6f} s")
    if plan.entry and plan.phases[plan.entry - 1].flying:
        faults.append("the entry ends before all four feet stand")
    # No static margin is promised in an entry: it must not hold what is none.
    faults += [f"step {s.step} ({s.leg}) is part of the entry" for s in plan.swings
               if s.index >= 0 and s.phases[0] < plan.entry]  # fmt: skip
    return faults + _order_faults(plan)


def _order_faults(plan: Plan) -> list[str]:
    """Swings that are missing, too many, or in another order than was asked for."""
    flown = [swing.leg for swing in plan.swings if swing.index >= 0]
    try:
        asked = plan.settings.swing_legs(plan.footholds.counts)
    except InputError as error:
        return [str(error)]
    if asked is not None and flown != asked:
        first = next((i for i, (a, b) in enumerate(zip(flown, asked, strict=False)) if a != b),
                     min(len(flown), len(asked)))  # fmt: skip
        return [f"{len(flown)} swings where {len(asked)} are asked for; step {first} differs"]
    made = {leg: flown.count(leg) for leg in LEGS}
    return [
        f"{leg} swings {count} times over {plan.footholds.counts[leg]} footholds"
        for leg, count in made.items()
        if count != plan.footholds.counts[leg] - 1
    ]


def _support_faults(i: int, phase: Phase, least: int) -> list[str]:
    """What is wrong with the feet that stand in phase ``i``."""
    standing = set(phase.support)
    if len(standing) < least or not standing <= set(LEGS):
        return [f"phase {i} stands on {len(standing)} feet"]
    if phase.kind == "swing" and phase.leg in standing:
        return [f"phase {i}: {phase.leg} stands while it swings"]
    if phase.kind == "stance" and len(standing) < 4:
        return [f"phase {i} stands on {len(standing)} feet without a swing"]
    return []


def slip(plan: Plan, motion: Motion) -> Check:
    """Standing feet do not move from where they touched down."""
    home = _expected(plan, motion)
    gaps = np.linalg.norm(motion.feet - _touchdown(motion, home), axis=3).max(axis=0)
    gaps = np.where(motion.standing, gaps + motion.feet_deviation, 0.0)
    piece, leg = worst_place(gaps)
    return judged("slip of standing feet", float(gaps[piece, leg]), SLIP, "m",
                   bound=motion.feet_deviation[piece, leg], when=motion.pieces.starts[piece],
                   where=LEGS[leg])  # fmt: skip


def landings(plan: Plan, motion: Motion) -> Check:
    """Standing feet stand on their footholds: within the landing radius, and at their height.

    So do feet that lift off as they touch down, and so stand for no time.
    """
    home = _expected(plan, motion)
    away = motion.feet - home
    radius = plan.footholds.landing_radius
    flat = np.hypot(away[..., 0], away[..., 1]) / radius
    high = np.abs(away[..., 2]) / LANDING_HEIGHT
    use = np.maximum(flat, high).max(axis=0)
    least = min(radius, LANDING_HEIGHT)
    use = np.where(motion.standing, use + motion.feet_deviation / least, 0.0)
    end = np.linalg.norm(motion.feet[1, -1] - plan.footholds.array[:, -1], axis=1) / radius
    for swing in plan.swings:
        leg, landed = LEGS.index(swing.leg), np.searchsorted(motion.phase, swing.phases[1] + 1) - 1
        away = np.abs(motion.feet[1, landed, leg] - swing.foot_end)
        on = max(float(np.hypot(*away[:2])) / radius, float(away[2]) / LANDING_HEIGHT)
        use[landed, leg] = max(use[landed, leg], on)
    piece, leg = worst_place(use)
    worst, where = float(use[piece, leg]), LEGS[leg]
    if end.max() > max(worst, 1.0):
        worst, where, piece = float(end.max()), f"{LEGS[int(end.argmax())]} at the end", -1
    return judged("feet on their footholds", worst, 1.0, "of landing radius or 1 mm",
                   when=motion.pieces.starts[piece], where=where)  # fmt: skip


def swing_height(plan: Plan, motion: Motion) -> Check:
    """Every swing rises the swing height above the higher of its two ends.

    Not so a flight with which the plan begins: its first end is in the air.
    """
    shortfalls = [
        (_apex(motion, swing) - max(swing.foot_start[2], swing.foot_end[2])
         - _asked_height(plan, swing), swing)
        for swing in plan.swings
        if swing.index >= 0
    ]  # fmt: skip
    if not shortfalls:
        return Check("swing height", Verdict.OK, 0.0, -SHORT, "m", ">=")
    least, swing = min(shortfalls, key=lambda pair: pair[0])
    return judged("swing height", float(least), -SHORT, "m above what is asked", ">=",
                   when=swing.start, where=f"step {swing.step} ({swing.leg})")  # fmt: skip


def _asked_height(plan: Plan, swing: Swing) -> float:
    """How far the foot was to rise above the higher end of a swing [m]."""
    heights = plan.footholds.swing_heights
    if heights is None or swing.index >= len(heights[swing.leg]):
        return plan.settings.swing_height
    return float(heights[swing.leg][swing.index])


def _apex(motion: Motion, swing: Swing) -> float:
    """Highest place seen of the flying foot: a lower bound of its apex [m]."""
    first, last = np.searchsorted(motion.phase, [swing.phases[0], swing.phases[1] + 1])
    heights = motion.feet[:, first:last, LEGS.index(swing.leg), 2]
    return float(heights.max(initial=-np.inf))


def ground(plan: Plan, motion: Motion) -> Check | None:
    """Flying feet do not sink below the lower end of their swing.

    ``None`` for plans with a height map, which says where the ground is
    (:mod:`gaitopt.certificate.ground.checks`).
    """
    if plan.footholds.ground is not None:
        return None
    lows = np.full((max(len(plan.phases), 1), len(LEGS)), -np.inf)
    for swing in plan.swings:
        flight = slice(swing.phases[0], swing.phases[1] + 1)
        lows[flight, LEGS.index(swing.leg)] = min(swing.foot_start[2], swing.foot_end[2])
    depth = lows[motion.phase] - (motion.feet[..., 2].min(axis=0) - motion.feet_deviation)
    depth = np.where(motion.standing, -np.inf, depth)
    piece, leg = worst_place(depth)
    worst = max(float(depth[piece, leg]), 0.0)
    return judged("flying feet above ground", worst, SINKING, "m below",
                   bound=motion.feet_deviation[piece, leg] if worst else 0.0,
                   when=motion.pieces.starts[piece], where=LEGS[leg])  # fmt: skip


def _expected(plan: Plan, motion: Motion) -> FloatArray:
    """Where each foot should stand during each piece ``(P, 4, 3)`` [m]."""
    counts = np.zeros((max(len(plan.phases), 1), 4), dtype=int)
    for swing in plan.swings:
        landed = min(swing.index + 1, plan.footholds.counts[swing.leg] - 1)
        counts[swing.phases[1] + 1 :, LEGS.index(swing.leg)] = landed
    return np.asarray(plan.footholds.array[np.arange(4), counts[motion.phase]])


def _touchdown(motion: Motion, home: FloatArray) -> FloatArray:
    """Where each foot was when it began to stand on its present foothold ``(P, 4, 3)``."""
    out = np.empty_like(home)
    for leg in range(4):
        changed = (home[1:, leg] != home[:-1, leg]).any(axis=1)
        lifted = motion.standing[1:, leg] & ~motion.standing[:-1, leg]
        begins = np.concatenate([[True], changed | lifted])
        first = np.maximum.accumulate(np.where(begins, np.arange(len(begins)), 0))
        out[:, leg] = motion.feet[0, first, leg]
    return out
