"""Whether unknown ground lies under a box that leans, exactly.

The box around such a box reaches farther: under a trunk that is turned by 45 degrees by a third.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray

AT_ONCE = 400_000
"""Most pairs of a box and a cell that are looked at in one call of NumPy: some 50 MB."""


class Footprints(NamedTuple):
    """Boxes, seen from above.

    Attributes:
        middles: of the boxes ``(N, 2)`` [m].
        axes: half their sides along their axes, seen from above ``(N, 3, 2)`` [m].
        margins: how much farther the boxes may reach in any direction ``(N,)`` [m].
    """

    middles: FloatArray
    axes: FloatArray
    margins: FloatArray

    def chosen(self, which: slice) -> Footprints:
        """Some of the boxes."""
        return Footprints(self.middles[which], self.axes[which], self.margins[which])


def over_cells(boxes: Footprints, cells: BoolArray, size: float, origin: FloatArray) -> BoolArray:
    """Whether boxes are above any of the marked cells of a grid ``(N,)``.

    Two convex shapes are apart where their shadows on the normal of one of their edges are.

    Args:
        boxes: seen from above.
        cells: which cells are marked ``(nx, ny)``.
        size: of a cell [m].
        origin: lowest x and y of the first cell ``(2,)`` [m].
    """
    reach = np.abs(boxes.axes).sum(axis=1) + boxes.margins[:, None]
    first = np.floor((boxes.middles - reach - origin) / size).astype(int)
    count = np.ceil((boxes.middles + reach - origin) / size).astype(int) - first
    wide, deep = np.maximum(count.max(axis=0, initial=1), 1).tolist()
    out = np.zeros(len(first), dtype=np.bool_)
    many = max(AT_ONCE // (wide * deep), 1)
    for k in range(0, len(first), many):
        part = slice(k, k + many)
        i = first[part, 0, None, None] + np.arange(wide)[:, None]
        j = first[part, 1, None, None] + np.arange(deep)
        inside = (i >= 0) & (i < cells.shape[0]) & (j >= 0) & (j < cells.shape[1])
        marked = (
            inside & cells[np.clip(i, 0, cells.shape[0] - 1), np.clip(j, 0, cells.shape[1] - 1)]
        )
        row, a, b = np.nonzero(marked)
        places = origin + size * (np.stack([i[row, a, 0], j[row, 0, b]], axis=1) + 0.5)
        touched = ~_apart(boxes.chosen(part), row, places, size)
        out[k + row[touched]] = True
    return out


def _apart(boxes: Footprints, row: np.ndarray, places: FloatArray, size: float) -> BoolArray:
    """Whether boxes ``row (M,)`` and cells about ``places (M, 2)`` are apart ``(M,)``."""
    axes = boxes.axes[row]
    away = places - boxes.middles[row]
    sides = np.broadcast_to(np.eye(2), (len(row), 2, 2))
    edges = np.concatenate([np.stack([-axes[..., 1], axes[..., 0]], axis=-1), sides], axis=1)
    lengths = np.linalg.norm(edges, axis=-1, keepdims=True)
    # An axis that points straight up has no shadow, and tells nothing.
    normals = np.divide(edges, lengths, out=np.zeros_like(edges), where=lengths > 1e-12)
    box = np.abs(np.einsum("mnk,mak->mna", normals, axes)).sum(axis=-1)
    cell = 0.5 * size * np.abs(normals).sum(axis=-1)
    distance = np.abs(np.einsum("mnk,mk->mn", normals, away))
    return np.asarray((distance > box + cell + boxes.margins[row, None]).any(axis=1))
