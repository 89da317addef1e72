"""Single steps of a free gait, many at once: is there a place for the body, and how long it takes.

Everything is in the walk's heading frame, and estimated on a coarse grid: the order that comes of
it is planned again, exactly.
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
from gaitopt.planners.phase_by_phase.swing_polylines import swing_polylines
from gaitopt.robots.collision_shapes import CollisionPairs
from gaitopt.robots.leg import Leg
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.support import triangle_half_planes

STANCE_INTERVALS, SWING_INTERVALS = 4, 30
"""Intervals in which a move is looked at, at least."""
APART = 5e-4
"""Distance that shapes keep wherever they are looked at [m]."""
WATCHED = 0.12
"""Shapes that are farther apart at four instants of a step are not looked at in between [m]."""


class Steps(NamedTuple):
    """Steps that may be taken.

    Attributes:
        leg: index of the leg that steps ``(E,)``.
        feet, landed: where the feet stand before and after ``(E, 4, 3)`` [m].
        before: body centre before the step ``(E, 3)`` [m].
        place: where it stands while the foot flies ``(E, 3)`` [m]; NaN where there is no place.
    """

    leg: np.ndarray
    feet: FloatArray
    landed: FloatArray
    before: FloatArray
    place: FloatArray

    def chosen(self, which: np.ndarray) -> Steps:
        """Some of the steps."""
        return Steps(*(part[which] for part in self))

    @property
    def ends(self) -> tuple[FloatArray, FloatArray]:
        """Where each foot lifts off and touches down ``(E, 3)``."""
        number = np.arange(len(self.leg))
        return self.feet[number, self.leg], self.landed[number, self.leg]


@dataclass(frozen=True, eq=False)
class StepPlanner:
    """Plans single steps of a robot.

    Attributes:
        robot, settings: of the walk.
        ground: mean height of all footholds [m].
    """

    robot: Quadruped
    settings: CrawlSettings
    ground: float

    @cached_property
    def _workspace(self) -> CogWorkspace:
        return CogWorkspace()

    @cached_property
    def _shapes(self) -> CollisionPairs | None:
        return CollisionPairs.of(self.robot)

    def standing(self, steps: Steps) -> BoolArray:
        """Whether three feet support an area and no leg stands across another ``(E,)``."""
        corners = np.take_along_axis(steps.feet[..., :2], OTHER_LEGS[steps.leg][..., None], axis=1)
        wide = ~np.isnan(triangle_half_planes(corners)[1]).any(axis=1)
        lf, lh, rh, rf = (steps.landed[:, i] for i in range(4))
        in_order = (lf[:, 0] > lh[:, 0]) & (rf[:, 0] > rh[:, 0])
        return np.asarray(wide & in_order & (lf[:, 1] > rf[:, 1]) & (lh[:, 1] > rh[:, 1]))

    def placed(self, steps: Steps) -> Steps:
        """The steps with the places that the COG problem of eq. (10) finds for the body."""
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
            if answer.solved and answer.margin >= s.stability_margin - 1e-9:
                place[i, :2], place[i, 2] = answer.position, heights[i]
        return steps._replace(place=place)

    def durations(self, steps: Steps) -> FloatArray:
        """Times of the body's moves and the swings after them ``(E,)`` [s]; inf if impossible."""
        speed = None if self.settings.speed == "max" else float(self.settings.speed)
        body, ways = self._moves(steps), self._ways(steps)
        moves = np.zeros((len(steps.leg), STANCE_INTERVALS))
        total = np.zeros(len(steps.leg))
        for i, name in enumerate(LEGS):
            local = steps.feet[:, i, None] - body + self.robot.centre
            times, possible = _times(self.robot.legs[name], local, body, speed)
            moves = np.maximum(moves, times)
            total[~possible] = np.inf
        total += moves.sum(axis=1)
        for i, name in enumerate(LEGS):
            mine = np.flatnonzero(steps.leg == i)
            local = ways[mine] - steps.place[mine, None] + self.robot.centre
            times, possible = _times(self.robot.legs[name], local, ways[mine], speed)
            total[mine] += np.where(possible, times.sum(axis=1), np.inf)
        return total

    def _moves(self, steps: Steps) -> FloatArray:
        """Body centre on its way ``(E, n, 3)``."""
        share = np.linspace(0.0, 1.0, STANCE_INTERVALS + 1)[:, None]
        return np.asarray(steps.before[:, None] + (steps.place - steps.before)[:, None] * share)

    def _ways(self, steps: Steps) -> FloatArray:
        """Points of the swings ``(E, n, 3)``, dense at the ends of their edges."""
        s = self.settings
        ways = swing_polylines(s.swing, *steps.ends, s.swing_height)
        each = max(SWING_INTERVALS // max(ways.shape[1] - 1, 1), 1)
        share = (1.0 - np.cos(np.pi * np.arange(each) / each)) / 2.0
        inner = ways[:, :-1, None] + np.diff(ways, axis=1)[:, :, None] * share[:, None]
        return np.concatenate(
            [inner.reshape(len(ways), each * (ways.shape[1] - 1), 3), ways[:, -1:]], axis=1
        )

    def apart(self, step: Steps) -> bool:
        """Whether legs and trunk keep apart during one step; yes, where shapes are meshes."""
        if self._shapes is None:
            return True
        body, way = self._moves(step)[0], self._ways(step)[0]
        feet = np.repeat(step.feet, len(body) + len(way), axis=0)
        feet[len(body) :, step.leg[0]] = way
        centres = np.concatenate([body, np.repeat(step.place, len(way), axis=0)])
        local = feet - centres[:, None] + self.robot.centre
        joints = np.concatenate(
            [self.robot.legs[name].inverse(local[:, i]) for i, name in enumerate(LEGS)], axis=1
        )
        # Before the move, before the swing, at its middle and after it.
        looks = [0, len(body), len(body) + len(way) // 2, -1]
        seen = self._shapes.distances(joints[looks]).min(axis=0)
        near = np.flatnonzero(seen < WATCHED).tolist()
        return not near or bool(self._shapes.distances(joints, near).min() >= APART)


def _times(
    leg: Leg, local: FloatArray, path: FloatArray, speed: float | None
) -> tuple[FloatArray, BoolArray]:
    """Times between points of a foot's way in the body frame, and whether the leg can go it."""
    joints = leg.inverse(local)
    low, high = leg.position_limits
    inside = ((joints >= low - 1e-9) & (joints <= high + 1e-9)).all(axis=(1, 2))
    lengths = np.linalg.norm(np.diff(path, axis=1), axis=2)
    times, _ = knot_times(joints, leg.velocity_limits, lengths, speed)
    turns = (np.abs(np.diff(joints, axis=1)) <= np.pi).all(axis=(1, 2))
    return times, inside & turns & (leg.shortfall(local) <= 1e-6).all(axis=1)
