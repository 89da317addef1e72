"""States: what they hold agrees with Pinocchio and with plans, and nonsense is refused."""

from __future__ import annotations

import pickle

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, InputError, Plan, State
from gaitopt.robots.quadruped import Quadruped


def test_the_state_of_a_plan_has_its_values_and_rates(a1_walk: Plan) -> None:
    times = np.linspace(0.0, a1_walk.duration, 40)
    for time in times.tolist():
        state = a1_walk.state(time)
        assert np.allclose(state.columns, a1_walk.path.evaluate([time])[0], rtol=0.0, atol=1e-12)
        rates = a1_walk.path.evaluate([time], 1)[0]
        assert np.allclose(state.column_rates, rates, rtol=0.0, atol=1e-9)
        flying = [swing.leg for swing in a1_walk.swings if swing.start <= time < swing.end]
        assert set(LEGS) - set(state.support) == set(flying)


def test_a_measured_state_moves_as_pinocchio_integrates_it(wang: Quadruped) -> None:
    """Velocities in the world's axes are those of the base a little later."""
    rng = np.random.default_rng(0)
    joints = wang.standing_joints()
    for _ in range(5):
        rpy, linear, angular = rng.uniform(-0.5, 0.5, (3, 3))
        rates = rng.normal(size=len(joints))
        state = State.of(
            wang, rng.normal(size=3), rpy, joints, linear=linear, angular=angular, rates=rates
        )
        step = 1e-6
        moved = pin.integrate(wang.model, state.q, step * state.v)
        assert np.allclose((moved[:3] - state.q[:3]) / step, linear, atol=1e-5)
        turned = pin.Quaternion(moved[3:7]).matrix() @ pin.Quaternion(state.q[3:7]).matrix().T
        assert np.allclose(pin.log3(turned) / step, angular, atol=1e-5)
        assert np.allclose(state.columns[3:6], rpy, atol=1e-12)
        later = State(moved, state.v, LEGS, wang.joint_names).columns
        assert np.allclose((later - state.columns) / step, state.column_rates, atol=1e-4)


def test_a_standing_robot_has_its_feet_where_they_were_asked_for(wang: Quadruped) -> None:
    feet = np.array([[0.3, 0.2, 0.02], [-0.3, 0.22, 0.0], [-0.32, -0.2, 0.01], [0.3, -0.2, 0.0]])
    state = State.standing(wang, feet, height=0.3)
    found = gaitopt.feet_from_joints(wang, state.q[:3], state.columns[3:6], state.q[7:])
    assert np.allclose(found, feet, atol=1e-9)
    assert state.q[2] + wang.centre[2] == pytest.approx(feet[:, 2].mean() + 0.3)
    assert not state.v.any() and state.support == LEGS
    plain = State.standing(wang, heading=0.5)
    assert plain.columns[5] == pytest.approx(0.5)
    assert np.allclose(plain.q[7:], wang.standing_joints(), atol=1e-9)


def test_a_state_survives_pickling_and_cannot_be_written_into(wang: Quadruped) -> None:
    state = State.standing(wang)
    again = pickle.loads(pickle.dumps(state))
    assert np.array_equal(again.q, state.q) and again.support == state.support
    with pytest.raises(ValueError, match="read-only"):
        state.q[0] = 1.0


def test_nonsense_is_refused(wang: Quadruped) -> None:
    good = State.standing(wang)
    nan = np.array(good.q)
    nan[9] = np.nan
    for change, words in (
        ({"q": nan}, "q must be finite numbers"),
        ({"q": good.q[:-1]}, "12 joints needs q"),
        ({"v": np.full(18, 1e9)}, "v must be finite numbers"),
        ({"q": np.where(np.arange(19) == 6, 2.0, good.q)}, "a quaternion x, y, z, w of length 1"),
        ({"support": ("LF", "FL")}, "a second name of one"),
        ({"support": "LF"}, "support must be a list of names"),
        ({"joint_names": ("a",)}, "a state with 1 joints"),
    ):
        fields = {"q": good.q, "v": good.v, "support": LEGS, "joint_names": wang.joint_names}
        with pytest.raises(InputError, match=words):
            State(**{**fields, **change})
    with pytest.raises(InputError, match=r"rpy must be \(3,\)"):
        State.of(wang, [0, 0, 0], [0, 0], good.q[7:])
    with pytest.raises(InputError, match=r"feet must be \(4, 3\)"):
        State.standing(wang, np.zeros((3, 3)))


def test_the_footholds_ahead_are_those_that_are_left(a1_walk: Plan) -> None:
    whole = a1_walk.footholds
    assert a1_walk.footholds_ahead(0.0).with_(order=None) == whole
    for swing in a1_walk.swings:
        left = a1_walk.footholds_ahead((swing.start + swing.end) / 2.0)
        assert np.array_equal(left[swing.leg][0], swing.foot_end)
        assert left.order == tuple(s.leg for s in a1_walk.swings[swing.step + 1 :])
    last = a1_walk.footholds_ahead(a1_walk.duration)
    assert last.steps == 0
    assert all(np.array_equal(last[leg][0], whole[leg][-1]) for leg in LEGS)


def test_what_is_told_of_footholds_and_steps_goes_with_them(a1_walk: Plan) -> None:
    counts = a1_walk.footholds.counts
    order = tuple(s.leg for s in a1_walk.swings)
    told = Footholds(
        a1_walk.footholds.points, order=order,
        friction={leg: np.linspace(0.5, 0.9, n) for leg, n in counts.items()},
        swing_heights={leg: np.linspace(0.05, 0.1, n - 1) for leg, n in counts.items()},
        body_places=np.arange(2.0 * len(order) + 2.0).reshape(-1, 2),
    )  # fmt: skip
    rest = told.after({leg: int(leg == order[0]) for leg in LEGS}, order[1:])
    assert rest.friction is not None and told.friction is not None
    assert rest.friction[order[0]][0] == told.friction[order[0]][1]
    assert rest.body_places is not None and told.body_places is not None
    assert np.array_equal(rest.body_places, told.body_places[1:])
    assert rest.swing_heights is not None
    assert [len(rest.swing_heights[leg]) for leg in LEGS] == [rest.counts[leg] - 1 for leg in LEGS]
