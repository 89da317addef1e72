"""The ground below each foot of a plan: on which foothold it stands, its normal, its friction."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.dynamics.contacts import LEVEL_GROUND, ContactGround
from gaitopt.plan.plan import Plan
from gaitopt.terrain.footholds import Footholds

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
        # A flight with which the plan begins leads to the first foothold, and leaves none.
        own = [swing for swing in plan.swings if swing.leg == leg and swing.index >= 0]
        starts = np.array([swing.start for swing in own])
        made = np.searchsorted(starts, np.asarray(times) - SAME_INSTANT, side="left")
        columns.append(np.minimum(made, plan.footholds.counts[leg] - 1))
    return np.stack(columns, axis=1)


def ground_below(plan: Plan, times: FloatArray, friction: float) -> ContactGround:
    """The ground below each foot, or where it will land.

    Args:
        plan: the plan.
        times: instants of it ``(N,)`` [s].
        friction: that of the limits: a foothold has no more than this, and it may have less.
    """
    if is_level(plan.footholds, friction):
        return LEVEL_GROUND
    return ground_on(plan.footholds, foothold_indices(plan, times), friction)


def ground_on(footholds: Footholds, indices: np.ndarray, friction: float) -> ContactGround:
    """The ground below footholds.

    Args:
        footholds: of all legs.
        indices: the foothold of each leg ``(N, 4)``.
        friction: as for :func:`ground_below`.
    """
    if is_level(footholds, friction):
        return LEVEL_GROUND
    grip, of_legs = np.ones(indices.shape), footholds.friction
    if of_legs is not None:
        for i, leg in enumerate(LEGS):
            grip[:, i] = np.minimum(of_legs[leg][indices[:, i]] / friction, 1.0)
    return ContactGround(footholds.normal_array[np.arange(len(LEGS)), indices], grip)


def is_level(footholds: Footholds, friction: float) -> bool:
    """Whether all normals are vertical, and no foothold has less than this friction."""
    slippery = footholds.friction is not None and any(
        (of_leg < friction).any() for of_leg in footholds.friction.values()
    )
    tilted = footholds.normals is not None and bool((footholds.normal_array[..., :2] != 0.0).any())
    return not (slippery or tilted)
