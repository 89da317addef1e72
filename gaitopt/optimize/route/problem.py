"""The time-optimal route as one smooth problem whose matrices are banded.

Unknowns are poses at knots and the times ``h`` between them; minimise the sum of all ``h``. Between
two knots every joint keeps its velocity limit, ``|q(k+1) - q(k)| <= w h``: the path's length in the
norm ``max |dq| / w`` (``docs/theory.md``), written so that it is smooth. All else are inequalities
at single knots: joint position limits, rows that are linear or separable quadratics of a pose, and
rows that are linear in the true centre of mass. There are no equalities: what is fixed is no
unknown.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.derivatives import RouteLinearisation
from gaitopt.optimize.route.layout import RouteLayout
from gaitopt.optimize.route.legs import JOINTS


@dataclass(frozen=True, eq=False)
class RouteProblem(RouteLayout):
    """A time-optimal route problem, as the interior-point method takes it."""

    @property
    def first_barrier(self) -> float:
        """First barrier parameter from a poor guess: small against an interval's time."""
        return 1e-2

    def first_guess(self) -> FloatArray:
        """The first guess as a vector of unknowns, with times a little longer than needed."""
        return self.unknowns_near(self.poses, 1e-2)

    def unknowns_near(self, poses: FloatArray, spare: float = 1e-3) -> FloatArray:
        """Unknowns of given poses ``(K, 9)``, with times a little longer than needed.

        Args:
            poses: of all knots.
            spare: added to every time, in units of time.
        """
        return self.pack(poses, 1.1 * self.least_times(poses) + spare * self.time_unit)

    def least_times(self, poses: FloatArray) -> FloatArray:
        """The least time between each two of ``poses (K, 9)`` ``(K - 1,)`` [s]."""
        joints = self.legs.joints(poses, self.feet, self.swing).reshape(-1, JOINTS)
        return np.asarray((np.abs(np.diff(joints, axis=0)) / self.velocity_limits).max(axis=1))

    def worst_knots(self, x: FloatArray, multipliers: FloatArray, count: int = 3) -> np.ndarray:
        """The knots at which the Lagrangian's gradient is largest ``(count,)``."""
        placed, at, _ = self.numbering
        slope = np.abs(
            self.linear_cost
            + self.quadratic_cost * x
            - self.linearise(x).jacobian_transpose_times(multipliers)
        )
        by_knot = np.where(placed >= 0, slope[np.maximum(placed, 0)], 0.0).max(axis=1)
        by_knot[1:] = np.maximum(by_knot[1:], slope[at])
        return np.argsort(-by_knot)[:count]

    @cached_property
    def linear_cost(self) -> FloatArray:
        """Gradient of the sum of all times."""
        _, at, size = self.numbering
        out = np.zeros(size)
        out[at] = 1.0
        return out

    @cached_property
    def quadratic_cost(self) -> FloatArray:
        """Diagonal of the small quadratic term that keeps knots apart, in the times only."""
        return self.linear_cost * self.quadratic_weight

    def values(self, x: FloatArray) -> FloatArray:
        """All inequalities, which must not be negative; NaN where a foot is out of reach."""
        poses, times = self.unpack(x)
        joints = self.legs.joints(poses, self.feet, self.swing).reshape(-1, JOINTS)
        return self.values_at(poses, times, joints)

    @property
    def restorable(self) -> int:
        """How many of the first inequalities can be met by giving intervals more time."""
        return 2 * (self.knots - 1) * JOINTS

    def restore(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Give intervals just so much more time that velocity limits keep their ``slack``.

        Args:
            x: unknowns.
            values: of all inequalities at ``x``.
            slack: what the velocity limits are to keep.

        Returns:
            Unknowns and values with the longer times.
        """
        count = self.restorable
        short = np.maximum(slack[:count] - values[:count], 0.0).reshape(2, -1, JOINTS)
        more = (short.max(axis=0) / self.turns).max(axis=1)
        out, after = x.copy(), values.copy()
        out[self.numbering[1]] += more
        after[:count] += np.tile((more[:, None] * self.turns).ravel(), 2)
        return out, after

    def linearise(self, x: FloatArray) -> RouteLinearisation:
        """Values and derivatives at ``x``."""
        return RouteLinearisation(self, x)
