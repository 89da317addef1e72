"""When feet have landed and lift off, and what they may bear before and after."""

from __future__ import annotations

import numpy as np
import pytest

import gaitopt
from gaitopt import ForceLimits, InputError, Plan
from gaitopt.dynamics.forces import build_force_problem, solve_forces
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.plan.load_transfer import TOUCH_SHARE, largest_shares, most_normal_shares, stances


def test_stances_are_those_that_a_walk_through_the_intervals_finds() -> None:
    rng = np.random.default_rng(0)
    standing = rng.random((60, 4)) < 0.7
    begin = np.cumsum(rng.random(60))
    end = begin + rng.random(60) * 0.1
    landed, lifted = stances(standing, begin, end)
    for leg in range(4):
        for k in np.flatnonzero(standing[:, leg]).tolist():
            first, last = k, k
            while first > 0 and standing[first - 1, leg]:
                first -= 1
            while last + 1 < 60 and standing[last + 1, leg]:
                last += 1
            assert landed[k, leg] == (end[first - 1] if first else -np.inf)
            assert lifted[k, leg] == (begin[last + 1] if last < 59 else np.inf)


def test_a_foot_takes_over_the_weight_within_the_transfer_time() -> None:
    limits = ForceLimits(transfer_time=0.2, reserve=0.03)
    shares = most_normal_shares(limits, [0.0, 0.2, 0.1, np.inf], [0.5, 0.5, 0.05, np.inf])
    assert shares == pytest.approx(0.03 + TOUCH_SHARE + np.array([0.0, 1.0, 0.25, np.inf]))
    assert np.isinf(most_normal_shares(ForceLimits(), 0.0, 0.0)).all()


def test_the_times_of_a_plan_are_those_of_its_swings(a1_walk: Plan) -> None:
    limits = ForceLimits(transfer_time=0.1)
    times = np.linspace(0.0, a1_walk.duration, 301)
    found = largest_shares(a1_walk, limits, times)
    standing = a1_walk.at(times).contacts
    for leg, name in enumerate(gaitopt.LEGS):
        swings = [swing for swing in a1_walk.swings if swing.leg == name]
        for time, share in zip(times[standing[:, leg]], found[standing[:, leg], leg], strict=True):
            near = [abs(time - t) for s in swings for t in (s.start, s.end)]
            assert share == pytest.approx(0.02 + TOUCH_SHARE + min(near) / 0.1)


def test_forces_are_found_below_largest_ones_as_far_as_there_are_any(a1_walk: Plan) -> None:
    """At rest on four feet: each bears about a quarter, and all four bear the weight."""
    value = a1_walk.path.evaluate([0.0])
    still = motion_of_path(a1_walk.robot, value, np.zeros_like(value), np.zeros_like(value))
    standing = np.ones((1, 4), dtype=np.bool_)

    def solved(most: list[float], objective: str) -> gaitopt.ContactForces:
        problem = build_force_problem(a1_walk.robot, still, standing, most=[most])
        return solve_forces(problem, objective)

    for objective in ("smoothest", "least torque", "largest reserve"):
        found = solved([0.15, np.inf, np.inf, np.inf], objective)
        assert found.feasible.all()
        shares = found.forces[0, :, 2] / found.weight
        assert shares.sum() == pytest.approx(1.0)
        assert (
            shares[0]
            <= 0.15 + 1e-7
            < solved([np.inf] * 4, objective).forces[0, 0, 2] / found.weight
        )
    found = solved([0.2, 0.2, 0.2, 0.2], "smoothest")
    assert not found.feasible.any() and found.worst() is not None
    # What is too much on the feet is what four fifths of the weight leave of it.
    assert found.residuals.normal_force.sum() / found.weight == pytest.approx(0.2, abs=1e-6)
    assert any(name.startswith("normal force") for name in found.conflicts(0))


@pytest.mark.parametrize("wrong", [-0.1, np.nan, 11.0, "soon"])
def test_transfer_times_that_are_none_are_refused(wrong: object) -> None:
    with pytest.raises(InputError, match="transfer_time"):
        ForceLimits(transfer_time=wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize("wrong", [[-0.1] * 4, [np.nan] * 4, [0.1] * 3])
def test_largest_forces_that_are_none_are_refused(a1_walk: Plan, wrong: list[float]) -> None:
    value = a1_walk.path.evaluate([0.0])
    still = motion_of_path(a1_walk.robot, value, np.zeros_like(value), np.zeros_like(value))
    with pytest.raises(InputError, match="most"):
        build_force_problem(a1_walk.robot, still, np.ones((1, 4), dtype=np.bool_), most=wrong)
