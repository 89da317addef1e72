"""The trapezoidal swing: speeds up, keeps its speed, slows down; half a sine upward."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.swing.curve import ArchCurve
from gaitopt.swing.sine_arch import half_sine


@dataclass(frozen=True, eq=False)
class TrapezoidSwing(ArchCurve):
    """Progress with a trapezoidal velocity, lift ``sin(pi s)``, with ``s = t / duration``.

    With L the step's length, T the duration and r the ramp: forward the foot starts and lands at
    rest, with accelerations of ``L / (r (1 - r) T^2)`` forward and backward; in between it keeps
    ``L / ((1 - r) T)``. Upwards it leaves and meets the ground at ``pi height / T`` without
    acceleration. Its acceleration jumps at the two ends of the plateau.

    Source: [XiLing], Module C, 4.2. The printed h(t) holds the height that the
    printed position multiplies it by once more, and takes its sine of pi t: here t is the share of
    the duration, and the height counts once.

    Attributes:
        ramp: share of the duration in which the foot speeds up, and in which it slows down,
            above 0 and at most 1/2. By default 1/3, which keeps the mean square of the forward
            acceleration least.

    Raises:
        InputError: the ramp is out of range; else as every swing curve.
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
        if not 1e-3 <= ramp <= 0.5:
            raise InputError(
                f"ramp must be a share of the duration from 0.001 to 0.5, got {self.ramp!r}"
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
