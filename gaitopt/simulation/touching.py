"""Which shape is under each foot of a simulated robot, and what else of the robot touches."""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.simulation.model import SimModel

NEAR_FOOT, NEAR_MORE = 1.3, 0.005
"""A shape of the robot's own touches with its foot up to this many radii of the foot from the foot
frame, and this much more [m]. Chosen: shapes of feet are balls, or near to the ball that stands for
them; a shin begins farther up."""


class Touching:
    """The contacts of one simulation.

    Attributes:
        bumps: names of links that touched something, but not with their feet.
    """

    def __init__(self, sim: SimModel, radius: float) -> None:
        self._sim, self._near = sim, NEAR_FOOT * radius + NEAR_MORE
        self.bumps: set[str] = set()

    def beneath(self, data: Any) -> np.ndarray:
        """The id of the shape under each foot ``(4,)``, -1 for none.

        A foot may touch two shapes at once: the one with the deeper contact counts.
        """
        found, deepest = np.full(len(LEGS), -1), [np.inf] * len(LEGS)
        if not data.ncon:
            return found
        pairs, gaps = data.contact.geom.tolist(), data.contact.dist.tolist()
        places = data.contact.pos if self._sim.own_shapes else None
        for number, ((a, b), gap) in enumerate(zip(pairs, gaps, strict=True)):
            if places is None:
                foot, other = (a, b) if a in self._sim.feet else (b, a)
                leg = self._sim.feet.index(foot)
            else:
                foot, other = (b, a) if self._is_ground(a) else (a, b)
                leg = self._leg(data, foot, other, places[number])
            if leg >= 0 and gap <= min(deepest[leg], 0.0):
                found[leg], deepest[leg] = other, gap
        return found

    def _is_ground(self, geom: int) -> bool:
        return int(self._sim.model.geom_bodyid[geom]) == 0

    def _leg(self, data: Any, own: int, other: int, place: np.ndarray) -> int:
        """Number of the leg whose foot touches the ground in a place; -1 for another contact."""
        model = self._sim.model
        if self._is_ground(other):
            away = np.linalg.norm(data.site_xpos[list(self._sim.sites)] - place, axis=1)
            leg = int(away.argmin())
            if away[leg] <= self._near:
                return leg
        else:
            self.bumps.add(str(model.body(int(model.geom_bodyid[other])).name))
        self.bumps.add(str(model.body(int(model.geom_bodyid[own])).name))
        return -1
