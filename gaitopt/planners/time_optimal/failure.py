"""Why a time-optimal route was not found, and the error that says so."""

from __future__ import annotations

from enum import Enum

import numpy as np

from gaitopt.errors import RouteError
from gaitopt.interior_point.solver import Solution
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.planners.time_optimal.walk import Route


class Reason(Enum):
    """Why a solution of the problem gives no walk; the value tells what to do.

    The problem looks at its knots only; all of these are found out between them.
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


def failed(
    route: Route,
    solution: Solution[RouteProblem],
    first: int,
    reason: Reason | None = None,
    worst: np.ndarray | None = None,
) -> RouteError:
    """The error of a route that was not found.

    Args:
        route: what was to be walked.
        solution: of the problem, which may be solved and still give no walk.
        first: the first step of the problem.
        reason: why the solution gives no walk; by default the solver's status says it.
        worst: the knots to blame; by default those with the worst residuals.
    """
    problem = solution.problem
    each = route.settings.stance_knots + route.settings.swing_knots
    worst = problem.largest_knots(solution.lagrangian_gradient()) if worst is None else worst
    steps = tuple(sorted({first + max(int(k) - 1, 0) // each for k in worst}))
    plan = route.phase_by_phase()
    offer = f" ({plan.duration:.1f} s) is in .plan" if plan else " failed, too"
    if plan and route.settings.true_com:
        offer += " (its margin is that of the body centre)"
    report = "\n".join(
        f"{i:4d} barrier {r.barrier:.1e} time {r.objective * problem.time_unit:.4f} s "
        f"gradient {r.stationarity:.1e} residual {r.residual:.1e} damping {r.damping:.1e}"
        for i, r in enumerate(solution.history)
    )
    return RouteError(
        f"no time-optimal route over steps {first} to {first + (problem.knots - 1) // each - 1} "
        f"was found: {reason or solution.status}. After {solution.iterations} iterations the "
        f"largest residuals are at steps {', '.join(map(str, steps))}: gradient "
        f"{solution.stationarity():.2g}, violation {solution.violation():.2g}. Free less, or take "
        "the walk planned phase by phase, which" + offer,
        steps, plan, report,
    )  # fmt: skip
