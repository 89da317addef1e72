"""What a time-optimal walk may choose, as a value."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt import Freedoms, InputError
from gaitopt.plan.settings.freedoms import VARIANTS

NAMES = ("overlap", "swing", "height", "posture", "dynamic")


def test_each_variant_frees_one_thing_more() -> None:
    assert [len(free.names) for free in VARIANTS.values()] == [0, 1, 2, 3, 4, 5]
    for name, free in VARIANTS.items():
        assert Freedoms.from_name(name) == Freedoms.of(name) == free
        assert free.variant == str(free) == name


@given(st.sets(st.sampled_from(NAMES)))
def test_names_and_values_are_the_same_thing(names: set[str]) -> None:
    if "dynamic" in names and not {"overlap", "swing"} <= names:
        with pytest.raises(InputError, match="needs 'overlap' and 'swing'"):
            Freedoms.of(names)
        return
    free = Freedoms.of(names)
    assert set(free.names) == names and Freedoms.of(free.to_dict()) == free
    assert Freedoms.of(free) is free


@pytest.mark.parametrize(("given", "words"), [
    ("wings", "free must be one of route, overlap, swing, height, posture, dynamic, got 'wings'"),
    (("swing", "wings"), "free names 'wings'"),
    (7, "free names '7'"),
])  # fmt: skip
def test_what_is_unknown_is_named(given: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        Freedoms.of(given)


def test_a_choice_without_a_name_lists_what_is_free() -> None:
    assert str(Freedoms.of(["height", "overlap"])) == "overlap+height"
