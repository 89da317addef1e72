"""Wrong values in place of every argument of every public function, class and method."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from copy import deepcopy
from typing import Any, Final

import numpy as np

from benchmarks.fuzz.calls import calls
from benchmarks.fuzz.outcome import OK, Outcome, holds_nan, outcome
from benchmarks.fuzz.values import NEVER_NUMBERS, NEVER_OBJECTS, WRONG
from gaitopt import GaitStateMachine

UNKNOWN_ALLOWED: Final = {
    ("HeightMap", "z"), ("HeightMap.with_heights", "z"), ("HeightMap.height", "places"),
    ("HeightMap.gradient", "places"), ("HeightMap.normal", "places"), ("HeightMap.ball", "places"),
    ("Leg.forward", "q"), ("Leg.jacobian", "q"), ("Leg.jacobian_rate", "q"),
    ("Leg.jacobian_rate", "rates"), ("Leg.inverse", "point"), ("Leg.length", "point"),
    ("Leg.shortfall", "point"), ("Leg.joint_points", "q"), ("Leg.gap_in_words", "point"),
    ("GroundLayers.footing", "place"), ("Obstacle.contains", "points"),
    ("Obstacle.distance", "points"), ("Obstacle.height_at", "places"),
    ("Obstacle.section_distance", "x"), ("Obstacle.section_distance", "z"),
    ("Obstacle.to_local", "points"), ("Obstacle.to_world", "points"),
}  # fmt: skip
"""Arguments in which NaN has a meaning: heights that nobody knows, places off the map, and angles
and places of legs, which give NaN again."""
MEANT: Final = {
    ("RouteSettings", "free", "empty list"), ("Freedoms.of", "given", "empty list"),
    ("HeightMap", "z", "masked (4, 3)"),
}  # fmt: skip
"""Wrong values with a meaning: plan files have a list of what is free, and nothing may be; ground
behind a mask is unknown."""
TEXTS: Final = ("text", "long text", "empty text", "path", "null text", "bytes")
SLOW: Final = ("plan_stride", "simulate", "save_figures", "compare")
"""Calls that take seconds where a wrong value is accepted."""


def cases() -> list[tuple[str, str, str]]:
    """All cases: call, argument, and name of the wrong value."""
    return [(name, argument, wrong)
            for name, (_, arguments) in calls().items() for argument in arguments
            for wrong in WRONG]  # fmt: skip


def run(case: tuple[str, str, str]) -> Outcome:
    """Put one wrong value into one call."""
    name, argument, wrong = case
    function, arguments = calls()[name]
    value = WRONG[wrong]()
    given = {**arguments, argument: value}
    hint = _hint(function, argument)
    never = _never(hint, arguments[argument], (name, argument))

    def nonsense(result: Any) -> str:
        if wrong in never and case not in MEANT:
            return f"{wrong} is no {hint or type(arguments[argument]).__name__}"
        if (name, argument) not in UNKNOWN_ALLOWED and holds_nan(result) and _new_nan(name):
            return "a number of the result is none"
        return ""

    del function
    return outcome(lambda: _called(name, given), nonsense)


def _called(name: str, given: Mapping[str, Any]) -> Any:
    function: Callable[..., Any] = calls()[name][0]
    owner = getattr(function, "__self__", None)
    if isinstance(owner, GaitStateMachine):
        # It remembers what happened: each case has its own.
        function = getattr(deepcopy(owner), function.__name__)
    return function(**given)


def _new_nan(name: str) -> bool:
    """Whether the result of the call without a fault holds only numbers."""
    if name not in _sound:
        kept = name not in SLOW and name not in ("view", "replay_video")
        found = outcome(lambda: _called(name, calls()[name][1]), lambda r: "nan" * holds_nan(r))
        _sound[name] = kept and found.kind == OK
    return _sound[name]


_sound: dict[str, bool] = {}


def _never(hint: str, good: Any, where: tuple[str, str]) -> tuple[str, ...]:
    """Names of the wrong values that this argument can never be."""
    if where in UNKNOWN_ALLOWED:
        return tuple(name for name in NEVER_NUMBERS if "nan" not in name)
    if hint in ("Any", "object"):
        return ()
    if isinstance(good, (bool, np.bool_)) or hint.startswith("Callable"):
        return ()
    number = any(word in hint for word in ("float", "int", "Array"))
    if number and not any(word in hint for word in ("str", "Mapping", "Path", "Iterable")):
        return NEVER_NUMBERS
    if hint and hint[0].isupper() and type(good).__name__ in hint:
        return tuple(n for n in NEVER_OBJECTS if not ("Mapping" in hint and "dict" in n))
    return ()


def _hint(function: Callable[..., Any], argument: str) -> str:
    parameter = inspect.signature(function).parameters.get(argument)
    if parameter is None or parameter.annotation is parameter.empty:
        return ""
    return str(parameter.annotation)
