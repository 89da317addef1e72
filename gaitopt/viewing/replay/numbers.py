"""Many numbers as short text, which the page's script reads back (``scripts/numbers.js``).

Numbers are multiples of a unit. Each column is written as differences of neighbours, a difference
as few bytes as it needs (7 bits each), and the bytes in base64. Keyframes take a third of the room
of 32-bit floats that way.
"""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
from numpy.typing import ArrayLike


def packed(values: ArrayLike, unit: float) -> dict[str, Any]:
    """Numbers ``(n,)`` or ``(n, c)`` for the page's script, within half a ``unit``.

    Returns:
        ``rows``, ``columns``, ``unit``, and ``bytes``: the columns one after the other, in base64.
    """
    table = np.asarray(values, dtype=np.float64)
    table = table[:, None] if table.ndim == 1 else table
    whole = np.rint(table / unit).astype(np.int64).T
    steps = np.diff(whole, axis=1, prepend=0).ravel()
    # The sign goes into the lowest bit, so that small differences of both signs are small numbers.
    data = _varied(np.where(steps < 0, -2 * steps - 1, 2 * steps).astype(np.uint64))
    return {
        "rows": len(table),
        "columns": table.shape[1],
        "unit": unit,
        "bytes": base64.b64encode(data.tobytes()).decode("ascii"),
    }


def as_text(numbers: Any, kind: str) -> str:
    """Numbers of a ``kind`` of NumPy, row by row, in base64."""
    return base64.b64encode(np.asarray(numbers).astype(kind).tobytes()).decode("ascii")


def _varied(numbers: np.ndarray) -> np.ndarray:
    """Bytes of whole numbers, lowest 7 bits first; the highest bit says that more follow."""
    longest = max(-(-int(numbers.max(initial=0)).bit_length() // 7), 1)
    shifts = np.arange(longest, dtype=np.uint64) * np.uint64(7)
    parts = numbers[:, None] >> shifts
    more = parts[:, 1:] > 0
    used = np.concatenate([np.ones((len(numbers), 1), dtype=np.bool_), more], axis=1)
    last = np.concatenate([~more, np.ones((len(numbers), 1), dtype=np.bool_)], axis=1)
    low = (parts & np.uint64(127)) | np.where(last, np.uint64(0), np.uint64(128))
    return np.asarray(low[used], dtype=np.uint8)
