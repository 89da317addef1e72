"""What becomes of a case, and how a value that is no number is found in a result."""

from __future__ import annotations

import dataclasses
import traceback
from collections.abc import Callable, Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from gaitopt import GaitoptError

REFUSED, OK, FOREIGN, NONSENSE, HANG, HALF, DIED = (
    "refused", "accepted", "foreign exception", "silent nonsense", "hang", "half file", "died"
)  # fmt: skip
FAULTS: Final = (FOREIGN, NONSENSE, HANG, HALF, DIED)


class Outcome(NamedTuple):
    """What became of a case: one of the words above, and why."""

    kind: str
    words: str = ""


def outcome(call: Callable[[], Any], nonsense: Callable[[Any], str]) -> Outcome:
    """Run a case.

    Args:
        call: the case.
        nonsense: says what is wrong with a result, or nothing.
    """
    try:
        result = call()
    except GaitoptError as error:
        return Outcome(REFUSED, str(error)) if str(error) else Outcome(FOREIGN, "no message")
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)
        ours = [f for f in where if "gaitopt/" in f.filename] or where
        last = f"{ours[-1].filename.split('gaitopt/')[-1]}:{ours[-1].lineno}"
        return Outcome(FOREIGN, f"{type(error).__name__}: {str(error)[:120]} ({last})")
    wrong = nonsense(result)
    return Outcome(NONSENSE, wrong) if wrong else Outcome(OK)


def holds_nan(value: Any, depth: int = 0) -> bool:
    """Whether a number that is none lies in a result, also in the fields of dataclasses."""
    if isinstance(value, (float, np.floating)):
        return bool(np.isnan(value))
    if isinstance(value, np.ndarray):
        return value.dtype.kind == "f" and bool(np.isnan(value).any())
    if depth > 4 or isinstance(value, (str, bytes)):
        return False
    if isinstance(value, Mapping):
        return any(holds_nan(v, depth + 1) for v in value.values())
    if isinstance(value, (list, tuple)):
        return any(holds_nan(v, depth + 1) for v in value)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return any(holds_nan(getattr(value, f.name, None), depth + 1)
                   for f in dataclasses.fields(value))  # fmt: skip
    return False
