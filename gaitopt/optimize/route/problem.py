"""The time-optimal walk without acceleration limits, as the interior-point method takes it.

The sum of all interval times ``h`` is minimised. In an interval every joint keeps its velocity
limit ``w``: ``|q(k+1) - q(k)| <= w h(k)``. So a time is at least the length of the path in the
norm ``max_j |dq_j| / w_j`` ([Wang2020], Section IV; ``docs/theory.md``); written as two
inequalities with an unknown time it is smooth. All other rows look at single poses: joint position
limits, rows that are linear or separable quadratics of a pose, and rows that are linear in the true
centre of mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray, frozen
from gaitopt.optimize.route.derivatives import RouteLinearisation
from gaitopt.optimize.route.layout import LastValues, RouteLayout
from gaitopt.optimize.route.legs import JOINTS

_TIME_FACTOR = 1.1
"""Times of a first guess over the least ones, so that velocity rows have some slack."""
_EXTRA_TIME = 1e-2
"""Added to the times of a poor first guess, in time units: intervals in which nothing moves yet
begin with a time, too."""
_LITTLE_EXTRA_TIME = 1e-3
"""The same near the minimum."""


@dataclass(frozen=True, eq=False)
class RouteProblem(RouteLayout):
    """The problem of a time-optimal walk without acceleration limits.

    It is a :class:`gaitopt.interior_point.problem.Problem`. Its unknown times are counted in
    :attr:`time_unit`.
    """

    @property
    def first_barrier(self) -> float:
        """First barrier parameter from a poor guess.

        The sum of all times changes by about one barrier parameter for each active row. This one
        is small against the time of an interval, which is about 0.1 to 1.
        """
        return 1e-2

    def first_guess(self) -> FloatArray:
        """The unknowns ``(n,)`` of the poses that the problem was made with."""
        return self.unknowns_near(self.poses, _EXTRA_TIME)

    def unknowns_near(
        self, poses: FloatArray, extra_time: float = _LITTLE_EXTRA_TIME
    ) -> FloatArray:
        """The unknowns ``(n,)`` of given poses, with times a little longer than needed.

        Args:
            poses: of all knots ``(K, 9)``.
            extra_time: added to every time, in time units.
        """
        times = _TIME_FACTOR * self.least_times(poses) + extra_time * self.time_unit
        return self.pack(poses, times)

    def least_times(self, poses: FloatArray) -> FloatArray:
        """The least time of every interval ``(K - 1,)`` [s] at given ``poses (K, 9)``."""
        turned = np.abs(np.diff(self.joints(poses), axis=0))
        return np.asarray((turned / self.velocity_limits).max(axis=1))

    def joints(self, poses: FloatArray) -> FloatArray:
        """Joint angles at poses of all knots ``(K, 12)`` [rad]; NaN out of reach."""
        return self.legs.joints(poses, self.feet, self.swing).reshape(-1, JOINTS)

    def largest_knots(self, v: FloatArray, count: int = 3) -> np.ndarray:
        """The knots at which a vector over all unknowns ``(n,)`` is largest ``(count,)``."""
        by_knot = self.of_poses(np.abs(v)).max(axis=1)
        by_knot[1:] = np.maximum(by_knot[1:], np.abs(v)[self.numbering.times])
        return np.argsort(-by_knot)[:count]

    @cached_property
    def linear_cost(self) -> FloatArray:
        """Gradient of the sum of all times ``(n,)``."""
        out = np.zeros(self.numbering.size)
        out[self.numbering.times] = 1.0
        return out

    @cached_property
    def quadratic_cost(self) -> FloatArray:
        """Diagonal of a small quadratic term in the times ``(n,)``.

        It keeps the times of intervals alike where the sum alone would leave them undetermined.
        """
        return self.linear_cost * self.quadratic_weight

    def values(self, x: FloatArray) -> FloatArray:
        """All inequalities ``(m,)``; NaN in some where a foot is out of reach."""
        poses, times = self.unpack(x)
        joints = self.joints(poses)
        values = self.row_values(poses, times, joints)
        # A line search ends where its last values were taken, and derivatives are wanted there.
        self.last_values[:] = [LastValues(frozen(x), frozen(joints), frozen(values))]
        return values

    @property
    def restorable(self) -> int:
        """Number of velocity rows, which come first: longer times meet all of them."""
        return 2 * (self.knots - 1) * JOINTS

    def restore(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Make intervals just so much longer that velocity rows keep their slacks.

        Args:
            x: unknowns ``(n,)``.
            values: of all inequalities at ``x`` ``(m,)``.
            slack: that the velocity rows are to keep ``(m,)``.

        Returns:
            Unknowns and values with the longer times.
        """
        count, limits = self.restorable, self.scaled_velocity_limits
        missing = np.maximum(slack[:count] - values[:count], 0.0).reshape(2, -1, JOINTS)
        extra_times = (missing.max(axis=0) / limits).max(axis=1)
        new_x, new_values = x.copy(), values.copy()
        new_x[self.numbering.times] += extra_times
        new_values[:count] += np.tile((extra_times[:, None] * limits).ravel(), 2)
        return new_x, new_values

    def linearise(self, x: FloatArray) -> RouteLinearisation:
        """Values and derivatives at ``x (n,)``."""
        return RouteLinearisation(self, x)
