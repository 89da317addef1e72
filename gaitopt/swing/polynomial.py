"""The polynomial swing: starts and lands without velocity and without acceleration."""

from __future__ import annotations

from typing import ClassVar

from gaitopt.conventions import FloatArray
from gaitopt.swing.curve import ArchCurve, smooth_step


class PolynomialSwing(ArchCurve):
    """A quintic along the step, and a quintic each for the way up and the way down.

    Velocity and acceleration are zero at both ends, upwards too. The progress is
    ``10 s^3 - 15 s^4 + 6 s^5`` with ``s = t / duration``. The lift is
    ``(20 u^3 - 25 u^4 + 8 u^5) / 3``, ``u = 2 s`` up to the apex and ``u = 2 - 2 s`` after it: the
    one quintic that starts so, ends at 1 with zero velocity and jerk, and so meets its mirror
    image with four continuous derivatives. Between ends of different heights two are.
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
