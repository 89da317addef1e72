"""Values that hardly any argument can be."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from decimal import Decimal
from enum import IntEnum
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np

NAN: Final = float("nan")


class Colour(IntEnum):
    """Whole numbers that mean something else."""

    RED = 1


class Evil:
    """Nothing can be done with this: it cannot even be shown."""

    def __repr__(self) -> str:
        raise RuntimeError("no words")

    def __float__(self) -> float:
        raise RuntimeError("no number")

    def __array__(self, *_: object, **__: object) -> Any:
        raise RuntimeError("no array")

    def __len__(self) -> int:
        raise RuntimeError("no length")


def _itself() -> list[Any]:
    own: list[Any] = []
    own.append(own)
    return own


def _deep() -> list[Any]:
    deep: list[Any] = [1.0]
    for _ in range(200):
        deep = [deep]
    return deep


def _masked(*shape: int) -> Any:
    """Numbers of which the first is hidden: whoever takes it takes 1e20."""
    values = np.ma.masked_array(np.full(shape, 0.1), np.zeros(shape, np.bool_))
    values[(0,) * len(shape)] = np.ma.masked
    return values


WRONG: Final[MappingProxyType[str, Callable[[], Any]]] = MappingProxyType({
    "None": lambda: None,
    "True": lambda: True,
    "nan": lambda: NAN,
    "inf": lambda: float("inf"),
    "-inf": lambda: float("-inf"),
    "-1": lambda: -1,
    "0": lambda: 0,
    "1e300": lambda: 1e300,
    "2**70": lambda: 2**70,
    "complex": lambda: 1j,
    "text": lambda: "nonsense",
    "empty text": lambda: "",
    "null text": lambda: "a\0b",
    "long text": lambda: "x" * 5000,
    "bytes": lambda: b"bytes",
    "object": object,
    "type": lambda: int,
    "function": lambda: len,
    "path": lambda: Path("/nonexistent/file"),
    "empty list": list,
    "empty dict": dict,
    "list of texts": lambda: ["a", "b"],
    "list of None": lambda: [None, None],
    "ragged list": lambda: [[1.0], [1.0, 2.0]],
    "dict": lambda: {"LF": "x", 3: None},
    "set": lambda: {1, 2},
    "nans (2)": lambda: [NAN, NAN],
    "nans (3)": lambda: np.full(3, NAN),
    "nans (4, 3)": lambda: np.full((4, 3), NAN),
    "infs (4, 3)": lambda: np.full((4, 3), np.inf),
    "zeros (5, 3)": lambda: np.zeros((5, 3)),
    "ones (2, 4, 2)": lambda: np.ones((2, 4, 2)),
    "zeros (7, 5)": lambda: np.zeros((7, 5)),
    "zeros (0,)": lambda: np.zeros(0),
    "zeros (0, 3)": lambda: np.zeros((0, 3)),
    "texts": lambda: np.array(["a", "b"]),
    "objects": lambda: np.array([None, {}], dtype=object),
    "nan 0-d": lambda: np.array(NAN),
    "frozenset": lambda: frozenset({0.1, 0.2}),
    "set of three": lambda: {0.1, 0.2, 0.3},
    "generator": lambda: (x for x in (0.1, 0.2, 0.3)),
    "range": lambda: range(3),
    "deque": lambda: deque([0.1, 0.2]),
    "bytearray": lambda: bytearray(b"ab"),
    "memoryview": lambda: memoryview(b"abc"),
    "Decimal": lambda: Decimal("0.1"),
    "Decimal nan": lambda: Decimal("nan"),
    "whole number of an enumeration": lambda: Colour.RED,
    "evil": Evil,
    "list of itself": _itself,
    "deep list": _deep,
    "huge whole numbers": lambda: [2**70, 1, 1],
    "beyond all floats": lambda: 10**400,
    "time": lambda: np.datetime64("2026-11-30"),
    "times (3)": lambda: np.array(["2026-11-30"] * 3, "datetime64[s]"),
    "span": lambda: np.timedelta64(5, "s"),
    "spans (3)": lambda: np.array([1, 2, 3], "timedelta64[s]"),
    "complex (3)": lambda: np.full(3, 1j),
    "complex (4, 3)": lambda: np.full((4, 3), 1j),
    "flags (3)": lambda: np.ones(3, np.bool_),
    "masked (2)": lambda: _masked(2),
    "masked (3)": lambda: _masked(3),
    "masked (4, 3)": lambda: _masked(4, 3),
    "masked number": lambda: np.ma.masked,
    "matrix (1, 3)": lambda: np.asmatrix([0.1, 0.2, 0.3]),
    "records (3)": lambda: np.zeros(3, [("x", float)]),
    "object 0-d": lambda: np.array({"a": 1}, dtype=object),
    "infs (2)": lambda: np.full(2, np.inf),
    "infs (3)": lambda: np.full(3, np.inf),
    "infs (12)": lambda: np.full(12, np.inf),
    "huge (3)": lambda: np.full(3, 1e300),
    "tiny (3)": lambda: np.full(3, 5e-324),
    "frame": lambda: _pandas().DataFrame({"a": [0.1, 0.2]}),
    "series": lambda: _pandas().Series([0.1, 0.2, 0.3], index=[2, 1, 0]),
    "surrogate": lambda: "a\ud800b",
    "device": lambda: Path("/dev/full"),
    "folder": lambda: Path("/"),
    "dict of nans": lambda: {leg: [NAN, NAN, NAN] for leg in ("LF", "LH", "RH", "RF")},
    "dict of texts": lambda: dict.fromkeys(("LF", "LH", "RH", "RF"), "x"),
})  # fmt: skip
"""Wrong values by name. Where one happens to be right, a call with it is no fault."""


def _pandas() -> Any:
    import pandas

    return pandas


NEVER_NUMBERS: Final = (
    "nan", "complex", "text", "empty text", "null text", "long text", "bytes", "object", "type",
    "function", "path", "list of texts", "list of None", "ragged list", "dict", "set", "nans (2)",
    "nans (3)", "nans (4, 3)", "texts", "objects", "nan 0-d", "dict of nans", "dict of texts",
    "frozenset", "set of three", "bytearray", "memoryview", "Decimal nan", "evil",
    "list of itself", "deep list", "beyond all floats", "time", "times (3)", "span", "spans (3)",
    "complex (3)", "complex (4, 3)", "masked (2)", "masked (3)", "masked (4, 3)", "masked number",
    "records (3)", "object 0-d", "surrogate", "device", "folder",
)  # fmt: skip
"""Those that no argument which is a number, or an array of numbers, can be."""
NEVER_OBJECTS: Final = tuple(name for name in WRONG if name != "None")
"""Those that no argument which is an object of gaitopt can be."""
