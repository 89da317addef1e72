"""The largest number in any rectangle of a table, from maxima of square blocks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import FloatArray

LARGEST = 7
"""Largest block: 2 to this power points along each side. Chosen: 2.6 m of a map of 2 cm, longer
than a robot; larger rectangles take several blocks."""


@dataclass(frozen=True, eq=False)
class BlockMaxima:
    """Maxima of all square blocks whose side is a power of two.

    Attributes:
        levels: ``levels[k][i, j]`` is the maximum of the block of ``2^k`` by ``2^k`` numbers that
            begins at ``(i, j)``.
    """

    levels: tuple[FloatArray, ...]

    @classmethod
    def of(cls, table: FloatArray) -> BlockMaxima:
        """The maxima of a table ``(nx, ny)``."""
        levels = [table]
        for k in range(LARGEST):
            step, last = 2**k, levels[-1]
            if min(last.shape) <= step:
                break
            rows = np.maximum(last[:-step], last[step:])
            levels.append(np.maximum(rows[:, :-step], rows[:, step:]))
        return cls(tuple(levels))

    def over(self, first: np.ndarray, end: np.ndarray) -> FloatArray:
        """Maxima over rectangles ``(N,)``.

        Blocks as wide as the smaller side of a rectangle, or nearly so, are laid along it.

        Args:
            first, end: begin and end of the rectangles, the end not counted ``(N, 2)``; they are
                not empty and within the table.
        """
        sizes = end - first
        smaller = np.minimum(sizes[:, 0], sizes[:, 1])
        level = np.minimum(np.log2(smaller).astype(int), len(self.levels) - 1)
        out = np.full(len(first), -np.inf)
        for k in np.flatnonzero(np.bincount(level)).tolist():
            of = np.flatnonzero(level == k)
            side, table = 2**k, self.levels[k]
            (i, j), (i_end, j_end) = first[of].T, end[of].T - side
            rows, columns = (-(-int(part.max()) // side) for part in sizes[of].T)
            found = np.full(len(of), -np.inf)
            for a in range(rows):
                row = np.minimum(i + a * side, i_end)
                for b in range(columns):
                    np.maximum(found, table[row, np.minimum(j + b * side, j_end)], out=found)
            out[of] = found
        return out
