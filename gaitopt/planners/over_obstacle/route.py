"""Footholds and postures of a walk over an obstacle, without its timing."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, leg_index
from gaitopt.errors import StrideFault
from gaitopt.optimize.posture.problem import BodyPose, build_posture_problem
from gaitopt.optimize.posture.solution import PostureSolution
from gaitopt.optimize.posture.solver import solve_posture
from gaitopt.plan.settings.over_obstacle import StrideSettings
from gaitopt.planners.over_obstacle.approach import Stand, Way, way_to
from gaitopt.planners.over_obstacle.layout import Gaps, Layout, footholds, lay_out, stands_over
from gaitopt.robots.quadruped import Quadruped
from gaitopt.swing.obstacle_paths import obstacle_path
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.obstacles import Obstacle

REACH_RESERVE = 0.999
"""Share of the allowed reach that postures use, so that curves between waypoints stay within it."""
SAME_POSE = 1e-6
"""Difference between successive poses that counts as none [m, rad]: the body then does not move."""
SAME_HEIGHT = 1e-6
"""Waypoints no farther than this below the highest one are on top of a path [m]."""
SWING_SAMPLES = 9
"""Samples of a swing over open ground, for which a parabola stands in the search; chosen here."""


class Step(NamedTuple):
    """One leg's step.

    Attributes:
        leg: the leg that steps.
        cycle: index of the cycle in the walk, from 0.
        over: whether the step leads over the obstacle.
        feet: where the feet are before it ``(4, 3)`` [m].
        target: where the foot touches down ``(3,)`` [m].
        pose: of the body during the step.
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
    """What a walk must keep, as the rounds of the search have found so far.

    Attributes:
        gaps: between the obstacle and the feet beside it.
        lift: additional height of paths over the obstacle, for the clearance of the leg above the
            foot [m].
        margin: stability margin of postures [m].
        foot: additional distance of feet from the obstacle, on top of the margin that is set [m].
    """

    gaps: Gaps
    lift: float
    margin: float
    foot: float = 0.0

    def widened(self, leg: str, across: float, extent: tuple[float, float], by: float) -> Demand:
        """The demand with a larger distance between one leg and the obstacle.

        Args:
            leg: the leg.
            across: x of its foot in the obstacle's frame [m].
            extent: least and greatest x of the obstacle [m].
            by: how much larger [m]. A foot above the obstacle is lifted, one beside it set away.
        """
        if extent[0] < across < extent[1]:
            return self._replace(lift=self.lift + by)
        return self._replace(gaps=self.gaps.widened(leg, after=across >= extent[1], by=by))


@dataclass(frozen=True, eq=False)
class StrideRoute:
    """A walk over an obstacle, without its timing.

    Attributes:
        robot: the robot.
        obstacle: the obstacle.
        settings: of the walk.
        demand: gaps, lift and margin that it keeps.
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
        """The obstacle over which paths are laid: higher by the demanded lift."""
        x, y, z = self.obstacle.position
        return replace(self.obstacle, position=(x, y, z + self.demand.lift))

    @property
    def foot_margin(self) -> float:
        """Distance that the centre of a foot's ball keeps from the obstacle [m]."""
        return self.settings.margin + self.demand.foot + self.robot.foot_radius

    def waypoints(self, step: Step) -> FloatArray:
        """Places of the foot during a step ``(n, 3)`` [m]."""
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
    robot: Quadruped,
    obstacle: Obstacle,
    settings: StrideSettings,
    demand: Demand,
    stand: Stand | None = None,
) -> StrideRoute:
    """Footholds and postures of a walk that keeps a demand.

    Args:
        robot, obstacle, settings: as for :func:`gaitopt.plan_stride`.
        demand: what the walk must keep.
        stand: where the robot stands before; by default where the walk itself begins.

    Raises:
        StrideFault: a posture is impossible.
    """
    if stands_over(robot, obstacle, demand.gaps) < 0.0:
        raise StrideFault(
            f"the stance of {robot.name} is {robot.stance_size[0]:.4g} m long; to stand over an "
            f"obstacle {obstacle.width:.4g} m wide its feet need gaps of "
            f"{demand.gaps.front_after:.3g} m and {demand.gaps.hind_before:.3g} m beside it",
            cause="short",
        )
    approach = settings.approach if stand is None else 0
    layout = lay_out(robot, obstacle, demand.gaps, approach, settings.leave)
    places = footholds(robot, obstacle, layout)
    start, end = (
        _square_pose(robot, obstacle, settings, float(layout.centres[k])) for k in (0, -1)
    )
    way = None
    if stand is not None:
        way = way_to(robot, obstacle, stand, float(layout.centres[0]), layout.longest)
        before = {leg: way.feet[:, i] for i, leg in enumerate(LEGS)}
        places = Footholds({leg: np.concatenate([before[leg], places[leg][1:]]) for leg in LEGS})
        start = way.body(-1, obstacle, _height(robot, settings))
    route = StrideRoute(robot, obstacle, settings, demand, layout, places, start, end, ())
    return _with_steps(route, way)


