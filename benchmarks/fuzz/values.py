"""Values that hardly any argument can be."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np

NAN: Final = float("nan")

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
    "dict of nans": lambda: {leg: [NAN, NAN, NAN] for leg in ("LF", "LH", "RH", "RF")},
    "dict of texts": lambda: dict.fromkeys(("LF", "LH", "RH", "RF"), "x"),
})  # fmt: skip
"""Wrong values by name. Where one happens to be right, a call with it is no fault."""

NEVER_NUMBERS: Final = (
    "nan", "complex", "text", "empty text", "null text", "long text", "bytes", "object", "type",
    "function", "path", "list of texts", "list of None", "ragged list", "dict", "set", "nans (2)",
    "nans (3)", "nans (4, 3)", "texts", "objects", "nan 0-d", "dict of nans", "dict of texts",
)  # fmt: skip
"""Those that no argument which is a number, or an array of numbers, can be."""
NEVER_OBJECTS: Final = tuple(name for name in WRONG if name != "None")
"""Those that no argument which is an object of gaitopt can be."""
