"""A course is timed several times: near the speeds that it has, and slower where it is too fast."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.torque_limits import torque_lines
from gaitopt.errors import InfeasibleStepError
from gaitopt.motion.path import MotionPath
from gaitopt.motion.pieces import stretched
from gaitopt.motion.retiming import legs_needed_stretch
from gaitopt.plan.plan import Plan
from gaitopt.retiming.other_limits import OtherLimits
from gaitopt.retiming.paced import PacedCourse
from gaitopt.retiming.pacing import Pacing
from gaitopt.retiming.transfers import with_gentle_loads, with_transfers

STRETCH_RESERVE = 1e-6
"""Share of time that is added where a motion is stretched, so that rounding exceeds no limit."""
LINE_ROUNDS = 2
"""Times that torques which fall with the speed are limited anew, near the speeds of the timing
before: a third one makes four steps of six robots less than 0.01 % faster."""
SLOWER_TANGENTS = 0.05
"""Share of squared speeds near which they are limited where those of the timing before would not
do."""
MOST_ROUNDS = 5
"""Most times that a motion is timed. Each round takes at least a quarter off what is too much."""


def paced(
    plan: Plan, promised: ForceLimits | None, others: OtherLimits, rounding: float,
    load_time: float = 0.0,
) -> tuple[PacedCourse, MotionPath, FloatArray]:  # fmt: skip
    """A plan's course at the highest speed that forces, torques and joints allow, and its path.

    Returns:
        The motion, its path, and how long it is to rest before each of its intervals ``(K,)`` [s],
        which neither of them counts.

    Args:
        plan, promised, others, rounding: as in :meth:`Pacing.of`.
        load_time: as in :func:`with_gentle_loads`.

    Raises:
        InfeasibleStepError: somewhere there is no speed at which forces exist.
        SolverError: feet leave their course however short the intervals are, or between the places
            of the grid there are no forces.
    """
    pacing = with_gentle_loads(Pacing.of(plan, promised, others, rounding), load_time)
    pacing = with_transfers(near_its_speeds(pacing))
    for _ in range(MOST_ROUNDS):
        motion, found = pacing.fastest()
        path = motion.path()
        slower = pacing.slowed(motion, path, found)
        if slower is None:
            break
        pacing = slower
    else:
        pacing.check(motion, path)
    robot = plan.robot
    velocities = robot.velocity_limits[robot.leg_joint_columns]
    accelerations = others.acceleration / np.broadcast_to(others.scales, len(robot.joint_names))
    needed = legs_needed_stretch(
        robot, path, 0.0, velocities, accelerations[robot.leg_joint_columns], 1
    )
    if needed <= 1.0:
        return motion, path, pacing.rests
    factor = needed * (1.0 + STRETCH_RESERVE)
    return replace(motion, stretch=factor), stretched(path, factor), pacing.rests


def near_its_speeds(pacing: Pacing) -> Pacing:
    """The same, with limits of torques that fall with the speed near the fastest timing.

    Limits far from it are lower than they have to be, so each timing is faster than the one before,
    and all of them keep the promised ones.

    Raises:
        InfeasibleStepError: somewhere there is no speed at which forces exist.
    """
    if pacing.promised is None or torque_lines(pacing.course.robot, pacing.promised) is None:
        return pacing
    plain = replace(pacing, timing=replace(pacing.timing, falling=False))
    expected = plain.squares(plain.fastest()[0])
    for _ in range(LINE_ROUNDS):
        near = replace(pacing, timing=replace(pacing.timing, expected=expected))
        try:
            expected = near.squares(near.fastest()[0])
        except InfeasibleStepError:
            # Near the speeds of a timing that exists there is one. These were no such speeds.
            expected = expected * SLOWER_TANGENTS
    return replace(pacing, timing=replace(pacing.timing, expected=expected))
