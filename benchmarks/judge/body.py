"""Checks of body and joints: margins, limits, reach, accelerations."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pinocchio as pin

from benchmarks.judge.motion import Finding, Motion, at_least, at_most
from gaitopt import LEGS
from gaitopt.conventions import FloatArray

RELATIVE = 1e-9
"""How much limits of joints may be exceeded."""
MARGIN_ROUNDING = 1e-8
"""Rounding of margins [m]; chosen here."""
RATE_JUMP = 1e-6
"""Largest jump of a velocity at a knot that is rounding [m/s, rad/s]; chosen here."""
GRAVITY = 9.81
"""[m/s^2], that of Pinocchio's models."""


def depth(points: FloatArray, corners: FloatArray) -> FloatArray:
    """How deep points ``(N, 2)`` lie in the convex hull of two to four corners ``(N, m, 2)``.

    The least over all pairs of corners that have all the others on one side of the line through
    them; negative outside, where it is the distance to the line of a side. With two corners it is
    minus the distance to the segment.
    """
    if corners.shape[1] == 2:
        a, along = corners[:, 0], corners[:, 1] - corners[:, 0]
        share = ((points - a) * along).sum(axis=1) / (along**2).sum(axis=1)
        nearest = a + np.clip(share, 0.0, 1.0)[:, None] * along
        return -np.asarray(np.linalg.norm(points - nearest, axis=1))
    least = np.full(len(points), np.inf)
    for a, b in combinations(range(corners.shape[1]), 2):
        along = corners[:, b] - corners[:, a]
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        others = [k for k in range(corners.shape[1]) if k not in (a, b)]
        sides = np.stack([((corners[:, k] - corners[:, a]) * normal).sum(axis=1) for k in others])
        here = ((points - corners[:, a]) * normal).sum(axis=1)
        for sign in (1.0, -1.0):
            is_side = (sign * sides >= 0.0).all(axis=0)
            least = np.where(is_side, np.minimum(least, sign * here), least)
    return least


def margins(motion: Motion) -> list[Finding]:
    """Margins of body centre and true centre of mass, of plans that promise static stability."""
    plan, settings = motion.plan, motion.plan.settings
    if not settings.static:
        return []
    promised, whole, times, all_times = [], [], [], []
    for phase in plan.phases[plan.entry :]:
        here = motion.during(phase.start, phase.end)
        feet = motion.feet[here][:, [LEGS.index(leg) for leg in phase.support], :2]
        if not here.any() or feet.shape[1] < 3:
            continue
        body = motion.com if settings.true_com else motion.centre
        whole.append(depth(motion.com[here, :2], feet))
        all_times.append(motion.times[here])
        if phase.flying:
            promised.append(depth(body[here, :2], feet))
            times.append(motion.times[here])
    name = "margin of the true COM" if settings.true_com else "margin of the body centre"
    out = [_margin("margin of the true COM", whole, 0.0, all_times)]
    return [*out, _margin(name, promised, settings.stability_margin, times)]


def _margin(name: str, found: list[FloatArray], limit: float, times: list[FloatArray]) -> Finding:
    empty = np.empty(0)
    joined = np.concatenate([empty, *found])
    when = np.concatenate([empty, *times])
    at = at_least(name, joined + MARGIN_ROUNDING, limit, [f"{t:.4f} s" for t in when])
    return at


def zmp(motion: Motion) -> list[Finding]:
    """The ZMP of a point mass at the body centre, of plans that state its margin and no forces."""
    plan = motion.plan
    asked, told = plan.settings.zmp_margin, plan.record.zmp_margin
    if plan.settings.promised_forces is not None or (asked is None and told is None):
        return []
    limit = asked - 1e-6 if asked is not None else told - 1e-5
    motions = motion.derivative(2)[:, :3]  # level bodies: the centre turns with the yaw alone
    middle = motion.centre - motion.values[:, :3]
    yaw_rate, yaw_rise = motion.rates[:, 5], motion.derivative(2)[:, 5]
    turned = np.stack([-middle[:, 1], middle[:, 0]], axis=1)
    acceleration = motions[:, :2] + yaw_rise[:, None] * turned
    acceleration -= (yaw_rate**2)[:, None] * middle[:, :2]
    ground = motion.feet[:, :, 2].min(axis=1) - motion.robot.foot_radius
    height = (motion.centre[:, 2] - ground) / (GRAVITY + motions[:, 2])
    points = motion.centre[:, :2] - height[:, None] * acceleration
    found, times = [], []
    for phase in plan.phases:
        here = (motion.inner >= phase.start) & (motion.inner <= phase.end)
        feet = motion.feet[here][:, [LEGS.index(leg) for leg in phase.support], :2]
        if here.any() and feet.shape[1] >= 2:
            found.append(depth(points[here], feet))
            times.append(motion.times[here])
    first = np.flatnonzero(np.diff(motion.segments))
    jumps = np.abs(motion.rates[first, :6] - motion.rates[first + 1, :6]).max(axis=1, initial=0.0)
    if (jumps > RATE_JUMP).any():  # an acceleration without bound
        found, times = [*found, np.array([-np.inf])], [*times, motion.times[first[:1]]]
    return [_margin("ZMP of the body centre", found, limit, times)]


