"""Checks of arguments by their type hints: one means for all public functions.

``gaitopt.NAME`` is the function of that name behind :func:`checked`. Wrong types, NaN, texts in
place of numbers and lists of unequal lengths are refused before the function begins. Ranges and
shapes are the function's own matter. Inside the package functions are called without this.
"""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from functools import partial, wraps
from pathlib import Path
from typing import Any, Final, TypeVar, cast

from gaitopt.errors import InputError
from gaitopt.inputs import SOURCES, as_plain_array, as_text, is_real, is_whole

Test = Callable[[Any], bool]
Function = TypeVar("Function", bound=Callable[..., Any])

WIDEST: Final = 2**63
"""Whole numbers from this on are no numbers for arrays, which have 64 bits for each."""
LONGEST_PART: Final = 255
"""Most bytes of a name in a path: what file systems allow."""
KINDS: Final = frozenset({
    "CogProblem", "CogWorkspace", "ControlGains", "CrawlSettings", "Footholds",
    "ForceLimits", "Freedoms", "GaitSchedule", "GaitSettings", "HeightMap", "Obstacle",
    "Plan", "PostureProblem", "Quadruped", "RouteSettings", "SimulationSettings", "SpeedLp",
    "SplineProblem", "State", "StrideSettings", "TerrainSearch", "Trajectory",
})  # fmt: skip
"""Classes of gaitopt that stand in type hints. They are known by name: nothing is imported."""
OWN_CHECKS: Final = frozenset({"ax", "axes", "goal", "settings", "terrains"})
"""Arguments of which every function says more than a type hint does."""


def checked(function: Function, name: str = "") -> Function:
    """A function behind checks of its arguments; a decorator for methods that users call.

    Args:
        function: whose parameters have type hints.
        name: under which the result is public in ``gaitopt``; none for methods.
    """
    plain = inspect.signature(function, follow_wrapped=False)
    code = getattr(function, "__code__", None)
    own = plain.parameters if code is None else code.co_varnames
    tests = {
        p.name: (partial(_fits, _options(str(p.annotation))), str(p.annotation))
        for p in plain.parameters.values()
        if p.name in own
        and p.name not in OWN_CHECKS
        and p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL)
    }

    @wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            given = plain.bind(*args, **kwargs).arguments
        except TypeError:
            # An argument too many or too few: Python's own words, or those of the function.
            return function(*args, **kwargs)
        for key, value in given.items():
            default = plain.parameters[key].default
            if key in tests and value is not default and not tests[key][0](value):
                raise InputError(_words(key, value, tests[key][1]))
        return function(*args, **kwargs)

    if name:
        # The place where pickle finds it.
        call.__module__, call.__qualname__ = "gaitopt", name
    return cast("Function", call)


def _options(hint: str) -> list[str]:
    """The alternatives of a type hint, without quotation marks."""
    return _split(hint.replace("'", "").replace('"', ""), "|")


def _parts(inner: str) -> list[str]:
    """The types between commas."""
    return _split(inner, ",")


def _split(hint: str, separator: str) -> list[str]:
    """The parts of a type hint between separators that stand in no brackets."""
    parts, depth = [""], 0
    for letter in hint:
        depth += (letter == "[") - (letter == "]")
        if letter == separator and not depth:
            parts.append("")
        else:
            parts[-1] += letter
    return [part.strip() for part in parts if part.strip()]


def _fits(options: list[str], value: Any) -> bool:
    """Whether a value can be of one of these types."""
    return any(_is_one(option, value) for option in options)


def _is_one(option: str, value: Any) -> bool:
    base, _, inner = option.partition("[")
    base, inner = base.split(".")[-1], inner.removesuffix("]")
    if base in KINDS:
        return any(base == each.__name__ for each in type(value).__mro__)
    if base in _SIMPLE:
        return _SIMPLE[base](value)
    if base in ("Mapping", "dict"):
        kind = _parts(inner)[1:]
        return isinstance(value, Mapping) and (
            not kind or all(_fits(_options(kind[0]), each) for each in value.values())
        )
    if base == "tuple":
        return _is_tuple(_parts(inner), value)
    if base in ("Sequence", "Iterable", "list"):
        if not isinstance(value, Iterable) or isinstance(
            value, (str, bytes, bytearray, memoryview, Mapping, type)
        ):
            return False
        axes = getattr(value, "ndim", None)
        if axes == 0 or (base != "Iterable" and isinstance(value, Set)):
            return False
        # What can be gone through only once is left alone.
        known = axes is not None or isinstance(value, Sequence)
        kinds = _parts(inner) if known else []
        return not kinds or all(_fits(_options(kinds[0]), item) for item in value)
    return True


