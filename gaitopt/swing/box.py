"""The box swing: straight up, straight across, straight down."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray


def box_corners(start: FloatArray, end: FloatArray, height: float | FloatArray) -> FloatArray:
    """Corners A, B, C, D of the box over which feet swing, for many swings at once.

    The foot rises ``height`` above the higher of its two ends, so that it clears both.

    Args:
        start: where the feet lift off ``(..., 3)`` [m].
        end: where they touch down ``(..., 3)`` [m].
        height: swing height ``(...)`` [m], or one for all.

    Returns:
        ``(..., 4, 3)`` [m]. Source: [Wang2020], Section II.E and Fig. 5.
    """
    start, end = np.broadcast_arrays(np.asarray(start, float), np.asarray(end, float))
    top = np.maximum(start[..., 2], end[..., 2]) + height
    above_start, above_end = start.copy(), end.copy()
    above_start[..., 2] = top
    above_end[..., 2] = top
    return np.stack([start, above_start, above_end, end], axis=-2)
