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
        level = np.minimum(np.log2(sizes.min(axis=1)).astype(int), len(self.levels) - 1)
        out = np.full(len(first), -np.inf)
        for k in np.unique(level).tolist():
            of = np.flatnonzero(level == k)
            side, table = 2**k, self.levels[k]
            counts = -(-sizes[of] // side)
            rows, columns = counts.max(axis=0).tolist()
            for a in range(rows):
                i = np.minimum(first[of, 0] + a * side, end[of, 0] - side)
                for b in range(columns):
                    j = np.minimum(first[of, 1] + b * side, end[of, 1] - side)
                    out[of] = np.maximum(out[of], table[i, j])
        return out
