"""Reads the constants of a leg off its joints: one whose inverse is a closed form, or any other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.robots.discovery import Chain
from gaitopt.robots.leg import Leg
from gaitopt.robots.leg_parts import LegParts
from gaitopt.robots.standing import can_stand

AXIS_TOLERANCE = 1e-9
"""How far from parallel or perpendicular joint axes may be for a closed form that is exact to 1e-9
m [rad]. Files whose digits are rounded are made exact before (:mod:`gaitopt.robots.files.axes`)."""
LEAST_ALIGNMENT = 0.5
"""Least cosine of the angle between a leg's roll axis and the body's x axis, and between axes of
pitch and the body's y axis: legs may be turned by up to 60 degrees."""

LEAST_REACH = 0.05
"""Least reach that the knee's limits must leave a leg, as a share of its length. Chosen: those of
all robots that were tried leave 0.8 and more."""


def read_leg(model: Any, name: str, chain: Chain, body: FloatArray, knee: float | None) -> Leg:
    """The constants of one leg, in the body frame.

    Args:
        model: the Pinocchio model.
        name: the leg's name.
        chain: its joints.
        body: axes of the body frame in the base frame ``(3, 3)``.
        knee: side of the knee, +1 forward, -1 backward; ``None`` takes it from the knee's limits,
            and where they allow both sides about equally, from those of the thigh; where these do,
            too, it points front knees backward and hind knees forward.

    Returns:
        A roll-pitch-pitch or pitch-pitch leg, or another one of three joints: a
        :class:`gaitopt.robots.general_leg.leg.GeneralLeg`.

    Raises:
        RobotError: a leg of two joints is not pitch-pitch; or one of three joints has no posture in
            which it stands and moves its foot in all directions; or the knee lets it only fold.
        InputError: the knee's limits do not let it point to the side that was asked for.
    """
    points, axes = chain.points @ body, chain.axes @ body
    tip = chain.tip @ body
    parts = LegParts(model, name, chain, points, axes, tip, knee)
    square = _square_frame(axes)
    if square is not None:
        return _square_leg(parts, *square)
    if len(axes) == 3:
        from gaitopt.robots.general_leg.reading import general_leg

        return general_leg(parts)
    raise RobotError(
        f"{parts.listing} is not pitch-pitch: both axes must point sideways and be parallel. With "
        "two joints that turn otherwise no foot stands still while the body moves ahead; give each "
        "leg a third joint, as a roll axis before two pitch axes"
    )


def _square_frame(axes: FloatArray) -> tuple[FloatArray, tuple[float, ...]] | None:
    """The leg frame ``(3, 3)``, and the signs of the joints' axes in it.

    ``None`` where the axes ``(nj, 3)`` are neither those of roll-pitch-pitch nor of pitch-pitch.
    """
    pitch = axes[-2] * np.sign(axes[-2, 1] or 1.0)
    if (
        abs(pitch[1]) < LEAST_ALIGNMENT
        or np.linalg.norm(np.cross(axes[-1], pitch)) > AXIS_TOLERANCE
    ):
        return None
    if len(axes) == 3:
        roll = axes[0] * np.sign(axes[0, 0] or 1.0)
        if abs(roll[0]) < LEAST_ALIGNMENT or abs(roll @ pitch) > AXIS_TOLERANCE:
            return None
        # Exactly perpendicular, whatever the URDF's digits, so that the inverse is exact.
        roll = roll - (roll @ pitch) * pitch
    else:
        roll = np.cross(pitch, np.array([0.0, 0.0, 1.0]))
    roll /= np.linalg.norm(roll)
    frame = np.column_stack([roll, pitch, np.cross(roll, pitch)])
    references = [roll, pitch, pitch][-len(axes) :]
    signs = tuple(float(np.sign(a @ r)) for a, r in zip(axes, references, strict=True))
    return frame, signs


def _square_leg(parts: LegParts, frame: FloatArray, signs: tuple[float, ...]) -> Leg:
    """A leg whose inverse is the closed form of roll-pitch-pitch or pitch-pitch."""
    points = parts.points
    local = (np.vstack([points, parts.tip]) - points[0]) @ frame
    if len(signs) == 3:
        hip = points[0] + frame[:, 0] * local[1, 0]
        lateral, drop = local[3, 1], np.round(-local[1, 2], 12)
        links = np.diff(local[1:], axis=0)
    else:
        hip, lateral, drop = points[0], local[2, 1], 0.0
        links = np.diff(local, axis=0)
    lengths = np.hypot(links[:, 0], links[:, 2])
    parts.check_links(lengths)
    angles = np.arctan2(-links[:, 0], -links[:, 2])
    zeros = (float(angles[0]), parts.knee_zero(float(angles[1] - angles[0]), signs[-1]))
    leg = Leg(
        name=parts.name,
        joints=parts.chain.names,
        foot=parts.chain.foot,
        hip=hip,
        axes=frame,
        lateral=float(lateral),
        drop=float(drop) + 0.0,
        upper=float(lengths[0]),
        lower=float(lengths[1]),
        signs=signs,
        zeros=zeros,
        knee=parts.knee_side(signs[-1] * parts.limits[:, -1] + zeros[1]),
        position_limits=parts.limits,
        velocity_limits=parts.rates,
    )
    if parts.knee is None and not can_stand(leg):
        # The limits of the thigh may tell what those of the knee leave open.
        other = replace(leg, knee=-leg.knee)
        leg = other if can_stand(other) else leg
    if not leg.reach > LEAST_REACH * (leg.upper + leg.lower):
        low, high = leg.position_limits[:, -1]
        raise RobotError(
            f"{parts.model.name}: leg {leg.name}: the limits of {leg.joints[-1]} ({low:.4g} to "
            f"{high:.4g} rad) let the leg do nothing but fold: its foot comes {leg.reach:.2g} m "
            "from its hip at most; correct them"
        )
    return leg
