"""The solution of a COG problem, with the residuals that show that it is optimal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from gaitopt.conventions import FloatArray, TextEnum

PRIMAL_TOLERANCE = 1e-9
"""Largest violation of a constraint in an accepted solution [m]. Chosen here: a hundred times the
accuracy of the QP solver, and far below what a robot can measure."""
ERROR_TOLERANCE = 1e-6
"""Largest bound on the distance from the true optimum in an accepted solution [m]. Chosen here: a
micrometre, far below what a robot can measure."""
ACTIVE_MULTIPLIER = 1e-6
"""Multiplier above which a constraint is said to be active. Chosen here: multipliers of active
constraints have the size of the distance that the body moves [m], and those of others that of the
QP solver's accuracy, 1e-11."""


class CogStatus(TextEnum):
    """The result of :func:`solve_cog`."""

    SOLVED = "solved"
    """The residuals are within tolerance."""
    NOT_VERIFIED = (
        "no solution was verified; usually there is none: reduce the stability margin, or take "
        "another body height or nearer footholds"
    )
    """The residuals are too large."""


@dataclass(frozen=True, eq=False)
class CogSolution:
    """A COG position with the residuals that show that it is optimal.

    Attributes:
        position: ``(2,)`` [m].
        distance: from the start [m].
        value: optimum of the objective: distance [m], margin [m] or reach fraction.
        margin: stability margin there [m]; ``inf`` when no leg is to swing.
        multipliers: multiplier of each constraint by name, scaled to the objective.
        active: names of the active constraints, which determine the optimum.
        status: whether the residuals below are within tolerance.
        primal: largest violation of a constraint [m].
        stationarity: largest entry of the Lagrangian's gradient.
        complementarity: sum of multipliers times slacks.
        error_bound: for ``"distance"`` a bound on the distance from the true optimum [m], for the
            others on the difference between the objective and its optimum. It is proven where no
            constraint is violated. A violation, of 1e-9 m at most, is taken into account to first
            order, by the multipliers.
        iterations: number of QPs that were solved.
    """

    position: FloatArray
    distance: float
    value: float
    margin: float
    multipliers: Mapping[str, float]
    active: tuple[str, ...]
    status: CogStatus
    primal: float
    stationarity: float
    complementarity: float
    error_bound: float
    iterations: int

    @property
    def solved(self) -> bool:
        """Whether the residuals are within tolerance."""
        return self.status is CogStatus.SOLVED


def distance_bound(slope: float, gap: float) -> float:
    """Bound on the distance of a place from the nearest one of the area [m].

    The Lagrangian is 1-strongly convex: ``r^2 / 2 <= gap + |slope| r`` for the distance ``r``.

    Args:
        slope: largest entry of the Lagrangian's gradient.
        gap: sum of multipliers times slacks.
    """
    return float(2.0**0.5 * slope + (2.0 * slope**2 + 2.0 * gap) ** 0.5)


def status_of(primal: float, error_bound: float) -> CogStatus:
    """Whether a violation and a bound on the error are within tolerance."""
    solved = primal <= PRIMAL_TOLERANCE and error_bound <= ERROR_TOLERANCE
    return CogStatus.SOLVED if solved else CogStatus.NOT_VERIFIED
