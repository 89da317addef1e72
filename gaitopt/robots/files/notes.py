"""What was read and guessed of a robot file, inside the URDF's text.

The element ``<gaitopt>`` is the last one in ``<robot>``. It holds what a URDF cannot say: which
link is which leg's foot, the radius of the feet, and what was done to the file. Readers of URDFs
pass it over. A plan file holds the URDF's text, and so all of this; its fingerprint covers it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.errors import RobotError
from gaitopt.inputs import as_text
from gaitopt.robots.files.origins import FARTHEST, number_in
from gaitopt.robots.files.own_shapes import OwnShapes, read_own_shapes, write_own_shapes

TAG = "gaitopt"
LARGEST_RADIUS = 1.0
"""Largest radius of a foot that is taken for one [m]: larger than any wheel of a legged robot."""
LARGEST_INERTIA = 1000.0
"""Largest inertia of a motor, seen at its joint, that is taken for one [kg m^2]. Chosen: those
of the robots that were tried are 0.001 to 0.6."""
FASTEST = 1e6
"""Largest speed of a motor without load that is taken for one [rad/s]. Chosen: as for limits."""
LEAST_ACCELERATION, LARGEST_ACCELERATION = 1e-6, 1e9
"""Limits of accelerations that are taken for some [rad/s^2]. Chosen: those of the robots that were
tried are 10 to 10,000."""
ACCELERATION = "acceleration_limit"
_RANGES = {
    "armature": (0.0, LARGEST_INERTIA), ACCELERATION: (LEAST_ACCELERATION, LARGEST_ACCELERATION),
}  # fmt: skip
Hulls = tuple[tuple[str, tuple[float, ...]], ...]
"""Links, and the coordinates x, y, z of a hull's corners in the link's frame [m], one after the
other. A link with several meshes has several hulls, and so has a trunk that is cut in parts."""
LONGEST_NOTE = 600
MOST_NOTES = 100
"""Most letters of a note, and most notes: a plan file may come from somebody else."""


@dataclass(frozen=True)
class Notes:
    """What the element ``<gaitopt>`` says.

    Attributes:
        kind: of the file: ``urdf``, ``xacro`` or ``mjcf``.
        feet: link of each leg's foot; empty where the URDF tells it.
        foot_radius: radius of the feet [m]; ``None`` where the URDF tells it.
        standing: joint angles of the file's standing pose, by joint [rad]; empty for none.
        armature: inertia of the motors, seen at the joints, by joint [kg m^2].
        accelerations: limits of the joints' accelerations, by joint [rad/s^2]. The user gives them;
            no robot file tells them.
        torque_lines: speeds up to which motors have their whole torque, and at which they have
            none, by joint [rad/s]. In between the torque falls linearly.
        locked: joints that were made fixed, and where [rad, m].
        hulls: convex hulls of the collision meshes.
        own: the shapes with which an MJCF's robot touches things.
        done: what was done to the file, in sentences.
        warnings: what the user should look at, each with its cure.
    """

    kind: str = "urdf"
    feet: Mapping[str, str] = field(default_factory=dict)
    foot_radius: float | None = None
    standing: Mapping[str, float] = field(default_factory=dict)
    armature: Mapping[str, float] = field(default_factory=dict)
    accelerations: Mapping[str, float] = field(default_factory=dict)
    torque_lines: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    locked: Mapping[str, float] = field(default_factory=dict)
    hulls: Hulls = ()
    own: OwnShapes = field(default_factory=OwnShapes)
    done: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"Notes({self.kind!r}, guesses: {len(self.done)}, warnings: {len(self.warnings)})"

    def __str__(self) -> str:
        """What was read, guessed and doubted, a line each."""
        doubts = [f"warning: {text}" for text in self.warnings] or ["no warnings"]
        return "\n".join([f"read as {self.kind}", *self.done, *doubts])


def write_notes(root: ElementTree.Element, notes: Notes) -> None:
    """Add the element to a ``<robot>``; an old one goes."""
    for old in root.findall(TAG):
        root.remove(old)
    out = ElementTree.SubElement(root, TAG, kind=notes.kind)
    if notes.foot_radius is not None:
        out.set("foot_radius", repr(float(notes.foot_radius)))
    for leg, link in notes.feet.items():
        ElementTree.SubElement(out, "foot", leg=leg, link=link)
    for tag, values in (("armature", notes.armature), (ACCELERATION, notes.accelerations)):
        for joint, value in values.items():
            ElementTree.SubElement(out, tag, joint=joint, value=repr(float(value)))
    for joint, (full, none) in notes.torque_lines.items():
        ElementTree.SubElement(out, "torque_line", joint=joint, full_to=repr(float(full)),
                               no_load=repr(float(none)))  # fmt: skip
    for tag, places in (("locked", notes.locked), ("standing", notes.standing)):
        for joint, at in places.items():
            ElementTree.SubElement(out, tag, joint=joint, at=repr(float(at)))
    for link, numbers in notes.hulls:
        ElementTree.SubElement(out, "hull", link=link).text = " ".join(map(repr, numbers))
    write_own_shapes(out, notes.own)
    for tag, texts in (("done", notes.done), ("warning", notes.warnings)):
        for text in texts:
            ElementTree.SubElement(out, tag).text = text[:LONGEST_NOTE]


def read_notes(urdf: str, label: str) -> Notes:
    """What the element in a URDF's text says; empty notes without one.

    Raises:
        RobotError: it is not valid.
    """
    if f"<{TAG}" not in urdf:
        return Notes()
    element = ElementTree.fromstring(urdf).find(TAG)
    if element is None:
        return Notes()
    where = f"{label}: <{TAG}>"
    feet = {_text(e, "leg", where): _text(e, "link", where) for e in element.findall("foot")}
    if feet and set(feet) != set(LEGS):
        raise RobotError(f"{where}: it names feet of {', '.join(feet)}; legs are {', '.join(LEGS)}")
    texts = {
        tag: tuple((e.text or "")[:LONGEST_NOTE] for e in element.findall(tag)[:MOST_NOTES])
        for tag in ("done", "warning")
    }
    return Notes(
        kind=element.get("kind", "urdf"),
        feet=MappingProxyType({leg: feet[leg] for leg in LEGS if feet}),
        foot_radius=_number(element, "foot_radius", where, LARGEST_RADIUS),
        standing=_numbers(element, "standing", "at", where),
        armature=_numbers(element, "armature", "value", where),
        accelerations=_numbers(element, ACCELERATION, "value", where),
        torque_lines=_lines(element, where),
        locked=_numbers(element, "locked", "at", where),
        hulls=_hulls(element, where),
        own=read_own_shapes(element, where),
        done=texts["done"],
        warnings=texts["warning"],
    )


def first_of(names: Sequence[str], most: int = 4) -> str:
    """Up to ``most`` names, and how many more there are, for a note or a message."""
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def _hulls(element: ElementTree.Element, where: str) -> Hulls:
    """The hulls of meshes."""
    out = []
    for hull in element.findall("hull"):
        text = hull.text or ""
        try:
            # A robot has up to 5000 corners. Python alone reads "1_0" as 10.
            numbers = () if "_" in text else tuple(map(float, text.split()))
        except ValueError:
            numbers = ()
        near = bool((np.abs(np.array(numbers)) < FARTHEST).all())
        if not near or len(numbers) % 3 or len(numbers) < 12:
            raise RobotError(f"{where}: a <hull> needs four corners or more, of three numbers each")
        out.append((_text(hull, "link", where), numbers))
    return tuple(out)


def _numbers(element: ElementTree.Element, tag: str, name: str, where: str) -> Mapping[str, float]:
    """Numbers of joints."""
    found = {}
    for part in element.findall(tag):
        value = _finite(_text(part, name, where))
        low, high = _RANGES.get(tag, (-math.inf, math.inf))
        if value is None or not low <= value <= high:
            raise RobotError(f"{where}: {tag} {part.get(name)!r} is no number that is allowed")
        found[_text(part, "joint", where)] = value
    return MappingProxyType(found)


def _lines(element: ElementTree.Element, where: str) -> Mapping[str, tuple[float, float]]:
    """Torque lines of joints."""
    found = {}
    for part in element.findall("torque_line"):
        full, none = (_finite(_text(part, name, where)) for name in ("full_to", "no_load"))
        if full is None or none is None or not 0.0 <= full < none <= FASTEST:
            raise RobotError(
                f"{where}: a torque_line needs speeds 0 <= full_to < no_load, got "
                f"{part.get('full_to')!r} and {part.get('no_load')!r}"
            )
        found[_text(part, "joint", where)] = (full, none)
    return MappingProxyType(found)


def _number(element: ElementTree.Element, name: str, where: str, largest: float) -> float | None:
    """A number from 0 to ``largest`` in an attribute; ``None`` where it is missing."""
    text = element.get(name)
    if text is None:
        return None
    value = _finite(text)
    if value is None or not 0.0 <= value <= largest:
        raise RobotError(
            f"{where}: {name} must be from 0 to {largest:g} m, got {as_text(text[:30])}"
        )
    return value


def _finite(text: str) -> float | None:
    value = number_in(text)
    return value if math.isfinite(value) else None


def _text(element: ElementTree.Element, name: str, where: str) -> str:
    text = element.get(name)
    if not text:
        raise RobotError(f"{where}: a <{element.tag}> has no {name}")
    return text
