"""The time-optimal route with bounded joint accelerations, and a ZMP that stays in its support.

Poses at knots are the control points of a quadratic B-spline in time. Its acceleration is constant
on a span about each knot: with spans ``d``, the velocity between the spans of knots ``k`` and ``k +
1`` is ``v(k) = (u(k+1) - u(k)) / h(k)`` with ``h(k) = (d(k) + d(k+1)) / 2``, and the acceleration
of span ``k`` is ``(v(k) - v(k-1)) / d(k)``. For the body and a flying foot that is exact; for the
joints, which follow by inverse kinematics, it holds up to the curvature of that map, and rows are
tightened by whoever looks there. The motion begins and ends at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.dynamic_derivatives import DynamicRouteLinearisation
from gaitopt.optimize.route.dynamic_layout import DynamicLayout, Entry
from gaitopt.optimize.route.problem import RouteProblem


@dataclass(frozen=True, eq=False)
class DynamicRouteProblem(DynamicLayout, RouteProblem):
    """A route problem with accelerations, as the interior-point method takes it."""

    @cached_property
    def linear_cost(self) -> FloatArray:
        """Gradient of the sum of all spans that are unknown."""
        out = np.array(super().linear_cost)
        out[self.numbering[1][-1]] += 1.0
        if self.entry is not None:
            out[self.numbering[1][0]] = 0.0
        return out

    @cached_property
    def quadratic_cost(self) -> FloatArray:
        """Diagonal of the small quadratic term; it also holds what nothing else looks at."""
        out = np.array(super().quadratic_cost)
        if self.entry is not None:
            out[self.numbering[1][0]] = 1.0
        return out

    @property
    def restorable(self) -> int:
        """None: a longer span changes accelerations, too."""
        return 0

    def restore(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Nothing is changed."""
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
        inside = (self.rows.knot > first) & (self.rows.knot <= last)
        rows = self.rows.chosen(inside).shifted(-first)
        near = (self.zmp.knot >= first) & (self.zmp.knot <= last)
        zmp = self.zmp.chosen(near).shifted(-first)
        return replace(
            self, feet=self.feet[first : last + 1], swing=self.swing[first : last + 1],
            poses=poses, unknown=unknown, rows=rows,
            acceleration_limits=self.acceleration_limits[:, first : last + 1],
            interval_velocity_limits=self.interval_velocity_limits[:, first:last], entry=entry,
            zmp=zmp,
        )  # fmt: skip

    def linearise(self, x: FloatArray) -> DynamicRouteLinearisation:
        """Values and derivatives at ``x``."""
        return DynamicRouteLinearisation(self, x)
