"""Whether each foot stood on its foothold in physics.

This is judged by all calls of the controller, some milliseconds apart, and not by the samples of
the recorded motion: a foot may stand for 12 ms only between two of its swings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.control.clock import SAME_INSTANT
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import quaternion_to_matrix
from gaitopt.simulation.result import MissedFoothold, MissReason
from gaitopt.simulation.settings import SimulationSettings

BEFORE_LIFT_OFF = 0.06
"""How long before its planned lift-off a foot may already rise [s]. Chosen: the controller's
reference is averaged over 40 ms."""
LAST_LOOK = 0.04
"""A foot that touches its foothold at any instant within this time before it may rise has not left
it [s]. Chosen: a foot with hardly any load may bounce."""


@dataclass(frozen=True, eq=False)
class Looks:
    """What was seen at each call of the controller, ``N`` in all.

    Attributes:
        t: ``(N,)`` [s].
        clock: the plan's time ``(N,)`` [s], which stands still while the controller waits.
        q: Pinocchio's configurations ``(N, nq)``.
        beneath: id of the shape under each foot ``(N, 4)``, -1 for none.
    """

    t: FloatArray
    clock: FloatArray
    q: FloatArray
    beneath: np.ndarray

    @property
    def finite(self) -> Looks:
        """Those whose configurations are numbers; all of them where there are none."""
        good = np.isfinite(self.q).all(axis=1)
        keep = good if good.any() else np.ones_like(good)
        return Looks(self.t[keep], self.clock[keep], self.q[keep], self.beneath[keep])


def feet_of(robot: Quadruped, q: FloatArray) -> FloatArray:
    """Feet ``(N, 4, 3)`` [m] at configurations ``(N, nq)``."""
    to_world = quaternion_to_matrix(q[:, 3:7]) @ robot.body_axes
    inside = np.stack([robot.legs[leg].forward(q[:, 7:][:, list(robot.leg_columns[leg])])
                       for leg in LEGS], axis=1)  # fmt: skip
    return np.asarray(q[:, None, :3] + np.einsum("nij,nlj->nli", to_world, inside))


def stances(plan: Plan) -> list[tuple[int, str, float, float, FloatArray]]:
    """Every time that a foot stands after a swing, by step.

    Returns:
        Tuples of step, leg, touch-down [s], next lift-off [s] and foothold ``(3,)`` [m].
    """
    found = []
    for i, swing in enumerate(plan.swings):
        later = (s.start for s in plan.swings[i + 1 :] if s.leg == swing.leg)
        found.append((swing.step, swing.leg, swing.end, next(later, np.inf), swing.foot_end))
    return found


def landings(
    plan: Plan, looks: Looks, columns: np.ndarray, settings: SimulationSettings
) -> list[tuple[float, MissedFoothold | None]]:
    """For each step the landing error [m], NaN where it was not done, and whether it missed.

    A foot is on its column where that is the shape under it. A height map is one shape, so there
    the foot is on its foothold where its ball touches the map and its centre is near the foothold,
    heights included.

    Args:
        plan: what was simulated.
        looks: what was seen.
        columns: ids of the shapes under the footholds ``(4, n)``.
        settings: of the simulation.
    """
    feet, clock = feet_of(plan.robot, looks.q), looks.clock
    counts = dict.fromkeys(LEGS, 0)
    # Feet that are in the air when the plan begins land on their first foothold.
    counts.update({swing.leg: -1 for swing in plan.swings if swing.index < 0})
    one_surface = plan.footholds.ground is not None
    radius = plan.footholds.landing_radius
    out: list[tuple[float, MissedFoothold | None]] = []
    for step, leg, start, end, foothold in stances(plan):
        column = LEGS.index(leg)
        counts[leg] += 1
        mine = columns[column, min(counts[leg], columns.shape[1] - 1)]
        # The clock may stand still at the touch-down, which is known but for rounding.
        first = int(np.searchsorted(clock, start - SAME_INSTANT))
        if first >= len(clock):
            last_distance = float(np.linalg.norm(feet[-1, column, :2] - foothold[:2]))
            never = MissedFoothold(step, leg, last_distance, MissReason.NEVER_REACHED)
            out.append((np.nan, never))
            continue
        # While the clock stands still at the lift-off the foot still stands.
        until = min(start + settings.landing_time, end) + SAME_INSTANT
        settled = max(int(np.searchsorted(clock, until, side="right")) - 1, first)
        last = max(int(np.searchsorted(clock, end - BEFORE_LIFT_OFF)) - 1, settled)
        off = np.linalg.norm(feet[:, column, :2] - foothold[:2], axis=1)
        away = np.linalg.norm(feet[:, column] - foothold, axis=1) if one_surface else off
        beneath = looks.beneath[first : settled + 1, column]
        looked = int(np.searchsorted(looks.t, looks.t[last] - LAST_LOOK))
        reason: MissReason | None = None
        if (beneath < 0).all():
            reason = MissReason.NO_CONTACT
        elif away[settled] > radius or not (beneath == mine).any():
            reason = MissReason.BESIDE
        elif away[last] > radius or (looks.beneath[looked : last + 1, column] != mine).all():
            reason = MissReason.LEFT
        distance = float(away[last] if reason is MissReason.LEFT else away[settled])
        out.append((float(off[settled]),
                    MissedFoothold(step, leg, distance, reason) if reason else None))  # fmt: skip
    return out
