"""Limits of the legs' joints: those of the file where they can be true, and those of the user."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from xml.etree import ElementTree

import numpy as np

from gaitopt.errors import RobotError
from gaitopt.robots.files.motors import refuse_unknown
from gaitopt.robots.files.notes import first_of
from gaitopt.robots.files.options import PerJoint, SpeedPair
from gaitopt.robots.files.origins import number_in
from gaitopt.robots.files.tree import Joint

ASSUMED_VELOCITY = 10.0
"""Velocity limit of a joint for which the file has none [rad/s]. Chosen: 7.5 to 52 are those of the
robots of example-robot-data whose limits are real."""
PLACEHOLDER_VELOCITY = 100.0
"""Velocity limits from here on are taken for placeholders [rad/s]. Chosen: twice the largest of
those robots."""
LEAST_LIMIT = 1e-6
"""Limits on velocity and effort below this are taken for zero [rad/s], [N m]: no robot walks with
them, and numbers near the smallest that a computer knows overflow where something is divided by
them. Chosen."""


def set_limits(
    label: str, joints: Sequence[Joint], velocity: PerJoint | None, effort: PerJoint | None,
    lines: Mapping[str, SpeedPair],
) -> list[str]:  # fmt: skip
    """Make the limits of joints valid, and put the user's in their place.

    Args:
        label: what to call the robot in messages.
        joints: the hinges of the legs, which change.
        velocity, effort: the user's limits [rad/s], [N m].
        lines: torque lines of the motors, by joint [rad/s]. A motor's speed without load is the
            velocity limit of a joint that has none.

    Returns:
        Warnings.

    Raises:
        InputError: an option names a joint that no leg has.
        RobotError: a limit in the file is no number, or negative where it may not be.
    """
    names = [joint.name for joint in joints]
    for what, given in (("velocity_limits", velocity), ("effort_limits", effort)):
        refuse_unknown(label, what, given if isinstance(given, Mapping) else {}, names)
    warnings = _ranges(label, joints)
    guessed, high, weak = [], [], []
    for joint in joints:
        limit = _limit(joint)
        for name, given in (("velocity", velocity), ("effort", effort)):
            value = _given(given, joint.name)
            if value is not None:
                limit.set(name, repr(value))
        speed, torque = (_value(label, joint, name) for name in ("velocity", "effort"))
        if not 0.0 < speed < np.inf and joint.name in lines:
            limit.set("velocity", repr(lines[joint.name][1]))
        elif not 0.0 < speed < np.inf:
            limit.set("velocity", repr(ASSUMED_VELOCITY))
            guessed.append(joint.name)
        elif speed >= PLACEHOLDER_VELOCITY and _given(velocity, joint.name) is None:
            high.append(f"{joint.name} {speed:g}")
        if not 0.0 < torque < np.inf:
            limit.set("effort", "0")
            weak.append(joint.name)
    if guessed:
        warnings.append(
            f"no velocity limit for {first_of(guessed)}: {ASSUMED_VELOCITY:g} rad/s is assumed; "
            "give velocity_limits= in rad/s"
        )
    if high:
        warnings.append(
            f"velocity limits that look like placeholders [rad/s]: {first_of(high)}; give "
            "velocity_limits= in rad/s"
        )
    if weak:
        warnings.append(
            f"no effort limit for {first_of(weak)}: their torques are not limited; give "
            "effort_limits= in N m"
        )
    return warnings


def _ranges(label: str, joints: Sequence[Joint]) -> list[str]:
    """Make position limits valid; returns warnings."""
    missing, crossed = [], []
    for joint in joints:
        limit = _limit(joint)
        given = low, high = _value(label, joint, "lower"), _value(label, joint, "upper")
        if joint.kind == "continuous" or not (np.isfinite(low) and np.isfinite(high)):
            if joint.kind != "continuous":
                missing.append(joint.name)
            low = high = 0.0
        elif low > high:
            crossed.append(joint.name)
            low, high = high, low
        # What gaitopt reads as "no limits" is an empty range (gaitopt.robots.limits).
        if (low, high) != given:
            limit.set("lower", repr(low))
            limit.set("upper", repr(high))
        joint.element.set("type", "revolute")
    warnings = []
    if missing:
        warnings.append(
            f"{first_of(missing)} have no position limits, or infinite ones: they are not checked; "
            "add <limit lower= upper=> to the file"
        )
    if crossed:
        warnings.append(
            f"lower limits above upper ones of {first_of(crossed)}: they were exchanged; correct "
            "the file if that is wrong"
        )
    return warnings


def _limit(joint: Joint) -> ElementTree.Element:
    """A joint's element ``<limit>``, which is made where it is missing."""
    limit = joint.element.find("limit")
    return ElementTree.SubElement(joint.element, "limit") if limit is None else limit


def _value(label: str, joint: Joint, name: str) -> float:
    """A joint's limit; 0 where it is missing, or where it means nothing.

    Raises:
        RobotError: it is no number, or negative where it may not be.
    """
    text = _limit(joint).get(name, "0")
    value, positive = number_in(text), name in ("velocity", "effort")
    if np.isnan(value) or (value < 0.0 and positive):
        raise RobotError(
            f"{label}: joint {joint.name}: its {name} limit is {text[:30]!r}; it must be "
            f"a number{', and not negative' * positive}"
        )
    return 0.0 if positive and value < LEAST_LIMIT else value


def _given(given: PerJoint | None, joint: str) -> float | None:
    """The user's limit for a joint; ``None`` where there is none."""
    return given.get(joint) if isinstance(given, Mapping) else given
