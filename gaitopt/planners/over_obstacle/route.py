"""Footholds and postures of a walk over an obstacle, before anything is timed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, leg_index
from gaitopt.errors import StrideFault
from gaitopt.optimize.posture.problem import BodyPose, build_posture_problem
from gaitopt.optimize.posture.solver import PostureSolution, solve_posture
from gaitopt.plan.settings.over_obstacle import StrideSettings
from gaitopt.planners.over_obstacle.layout import Gaps, Layout, footholds, lay_out, stands_over
from gaitopt.robots.quadruped import Quadruped
from gaitopt.swing.obstacle_paths import obstacle_path
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.obstacles import Obstacle

REACH_RESERVE = 0.999
"""Share of the reach that postures use, so that curves between waypoints stay within it."""
STILL = 1e-6
"""A posture as near to the one before as this is that one [m, rad]."""
SWING_SAMPLES = 9


class Step(NamedTuple):
    """One leg's step.

    Attributes:
        leg: which.
        cycle: of the walk, from 0.
        over: whether it leads over the obstacle.
        feet: where the feet are before it ``(4, 3)`` [m].
        target: where the foot touches down ``(3,)`` [m].
        pose: of the body during it.
    """

    leg: str
    cycle: int
    over: bool
    feet: FloatArray
    target: FloatArray
    pose: BodyPose

    @property
    def landed(self) -> FloatArray:
        """Where the feet are after it ``(4, 3)`` [m]."""
        feet: FloatArray = self.feet.copy()
        feet[leg_index(self.leg)] = self.target
        return feet


class Demand(NamedTuple):
    """What rounds have found to be needed.

    Attributes:
        gaps: between the obstacle and the feet beside it.
        lift: how much higher than needed for the foot alone strides go over it [m].
        margin: stability margin that postures are asked for [m].
        foot: what feet keep from the obstacle on top of their margin [m].
    """

    gaps: Gaps
    lift: float
    margin: float
    foot: float = 0.0

    def widened(self, leg: str, across: float, extent: tuple[float, float], by: float) -> Demand:
        """With more room for a leg whose foot is at ``across`` an obstacle of some ``extent``."""
        if extent[0] < across < extent[1]:
            return self._replace(lift=self.lift + by)
        return self._replace(gaps=self.gaps.widened(leg, after=across >= extent[1], by=by))


@dataclass(frozen=True, eq=False)
class StrideRoute:
    """A walk before timing.

    Attributes:
        robot: the robot.
        obstacle: what is in the way.
        settings: what was asked.
        demand: gaps, lift and margin that it needs.
        layout: its cycles.
        footholds: in the world.
        start, end: poses before the first and after the last step.
        steps: all steps.
    """

    robot: Quadruped
    obstacle: Obstacle
    settings: StrideSettings
    demand: Demand
    layout: Layout
    footholds: Footholds
    start: BodyPose
    end: BodyPose
    steps: tuple[Step, ...]

    @property
    def raised(self) -> Obstacle:
        """The obstacle that paths go over: lifted, where they have to go higher."""
        x, y, z = self.obstacle.position
        return replace(self.obstacle, position=(x, y, z + self.demand.lift))

    @property
    def foot_margin(self) -> float:
        """Distance that the centre of a foot's ball keeps from the obstacle [m]."""
        return self.settings.margin + self.demand.foot + self.robot.foot_radius

    def waypoints(self, step: Step) -> FloatArray:
        """Places of the foot on its way ``(n, 3)`` [m]."""
        start = step.feet[leg_index(step.leg)]
        if step.over:
            path = obstacle_path(
                start, step.target, self.raised, self.foot_margin,
                pattern=self.settings.pattern, count=self.settings.waypoints,
            )  # fmt: skip
            return path.waypoints
        share = np.linspace(0.0, 1.0, SWING_SAMPLES)[:, None]
        way = start + share * (step.target - start)
        way[:, 2] += self.settings.swing_height * 4.0 * (share * (1.0 - share))[:, 0]
        return np.asarray(way)


def make_route(
    robot: Quadruped, obstacle: Obstacle, settings: StrideSettings, demand: Demand
) -> StrideRoute:
    """Footholds and postures of a demand.

    Raises:
        StrideFault: a posture is impossible.
    """
    if stands_over(robot, obstacle, demand.gaps) < 0.0:
        raise StrideFault(
            f"{robot.name} stands {robot.stance_size[0]:.4g} m long, and beside an obstacle "
            f"{obstacle.width:.4g} m wide its feet need {demand.gaps.front_after:.3g} and "
            f"{demand.gaps.hind_before:.3g} m between them and it",
            cause="short",
        )
    layout = lay_out(robot, obstacle, demand.gaps, settings.approach, settings.leave)
    places = footholds(robot, obstacle, layout)
    start, end = (
        _square_pose(robot, obstacle, settings, float(layout.centres[k])) for k in (0, -1)
    )
    route = StrideRoute(robot, obstacle, settings, demand, layout, places, start, end, ())
    feet, pose = places.array[:, 0].copy(), start
    steps: list[Step] = []
    for cycle in range(layout.cycles):
        for leg in settings.sequence:
            target = places[leg][cycle + 1]
            step = Step(leg, cycle, layout.strides_over(leg, cycle), feet.copy(), target, pose)
            steps.append(
                step._replace(pose=_or_still(pose, _posture(route, step, len(steps)).pose))
            )
            feet, pose = step.landed, steps[-1].pose
    last = _settled(route, feet, pose)
    return replace(route, steps=tuple(steps), end=last)


def _square_pose(
    robot: Quadruped, obstacle: Obstacle, settings: StrideSettings, centre: float
) -> BodyPose:
    """The body level above four square feet."""
    local = np.array([centre, 0.0, robot.foot_radius + settings.body_height])
    return BodyPose(obstacle.to_world(local), np.array([0.0, 0.0, obstacle.yaw]))


def _posture(route: StrideRoute, step: Step, number: int) -> PostureSolution:
    """The nearest posture from which a step is possible; the step's own pose is the one before."""
    settings, robot = route.settings, route.robot
    places = [step.target]
    if step.over:
        way = route.waypoints(step)
        top = np.flatnonzero(way[:, 2] > way[:, 2].max() - 1e-6)
        places += [way[top[0]], way[top[-1]]]
    problem = build_posture_problem(
        robot, dict(zip(LEGS, step.feet, strict=True)), step.pose, swing=step.leg, places=places,
        margin=route.demand.margin, reach_fraction=settings.reach_fraction * REACH_RESERVE,
    )  # fmt: skip
    found = solve_posture(problem)
    if not found.solved:
        length = float(np.linalg.norm(step.target - problem.feet[leg_index(step.leg)]))
        raise StrideFault(
            f"step {number}: no posture keeps a margin of {route.demand.margin:.4g} m while "
            f"{step.leg} steps {length:.3g} m{' over the obstacle' if step.over else ''}",
            step.leg, number, "posture", found,
        )  # fmt: skip
    return found


def _settled(route: StrideRoute, feet: FloatArray, before: BodyPose) -> BodyPose:
    """The recovery state: level above the last square of feet."""
    found = solve_posture(
        build_posture_problem(
            route.robot,
            dict(zip(LEGS, feet, strict=True)),
            route.end,
            reach_fraction=route.settings.reach_fraction * REACH_RESERVE,
            margin=route.demand.margin,
        )
    )
    return _or_still(before, found.pose) if found.solved else before


def _or_still(before: BodyPose, found: BodyPose) -> BodyPose:
    """The pose before, when the one that was found is hardly another."""
    return before if np.abs(found.numbers - before.numbers).max() < STILL else found
