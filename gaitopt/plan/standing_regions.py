"""Where the true centre of mass of a plan's robot may be during its swings, so that it can rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.dynamics.feasible_region import feasible_regions
from gaitopt.dynamics.region.result import FeasibleRegion
from gaitopt.errors import InputError
from gaitopt.plan.contact_ground import ground_below
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan


def swing_region(plan: Plan, swing: Phase) -> FeasibleRegion | None:
    """Where contact forces hold the robot at rest, in the posture of the middle of a swing.

    In a walk phase by phase body and standing legs rest during swings, so the region holds for all
    of the swing.

    Args:
        plan: any plan.
        swing: one of its phases.

    Returns:
        ``None`` where the plan promises no forces or lets the body rely on its momentum, fewer than
        three feet stand, the swing lasts no time, or joints are beyond their limits.
    """
    return swing_regions(plan, [swing])[0]


def swing_regions(plan: Plan, swings: Sequence[Phase]) -> tuple[FeasibleRegion | None, ...]:
    """:func:`swing_region` of many swings, with all matrices made at once."""
    limits = plan.settings.promised_forces
    found: list[FeasibleRegion | None] = [None] * len(swings)
    if limits is None or not plan.settings.static:
        return tuple(found)
    chosen = [i for i, s in enumerate(swings) if len(s.support) >= 3 and s.duration > 0.0]
    if not chosen:
        return tuple(found)
    middles = np.array([min(s.start + s.duration / 2.0, plan.duration)
                        for s in (swings[i] for i in chosen)])  # fmt: skip
    feet, postures = plan.at(middles).feet, plan.path.evaluate(middles)[:, :6]
    ground = ground_below(plan, middles, limits.friction)
    standing = np.array([[leg in swings[i].support for leg in LEGS] for i in chosen])
    size = (len(chosen), len(LEGS))
    normals = np.broadcast_to(np.asarray(ground.normals, np.float64), (*size, 3))
    grip = np.broadcast_to(np.asarray(ground.grip, np.float64), size)

    def regions(part: slice) -> tuple[FeasibleRegion, ...]:
        return feasible_regions(
            plan.robot, feet[part], normals[part], limits, standing[part], postures[part],
            grip=grip[part],
        )  # fmt: skip

    try:
        found_here: list[FeasibleRegion | None] = list(regions(slice(None)))
    except InputError:
        found_here = []
        for i in range(len(chosen)):
            try:
                found_here += regions(slice(i, i + 1))
            except InputError:
                # A standing leg beyond its joint limits: the certificate tells of it.
                found_here.append(None)
    for i, region in zip(chosen, found_here, strict=True):
        found[i] = region
    return tuple(found)
