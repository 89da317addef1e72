"""What is known of the motors of the legs' joints, and limits of their accelerations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

from gaitopt.errors import InputError
from gaitopt.robots.files.limbs import Limb
from gaitopt.robots.files.options import PairPerJoint, PerJoint, SpeedPair

Value = TypeVar("Value", float, SpeedPair)


def motor_inertias(
    label: str, limbs: Mapping[str, Limb], known: Mapping[str, float], given: PerJoint | None
) -> dict[str, float]:
    """Inertias of motors and gears, seen at their joints, by joint [kg m^2].

    Args:
        label: what to call the robot in messages.
        limbs: the legs.
        known: what the file says.
        given: what the user says; it counts where both do.

    Raises:
        InputError: the user names a joint that no leg has.
    """
    found = _by_joint(label, "motor_inertia", limbs, known, given)
    return {joint: value for joint, value in found.items() if value > 0.0}


def acceleration_limits(
    label: str, limbs: Mapping[str, Limb], known: Mapping[str, float], given: PerJoint | None
) -> dict[str, float]:
    """Limits of the joints' accelerations, by joint [rad/s^2].

    Args:
        label, limbs, given: as in :func:`motor_inertias`.
        known: what was given when the file was read before.

    Raises:
        InputError: the user names a joint that no leg has.
    """
    return _by_joint(label, "acceleration_limits", limbs, known, given)


def torque_lines(
    label: str, limbs: Mapping[str, Limb], known: Mapping[str, SpeedPair],
    given: PairPerJoint | None,
) -> dict[str, SpeedPair]:  # fmt: skip
    """Speeds at which the torques of joints begin to fall and end, by joint [rad/s].

    Args:
        label, limbs, known, given: as in :func:`motor_inertias`.

    Raises:
        InputError: the user names a joint that no leg has.
    """
    return _by_joint(label, "torque_line", limbs, known, given)


def _by_joint(
    label: str,
    what: str,
    limbs: Mapping[str, Limb],
    known: Mapping[str, Value],
    given: Value | Mapping[str, Value] | None,
) -> dict[str, Value]:
    """Values by joint: what is known, and in its place what the user gives, for all or for some.

    Args:
        label, limbs, known, given: as in :func:`motor_inertias`.
        what: the name of the user's option.

    Raises:
        InputError: the user names a joint that no leg has.
    """
    joints = [joint.name for limb in limbs.values() for joint in limb.joints]
    if given is None:
        return dict(known)
    own = given if isinstance(given, Mapping) else dict.fromkeys(joints, given)
    refuse_unknown(label, what, own, joints)
    return {**known, **own}


def refuse_unknown(label: str, what: str, given: Mapping[str, object], joints: list[str]) -> None:
    """Refuse an option that names a joint that no leg has.

    Raises:
        InputError: it does.
    """
    for name in given:
        if name not in joints:
            raise InputError(
                f"{label}: {what}: no leg has a joint {name!r}; they are {', '.join(joints)}"
            )
