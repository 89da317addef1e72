"""The same numbers in another form: the result is the same, or they are refused.

Arrays of other programs are read-only, have another order of bytes or of axes, or a type of their
own. Whoever takes them has to take the same numbers.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping
from fractions import Fraction
from functools import cache
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from benchmarks.fuzz.calls import calls
from benchmarks.fuzz.outcome import Outcome, outcome

SLOW: Final = ("plan_", "plot_", "choose_", "search_", "retimed", "feasible_", "explore", "save_",
               "replay", "contact_", "simulate", "compare", "show", "verify", "export")  # fmt: skip
"""How the names of calls begin that take long; their arguments are no arrays, or places."""


class Special(np.ndarray):
    """An array of a class of its own, of which nothing is known."""


def _every_other(array: Any) -> Any:
    """The same numbers, between which others lie."""
    wide = np.full((*array.shape[:-1], 2 * array.shape[-1]), np.nan)
    wide[..., ::2] = array
    return wide[..., ::2]


def _read_only(array: Any) -> Any:
    copy = array.copy()
    copy.setflags(write=False)
    return copy


def _objects(array: Any) -> Any:
    return array.astype(object)


def _frame(array: Any) -> Any:
    import pandas

    if array.ndim == 1:
        return pandas.Series(array, index=range(len(array), 0, -1))
    return pandas.DataFrame(array) if array.ndim == 2 else array.tolist()


FORMS: Final[Mapping[str, Callable[[Any], Any]]] = MappingProxyType({
    "list": lambda a: a.tolist(),
    "tuples": lambda a: tuple(map(tuple, a.tolist())) if a.ndim == 2 else tuple(a.tolist()),
    "bytes in another order": lambda a: a.astype(">f8"),
    "axes in another order": np.asfortranarray,
    "backwards in memory": lambda a: a[..., ::-1].copy()[..., ::-1],
    "every other number": _every_other,
    "read-only": _read_only,
    "objects": _objects,
    "fractions": lambda a: np.array([Fraction(float(x)) for x in a.flat], object).reshape(a.shape),
    "long floats": lambda a: a.astype(np.longdouble),
    "a class of its own": lambda a: a.view(Special),
    "nothing masked": lambda a: np.ma.masked_array(a, np.zeros(a.shape, np.bool_)),
    "pandas": _frame,
    "memory": lambda a: memoryview(np.ascontiguousarray(a)),
})  # fmt: skip
"""Other forms of an array of floats, by name."""


def cases() -> list[tuple[str, str, str]]:
    """All cases: call, argument that is an array of numbers, and form."""
    return [(name, argument, form)
            for name, (_, arguments) in calls().items() if not name.startswith(SLOW)
            for argument, value in arguments.items() if _numbers(value) is not None
            for form in FORMS]  # fmt: skip


def run(case: tuple[str, str, str]) -> Outcome:
    """Call with the numbers as they are, and in another form."""
    name, argument, form = case
    function, arguments = calls()[name]
    plain = _plain(name)
    given = {**arguments, argument: FORMS[form](_numbers(arguments[argument]))}
    return outcome(lambda: function(**given),
                   lambda found: "" if same(plain, found) else "another result")  # fmt: skip


@cache
def _plain(name: str) -> Any:
    """The result of a call without a fault."""
    function, arguments = calls()[name]
    return function(**arguments)


def _numbers(value: Any) -> Any:
    """An argument as an array of floats; ``None`` where it is none."""
    if not isinstance(value, (np.ndarray, list, tuple)) or not len(value):
        return None
    try:
        array = np.asarray(value)
    except ValueError:
        return None
    return array.astype(np.float64) if array.dtype.kind in "iuf" and array.ndim else None


def same(one: Any, other: Any, depth: int = 0) -> bool:
    """Whether two results hold the same numbers, to rounding."""
    if isinstance(one, (np.ndarray, float, int)) and not isinstance(one, bool):
        if isinstance(one, np.ndarray) and type(one) is not type(other):
            return False
        if isinstance(one, np.ndarray) and one.dtype.kind not in "biuf":
            return True
        return bool(np.allclose(one, other, rtol=1e-12, atol=1e-12, equal_nan=True))
    if isinstance(one, Mapping):
        return list(one) == list(other) and all(same(one[k], other[k], depth + 1) for k in one)
    if isinstance(one, (list, tuple)):
        return len(one) == len(other) and all(
            same(a, b, depth + 1) for a, b in zip(one, other, strict=True)
        )
    if dataclasses.is_dataclass(one) and not isinstance(one, type) and depth < 5:
        return type(one) is type(other) and all(
            same(getattr(one, f.name), getattr(other, f.name), depth + 1)
            for f in dataclasses.fields(one)
        )
    return True
