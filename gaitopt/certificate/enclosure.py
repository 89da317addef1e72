"""Bounds on a path, and on points that it moves, that hold at every instant.

A polynomial lies within the range of its Bernstein coefficients [Farouki2012]. The second
derivative of a point on a chain of hinges is bounded by the hinges' rates and by the point's
distances from their axes; the point leaves its chord by at most an eighth of that bound times the
squared time between the chord's ends.

:mod:`gaitopt.motion.bounds` computes Bernstein bounds for the planners. The certificate keeps this
second copy on purpose: an error in one of them is seen by the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import comb, perm
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, frozen
from gaitopt.motion.path import MotionPath

SAME_PLACE = 1e-12
"""Difference of two places up to which one sample stands for both [m, rad]: pieces that meet in
exact arithmetic differ by about 1e-16 times their terms."""
AT_ONCE = 512
"""Pieces whose coefficients are looked at in one call of NumPy: as many as a core's cache holds."""


class Places(NamedTuple):
    """The places at the ends of pieces, each once where one piece goes on from the last one.

    Attributes:
        values: of the path's columns ``(U, n)``.
        ends: numbers of the places at the starts and at the ends of the pieces ``(2, P)``.
    """

    values: FloatArray
    ends: np.ndarray


@dataclass(frozen=True, eq=False)
class Pieces:
    """A path cut into pieces, each a polynomial in its own time.

    Attributes:
        starts, lengths: start and length of each piece ``(P,)`` [s].
        coefficients: ``(degree + 1, P, n)``, highest power first.
    """

    starts: FloatArray
    lengths: FloatArray
    coefficients: FloatArray
    _enclosures: dict[int, tuple[FloatArray, FloatArray]] = field(
        default_factory=dict, init=False, repr=False
    )
    _largest: dict[int, FloatArray] = field(default_factory=dict, init=False, repr=False)

    @classmethod
    def of(cls, path: MotionPath) -> Pieces:
        """The path's own segments."""
        lengths = np.diff(path.times) if len(path.times) > 1 else np.zeros(1)
        return cls(path.times[: len(lengths)], lengths, path.coefficients)

    def cut(self, counts: np.ndarray) -> Pieces:
        """Each piece ``p`` cut into ``counts[p]`` equal ones."""
        owner = np.repeat(np.arange(len(counts)), counts)
        place = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
        step = self.lengths[owner] / counts[owner]
        shift = (place * step)[:, None]
        shifted = [c[owner].copy() for c in self.coefficients]
        # Taylor shift by repeated synthetic division: p(t + shift) in powers of t.
        for top in range(len(shifted) - 1, 0, -1):
            for k in range(1, top + 1):
                shifted[k] = shifted[k] + shift * shifted[k - 1]
        return Pieces(self.starts[owner] + place * step, step, np.array(shifted))

    def chosen(self, which: np.ndarray) -> Pieces:
        """Some of the pieces, by a mask or their numbers."""
        return Pieces(self.starts[which], self.lengths[which], self.coefficients[:, which])

    def values(self) -> tuple[FloatArray, FloatArray]:
        """Values at the start and the end of every piece ``(P, n)``."""
        return self.at_ends(0)

    def places(self) -> Places:
        """The places at both ends of all pieces, without those that are there twice."""
        starts, ends = self.values()
        apart = np.ones(len(starts), dtype=np.bool_)
        # A comparison with NaN is false: what is no number is a place of its own.
        apart[:-1] = ~(np.abs(ends[:-1] - starts[1:]) <= SAME_PLACE).all(axis=1)
        own = np.flatnonzero(apart)
        last = np.arange(1, len(starts) + 1)
        last[own] = len(starts) + np.arange(len(own))
        return Places(np.concatenate([starts, ends[own]]), np.stack([np.arange(len(starts)), last]))

    def at_ends(self, derivative: int) -> tuple[FloatArray, FloatArray]:
        """A derivative at the start and the end of every piece ``(P, n)``."""
        start, end = (np.zeros_like(self.coefficients[0]) for _ in range(2))
        degree = len(self.coefficients) - 1
        for power in range(degree, derivative - 1, -1):
            factor = float(np.prod(np.arange(power - derivative + 1, power + 1)))
            start = factor * self.coefficients[degree - power]
            end = end * self.lengths[:, None] + start
        return start, end

    def enclosure(self, derivative: int = 0) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest value that a derivative can take on each piece ``(P, n)``.

        The arrays are read-only, for they are kept for the next check.
        """
        if derivative not in self._enclosures:
            self._enclosures[derivative] = self._bernstein(derivative)
        return self._enclosures[derivative]

    def _bernstein(self, derivative: int) -> tuple[FloatArray, FloatArray]:
        """Least and largest Bernstein coefficient of a derivative on each piece ``(P, n)``."""
        powers = self.coefficients[::-1]
        degree, shape = len(powers) - 1 - derivative, powers.shape[1:]
        # Checks look at single columns, which are contiguous here.
        low, high = np.zeros(shape[::-1]), np.zeros(shape[::-1])
        shares = np.array([[comb(i, k) / comb(degree, k) for k in range(degree + 1)]
                           for i in range(degree + 1)])  # fmt: skip
        factors = np.array([perm(k, derivative) * self.lengths ** (k - derivative)
                            for k in range(derivative, len(powers))])  # fmt: skip
        for begin in range(0, shape[0] if degree >= 0 else 0, AT_ONCE):
            part = slice(begin, begin + AT_ONCE)
            scaled = factors[:, part, None] * powers[derivative:, part]
            found = (shares @ scaled.reshape(degree + 1, -1)).reshape(scaled.shape)
            low[:, part], high[:, part] = found.min(axis=0).T, found.max(axis=0).T
        return frozen(low.T), frozen(high.T)

    def largest(self, derivative: int) -> FloatArray:
        """Largest size that a derivative can have on each piece ``(P, n)``; read-only."""
        if derivative not in self._largest:
            low, high = self.enclosure(derivative)
            self._largest[derivative] = frozen(np.maximum(np.abs(low), np.abs(high)))
        return self._largest[derivative]


@dataclass(frozen=True, eq=False)
class Chain:
    """The hinges that move a point, from the base outward.

    Attributes:
        columns: the path's columns of the hinges.
        distances: upper bounds on the distance from each hinge's origin to the point ``(nj,)`` [m].
        base: upper bound on the distance from the base's origin to the point [m].
    """

    columns: tuple[int, ...]
    distances: tuple[float, ...]
    base: float


def chain_to(model: Any, joint: int, lever: FloatArray, extra: float = 0.0) -> Chain:
    """The chain of a point fixed to ``joint`` at ``lever (3,)`` [m].

    Args:
        model: Pinocchio's model with a free-flying base as joint 1.
        joint: the joint's id; 1 for the base itself.
        lever: place in the joint's frame.
        extra: added to all distances, for a body of this radius about the point [m].
    """
    distance = float(np.linalg.norm(lever)) + extra
    columns, distances = [], []
    while joint > 1:
        # A path has six columns for the base, as Pinocchio has six velocities.
        columns.append(int(model.joints[joint].idx_v))
        distances.append(distance)
        distance += float(np.linalg.norm(model.jointPlacements[joint].translation))
        joint = model.parents[joint]
    return Chain(tuple(columns[::-1]), tuple(distances[::-1]), distance)


def acceleration_bounds(
    chains: Sequence[Chain], rates: FloatArray, accelerations: FloatArray
) -> FloatArray:
    """Bounds on the second time derivatives of points' places in the world ``(P, n)`` [m/s^2].

    With hinges i = 1..n from the base outward, the second derivative is the sum of J_i q''_i and
    of q'_i q'_j a_i x (a_j x r_j), whose factors are no longer than the distance from the outer of
    the two hinges. Roll, pitch and yaw count as three hinges at the base. So each hinge adds its
    distance times a number of its own, ``q''_j`` and ``q'_j (q'_j + 2 sum of q'_i before it)``.

    Args:
        chains: of ``n`` points, all of one robot.
        rates, accelerations: largest first and second derivatives of all columns ``(P, n)``.
    """
    # Arrays with the pieces last are faster.
    rates, bounds, seen = rates.T, np.array(accelerations.T), set()
    straight = np.sqrt((bounds[:3] ** 2).sum(axis=0))
    distances = np.zeros((len(chains), len(bounds)))
    turned: dict[int, FloatArray] = {}
    for n, chain in enumerate(chains):
        columns = (5, 4, 3, *chain.columns)
        distances[n, columns] = [chain.base] * 3 + list(chain.distances)
        if chain.columns in seen:
            continue
        seen.add(chain.columns)
        before = np.zeros_like(straight)
        for column in columns:
            turned[column] = rates[column] * (rates[column] + 2.0 * before)
            before += rates[column]
    for column, turning in turned.items():
        bounds[column] += turning
    return np.asarray((distances @ bounds + straight).T)


def speed_bound(chain: Chain, rates: FloatArray) -> FloatArray:
    """Bound on a point's speed relative to the base ``(P,)`` [m/s].

    Args:
        chain: the point's chain.
        rates: largest first derivatives of all columns ``(P, n)``.
    """
    return np.asarray(rates[:, list(chain.columns)] @ np.array(chain.distances))


def chord_deviation(bound: FloatArray, lengths: FloatArray) -> FloatArray:
    """How far a curve leaves its chord at most ``(P,)`` [m].

    Args:
        bound: on its second derivative ``(P,)`` [m/s^2].
        lengths: time between the ends of the chord ``(P,)`` [s].
    """
    return np.asarray(bound * lengths**2 / 8.0)
