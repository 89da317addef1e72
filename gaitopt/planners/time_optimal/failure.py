"""Why a time-optimal walk was not found, and the error that says so."""

from __future__ import annotations

from enum import Enum

import numpy as np

from gaitopt.errors import RouteError
from gaitopt.interior_point.solver import Solution
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.planners.time_optimal.walk import Route


class Reason(Enum):
    """Why a solved problem gives no walk; the value says what to do.

    The inequalities of a problem hold at its knots. These reasons are found between them.
    """

    LIMITS_BETWEEN_KNOTS = (
        "joints exceed their limits, or the walk loses its margin or clearance, between knots; "
        "take more knots, or ask for less margin"
    )
    LIMITS_BETWEEN_WINDOWS = (
        "joints exceed their limits, or the walk loses its margin or clearance, where windows meet;"
        " take a longer horizon"
    )
    COM_MARGIN = (
        "the true centre of mass loses its margin between knots; take more knots, or com='body'"
    )
    CLEARANCE = (
        "feet lose their clearance between knots; take more knots, or ask for less clearance"
    )

    def __str__(self) -> str:
        return self.value


def route_error(
    route: Route,
    solution: Solution[RouteProblem],
    reason: Reason | None = None,
    worst_knots: np.ndarray | None = None,
) -> RouteError:
    """The error that says that no walk was found, with the walk planned phase by phase.

    Args:
        route: the walk, or the window of its steps, that was to be planned.
        solution: of its problem; it may be solved and still give no walk.
        reason: why the solution gives no walk; by default the solver's status says it.
        worst_knots: the knots to blame; by default those with the largest residuals.
    """
    problem = solution.problem
    if worst_knots is None:
        worst_knots = problem.largest_knots(solution.lagrangian_gradient())
    # The last knot of a step is also where the next one begins: it counts as the former's.
    within = {max(int(k) - 1, 0) // route.intervals for k in worst_knots}
    steps = tuple(sorted(route.first_step + step for step in within))
    last = route.first_step + route.count - 1
    plan = route.phase_by_phase()
    offer = " failed, too" if plan is None else f" ({plan.duration:.1f} s) is in .plan"
    return RouteError(
        f"no time-optimal route over steps {route.first_step} to {last} was found: "
        f"{reason or solution.status}. After {solution.iterations} iterations the largest "
        f"residuals are at steps {', '.join(map(str, steps))}: gradient "
        f"{solution.stationarity():.2g}, violation {solution.violation():.2g}. Free less, or take "
        f"the walk planned phase by phase, which{offer}",
        steps, plan, _report(solution),
    )  # fmt: skip


def _report(solution: Solution[RouteProblem]) -> str:
    """The solver's iterations, one line each."""
    unit = solution.problem.time_unit
    return "\n".join(
        f"{i:4d} barrier {r.barrier:.1e} time {r.linear_objective * unit:.4f} s "
        f"gradient {r.stationarity:.1e} residual {r.residual:.1e} damping {r.damping:.1e}"
        for i, r in enumerate(solution.history)
    )
