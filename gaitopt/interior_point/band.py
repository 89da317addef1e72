"""Where rows and blocks go: sums over each knot's rows, and matrices in banded form."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray


class Slots(NamedTuple):
    """Lays out rows by their knots, so that sums over each knot's rows are matrix products.

    Attributes:
        knot: of each row ``(M,)``, ascending.
        slot: its number among its knot's rows ``(M,)``.
        shape: knots, and most rows of any.
    """

    knot: np.ndarray
    slot: np.ndarray
    shape: tuple[int, int]

    @classmethod
    def of(cls, knot: np.ndarray, knots: int) -> Slots:
        """From each row's knot, ascending."""
        first = np.searchsorted(knot, knot, side="left")
        slot = np.arange(len(knot)) - first
        return cls(knot, slot, (knots, int(slot.max(initial=0)) + 1))

    def spread(self, rows: FloatArray) -> FloatArray:
        """``rows (M, ...)`` as ``(knots, most, ...)``, with zeros where there is none."""
        out = np.zeros((*self.shape, *rows.shape[1:]))
        out[self.knot, self.slot] = rows
        return out


class Band(NamedTuple):
    """Scatters blocks of intervals into the lower band of a symmetric matrix.

    Attributes:
        source: entries of the flattened blocks that are used.
        target: their places in the flattened band.
        shape: of the band, ``(width, size)``.
        where: unknown of each row of each block ``(K - 1, b)``, -1 where there is none.
    """

    source: np.ndarray
    target: np.ndarray
    shape: tuple[int, int]
    where: np.ndarray

    @classmethod
    def of(cls, where: np.ndarray, size: int) -> Band:
        """From the unknowns that each block's rows belong to."""
        row, column = where[:, :, None], where[:, None, :]
        used = (row >= column) & (column >= 0)
        source = np.flatnonzero(used)
        down = np.broadcast_to(row - column, used.shape).reshape(-1)[source]
        across = np.broadcast_to(column, used.shape).reshape(-1)[source]
        width = int(down.max(initial=0)) + 1
        return cls(source, down * size + across, (width, size), where)

    def matrix(self, blocks: FloatArray) -> FloatArray:
        """Sum of ``blocks (K - 1, b, b)`` in LAPACK's lower banded form ``(width, size)``."""
        flat = np.bincount(
            self.target, blocks.reshape(-1)[self.source], minlength=self.shape[0] * self.shape[1]
        )
        return np.asarray(flat.reshape(self.shape))
