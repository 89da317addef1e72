"""The sine arch swing: constant speed forward, half a sine upward."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.swing.curve import ArchCurve


def half_sine(w: FloatArray, order: int) -> FloatArray:
    """Derivative of ``sin(pi w)`` of the given ``order``, 0 to 3."""
    s, c = np.sin(np.pi * w), np.cos(np.pi * w)
    return (s, np.pi * c, -(np.pi**2) * s, -(np.pi**3) * c)[order]


class SineArchSwing(ArchCurve):
    """Progress ``s`` and lift ``sin(pi s)``, with ``s = t / duration``.

    At both ends the foot's horizontal speed is the step's length over the duration, and its
    vertical speed is ``pi height / duration``, so that it hits the ground. Its acceleration there
    is zero.

    Source: [XiLing], eqs. (40) and (41), which call it half-elliptical, which it is not:
    see :class:`gaitopt.swing.ellipse.HalfEllipseSwing`.
    """

    smoothness: ClassVar[int] = 2
    rest_order: ClassVar[int] = 0

    def _progress(self, w: FloatArray, order: int) -> FloatArray:
        return (w, np.ones_like(w), np.zeros_like(w), np.zeros_like(w))[order]

    def _lift(self, w: FloatArray, order: int) -> FloatArray:
        return half_sine(w, order)
