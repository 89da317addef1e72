"""Friction of single footholds in physics.

The friction of a foothold counts in proportion to that of the plan's limits: where it is half of
it, a foot that stands there has half of the settings' friction. With settings that have the
friction of the limits footholds have just what the plan says of them.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.plan.contact_ground import foothold_indices, ground_on
from gaitopt.plan.plan import Plan
from gaitopt.simulation.model import SimModel
from gaitopt.simulation.settings import SimulationSettings

FIRST = 2
"""MuJoCo's priority of feet whose friction changes: above that of a height map. Of two shapes the
one with the higher priority tells how they touch."""


class Grip:
    """Gives feet the friction of the footholds that they stand on, or will land on.

    Args:
        sim: the model; its feet are changed where a foothold has less friction than the limits.
        plan: what is walked.
        settings: of the physics.
    """

    def __init__(self, sim: SimModel, plan: Plan, settings: SimulationSettings) -> None:
        limits = plan.settings.promised_forces or ForceLimits()
        footholds = plan.footholds
        self._plan, self._model = plan, sim.model
        last = np.array([footholds.counts[leg] - 1 for leg in LEGS])
        each = np.minimum(np.arange(len(footholds))[:, None], last)
        share = ground_on(footholds, each, limits.friction).grip
        self._friction = settings.friction * np.broadcast_to(share, each.shape)
        self._slippery = bool((self._friction < settings.friction).any())
        self._last = np.full(len(LEGS), -1)
        self._shapes = [_shapes(sim, leg) for leg in range(len(LEGS))]
        ground = int(sim.columns[0, 0])
        for shapes in self._shapes if self._slippery else ():
            sim.model.geom_priority[shapes] = FIRST
            sim.model.geom_solimp[shapes] = sim.model.geom_solimp[ground]

    def stand_on(self, clock: float) -> None:
        """Take up the footholds at an instant of the plan [s]."""
        if not self._slippery:
            return
        now = foothold_indices(self._plan, np.array([clock]))[0]
        for leg in np.flatnonzero(now != self._last).tolist():
            self._model.geom_friction[self._shapes[leg], 0] = self._friction[now[leg], leg]
        self._last = now


def _shapes(sim: SimModel, leg: int) -> np.ndarray:
    """Shapes of a foot: its ball, or what of the robot's own is on its link."""
    if sim.feet:
        return np.array([sim.feet[leg]])
    return np.flatnonzero(sim.model.geom_bodyid == sim.model.site_bodyid[sim.sites[leg]])
