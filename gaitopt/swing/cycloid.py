"""The cycloid swing, which starts and lands at rest."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.swing.curve import ArchCurve


class CycloidSwing(ArchCurve):
    """A cycloid, the path of a point on a rolling wheel, stretched to the step and the height.

    With ``sigma = 2 pi t / duration`` the progress is ``(sigma - sin sigma) / (2 pi)`` and the
    lift ``(1 - cos sigma) / 2``. At both ends the velocity is zero; the acceleration is
    ``2 pi^2 height / duration^2`` upwards, and zero sideways.

    Source: [Wang2024], eqs. (17)-(20) with four corrections. Eqs. (17) and (18)
    print ``2 sin sigma``, which starts backwards and overshoots by 10.9 % of the step. Eq. (19)
    prints y for z, and comes back to the start's height whatever the end's is. Eq. (20) prints
    lambda for mu: ``mu Ts`` is the duration of the swing.
    """

    smoothness: ClassVar[int] = 2
    rest_order: ClassVar[int] = 1

    @property
    def peak_speed(self) -> FloatArray:
        """The foot's largest speed ``(...)`` [m/s].

        It is exact between ends of the same height. With L the step's length, h the height and T
        the duration it is ``2 L / T``, in the middle of the swing; or
        ``(pi h)^2 / sqrt((pi h)^2 - L^2) / T`` for a tall swing, ``pi h > sqrt(2) L``. Otherwise it
        is that of every
        :class:`~gaitopt.swing.curve.ArchCurve`.
        """
        reach, climb = self._reach(), np.pi * self.height
        tall = climb > np.sqrt(2.0) * reach
        cosine = np.sqrt(1.0 - np.divide(reach, climb, out=np.zeros_like(reach), where=tall) ** 2)
        level = np.where(tall, climb / cosine, 2.0 * reach) / self.duration
        if not self._rise().any():
            return np.asarray(level)
        return np.asarray(np.where(self._rise() == 0.0, level, super().peak_speed))

    def _progress(self, w: FloatArray, order: int) -> FloatArray:
        turn = 2.0 * np.pi
        s, c = np.sin(turn * w), np.cos(turn * w)
        return (w - s / turn, 1.0 - c, turn * s, turn**2 * c)[order]

    def _lift(self, w: FloatArray, order: int) -> FloatArray:
        turn = 2.0 * np.pi
        s, c = np.sin(turn * w), np.cos(turn * w)
        return ((1.0 - c) / 2.0, np.pi * s, turn * np.pi * c, -(turn**2) * np.pi * s)[order]
