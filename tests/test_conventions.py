"""Names and frames that every room shares."""

from __future__ import annotations

import json
import pickle

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.conventions import GRAVITY, LEGS, TextEnum, frozen, leg_index, rotation_z

angles = st.floats(-10.0, 10.0)


def test_there_are_four_legs_named_by_side_and_end() -> None:
    assert LEGS == ("LF", "LH", "RH", "RF")
    assert {side + end for side in "LR" for end in "FH"} == set(LEGS)


def test_gravity_is_that_of_pinocchios_models() -> None:
    assert pin.Model().gravity.linear.tolist() == [0.0, 0.0, -GRAVITY]


class Fruit(TextEnum):
    APPLE = "apple"


def test_a_text_enumeration_is_its_texts() -> None:
    assert Fruit.APPLE == "apple" and {Fruit.APPLE} == {"apple"} and Fruit("apple") is Fruit.APPLE
    assert (str(Fruit.APPLE), f"{Fruit.APPLE}", f"{Fruit.APPLE:>7}") == (
        "apple",
        "apple",
        "  apple",
    )
    assert json.dumps([Fruit.APPLE]) == '["apple"]'
    assert pickle.loads(pickle.dumps(Fruit.APPLE)) is Fruit.APPLE


@pytest.mark.parametrize("leg", LEGS)
def test_leg_index_is_the_place_in_legs(leg: str) -> None:
    assert LEGS[leg_index(leg)] == leg


def test_frozen_array_is_a_copy_that_cannot_be_written() -> None:
    original = np.array([1.0, 2.0])
    copy = frozen(original)
    original[0] = 9.0
    assert copy.tolist() == [1.0, 2.0]
    with pytest.raises(ValueError, match="read-only"):
        copy[0] = 3.0


def test_frozen_array_holds_floats() -> None:
    assert frozen([1, 2]).dtype == np.float64


def test_quarter_turn_takes_forward_to_left() -> None:
    np.testing.assert_allclose(rotation_z(np.pi / 2) @ [1, 0, 0], [0, 1, 0], rtol=0, atol=1e-16)


@given(angles, angles)
def test_turns_add_up(first: float, second: float) -> None:
    np.testing.assert_allclose(
        rotation_z(first) @ rotation_z(second), rotation_z(first + second), rtol=0, atol=1e-14
    )


@given(angles)
def test_rotation_keeps_lengths_handedness_and_height(angle: float) -> None:
    turn = rotation_z(angle)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), rtol=0, atol=1e-15)
    assert np.linalg.det(turn) == pytest.approx(1.0, abs=1e-14)
    assert (turn @ [0.3, -0.4, 0.7])[2] == 0.7
