"""The half-ellipse swing: what [XiLing] calls its eq. (40), which is printed as a sine arch."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.swing.curve import ArchCurve
from gaitopt.swing.sine_arch import half_sine


class HalfEllipseSwing(ArchCurve):
    """Progress ``(1 - cos(pi s)) / 2`` and lift ``sin(pi s)``, with ``s = t / duration``.

    Between ends of the same height the path is half an ellipse, whose semi-axes are half the step
    and the height. The foot's velocity is vertical at both ends, ``pi height / duration``. Its
    acceleration there is horizontal, ``pi^2 / 2`` times the step over the square of the duration,
    forward at lift-off and backward at touch-down.

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
