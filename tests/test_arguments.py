"""Arguments by their type hints: what is refused, and what is not."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import InputError
from gaitopt.arguments import checked


def example(
    number: float, whole: int, yes: bool, text: str, path: str | Path, rows: Any, plan: Any,
    pair: Any, by_leg: Any, call: Any,
) -> str:  # fmt: skip
    """Takes one of each."""
    return "taken"


example.__annotations__ |= {
    "path": "StrPath | None", "rows": "ArrayLike", "plan": "Plan | None",
    "pair": "tuple[float, float] | None", "by_leg": "Mapping[str, ArrayLike]",
    "call": "Callable[[int], None] | None", "number": "float", "whole": "int", "yes": "bool",
    "text": "str",
}  # fmt: skip
GOOD: Mapping[str, Any] = {
    "number": 1.0, "whole": 2, "yes": True, "text": "a", "path": "a.csv", "rows": [[1, 2]],
    "plan": None, "pair": (1, 2.0), "by_leg": {"LF": [0.0]}, "call": None,
}  # fmt: skip
public: Callable[..., str] = checked(example, "example")


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("number", [0, 1.5, np.float64(2), np.int32(1), np.array(3.0), Fraction(1, 2), np.inf]),
        ("whole", [0, np.int64(4)]),
        ("yes", [np.bool_(False)]),
        ("path", [Path("b"), None]),
        ("rows", [[], 1.0, np.zeros((0, 3)), (1, 2), [[True]], np.full(2, np.inf)]),
        ("pair", [[1, 2], np.zeros(2), None]),
        ("by_leg", [{}, {"LF": np.zeros(3)}]),
        ("call", [print]),
    ],
)
def test_what_can_be_right_is_taken(name: str, values: list[Any]) -> None:
    for value in values:
        assert public(**{**GOOD, name: value}) == "taken"


@pytest.mark.parametrize(
    ("name", "values", "wanted"),
    [
        ("number", [np.nan, "1", None, True, 1j, [1.0], np.array(np.nan), object()], "a number"),
        ("whole", [1.0, "1", None, True, np.nan], "a whole number"),
        ("yes", [0, 1, "yes", None], "True or False"),
        ("text", [None, b"a", 1], "a text"),
        ("path", [1, b"a", "a\0b", "", []], "a path"),
        ("rows", ["1", ["1"], None, [None], [[1], [1, 2]], [np.nan], {"a": 1}], "finite numbers"),
        ("plan", ["plan.npz", 1, [], object()], "a Plan"),
        ("pair", [(1,), (1, 2, 3), "ab", (1, None), (1, np.nan), 1.0], "a tuple"),
        ("by_leg", [[], {"LF": "x"}, {"LF": None}, {"LF": [np.nan]}, None], "a mapping"),
        ("call", [1, "print", []], "a function"),
    ],
)
def test_what_cannot_be_right_is_refused(name: str, values: list[Any], wanted: str) -> None:
    for value in values:
        with pytest.raises(InputError, match=f"^{name} must be {wanted}, got "):
            public(**{**GOOD, name: value})


def test_a_robot_may_be_the_text_of_a_file() -> None:
    text = gaitopt.load_robot("wang2020").urdf
    assert gaitopt.load_robot(text).urdf == text
    with pytest.raises(InputError, match="source must be a name, a path or the text of a file"):
        gaitopt.load_robot(3)  # type: ignore[arg-type]


def test_a_public_function_is_still_that_function() -> None:
    assert pickle.loads(pickle.dumps(gaitopt.trot)) is gaitopt.trot
    assert gaitopt.trot.__doc__ and gaitopt.trot(0.5).cycle_time == 0.5
    with pytest.raises(TypeError, match="missing 1 required"):
        gaitopt.trot()  # type: ignore[call-arg]
    with pytest.raises(InputError, match="plan must be a Plan, got a str; planners return one"):
        gaitopt.verify("walk.npz")  # type: ignore[arg-type]
