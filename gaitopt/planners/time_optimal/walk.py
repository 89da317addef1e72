"""A walk that is planned as one optimisation problem, and what is known of it before."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import GRAVITY, FloatArray, rotation_z
from gaitopt.errors import GaitoptError
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.base import VELOCITY
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.phase_by_phase.diagnosis import check_heights
from gaitopt.planners.phase_by_phase.planner import plan_in_order
from gaitopt.planners.phase_by_phase.steps import CrawlSteps, check_roll, check_stance, crawl_steps
from gaitopt.planners.phase_by_phase.targets import optimise_cogs, start_place
from gaitopt.robots.collisions.pairs import CollisionPairs
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds


class Ramps(NamedTuple):
    """How sharp turns are on splines whose timing forces set.

    Attributes:
        loads: time in which the slowest joint reaches its velocity limit about lift-offs and
            touchdowns, where loads go over from leg to leg [s].
        elsewhere: the same anywhere else [s].
        most: largest acceleration of a leg's end by that of one joint, in units of gravity.
    """

    loads: float
    elsewhere: float
    most: float = 3.0


RAMPS = RISING_RAMPS = Ramps(0.002, 0.0015, most=6.0)
POSTURE_RAMPS, DYNAMIC_RAMPS = Ramps(0.03, 0.02), Ramps(0.06, 0.035)
"""Where the body stays level at one height, and at any; where it may turn, too; and where forces
alone keep the balance. Loads that go over jump with sharp turns, and ground gives way: so such
walks have loads that go over gently, the controller of ``simulate`` eases what jumps, and servos do
not drive joints far beyond their limits. With them knees of wang2020 reach 120 (``swing``) and
113 % of their velocity limits (``height``; 64 steps, seed 0). The first two are as sharp as pays:
with 9 g these walks came out equally fast. ``posture`` came out no faster with 0.005 s, and a knee
reached 137 % (16 steps, seed 2) before servos did so. ``dynamic`` has no gentle loads, and is 5 %
slower with them and sharp turns."""


@dataclass(frozen=True, eq=False)
class Route:
    """A walk that is planned as one problem: the whole walk, or a window of its steps.

    Attributes:
        robot, footholds, settings: of the whole walk.
        steps: the steps to plan, in the heading frame.
        cogs: body centre before and after the stance phase of each of them ``(S + 1, 3)`` [m], of
            the walk that is planned phase by phase.
        shapes: collision shapes of the legs, which must not touch each other; ``None`` where
            they are meshes whose hulls are not known.
        first_step: index of the first of these steps in the whole walk.
    """

    robot: Quadruped
    footholds: Footholds
    settings: RouteSettings
    steps: CrawlSteps
    cogs: FloatArray
    shapes: CollisionPairs | None
    first_step: int = 0

    @property
    def count(self) -> int:
        """Number of steps."""
        return len(self.steps.legs)

    @property
    def intervals(self) -> int:
        """Intervals of each step."""
        return self.settings.stance_knots + self.settings.swing_knots

    @property
    def acceleration_limit(self) -> float:
        """Limit of joint accelerations along splines [rad/s^2].

        Where forces set the timing and no other is asked for, it only keeps the spline from
        bending more than what forces could follow, about lift-offs and touchdowns.
        """
        return self._acceleration(self._ramps.loads)

    @property
    def turn_limit(self) -> float:
        """The same elsewhere on a spline whose timing forces set [rad/s^2]."""
        return self._acceleration(self._ramps.elsewhere)

    @property
    def _ramps(self) -> Ramps:
        free = self.settings.free
        if not self.settings.static:
            return DYNAMIC_RAMPS
        if free.posture:
            return POSTURE_RAMPS
        return RISING_RAMPS if free.height else RAMPS

    def _acceleration(self, ramp: float) -> float:
        """The limit that was asked for, or that of a ramp [rad/s^2]."""
        asked = self.settings.acceleration_limit
        if asked is not None:
            return asked
        legs = self.robot.legs.values()
        quick = min(float(leg.velocity_limits.min()) for leg in legs) / ramp
        return min(quick, self._ramps.most * GRAVITY / max(leg.reach for leg in legs))

    def window(self, first: int, last: int) -> Route:
        """The steps from ``first`` up to, not including, ``last``, counted within this route."""
        return replace(
            self, steps=self.steps.part(first, last), cogs=self.cogs[first : last + 1],
            first_step=self.first_step + first,
        )  # fmt: skip

    def phase_by_phase(self) -> Plan | None:
        """The plan of [Wang2020] over all footholds; ``None`` where it is not possible."""
        try:
            return plan_in_order(self.robot, self.footholds, crawl_settings(self.settings))
        except GaitoptError:
            return None


def crawl_settings(settings: RouteSettings) -> CrawlSettings:
    """Settings of the same walk planned phase by phase."""
    return CrawlSettings(
        stability_margin=settings.stability_margin, body_height=settings.body_height,
        swing_height=settings.swing_height, sequence=settings.sequence,
        reach_fraction=settings.reach_fraction, heading=settings.heading,
        follow_terrain=settings.follow_terrain, cog_start=settings.cog_start, timing=VELOCITY,
        com=settings.com,
    )  # fmt: skip


def prepare_route(
    robot: Quadruped, footholds: Footholds, settings: RouteSettings, planned: Plan | None = None
) -> Route:
    """The whole walk, with the targets of the body centre of the walk planned phase by phase.

    Args:
        robot, footholds, settings: of the walk.
        planned: a walk phase by phase of this robot over these footholds, if there is one. Where it
            has the same settings, its targets are taken and not found anew.

    Raises:
        InputError: the robot's legs cannot move sideways, or they cross at the start.
        InfeasibleStepError: the walk planned phase by phase is not possible.
    """
    crawl = crawl_settings(settings)
    check_roll("plan_route", robot)
    robot.require_velocity_limits()
    steps = crawl_steps(footholds, crawl)
    check_stance(steps)
    check_heights(robot, steps, crawl)
    same = replace(crawl, sequence=crawl.order_over(footholds))
    if planned is not None and planned.settings == same and planned.phases:
        world = [planned.phases[0].cog_start, *(p.cog_end for p in planned.phases[::2])]
        cogs = np.array(world) @ rotation_z(crawl.heading)
    else:
        start = start_place(robot, steps, crawl)
        targets = optimise_cogs(robot, steps, crawl, start)
        ends = [np.append(t.position, z) for t, z in zip(targets, steps.heights, strict=True)]
        cogs = np.vstack([start, *ends])
    return Route(robot, footholds, settings, steps, cogs, CollisionPairs.of(robot))
