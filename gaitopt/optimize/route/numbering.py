"""Where the unknowns of a time-optimal walk stand, and the parts of a vector over its rows.

Words and shapes are those of :mod:`gaitopt.optimize.route.layout`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray


class Numbering(NamedTuple):
    """Where poses and times stand in the vector of unknowns.

    Attributes:
        poses: number of each entry that may be unknown ``(K, c)``; -1 where it is fixed.
        times: number of each interval's time ``(K - 1,)``.
        size: how many unknowns there are.
    """

    poses: np.ndarray
    times: np.ndarray
    size: int


class RowParts(NamedTuple):
    """A vector over all rows, split by what they are about.

    Attributes:
        velocity_up, velocity_down: limits on positive and negative velocities ``(K - 1, 12)``.
        position_low, position_high: limits on joint positions that are in use, from the first
            knot with an unknown on ``(late knots, limits in use)``.
        single: rows on single poses ``(M,)``, those on the COM included.
    """

    velocity_up: FloatArray
    velocity_down: FloatArray
    position_low: FloatArray
    position_high: FloatArray
    single: FloatArray
