"""A smooth path through exactly computed states: piecewise quintic, refined until it is accurate.

On every interval the quintic has the motion's own positions, velocities and accelerations at both
ends. So the path is as smooth as the motion is, and its error falls with the sixth power of the
interval's length.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import SolverError
from gaitopt.motion.path import MotionPath
from gaitopt.motion.pieces import States, quintic_hermite

MOST_HALVINGS = 8
"""How many times an interval is halved at most: the error then falls by 256**6, 3e14."""
INWARD = 1e-9
"""Share of an interval by which derivatives are taken inside it: they may jump at its ends."""


def smooth_path(
    knots: FloatArray,
    state: Callable[[FloatArray, FloatArray], States],
    error: Callable[[FloatArray, FloatArray], FloatArray],
    tolerance: float,
    first: MotionPath | None = None,
) -> MotionPath:
    """Fit a piecewise quintic path to a motion that is given by formulae.

    Args:
        knots: times ``(K + 1,)`` between which the motion is analytic [s], from 0.
        state: gives values at times ``(N,)``, and velocities and accelerations at the second
            times ``(N,)``, which lie a little inside the interval of the first.
        error: how wrong path values ``(N, n)`` are at times ``(N,)``; ``(N,)``.
        tolerance: the largest error that is allowed in the middle of any interval.
        first: the path through the knots, if it is known already.

    Raises:
        SolverError: the error stays too large however short the intervals are.
    """
    for _ in range(MOST_HALVINGS):
        path = first or _quintics(knots, state)
        middles = (knots[1:] + knots[:-1]) / 2.0
        wrong = error(middles, path.evaluate(middles))
        bad = np.flatnonzero(~(wrong <= tolerance))
        if not bad.size:
            return path
        knots, first = np.sort(np.concatenate([knots, middles[bad]])), None
    raise SolverError(
        f"the motion leaves its path by {float(np.nanmax(wrong)):.2g} m near "
        f"{middles[int(np.nanargmax(wrong))]:.3f} s however short the intervals are; take another "
        "body_height, so that no leg is quite straight or folded"
    )


def _quintics(knots: FloatArray, state: Callable[[FloatArray, FloatArray], States]) -> MotionPath:
    """The path with the motion's states at both ends of every interval."""
    lengths = np.diff(knots)
    begin = state(knots[:-1], knots[:-1] + INWARD * lengths)
    end = state(knots[1:], knots[1:] - INWARD * lengths)
    return MotionPath(knots, quintic_hermite(lengths, begin, end))