def _with_steps(route: StrideRoute, way: Way | None) -> StrideRoute:
    """The route with all of its steps, and the pose after the last one.

    Args:
        route: without them.
        way: the stances before the walk itself, if there are any.

    Raises:
        StrideFault: a posture is impossible.
    """
    settings, obstacle, layout, places = (
        route.settings, route.obstacle, route.layout, route.footholds
    )  # fmt: skip
    before = 0 if way is None else way.cycles
    feet, pose = places.array[:, 0].copy(), route.start
    steps: list[Step] = []
    for cycle in range(before + layout.cycles):
        for leg in settings.sequence:
            over = layout.strides_over(leg, cycle - before)
            # On its way to the walk the body turns with the stances.
            near = pose
            if way is not None and cycle < before:
                near = way.body(cycle, obstacle, _height(route.robot, settings))
            step = Step(leg, cycle, over, feet.copy(), places[leg][cycle + 1], near)
            steps.append(
                step._replace(pose=_unless_same(pose, _posture(route, step, len(steps)).pose))
            )
            feet, pose = step.landed, steps[-1].pose
    return replace(route, steps=tuple(steps), end=_recovery_pose(route, feet, pose))


def _height(robot: Quadruped, settings: StrideSettings) -> float:
    """Height of a level body above the ground [m]."""
    return robot.foot_radius + settings.body_height


def _square_pose(
    robot: Quadruped, obstacle: Obstacle, settings: StrideSettings, centre: float
) -> BodyPose:
    """The pose of a level body above the middle of a square stance."""
    local = np.array([centre, 0.0, _height(robot, settings)])
    return BodyPose(obstacle.to_world(local), np.array([0.0, 0.0, obstacle.yaw]))


def _posture(route: StrideRoute, step: Step, number: int) -> PostureSolution:
    """The nearest posture from which a step is possible.

    The step's own pose is the one before. Besides its target the foot must reach both ends of the
    top of its path.
    """
    settings, robot = route.settings, route.robot
    places = [step.target]
    if step.over:
        way = route.waypoints(step)
        top = np.flatnonzero(way[:, 2] > way[:, 2].max() - SAME_HEIGHT)
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


def _recovery_pose(route: StrideRoute, feet: FloatArray, before: BodyPose) -> BodyPose:
    """The pose after the last step: level above the feet, or the pose before when that fails."""
    found = solve_posture(
        build_posture_problem(
            route.robot,
            dict(zip(LEGS, feet, strict=True)),
            route.end,
            reach_fraction=route.settings.reach_fraction * REACH_RESERVE,
            margin=route.demand.margin,
        )
    )
    return _unless_same(before, found.pose) if found.solved else before


def _unless_same(before: BodyPose, found: BodyPose) -> BodyPose:
    """The pose that was found, or the one before when they are the same but for rounding."""
    return before if np.abs(found.numbers - before.numbers).max() < SAME_POSE else found
