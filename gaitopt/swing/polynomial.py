"""The polynomial swing, which starts and lands without velocity and acceleration."""

from __future__ import annotations

from typing import ClassVar

from gaitopt.conventions import FloatArray
from gaitopt.swing.curve import ArchCurve, smooth_step


class PolynomialSwing(ArchCurve):
    """A quintic along the step, a quintic upwards, and another one downwards.

    Velocity and acceleration are zero at both ends. The progress is ``10 s^3 - 15 s^4 + 6 s^5``
    with ``s = t / duration``. The lift is ``(20 u^3 - 25 u^4 + 8 u^5) / 3``, with ``u = 2 s`` up to
    the highest point and ``u = 2 - 2 s`` after it. This is the quintic that starts at 0 with zero
    velocity and acceleration and ends at 1 with zero velocity and jerk; so four derivatives are
    continuous at the highest point. Between ends of different heights two derivatives are.
    """

    smoothness: ClassVar[int] = 2
    rest_order: ClassVar[int] = 2

    def _progress(self, w: FloatArray, order: int) -> FloatArray:
        return smooth_step(w, order)

    def _lift(self, w: FloatArray, order: int) -> FloatArray:
        u, r = 2.0 * w, 1.0 - 2.0 * w
        return (
            u**3 * (20.0 - 25.0 * u + 8.0 * u * u) / 3.0,
            40.0 / 3.0 * u * u * r * (3.0 - 2.0 * u),
            80.0 / 3.0 * u * (6.0 - 15.0 * u + 8.0 * u * u),
            320.0 * r * (1.0 - 4.0 * u),
        )[order]
