"""The two sweeps of the fastest timing, in closed form, for many chains at once.

Limits on an interval are half-planes of the path acceleration ``u`` and the squared path speed
``x`` at its begin, and the robot can rest anywhere on its chain: the point (0, 0) keeps all of
them. The largest ``x`` from which the rest can still be followed is then the least of a few linear
functions of the largest ``x`` where the interval ends; one of them for each half-plane that bounds
``u`` from below. The largest ``u`` is that of the half-planes from above. So each place takes a few
operations on arrays over all chains.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray

FLAT = 1e-14
"""Coefficients below this are zero: they would bound accelerations or speeds of 1e14."""
ANY = 1e30
"""An acceleration or a squared speed that nothing bounds."""


class SweptIntervals(NamedTuple):
    """Intervals of ``C`` chains, in the units of their chains.

    Attributes:
        begin, end: half-planes ``a u + b x <= 1`` where each interval begins and ends
            ``(K, M, 2)``; zeros for none. At the end ``x`` is the squared speed there.
        steps: twice the length; 0 where the speed is constant ``(K,)``.
        top, top_end: largest squared speeds at both ends ``(K,)``.
        first: first interval of each chain, and ``K`` ``(C + 1,)``.
    """

    begin: FloatArray
    end: FloatArray
    steps: FloatArray
    top: FloatArray
    top_end: FloatArray
    first: np.ndarray


def swept(intervals: SweptIntervals, slower: float) -> tuple[FloatArray, FloatArray]:
    """Squared speeds of the fastest timing at both ends of every interval, each ``(K,)``.

    Args:
        intervals: where the robot can rest, and their limits.
        slower: share of a largest squared speed that is used.
    """
    by_u, by_x, rest = _rows(intervals)
    order, active = _lock_step(intervals.first)
    most = slower * _backward(intervals, by_u, by_x, rest, order, active)
    return _forward(intervals, by_u, by_x, rest, most, order, active)


def _rows(intervals: SweptIntervals) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Rows ``by_u u + by_x x <= rest`` of each interval, each ``(K, r)``."""
    steps = intervals.steps[:, None]
    moves = (steps > 0.0).astype(np.float64)
    here, there = intervals.begin, intervals.end
    # The last row: the squared speed at the end is not negative.
    by_u = np.concatenate(
        [moves * here[..., 0], moves * (there[..., 0] + steps * there[..., 1]), -steps], axis=1
    )
    by_x = np.concatenate([here[..., 1], there[..., 1], -np.ones_like(steps)], axis=1)
    rest = np.ones_like(by_u)
    rest[:, -1] = 0.0
    return by_u, by_x, rest


def _lock_step(first: np.ndarray) -> tuple[np.ndarray, list[int]]:
    """Chains, longest first ``(C,)``, and how many of them have an n-th interval, for each n."""
    lengths = np.diff(first)
    order = np.argsort(-lengths, kind="stable")
    counts = np.bincount(lengths, minlength=int(lengths.max(initial=0)) + 1)
    return order, (len(lengths) - np.cumsum(counts))[:-1].tolist()


def _backward(
    intervals: SweptIntervals, by_u: FloatArray, by_x: FloatArray, rest: FloatArray,
    order: np.ndarray, active: list[int],
) -> FloatArray:  # fmt: skip
    """Largest squared speeds where intervals begin from which chains can be followed ``(K,)``."""
    steps = intervals.steps[:, None]
    cap = np.minimum(intervals.top, _largest(by_u, by_x, rest))
    # Rows from below, together with x + steps u <= high, say x <= gain high + plain.
    down = np.maximum(-by_u, 0.0)
    total = down + steps * by_x
    bounds = (down > FLAT) & (total > FLAT)
    divided = np.where(bounds, total, 1.0)
    gain = np.where(bounds, down / divided, 0.0)
    plain = np.where(bounds, steps * rest / divided, ANY)
    even = intervals.steps == 0.0
    gain[even, -1], plain[even, -1] = 1.0, 0.0
    most = np.zeros(len(cap))
    last, high = intervals.first[1:][order] - 1, np.full(len(order), ANY)
    for back, count in enumerate(active):
        i = last[:count] - back
        limit = np.minimum(high[:count], intervals.top_end[i])
        found = np.minimum(cap[i], (gain[i] * limit[:, None] + plain[i]).min(axis=1))
        most[i] = high[:count] = np.maximum(found, 0.0)
    return most


def _largest(by_u: FloatArray, by_x: FloatArray, rest: FloatArray) -> FloatArray:
    """Largest ``x`` for which some ``u`` keeps all rows ``(K,)``: pairs of them without ``u``."""
    up, down = np.maximum(by_u, 0.0), np.maximum(-by_u, 0.0)
    flat = (np.abs(by_u) <= FLAT) & (by_x > FLAT)
    out = np.where(flat, rest / np.where(flat, by_x, 1.0), ANY).min(axis=1)
    for j in range(by_u.shape[1]):
        here = up[:, j : j + 1]
        total = down * by_x[:, j : j + 1] + here * by_x
        bounds = (here > FLAT) & (down > FLAT) & (total > FLAT)
        if bounds.any():
            value = down * rest[:, j : j + 1] + here * rest
            divided = np.where(bounds, total, 1.0)
            out = np.minimum(out, np.where(bounds, value / divided, ANY).min(axis=1))
    return np.asarray(out)


def _forward(
    intervals: SweptIntervals, by_u: FloatArray, by_x: FloatArray, rest: FloatArray,
    most: FloatArray, order: np.ndarray, active: list[int],
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Squared speeds that gain as much as the largest ones ``most (K,)`` allow."""
    bounds = by_u > FLAT
    divided = np.where(bounds, by_u, 1.0)
    plain = np.where(bounds, rest / divided, ANY)
    slope = np.where(bounds, -by_x / divided, 0.0)
    after = np.append(most[1:], ANY)
    after[intervals.first[1:] - 1] = ANY
    after = np.minimum(after, intervals.top_end)
    begin, end = np.zeros(len(most)), np.zeros(len(most))
    start = intervals.first[:-1][order]
    x = most[start]
    for ahead, count in enumerate(active):
        i = start[:count] + ahead
        now = begin[i] = x[:count]
        u = (plain[i] + slope[i] * now[:, None]).min(axis=1)
        end[i] = x[:count] = np.clip(now + intervals.steps[i] * u, 0.0, after[i])
    return begin, end
