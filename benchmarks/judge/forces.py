"""Contact forces at random instants: one linear program each, of all forces together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from scipy.optimize import linprog

from benchmarks.judge.body import GRAVITY, RATE_JUMP
from benchmarks.judge.motion import Finding, Motion, at_least, at_most, rotation
from gaitopt import LEGS, ForceLimits
from gaitopt.conventions import FloatArray

NOTHING = 1e-6
"""What the linear program's own tolerance may take from a limit, as a share of the weight."""
WORST, LOOKS = 3, 2
"""Around so many of the tightest instants others are looked at, so many times."""
NEAREST = 60
"""So many samples are looked at around an instant that somebody names."""
NO_ANSWER = 4
"""HiGHS's presolve sometimes ends without a verdict (seen once, in a trot of go2), where the
program without it is solved."""
PLACEHOLDER = 3.0
"""Effort limits of more than so many times the weight times the reach of a leg are none."""


class Contact(NamedTuple):
    """One standing foot: its point, normal, friction and Jacobian ``(3, 6 + nj)``."""

    point: FloatArray
    normal: FloatArray
    friction: float
    jacobian: FloatArray


def contact_forces(
    motion: Motion, instants: int, rng: np.random.Generator, around: Sequence[float] = ()
) -> list[Finding]:
    """Jumps of velocities, and the tightest limit at random instants and around phases' ends.

    Args:
        motion: the samples.
        instants: how many random ones there are.
        rng: chooses them.
        around: times whose :data:`NEAREST` samples are looked at as well [s].
    """
    limits = motion.plan.settings.promised_forces
    if limits is None:
        return []
    first = np.flatnonzero(np.diff(motion.segments))
    jumps = np.abs(motion.rates[first] - motion.rates[first + 1]).max(axis=1, initial=0.0)
    chosen = rng.choice(len(motion.times), min(instants, len(motion.times)), replace=False)
    starts = np.array([p.start for p in motion.plan.phases] + [motion.plan.duration])
    near = np.flatnonzero(np.abs(motion.times[:, None] - starts).min(axis=1) < 1e-9)
    chosen = np.union1d(chosen, rng.choice(near, min(instants // 2, len(near)), replace=False))
    for time in around:
        chosen = np.union1d(chosen, np.argsort(np.abs(motion.times - time))[:NEAREST])
    accelerations = motion.derivative(2)
    left: dict[int, tuple[float, str]] = {}
    for look in range(1 + LOOKS):
        for k in chosen.tolist():
            if k not in left:
                left[k] = _tightest(motion, k, accelerations[k], limits)
        worst = sorted(left, key=lambda k: left[k][0])[:WORST]
        # Samples that are near in time, then nearer: limits are tight for an instant only.
        aside = np.arange(-3, 4) * 4 ** (LOOKS - 1 - look) if look < LOOKS else np.zeros(1, int)
        chosen = np.unique(np.clip(np.add.outer(worst, aside), 0, len(motion.times) - 1))
    least = [found for found, _ in left.values()]
    where = [f"{motion.times[k]:.4f} s, {what}" for k, (_, what) in left.items()]
    weight = float(pin.computeTotalMass(motion.model)) * GRAVITY
    return [
        at_most("contact forces", jumps, RATE_JUMP, [f"jump at {t:.4f} s" for t in
                                                     motion.times[first]]),
        at_least("contact forces", least, -NOTHING * weight, where),
    ]  # fmt: skip


def velocities(values: FloatArray, rates: FloatArray, rises: FloatArray) -> tuple[FloatArray, ...]:
    """Pinocchio's ``v`` and its derivative, from the path's values and two derivatives."""
    turn = rotation(values[3:6])
    (roll, pitch), (dr, dp, dy), (ar, ap, ay) = values[3:5], rates[3:6], rises[3:6]
    sr, cr, sp, cp = np.sin(roll), np.cos(roll), np.sin(pitch), np.cos(pitch)
    spin = np.array([dr - dy * sp, dp * cr + dy * cp * sr, -dp * sr + dy * cp * cr])
    rise = np.array([
        ar - ay * sp - dy * dp * cp,
        ap * cr - dp * dr * sr + ay * cp * sr - dy * dp * sp * sr + dy * dr * cp * cr,
        -ap * sr - dp * dr * cr + ay * cp * cr - dy * dp * sp * cr - dy * dr * cp * sr,
    ])  # fmt: skip
    along = turn.T @ rates[:3]
    v = np.concatenate([along, spin, rates[6:]])
    a = np.concatenate([turn.T @ rises[:3] - np.cross(spin, along), rise, rises[6:]])
    return v, a


def _tightest(motion: Motion, k: int, rises: FloatArray, limits: ForceLimits) -> tuple[float, str]:
    """What the tightest limit leaves at a sample [N], for the forces that leave it the most."""
    model, data = motion.model, motion.data
    q = motion.configuration(motion.values[k])
    v, a = velocities(motion.values[k], motion.rates[k], rises)
    needed = np.array(pin.rnea(model, data, q, v, a))
    weight = float(pin.computeTotalMass(model)) * GRAVITY
    reach = max(leg.reach for leg in motion.robot.legs.values())
    legs = [i for i in range(4) if motion.standing[k, i]]
    contacts = [_contact(motion, k, q, i, limits) for i in legs]
    world = np.zeros((6, 6))  # forces in the base's frame to force and moment about its origin
    turn = rotation(motion.values[k][3:6])
    world[:3, :3] = world[3:, 3:] = turn
    base = world @ needed[:6]
    on = " ".join(LEGS[i] for i in legs) or "no foot"
    if not contacts:
        flight = _flight_middle(motion, k) - motion.values[k][:3]
        moment = base[3:] - np.cross(flight, base[:3])
        left = np.linalg.norm(base[:3]) + np.linalg.norm(moment) / reach
        return float(limits.balance_tolerance * weight - left), on
    jacobian = np.concatenate([c.jacobian for c in contacts])
    grip = np.concatenate([world @ c.jacobian[:, :6].T for c in contacts], axis=1)
    rows, least = [], []  # rows f - least >= slack
    on_four = limits.reserve / 2 if limits.reserve_on_four is None else limits.reserve_on_four
    share = limits.reserve if len(legs) < 4 else on_four
    for n, contact in enumerate(contacts):
        for row, bound in _pyramid(contact, limits.sides, share * weight):
            wide = np.zeros(3 * len(contacts))
            wide[3 * n : 3 * n + 3] = row
            rows.append(wide)
            least.append(bound)
    efforts = _efforts(motion, limits, v[6:], weight, reach)
    for column, (low, high) in enumerate(efforts.T):
        row = jacobian[:, 6 + column]
        for sign, bound in ((1.0, high), (-1.0, -low)):
            if np.isfinite(bound):  # sign (needed - row f) <= bound
                rows.append(sign * row / reach)
                least.append((sign * needed[6 + column] - bound) / reach)
    # Unknowns: forces [weights] and the slack. Three rows of forces, three of moments over the
    # reach: all are shares of the weight.
    scale = np.array([1.0, 1.0, 1.0, 1 / reach, 1 / reach, 1 / reach])
    equal, right = scale[:, None] * grip, scale * base / weight
    above, beyond = -np.array(rows), -np.array(least) / weight
    if len(contacts) == 2:
        line = contacts[1].point - contacts[0].point
        line /= np.linalg.norm(line)
        half = 0.5 * motion.robot.stance_size[0]
        middle = 0.5 * (contacts[0].point + contacts[1].point) - motion.values[k][:3]
        # The moment about the line through two feet cannot be made: it must be small.
        about = np.concatenate([-np.cross(line, middle), line])  # on force and moment at the base
        left = abs(float(about @ base))
        loose = limits.balance_tolerance * weight * half - left
        if loose < 0.0:
            return float(loose / half), f"{on}: moment of {left:.4g} N m about their line"
        frame = np.linalg.svd(about[None] / scale)[2][1:]
        equal, right = frame @ equal, frame @ right
    program: dict[str, Any] = {
        "c": np.append(np.zeros(3 * len(contacts)), -1.0),
        "A_ub": np.column_stack([above, np.ones(len(above))]), "b_ub": beyond,
        "A_eq": np.column_stack([equal, np.zeros(len(equal))]), "b_eq": right,
        "bounds": [(None, None)] * (3 * len(contacts)) + [(None, 1.0)], "method": "highs",
    }  # fmt: skip
    done = linprog(**program)
    if done.status == NO_ANSWER:
        done = linprog(**program, options={"presolve": False})
    return (-np.inf if done.x is None else float(done.x[-1]) * weight), on


def _contact(motion: Motion, k: int, q: FloatArray, i: int, limits: ForceLimits) -> Contact:
    """The contact of a foot, one foot radius below the ball's centre along the normal."""
    plan, leg = motion.plan, LEGS[i]
    time = motion.times[k] + (1e-7 if motion.local[k] == 0.0 else -1e-7)
    ended = [s.index + 1 for s in plan.swings if s.leg == leg and s.end <= time]
    index = min(max(ended, default=0), plan.footholds.counts[leg] - 1)
    normal = plan.footholds.normal_array[i, index]
    friction = limits.friction
    if plan.footholds.friction is not None:
        friction = min(friction, float(plan.footholds.friction[leg][index]))
    pin.computeJointJacobians(motion.model, motion.data, q)
    pin.updateFramePlacements(motion.model, motion.data)
    frame = motion.frames[i]
    arm = -motion.robot.foot_radius * normal
    whole = pin.getFrameJacobian(motion.model, motion.data, frame, pin.LOCAL_WORLD_ALIGNED)
    jacobian = whole[:3] - pin.skew(arm) @ whole[3:]
    return Contact(motion.data.oMf[frame].translation + arm, normal, friction, jacobian)


def _pyramid(contact: Contact, sides: int, least: float) -> list[tuple[FloatArray, float]]:
    """Rows of a friction pyramid whose edges lie on the cone, and the least normal force.

    The pyramid's first side faces x of the world, turned as the vertical turns into the normal.
    """
    normal = contact.normal / np.linalg.norm(contact.normal)
    turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), normal).matrix()
    out = [(normal, least)]
    for n in range(sides):
        angle = 2.0 * np.pi * n / sides
        aside = turn @ np.array([np.cos(angle), np.sin(angle), 0.0])
        out.append((contact.friction * np.cos(np.pi / sides) * normal - aside, 0.0))
    return out


def _efforts(
    motion: Motion, limits: ForceLimits, speeds: FloatArray, weight: float, reach: float
) -> FloatArray:
    """Least and largest torque of each joint at its speed ``(2, nj)`` [N m]."""
    stated = np.array(motion.robot.effort_limits)
    stated[stated > PLACEHOLDER * weight * reach] = np.inf
    largest = limits.torque_share * stated
    knee, end = (limits.speed_share * row for row in motion.robot.torque_lines)
    if limits.torque_line is not None:
        knee = np.minimum(knee, limits.torque_line.knee * motion.robot.velocity_limits)
        end = np.minimum(end, limits.torque_line.no_load * motion.robot.velocity_limits)
    falls = np.isfinite(end)
    left = np.ones(len(speeds))
    left[falls] = np.clip(
        (end[falls] - np.abs(speeds[falls])) / (end[falls] - knee[falls]), 0.0, 1.0
    )
    driving = np.where(np.isfinite(largest), largest, 1.0) * left
    driving = np.where(np.isfinite(largest), driving, np.inf)
    return np.stack([-np.where(speeds < 0.0, driving, largest),
                     np.where(speeds > 0.0, driving, largest)])  # fmt: skip


def _flight_middle(motion: Motion, k: int) -> FloatArray:
    """Middle of the base's places in the flight of all feet that holds a sample."""
    grounded = motion.standing.any(axis=1)
    before = np.flatnonzero(grounded[:k])
    after = np.flatnonzero(grounded[k:])
    low = before[-1] + 1 if len(before) else 0
    high = k + after[0] if len(after) else len(grounded)
    places = motion.values[low:high, :3]
    return np.asarray(0.5 * (places.min(axis=0) + places.max(axis=0)))
