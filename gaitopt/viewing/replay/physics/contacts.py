"""Phases of a walk in physics, from which feet touched the ground."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.plan.com_margin import margins_over, true_com
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory

FLICKER = 0.05
"""Contacts, and times without contact, that are shorter count as none [s]. Chosen: feet that land
bounce for a few hundredths of a second, and the swings of walks and trots last longer."""


def phases_of(plan: Plan, motion: Trajectory) -> tuple[Phase, ...]:
    """Stretches of a simulated motion with the same feet on the ground.

    The k-th flight of a foot is that of the plan, so phases have the numbers of the plan's steps.
    Margins are static ones of the true centre of mass, over the feet that touched.
    """
    times = motion.t - motion.t[0]
    touching = settled_contacts(times, motion.contacts)
    changes = 1 + np.flatnonzero((touching[1:] != touching[:-1]).any(axis=1))
    starts = np.concatenate([[0], changes])
    ends = np.concatenate([changes, [len(times) - 1]])
    margins = touched_margins(plan, motion)
    steps = {leg: [s.step for s in plan.swings if s.leg == leg] or [0] for leg in LEGS}
    flights = dict.fromkeys(LEGS, -1)
    before = np.ones(len(LEGS), dtype=np.bool_)
    phases = []
    for first, last in zip(starts, ends, strict=True):
        for leg, was, now in zip(LEGS, before, touching[first], strict=True):
            flights[leg] += bool(was and not now)
        before = touching[first]
        known = margins[first : last + 1]
        known = known[np.isfinite(known)]
        leg = _leg(touching, int(first), flights, steps)
        column = LEGS.index(leg) if leg else 0
        # A stance has the number of the step that comes next.
        ahead = 0 if leg and not touching[first, column] else 1
        made = steps[leg][min(flights[leg] + ahead, len(steps[leg]) - 1)] if leg else 0
        phases.append(Phase(
            kind="stance" if touching[first].all() else "swing", leg=leg, step=made,
            start=float(times[first]), duration=float(times[last] - times[first]),
            cog_start=motion.cog[first], cog_end=motion.cog[last],
            support=tuple(leg for leg, on in zip(LEGS, touching[first], strict=True) if on),
            foot_start=motion.feet[first, column], foot_end=motion.feet[last, column],
            margin=float(known.min()) if len(known) else float("-inf"),
        ))  # fmt: skip
    return tuple(phases)


def touched_margins(plan: Plan, motion: Trajectory) -> FloatArray:
    """Static margins of the true centre of mass over the feet that touch ``(N,)`` [m]."""
    return margins_over(motion, true_com(plan.robot, motion.q))


def settled_contacts(times: FloatArray, contacts: BoolArray) -> BoolArray:
    """Contacts ``(N, 4)`` without those, and without gaps, shorter than :data:`FLICKER`."""
    out = np.array(contacts)
    for column in out.T:
        edges = np.concatenate([[0], 1 + np.flatnonzero(column[1:] != column[:-1]), [len(column)]])
        for first, last in pairwise(edges[1:-1]):
            if times[last] - times[first] < FLICKER:
                column[first:last] = column[first - 1]
    return out


def _leg(
    touching: BoolArray, first: int, flights: dict[str, int], steps: dict[str, list[int]]
) -> str:
    """The leg that flies, or the next one that does; the one with the earlier step of two."""
    flying = ~touching[first]
    if not flying.any():
        later = np.flatnonzero((~touching[first:]).any(axis=1))
        if not len(later):
            return ""
        flying = ~touching[first + later[0]]
    legs = [leg for leg, flies in zip(LEGS, flying, strict=True) if flies]
    return min(legs, key=lambda leg: steps[leg][min(max(flights[leg], 0), len(steps[leg]) - 1)])
