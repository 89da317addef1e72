"""Tables with a few rows for each place: points and half-planes of the plane.

Rows stand first, and zeros for none behind them.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray


def appended(
    table: np.ndarray, places: np.ndarray, added: np.ndarray, like: np.ndarray | None = None
) -> np.ndarray:
    """Tables ``(N, M, k)`` with more rows ``(P, k)``, of places that may repeat.

    Args:
        table: its rows stand first, and zeros for none behind them.
        places: of the rows ``(P,)``.
        added: the rows.
        like: the table of which rows are there, if it is another one.
    """
    if not len(places):
        return table
    order = np.argsort(places, kind="stable")
    places, added = places[order], added[order]
    starts = np.flatnonzero(np.concatenate([[True], np.diff(places) > 0]))
    rank = np.arange(len(places)) - np.repeat(starts, np.diff(np.append(starts, len(places))))
    column = used(table if like is None else like).sum(axis=1)[places] + rank
    most = max(int(column.max()) + 1, table.shape[1])
    wide = np.zeros((len(table), most, table.shape[2]), dtype=table.dtype)
    wide[:, : table.shape[1]] = table
    wide[places, column] = added
    return wide


def used(table: FloatArray) -> BoolArray:
    """Which of the sides or points ``(N, M, 2)`` are there ``(N, M)``."""
    return np.asarray((table[..., 0] != 0.0) | (table[..., 1] != 0.0))
