"""Masses and inertias of a robot file: checked, given by the user, or estimated from shapes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError, RobotError
from gaitopt.robots.files.meshes import MeshFinder
from gaitopt.robots.files.notes import first_of
from gaitopt.robots.files.options import FROM_FILE, FROM_SHAPES, NO_MASSES
from gaitopt.robots.files.origins import Element, numbers, placement_of, set_origin
from gaitopt.robots.files.shapes import Solid, solids_of
from gaitopt.robots.files.tree import UrdfTree

DENSITY = 1000.0
"""Density with which masses are estimated from shapes [kg/m^3]. Chosen: that of water; links of
metal with motors and hollows are about as heavy."""
LEAST_SIZE = 0.02
"""Radius of the ball whose inertia a link without shapes gets [m]. Chosen."""
NAMES = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
"""Attributes of an inertia: moments, then products."""
LARGEST_INERTIA = 1e12
"""Moment of inertia from which on one is taken for a mistake [kg m^2]."""
ROUNDING = 1e-9
"""An eigenvalue of an inertia matrix below this share of its trace counts as none."""
LARGE = 3.0
"""Radius of gyration of a part, as a share of the robot's extent, from which on its inertia is
taken for a mistake. Chosen: placeholders of 100 kg m^2 make it 30 and more."""
OTHERWISE = (
    "masses='shapes' estimates all from the links' shapes, and masses='none' does without, which "
    "is enough for plans with timing='velocity'"
)
CURE = f"give masses={{'link': kg, ...}}; {OTHERWISE}"
NO_SHAPE = (
    " and no shape that could be read, so masses='shapes' cannot estimate it; give "
    "masses={'link': kg, ...} for all links, or masses='none'"
)


class _Inertia(NamedTuple):
    """Mass [kg], centre of mass ``(3,)`` [m], and inertia about it ``(3, 3)`` [kg m^2]."""

    mass: float
    com: FloatArray
    matrix: FloatArray


def set_masses(
    tree: UrdfTree, masses: Mapping[str, float] | str | None, finder: MeshFinder
) -> list[str]:
    """Put the user's masses into a robot, and check all of them.

    Args:
        tree: the robot, in which only hinges of legs move.
        masses: of links [kg], ``"shapes"``, ``"file"``, ``"none"``, or ``None``.
        finder: where meshes are.

    Returns:
        Warnings.

    Raises:
        RobotError: the robot or a part that moves has no mass, or one that no body can have.
        InputError: ``masses`` names a link that is not there.
    """
    warnings = []
    if masses == FROM_SHAPES:
        _estimate(tree, finder)
        warnings.append(f"masses are estimated from shapes, as {DENSITY:g} kg/m^3 times the volume")
    elif masses == FROM_FILE:
        _take_file(tree, finder)
        warnings.append("inertias are those of the links' shapes with the file's masses")
    elif isinstance(masses, Mapping):
        for link, mass in masses.items():
            if link not in tree.links:
                raise InputError(f"masses: the robot has no link {link!r}")
            _give(tree, link, mass, finder)
    for link in tree.links:
        if masses != NO_MASSES:
            _refuse_negative(tree, link)
        _complete(tree, link)
    return warnings if masses == NO_MASSES else [
        *warnings, *_check_bodies(tree, NO_SHAPE if masses == FROM_SHAPES else f"; {CURE}")
    ]  # fmt: skip


def _check_bodies(tree: UrdfTree, cure: str) -> list[str]:
    """Check that the base and all parts that move have masses and inertias that bodies can have.

    Args:
        tree: the robot.
        cure: how an error goes on that says that a link has no mass.

    Returns:
        Warnings.

    Raises:
        RobotError: one has none, or an inertia with which nothing can be computed.
    """
    if not any(tree.mass(link) > 0.0 for link in tree.links):
        raise RobotError(f"{tree.label}: no link has a mass (<inertial>); {CURE}")
    odd: list[str] = []
    wrong: dict[str, str] = {}
    extent = _extent(tree)
    for top in (tree.base, *(joint.child for joint in tree.walk() if not joint.fixed)):
        whole = _whole(tree, top)
        # A link without mass may stand above the one that has it.
        body = next((link for link in tree.rigid_with(top) if tree.mass(link) > 0.0), top)
        if not whole.mass > 0.0:
            named = cure.replace("'link'", repr(body))
            raise RobotError(f"{tree.label}: link {body} moves and has no mass{named}")
        if not np.abs(whole.matrix).max() < LARGEST_INERTIA:
            raise RobotError(f"{tree.label}: the inertia of link {body} is no sensible number")
        principal = np.linalg.eigvalsh(whole.matrix)
        gyration = float(np.sqrt(max(principal.sum(), 0.0) / 2.0 / whole.mass))
        if not principal[0] > ROUNDING * principal.sum():
            moments = " ".join(f"{moment:.3g}" for moment in principal)
            wrong[top] = f"not that of a body: its principal moments are {moments} kg m^2"
        elif gyration > LARGE * extent:
            wrong[top] = (
                f"that of a body of {gyration:.3g} m around its middle, and the whole robot is "
                f"{extent:.2g} m large"
            )
        elif principal[2] > principal[0] + principal[1] + ROUNDING * principal.sum():
            odd.append(body)
    if wrong:
        raise RobotError(_wrong_inertias(tree, wrong))
    if not odd:
        return []
    return [
        f"inertias that no body can have (one principal moment above the sum of the others): "
        f"{first_of(odd)}; correct them in the file, or give masses='file' for those of the shapes"
    ]


def _extent(tree: UrdfTree) -> float:
    """Diagonal of the box around all links' origins in the first posture [m]."""
    places = np.array([pose[:3, 3] for pose in tree.poses().values()])
    return float(np.linalg.norm(np.ptp(places, axis=0)))


