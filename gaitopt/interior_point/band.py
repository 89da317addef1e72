"""Sums over groups of rows, and symmetric matrices in banded form, without Python loops."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray


class RowGroups(NamedTuple):
    """Rows of inequalities by their group, so that sums over a group are matrix products.

    Attributes:
        group: of each row ``(M,)``, ascending.
        place: its number within its group ``(M,)``, from 0.
        shape: number of groups, and of rows in the largest.
    """

    group: np.ndarray
    place: np.ndarray
    shape: tuple[int, int]

    @classmethod
    def of(cls, group: np.ndarray, groups: int) -> RowGroups:
        """Number the rows of each group.

        Args:
            group: of each row ``(M,)``, ascending.
            groups: how many there are, those without rows included.
        """
        first = np.searchsorted(group, group, side="left")
        place = np.arange(len(group)) - first
        return cls(group, place, (groups, int(place.max(initial=0)) + 1))

    def padded(self, rows: FloatArray) -> FloatArray:
        """``rows (M, ...)`` as ``(groups, most rows, ...)``, filled up with zeros."""
        out = np.zeros((*self.shape, *rows.shape[1:]))
        out[self.group, self.place] = rows
        return out


class BlockBand(NamedTuple):
    """Adds up symmetric blocks in the lower band of a symmetric matrix.

    Attributes:
        source: numbers of the used entries of all flattened blocks.
        target: their places in the flattened band.
        shape: of the band, ``(width, n)``.
    """

    source: np.ndarray
    target: np.ndarray
    shape: tuple[int, int]

    @classmethod
    def of(cls, unknowns: np.ndarray, size: int) -> BlockBand:
        """Find out where the entries of blocks go.

        Args:
            unknowns: number of the unknown that each row of each block belongs to ``(B, b)``; -1
                where it belongs to none. An unknown may stand twice in a block.
            size: number of unknowns ``n``.
        """
        row, column = unknowns[:, :, None], unknowns[:, None, :]
        used = (row >= column) & (column >= 0)
        source = np.flatnonzero(used)
        below = np.broadcast_to(row - column, used.shape).reshape(-1)[source]
        across = np.broadcast_to(column, used.shape).reshape(-1)[source]
        width = int(below.max(initial=0)) + 1
        return cls(source, below * size + across, (width, size))

    def matrix(self, blocks: FloatArray) -> FloatArray:
        """Sum of ``blocks (B, b, b)`` in LAPACK's form ``(width, n)``.

        Row ``d`` of the result holds the entries ``d`` below the diagonal, column by column.
        """
        flat = np.bincount(
            self.target, blocks.reshape(-1)[self.source], minlength=self.shape[0] * self.shape[1]
        )
        return np.asarray(flat.reshape(self.shape))


def symmetric_times(band: FloatArray, x: FloatArray) -> FloatArray:
    """The product of a symmetric matrix and ``x (n,)``.

    Args:
        band: the matrix's lower band in LAPACK's form ``(width, n)``.
        x: the vector.
    """
    out = band[0] * x
    for below in range(1, len(band)):
        entries = band[below, :-below]
        out[below:] += entries * x[:-below]
        out[:-below] += entries * x[below:]
    return np.asarray(out)
