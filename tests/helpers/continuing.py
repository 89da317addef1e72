"""What holds of every plan that begins in a state."""

from __future__ import annotations

import numpy as np

from gaitopt import LEGS, Plan, State, verify

SAME_RATE = 1e-5
"""Largest jump of a rate [rad/s]: standing feet of plans slide by a micrometre at most, and rates
of standing legs are those of feet that do not."""


def assert_continues(plan: Plan, state: State) -> None:
    """The plan is in the state when it begins, feet stand that did, and it ends at rest."""
    assert np.abs(plan.path.evaluate([0.0])[0] - state.columns)[3:].max() < 1e-9
    assert np.abs(plan.path.evaluate([0.0], 1)[0] - state.column_rates).max() < SAME_RATE
    begin = plan.at([0.0])
    assert {leg for leg, on in zip(LEGS, begin.contacts[0], strict=True) if on} == set(
        state.support
    )
    # Nothing jumps anywhere in the plan, so nothing jumps where the entry ends.
    assert plan.path.jumps(0).max() < 1e-9
    assert plan.path.jumps(1).max() < 1e-5
    rest = plan.phases[plan.entry - 1].end
    assert np.abs(plan.path.evaluate([rest], 1)).max() < 1e-6
    assert np.abs(plan.path.evaluate([plan.duration], 1)).max() < 1e-6


def assert_certified(plan: Plan) -> None:
    found = verify(plan)
    assert found.outcome == "certified", str(found)