def _is_tuple(kinds: list[str], value: Any) -> bool:
    """Whether a value can be this tuple. Lists and arrays count; sets have no order."""
    if isinstance(value, (str, bytes, bytearray, memoryview, Mapping, Set)):
        return False
    try:
        items = list(value)
    except TypeError:
        return False
    if kinds[-1:] == ["..."]:
        return all(_fits(_options(kinds[0]), item) for item in items)
    return len(items) == len(kinds) and all(
        _fits(_options(kind), item) for kind, item in zip(kinds, items, strict=True)
    )


def _is_number(value: Any) -> bool:
    """Whether a value is a real number, and not NaN."""
    if isinstance(value, int) and abs(value) >= WIDEST:
        return False
    return is_real(value) and bool(value == value)


def _is_true_or_false(value: Any) -> bool:
    import numpy as np

    return isinstance(value, (bool, np.bool_))


def _is_array(value: Any) -> bool:
    """Whether a value can become an array of real numbers, none of them NaN."""
    import numpy as np

    raw = as_plain_array(value)
    if raw is None:
        return False
    if raw.dtype.kind not in "biuf" and raw.size:
        return False
    return not (raw.dtype.kind == "f" and bool(np.isnan(raw).any()))


def _is_function(value: Any) -> bool:
    """Whether a value can be called; a class would make an object of what it is told."""
    return callable(value) and not isinstance(value, type)


def _takes_two(value: Any) -> bool:
    """Whether a value can be called with two arguments; not all functions tell what they take."""
    if not _is_function(value):
        return False
    try:
        inspect.signature(value).bind(1, 2)
    except TypeError:
        return False
    except ValueError:
        pass
    return True


def _is_text_or_path(value: Any) -> bool:
    return isinstance(value, (str, os.PathLike)) and "\0" not in str(value) and str(value) != ""


def _is_path(value: Any) -> bool:
    if not _is_text_or_path(value):
        return False
    try:
        return all(len(os.fsencode(part)) <= LONGEST_PART for part in Path(value).parts)
    except UnicodeEncodeError:
        return False


_SIMPLE: Final[Mapping[str, Test]] = {
    "None": lambda value: value is None,
    "float": _is_number,
    "int": is_whole,
    "bool": _is_true_or_false,
    "str": lambda value: isinstance(value, str),
    "Literal": lambda value: isinstance(value, str),
    "StrPath": _is_path,
    "RobotSource": _is_text_or_path,
    "Path": _is_path,
    "ArrayLike": _is_array,
    "FloatArray": _is_array,
    "BoolArray": _is_array,
    "Objective": lambda value: isinstance(value, str),
    # Protocols, by what they are first asked for.
    "GroundSearch": lambda value: hasattr(value, "footholds"),
    "SimulatedWalk": lambda value: hasattr(value, "motion"),
    "Columns": lambda value: hasattr(value, "radius") and hasattr(value, "touching"),
    "Callable": _is_function,
    "Progress": _takes_two,
}
_CALLED: Final = {
    "float": "a number", "int": "a whole number", "bool": "True or False", "str": "a text",
    "Literal": "a text", "Objective": "a text", "GroundSearch": "a search for footholds",
    "SimulatedWalk": "a SimulationResult", "Columns": "Footholds",
    "StrPath": "a path", "Path": "a path",
    "RobotSource": "a name, a path or the text of a file",
    "ArrayLike": "finite numbers",
    "FloatArray": "finite numbers", "BoolArray": "numbers", "Callable": "a function",
    "Progress": "a function of two numbers", "Mapping": "a mapping", "dict": "a mapping",
    "Sequence": "a sequence", "Iterable": "a sequence", "tuple": "a tuple", "list": "a list",
}  # fmt: skip


def _words(name: str, value: Any, hint: str) -> str:
    """What a message says of a wrong value."""
    bases = [option.partition("[")[0].split(".")[-1] for option in _options(hint)]
    wanted = [_CALLED.get(base, f"a {base}") for base in bases if base != "None"]
    kinds = [base for base in bases if base in KINDS]
    shown = f"a {type(value).__name__}" if kinds else as_text(value)
    source = next((f"; {SOURCES[base]}" for base in kinds if base in SOURCES), "")
    return f"{name} must be {' or '.join(dict.fromkeys(wanted))}, got {shown}{source}"
