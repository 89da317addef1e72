"""Checks of a URDF's text, before Pinocchio reads it.

Readers of URDFs accept much that is wrong: a mass of -1 kg, a mass that is no number (they drop
it), or an upper limit below the lower one. Each would end in a wrong plan much later.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from typing import Any
from xml.etree import ElementTree

from gaitopt.errors import RobotError
from gaitopt.robots.xml_text import parsed_xml, shown, unsafe

LARGEST_MASS = 1e9
"""Mass from which on a link's mass is taken for a mistake [kg]."""

_NEEDS_LIMITS = ("revolute", "prismatic")

MASS_ROUNDING = 1e-9
"""Share of a robot's mass that sums of its links' masses may differ by: rounding is far less."""

LARGEST = 1e3
"""Largest size of a shape that is taken for one [m]: that of places in a robot's file."""


def check_urdf(urdf: str, label: str) -> None:
    """Refuse a URDF that is not valid.

    Args:
        urdf: the text.
        label: what to call it in the message.

    Raises:
        RobotError: the message names the link or joint, the attribute and its value.
    """
    root = parsed_urdf(urdf, label)
    for kind in ("link", "joint"):
        _check_names(root, kind, label)
    for link in root.findall("link"):
        _check_link(link, f"{label}: link {link.get('name')}")
    for joint in root.findall("joint"):
        _check_joint(joint, f"{label}: joint {joint.get('name')}")


def parsed_urdf(urdf: str, label: str) -> ElementTree.Element:
    """The element ``<robot>`` of a URDF.

    Args:
        urdf: the text.
        label: what to call it in the message.

    Raises:
        RobotError: the text is no URDF, too large, or could do harm when it is read.
    """
    if "<robot" not in urdf:
        raise RobotError(f"{label}: no <robot> element; this is not a URDF")
    root = parsed_xml(urdf, label, "URDF")
    if root.tag != "robot":
        raise RobotError(f"{label}: the outermost element is <{root.tag}>, not <robot>")
    return root


def _check_names(root: ElementTree.Element, kind: str, label: str) -> None:
    """Refuse links or joints without a name that can be printed, and two with the same name."""
    names = Counter(element.get("name") for element in root.findall(kind))
    for name, count in names.items():
        if not name:
            raise RobotError(f"{label}: a {kind} has no name")
        if any(map(unsafe, name)):
            raise RobotError(
                f"{label}: the name of the {kind} {shown(name)} holds a character that cannot be "
                "printed; rename it"
            )
        if count > 1:
            raise RobotError(f"{label}: {count} {kind}s have the name {name}")


def _check_link(link: ElementTree.Element, where: str) -> None:
    """Refuse masses, inertias and sizes of shapes that are no sensible numbers."""
    for mass in link.iterfind("inertial/mass"):
        value = _number(mass, "value", where)
        if not 0.0 <= value < LARGEST_MASS:
            raise RobotError(
                f"{where}: a mass of {value:g} kg; it must be positive, and below "
                f"{LARGEST_MASS:g} kg"
            )
    for inertia in link.iterfind("inertial/inertia"):
        for name in inertia.keys():  # noqa: SIM118
            _number(inertia, name, where)
    for origin in link.iterfind("./*/origin"):
        for name in ("xyz", "rpy"):
            if len((origin.get(name) or "0 0 0").split()) not in (0, 3):
                raise RobotError(
                    f"{where}: an origin with {name}={origin.get(name)!r}; give 3 numbers"
                )
        for part in (origin.get("xyz") or "").split():
            if not -LARGEST <= _finite(part) <= LARGEST:
                raise RobotError(
                    f"{where}: an origin at {origin.get('xyz')!r}; a part of a link lies within "
                    f"{LARGEST:g} m of it"
                )
    for shape in link.iterfind("./*/geometry/*"):
        for name in ("radius", "length"):
            if shape.get(name) is not None and not 0.0 < _number(shape, name, where) <= LARGEST:
                raise RobotError(
                    f"{where}: a {shape.tag} with {name} {shape.get(name)}; it must be positive, "
                    f"and {LARGEST:g} m at most"
                )
        size = shape.get("size")
        if size is not None or shape.tag == "box":
            lengths = [_finite(part) for part in (size or "").split()]
            if len(lengths) != 3 or not all(0.0 < length <= LARGEST for length in lengths):
                raise RobotError(
                    f"{where}: a box of size {size!r}; give 3 lengths, each of {LARGEST:g} m at "
                    "most"
                )


def _check_joint(joint: ElementTree.Element, where: str) -> None:
    """Refuse limits that are missing, no numbers, or contradict one another."""
    limit = joint.find("limit")
    if limit is None:
        if joint.get("type") in _NEEDS_LIMITS:
            raise RobotError(f"{where} is {joint.get('type')} and has no <limit>")
        return
    low, high = (_number(limit, name, where, "0") for name in ("lower", "upper"))
    if low > high:
        raise RobotError(f"{where}: its lower limit {low:g} is above its upper limit {high:g}")
    for name in ("velocity", "effort"):
        if _number(limit, name, where, "0") < 0.0:
            raise RobotError(f"{where}: its {name} limit {limit.get(name)} is negative")


def _number(
    element: ElementTree.Element, name: str, where: str, missing: str | None = None
) -> float:
    """The number in an attribute; ``missing`` stands for the text of one that is not there.

    Raises:
        RobotError: the attribute is missing, or no number.
    """
    text = element.get(name, missing)
    value = math.nan if text is None else _finite(text, infinite=element.tag == "limit")
    if math.isnan(value):
        said = "is missing" if text is None else f"is {text[:20]!r}, no finite number"
        raise RobotError(f"{where}: {name} of its <{element.tag}> {said}")
    return value


def _finite(text: str, *, infinite: bool = False) -> float:
    """The number in ``text``; NaN where it is none, or infinite and that is not allowed."""
    try:
        value = float(text)
    except ValueError:
        return math.nan
    return value if math.isfinite(value) or infinite else math.nan


def check_masses(model: Any, urdf: str, label: str) -> None:
    """Refuse a model that has lost masses: readers drop an ``<inertial>`` that they cannot read.

    Args:
        model: Pinocchio's.
        urdf: its text.
        label: what to call it in the message.

    Raises:
        RobotError: the masses of the text's links add up to another mass.
    """
    import pinocchio as pin

    masses = ElementTree.fromstring(urdf).iterfind("link/inertial/mass")
    stated = sum(float(mass.get("value", "0")) for mass in masses)
    found = float(pin.computeTotalMass(model))
    if not abs(found - stated) <= MASS_ROUNDING * stated:
        raise RobotError(
            f"{label}: the masses of its links add up to {stated:.6g} kg, and Pinocchio reads "
            f"{found:.6g} kg: it cannot read one of the <inertial> elements; write their numbers "
            "without blanks around them"
        )


def with_velocity_limit(urdf: str, limit: float) -> str:
    """The URDF with this velocity limit [rad/s] on every joint that has limits.

    Only the numbers of ``<limit velocity="...">`` change; everything else stays as it is.
    """
    return re.sub(
        r"(<limit\b[^<>]*\bvelocity\s*=\s*)(\"[^\"]*\"|'[^']*')", rf'\g<1>"{float(limit)!r}"', urdf
    )
