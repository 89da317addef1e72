"""Limits that leave a reserve stay within the range of limits."""

from __future__ import annotations

from gaitopt import ForceLimits
from gaitopt.retiming.reserves import PLANNED_SHARE, tightened


def test_every_limit_is_stricter() -> None:
    limits = ForceLimits()
    kept = tightened(limits, PLANNED_SHARE)
    assert kept.friction < limits.friction and kept.torque_share < limits.torque_share
    assert kept.reserve > limits.reserve and kept.speed_share < limits.speed_share
    assert kept.reserve_on_four is not None and kept.reserve_on_four > limits.reserve / 2.0


def test_limits_at_the_ends_of_their_ranges_stay_as_they_are() -> None:
    strictest = ForceLimits(
        friction=0.001, reserve=1.0 / 3.0, reserve_on_four=0.25, torque_share=0.001,
        speed_share=0.001,
    )  # fmt: skip
    assert tightened(strictest, PLANNED_SHARE) == strictest