def _wrong_inertias(tree: UrdfTree, wrong: Mapping[str, str]) -> str:
    """What is said of inertias that are wrong, and what would do.

    Args:
        tree: the robot.
        wrong: what is wrong, by the link that moves.
    """
    names = [next(link for link in tree.rigid_with(top) if tree.mass(link) > 0.0) for top in wrong]
    many = f" (and of {first_of(names[1:])})" if len(names) > 1 else ""
    return (
        f"{tree.label}: the inertia of link {names[0]}{many} is {next(iter(wrong.values()))}; "
        "correct it, or give masses='file', which keeps the masses and takes the inertias from "
        f"the links' shapes; {OTHERWISE}"
    )


def _refuse_negative(tree: UrdfTree, link: str) -> None:
    """Refuse a link whose mass is negative, or no finite number.

    Raises:
        RobotError: it is; the message names the link and the mass.
    """
    mass = tree.mass(link)
    if not 0.0 <= mass < np.inf:
        raise RobotError(
            f"{tree.label}: link {link}: its mass is {mass:g} kg, and must not be negative; "
            f"correct <mass value=>, or {CURE}"
        )


def _complete(tree: UrdfTree, link: str) -> None:
    """Write down products of inertia that are missing: some readers drop the whole matrix.

    Raises:
        RobotError: a link with a mass has no moments of inertia.
    """
    if not tree.mass(link) > 0.0:
        return
    element = tree.links[link].find("inertial/inertia")
    missing = [n for n in NAMES[:3] if element is None or element.get(n) is None]
    if element is None or missing:
        raise RobotError(
            f"{tree.label}: link {link} has a mass and no {' '.join(missing)} of its inertia; add "
            f"them, or give masses={{'{link}': kg}}"
        )
    for name in NAMES[3:]:
        if element.get(name) is None:
            element.set(name, "0")


def _whole(tree: UrdfTree, body: str) -> _Inertia:
    """The inertia of a link and what is fixed to it, in its frame."""
    parts = [
        part
        for link, pose in tree.rigid_with(body).items()
        if (part := _read(tree, link, pose)) is not None
    ]
    return _sum(parts)


def _sum(parts: list[_Inertia]) -> _Inertia:
    """The inertia of parts together."""
    mass = sum(part.mass for part in parts)
    if not mass > 0.0:
        return _Inertia(0.0, np.zeros(3), np.zeros((3, 3)))
    com = np.sum([part.mass * part.com for part in parts], axis=0) / mass
    matrix = np.zeros((3, 3))
    for part in parts:
        away = part.com - com
        matrix += part.matrix + part.mass * (away @ away * np.eye(3) - np.outer(away, away))
    return _Inertia(float(mass), com, matrix)


def _read(tree: UrdfTree, link: str, pose: FloatArray) -> _Inertia | None:
    """A link's ``<inertial>`` in the frame in which ``pose (4, 4)`` is the link's."""
    inertial = tree.links[link].find("inertial")
    if inertial is None:
        return None
    where = f"{tree.label}: link {link}: inertia"
    element = inertial.find("inertia")
    values = np.zeros(6)
    if element is not None:
        values = numbers(" ".join(element.get(name, "0") for name in NAMES), 6, where)
    xx, yy, zz, xy, xz, yz = values
    own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    frame = pose @ placement_of(inertial, where)
    return _Inertia(tree.mass(link), frame[:3, 3], frame[:3, :3] @ own @ frame[:3, :3].T)


