"""Many small programs of one size, solved one by one and judged together.

DAQP [Arnstrom2022] takes 10 to 20 us for one of them, and a judgement of its answer in Python
several times as much. So the answers are judged by a few operations on arrays over all programs.
As in :mod:`gaitopt.dynamics.small_programs` no status of the solver is believed: a solution of a
quadratic program counts if it keeps all rows, and one of a linear program if multipliers prove it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import repeat
from typing import Final, NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.small_programs import (
    LINEAR_WEIGHT,
    NO_BOUND,
    PROGRAM_TOLERANCE,
    PROOF_TOLERANCE,
    ROW_TOLERANCE,
    SOLVER_TOLERANCE,
)

WEIGHT: Final = 1e-9
"""Weight of the squared unknowns, which makes a solution unique. Of 171,000 programs along the
walks of three robots all are proven with 1e-7 to 1e-10, and 48 are not with 1e-11."""


class LinearSolutions(NamedTuple):
    """Last points of linear programs.

    Attributes:
        points: ``(N, n)``.
        multipliers: of the rows ``(N, m)``: positive at their upper limit, negative at their lower
            one, and zero where a row holds nothing back.
        proven: points that keep all rows and are minimisers, by their multipliers ``(N,)``.
    """

    points: FloatArray
    multipliers: FloatArray
    proven: BoolArray


def solve_linear_programs(
    costs: FloatArray, rows: FloatArray, low: FloatArray, high: FloatArray
) -> LinearSolutions:
    """Minimise ``c x`` over ``low <= A x <= high``, ``N`` times.

    Args:
        costs: ``c (n,)``, the same for all.
        rows: ``A (N, m, n)``, of order one.
        low: ``(N, m)``, at least ``-NO_BOUND``.
        high: ``(N, m)``, at most ``NO_BOUND``.
    """
    count, length, size = rows.shape
    points, multipliers = np.empty((count, size)), np.empty((count, length))
    weight = WEIGHT * np.eye(size)
    fixed = repeat((weight, costs), count)
    for i, (point, weights) in enumerate(_answers(fixed, rows, low, high)):
        points[i], multipliers[i] = point, weights
    _without_endless(points)
    _without_endless(multipliers)
    values = (rows @ points[..., None])[..., 0]
    above, below = high - values, values - low
    gradient = costs + WEIGHT * points + (multipliers[:, None] @ rows)[:, 0]
    held = np.where(multipliers > 0.0, above, np.where(multipliers < 0.0, below, 0.0))
    # Comparisons with NaN are false.
    proven = np.asarray((np.minimum(above, below) >= -PROGRAM_TOLERANCE).all(axis=1))
    proven &= np.abs(gradient).max(axis=1, initial=0.0) <= PROOF_TOLERANCE
    proven &= (np.abs(multipliers * held) <= PROOF_TOLERANCE).all(axis=1)
    return LinearSolutions(points, multipliers, proven)


def last_points(costs: FloatArray, rows: FloatArray, low: FloatArray) -> FloatArray:
    """DAQP's last points ``(N, n)`` for many programs: minimise ``c x`` over ``A x >= low``.

    Nothing is proven of them, which takes time: they are for callers who judge each answer afresh,
    whatever it is. It need not even be finite.

    Args:
        costs: ``c (n,)``, the same for all.
        rows: ``A (N, m, n)``, of order one.
        low: ``(N, m)``, at least ``-NO_BOUND``.
    """
    count, _, size = rows.shape
    points, high = np.empty((count, size)), np.full(low.shape, NO_BOUND)
    fixed = repeat((LINEAR_WEIGHT * np.eye(size), costs), count)
    for i, (point, _) in enumerate(_answers(fixed, rows, low, high)):
        points[i] = point
    return points


def solve_quadratic_programs(
    hessians: FloatArray, gradients: FloatArray, rows: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Minimise ``x H x / 2 + g x`` over ``low <= A x <= high``, ``N`` times.

    Args:
        hessians: ``H (N, n, n)``, positive definite and of order one.
        gradients: ``g (N, n)``.
        rows, low, high: as in :func:`solve_linear_programs`.

    Returns:
        The last points ``(N, n)``, and which of them keep all rows ``(N,)``.
    """
    points = np.empty(gradients.shape)
    objectives = zip(hessians, gradients, strict=True)
    for i, (point, _) in enumerate(_answers(objectives, rows, low, high)):
        points[i] = point
    _without_endless(points)
    values = (rows @ points[..., None])[..., 0]
    kept = (values >= low - ROW_TOLERANCE) & (values <= high + ROW_TOLERANCE)
    return points, np.asarray(kept.all(axis=1))


def _without_endless(table: FloatArray) -> None:
    """Write NaN over what is too large for a number, as it is where rows contradict each other."""
    table[np.abs(table) >= NO_BOUND] = np.nan


def _answers(
    objectives: Iterable[tuple[FloatArray, FloatArray]],
    rows: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """DAQP's last point and its multipliers, of one program after the other.

    Each begins with the active rows of the one before: neighbours on a path are much alike.
    """
    import daqp

    model, last = daqp.Model(), None
    nothing = np.full(rows.shape[2], np.nan), np.zeros(rows.shape[1])
    for objective, matrix, least, most in zip(objectives, rows, low, high, strict=True):
        if last is None:
            sense = np.zeros(rows.shape[1], dtype=np.int32)
            ready = model.setup(*objective, matrix, most, least, sense)[0]
            model.settings = {"primal_tol": SOLVER_TOLERANCE}
        elif objective is last:
            ready = model.update(A=matrix, bupper=most, blower=least)
        else:
            ready = model.update(*objective, matrix, most, least)
        # It is set up anew after rows that it sees to contradict each other.
        last = None if ready < 0 else objective
        if last is None:
            yield nothing
        else:
            point, _, _, report = model.solve()
            yield point, report["lam"]
