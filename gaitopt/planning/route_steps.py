"""What a time-optimal route walks, the per-phase walk that shows the way, and how it fails."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import GaitoptError, SolverError
from gaitopt.optimize.route_problem import RouteProblem
from gaitopt.optimize.route_solver import Answer
from gaitopt.planning.crawl import (
    CrawlSteps,
    check_robot,
    check_stance,
    crawl_steps,
    optimise_cogs,
    plan_in_order,
    start_place,
)
from gaitopt.planning.diagnosis import check_heights
from gaitopt.planning.plan import Plan
from gaitopt.planning.route_collision import Shapes
from gaitopt.planning.route_knots import RouteKnots, build_route, lay_knots
from gaitopt.planning.route_settings import RouteSettings
from gaitopt.planning.settings import CrawlSettings
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds


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


@dataclass(frozen=True, eq=False)
class Route:
    """What is to be walked, and the per-phase walk that shows the way.

    Attributes:
        robot, footholds, settings: of the walk.
        steps: its steps, in the heading frame.
        cogs: body centre before and after each stance phase of the per-phase walk ``(S + 1, 3)``.
        cog_start: what was asked for.
        shapes: of the legs, to be kept apart; ``None`` where they are meshes.
    """

    robot: Quadruped
    footholds: Footholds
    settings: RouteSettings
    steps: CrawlSteps
    cogs: FloatArray
    cog_start: ArrayLike | None
    shapes: Shapes | None

    def part(self, first: int, last: int) -> CrawlSteps:
        """The steps from ``first`` up to, not including, ``last``."""
        s = self.steps
        return CrawlSteps(
            s.legs[first:last], s.feet[first:last], s.targets[first:last], s.heights[first:last],
            s.start_height,
        )  # fmt: skip

    def phase_by_phase(self) -> Plan | None:
        """The paper's plan over the same footholds; ``None`` where there is none."""
        s = self.settings
        try:
            return plan_in_order(self.robot, self.footholds, crawl_settings(s), self.cog_start)
        except GaitoptError:
            return None


def crawl_settings(settings: RouteSettings) -> CrawlSettings:
    """Settings of the walk phase by phase over the same footholds."""
    return CrawlSettings(
        stability_margin=settings.stability_margin, body_height=settings.body_height,
        swing_height=settings.swing_height, sequence=settings.sequence,
        reach_fraction=settings.reach_fraction, heading=settings.heading,
        follow_terrain=settings.follow_terrain,
    )  # fmt: skip


def prepared(
    robot: Quadruped, footholds: Footholds, settings: RouteSettings, cog_start: ArrayLike | None
) -> Route:
    """Steps and COG targets of the per-phase walk.

    Raises:
        InfeasibleStepError: a step is impossible.
    """
    paper = crawl_settings(settings)
    check_robot(robot)
    steps = crawl_steps(footholds, paper)
    check_stance(steps)
    check_heights(robot, steps, paper)
    start = start_place(robot, steps, paper, cog_start)
    solutions = optimise_cogs(robot, steps, paper, start)
    ends = [np.append(s.position, z) for s, z in zip(solutions, steps.heights, strict=True)]
    return Route(robot, footholds, settings, steps, np.vstack([start, *ends]), cog_start,
                 Shapes.of(robot))  # fmt: skip


def knots_of(route: Route, first: int, last: int) -> RouteKnots:
    """The knots of the steps from ``first`` up to, not including, ``last``."""
    return lay_knots(route.part(first, last), route.settings.stance_knots,
                     route.settings.swing_knots)  # fmt: skip


def problem_of(route: Route, first: int, last: int) -> RouteProblem:
    return build_route(
        route.robot, route.part(first, last), route.settings, route.cogs[first : last + 1],
        route.footholds.radius,
    )[1]  # fmt: skip


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
