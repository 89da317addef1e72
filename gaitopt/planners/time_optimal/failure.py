"""The error of a walk that was not found."""

from __future__ import annotations

import numpy as np

from gaitopt.errors import SolverError
from gaitopt.interior_point.solver import Answer
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.plan import Plan
from gaitopt.planners.time_optimal.walk import Route


class RouteError(SolverError):
    """The time-optimal route did not converge.

    Attributes:
        steps: the steps at which the residuals are largest.
        plan: the walk planned phase by phase, which is feasible.
        report: the solver's iterations, a line each.
    """

    def __init__(self, message: str, steps: tuple[int, ...], plan: Plan | None, report: str):
        super().__init__(message)
        self.steps, self.plan, self.report = steps, plan, report

    def __reduce__(self) -> tuple[object, ...]:
        return (RouteError, (str(self), self.steps, self.plan, self.report))


def failed(
    route: Route,
    problem: RouteProblem,
    answer: Answer,
    first: int,
    worst: np.ndarray | None = None,
) -> RouteError:
    """The error for an answer that is none.

    Args:
        route, problem, answer: what was to be walked, and what came of it.
        first: the first step of the problem.
        worst: the knots to blame; by default those with the worst residuals.
    """
    each = route.settings.stance_knots + route.settings.swing_knots
    worst = problem.worst_knots(answer.x, answer.duals) if worst is None else worst
    steps = tuple(sorted({first + max(int(k) - 1, 0) // each for k in worst}))
    plan = route.phase_by_phase()
    offer = f" ({plan.duration:.1f} s) is in .plan" if plan else " failed, too"
    if plan and route.settings.true_com:
        offer += " (its margin is that of the body centre)"
    report = "\n".join(
        f"{i:4d} barrier {r[0]:.1e} time {r[1] * problem.unit:.4f} s gradient {r[2]:.1e} "
        f"gap {r[3]:.1e} shift {r[4]:.1e}"
        for i, r in enumerate(answer.history)
    )
    return RouteError(
        f"the time-optimal route over steps {first} to {first + (problem.knots - 1) // each - 1} "
        f"did not converge ({answer.status} after {answer.iterations} iterations), worst at "
        f"steps {', '.join(map(str, steps))}: gradient {answer.stationarity:.2g}, violation "
        f"{answer.primal:.2g}; free less, or take the walk planned phase by phase, which" + offer,
        steps, plan, report,
    )  # fmt: skip
