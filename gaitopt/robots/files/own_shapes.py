"""The shapes with which an MJCF's robot touches things, inside the notes of its URDF.

A URDF has neither capsules nor ellipsoids, and does not say which shapes touch which. So what an
MJCF says of them goes beside the URDF, for physics. Meshes are kept as their convex hulls, which is
what MuJoCo takes of them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from xml.etree import ElementTree

from gaitopt.errors import RobotError
from gaitopt.robots.files.origins import FARTHEST, number_in

SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "box": 3, "ellipsoid": 3, "mesh": 0}
"""Kinds of shapes as MuJoCo calls them, and how many sizes each has."""
MOST_SHAPES = 1000
"""Most shapes, and most pairs of links that do not touch. Chosen: robots have up to 100."""
MOST_CORNERS = 20_000
"""Most corners of all meshes, as of hulls."""
MOST_BITS = 2**31 - 1
"""Largest number whose bits say what touches what."""


@dataclass(frozen=True)
class OwnShape:
    """A shape on a link.

    Attributes:
        link: the link.
        kind: one of :data:`SIZES`.
        size: MuJoCo's sizes of it: radius, half lengths [m].
        place: of its middle in the link's frame ``(3,)`` [m].
        turn: of it, as a quaternion w, x, y, z.
        bits: MuJoCo's ``contype`` and ``conaffinity``, which say what it touches.
        corners: of a mesh, in its own frame: x, y, z, one after the other [m].
    """

    link: str
    kind: str
    size: tuple[float, ...]
    place: tuple[float, ...]
    turn: tuple[float, ...]
    bits: tuple[int, int]
    corners: tuple[float, ...] = ()


@dataclass(frozen=True)
class OwnShapes:
    """All shapes of a robot, and pairs of links that never touch one another."""

    shapes: tuple[OwnShape, ...] = ()
    apart: tuple[tuple[str, str], ...] = ()

    def __bool__(self) -> bool:
        return bool(self.shapes)


def write_own_shapes(out: ElementTree.Element, own: OwnShapes) -> None:
    """Add the shapes to the element of notes."""
    for shape in own.shapes:
        element = ElementTree.SubElement(
            out, "shape", link=shape.link, kind=shape.kind, size=_text(shape.size),
            place=_text(shape.place), turn=_text(shape.turn), bits=_text(shape.bits),
        )  # fmt: skip
        if shape.corners:
            element.text = _text(shape.corners)
    for one, other in own.apart:
        ElementTree.SubElement(out, "apart", link=one, other=other)


def read_own_shapes(element: ElementTree.Element, where: str) -> OwnShapes:
    """The shapes in an element of notes.

    Raises:
        RobotError: one is not valid, or there are too many.
    """
    shapes = tuple(_shape(part, where) for part in element.findall("shape"))
    apart = tuple(
        (part.get("link", ""), part.get("other", "")) for part in element.findall("apart")
    )
    corners = sum(len(shape.corners) // 3 for shape in shapes)
    if max(len(shapes), len(apart)) > MOST_SHAPES or corners > MOST_CORNERS:
        raise RobotError(
            f"{where}: more than {MOST_SHAPES} shapes or pairs, or more than {MOST_CORNERS} corners"
        )
    return OwnShapes(shapes, apart)


def _shape(element: ElementTree.Element, where: str) -> OwnShape:
    """A shape; raises RobotError where it is none."""
    kind = element.get("kind", "")
    size, place, turn, bits = (
        _numbers(element.get(name, "")) for name in ("size", "place", "turn", "bits")
    )
    corners = _numbers(element.text or "")
    link = element.get("link", "")
    good = bool(link) and len(size) == SIZES.get(kind, -1) and len(place) == 3 and len(turn) == 4
    good = good and all(0.0 < value < FARTHEST for value in size)
    good = good and all(abs(value) < FARTHEST for value in (*place, *corners))
    good = good and 0.9 < math.hypot(*turn) < 1.1
    good = good and len(bits) == 2 and all(0 <= bit <= MOST_BITS for bit in bits)
    hull = len(corners) >= 12 and len(corners) % 3 == 0
    if not good or hull != (kind == "mesh"):
        raise RobotError(f"{where}: a <shape> of link {link!r} is no shape of MuJoCo")
    return OwnShape(link, kind, size, place, turn, (int(bits[0]), int(bits[1])), corners)


def _numbers(text: str) -> tuple[float, ...]:
    """Numbers of a text; one that is no finite number makes them none."""
    found = tuple(number_in(part) for part in text.split())
    return found if all(math.isfinite(value) for value in found) else ()


def _text(numbers: tuple[float, ...]) -> str:
    return " ".join(repr(number) for number in numbers)
