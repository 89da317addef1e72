"""Which shape is under each foot of a simulated robot, and what else of the robot touches."""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.simulation.limbs import NEAR_FOOT, NEAR_MORE
from gaitopt.simulation.model import SimModel, import_mujoco

LEAST_SHARE = 0.001
"""Share of the robot's weight from which on the controller is told that a foot bears load. In
MuJoCo a foot that is leaving the ground touches it until no shapes overlap, without a force. If it
is asked for a large force at once, it kicks: in 16 steps of wang2020 (``posture``, seed 0, turns of
3 and 5 ms) a knee reached 8.3 times its velocity limit so. Feet that stand bear 1 % or more in
plans."""


class Touching:
    """The contacts of one simulation.

    Attributes:
        bumps: names of links that touched something, but not with their feet.
    """

    def __init__(self, sim: SimModel, radius: float) -> None:
        self._sim, self._near = sim, NEAR_FOOT * radius + NEAR_MORE
        self._legs = {ball: leg for leg, ball in enumerate(sim.feet)}
        self._on_ground: list[bool] = (sim.model.geom_bodyid == 0).tolist()
        self.bumps: set[str] = set()

    def beneath(self, data: Any) -> tuple[np.ndarray, FloatArray]:
        """The id of the shape under each foot, -1 for none, and normal forces [N]; each ``(4,)``.

        A foot may touch two shapes at once: the one with the deeper contact counts.
        """
        found, deepest = np.full(len(LEGS), -1), [np.inf] * len(LEGS)
        loads = np.zeros(len(LEGS))
        if not data.ncon:
            return found, loads
        contact = data.contact
        pairs, gaps = contact.geom.tolist(), contact.dist.tolist()
        # The first row of a contact is its normal force, as friction cones are elliptic.
        places, rows, forces = contact.pos, contact.efc_address.tolist(), data.efc_force
        for number, ((a, b), gap) in enumerate(zip(pairs, gaps, strict=True)):
            own, other = (b, a) if self._is_ground(a) else (a, b)
            leg = self._leg(data, own, other, places[number])
            if leg < 0:
                continue
            if rows[number] >= 0:
                loads[leg] += forces[rows[number]]
            if gap <= min(deepest[leg], 0.0):
                found[leg], deepest[leg] = other, gap
        return found, loads

    def forces(self, data: Any) -> FloatArray:
        """The forces on the feet, in the world's axes ``(4, 3)`` [N]."""
        found, force, read = np.zeros((len(LEGS), 3)), np.zeros(6), import_mujoco().mj_contactForce
        for number in range(data.ncon):
            a, b = (int(g) for g in data.contact.geom[number])
            own, other = (b, a) if self._is_ground(a) else (a, b)
            leg = self._leg(data, own, other, data.contact.pos[number])
            if leg >= 0:
                read(self._sim.model, data, number, force)
                # The rows of the frame are its axes, and the force is the one on the second shape.
                pushed = force[:3] @ data.contact.frame[number].reshape(3, 3)
                found[leg] += pushed if own == b else -pushed
        return found

    def hardness(self, data: Any) -> FloatArray:
        """Normal force for each metre of depth, on feet that do not move ``(4,)`` [N/m].

        In a contact that is neither approached nor left, MuJoCo's force times its regularisation
        is its stiffness times its impedance times the depth.
        """
        found = np.zeros(len(LEGS))
        for number in range(data.ncon):
            a, b = (int(g) for g in data.contact.geom[number])
            own, other = (b, a) if self._is_ground(a) else (a, b)
            leg = self._leg(data, own, other, data.contact.pos[number])
            row = int(data.contact.efc_address[number])
            if leg >= 0 and row >= 0:
                stiffness, _, impedance, _ = data.efc_KBIP[row]
                found[leg] += stiffness * impedance / data.efc_R[row]
        return found

    def _is_ground(self, geom: int) -> bool:
        return self._on_ground[geom]

    def _leg(self, data: Any, own: int, other: int, place: np.ndarray) -> int:
        """Number of the leg whose foot touches the ground in a place; -1 for another contact."""
        if own in self._legs:
            return self._legs[own]
        on_ground = self._is_ground(other)
        if on_ground and self._sim.own_shapes:
            away = np.linalg.norm(data.site_xpos[list(self._sim.sites)] - place, axis=1)
            leg = int(away.argmin())
            if away[leg] <= self._near:
                return leg
        for geom in (own,) if on_ground else (own, other):
            body = int(self._sim.model.geom_bodyid[geom])
            self.bumps.add(str(self._sim.model.body(body).name))
        return -1
