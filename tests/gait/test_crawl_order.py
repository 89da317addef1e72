"""The order in which a crawling robot's legs move."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
import pytest

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.gait.crawl import (
    CRAWL_SEQUENCES,
    FREE_ORDER,
    WANG_SEQUENCE,
    check_order,
    check_sequence,
    swing_order,
)
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.robots.numbering import NUMBERINGS


def turned(sequence: tuple[str, ...]) -> frozenset[tuple[str, ...]]:
    """The same cycle, begun at each of its legs."""
    return frozenset(sequence[k:] + sequence[:k] for k in range(4))


def test_wang_walks_in_the_order_of_its_numbers() -> None:
    numbers = NUMBERINGS["wang2020"]
    assert WANG_SEQUENCE == ("RH", "RF", "LH", "LF") == tuple(numbers[i] for i in (1, 2, 3, 4))


def test_hind_leg_is_followed_by_the_front_leg_of_its_side() -> None:
    """The property of the order that McGhee and Frank found best for static stability."""
    cycle = WANG_SEQUENCE + WANG_SEQUENCE[:1]
    for leg, following in zip(WANG_SEQUENCE, cycle[1:], strict=True):
        if leg[1] == "H":
            assert following == leg[0] + "F"


def test_six_sequences_are_all_the_cycles_there_are() -> None:
    assert len(CRAWL_SEQUENCES) == 6
    assert {turned(s) for s in CRAWL_SEQUENCES} == {turned(s) for s in permutations(LEGS)}
    assert WANG_SEQUENCE in CRAWL_SEQUENCES


@pytest.mark.parametrize("sequence", list(permutations(LEGS)))
def test_any_order_of_all_legs_is_allowed(sequence: tuple[str, ...]) -> None:
    assert check_sequence(sequence) == sequence
    assert check_sequence(iter(sequence)) == sequence


@pytest.mark.parametrize(
    ("sequence", "got"),
    [
        ((), "nothing"),
        (("RH", "RF", "LH"), "RH, RF, LH"),
        (("RH", "RF", "LH", "LH"), "RH, RF, LH, LH"),
        (("RH", "RF", "LH", "LF", "RH"), "RH, RF, LH, LF, RH"),
        (("RH", "RF", "LH", "XX"), "RH, RF, LH, XX"),
        ((1, 2, 3, 4), "1, 2, 3, 4"),
        ("RHRF", "RHRF"),
        ("Freely", "Freely"),
    ],
)
def test_other_orders_are_refused_with_what_was_given(sequence: tuple[str, ...], got: str) -> None:
    with pytest.raises(InputError) as caught:
        check_sequence(sequence)
    assert str(caught.value) == (
        f"sequence must name each of LF, LH, RH, RF once, got {got}; an order is RH, RF, LH, LF, "
        "for instance, and where footholds are given 'free' searches for one"
    )


@pytest.mark.parametrize("sequence", [
    "RH,RF,LH,LF", " RH RF  LH LF ", "rh, rf, lh, lf,", "RR,FR,RL,FL", ("HR", "fr", "hl", "FL"),
    ("rear_right", "Front-Right", "hind left", "leftFront"),
])  # fmt: skip
def test_an_order_may_be_one_text_and_legs_may_have_other_names(sequence: Any) -> None:
    assert check_sequence(sequence) == check_order(sequence) == WANG_SEQUENCE
    assert CrawlSettings(sequence=sequence).sequence == WANG_SEQUENCE


def test_free_is_understood_in_any_case() -> None:
    assert CrawlSettings(sequence=" Free").sequence == FREE_ORDER  # type: ignore[arg-type]


def test_walk_steps_every_leg_onto_each_of_its_footholds_in_turn() -> None:
    steps = swing_order(WANG_SEQUENCE, 3)
    assert steps == [
        ("RH", 1), ("RF", 1), ("LH", 1), ("LF", 1),
        ("RH", 2), ("RF", 2), ("LH", 2), ("LF", 2),
    ]  # fmt: skip


def test_seventeen_footholds_make_64_steps() -> None:
    assert len(swing_order(WANG_SEQUENCE, 17)) == 64


@pytest.mark.parametrize("footholds", [np.int64(3), {"FL": 3, "RL": 3, "RR": 3, "FR": 3}])
def test_numbers_of_footholds_may_be_numpys_and_legs_have_other_names(footholds: Any) -> None:
    assert swing_order(WANG_SEQUENCE, footholds) == swing_order(WANG_SEQUENCE, 3)


@pytest.mark.parametrize("footholds", [None, "3", 0, 2.0, {"LF": 3}])
def test_what_is_no_number_of_footholds_is_told(footholds: Any) -> None:
    with pytest.raises(InputError, match=r"^footholds of L[FH] must be a whole number from 1 to "):
        swing_order(WANG_SEQUENCE, footholds)


def test_one_foothold_is_standing_still() -> None:
    assert swing_order(WANG_SEQUENCE, 1) == []


def test_walk_refuses_a_bad_order() -> None:
    with pytest.raises(InputError, match=r"once, got LF, LF, LF, LF; an order is"):
        swing_order(("LF",) * 4, 3)
