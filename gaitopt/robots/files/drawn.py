"""The shapes that a URDF draws, with their colours."""

from __future__ import annotations

from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.robots.rotations import rpy_to_matrix

Element = ElementTree.Element
SHAPES = ("box", "sphere", "cylinder", "mesh")


class Visual(NamedTuple):
    """A shape that is drawn.

    Attributes:
        link: name of its link.
        shape: the element ``<box>``, ``<sphere>``, ``<cylinder>`` or ``<mesh>``.
        origin: its pose in the link's frame ``(4, 4)``.
        material: name of its material, ``None`` without one.
        rgba: its colour, ``None`` without one.
    """

    link: str
    shape: Element
    origin: FloatArray
    material: str | None
    rgba: FloatArray | None

    def numbers(self, name: str, count: int) -> tuple[float, ...]:
        """So many numbers of an attribute of the shape.

        Raises:
            RobotError: it is missing, or has others.
        """
        found = _numbers(self.shape, name, None)
        if len(found) != count:
            raise RobotError(
                f"link {self.link!r}: <{self.shape.tag}> has {len(found)} numbers in {name}, and "
                f"needs {count}"
            )
        return tuple(found.tolist())

    def scale(self) -> FloatArray | None:
        """One or three factors of a mesh; ``None`` without any.

        Raises:
            RobotError: they are no numbers.
        """
        found = _numbers(self.shape, "scale", "")
        return found if len(found) else None


def drawn_shapes(urdf: str) -> list[Visual]:
    """All shapes that a URDF's text draws, with the colours of materials that are only named.

    Raises:
        RobotError: a shape is of no known kind, or has attributes that are no numbers.
    """
    root = ElementTree.fromstring(urdf)
    known = {m.get("name"): _colour(m) for m in root.findall("material")}
    found = []
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            geometry = visual.find("geometry")
            shape = None if geometry is None else next(iter(geometry), None)
            if shape is None or shape.tag not in SHAPES:
                raise RobotError(
                    f"link {link.get('name')!r} draws a shape that is none of {', '.join(SHAPES)}"
                )
            material = visual.find("material")
            name = None if material is None else material.get("name")
            rgba = None if material is None else _colour(material)
            if rgba is None and material is not None:
                rgba = known.get(name)
            found.append(Visual(str(link.get("name")), shape, _origin(visual), name, rgba))
    return found


def _colour(material: Element) -> FloatArray | None:
    colour = material.find("color")
    return None if colour is None else _numbers(colour, "rgba", "1 1 1 1")


def _origin(visual: Element) -> FloatArray:
    """The pose in an element's ``<origin>`` ``(4, 4)``; identity without one."""
    origin, out = visual.find("origin"), np.eye(4)
    if origin is not None:
        out[:3, :3] = rpy_to_matrix(_numbers(origin, "rpy", "0 0 0"))
        out[:3, 3] = _numbers(origin, "xyz", "0 0 0")
    return out


def _numbers(element: Element, name: str, usual: str | None) -> FloatArray:
    text = element.get(name, usual)
    try:
        return np.array([float(word) for word in str(text).replace(",", " ").split()])
    except ValueError:
        raise RobotError(f"<{element.tag}> has {name}={text!r}, which are no numbers") from None
