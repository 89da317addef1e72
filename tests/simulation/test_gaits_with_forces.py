"""Gaits with contact forces in physics: they are followed as planned, and better than without."""

from __future__ import annotations

from collections.abc import Callable

import pytest

import gaitopt


@pytest.mark.parametrize("name", ["a1", "go2"])
def test_a_trot_at_half_a_metre_a_second_is_followed(name: str) -> None:
    robot, gait = gaitopt.load_robot(name), gaitopt.trot(0.5)
    results = [
        gaitopt.simulate(
            gaitopt.plan_gait(robot, gait, velocity=0.5, duration=0.5, timing=timing)
        )
        for timing in ("forces", "velocity")
    ]  # fmt: skip
    assert results[0].passed, str(results[0])
    assert results[0].waited == 0.0
    assert results[0].body_error < 0.01 and results[0].tilt < 0.03
    assert results[0].body_error < 0.5 * results[1].body_error


@pytest.mark.parametrize("name", ["trot", "pronk", "bound"])
def test_a_body_that_flies_or_pitches_is_followed(
    flying: Callable[[str], gaitopt.Plan], name: str
) -> None:
    result = gaitopt.simulate(flying(name))
    assert result.passed, str(result)
    assert result.body_error < 0.02 and result.tilt < 0.06


def test_a_pace_is_followed() -> None:
    """Its body is never above its feet: it falls to one side and is caught by the other."""
    plan = gaitopt.plan_gait(
        gaitopt.load_robot("a1"), gaitopt.pace(0.5), velocity=0.1, duration=0.0,
        forces=gaitopt.ForceLimits(friction=0.8),
    )  # fmt: skip
    result = gaitopt.simulate(plan)
    assert result.passed, str(result)
