"""Single steps of a free gait, many at once: where the body can stand, and how long a step takes.

All is in the walk's heading frame. Times are estimated on a coarse grid: the walk in the order that
is found is then planned exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, OTHER_LEGS, BoolArray, FloatArray
from gaitopt.optimize.cog.solver import CogWorkspace, build_cog_problems, solve_cog
from gaitopt.optimize.speed import knot_times
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.demands import ROUNDING
from gaitopt.planners.phase_by_phase.joint_checks import ANGLE_ROUNDING, REACH_TOLERANCE
from gaitopt.planners.phase_by_phase.swing_polylines import swing_polylines
from gaitopt.robots.collisions.pairs import CollisionPairs
from gaitopt.robots.leg import Leg
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.support import triangle_half_planes

STANCE_INTERVALS, SWING_INTERVALS = 4, 30
"""Intervals of the body's move and of a swing for which times are estimated. With them the
estimated duration is within 0.5 % of that of the plan, which a test of ``find_order`` holds."""
LEAST_DISTANCE = 5e-4
"""Distance that shapes of different legs, and of a leg and the trunk, keep at all these places [m].
Chosen here: it makes up for what is nearer between two of them."""
LOOKED_AT = 0.12
"""Shapes that are farther apart than this at four instants of a step are not looked at in between
[m]. Chosen here: more than a link moves toward another between two of these instants."""


class Steps(NamedTuple):
    """Steps that may be taken.

    Attributes:
        leg: index of the leg that steps ``(E,)``.
        feet, landed: where the feet stand before and after ``(E, 4, 3)`` [m].
        before: body centre before the step ``(E, 3)`` [m].
        place: body centre while the foot flies ``(E, 3)`` [m]; NaN where there is no place for it.
        lift: how far the foot rises above the higher end of its swing ``(E,)`` [m].
    """

    leg: np.ndarray
    feet: FloatArray
    landed: FloatArray
    before: FloatArray
    place: FloatArray
    lift: FloatArray

    def chosen(self, which: np.ndarray) -> Steps:
        """The steps with these numbers."""
        return Steps(*(part[which] for part in self))

    @property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Where each foot lifts off and touches down ``(E, 3)`` each [m]."""
        number = np.arange(len(self.leg))
        return self.feet[number, self.leg], self.landed[number, self.leg]


