"""What the body centre's targets have to keep beside eq. (10) of [Wang2020], step by step.

The true centre of mass may keep the margin, and not the body centre; and with contact forces it has
to be where they hold the robot. Both depend on the target that is looked for. So they are found
where the body was found to be, and the targets are found anew until nothing is missing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.centre_of_mass import (
    com_in_swings,
    shifts_at_rest,
    shifts_in_swings,
)
from gaitopt.planners.phase_by_phase.steps import CrawlSteps
from gaitopt.retiming.reserves import PLANNED_SHARE, tightened
from gaitopt.robots.quadruped import Quadruped

ROUNDING: Final = 1e-9
"""Largest violation of a margin or a reach that counts as none [m]: what
:data:`gaitopt.optimize.cog.solution.PRIMAL_TOLERANCE` allows."""
MORE: Final = 2e-6
"""Length by which more is asked for than what was found to be needed [m], so that rounds end."""
ROOM: Final = 0.5
"""Distance from the sides of the region where forces hold the robot, as a share of the stability
margin. At its border no force is left for motion."""
LEAST_ROOM: Final = 2e-4
"""Distance that is kept in any case [m], so that rounds end."""


@dataclass(frozen=True, eq=False)
class Demands:
    """What is asked of the targets of some steps.

    Attributes:
        shifts: how much nearer to each side of the triangle than the body centre the point is that
            keeps the margin ``(S, 3)`` [m]; ``None`` where it is the body centre.
        regions: half-planes within which forces hold the robot, for the body centre: x and y of
            inward normals, and offsets [m] ``(k, 3)`` each; ``None`` where they ask for nothing.
        room: distance from the sides of these that is asked for ``(S,)`` [m].
        not_held: steps at whose last targets forces did not hold the robot.
    """

    shifts: FloatArray | None
    regions: tuple[FloatArray | None, ...]
    room: FloatArray
    not_held: tuple[int, ...] = ()

    @classmethod
    def at_first(
        cls, robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings, start: FloatArray
    ) -> Demands | None:
        """What is known of a walk before any target is; ``None`` where nothing is asked for.

        Args:
            robot, steps, settings: the walk.
            start: body centre at the start ``(3,)`` [m], in the heading frame.
        """
        count = len(steps.legs)
        if not count or not (settings.true_com or settings.forces is not None):
            return None
        shifts = shifts_at_rest(robot, steps, start) if settings.true_com else None
        room = max(ROOM * settings.stability_margin, LEAST_ROOM)
        return cls(shifts, (None,) * count, np.full(count, room))

    @property
    def half_planes(self) -> list[FloatArray | None]:
        """The half-planes of every step, as far inside as the room asks for."""
        return [
            None if planes is None else planes + np.array([0.0, 0.0, room])
            for planes, room in zip(self.regions, self.room.tolist(), strict=True)
        ]

    def of_step(self, step: int) -> Demands:
        """Those of one step."""
        own = slice(step, step + 1)
        shifts = None if self.shifts is None else self.shifts[own]
        return Demands(shifts, self.regions[own], self.room[own])

    def with_step(self, step: int, other: Demands) -> Demands:
        """The same with another step's in place of that of ``step``."""
        room, shifts, regions = self.room.copy(), self.shifts, list(self.regions)
        room[step], regions[step] = other.room[0], other.regions[0]
        if shifts is not None and other.shifts is not None:
            shifts = shifts.copy()
            shifts[step] = other.shifts[0]
        return Demands(shifts, tuple(regions), room)

    def with_less_room(self) -> Demands | None:
        """The same with half of the room of a single step; ``None`` where no more is left."""
        if self.regions[0] is None or self.room[0] <= LEAST_ROOM:
            return None
        return replace(self, room=np.maximum(self.room / 2.0, LEAST_ROOM))

    def without_regions(self) -> Demands:
        """The same, as if no forces were asked for."""
        return replace(self, regions=(None,) * len(self.regions))

    def found_at(
        self, robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings, cogs: FloatArray
    ) -> Demands:
        """What is needed with the body at given places, whatever was asked for.

        Args:
            robot, steps, settings: the walk.
            cogs: body centre during each swing ``(S, 3)`` [m], in the heading frame.
        """
        offsets = com_in_swings(robot, steps, settings, cogs)
        shifts = None if self.shifts is None else shifts_in_swings(steps, offsets)
        missing = self._missing(robot, steps, settings, cogs, offsets)
        regions = tuple(missing.get(s) for s in range(len(self.regions)))
        return Demands(shifts, regions, self.room)

    def raised(
        self, robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings, cogs: FloatArray
    ) -> Demands | None:
        """The same, and what is missing at the targets that were found with them.

        Args:
            robot, steps, settings: the walk.
            cogs: body centre during each swing ``(S, 3)`` [m], in the heading frame.

        Returns:
            ``None`` where nothing is missing.
        """
        offsets = com_in_swings(robot, steps, settings, cogs)
        shifts, enough = self.shifts, True
        if shifts is not None:
            needed = shifts_in_swings(steps, offsets)
            enough = bool((needed <= shifts + ROUNDING).all())
            # Only ever more, so that the rounds end.
            shifts = np.maximum(shifts, needed + MORE)
        missing = self._missing(robot, steps, settings, cogs, offsets)
        if enough and not missing:
            return None
        regions = tuple(missing.get(s, planes) for s, planes in enumerate(self.regions))
        return Demands(shifts, regions, self.room, tuple(missing))

    def _missing(
        self,
        robot: Quadruped,
        steps: CrawlSteps,
        settings: CrawlSettings,
        cogs: FloatArray,
        offsets: FloatArray,
    ) -> dict[int, FloatArray]:
        """Half-planes of the steps in which forces do not hold the robot."""
        if settings.forces is None:
            return {}
        from gaitopt.planners.phase_by_phase.standing_places import half_planes_by_forces

        limits = tightened(settings.forces, PLANNED_SHARE)
        return half_planes_by_forces(
            robot, steps, settings.heading, limits, cogs, offsets, self.room
        )
