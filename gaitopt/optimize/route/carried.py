"""Multipliers of a solved problem for the same walk with more rows on single poses."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.band import RowGroups
from gaitopt.optimize.route.layout import RouteLayout
from gaitopt.optimize.route.legs import JOINTS


def carried_multipliers(old: RouteLayout, new: RouteLayout, multipliers: FloatArray) -> FloatArray:
    """The multipliers of a problem, put where its rows are in another one ``(m,)``.

    At each knot the other problem has the same rows on its pose in the same order, and perhaps more
    after them. These get zeros, which say that nothing is known of them.

    Args:
        old: the problem that was solved.
        new: the other one.
        multipliers: of the old one's rows.
    """
    before = 2 * (old.knots - 1) * JOINTS
    before += int(old.used_limits.sum()) * (old.knots - old.fixed_knots)
    after = before + len(old.row_order)
    unsorted = np.empty(len(old.row_order))
    unsorted[old.row_order] = multipliers[before:after]
    rows = len(old.rows.knot)
    single = _by_knot(old.rows.knot, new.rows.knot, unsorted[:rows], new.knots)
    if old.com is not None and new.com is not None:
        of_com = _by_knot(old.com.knot, new.com.knot, unsorted[rows:], new.knots)
        single = np.concatenate([single, of_com])
    return np.concatenate([multipliers[:before], single[new.row_order], multipliers[after:]])


def _by_knot(old: np.ndarray, new: np.ndarray, values: FloatArray, knots: int) -> FloatArray:
    """Values of rows for other rows: the n-th of a knot goes to its n-th, the rest are zeros.

    Args:
        old, new: knots of both rows, ascending.
        values: of the old ones.
        knots: how many there are.
    """
    here, there = RowGroups.of(old, knots), RowGroups.of(new, knots)
    out = np.zeros((knots, max(here.shape[1], there.shape[1])))
    out[here.group, here.place] = values
    return np.asarray(out[there.group, there.place])
