"""Walks over a map that begin in the middle of another walk over it."""

from __future__ import annotations

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Plan, State
from gaitopt.errors import InfeasibleStateError
from gaitopt.planners.over_terrain.from_state import pose_of, reached_from

GO2 = gaitopt.load_robot("go2")


@pytest.fixture(scope="module")
def rubble() -> Plan:
    ground = gaitopt.make_ground("rubble", robot=GO2, length=0.9, difficulty=0.5)
    return gaitopt.plan_terrain(GO2, ground, (0.9, 0.0), start=(0.0, 0.0, 0.0))


def test_from_the_middle_of_a_swing_to_another_goal(rubble: Plan) -> None:
    ground, swing = rubble.footholds.ground, rubble.swings[2]
    assert ground is not None
    time = swing.start + 0.5 * swing.duration
    state = rubble.state(time)
    assert state.support != LEGS
    plan = gaitopt.plan_terrain(GO2, ground, (0.5, 0.08), start=state)
    assert np.abs(plan.path.evaluate([0.0])[0] - state.columns).max() < 1e-9
    assert np.abs(plan.path.evaluate([0.0], 1)[0] - state.column_rates).max() < 1e-5
    assert gaitopt.verify(plan).outcome == "certified"
    feet = rubble.at([time]).feet[0]
    for leg in state.support:
        assert np.allclose(plan.footholds[leg][0], feet[LEGS.index(leg)], atol=1e-9)


def test_feet_that_stand_elsewhere_step_first(rubble: Plan) -> None:
    feet = np.array([rubble.footholds[leg][0] for leg in LEGS])
    here = State.standing(GO2, feet)
    assert np.allclose(pose_of(GO2, here)[:2], feet[:, :2].mean(axis=0))
    same = reached_from(GO2, here, rubble.footholds, 0.05)
    assert same == rubble.footholds
    later = rubble.footholds.after(
        {leg: int(leg in ("LF", "RH")) for leg in LEGS},
        [s.leg for s in rubble.swings if not (s.index == 0 and s.leg in ("LF", "RH"))],
    )
    moved = reached_from(GO2, here, later, 0.05)
    assert moved.order is not None and later.order is not None
    assert set(moved.order[:2]) == {"LF", "RH"} and moved.order[2:] == later.order
    assert moved.steps == later.steps + 2
    assert moved.postures is not None and later.postures is not None
    assert len(moved.postures) == len(later.postures) + 2
    for leg in ("LF", "RH"):
        assert np.allclose(moved[leg][0], feet[LEGS.index(leg)])


def test_a_foot_above_the_ground_of_the_map_is_refused(rubble: Plan) -> None:
    feet = np.array([rubble.footholds[leg][0] for leg in LEGS])
    feet[:, 2] += 0.02
    with pytest.raises(InfeasibleStateError, match=r"LF stands 20\.0 mm above the ground"):
        reached_from(GO2, State.standing(GO2, feet), rubble.footholds, 0.05)
