"""Reads a leg of three hinges with any axes: its size, and the posture in which it stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.robots.general_leg.hinges import ThreeHinges
from gaitopt.robots.general_leg.inverse import HingeInverse
from gaitopt.robots.general_leg.leg import GeneralLeg
from gaitopt.robots.leg_angles import wrap_angle
from gaitopt.robots.leg_parts import LegParts

LEAST_ALIGNMENT = 0.5
"""Least cosine of the angle between the knee's axis and the body's y axis, at zero angles and in
the standing posture: up to 60 degrees, as for other legs (:mod:`gaitopt.robots.leg_reading`)."""
STANDING_SHARES = (0.7, 0.8, 0.6, 0.9, 0.5)
"""Heights of the shoulder above the foot, as shares of the leg's reach, at which the posture of a
standing leg is looked for. Chosen: the first is that of a standing robot
(:mod:`gaitopt.robots.standing`)."""
OUTWARD = (0.4, 0.3, 0.2, 0.0)
"""How far out the feet of sprawling legs are, as shares of the leg's reach, that are tried. Chosen:
farther out, straight legs reach no footholds; farther in, steps to the side turn the legs more."""
ROUNDS = 50
"""Rounds in which the posture and the place of the shoulder are found by turns."""
AGREED = 1e-9
"""Distance by which the shoulder moves in the last of them [m]."""
LEAST_MOBILITY = 0.05
"""Least determinant of the foot's Jacobian in the standing posture, as a share of that of a leg
with square axes that are all as far from the foot as they can be. Chosen: a leg that is straight to
0.1 rad has less."""
SWING, STEPS = 0.7, 15
"""How far hip joints turn from the standing posture when it is measured how far the shoulder moves
[rad], and how many places of each joint are looked at. Chosen: a leg that leans by 0.7 rad puts the
foot as far aside as it is low."""
STEEPEST = 0.7
"""Least cosine of the angle between the vertical and the way from shoulder to foot there."""
SLACK_RESERVE = 1.02
"""Factor on what was measured, for what is between the places."""

_NOT_STANDING = (
    "{} is neither roll-pitch-pitch nor pitch-pitch, and it cannot stand: no posture within its "
    "limits has the foot below the hip, free to move in all directions, and a knee whose axis "
    "points sideways; turn the base link so that the robot faces along its x or y, or correct the "
    "axes or limits"
)
_SPRAWLING = (
    "{} turns first about the vertical, and no posture within its limits has the foot below the "
    "hip or beside it, free to move in all directions; gaitopt plans for legs that lean sideways "
    "at their first joint (roll), and for sprawling ones that reach out from a vertical axis: "
    "correct the axes, or allow more than these limits [rad]: {}"
)
VERTICAL = 0.9
"""Least cosine of the angle between an axis and the vertical with which it counts as vertical."""


def general_leg(parts: LegParts) -> GeneralLeg:
    """A leg of three hinges with any axes."""
    hinges = ThreeHinges(parts.axes, parts.points, parts.tip)
    solver = HingeInverse.of(hinges)
    axis, sideways = parts.axes[2], float(parts.axes[2, 1])
    sign = float(np.sign(sideways))
    if abs(sideways) < LEAST_ALIGNMENT or solver.is_singular:
        raise _refusal(parts)
    links = np.diff([solver.shoulder, solver.knee, parts.tip], axis=0)
    flat = links - (links @ axis)[:, None] * axis
    lengths = np.linalg.norm(flat, axis=1)
    parts.check_links(lengths)
    bend = np.arctan2(sign * axis @ np.cross(*flat), flat[0] @ flat[1])
    zero = parts.knee_zero(float(bend), sign)
    first = GeneralLeg(
        name=parts.name,
        joints=parts.chain.names,
        foot=parts.chain.foot,
        hip=solver.shoulder,
        axes=np.eye(3),
        lateral=float(sign * (links.sum(axis=0) @ axis)),
        drop=0.0,
        upper=float(lengths[0]),
        lower=float(lengths[1]),
        signs=(1.0, 1.0, sign),
        zeros=(0.0, zero),
        knee=parts.knee_side(sign * parts.limits[:, -1] + zero),
        position_limits=parts.limits,
        velocity_limits=parts.rates,
        hinges=hinges,
        standing=np.clip(0.0, *parts.limits),
    )
    leg = _standing(parts, first, solver)
    return replace(leg, slack=_slack(leg))


def _standing(parts: LegParts, leg: GeneralLeg, solver: HingeInverse) -> GeneralLeg:
    """The leg with its standing posture, and its shoulder in it.

    Raises:
        RobotError: there is none in which the foot can move in all directions.
    """
    below = _standing_with(leg, solver, np.array([0.0, leg.lateral, 0.0]), np.zeros(3))
    if below is not None:
        return below
    if abs(parts.axes[0, 2]) > VERTICAL:
        # Feet stand beside the hips: the place above the foot counts as the hip.
        plain = replace(leg, lateral=0.0)
        for out in OUTWARD:
            found = _standing_with(plain, solver, np.zeros(3), _outward(parts, leg, out))
            if found is not None:
                return found
    raise _refusal(parts)


def _outward(parts: LegParts, leg: GeneralLeg, out: float) -> FloatArray:
    """From the shoulder to above the foot of a leg that reaches out ``(3,)`` [m], at zero angles.

    Args:
        parts, leg: the leg.
        out: how far the foot is out, as a share of the leg's reach.
    """
    axis = np.append(parts.axes[2, :2], 0.0)
    axis *= leg.signs[2] / np.linalg.norm(axis)
    start, shoulder, _, tip = leg.joint_points(np.clip(0.0, *parts.limits))
    away = tip - (start + shoulder) / 2.0
    ahead = np.array([axis[1], -axis[0], 0.0])
    ahead *= np.sign(away @ ahead) or 1.0
    return np.asarray(leg.lateral * axis + out * leg.reach * ahead)


def _standing_with(
    leg: GeneralLeg, solver: HingeInverse, beside: FloatArray, out: FloatArray
) -> GeneralLeg | None:
    """The leg with its standing posture; ``None`` where it has none that can move its foot.

    Args:
        leg, solver: the leg.
        beside: from the hip to above the foot ``(3,)`` [m].
        out: from the shoulder to what counts as the hip ``(3,)`` [m].
    """
    for share in STANDING_SHARES:
        found = leg
        for _ in range(ROUNDS):
            hip = leg.joint_points(found.standing)[1] + out
            foot = hip + beside - np.array([0.0, 0.0, share * leg.reach])
            q = _standing_angles(leg, solver, foot)
            if q is None:
                break
            moved = float(np.linalg.norm(leg.joint_points(q)[1] + out - hip))
            found = replace(leg, hip=hip, standing=q)
            if moved < AGREED:
                largest = leg.upper * leg.lower * (leg.upper + leg.lower)
                if abs(np.linalg.det(leg.jacobian(q))) > LEAST_MOBILITY * largest:
                    return found
                break
    return None


def _refusal(parts: LegParts) -> RobotError:
    """The error of a leg that cannot stand."""
    words = _SPRAWLING if abs(parts.axes[0, 2]) > VERTICAL else _NOT_STANDING
    limits = ", ".join(
        f"{joint} {low:.3g} to {high:.3g}"
        for joint, (low, high) in zip(parts.chain.names, parts.limits.T.tolist(), strict=True)
    )
    return RobotError(words.format(parts.listing, limits))


def _standing_angles(leg: GeneralLeg, solver: HingeInverse, foot: FloatArray) -> FloatArray | None:
    """Joint angles ``(3,)`` [rad] for the place of a foot ``(3,)``; ``None`` where there are none.

    The knee is on its side, with its axis pointing as at zero angles.
    """
    found = solver.postures(foot[None])[0]
    found = solver.improved(found, np.repeat(foot[None], len(found), axis=0))
    centres = np.where(np.isfinite(leg.position_limits).all(axis=0),
                       leg.position_limits.sum(axis=0) / 2.0, 0.0)  # fmt: skip
    found = wrap_angle(found, centres)
    at = leg.hinges.placed(found)
    bends = wrap_angle(leg.signs[2] * found[:, 2] + leg.zeros[1])
    low, high = leg.position_limits
    kept = (
        (np.linalg.norm(at.foot - foot, axis=1) < AGREED)
        & (at.axes[:, 2, 1] * leg.signs[2] > LEAST_ALIGNMENT)
        & (bends * leg.knee > 0.0)
        & ((found >= low) & (found <= high)).all(axis=1)
    )
    if not kept.any():
        return None
    away = np.where(kept, ((found - centres) ** 2).sum(axis=1), np.inf)
    return np.asarray(found[away.argmin()])


def _slack(leg: GeneralLeg) -> float:
    """How much longer a leg may be than the distance of its foot from its hip tells [m].

    It is measured at many postures with the foot below the hip.
    """
    low, high = leg.position_limits
    ranges = [
        np.linspace(max(low[i], leg.standing[i] - SWING), min(high[i], leg.standing[i] + SWING),
                    STEPS) for i in range(2)
    ]  # fmt: skip
    bends = np.linspace(0.0, np.pi, STEPS) * leg.knee
    knees = np.clip(leg.signs[2] * (bends - leg.zeros[1]), low[2], high[2])
    q = np.stack(np.meshgrid(*ranges, knees), axis=-1).reshape(-1, 3)
    way = leg.forward(q) - leg.hip
    distance = np.sqrt(np.maximum((way**2).sum(axis=1) - leg.lateral**2, 0.0))
    bend = leg.signs[2] * q[:, 2] + leg.zeros[1]
    square = leg.upper**2 + leg.lower**2 + 2.0 * leg.upper * leg.lower * np.cos(bend)
    length = np.sqrt(np.maximum(square, 0.0))
    below = -way[:, 2] > STEEPEST * np.linalg.norm(way, axis=1)
    excess = float(np.max(length - distance, where=below, initial=0.0))
    return SLACK_RESERVE * excess if excess > AGREED else 0.0
