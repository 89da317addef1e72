"""The flights of the feet, and the rows of a problem that bound their height."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.layout import Rows
from gaitopt.optimize.route.legs import FOOT, POSE
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.knots import RouteKnots

FOOT_HEIGHT = FOOT.start + 2
"""Column of a pose that holds the height of the flying foot."""
LEAST_KNOTS_FOR_TWO = 6
"""Least intervals of a flight with which two knots at either end are above a column: one is left
between them."""


class Flights(NamedTuple):
    """Flights of feet.

    Attributes:
        lift_off, touchdown: knots at which the feet lift off and touch down ``(S,)``.
        footholds: the two footholds of each flight ``(S, 2, 3)`` [m].
    """

    lift_off: np.ndarray
    touchdown: np.ndarray
    footholds: FloatArray

    @classmethod
    def of(cls, knots: RouteKnots, first_knot: int = 0) -> Flights:
        """The flights that begin at ``first_knot`` or later."""
        pairs = knots.flights
        pairs = pairs[pairs[:, 0] >= first_knot]
        leg = knots.leg[pairs[:, 0]]
        return cls(pairs[:, 0], pairs[:, 1], knots.feet[pairs, leg[:, None]])

    @property
    def higher_foothold(self) -> FloatArray:
        """Height of the higher one of the two footholds ``(S,)`` [m]."""
        return np.asarray(self.footholds[..., 2].max(axis=1))


def knots_above_column(settings: RouteSettings) -> int:
    """Knots in the air at either end of a flight at which the foot is above its column.

    On a walk along splines whose timing forces set they are two, where there are knots enough. The
    foot then leaves the space above the column at the second, which can be a sharp turn: its span
    is short, and that of the first one, between ground and turn, is long.
    """
    turns = settings.smooth and settings.forces is not None
    return 2 if turns and settings.swing_knots >= LEAST_KNOTS_FOR_TWO else 1


def smooth_apex_knots(lift_off: np.ndarray, swing_intervals: int) -> tuple[np.ndarray, np.ndarray]:
    """The two knots in the middle of a flight whose control points both keep the swing height.

    A quadratic B-spline does not pass through its control points, but it passes through the middle
    between two of them: so the flight of a smooth walk has its apex there.
    """
    return lift_off + swing_intervals // 2, lift_off + swing_intervals // 2 + 1


def height_rows(rows: Rows) -> np.ndarray:
    """Numbers of the rows that bound the height of the flying foot and nothing else."""
    only_height = np.arange(POSE) == FOOT_HEIGHT
    return np.flatnonzero(((rows.linear == only_height) & (rows.square == 0.0)).all(axis=1))
