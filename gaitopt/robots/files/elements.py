"""Elements of a robot file that no URDF has: misspelt ones, and those of other programs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Final
from xml.etree import ElementTree

from gaitopt.robots.files.notes import TAG, first_of
from gaitopt.robots.files.shapes import KNOWN as SHAPES
from gaitopt.robots.xml_text import shown

KNOWN: Final[Mapping[str, frozenset[str]]] = MappingProxyType({
    "robot": frozenset({
        "link", "joint", "material", "transmission", "gazebo", "ros2_control", "sensor", "mujoco",
        "plugin", "loop_joint", "frame", TAG,
    }),
    "link": frozenset({
        "inertial", "visual", "collision", "material", "sensor", "contact", "gravity", "kinematic",
        "surface", "self_filter", "collision_checking", "self_collision_checking", "verbose",
    }),
    "joint": frozenset({
        "origin", "parent", "child", "axis", "limit", "dynamics", "calibration", "mimic",
        "safety_controller", "hardwareInterface", "actuator",
    }),
    "inertial": frozenset({"origin", "mass", "inertia"}),
    "visual": frozenset({"origin", "geometry", "material", "verbose"}),
    "collision": frozenset({
        "origin", "geometry", "material", "verbose", "surface", "contact_coefficients",
    }),
    "geometry": frozenset({*SHAPES, "capsule"}),
})  # fmt: skip
"""Elements that may be in another one: those of URDF, and those that simulators and drivers add and
that say nothing of what is read here. They are those of the 96 URDFs of example-robot-data and of
those vendors' files that were tried."""
MOST: Final = 6
"""Most elements that a warning names."""


def unknown_elements(root: ElementTree.Element) -> list[str]:
    """A warning, if elements of a ``<robot>`` are not those of a URDF, and so are not read.

    A misspelt ``<collision>`` would otherwise be a part that nobody looks at. Elements with a
    namespace are those of other programs, and are passed over.
    """
    found = list(dict.fromkeys(_unknown(root, "")))
    if not found:
        return []
    return [
        f"elements that no URDF has are not read: {first_of(found, MOST)}; correct their names, or "
        "take them out"
    ]


def _unknown(element: ElementTree.Element, where: str) -> Iterator[str]:
    """Unknown elements inside one, and where they are."""
    for part in element:
        if not isinstance(part.tag, str) or part.tag.startswith("{"):
            continue
        if part.tag not in KNOWN[element.tag]:
            yield f"<{shown(part.tag)[:40]}> in {where or '<robot>'}"
        elif part.tag in KNOWN:
            name = part.get("name") if part.tag in ("link", "joint") else None
            inside = f"{part.tag} {shown(name)[:60]}" if name else f"<{part.tag}> of {where}"
            yield from _unknown(part, inside)