def joints(motion: Motion) -> list[Finding]:
    """Positions and velocities of the joints within the URDF's limits."""
    names, values, rates = motion.robot.joint_names, motion.values[:, 6:], motion.rates[:, 6:]
    low, high = motion.robot.position_limits
    beyond = np.maximum(low - values, values - high).max(axis=0)
    size = np.where(np.isfinite(high - low), np.maximum(np.abs(low), np.abs(high)), 1.0)
    share = np.abs(rates).max(axis=0) / motion.robot.velocity_limits
    return [
        at_most("joint positions", beyond / np.maximum(size, 1.0), RELATIVE, names),
        at_most("joint velocities", share, 1.0 + RELATIVE, names),
    ]


def reach(motion: Motion) -> list[Finding]:
    """Length of each leg from its second hinge to its foot, as a share of the straight leg's."""
    worst, where = [], []
    for leg in LEGS:
        own = motion.robot.legs[leg]
        if not own.has_roll or type(own).__module__.find("general") >= 0:
            continue
        column = motion.robot.leg_columns[leg][2]
        knee = motion.model.joints[motion.model.getJointId(own.joints[2])]
        place = motion.model.jointPlacements[knee.id]
        axis = _axis(motion, own.joints[2])
        foot = motion.model.frames[motion.model.getFrameId(own.foot)].placement.translation
        upper = place.rotation.T @ place.translation
        lower = foot - axis * (axis @ foot)
        upper = upper - axis * (axis @ upper)
        angles = motion.values[:, 6 + column]
        # The foot turned about the knee's axis: square to it, so Rodrigues' formula has two terms.
        turned = np.outer(np.cos(angles), lower) + np.outer(np.sin(angles), np.cross(axis, lower))
        straight = np.linalg.norm(upper) + np.linalg.norm(lower)
        worst.append(np.linalg.norm(turned + upper, axis=1).max() / straight)
        where.append(leg)
    limit = motion.plan.settings.reach_fraction * (1.0 + RELATIVE)
    return [at_most("reach", worst, limit, where)]


def _axis(motion: Motion, name: str) -> FloatArray:
    """Axis of a hinge in its own frame."""
    model, data = motion.model, motion.data
    joint = model.getJointId(name)
    pin.computeJointJacobians(model, data, pin.neutral(model))
    columns = pin.getJointJacobian(model, data, joint, pin.LOCAL)
    return np.asarray(columns[3:, model.joints[joint].idx_v])


def accelerations(motion: Motion) -> list[Finding]:
    """Limits of joint accelerations and jerks where they are promised; no jumps at knots."""
    out, settings = [], motion.plan.settings
    for order, name, limit in ((2, "joint accelerations", settings.acceleration_limit),
                               (3, "joint jerks", settings.jerk_limit)):  # fmt: skip
        if limit is None:
            continue
        # Of a stride this is the largest of its joints' limits.
        most = np.abs(motion.derivative(order)[:, 6:]).max(axis=0) / limit
        below = motion.derivative(order - 1)[:, 6:]
        first = np.flatnonzero(np.diff(motion.segments))
        jumps = np.abs(below[first] - below[first + 1]).max(initial=0.0)
        out.append(at_most(name, most, 1.0 + RELATIVE, motion.robot.joint_names))
        out.append(at_most(f"{name}, jumps at knots", jumps, 1e-6 * limit, "all joints"))
    return out
