"""The box swing over time: straight up, straight across, straight down, at rest at the corners."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.swing.box import box_corners
from gaitopt.swing.curve import SwingCurve, smooth_step

_NO_EDGE = 1e-100
"""Share of the duration below which an edge counts as a point, so that none divides by zero."""


class BoxSwing(SwingCurve):
    """The box of :func:`gaitopt.swing.box.box_corners` with a smooth stop at each corner.

    Along each edge the foot moves by ``10 s^3 - 15 s^4 + 6 s^5``: velocity and acceleration are
    zero at both ends and at the two corners in between. The times of the edges are in proportion to
    the square roots of their lengths, so that the largest acceleration is the same on each.

    Source: [Wang2020], Section II.E and Fig. 5, for the path; the timing is gaitopt's own.
    """

    smoothness: ClassVar[int] = 2
    rest_order: ClassVar[int] = 2

    @property
    def breaks(self) -> FloatArray:
        """Shares of the duration ``(..., 2)`` at which the foot is at the box's upper corners.

        They coincide where the foot steps on the spot; one coincides with an end of the swing where
        the foot does not rise or sink there. For a foot that stands still they are thirds.
        """
        return self._times()[1][..., 1:3]

    @property
    def peak_speed(self) -> FloatArray:
        """The foot's largest speed ``(...)`` [m/s], exact, in the middle of the longest edge.

        With edges a, b, c: ``15/8 sqrt(max(a, b, c)) (sqrt(a) + sqrt(b) + sqrt(c))`` over the
        duration.
        """
        roots = np.sqrt(self._lengths())
        return np.asarray(1.875 * roots.max(axis=-1) * roots.sum(axis=-1) / self.duration)

    @property
    def length(self) -> FloatArray:
        """Length ``(...)`` of the foot's path [m], exact."""
        return np.asarray(self._lengths().sum(axis=-1))

    def _corners(self) -> FloatArray:
        return box_corners(self.start, self.end, self.height)

    def _lengths(self) -> FloatArray:
        edges = np.diff(self._corners(), axis=-2)
        across = np.hypot(edges[..., 1, 0], edges[..., 1, 1])
        return np.stack([edges[..., 0, 2], across, -edges[..., 2, 2]], axis=-1)

    def _times(self) -> tuple[FloatArray, FloatArray]:
        """Shares of the three edges ``(..., 3)``, and of the four corners ``(..., 4)``."""
        roots = np.sqrt(self._lengths())
        total = roots.sum(axis=-1, keepdims=True)
        shares = np.where(total > 0.0, roots, 1.0) / np.where(total > 0.0, total, 3.0)
        corners = np.zeros((*shares.shape[:-1], 4))
        corners[..., 1] = shares[..., 0]
        corners[..., 2] = np.maximum(1.0 - shares[..., 2], shares[..., 0])
        corners[..., 3] = 1.0
        return shares, corners

    def _shape(self, share: FloatArray, order: int) -> FloatArray:
        shares, times = self._times()
        edge = np.asarray((share[..., None] >= times[..., 1:3]).sum(axis=-1))
        taken = _pick(shares[..., None], edge)[..., 0]
        rate = np.divide(1.0, taken, out=np.zeros_like(taken), where=taken > _NO_EDGE)
        passed = (share - _pick(times[..., None], edge)[..., 0]) * rate
        left = (_pick(times[..., None], edge + 1)[..., 0] - share) * rate
        # Places are measured from the nearer corner, so that the corners are exact.
        first = passed < 0.5
        corners = self._corners()
        near = _pick(corners, np.where(first, edge, edge + 1))
        way = _pick(corners, np.where(first, edge + 1, edge)) - near
        part = np.clip(np.where(first, passed, left), 0.0, 1.0)  # against rounding
        out = way * smooth_step(part, order)[..., None]
        if order == 0:
            return np.asarray(near + out)
        sign = np.where(first, 1.0, (-1.0) ** order)
        return np.asarray(out * (sign * rate**order)[..., None])


def _pick(rows: FloatArray, index: np.ndarray) -> FloatArray:
    """The row ``index (...)`` of each of ``rows (..., k, n)``: ``(..., n)``."""
    everywhere = np.broadcast_to(rows, (*index.shape, *rows.shape[-2:]))
    return np.take_along_axis(everywhere, index[..., None, None], axis=-2)[..., 0, :]
