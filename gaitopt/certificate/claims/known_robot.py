"""Whether the robot inside a plan is no stronger than the one whose name it bears.

A plan holds its own robot, so that it can be checked anywhere. Somebody could raise a limit there,
and the plan would be judged by the raised limit. So a robot with a known name is compared with the
file of that name: its lengths, masses, collision shapes, and limits, none of which may be wider.
"""

from __future__ import annotations

import warnings
from typing import Any
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import MissingPackageError, RobotError, RobotWarning
from gaitopt.robots.catalog import OWN_NAMES, known_urdf, load_robot, taken_for
from gaitopt.robots.files.notes import TAG
from gaitopt.robots.quadruped import Quadruped

ROUNDING = 1e-9
"""Differences of lengths [m], and of masses and limits as shares of them, that are rounding."""


def refuse_other_robot(robot: Quadruped) -> bool:
    """Refuse a robot with a known name that differs from the one of that name.

    A robot of gaitopt's own must have its very text, unless options of :func:`gaitopt.load_robot`
    have changed it. A robot whose package is not installed is not compared.

    Returns:
        Whether there is a robot of that name that it was compared with.

    Raises:
        RobotError: it differs; the message says in what.
    """
    name = taken_for(robot.name)
    if name is None:
        return False
    try:
        if known_urdf(name) == robot.urdf:
            return True
    except MissingPackageError:
        return False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        known = load_robot(name)
    if name in OWN_NAMES and f"<{TAG}" not in robot.urdf:
        refuse_other_text(robot, known)
    refuse_stronger(robot, known)
    return True


def refuse_other_text(robot: Quadruped, known: Quadruped) -> None:
    """Refuse a robot whose URDF is not the very text of another one.

    Args:
        robot: the robot of a plan.
        known: the one that it should be.

    Raises:
        RobotError: the texts differ; the message has their fingerprints.
    """
    if robot.urdf != known.urdf:
        raise RobotError(
            f"the plan was made for a {robot.name} whose URDF has the fingerprint "
            f"{robot.sha256[:12]}, and {known.name} here has {known.sha256[:12]}; plan again "
            "for this robot"
        )


def refuse_stronger(robot: Quadruped, known: Quadruped) -> None:
    """Refuse a robot that differs from another in lengths or masses, or has wider limits.

    Args:
        robot: the robot of a plan.
        known: the one that it should be.

    Raises:
        RobotError: it differs; the message says in what.
    """
    found = _difference(robot, known)
    if found:
        raise RobotError(
            f"the plan was made for a {robot.name} that is not {known.name}: {found}; a plan is "
            f"not judged by limits of its own: plan again for {known.name}, or give the robot that "
            "it was made for (--robot FILE)"
        )


def _difference(robot: Quadruped, known: Quadruped) -> str:
    """The first difference, in words; empty where the robot is the same, or weaker."""
    for leg in LEGS:
        ours, theirs = robot.legs[leg], known.legs[leg]
        if ours.joints != theirs.joints:
            return f"leg {leg} has the joints {', '.join(ours.joints)}"
        if ours.is_general != theirs.is_general:
            return f"the axes of leg {leg} have other directions"
        lengths = [ours.constants, theirs.constants]
        if not np.abs(lengths[0] - lengths[1]).max() <= ROUNDING:
            return f"lengths of leg {leg} differ by {np.abs(lengths[0] - lengths[1]).max():.3g} m"
    if robot.joint_names != known.joint_names:
        return "it has other joints beside those of its legs"
    inertias = [np.array([i.toDynamicParameters() for i in list(r.model.inertias)[1:]])
                for r in (robot, known)]  # fmt: skip
    if not np.abs(inertias[0] - inertias[1]).max() <= ROUNDING * known.mass:
        return f"masses or inertias differ ({robot.mass:.6g} kg and {known.mass:.6g} kg in all)"
    if _shapes(robot) != _shapes(known):
        return "their collision shapes differ"
    # Of a robot whose file knows no motors a plan may know more.
    told = known.motor_inertia > 0.0
    if not (robot.motor_inertia[told] == known.motor_inertia[told]).all():
        return "the inertia of its motors differs"
    low, high = robot.position_limits, known.position_limits
    limits = (
        ("lower position", -low[0], -high[0], "rad"),
        ("upper position", low[1], high[1], "rad"),
        ("velocity", robot.velocity_limits, known.velocity_limits, "rad/s"),
        ("acceleration", robot.acceleration_limits, known.acceleration_limits, "rad/s^2"),
        ("torque", robot.effort_limits, known.effort_limits, "N m"),
        ("full torque's speed", robot.torque_lines[0], known.torque_lines[0], "rad/s"),
        ("speed without load", robot.torque_lines[1], known.torque_lines[1], "rad/s"),
    )
    for what, ours_all, theirs_all, unit in limits:
        raised = _raised(ours_all, theirs_all)
        if raised is not None:
            values = f"{abs(ours_all[raised]):.6g} and {abs(theirs_all[raised]):.6g} {unit}"
            return f"the {what} limit of {robot.joint_names[raised]} is wider ({values})"
    return ""


def _shapes(robot: Quadruped) -> tuple[Any, ...]:
    """All collision shapes of a robot."""
    links = ElementTree.fromstring(robot.urdf).findall("link")
    return robot.notes.hulls, sorted(
        (str(link.get("name")), ElementTree.tostring(shape).strip())
        for link in links
        for shape in link.findall("collision")
    )


def _raised(ours: FloatArray, theirs: FloatArray) -> int | None:
    """Index of the first limit that is wider than it should be; ``None`` where none is."""
    finite = np.isfinite(theirs)
    margin = ROUNDING * np.where(finite, np.abs(theirs), 0.0)
    wide = np.flatnonzero(finite & ~(ours <= theirs + margin))
    return int(wide[0]) if len(wide) else None
