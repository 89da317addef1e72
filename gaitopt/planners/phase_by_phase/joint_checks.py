"""What the joints of a timed walk must keep: reach, position limits, no jumps, precise paths.

Each check raises an error that names the step, the leg or joint, and a way out.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.planners.phase_by_phase.steps import CrawlSteps
from gaitopt.robots.leg import Leg
from gaitopt.robots.quadruped import Quadruped

REACH_TOLERANCE = 1e-6
"""Largest distance by which a foot may be out of reach [m]: the error that the COG problem's
solution may have (``ERROR_TOLERANCE`` of :mod:`gaitopt.optimize.cog.solver`)."""
ANGLE_ROUNDING = 1e-9
"""Largest angle by which a joint may exceed its position limits [rad], for rounding."""


def check_within_reach(leg: Leg, feet: FloatArray, step: np.ndarray, steps: CrawlSteps) -> None:
    """Refuse feet that the leg does not reach.

    Args:
        leg: the leg.
        feet: places of its foot in the body's frame ``(M, 3)`` [m].
        step: the step that each of them belongs to ``(M,)``.
        steps: all steps.

    Raises:
        InfeasibleStepError: names the worst place.
    """
    short = leg.shortfall(feet)
    worst = int(short.argmax())
    if short[worst] <= REACH_TOLERANCE:
        return
    raise InfeasibleStepError(
        f"step {step[worst]} ({steps.legs[step[worst]]}): the foot of {leg.name} would have to "
        f"be {leg.gap_in_words(feet[worst])}; change swing_height or body_height",
        step=int(step[worst]), leg=leg.name, conflicts=(f"reach {leg.name}",),
    )  # fmt: skip


def check_position_limits(
    robot: Quadruped, joints: FloatArray, step: np.ndarray, steps: CrawlSteps, kind: str
) -> None:
    """Refuse joint angles ``(M, nj)`` [rad] outside of the position limits.

    Args:
        robot, joints: whose angles, and which.
        step: the step that each row of them belongs to ``(M,)``.
        steps: all steps.
        kind: ``"stance"`` or ``"swing"``.

    Raises:
        InfeasibleStepError: names the joint that exceeds its limits most in the first such leg.
    """
    least, most = joints.min(axis=0), joints.max(axis=0)
    lowest, highest = robot.position_limits
    own = robot.leg_joint_columns
    # A comparison with NaN is false: such angles are looked at below.
    if (np.maximum(lowest - least, most - highest)[own] <= ANGLE_ROUNDING).all():
        return
    for name, leg in robot.legs.items():
        columns = list(robot.leg_columns[name])
        low, high = leg.position_limits
        over = np.maximum(low - least[columns], most[columns] - high)
        worst = int(over.argmax())
        if over[worst] <= ANGLE_ROUNDING:
            continue
        angles = joints[:, columns[worst]]
        knot = int(np.maximum(low[worst] - angles, angles - high[worst]).argmax())
        raise InfeasibleStepError(
            f"step {step[knot]} ({kind} for {steps.legs[step[knot]]}): joint {leg.joints[worst]} "
            f"would turn to {angles[knot]:.4f} rad, and its limits are {low[worst]:.4f} to "
            f"{high[worst]:.4f} rad; try another body_height or nearer footholds",
            step=int(step[knot]), leg=name, conflicts=(f"position {leg.joints[worst]}",),
        )  # fmt: skip


def check_no_full_turns(
    robot: Quadruped,
    joints: FloatArray,
    firsts: np.ndarray,
    step: np.ndarray,
    steps: CrawlSteps,
    kind: str,
) -> None:
    """Refuse joint angles that jump by a turn from one knot to the next.

    Inverse kinematics gives angles within half a turn of zero. So it hides that a joint would have
    to go on beyond that, for instance when a hip comes down to its foot.

    Args:
        robot, joints, step, steps, kind: as in :func:`check_position_limits`.
        firsts: index of each step's first knot.

    Raises:
        InfeasibleStepError: names the joint and the step.
    """
    jumps = np.abs(np.diff(joints, axis=0))
    jumps[firsts[1:] - 1] = 0.0
    if jumps.max(initial=0.0) <= np.pi:
        return
    knot, joint = (int(i) for i in np.unravel_index(int(jumps.argmax()), jumps.shape))
    if jumps[knot, joint] > np.pi:
        raise InfeasibleStepError(
            f"step {step[knot]} ({kind} for {steps.legs[step[knot]]}): joint "
            f"{robot.joint_names[joint]} would have to turn on by more than half a turn; raise "
            "body_height",
            step=int(step[knot]), leg=steps.legs[step[knot]],
            conflicts=(f"position {robot.joint_names[joint]}",),
        )  # fmt: skip


def check_precision(
    step: np.ndarray,
    errors: FloatArray,
    too_coarse: BoolArray,
    intervals: int,
    steps: CrawlSteps,
    kind: str,
) -> None:
    """Refuse moves whose feet leave their paths even with the most knots that are allowed.

    Args:
        step: the steps of the moves ``(n,)``.
        errors: how far feet leave their paths ``(n,)`` [m].
        too_coarse: which of the moves to refuse ``(n,)``.
        intervals: the number of intervals that they have.
        steps, kind: as in :func:`check_position_limits`.

    Raises:
        SolverError: names the first such step.
    """
    if too_coarse.any():
        i = int(np.flatnonzero(too_coarse)[0])
        raise SolverError(
            f"step {step[i]} ({kind} for {steps.legs[step[i]]}): feet leave their path by "
            f"{errors[i]:.2g} m between knots, even with {intervals} intervals; take "
            "reach_fraction below 1 or another body_height, so that no leg is quite straight or "
            "folded",
            step=int(step[i]),
        )
