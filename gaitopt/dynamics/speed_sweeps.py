"""The two sweeps of the fastest timing, in closed form, for many chains at once.

Limits on an interval are half-planes of the path acceleration ``u`` and the squared path speed
``x`` at its begin, and the robot can rest anywhere on its chain: the point (0, 0) keeps all of
them. The largest ``x`` from which the rest can still be followed is then the least of a few linear
functions of the largest ``x`` where the interval ends; one of them for each half-plane that bounds
``u`` from below. The largest ``u`` is that of the half-planes from above. So each place takes a few
operations on arrays over all chains.

Where chains are few and long, arrays over them are short, and their overhead is nearly all of the
time. There the half-plane that counts is guessed at every place, the places are gone through with
plain numbers, and then all guesses are judged, and mended, in a few operations on arrays over all
places (policy iteration [Howard1960]). It ends with the same numbers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray

FLAT = 1e-14
"""Coefficients below this are zero: they would bound accelerations or speeds of 1e14."""
LESS = 1.0 - 1e-13
"""Share of a largest squared speed from which on another one is less than it."""
ANY = 1e30
"""An acceleration or a squared speed that nothing bounds."""
FEW_CHAINS = 4
"""So many chains of the longest length have as many intervals as those that count as few."""
MOST_GUESSES = 40
"""Most times that half-planes are guessed; 3 to 12 are usual."""


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
    steps = _Steps.of(intervals.first)
    most = slower * _backward(intervals, by_u, by_x, rest, steps)
    return _forward(intervals, by_u, by_x, rest, most, steps)


class _Steps(NamedTuple):
    """The n-th intervals of all chains, for one n after the other.

    Attributes:
        ahead, back: intervals, counted from the begins of chains and from their ends ``(K,)``.
        counts: how many chains have an n-th one.
    """

    ahead: np.ndarray
    back: np.ndarray
    counts: list[int]

    @classmethod
    def of(cls, first: np.ndarray) -> _Steps:
        """Of chains with these first intervals; the longest chains come first."""
        lengths = np.diff(first)
        order = np.argsort(-lengths, kind="stable")
        having = np.bincount(lengths, minlength=int(lengths.max(initial=0)) + 1)
        counts = (len(lengths) - np.cumsum(having))[:-1]
        step = np.repeat(np.arange(len(counts)), counts)
        chain = order[np.arange(len(step)) - np.repeat(np.cumsum(counts) - counts, counts)]
        return cls(first[chain] + step, first[chain + 1] - 1 - step, counts.tolist())

    @property
    def few(self) -> bool:
        """Whether there are few chains, for their length."""
        return len(self.ahead) < FEW_CHAINS * len(self.counts)


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


def _backward(
    intervals: SweptIntervals, by_u: FloatArray, by_x: FloatArray, rest: FloatArray,
    at: _Steps,
) -> FloatArray:  # fmt: skip
    """Largest squared speeds where intervals begin from which chains can be followed ``(K,)``."""
    steps = intervals.steps[:, None]
    cap = _largest(intervals.top, by_u, by_x, rest)
    # Rows from below, together with x + steps u <= high, say x <= gain high + plain.
    down = np.maximum(-by_u, 0.0)
    total = down + steps * by_x
    bounds = (down > FLAT) & (total > FLAT)
    divided = np.where(bounds, total, 1.0)
    gain = np.where(bounds, down / divided, 0.0)
    plain = np.where(bounds, steps * rest / divided, ANY)
    even = intervals.steps == 0.0
    gain[even, -1], plain[even, -1] = 1.0, 0.0
    if at.few:
        guessed = _backward_by_guesses(intervals, cap, gain, plain)
        if guessed is not None:
            return guessed
    # What each step reads stands together.
    cap, gain, plain, top = (t[at.back] for t in (cap, gain, plain, intervals.top_end))
    found, begin = np.empty(len(cap)), 0
    high = np.full(max(at.counts, default=0), ANY)
    for count in at.counts:
        own = slice(begin, begin + count)
        limit = np.minimum(high[:count], top[own])
        least = np.minimum.reduce(gain[own] * limit[:, None] + plain[own], axis=1)
        high = found[own] = np.maximum(np.minimum(cap[own], least), 0.0)
        begin += count
    most = np.empty(len(cap))
    most[at.back] = found
    return most


def _largest(top: FloatArray, by_u: FloatArray, by_x: FloatArray, rest: FloatArray) -> FloatArray:
    """Largest ``x`` up to ``top (K,)`` for which some ``u`` keeps all rows ``(K,)``.

    By Newton's method from above: where the least upper bound of ``u`` is below the largest lower
    one, ``x`` is too large, and these two rows tell how large it may be.
    """
    flat = (np.abs(by_u) <= FLAT) & (by_x > FLAT)
    x = np.minimum(top, np.where(flat, rest / np.where(flat, by_x, 1.0), ANY).min(axis=1))
    divided = np.where(np.abs(by_u) > FLAT, by_u, 1.0)
    plain, slope = rest / divided, -by_x / divided
    up, down = by_u > FLAT, by_u < -FLAT
    open_ = np.flatnonzero(up.any(axis=1) & down.any(axis=1))
    while len(open_):
        bounds = plain[open_] + slope[open_] * x[open_, None]
        above = open_, np.where(up[open_], bounds, np.inf).argmin(axis=1)
        below = open_, np.where(down[open_], bounds, -np.inf).argmax(axis=1)
        steeper = slope[below] - slope[above]
        crossed = (plain[above] - plain[below]) / np.where(steeper > 0.0, steeper, 1.0)
        # Rows that have crossed do so at a smaller x, as none of them excludes x = 0.
        less = (steeper > 0.0) & (crossed < LESS * x[open_])
        x[open_[less]] = crossed[less]
        open_ = open_[less]
    return np.asarray(x)


def _forward(
    intervals: SweptIntervals, by_u: FloatArray, by_x: FloatArray, rest: FloatArray,
    most: FloatArray, at: _Steps,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Squared speeds that gain as much as the largest ones ``most (K,)`` allow."""
    bounds = by_u > FLAT
    divided = np.where(bounds, by_u, 1.0)
    plain = np.where(bounds, rest / divided, ANY)
    slope = np.where(bounds, -by_x / divided, 0.0)
    after = np.append(most[1:], ANY)
    after[intervals.first[1:] - 1] = ANY
    after = np.minimum(after, intervals.top_end)
    if at.few:
        guessed = _forward_by_guesses(intervals, plain, slope, after, most)
        if guessed is not None:
            return guessed
    plain, slope, steps, after = (t[at.ahead] for t in (plain, slope, intervals.steps, after))
    begins, ends, place = np.empty(len(most)), np.empty(len(most)), 0
    x = most[at.ahead[: max(at.counts, default=0)]]
    for count in at.counts:
        own = slice(place, place + count)
        x = begins[own] = x[:count]
        u = np.minimum.reduce(plain[own] + slope[own] * x[:, None], axis=1, initial=ANY)
        x = ends[own] = np.maximum(np.minimum(x + steps[own] * u, after[own]), 0.0)
        place += count
    begin, end = np.empty(len(most)), np.empty(len(most))
    begin[at.ahead], end[at.ahead] = begins, ends
    return begin, end


