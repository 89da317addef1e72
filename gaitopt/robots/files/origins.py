"""Places and numbers in the text of a URDF."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.inputs import as_text
from gaitopt.robots.rotations import matrix_to_rpy, rpy_to_matrix

FARTHEST = 1e3
"""Largest coordinate of a place that is taken for one [m]."""

Element = ElementTree.Element
_NUMBERS = ("value", "ixx", "iyy", "izz", "ixy", "ixz", "iyz", "lower", "upper", "effort",
            "velocity", "radius", "length", "xyz", "rpy", "size", "scale", "damping",
            "friction")  # fmt: skip
"""Attributes of a URDF that are numbers."""


_ONCE = {
    "joint": ("origin", "parent", "child", "axis", "limit", "dynamics", "mimic"),
    "link": ("inertial",), "inertial": ("origin", "mass", "inertia"),
    "visual": ("origin", "geometry"), "collision": ("origin", "geometry"),
}  # fmt: skip
"""Elements that others have once. Pinocchio takes the first, and MuJoCo refuses the file."""


def tidy(root: Element) -> None:
    """Take away elements that come a second time, and the blanks around numbers.

    Pinocchio drops a mass of ``"0.9 "``, and what else it knows of the link's inertia. One number
    for the scale of a mesh, of which it drops the shape, becomes three.
    """
    for element in list(root.iter()):
        for tag in _ONCE.get(element.tag, ()):
            for again in element.findall(tag)[1:]:
                element.remove(again)
    for element in root.iter():
        for name in _NUMBERS:
            text = element.get(name)
            if text is not None and text != text.strip():
                element.set(name, text.strip())
        scale = element.get("scale", "").split() if element.tag == "mesh" else []
        if len(scale) == 1:
            element.set("scale", " ".join(3 * scale))


def rotation_about(axis: FloatArray, angle: float) -> FloatArray:
    """Matrix ``(3, 3)`` that turns about a unit axis ``(3,)`` by an angle [rad]."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def placement_of(element: Element, where: str) -> FloatArray:
    """The pose ``(4, 4)`` in an element's ``<origin>``; identity without one."""
    origin, out = element.find("origin"), np.eye(4)
    if origin is not None:
        out[:3, 3] = numbers(origin.get("xyz", "0 0 0"), 3, f"{where}: xyz")
        if np.abs(out[:3, 3]).max() > FARTHEST:
            raise RobotError(
                f"{where}: xyz {origin.get('xyz')!r} is farther than {FARTHEST:g} m; a URDF is in "
                "metres: give scale= where the file has another unit"
            )
        out[:3, :3] = rpy_to_matrix(numbers(origin.get("rpy", "0 0 0"), 3, f"{where}: rpy"))
    return out


def numbers(text: str, count: int, what: str) -> FloatArray:
    """So many finite numbers in a text.

    Raises:
        RobotError: there are fewer or more, or one is no number; the message begins with ``what``.
    """
    parts = text.split()
    values = np.array([number_in(part) for part in parts[: count + 1]])
    if len(values) != count or not np.isfinite(values).all():
        wanted = "a finite number" if count == 1 else f"{count} finite numbers"
        raise RobotError(f"{what} must be {wanted}, got {as_text(text[:60])}")
    return values


def number_in(text: str) -> float:
    """The number in a text; NaN for none, and for ``"1_0"``, which is 10 in Python alone."""
    if "_" in text:
        return float("nan")
    try:
        return float(text)
    except ValueError:
        return float("nan")


def set_origin(element: Element, placement: FloatArray) -> None:
    """Write a pose ``(4, 4)`` into an element's ``<origin>``."""
    origin = element.find("origin")
    if origin is None:
        origin = ElementTree.SubElement(element, "origin")
    rpy = matrix_to_rpy(placement[:3, :3])
    for name, values in (("xyz", placement[:3, 3]), ("rpy", rpy)):
        origin.set(name, " ".join(repr(float(v) + 0.0) for v in values))
