"""The common interface of all swing curves: place, velocity, acceleration and jerk of a foot."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import check_known, check_numbers

FARTHEST = 1e6
"""Coordinates of an end of a swing beyond this are taken for a mistake [m]."""

HIGHEST = 100.0
"""Swing heights above this are taken for a mistake [m]."""

DURATIONS = (1e-6, 1e6)
"""Shortest and longest swing [s]; others are taken for a mistake."""

_SPEED_SAMPLES = 4096
"""Samples of the speed in half a swing: errors of ``peak_speed`` are below 1e-6, as shown there."""
_LENGTH_NODES = 64
"""Nodes of the quadrature on each piece: errors of ``length`` are below 1e-6, as measured."""
_AT_ONCE = 1024
"""Swings whose speeds are in memory together: some 30 MB of samples."""


@dataclass(frozen=True, eq=False)
class SwingCurve(ABC):
    """The flight of a foot from ``start`` to ``end``, for one swing or for many at once.

    The fields are broadcast against one another and stored in their common shape. The foot's
    highest point is exactly ``height`` above the higher end. Every curve is symmetric in time: in
    reverse it is the curve from ``end`` to ``start``. A swing on one spot (``start == end``) and
    one without height are possible.

    Class attributes, which hold for ends of any heights:

    - ``smoothness``: how many derivatives are continuous in flight.
    - ``rest_order``: how many derivatives are zero at lift-off and touch-down. 0: the foot moves
      there; 1: its velocity is zero; 2: its acceleration, too.

    Attributes:
        start: where the feet lift off ``(..., 3)`` [m].
        end: where they touch down ``(..., 3)`` [m].
        height: swing height above the higher of the two ends ``(...)`` [m], 0 or more.
        duration: time in the air ``(...)`` [s].

    Raises:
        InputError: a field has a wrong shape, is not finite, or is out of range.
    """

    start: FloatArray
    end: FloatArray
    height: FloatArray
    duration: FloatArray

    smoothness: ClassVar[int]
    rest_order: ClassVar[int]

    def __post_init__(self) -> None:
        start = check_numbers("start", self.start, -FARTHEST, FARTHEST, "m")
        end = check_numbers("end", self.end, -FARTHEST, FARTHEST, "m")
        height = check_numbers("height", self.height, 0.0, HIGHEST, "m")
        duration = check_numbers("duration", self.duration, *DURATIONS, "s")
        for name, place in (("start", start), ("end", end)):
            if place.shape[-1:] != (3,):
                raise InputError(f"{name} must have the shape (..., 3), got {place.shape}")
        shapes = start.shape[:-1], end.shape[:-1], height.shape, duration.shape
        try:
            shape = np.broadcast_shapes(*shapes)
        except ValueError:
            raise InputError(
                "start, end, height and duration must each be given for one swing or for as many "
                f"as the others, got {', '.join(map(str, shapes))}"
            ) from None
        for name, place in (("start", start), ("end", end)):
            object.__setattr__(self, name, frozen(np.broadcast_to(place, (*shape, 3))))
        for name, value in (("height", height), ("duration", duration)):
            object.__setattr__(self, name, frozen(np.broadcast_to(value, shape)))

    def position(self, t: ArrayLike) -> FloatArray:
        """Where the foot is ``(..., 3)`` [m].

        Args:
            t: time since lift-off [s], broadcast against the swings: times ``(N, 1)`` and swings
                ``(M,)`` give ``(N, M, 3)``. Times outside the swing count as its ends, also for
                derivatives. Where a derivative jumps it is that of one side.

        Raises:
            InputError: ``t`` cannot be broadcast against the swings, or is NaN.
        """
        return self._derivative(t, 0)

    def velocity(self, t: ArrayLike) -> FloatArray:
        """First derivative of :meth:`position` ``(..., 3)`` [m/s]."""
        return self._derivative(t, 1)

    def acceleration(self, t: ArrayLike) -> FloatArray:
        """Second derivative of :meth:`position` ``(..., 3)`` [m/s^2]."""
        return self._derivative(t, 2)

    def jerk(self, t: ArrayLike) -> FloatArray:
        """Third derivative of :meth:`position` ``(..., 3)`` [m/s^3]."""
        return self._derivative(t, 3)

    @property
    def apex(self) -> FloatArray:
        """Height ``(...)`` of the foot's highest point [m]."""
        return np.asarray(np.maximum(self.start[..., 2], self.end[..., 2]) + self.height)

    @property
    @abstractmethod
    def breaks(self) -> FloatArray:
        """Shares of the duration ``(..., k)`` at which a derivative may jump, increasing.

        The curve is analytic between them, so that a planner puts knots there.
        """

    @property
    @abstractmethod
    def peak_speed(self) -> FloatArray:
        """The foot's largest speed ``(...)`` [m/s]."""

    @property
    @abstractmethod
    def length(self) -> FloatArray:
        """Length ``(...)`` of the foot's path [m]."""

    @abstractmethod
    def _shape(self, share: FloatArray, order: int) -> FloatArray:
        """Derivative of the position by the share of the duration ``(..., 3)`` [m]."""

    def _derivative(self, t: ArrayLike, order: int) -> FloatArray:
        times = check_known("t", t)
        try:
            np.broadcast_shapes(times.shape, self.duration.shape)
        except ValueError:
            raise InputError(
                f"times {times.shape} do not go with swings {self.duration.shape}; give times "
                "(N, 1) for N times of each of M swings"
            ) from None
        share = np.asarray(np.clip(times, 0.0, self.duration) / self.duration)
        return self._shape(share, order) / self.duration[..., None] ** order


