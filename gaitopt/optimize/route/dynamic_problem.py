"""The time-optimal walk with acceleration limits, as the interior-point method takes it.

Poses at knots are the control points of a quadratic B-spline in time. Its acceleration is constant
on a span about each knot: with spans ``d``, the velocity at the border of the spans of knots ``k``
and ``k + 1`` is ``v(k) = (u(k+1) - u(k)) / h(k)`` with ``h(k) = (d(k) + d(k+1)) / 2``, and the
acceleration in span ``k`` is ``(v(k) - v(k-1)) / d(k)``. For body and flying foot that is exact.
For joints, which follow by inverse kinematics, it holds up to the curvature of that map: whoever
states their limits has to allow for it (:mod:`gaitopt.planners.time_optimal.smooth.between`). The
motion ends at rest, and begins at rest or with a given velocity.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.dynamic_derivatives import DynamicRouteLinearisation
from gaitopt.optimize.route.dynamic_layout import DynamicLayout, Entry
from gaitopt.optimize.route.problem import RouteProblem


@dataclass(frozen=True, eq=False, kw_only=True)
class DynamicRouteProblem(DynamicLayout, RouteProblem):
    """The problem of a time-optimal walk with acceleration limits.

    It is a :class:`gaitopt.interior_point.problem.Problem`.
    """

    @cached_property
    def linear_cost(self) -> FloatArray:
        """Gradient of the sum of all spans that are unknown ``(n,)``."""
        out = np.array(super().linear_cost)
        # The last span is as long as the one before it, and so counts with it.
        out[self.numbering.times[-1]] += 1.0
        if self.entry is not None:
            out[self.numbering.times[0]] = 0.0
        return out

    @cached_property
    def quadratic_cost(self) -> FloatArray:
        """Diagonal of the small quadratic term in the times ``(n,)``.

        With an entry no row looks at the first number, as its span is given: a quadratic cost of
        its own keeps the Newton matrix positive definite.
        """
        out = np.array(super().quadratic_cost)
        if self.entry is not None:
            out[self.numbering.times[0]] = 1.0
        return out

    @property
    def restorable(self) -> int:
        """None: a longer span changes accelerations, too."""
        return 0

    def restore(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Change nothing."""
        return x, values

    def window(
        self, first: int, last: int, poses: FloatArray, entry: Entry | None
    ) -> DynamicRouteProblem:
        """The problem from one knot to another, at whose end the motion rests.

        Args:
            first, last: knots; the first one's pose is fixed.
            poses: first guess ``(last - first + 1, 9)``, with the first pose as it is.
            entry: how the motion comes in there.
        """
        unknown = self.unknown[first : last + 1].copy()
        unknown[0] = -1
        free = unknown >= 0
        unknown[free] -= unknown[free].min()
        rows_inside = (self.rows.knot > first) & (self.rows.knot <= last)
        zmp_inside = (self.zmp.knot >= first) & (self.zmp.knot <= last)
        return replace(
            self, feet=self.feet[first : last + 1], swing=self.swing[first : last + 1],
            poses=poses, unknown=unknown, rows=self.rows.chosen(rows_inside).shifted(-first),
            acceleration_limits=self.acceleration_limits[:, first : last + 1],
            interval_velocity_limits=self.interval_velocity_limits[:, first:last],
            zmp=self.zmp.chosen(zmp_inside).shifted(-first), entry=entry,
            com=None if self.com is None else self.com.between(first, last),
        )  # fmt: skip

    def linearise(self, x: FloatArray) -> DynamicRouteLinearisation:
        """Values and derivatives at ``x (n,)``."""
        return DynamicRouteLinearisation(self, x)
