"""Sizes that no walking robot has, as those of files in millimetres; other units; sizes of zero."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.robots.files.limbs import Limb
from gaitopt.robots.files.notes import TAG, first_of
from gaitopt.robots.files.origins import number_in, numbers
from gaitopt.robots.files.tree import UrdfTree

SHORTEST, LONGEST = 0.03, 2.5
"""Lengths of legs, from the first joint to the last, between which sizes are taken for real [m].
Chosen: those of the robots that were tried are 0.07 to 0.55."""
UNITS = (0.001, 0.01, 0.0254, 1000.0, 100.0)
"""Units of files that are proposed [m]: millimetres, centimetres, inches; and metres that were
divided by a thousand or a hundred."""
USUAL = (0.08, 1.0)
"""Lengths of legs that a proposed unit leads to [m]."""
LIGHTEST, HEAVIEST = 5.0, 2e4
"""Masses of robots as shares of the cube of their legs' lengths, between which masses are taken for
real [kg/m^3]. Chosen: those of the robots that were tried are 440 to 7 000, and a thousand times as
much where masses are in grams."""
LENGTHS = {
    "origin": ("xyz",), "box": ("size",), "sphere": ("radius",),
    "cylinder": ("radius", "length"), "capsule": ("radius", "length"),
}  # fmt: skip
"""Attributes of a URDF's elements that are lengths."""
UNREAL = "no walking robot"
"""What every warning of this module says."""
SHAPE_SIZES = {
    "sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length"),
    "box": ("size",),
}  # fmt: skip

"""Attributes of shapes that are sizes."""
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def scale_lengths(root: ElementTree.Element, unit: float, label: str) -> None:
    """Turn the lengths of a URDF into metres: places, shapes, meshes and moments of inertia.

    Args:
        root: the element ``<robot>``, which is changed.
        unit: the file's unit of length [m].
        label: what to call the robot in messages.

    Raises:
        InputError: gaitopt has read this robot before, so that its lengths are metres.
        RobotError: a length is no number.
    """
    if root.find(TAG) is not None:
        raise InputError(
            f"{label}: scale is for the file as it came; this one gaitopt has written, in metres"
        )
    for element in root.iter():
        for name in LENGTHS.get(element.tag, ()):
            _multiply(element, name, unit, label)
        if element.tag == "mesh":
            element.set("scale", element.get("scale", "1 1 1"))
            _multiply(element, "scale", unit, label)
        if element.tag == "inertia":
            for name in MOMENTS:
                _multiply(element, name, unit**2, label)
        if element.tag == "joint" and element.get("type") == "prismatic":
            for limit in element.findall("limit"):
                for name in ("lower", "upper"):
                    _multiply(limit, name, unit, label)


def _multiply(element: ElementTree.Element, name: str, factor: float, label: str) -> None:
    """Multiply the numbers of an attribute, if there is one."""
    text = element.get(name)
    if text is None:
        return
    where = f"{label}: {name} of a <{element.tag}>"
    values = factor * numbers(text, len(text.split()), where)
    element.set(name, " ".join(repr(float(value)) for value in values))


def size_warnings(tree: UrdfTree, limbs: Iterable[Limb]) -> list[str]:
    """A warning, if legs are shorter or longer than those of any walking robot."""
    length = _leg_length(tree, limbs)
    if SHORTEST <= length <= LONGEST or length == 0.0:
        return []
    fitting = [unit for unit in UNITS if USUAL[0] <= length * unit <= USUAL[1]]
    unit = f"scale={fitting[0]:g}" if fitting else "scale="
    return [
        f"the legs are {length:.3g} m long from the first joint to the last, which {UNREAL}'s are: "
        f"a URDF is in metres; if this file has another unit, give {unit} (that unit in metres)"
    ]


def mass_warnings(tree: UrdfTree, limbs: Iterable[Limb]) -> list[str]:
    """A warning, if the robot is lighter or heavier than any walking robot of its size."""
    length = _leg_length(tree, limbs)
    mass = sum(tree.mass(link) for link in tree.links)
    if mass == 0.0 or LIGHTEST <= mass / max(length, 1e-9) ** 3 <= HEAVIEST:
        return []
    return [
        f"the robot has {mass:.3g} kg on legs of {length:.3g} m, which is {UNREAL}'s mass: "
        "a URDF is in kilograms and metres; give masses= in kg"
    ]


def _leg_length(tree: UrdfTree, limbs: Iterable[Limb]) -> float:
    """Mean length of the legs from the first joint to the last [m]."""
    poses = tree.poses()
    lengths = []
    for limb in limbs:
        points: FloatArray = np.array([poses[joint.child][:3, 3] for joint in limb.joints])
        lengths.append(float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum()))
    return float(np.mean(lengths))


def remove_empty_shapes(root: ElementTree.Element) -> list[str]:
    """Take the shapes of size zero out of a ``<robot>``; returns what was done, in sentences.

    Some files mark places with them. They touch nothing and cannot be seen, and readers refuse
    them. One that has a negative size stays, to be refused.
    """
    emptied = []
    for link in root.findall("link"):
        for tag in ("collision", "visual"):
            for shape in link.findall(tag):
                if any(_is_empty(part) for part in shape.iterfind("geometry/*")):
                    link.remove(shape)
                    emptied.append(link.get("name") or "")
    if not emptied:
        return []
    return [f"shapes of size zero are left out, at {first_of(list(dict.fromkeys(emptied)))}"]


def _is_empty(shape: ElementTree.Element) -> bool:
    """Whether one size of a shape is zero, and none is negative or no number."""
    texts = [
        text for name in SHAPE_SIZES.get(shape.tag, ()) for text in shape.get(name, "").split()
    ]
    sizes = [number_in(text) for text in texts]
    return bool(sizes) and min(sizes) == 0.0
