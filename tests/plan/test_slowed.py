"""The same plan, slower."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import gaitopt
from gaitopt import InputError, Plan


def test_a_slowed_plan_is_at_the_same_places_later(a1_walk: Plan) -> None:
    slow = a1_walk.slowed(1.7)
    times = np.linspace(0.0, a1_walk.duration, 60)
    fast, later = a1_walk.at(times), slow.at(np.minimum(1.7 * times, slow.duration))
    assert later.q == pytest.approx(fast.q, abs=1e-9)
    assert 1.7 * later.v == pytest.approx(fast.v, abs=1e-7)
    assert slow.duration == pytest.approx(1.7 * a1_walk.duration)
    assert [p.end for p in slow.phases] == pytest.approx([1.7 * p.end for p in a1_walk.phases])


def test_inertial_forces_shrink_with_the_square_and_the_certificate_holds(a1_walk: Plan) -> None:
    slow = a1_walk.slowed(2.0)
    assert gaitopt.verify(a1_walk).outcome == "certified"
    assert gaitopt.verify(slow).outcome == "certified"
    weight = a1_walk.robot.mass * 9.81
    # The sum of all contact forces is the weight and the mass times the COM's acceleration.
    times = np.linspace(0.0, a1_walk.duration, 20)
    fast = gaitopt.contact_forces(a1_walk, times=times).forces.sum(axis=1)
    later = gaitopt.contact_forces(slow, times=np.minimum(2 * times, slow.duration)).forces
    fast[:, 2] -= weight
    assert np.abs(fast).max() > 0.1 * weight
    assert later.sum(axis=1) - [0, 0, weight] == pytest.approx(fast / 4.0, abs=1e-4 * weight)


def test_what_cannot_be_slowed_says_so(a1_walk: Plan, flying: Callable[[str], Plan]) -> None:
    with pytest.raises(InputError, match="factor must be a number from 1 to 1000"):
        a1_walk.slowed(0.5)
    with pytest.raises(InputError, match="falls where it is slow"):
        flying("trot").slowed(2.0)
