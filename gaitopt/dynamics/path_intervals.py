"""Intervals of paths, and what bounds the speed along them besides forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray


@dataclass(frozen=True, eq=False)
class PathIntervals:
    """Intervals of ``C`` chains, one chain after another; each is followed without a stop.

    Attributes:
        begin, end: the samples at which each interval begins and ends ``(K,)``. Where feet land or
            lift off the same place is two samples, or one that two intervals share.
        lengths: of the intervals, in the path's parameter ``(K,)``.
        standing: which feet stand ``(K, 4)``.
        first: first interval of each chain, and ``K`` ``(C + 1,)``.
        even: intervals that are followed at constant speed ``(K,)``; none by default. It suits
            places where the path itself begins or ends at rest: speeds along it may be any there.
    """

    begin: np.ndarray
    end: np.ndarray
    lengths: FloatArray
    standing: BoolArray
    first: np.ndarray
    even: BoolArray | None = None

    def __len__(self) -> int:
        return len(self.lengths)


@dataclass(frozen=True, eq=False)
class TimingLimits:
    """What bounds the timing besides forces, at ``S`` samples.

    Attributes:
        squares: largest squared path speeds ``(S,)`` [1/s^2]: joint velocities, and 0 for a stop.
        first, second: derivatives of the joints whose acceleration is limited, by the path's
            parameter ``(S, n)``, times ``scales``.
        acceleration: limit of their accelerations [rad/s^2]; infinite for none.
        slack: what every side of a friction pyramid keeps, as a share of the weight.
        expected: squared path speeds near which torques that fall with the speed of joints are
            limited exactly ``(S,)`` [1/s^2], and elsewhere by more than needed; :attr:`squares` by
            default.
        falling: whether torques that fall with the speed of joints are limited at all.
        scales: limit of all accelerations over each joint's own ``(n,)``, where these differ.
        most: largest normal forces of the feet as shares of the weight ``(S, 4)``; none by default.
    """

    squares: FloatArray
    first: FloatArray
    second: FloatArray
    acceleration: float = np.inf
    slack: float = 0.0
    expected: FloatArray | None = None
    falling: bool = True
    scales: FloatArray | float = 1.0
    most: FloatArray | None = None
