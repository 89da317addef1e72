"""The ground below each foot of a plan: on which foothold it stands, its normal, its friction."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan

SAME_INSTANT = 1e-9
"""How long after its lift-off a foot counts as still on its foothold [s]: times of long walks are
known to 1e-12 s."""


def foothold_indices(plan: Plan, times: FloatArray) -> np.ndarray:
    """Index of the foothold on which each foot stands, or will land ``(N, 4)``.

    At the very instant of its lift-off a foot is still on the foothold that it leaves.

    Args:
        plan: the plan.
        times: instants of it ``(N,)`` [s].
    """
    columns = []
    for leg in LEGS:
        starts = np.array([swing.start for swing in plan.swings if swing.leg == leg])
        made = np.searchsorted(starts, np.asarray(times) - SAME_INSTANT, side="left")
        columns.append(np.minimum(made, plan.footholds.counts[leg] - 1))
    return np.stack(columns, axis=1)


def contact_normals(plan: Plan, times: FloatArray) -> FloatArray:
    """Unit normals of the ground below each foot, or where it will land ``(N, 4, 3)``."""
    normals = plan.footholds.normal_array
    return np.asarray(normals[np.arange(len(LEGS)), foothold_indices(plan, times)])


def contact_friction(plan: Plan, times: FloatArray, usual: float) -> FloatArray:
    """Coefficient of friction below each foot, or where it will land ``(N, 4)``.

    Args:
        plan: the plan.
        times: instants of it ``(N,)`` [s].
        usual: that of footholds of which none is known.
    """
    of_legs = plan.footholds.friction
    if of_legs is None:
        return np.full((len(times), len(LEGS)), usual)
    indices = foothold_indices(plan, times)
    return np.stack([of_legs[leg][indices[:, i]] for i, leg in enumerate(LEGS)], axis=1)
