"""Checks of phases, and of what joins them: continuity, order of the legs, ends of phases."""

from __future__ import annotations

import numpy as np

from benchmarks.judge.motion import Finding, Motion, at_most
from gaitopt import LEGS, GaitoptError

SAME = 1e-9
"""Largest jump of the path, and largest distance of a phase's ends from it [m, rad]."""


def continuity(motion: Motion) -> list[Finding]:
    """Both sides of every knot."""
    first = np.flatnonzero(np.diff(motion.segments))
    jumps = np.abs(motion.values[first] - motion.values[first + 1]).max(axis=1, initial=0.0)
    return [at_most("continuity", jumps, SAME, motion.times[first])]


def contact_sequence(motion: Motion) -> list[Finding]:
    """Number and order of the flights, the times of the phases, and feet that stand."""
    plan, wrong = motion.plan, []
    time = 0.0
    for phase in plan.phases:
        if abs(phase.start - time) > 1e-6:  # times of long walks are sums of many numbers
            wrong.append(f"a phase starts at {phase.start:.4f} and the last ended at {time:.4f}")
        time = phase.end
        stand = len(phase.support)
        if (phase.kind == "stance") != (stand == 4):
            wrong.append(f"{phase.kind} on {stand} feet at {phase.start:.3f} s")
        if plan.settings.static and phase not in plan.phases[: plan.entry] and stand < 3:
            wrong.append(f"{stand} feet at {phase.start:.3f} s")
        if phase.kind == "swing" and phase.leg in phase.support:
            wrong.append(f"{phase.leg} swings and stands at {phase.start:.3f} s")
    if abs(time - plan.duration) > 1e-6:
        wrong.append(f"phases end at {time:.4f} s and the path at {plan.duration:.4f} s")
    swings = [s for s in plan.swings if s.index >= 0 and s.phases[0] >= plan.entry]
    for leg in LEGS:
        flights = sum(s.leg == leg for s in plan.swings if s.index >= 0)
        if not plan.entry and flights != plan.footholds.counts[leg] - 1:
            wrong.append(f"{leg} flies {flights} times")
    try:
        asked = plan.settings.swing_legs(plan.footholds.counts)
    except GaitoptError as error:  # an order of as many steps as other footholds ask for
        asked = None
        wrong.append(str(error))
    if asked is not None and not plan.entry:
        rows = [(round(s.start, 6), s.leg) for s in swings]
        if [leg for _, leg in rows] != list(asked):
            wrong += _order_of(rows, list(asked))
    return [at_most("contact sequence", len(wrong), 0, "; ".join(wrong[:2]))]


def _order_of(rows: list[tuple[float, str]], asked: list[str]) -> list[str]:
    """What is wrong with an order, where legs that lift off together may come in any order."""
    k = 0
    while k < len(rows):
        together = [leg for start, leg in rows if start == rows[k][0]]
        wanted = asked[k : k + len(together)]
        if sorted(together) != sorted(wanted):
            return [f"{together} lift off at {rows[k][0]:.3f} s, not {wanted}"]
        k += len(together)
    return [] if len(rows) == len(asked) else [f"{len(rows)} swings, not {len(asked)}"]


def phases_agree(motion: Motion) -> list[Finding]:
    """Body centre and foot at both ends of every phase."""
    apart, where = [], []
    for k, phase in enumerate(motion.plan.phases):
        for time, centre, foot in ((phase.start, phase.cog_start, phase.foot_start),
                                   (phase.end, phase.cog_end, phase.foot_end)):  # fmt: skip
            at = int(np.argmin(np.abs(motion.times - time)))
            gap = np.abs(motion.centre[at] - centre).max()
            # Samples are at the knots, and a phase that ends elsewhere is evaluated there.
            if abs(motion.times[at] - time) > 1e-12:
                values = motion.plan.path.evaluate([time])
                feet, centres, _ = motion.places(values)
                gap = np.abs(centres[0] - centre).max()
            else:
                feet = motion.feet[at : at + 1]
            if phase.leg:
                gap = max(gap, np.abs(feet[0, LEGS.index(phase.leg)] - foot).max())
            apart.append(gap)
            where.append(f"phase {k}, {time:.3f} s")
    return [at_most("phases agree with the path", apart, SAME, where)]