def _backward_by_guesses(
    intervals: SweptIntervals, cap: FloatArray, gain: FloatArray, plain: FloatArray
) -> FloatArray | None:
    """:func:`_backward` with the same ``cap``, ``gain`` and ``plain``; ``None`` after many guesses.

    Whatever the guess, what follows from it is too large or right, and so a better guess makes it
    smaller.
    """
    every, caps, tops = np.arange(len(cap)), cap.tolist(), intervals.top_end.tolist()
    last = np.zeros(len(cap), dtype=np.bool_)
    last[intervals.first[1:] - 1] = True
    row = (gain * np.minimum(intervals.top_end, ANY)[:, None] + plain).argmin(axis=1)
    for _ in range(MOST_GUESSES):
        numbers = zip(
            caps[::-1], tops[::-1], gain[every, row][::-1].tolist(),
            plain[every, row][::-1].tolist(), last[::-1].tolist(), strict=True,
        )  # fmt: skip
        high, back = ANY, []
        for most, top, steep, flat, ends in numbers:
            limit = min(ANY if ends else high, top)
            high = max(min(most, steep * limit + flat), 0.0)
            back.append(high)
        found = np.array(back[::-1])
        after = np.where(last, ANY, np.append(found[1:], ANY))
        values = gain * np.minimum(after, intervals.top_end)[:, None] + plain
        better = values.argmin(axis=1)
        wrong = np.maximum(np.minimum(cap, values[every, better]), 0.0) < found
        if not wrong.any():
            return found
        row[wrong] = better[wrong]
    return None


def _forward_by_guesses(
    intervals: SweptIntervals, plain: FloatArray, slope: FloatArray, after: FloatArray,
    most: FloatArray,
) -> tuple[FloatArray, FloatArray] | None:  # fmt: skip
    """:func:`_forward` with the same ``plain``, ``slope`` and ``after``; ``None`` as above.

    Each guess is right up to the first place at which it is mended, at least.
    """
    every, first = np.arange(len(most)), np.zeros(len(most), dtype=np.bool_)
    first[intervals.first[:-1]] = True
    firsts, starts = first.tolist(), most.tolist()
    steps, afters = intervals.steps.tolist(), after.tolist()
    row = (plain + slope * most[:, None]).argmin(axis=1)
    for _ in range(MOST_GUESSES):
        numbers = zip(firsts, starts, steps, afters, plain[every, row].tolist(),
                      slope[every, row].tolist(), strict=True)  # fmt: skip
        x, begins, ends = 0.0, [], []
        for begins_chain, start, step, limit, flat, steep in numbers:
            x = start if begins_chain else x
            begins.append(x)
            x = max(min(x + step * min(flat + steep * x, ANY), limit), 0.0)
            ends.append(x)
        begin = np.array(begins)
        values = plain + slope * begin[:, None]
        better = values.argmin(axis=1)
        wrong = values[every, better] < values[every, row]
        if not wrong.any():
            return begin, np.array(ends)
        row[wrong] = better[wrong]
    return None
