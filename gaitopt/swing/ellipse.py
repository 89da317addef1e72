"""The half-ellipse: what eq. (40) of [XiLing] names, not what it prints."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.swing.curve import ArchCurve
from gaitopt.swing.sine_arch import half_sine


class HalfEllipseSwing(ArchCurve):
    """Progress ``(1 - cos(pi s)) / 2``, lift ``sin(pi s)``, with ``s = t / duration``.

    Between ends of one height the path is half an ellipse, its semi-axes half the step and the
    height. The foot leaves the ground and meets it upright, at ``pi height / duration``. Its
    acceleration at the ends is ``pi^2 / 2`` times the step over the square of the duration,
    forward at lift-off and backward at touch-down, and zero upwards.

    Source: [XiLing], eq. (40), corrected: as printed it is a sine arch
    (:class:`gaitopt.swing.sine_arch.SineArchSwing`).
    """

    smoothness: ClassVar[int] = 2
    rest_order: ClassVar[int] = 0

    def _progress(self, w: FloatArray, order: int) -> FloatArray:
        if order == 0:
            return np.sin(np.pi * w / 2.0) ** 2  # keeps the small progress near the end
        return np.pi / 2.0 * half_sine(w, order - 1)

    def _lift(self, w: FloatArray, order: int) -> FloatArray:
        return half_sine(w, order)
