"""Loads that go over from one foot to another: the largest normal forces of the feet.

A foot that has just landed cannot carry much: the ground under it gives way a little, and joints
have to change their torques. The same holds for a foot that is about to lift off. With
:attr:`ForceLimits.transfer_time` the normal force of a foot is at most a small share of the weight
at the instants at which it lands and lifts off, and this limit grows evenly with the time since and
until then. So the limit is a concave function of time as long as the foot stands.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.plan.plan import Plan

TOUCH_SHARE: Final = 0.05
"""What a foot may carry beyond its reserve at the instants at which it lands and lifts off, as a
share of the weight. Chosen: forces must lie between the reserve and this limit. The controller of
``gaitopt.simulate`` leaves a foot with 2 to 5 % of a full load there."""


class Stances(NamedTuple):
    """When feet that stand have landed, and when they lift off; each ``(K, 4)`` [s].

    Infinite for a foot that stands from the first interval on, or to the last one. What is said of
    feet in the air means nothing.
    """

    landed: FloatArray
    lifted: FloatArray


def stances(standing: BoolArray, begin: FloatArray, end: FloatArray) -> Stances:
    """The stances of four feet over intervals that follow each other.

    Args:
        standing: which feet stand on each interval ``(K, 4)``.
        begin, end: of the intervals, in order ``(K,)`` [s].
    """
    number = np.arange(len(standing))[:, None]
    before = np.maximum.accumulate(np.where(standing, -1, number), axis=0)
    after = np.where(standing, len(standing), number)[::-1]
    after = np.minimum.accumulate(after, axis=0)[::-1]
    landed = np.append(end, -np.inf)[before]
    lifted = np.append(begin, np.inf)[after]
    return Stances(landed, lifted)


def most_normal_shares(limits: ForceLimits, since: ArrayLike, until: ArrayLike) -> FloatArray:
    """Largest normal forces of standing feet, as shares of the weight ``(...)``.

    Args:
        limits: with the time within which a foot takes over the weight.
        since: time since each foot has landed ``(...)`` [s].
        until: time until it lifts off ``(...)`` [s].
    """
    left = np.maximum(np.minimum(since, until), 0.0)
    if limits.transfer_time == 0.0:
        return np.full(left.shape, np.inf)
    return np.asarray(limits.reserve + TOUCH_SHARE + left / limits.transfer_time)


def largest_shares(plan: Plan, limits: ForceLimits, times: FloatArray) -> FloatArray:
    """Largest normal forces of a plan's feet, as shares of the weight ``(N, 4)``.

    Args:
        plan: the plan.
        limits: with the time within which a foot takes over the weight.
        times: instants of it ``(N,)`` [s]. Where phases meet the later one counts.
    """
    if limits.transfer_time == 0.0 or not plan.phases:
        return np.full((len(times), len(LEGS)), np.inf)
    begin = np.array([phase.start for phase in plan.phases])
    end = np.array([phase.end for phase in plan.phases])
    standing = np.array([[leg in phase.support for leg in LEGS] for phase in plan.phases])
    spans = stances(standing, begin, end)
    phase = np.clip(np.searchsorted(begin, times, side="right") - 1, 0, None)
    since, until = times[:, None] - spans.landed[phase], spans.lifted[phase] - times[:, None]
    return most_normal_shares(limits, since, until)
