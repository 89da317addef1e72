"""Feet of a planned walk whose balls roll too far on their footholds.

The ball of a real foot rolls as its leg turns, by the radius times the angle, and lands before its
foothold by half of the way (:mod:`gaitopt.motion.rolling`). Where steps are nearly as long as the
robot is high, half of the way is nearly the radius of a column, and a foot that lands a few
millimetres off rolls from it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.motion.rolling import rolled_away
from gaitopt.plan.contact_ground import ground_below
from gaitopt.plan.plan import Plan

EVERY = 0.02
"""Time between the samples of a plan [s]."""
LEAST_SAMPLES, MOST_SAMPLES = 1_000, 20_000
"""Least and most samples; short walks are looked at more often, and long ones less often."""
TOLD = 0.75
"""Half of the way on a column, as a share of the radius within which feet may land, from which on
it is told. Of 45 walks of eight robots with steps of 0.9 to 1.1 times their height those that lost
footholds had 0.84 or more, but for two of hyq, which fell for another reason."""


class RollingFoot(NamedTuple):
    """A foot that rolls far on a foothold.

    Attributes:
        step, leg: after which step, and whose foot.
        way: half of the way that its ball rolls [m].
        radius: within which feet may land [m].
    """

    step: int
    leg: str
    way: float
    radius: float

    def in_words(self) -> str:
        """What is in the way, and what helps."""
        return (
            f"step {self.step} ({self.leg}): the ball of the foot rolls by {1e3 * self.way:.0f} mm "
            f"to either side of its foothold while it stands, as its leg turns, on a column with a "
            f"radius of {1e3 * self.radius:.0f} mm; a foot that lands a little off may roll from "
            "it; what helps: shorter steps, or wider columns (radius)"
        )


def foot_rolling_off(plan: Plan) -> RollingFoot | None:
    """The first foot that rolls by more than :data:`TOLD` of a column's radius; ``None`` without.

    Feet that are points do not roll.

    Args:
        plan: over columns.
    """
    radius, ball = plan.footholds.landing_radius, plan.robot.foot_radius
    if not (ball > 0.0 and _may_turn(plan, TOLD * radius / (0.5 * ball))):
        return None
    found = first_rolling_step(plan, TOLD * radius)
    return None if found is None else RollingFoot(*found, radius)


def _may_turn(plan: Plan, most: float) -> bool:
    """Whether a foot's link may turn by more than ``most`` while it stands [rad].

    No link turns by more than the ways of its joints and of the body in all. Nor by more than
    their ranges, as long as the joints' axes stay where they are: the integral of an axis ``a``
    over an angle ``q`` is at most the range of ``q`` times one and half of the way of ``a``, by
    parts. The angles are those between phases; what they miss there, the path hardly does.

    Args:
        plan: over columns.
        most: [rad].
    """
    times = np.array([0.0, *(phase.end for phase in plan.phases)])
    values = plan.path.evaluate(times)[:, 3:]
    ways = np.cumsum(np.abs(np.diff(values, axis=0, prepend=values[:1])), axis=0)
    standing = np.array([[leg in phase.support for leg in LEGS] for phase in plan.phases], np.int8)
    standing = standing.reshape(-1, len(LEGS))  # a plan may have no step
    edges = np.diff(np.pad(standing, ((1, 1), (0, 0))), axis=0)
    for i, leg in enumerate(LEGS):
        # Yaw, pitch and roll, in the order in which they turn.
        columns = [2, 1, 0, *(3 + column for column in plan.robot.leg_columns[leg])]
        firsts, lasts = np.flatnonzero(edges[:, i] > 0), np.flatnonzero(edges[:, i] < 0)
        turned = ways[lasts][:, columns] - ways[firsts][:, columns]
        for stance in np.flatnonzero(turned.sum(axis=1) > most).tolist():
            angles = values[firsts[stance] : lasts[stance] + 1, columns]
            # Body and joints before a joint turn its axis.
            axes = np.append(0.0, np.cumsum(turned[stance])[:-1])
            if np.ptp(angles, axis=0) @ (1.0 + 0.5 * axes) > most:
                return True
    return False


def first_rolling_step(plan: Plan, most: float) -> tuple[int, str, float] | None:
    """The first step whose foot rolls too far on its foothold: step, leg, half of the way [m].

    Args:
        plan: the walk.
        most: half of the way that feet may roll [m].
    """
    wanted = int(np.ceil(plan.duration / EVERY)) + 1
    count = min(max(wanted, LEAST_SAMPLES), MOST_SAMPLES)
    times = np.linspace(0.0, plan.duration, count)
    away = _away(plan, times)
    for swing in plan.swings:
        leg = LEGS.index(swing.leg)
        later = (s.start for s in plan.swings if s.leg == swing.leg and s.start > swing.start)
        first, last = np.searchsorted(times, [swing.end, next(later, plan.duration)])
        way = float(away[first:last, leg].max(initial=0.0))
        if way > most:
            return swing.step, swing.leg, way
    return None


def _away(plan: Plan, times: FloatArray) -> FloatArray:
    """How far rolling balls are from the feet of a plan ``(N, 4)`` [m]."""
    at = plan.at(times)
    limits = plan.settings.promised_forces
    below = ground_below(plan, times, 1.0 if limits is None else limits.friction)
    standing = np.array(at.contacts)
    normals = np.broadcast_to(below.normals, (*standing.shape, 3))
    dt = float(times[1] - times[0])
    ways = rolled_away(plan.robot, at.q, at.v, standing, dt, normals)
    return np.asarray(np.linalg.norm(ways, axis=-1))