@dataclass(frozen=True, eq=False)
class StepPlanner:
    """Plans single steps of a walk.

    Attributes:
        robot, settings: of the walk.
        ground: mean height of all footholds [m].
    """

    robot: Quadruped
    settings: CrawlSettings
    ground: float

    def can_stand(self, steps: Steps) -> BoolArray:
        """Whether three feet support an area, and no leg crosses another afterward ``(E,)``."""
        corners = np.take_along_axis(steps.feet[..., :2], OTHER_LEGS[steps.leg][..., None], axis=1)
        wide = ~np.isnan(triangle_half_planes(corners)[1]).any(axis=1)
        lf, lh, rh, rf = (steps.landed[:, i] for i in range(4))
        in_order = (lf[:, 0] > lh[:, 0]) & (rf[:, 0] > rh[:, 0])
        return np.asarray(wide & in_order & (lf[:, 1] > rf[:, 1]) & (lh[:, 1] > rh[:, 1]))

    def with_places(self, steps: Steps) -> Steps:
        """The steps with the places that the COG problem ([Wang2020], eq. (10)) finds."""
        place = np.full((len(steps.leg), 3), np.nan)
        if not len(steps.leg):
            return steps._replace(place=place)
        s = self.settings
        levels = np.full(len(place), self.ground)
        if s.follow_terrain:
            levels = (steps.feet[..., 2].mean(axis=1) + steps.landed[..., 2].mean(axis=1)) / 2.0
        heights = levels + s.body_height
        problems = build_cog_problems(
            self.robot, steps.feet, heights, [LEGS[i] for i in steps.leg.tolist()], steps.ends[1],
            stability_margin=s.stability_margin, reach_fraction=s.reach_fraction,
            objective=s.objective,  # type: ignore[arg-type]
        )  # fmt: skip
        for i, problem in enumerate(problems):
            answer = solve_cog(problem.starting_at(steps.before[i, :2]), self._workspace)
            if answer.solved and answer.margin >= s.stability_margin - ROUNDING:
                place[i, :2], place[i, 2] = answer.position, heights[i]
        return steps._replace(place=place)

    def durations(self, steps: Steps) -> FloatArray:
        """Times of the body's move and the swing ``(E,)`` [s]; infinite for an impossible step."""
        speed = None if self.settings.speed == "max" else float(self.settings.speed)
        body, swings = self._body_moves(steps), self._swings(steps)
        moves = np.zeros((len(steps.leg), STANCE_INTERVALS))
        total = np.zeros(len(steps.leg))
        for i, name in enumerate(LEGS):
            local = steps.feet[:, i, None] - body + self.robot.centre
            times, possible = _times(self.robot.legs[name], local, body, speed)
            moves = np.maximum(moves, times)
            total[~possible] = np.inf
        total += moves.sum(axis=1)
        for i, name in enumerate(LEGS):
            of_leg = np.flatnonzero(steps.leg == i)
            local = swings[of_leg] - steps.place[of_leg, None] + self.robot.centre
            times, possible = _times(self.robot.legs[name], local, swings[of_leg], speed)
            total[of_leg] += np.where(possible, times.sum(axis=1), np.inf)
        return total

    def keeps_apart(self, step: Steps) -> bool:
        """Whether legs and trunk keep apart during a single step.

        Where shapes are meshes whose hulls are not known, the answer is yes.
        """
        if self._shapes is None:
            return True
        body, swing = self._body_moves(step)[0], self._swings(step)[0]
        feet = np.repeat(step.feet, len(body) + len(swing), axis=0)
        feet[len(body) :, step.leg[0]] = swing
        centres = np.concatenate([body, np.repeat(step.place, len(swing), axis=0)])
        local = feet - centres[:, None] + self.robot.centre
        joints = np.concatenate(
            [self.robot.legs[name].inverse(local[:, i]) for i, name in enumerate(LEGS)], axis=1
        )
        # Before the move, before the swing, at its middle and after it.
        instants = [0, len(body), len(body) + len(swing) // 2, -1]
        distances = self._shapes.distances(joints[instants]).min(axis=0)
        near = np.flatnonzero(distances < LOOKED_AT).tolist()
        return not near or bool(self._shapes.distances(joints, near).min() >= LEAST_DISTANCE)

    @cached_property
    def _workspace(self) -> CogWorkspace:
        """What the COG solver uses again and again."""
        return CogWorkspace()

    @cached_property
    def _shapes(self) -> CollisionPairs | None:
        """The robot's shapes; ``None`` where they are not known."""
        return CollisionPairs.of(self.robot)

    def _body_moves(self, steps: Steps) -> FloatArray:
        """Body centre along its move before each swing ``(E, n, 3)`` [m]."""
        share = np.linspace(0.0, 1.0, STANCE_INTERVALS + 1)[:, None]
        return np.asarray(steps.before[:, None] + (steps.place - steps.before)[:, None] * share)

    def _swings(self, steps: Steps) -> FloatArray:
        """Points of each swing ``(E, n, 3)`` [m], dense at the ends of its edges."""
        s = self.settings
        corners = swing_polylines(s.swing, *steps.ends, steps.lift)
        edges = corners.shape[1] - 1
        each = max(SWING_INTERVALS // max(edges, 1), 1)
        share = (1.0 - np.cos(np.pi * np.arange(each) / each)) / 2.0
        inner = corners[:, :-1, None] + np.diff(corners, axis=1)[:, :, None] * share[:, None]
        return np.concatenate(
            [inner.reshape(len(corners), each * edges, 3), corners[:, -1:]], axis=1
        )


def _times(
    leg: Leg, local: FloatArray, path: FloatArray, speed: float | None
) -> tuple[FloatArray, BoolArray]:
    """Times between the points of paths, and whether the leg can follow each path.

    Args:
        leg: the leg.
        local: places of its foot in the body's frame ``(E, n, 3)`` [m].
        path: places of what moves with the given speed, foot or body ``(E, n, 3)`` [m].
        speed: the speed that was asked for [m/s]; ``None`` for as fast as possible.

    Returns:
        Times ``(E, n - 1)`` [s], and truth values ``(E,)``.
    """
    joints = leg.inverse(local)
    low, high = leg.position_limits
    inside = (joints >= low - ANGLE_ROUNDING) & (joints <= high + ANGLE_ROUNDING)
    lengths = np.linalg.norm(np.diff(path, axis=1), axis=2)
    times, _ = knot_times(joints, leg.velocity_limits, lengths, speed)
    no_full_turns = (np.abs(np.diff(joints, axis=1)) <= np.pi).all(axis=(1, 2))
    reached = (leg.shortfall(local) <= REACH_TOLERANCE).all(axis=1)
    return times, inside.all(axis=(1, 2)) & no_full_turns & reached