class ArchCurve(SwingCurve):
    """A curve that consists of a progress along the step and a lift above the ground.

    Let ``w`` be the share of the duration since lift-off or until touch-down, whichever is less;
    let ``near`` be this end of the swing, and ``far`` the other::

        x, y = near + (far - near) progress(w)
        z    = near + height lift(w) + max(far - near, 0) smooth_step(2 w)

    Between ends of the same height the last term is zero. Otherwise it raises the foot to the
    height of the higher end, in the half of the swing at the lower end. So in the other half the
    foot is never below the higher end, the highest point stays in the middle of the swing, and
    velocity and acceleration are continuous there.
    """

    @property
    def breaks(self) -> FloatArray:
        halves = self._half_breaks()
        shares = np.array(sorted({*halves, 0.5, *(1.0 - half for half in halves)}))
        return np.broadcast_to(shares, (*self.duration.shape, len(shares)))

    @property
    def peak_speed(self) -> FloatArray:
        """The foot's largest speed ``(...)`` [m/s]; it is at most 1e-6 of it too small.

        It is exact where the foot is fastest at an end, in the middle or at a break. Elsewhere it
        is the largest of samples that are ``d = duration / 8192`` apart. From the fastest instant
        to the nearest sample the velocity's component along the direction of the largest one falls
        by at most ``J d^2 / 8``, with J the largest jerk. J is at most the sum of the jerks of the
        three terms, each no more than ``128 / duration^2`` times its term's largest speed, and no
        term is faster than the foot: in all ``3 * 128 / 8 / 8192^2 = 7.2e-7`` of the largest speed.
        """
        grid = np.linspace(0.0, 0.5, _SPEED_SAMPLES + 1)
        shares = np.union1d(grid, self._half_breaks())
        along, up, step = self._rates(shares)
        products = np.stack([along * along, up * up, 2.0 * up * step, step * step])
        reach, lower, height = self._reach().ravel(), self._rise().ravel(), self.height.ravel()
        factors = np.stack([reach**2, height**2, height * lower, lower**2], axis=-1)
        parts = np.array_split(factors, max(len(factors) // _AT_ONCE, 1))
        squares = np.concatenate([(part @ products).max(axis=-1) for part in parts])
        return np.asarray(np.sqrt(squares).reshape(self.duration.shape) / self.duration)

    @property
    def length(self) -> FloatArray:
        """Length ``(...)`` of the foot's path [m], with an error below 1e-6 of it.

        It is computed by Gauss-Legendre quadrature with 64 nodes on each analytic piece. Compared
        with quadrature on meshes that are refined towards the ends, for steps and heights from 1 um
        to 10 m, the largest error was 6e-8.
        """
        x, weights = _legendre_rule()
        cuts = np.unique([0.0, *self._half_breaks(), 0.5])[:, None]
        widths = np.diff(cuts, axis=0)
        shares = (cuts[:-1] + widths * (x + 1.0) / 2.0).ravel()
        parts = (widths * weights / 2.0).ravel()
        along, up, step = self._rates(shares)
        sideways = self._reach()[..., None] * along
        upper = self.height[..., None] * up
        lower = upper + self._rise()[..., None] * step
        return np.asarray((np.hypot(sideways, upper) + np.hypot(sideways, lower)) @ parts)

    @abstractmethod
    def _progress(self, w: FloatArray, order: int) -> FloatArray:
        """Derivative of the share of the step done: 0 at the near end, 1/2 in the middle."""

    @abstractmethod
    def _lift(self, w: FloatArray, order: int) -> FloatArray:
        """Derivative of the share of the height: 0 at the near end, 1 in the middle."""

    def _half_breaks(self) -> tuple[float, ...]:
        """Breaks of progress and lift in the first half, without the middle."""
        return ()

    def _reach(self) -> FloatArray:
        step = self.end - self.start
        return np.asarray(np.hypot(step[..., 0], step[..., 1]))

    def _rise(self) -> FloatArray:
        return np.asarray(np.abs(self.end[..., 2] - self.start[..., 2]))

    def _rates(self, w: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        return self._progress(w, 1), self._lift(w, 1), 2.0 * smooth_step(2.0 * w, 1)

    def _shape(self, share: FloatArray, order: int) -> FloatArray:
        first = share < 0.5
        w = np.where(first, share, 1.0 - share)
        near = np.where(first[..., None], self.start, self.end)
        step = np.where(first[..., None], self.end, self.start) - near
        out = step * self._progress(w, order)[..., None]
        out[..., 2] = self.height * self._lift(w, order)
        out[..., 2] += np.maximum(step[..., 2], 0.0) * 2.0**order * smooth_step(2.0 * w, order)
        if order == 0:
            return np.asarray(near + out)
        return np.asarray(np.where(first[..., None], out, (-1.0) ** order * out))


def smooth_step(share: FloatArray, order: int = 0) -> FloatArray:
    """The quintic from 0 to 1 whose velocity and acceleration are zero at both ends.

    It is ``10 s^3 - 15 s^4 + 6 s^5`` with ``s = share``, or its derivative of ``order`` 0 to 3.
    """
    s, r = share, 1.0 - share
    return (
        s**3 * (10.0 - 15.0 * s + 6.0 * s * s),
        30.0 * (s * r) ** 2,
        60.0 * s * r * (r - s),
        60.0 * (1.0 - 6.0 * s * r),
    )[order]


@cache
def _legendre_rule() -> tuple[FloatArray, FloatArray]:
    return np.polynomial.legendre.leggauss(_LENGTH_NODES)
