"""The body's move from where it came to rest to where a walk begins, on four feet."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.errors import InfeasibleStateError, InfeasibleStepError, InputError, SolverError
from gaitopt.motion.body_and_feet import body_and_feet_path
from gaitopt.motion.path import MotionPath
from gaitopt.motion.pieces import States
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.retiming.other_limits import OtherLimits
from gaitopt.retiming.retimed import GENTLE_LIFT, timed
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

SAME_PLACE = 1e-12
"""Base columns that differ by less are the same [m, rad]."""
FOOT_TOLERANCE = 1e-6
"""Largest distance of a foot from its place between knots [m]."""
INTERVALS = 24
"""Intervals of a move before it is timed."""


def moved(
    robot: Quadruped, footholds: Footholds, begin: FloatArray, end: FloatArray,
    limits: ForceLimits, accelerations: FloatArray, what: str = "start",
) -> MotionPath | None:  # fmt: skip
    """The body's way on four feet, from rest to rest, as fast as forces and joints allow.

    All base columns go along a straight line; up and down the body is accelerated by no more than
    :data:`~gaitopt.retiming.retimed.GENTLE_LIFT`. Nothing moves where both ends are the same:
    ``None``.

    Args:
        robot: the robot.
        footholds: the feet stand on their first ones.
        begin, end: columns of the base ``(6,)``.
        limits: on forces and torques.
        accelerations: that joints keep ``(nj,)`` [rad/s^2]; infinite for none.
        what: of the plan the move belongs to, for the message of an error.

    Raises:
        InfeasibleStateError: a leg does not reach its foot on the way, or no contact forces hold
            the robot; tells what is in the way.
    """
    change = end - begin
    if np.abs(change).max() <= SAME_PLACE:
        return None
    feet = np.array([footholds[leg][0] for leg in LEGS])
    knots = np.linspace(0.0, 1.0, INTERVALS + 1)

    def base(times: FloatArray) -> States:
        # 10 t^3 - 15 t^4 + 6 t^5: at rest, without acceleration, at both ends.
        t = times[:, None]
        return (
            begin + change * t**3 * (10.0 - 15.0 * t + 6.0 * t**2),
            change * 30.0 * t**2 * (1.0 - t) ** 2,
            change * 60.0 * t * (1.0 - t) * (1.0 - 2.0 * t),
        )

    def stand(times: FloatArray) -> States:
        place = np.broadcast_to(feet, (len(times), *feet.shape))
        return np.array(place), np.zeros(place.shape), np.zeros(place.shape)

    try:
        path = body_and_feet_path(robot, knots, base, stand, FOOT_TOLERANCE)
        settings = CrawlSettings.for_robot(robot, forces=limits)
        phase = Phase("stance", "", 0, 0.0, 1.0, begin[:3], end[:3], LEGS, feet[0], feet[0], 0.0)
        firsts = Footholds({leg: footholds[leg][:1] for leg in LEGS},
                           normals=_firsts(footholds.normals),
                           friction=_firsts(footholds.friction))  # fmt: skip
        others = replace(OtherLimits.of_joints(accelerations), lift=GENTLE_LIFT)
        return timed(Plan(robot, firsts, settings, (phase,), path), limits, others).path
    except (InputError, InfeasibleStepError, SolverError) as error:
        raise InfeasibleStateError(
            f"{what}: the body cannot move there from where it rests, with four feet on the "
            f"ground: {error}", "move on four feet", 1.0, 1.0, "", 0.0,
        ) from error  # fmt: skip


def _firsts(of_legs: object) -> dict[str, FloatArray] | None:
    return None if of_legs is None else {leg: of_legs[leg][:1] for leg in LEGS}  # type: ignore[index]
