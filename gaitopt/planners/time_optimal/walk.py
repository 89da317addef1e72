"""What a time-optimal route walks, the per-phase walk that shows the way, and how it fails."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import GaitoptError
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.phase_by_phase.diagnosis import check_heights
from gaitopt.planners.phase_by_phase.planner import plan_in_order
from gaitopt.planners.phase_by_phase.steps import CrawlSteps, check_robot, check_stance, crawl_steps
from gaitopt.planners.phase_by_phase.targets import optimise_cogs, start_place
from gaitopt.robots.collision_shapes import CollisionPairs
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds


@dataclass(frozen=True, eq=False)
class Route:
    """What is to be walked, and the per-phase walk that shows the way.

    Attributes:
        robot, footholds, settings: of the walk.
        steps: its steps, in the heading frame.
        cogs: body centre before and after each stance phase of the per-phase walk ``(S + 1, 3)``.
        shapes: of the legs, to be kept apart; ``None`` where they are meshes.
    """

    robot: Quadruped
    footholds: Footholds
    settings: RouteSettings
    steps: CrawlSteps
    cogs: FloatArray
    shapes: CollisionPairs | None

    def part(self, first: int, last: int) -> CrawlSteps:
        """The steps from ``first`` up to, not including, ``last``."""
        s = self.steps
        return CrawlSteps(
            s.legs[first:last], s.feet[first:last], s.targets[first:last], s.heights[first:last],
            s.start_height,
        )  # fmt: skip

    def phase_by_phase(self) -> Plan | None:
        """The plan phase by phase over the same footholds; ``None`` where there is none."""
        try:
            return plan_in_order(self.robot, self.footholds, crawl_settings(self.settings))
        except GaitoptError:
            return None


def crawl_settings(settings: RouteSettings) -> CrawlSettings:
    """Settings of the walk phase by phase over the same footholds."""
    return CrawlSettings(
        stability_margin=settings.stability_margin, body_height=settings.body_height,
        swing_height=settings.swing_height, sequence=settings.order,
        reach_fraction=settings.reach_fraction, heading=settings.heading,
        follow_terrain=settings.follow_terrain, cog_start=settings.cog_start,
    )  # fmt: skip


def prepared(robot: Quadruped, footholds: Footholds, settings: RouteSettings) -> Route:
    """Steps and COG targets of the per-phase walk.

    Raises:
        InfeasibleStepError: a step is impossible.
    """
    paper = crawl_settings(settings)
    check_robot(robot)
    steps = crawl_steps(footholds, paper)
    check_stance(steps)
    check_heights(robot, steps, paper)
    start = start_place(robot, steps, paper)
    solutions = optimise_cogs(robot, steps, paper, start)
    ends = [np.append(s.position, z) for s, z in zip(solutions, steps.heights, strict=True)]
    return Route(robot, footholds, settings, steps, np.vstack([start, *ends]),
                 CollisionPairs.of(robot))  # fmt: skip
