"""The flights of the feet, and the rows that bound their height."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.layout import Rows
from gaitopt.optimize.route.legs import FOOT, POSE
from gaitopt.planners.time_optimal.knots import RouteKnots

KEPT = 0.5
"""Share of the rows' reserve that a motion keeps at least."""


class Flights(NamedTuple):
    """The flights of a motion.

    Attributes:
        lift, land: knots at which the feet lift off and land ``(S,)``.
        ends: the two footholds ``(S, 2, 3)`` [m].
    """

    lift: np.ndarray
    land: np.ndarray
    ends: FloatArray

    @classmethod
    def of(cls, knots: RouteKnots, skip: int) -> Flights:
        """Those that begin at knot ``skip`` or later."""
        pairs = knots.ends[1:].reshape(-1, 2)
        pairs = pairs[pairs[:, 0] >= skip]
        leg = knots.leg[pairs[:, 0]]
        return cls(pairs[:, 0], pairs[:, 1], knots.feet[pairs, leg[:, None]])

    @property
    def top(self) -> FloatArray:
        """Height of the higher foothold ``(S,)`` [m]."""
        return np.asarray(self.ends[..., 2].max(axis=1))


def apexes(lift: np.ndarray, swing_knots: int) -> tuple[np.ndarray, np.ndarray]:
    """The two knots between whose control points a smooth flight is highest."""
    return lift + swing_knots // 2, lift + swing_knots // 2 + 1


def height_rows(rows: Rows) -> np.ndarray:
    """The rows that look at the flying foot's height alone, by their numbers."""
    alone = np.arange(POSE) == FOOT.start + 2
    return np.flatnonzero(((rows.linear == alone) & (rows.square == 0.0)).all(axis=1))
