"""Checks of the feet: slip, footholds, height of swings."""

from __future__ import annotations

import numpy as np

from benchmarks.judge.motion import Finding, Motion, at_least, at_most
from gaitopt import LEGS
from gaitopt.conventions import FloatArray
from gaitopt.plan.settings.time_optimal import RouteSettings

SLIP, LANDED_HEIGHT = 1e-4, 1e-3
"""Limits of ``docs/trust.md`` [m]."""
BELOW = 5e-4
"""How far below the lower end of its swing a foot may be [m]."""
ROUNDING = 1e-6
"""What heights of swings may be less [m]."""


def standing_feet(motion: Motion) -> list[Finding]:
    """Slip, and places on the footholds."""
    slip, far, high, where = [], [], [], []
    for i, leg in enumerate(LEGS):
        points = motion.plan.footholds[leg]
        for start, end, index in motion.stances(leg):
            feet = _span(motion, i, start, end)
            slip.append(np.linalg.norm(feet - feet[0], axis=1).max())
            gap = feet - points[min(index, len(points) - 1)]
            far.append(np.hypot(gap[:, 0], gap[:, 1]).max())
            high.append(np.abs(gap[:, 2]).max())
            where.append(f"{leg} on foothold {index}, {start:.3f} to {end:.3f} s")
    radius = motion.plan.footholds.landing_radius
    return [
        at_most("slip of standing feet", slip, SLIP, where),
        at_most("feet on their footholds", far, radius, where),
        at_most("feet on their footholds", high, LANDED_HEIGHT, where),
    ]


def _span(motion: Motion, i: int, start: float, end: float) -> FloatArray:
    """Places of a foot in a closed span, both ends among them."""
    ends = motion.places(motion.plan.path.evaluate([start, end]))[0][:, i]
    inside = motion.feet[motion.during(start, end), i]
    return np.concatenate([ends[:1], inside, ends[1:]])


def flying_feet(motion: Motion) -> list[Finding]:
    """Height of every swing, least height in it, and the clearance of a free swing curve."""
    plan, settings = motion.plan, motion.plan.settings
    free = isinstance(settings, RouteSettings) and settings.free.swing
    rises, asked, depths, clear, where = [], [], [], [], []
    for swing in plan.swings:
        i = LEGS.index(swing.leg)
        feet = _span(motion, i, swing.start, swing.end)
        of_leg = plan.footholds.swing_heights
        if swing.index >= 0 and swing.phases[0] >= plan.entry:
            top = max(swing.foot_start[2], swing.foot_end[2])
            rises.append(_apex(motion, i, swing.start, swing.end) - top)
            own = () if of_leg is None else of_leg[swing.leg]
            known = swing.index < len(own)  # or the sequence is at fault
            asked.append(own[swing.index] if known else settings.swing_height)
            if free:
                clear.append(_clearance(motion, feet, swing.foot_start, swing.foot_end))
        depths.append(min(swing.foot_start[2], swing.foot_end[2]) - feet[:, 2].min())
        where.append(f"step {swing.step} ({swing.leg}), {swing.start:.3f} to {swing.end:.3f} s")
    lack = np.array(asked) - np.array(rises)
    out = [at_most("swing height", lack, ROUNDING, where[-len(lack) :])]
    if free:
        limit = settings.clearance - ROUNDING
        out.append(at_least("swing clearance", clear, limit, where[-len(clear) :]))
    if plan.footholds.ground is None:
        out.append(at_most("flying feet above ground", depths, BELOW, where))
    return out


def _apex(motion: Motion, i: int, start: float, end: float) -> float:
    """Highest place of a foot in a flight, looked for more closely around the highest sample."""
    inside = np.flatnonzero(motion.during(start, end))
    if not len(inside):
        return -np.inf
    best = inside[int(np.argmax(motion.feet[inside, i, 2]))]
    near = motion.times[best] + np.linspace(-1.0, 1.0, 41) * 2e-3
    near = near[(near >= start) & (near <= end)]
    feet = (
        motion.places(motion.plan.path.evaluate(near))[0] if len(near) else motion.feet[best][None]
    )
    return float(max(feet[:, i, 2].max(), motion.feet[best, i, 2]))


def _clearance(motion: Motion, feet: FloatArray, begin: FloatArray, end: FloatArray) -> float:
    """Least height over the higher foothold where a foot is outside both footholds' radius."""
    radius = motion.plan.footholds.landing_radius
    outside = np.ones(len(feet), dtype=bool)
    for place in (begin, end):
        outside &= np.hypot(*(feet[:, :2] - place[:2]).T) > radius
    return float((feet[outside, 2] - max(begin[2], end[2])).min(initial=np.inf))
