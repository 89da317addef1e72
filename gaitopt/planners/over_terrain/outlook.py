"""What becomes of a foothold while its foot stands there: does its leg reach it, and stay clear?

A foothold may be good when the foot lands on it, and its shank touch the stone behind it, or its
leg not reach it, when the body has moved on. So each is looked at for the whole stance, before any
step to it is judged, with the body where it will about be.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.planners.over_terrain.course import Course
from gaitopt.planners.over_terrain.judge import Judge
from gaitopt.planners.over_terrain.surfaces import Stands

HEIGHTS = (1.0, 0.88)
"""Heights of the body, as shares of the usual one, of which one has to do. Chosen: the usual one,
and one from which legs reach lower footholds."""
STEPS = 5
"""Steps that the foot stands through, with its landing and its lifting."""


class Outlook:
    """Looks at footholds for the whole stance on them, and remembers what it saw.

    Args:
        judge: of the steps.
        stands: where feet may stand.
        course: where the body goes.
        cycles: how often each leg steps.
    """

    def __init__(self, judge: Judge, stands: Stands, course: Course, cycles: int) -> None:
        self.judge = judge
        self.stands = stands
        made = (np.arange(4 * cycles + STEPS) + 0.5) / 4.0
        self.poses = course.at(course.after(np.minimum(made, cycles), cycles))
        self.feet = self._feet()
        self._seen: dict[tuple[int, int], FloatArray] = {}

    def of(self, leg: int, step: int, near: np.ndarray) -> FloatArray:
        """The share of the stance for which each foothold is of no use ``(n,)``.

        Args:
            leg: index of the leg.
            step: that puts its foot there, counted over all legs.
            near: numbers of the stands ``(n,)``, always the same ones for a leg and step.
        """
        if (leg, step) not in self._seen:
            self._seen[leg, step] = self._looked_at(leg, step, self.stands.centres[near])
        return self._seen[leg, step]

    def _looked_at(self, leg: int, step: int, places: FloatArray) -> FloatArray:
        lifted = places + np.array([0.0, 0.0, self.judge.settings.clearance])
        feet = np.concatenate([np.tile(places, (STEPS, 1)), lifted])
        steps = step + np.minimum(np.arange(STEPS + 1), STEPS - 1)
        at = np.repeat(steps, len(places))
        useless = np.arange(len(feet))
        for height in HEIGHTS:
            useless = useless[~self._of_use(leg, at[useless], feet[useless], height)]
        return np.bincount(useless % len(places), minlength=len(places)) / len(steps)

    def _of_use(self, leg: int, steps: np.ndarray, feet: FloatArray, height: float) -> BoolArray:
        """Whether a leg reaches ``feet (n, 3)`` in steps and is clear of the ground ``(n,)``."""
        own, which = np.unique(steps, return_inverse=True)
        postures = self.judge.posture_over(self.feet[own], self.poses[own, 2], height)
        poses = np.concatenate([self.poses[own, :2], postures], axis=1)[which]
        local = self.judge.limbs.local(feet[:, None], poses)[:, 0]
        good = self.judge.within(leg, local)[1]
        some = np.flatnonzero(good)
        good[some] = self.judge.limbs.leg_clear(leg, feet[some, None], poses[some])
        return good

    def _feet(self) -> FloatArray:
        """Where the feet are usually in each step, at the mean height around ``(S, 4, 3)`` [m]."""
        ground = self.judge.surfaces.ground
        around = self.stands.mean_heights(self.judge.settings.freedom / ground.resolution)
        cosine, sine = np.cos(self.poses[:, 2:]), np.sin(self.poses[:, 2:])
        ahead, left = self.judge.usual_feet.T
        xy = np.stack([cosine * ahead - sine * left, sine * ahead + cosine * left], axis=-1)
        xy += self.poses[:, None, :2]
        at = np.round((xy - ground.origin) / ground.resolution).astype(int)
        i, j = np.moveaxis(np.clip(at, 0, np.subtract(ground.shape, 1)), -1, 0)
        z = around[i, j]
        some = np.isfinite(z)
        # Over ground without footholds the other feet tell how high the body is.
        mean = np.where(some, z, 0.0).sum(axis=1) / np.maximum(some.sum(axis=1), 1)
        return np.concatenate([xy, np.where(some, z, mean[:, None])[..., None]], axis=-1)
