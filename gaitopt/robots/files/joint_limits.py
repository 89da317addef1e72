"""Limits of the legs' joints: those of the file where they can be true, and those of the user."""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np

from gaitopt.errors import RobotError
from gaitopt.robots.files.options import PerJoint
from gaitopt.robots.files.tree import Joint

ASSUMED_VELOCITY = 10.0
"""Velocity limit of a joint for which the file has none [rad/s]. Chosen: 7.5 to 52 are those of the
robots of example-robot-data whose limits are real."""
PLACEHOLDER_VELOCITY = 100.0
"""Velocity limits from here on are taken for placeholders [rad/s]. Chosen: twice the largest of
those robots."""


def set_limits(
    label: str, joints: Sequence[Joint], velocity: PerJoint | None, effort: PerJoint | None
) -> list[str]:
    """Make the limits of joints valid, and put the user's in their place.

    Args:
        label: what to call the robot in messages.
        joints: the hinges of the legs, which change.
        velocity, effort: the user's limits [rad/s], [N m].

    Returns:
        Warnings.

    Raises:
        RobotError: an option names a joint that no leg has.
    """
    names = [joint.name for joint in joints]
    for what, given in (("velocity_limits", velocity), ("effort_limits", effort)):
        for name in given if isinstance(given, dict) else ():
            if name not in names:
                raise RobotError(
                    f"{label}: {what}: no leg has a joint {name!r}; they are {', '.join(names)}"
                )
    warnings = _ranges(joints)
    guessed, high, weak = [], [], []
    for joint in joints:
        limit = _limit(joint)
        for name, given in (("velocity", velocity), ("effort", effort)):
            value = _given(given, joint.name)
            if value is not None:
                limit.set(name, repr(value))
        speed, torque = _value(limit, "velocity"), _value(limit, "effort")
        if not 0.0 < speed < np.inf:
            limit.set("velocity", repr(ASSUMED_VELOCITY))
            guessed.append(joint.name)
        elif speed >= PLACEHOLDER_VELOCITY and _given(velocity, joint.name) is None:
            high.append(f"{joint.name} {speed:g}")
        if not 0.0 < torque < np.inf:
            limit.set("effort", "0")
            weak.append(joint.name)
    if guessed:
        warnings.append(
            f"no velocity limit for {_some(guessed)}: {ASSUMED_VELOCITY:g} rad/s is assumed; give "
            "velocity_limits= in rad/s"
        )
    if high:
        warnings.append(
            f"velocity limits that look like placeholders [rad/s]: {_some(high)}; give "
            "velocity_limits= in rad/s"
        )
    if weak:
        warnings.append(
            f"no effort limit for {_some(weak)}: their torques are not limited; give "
            "effort_limits= in N m"
        )
    return warnings


def _ranges(joints: Sequence[Joint]) -> list[str]:
    """Make position limits valid; returns warnings."""
    missing, crossed = [], []
    for joint in joints:
        limit = _limit(joint)
        low, high = _value(limit, "lower"), _value(limit, "upper")
        if joint.kind == "continuous" or not (np.isfinite(low) and np.isfinite(high)):
            if joint.kind != "continuous":
                missing.append(joint.name)
            low = high = 0.0
        elif low > high:
            crossed.append(joint.name)
            low, high = high, low
        # What gaitopt reads as "no limits" is an empty range (gaitopt.robots.limits).
        if (low, high) != (_value(limit, "lower"), _value(limit, "upper")):
            limit.set("lower", repr(low))
            limit.set("upper", repr(high))
        joint.element.set("type", "revolute")
    warnings = []
    if missing:
        warnings.append(
            f"{_some(missing)} have no position limits, or infinite ones: they are not checked; "
            "add <limit lower= upper=> to the file"
        )
    if crossed:
        warnings.append(
            f"lower limits above upper ones of {_some(crossed)}: they were exchanged; correct the "
            "file if that is wrong"
        )
    return warnings


def _limit(joint: Joint) -> ElementTree.Element:
    """A joint's element ``<limit>``, which is made where it is missing."""
    limit = joint.element.find("limit")
    return ElementTree.SubElement(joint.element, "limit") if limit is None else limit


def _value(limit: ElementTree.Element, name: str) -> float:
    """A limit; 0 where it is missing.

    Raises:
        RobotError: it is no number.
    """
    text = limit.get(name, "0")
    try:
        value = float(text)
    except ValueError:
        value = np.nan
    if np.isnan(value) or (value < 0.0 and name in ("velocity", "effort")):
        raise RobotError(f"a joint's {name} limit is {text[:30]!r}; it must be a number, >= 0")
    return value


def _given(given: PerJoint | None, joint: str) -> float | None:
    """The user's limit for a joint."""
    if given is None or isinstance(given, (int, float)):
        return None if given is None else float(given)
    return None if joint not in given else float(given[joint])


def _some(names: Sequence[str]) -> str:
    """Up to four names, and how many more there are."""
    more = f" and {len(names) - 4} more" if len(names) > 4 else ""
    return ", ".join(names[:4]) + more
