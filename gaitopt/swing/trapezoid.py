"""The trapezoidal swing: a trapezoidal velocity forward, half a sine upward."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import as_text
from gaitopt.swing.curve import ArchCurve
from gaitopt.swing.sine_arch import half_sine

LEAST_RAMP = 1e-3
"""Smallest ramp: shorter ones are jumps of the velocity for any robot."""


@dataclass(frozen=True, eq=False)
class TrapezoidSwing(ArchCurve):
    """Progress with a trapezoidal velocity and lift ``sin(pi s)``, with ``s = t / duration``.

    Let L be the step's length, T the duration and r the ramp. The foot starts and lands with zero
    horizontal velocity. It accelerates and brakes with ``L / (r (1 - r) T^2)``, and in between its
    horizontal velocity is ``L / ((1 - r) T)``. Its vertical speed at both ends is
    ``pi height / T``, its vertical acceleration zero. The acceleration jumps where the horizontal
    velocity becomes constant, and where it stops being so.

    Source: [XiLing], Module C, 4.2, corrected: the printed h(t) contains the height, by which the
    printed position multiplies it once more; and its sine is that of ``pi t``, where t must be the
    share of the duration.

    Attributes:
        ramp: share of the duration in which the foot accelerates, and in which it brakes, above 0
            and at most 1/2. With 1/3, the default, the mean square of the forward acceleration is
            least.

    Raises:
        InputError: the ramp is out of range, or another field is not valid.
    """

    ramp: float = 1.0 / 3.0

    smoothness: ClassVar[int] = 1
    rest_order: ClassVar[int] = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            ramp = float(self.ramp)
        except (TypeError, ValueError):
            ramp = np.nan
        if not LEAST_RAMP <= ramp <= 0.5:
            raise InputError(
                f"ramp must be a share of the duration from 0.001 to 0.5, got {as_text(self.ramp)}"
            )
        object.__setattr__(self, "ramp", ramp)

    def _half_breaks(self) -> tuple[float, ...]:
        return (self.ramp,)

    def _progress(self, w: FloatArray, order: int) -> FloatArray:
        r, zero = self.ramp, np.zeros_like(w)
        ramp = (w * w / (2.0 * r), w / r, zero + 1.0 / r, zero)[order]
        plateau = (w - r / 2.0, zero + 1.0, zero, zero)[order]
        return np.asarray(np.where(w < r, ramp, plateau) / (1.0 - r))

    def _lift(self, w: FloatArray, order: int) -> FloatArray:
        return half_sine(w, order)