def _estimate(tree: UrdfTree, finder: MeshFinder) -> None:
    """Give every link that has shapes a mass."""
    found = False
    for link in tree.links:
        whole = _of_shapes(tree, link, finder)
        if whole.mass > 0.0:
            _write(tree.links[link], whole)
            found = True
    if not found:
        raise RobotError(
            f"{tree.label}: masses='shapes': no link has a shape that could be read (meshes that "
            "are missing tell nothing: give package_folders=...)"
        )


def _take_file(tree: UrdfTree, finder: MeshFinder) -> None:
    """Give all links the inertias of their shapes, and the masses that they have."""
    for link in tree.links:
        _refuse_negative(tree, link)
        if tree.mass(link) > 0.0:
            _give(tree, link, tree.mass(link), finder)


def _give(tree: UrdfTree, link: str, mass: float, finder: MeshFinder) -> None:
    """Give a link a mass; its inertia follows from its shapes, or is that of a ball."""
    whole = _of_shapes(tree, link, finder)
    if not whole.mass > 0.0:
        ends = [joint.placement[:3, 3] for joint in tree.below(link)] or [np.zeros(3)]
        end = max(ends, key=lambda point: float(np.linalg.norm(point)))
        radius = max(float(np.linalg.norm(end)) / 2.0, LEAST_SIZE)
        whole = _Inertia(1.0, end / 2.0, 0.4 * radius**2 * np.eye(3))
    share = float(mass) / whole.mass
    _write(tree.links[link], _Inertia(float(mass), whole.com, whole.matrix * share))


def _of_shapes(tree: UrdfTree, link: str, finder: MeshFinder) -> _Inertia:
    """The inertia of a link's shapes, all of one density."""
    for tag in ("collision", "visual"):
        solids = list(solids_of(tree, link, np.eye(4), tag, finder))
        if solids:
            return _sum([_of_solid(solid) for solid in solids])
    return _sum([])


def _of_solid(solid: Solid) -> _Inertia:
    """The inertia of one shape; a mesh counts as the box around its convex hull's volume."""
    centre, turn = solid.pose[:3, 3], solid.pose[:3, :3]
    if solid.kind == "sphere":
        radius = float(solid.size[0])
        mass = DENSITY * 4.0 / 3.0 * np.pi * radius**3
        return _Inertia(mass, centre, 0.4 * mass * radius**2 * np.eye(3))
    if solid.kind in ("cylinder", "capsule"):
        radius, length = (float(v) for v in solid.size)
        mass = DENSITY * np.pi * radius**2 * length
        across = mass * (radius**2 / 4.0 + length**2 / 12.0)
        own = np.diag([across, across, mass * radius**2 / 2.0])
        return _Inertia(mass, centre, turn @ own @ turn.T)
    if solid.kind == "box":
        mass = DENSITY * float(np.prod(solid.size))
        return _Inertia(mass, centre, turn @ _box(mass, solid.size) @ turn.T)
    low, high = solid.corners.min(axis=0), solid.corners.max(axis=0)
    mass = DENSITY * _hull_volume(solid.corners)
    return _Inertia(mass, (low + high) / 2.0, _box(mass, high - low))


def _box(mass: float, size: FloatArray) -> FloatArray:
    """Inertia of a box about its middle."""
    squares = size**2
    return np.asarray(np.diag(mass / 12.0 * (squares.sum() - squares)))


def _hull_volume(points: FloatArray) -> float:
    """Volume of the convex hull of points [m^3]; 0 for flat ones."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return float(ConvexHull(points).volume)
    except (QhullError, ValueError):
        return 0.0


def _write(link: Element, inertia: _Inertia) -> None:
    """Replace a link's ``<inertial>``."""
    for old in link.findall("inertial"):
        link.remove(old)
    add_inertial(link, inertia.mass, inertia.com, inertia.matrix)


def add_inertial(link: Element, mass: float, com: FloatArray, matrix: FloatArray) -> None:
    """Add an ``<inertial>`` in the axes of a link: some readers pass over a rotation of it.

    Args:
        link: the link.
        mass, com, matrix: as in :class:`_Inertia`.
    """
    out, place = ElementTree.SubElement(link, "inertial"), np.eye(4)
    place[:3, 3] = com
    set_origin(out, place)
    ElementTree.SubElement(out, "mass", value=repr(float(mass)))
    places = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2),
              "izz": (2, 2)}  # fmt: skip
    values = {name: repr(float(matrix[place]) + 0.0) for name, place in places.items()}
    ElementTree.SubElement(out, "inertia", values)
