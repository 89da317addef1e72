"""Checks of the joints: positions, velocities, accelerations, jerks, and the legs' reach."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin

from gaitopt.certificate.check import JUMP, RELATIVE, SHORT, Check, Verdict, judged, worst_place
from gaitopt.certificate.enclosure import Pieces
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.plan.plan import Plan

Line = tuple[FloatArray, FloatArray]
MOST_HALVINGS = 20
"""Most times that a piece is cut in halves. The bound falls with the square of its length: twelve
times leave a ten-millionth of what it was."""
PARALLEL = 1e-6
"""Squared sine of the angle below which two axes count as parallel [rad^2]."""
_DERIVATIVES = {2: ("joint accelerations", "rad/s^2"), 3: ("joint jerks", "rad/s^3")}


def joint_positions(plan: Plan, motion: Motion) -> Check:
    """Joints stay within their limits: a polynomial lies within its Bernstein coefficients."""
    low, high = plan.robot.position_limits
    if not np.isfinite([low, high]).any():
        return Check("joint positions", Verdict.OK, -np.inf, RELATIVE, "rad",
                     note="no limits stated")  # fmt: skip
    worst, when, joint = _worst(
        motion.pieces, 0, lambda least, most: np.maximum(low - least, most - high), RELATIVE
    )
    return judged("joint positions", worst, RELATIVE, "rad beyond limits", when=when,
                   where=plan.robot.joint_names[joint])  # fmt: skip


def joint_velocities(plan: Plan, motion: Motion) -> Check:
    """Joints keep their velocity limits, by the Bernstein coefficients of their rates."""
    limits = plan.robot.velocity_limits
    worst, when, joint = _worst(
        motion.pieces, 1, lambda least, most: _size(least, most) / limits, 1.0 + RELATIVE
    )
    return judged("joint velocities", worst, 1.0 + RELATIVE, "of the limit", when=when,
                   where=plan.robot.joint_names[joint])  # fmt: skip


def joint_accelerations(plan: Plan, motion: Motion) -> Check | None:
    """Joints keep the acceleration limits of the plan and of the robot, where there are any.

    A jump of velocity at a knot is an acceleration without bound.
    """
    limits = _own_limits(plan, 2, plan.settings.acceleration_limit)
    return _derivative(plan, motion, 2, np.minimum(limits, plan.robot.acceleration_limits))


def joint_jerks(plan: Plan, motion: Motion) -> Check | None:
    """Joints keep the jerk limit, where the plan claims one.

    A jump of acceleration at a knot is a jerk without bound.
    """
    return _derivative(plan, motion, 3, _own_limits(plan, 3, plan.settings.jerk_limit))


def _derivative(plan: Plan, motion: Motion, order: int, limits: FloatArray) -> Check | None:
    """The derivative of all joints of this ``order``, held against limits ``(nj,)``."""
    name, unit = _DERIVATIVES[order]
    bounded = np.isfinite(limits)
    if not bounded.any():
        return None
    limit = float(limits[bounded].max())
    most_allowed = limit * (1.0 + RELATIVE)
    # Joints with limits of their own are held against these: shares of the largest one. Those
    # without count nothing.
    own = limit / limits
    worst, when, joint = _worst(
        motion.pieces, order, lambda least, most: _size(least, most) * own, most_allowed
    )
    before = np.where(bounded, plan.path.jumps(order - 1)[:, 6:], 0.0)
    if before.size and before.max() > JUMP * max(limit, 1.0):
        knot, joint = worst_place(before)
        worst, when = np.inf, float(plan.path.times[knot + 1])
    return judged(name, worst, most_allowed, unit, when=when,
                   where=plan.robot.joint_names[joint])  # fmt: skip


def _own_limits(plan: Plan, order: int, limit: float | None) -> FloatArray:
    """The limits of the plan ``(nj,)``, which a stride has joint by joint; infinite for none."""
    count = len(plan.robot.joint_names)
    by_leg = {2: "accelerations", 3: "jerks"}[order]
    own: tuple[float, ...] = getattr(plan.settings, by_leg, ()) if limit is not None else ()
    limits = np.full(count, np.inf if limit is None else limit)
    for leg in LEGS if own else ():
        limits[list(plan.robot.leg_columns[leg])] = own
    return limits


def _size(least: FloatArray, most: FloatArray) -> FloatArray:
    """Largest size of numbers between two bounds."""
    return np.maximum(np.abs(least), np.abs(most))


def _worst(
    pieces: Pieces,
    derivative: int,
    measure: Callable[[FloatArray, FloatArray], FloatArray],
    limit: float,
) -> tuple[float, float, int]:
    """The worst measure of a derivative of the joints, the time of its piece [s], and the joint.

    Bernstein coefficients lie around the values and may exceed a limit where these do not. Pieces
    of which this is so are cut in halves, until no coefficient exceeds the limit, or a value does.

    Args:
        pieces: the path.
        derivative: of it.
        measure: from least and most values ``(P, nj)`` to what is held against the limit.
        limit: the most that is allowed.
    """
    found = (-np.inf, float("nan"), 0)
    for halving in range(MOST_HALVINGS + 1):
        low, high = pieces.enclosure(derivative)
        bounds = measure(low[:, 6:], high[:, 6:])
        # What is no number is not within the limit.
        beyond = np.logical_not(np.all(bounds <= limit, axis=1))
        if not beyond.all():
            found = max(found, _place(pieces, np.where(beyond[:, None], -np.inf, bounds)))
        if not beyond.any():
            break
        pieces, bounds = pieces.chosen(beyond), bounds[beyond]
        values = [measure(x[:, 6:], x[:, 6:]) for x in pieces.at_ends(derivative)]
        if halving == MOST_HALVINGS or not all((value <= limit).all() for value in values):
            return _place(pieces, bounds)
        pieces = pieces.cut(np.full(len(pieces.starts), 2))
    return found


def _place(pieces: Pieces, values: FloatArray) -> tuple[float, float, int]:
    """The largest of some values ``(P, nj)``, the time of its piece [s], and its joint."""
    piece, joint = worst_place(values)
    return float(values[piece, joint]), float(pieces.starts[piece]), joint


def reach(plan: Plan, motion: Motion) -> Check:
    """Legs are not straighter than the plan's reach fraction allows.

    On the way from a given state a leg may be as straight as it is there.
    """
    low, high = motion.pieces.enclosure()
    entry = plan.phases[plan.entry - 1].end if plan.entry else 0.0
    worst, place = -np.inf, (0, 0)
    for i, name in enumerate(LEGS):
        column = 6 + plan.robot.leg_columns[name][-1]
        a, b, c = _leg_length_law(plan, name)
        greatest = _largest_of_cosine(low[:, column], high[:, column], b, c)
        allowed = plan.settings.reach_fraction * _longest(plan, name, a, b, c)
        knee = plan.path.evaluate([0.0])[0, column]
        begin = np.sqrt(max(a + b * np.cos(knee) + c * np.sin(knee), 0.0))
        most = np.where(motion.pieces.starts < entry, max(allowed, begin), allowed)
        over = np.sqrt(np.maximum(a + greatest, 0.0)) - most
        if over.max() > worst:
            worst, place = float(over.max()), (int(over.argmax()), i)
    return judged("reach", worst, SHORT, "m beyond", when=motion.pieces.starts[place[0]],
                   where=LEGS[place[1]])  # fmt: skip


def _leg_length_law(plan: Plan, leg: str) -> tuple[float, float, float]:
    """``a, b, c`` of ``length**2 = a + b cos q + c sin q`` over the knee's angle q, by Pinocchio.

    The length is the foot's distance from the shoulder, square to the knee's axis; the shoulder is
    where the thigh's axis is nearest to that of the hip. For a knee parallel to the thigh's axis it
    is the distance from that axis. Three angles give the law.
    """
    model = plan.robot.model
    data = model.createData()
    joints = [model.getJointId(name) for name in plan.robot.legs[leg].joints]
    frame = model.getFrameId(plan.robot.legs[leg].foot)
    q, squares = pin.neutral(model), []
    for angle in (0.0, np.pi / 2, np.pi):
        q[model.joints[joints[-1]].idx_q] = angle
        pin.framesForwardKinematics(model, data, q)
        # Turning the knee moves none of these axes.
        axes = [data.oMi[joint].rotation @ _hinge_axis(model, joint) for joint in joints]
        shoulder = _nearest(
            *((data.oMi[joint].translation, axis)
              for joint, axis in zip(joints[-2::-1], axes[-2::-1], strict=True))
        )  # fmt: skip
        squares.append(
            float(np.sum(np.cross(axes[-1], data.oMf[frame].translation - shoulder) ** 2))
        )
    a = (squares[0] + squares[2]) / 2.0
    return a, squares[0] - a, squares[1] - a


def _nearest(line: Line, other: Line | None = None) -> FloatArray:
    """The point of a line that is nearest to another; any point if they are parallel.

    Lines are a point and a unit direction, ``(3,)`` each.
    """
    point, axis = line
    if other is None:
        return np.array(point)
    normal = np.cross(axis, other[1])
    square = float(normal @ normal)
    if square < PARALLEL:
        return np.array(point)
    return np.asarray(point + np.cross(other[0] - point, other[1]) @ normal / square * axis)


def _hinge_axis(model: pin.Model, joint: int) -> FloatArray:
    """The unit axis of a hinge in its own frame ``(3,)``."""
    data = model.joints[joint].createData()
    model.joints[joint].calc(data, pin.neutral(model))
    return frozen(np.reshape(data.S, 6)[3:])


def _largest_of_cosine(low: FloatArray, high: FloatArray, b: float, c: float) -> FloatArray:
    """Largest value of ``b cos q + c sin q`` for q from ``low`` to ``high``."""
    ends = np.maximum(b * np.cos(low) + c * np.sin(low), b * np.cos(high) + c * np.sin(high))
    turns = np.ceil((low - np.arctan2(c, b)) / (2 * np.pi))
    top = np.arctan2(c, b) + 2 * np.pi * turns
    return np.asarray(np.where(top <= high, np.hypot(b, c), ends))


def _longest(plan: Plan, leg: str, a: float, b: float, c: float) -> float:
    """The greatest length of the leg within the knee's limits [m]."""
    low, high = plan.robot.position_limits[:, plan.robot.leg_columns[leg][-1]]
    if not np.isfinite([low, high]).all():
        low, high = -np.pi, np.pi  # a full turn holds every angle
    most = _largest_of_cosine(np.array([low]), np.array([high]), b, c)
    return float(np.sqrt(a + float(most.max())))
