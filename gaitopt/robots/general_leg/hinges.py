"""Three hinges in a row and a foot, whatever the directions and places of their axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, frozen


class Placed(NamedTuple):
    """Hinges at joint angles, in the body frame.

    Attributes:
        axes: unit axes ``(..., 3, 3)``, one a row.
        points: a point on each ``(..., 3, 3)`` [m].
        foot: ``(..., 3)`` [m].
    """

    axes: FloatArray
    points: FloatArray
    foot: FloatArray

    @property
    def jacobian(self) -> FloatArray:
        """Derivative of the foot by the joints ``(..., 3, 3)`` [m/rad]."""
        rows = np.cross(self.axes, self.foot[..., None, :] - self.points)
        return np.asarray(np.swapaxes(rows, -1, -2))

    def jacobian_rate(self, rates: FloatArray) -> FloatArray:
        """Derivative of :attr:`jacobian` over time ``(..., 3, 3)``.

        Args:
            rates: joint velocities ``(..., 3)`` [rad/s].
        """
        turns = self.axes * rates[..., None]
        velocity = (self.jacobian @ rates[..., None])[..., 0]
        columns = []
        for i in range(3):
            axis, point = self.axes[..., i, :], self.points[..., i, :]
            before = turns[..., :i, :]
            spin = before.sum(axis=-2)
            arms = point[..., None, :] - self.points[..., :i, :]
            moved = np.cross(before, arms).sum(axis=-2)
            turned = np.cross(np.cross(spin, axis), self.foot - point)
            columns.append(turned + np.cross(axis, velocity - moved))
        return np.stack(columns, axis=-1)


@dataclass(frozen=True, eq=False)
class ThreeHinges:
    """The hinges at zero joint angles, in the body frame.

    Attributes:
        axes: unit axes ``(3, 3)``, one a row, from body to foot.
        points: a point on each axis ``(3, 3)`` [m].
        foot: ``(3,)`` [m].
    """

    axes: FloatArray
    points: FloatArray
    foot: FloatArray

    def __post_init__(self) -> None:
        for name in ("axes", "points", "foot"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def moved(self, point: Any, q: tuple[Any, ...]) -> tuple[Any, Any, Any]:
        """Where a point [m] goes when the first ``len(q)`` joints turn by angles [rad].

        Takes arrays or CasADi symbols. It is a product of exponentials: each joint turns what is
        beyond it about its axis at zero angles, the last joint first. Source: [Brockett1984].
        """
        x, y, z = point
        for i in range(len(q) - 1, -1, -1):
            (ax, ay, az), (px, py, pz) = self.axes[i], self.points[i]
            x, y, z = x - px, y - py, z - pz
            sine, cosine = np.sin(q[i]), np.cos(q[i])
            along = (ax * x + ay * y + az * z) * (1.0 - cosine)
            x, y, z = (
                px + ax * along + cosine * x + sine * (ay * z - az * y),
                py + ay * along + cosine * y + sine * (az * x - ax * z),
                pz + az * along + cosine * z + sine * (ax * y - ay * x),
            )
        return x, y, z

    def placed(self, q: FloatArray) -> Placed:
        """The hinges at joint angles ``q (..., 3)`` [rad]."""
        columns = tuple(np.moveaxis(q, -1, 0))

        def at(point: FloatArray, joints: int) -> FloatArray:
            lead = np.zeros(q.shape[:-1])
            return np.stack([x + lead for x in self.moved(point, columns[:joints])], axis=-1)

        points = [at(self.points[i], i) for i in range(3)]
        ends = [at(self.points[i] + self.axes[i], i) for i in range(3)]
        places = np.stack(points, axis=-2)
        return Placed(np.stack(ends, axis=-2) - places, places, at(self.foot, 3))
