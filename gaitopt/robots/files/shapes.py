"""The shapes of a URDF's links, as far as the end of a leg needs them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.robots.files.meshes import MeshFinder, mesh_corners
from gaitopt.robots.files.notes import first_of
from gaitopt.robots.files.origins import FARTHEST, Element, numbers, placement_of, set_origin
from gaitopt.robots.files.tree import UrdfTree

SLAB = 0.05
"""Part of a mesh's length at its end to which a ball is fitted. Chosen: about the foot of a lower
leg."""
SLENDER = 0.7
"""Least cosine between a cylinder's axis and the leg with which it counts as a stick, and not as a
roll. Chosen: 45 degrees."""


LEAN = (1.0, 0.15)
"""By how much the ground may lean against a lower leg about the knee's axis, and square to it
[rad]. Chosen: lower legs of walking robots lean by about so much."""
COVER = 2e-4
"""How far a ball reaches beyond meshes [m]. Chosen: corners lie between the ways that are tried."""
ROLLS = 0.1
"""How much more a ball may cover than the shapes, as a share of its radius. Chosen: the feet of
robots at hand miss a ball by up to 3 % of the radius, and flat ends by half of it."""


class Ball(NamedTuple):
    """A ball: its centre ``(3,)`` and radius [m]."""

    centre: FloatArray
    radius: float

    def is_like(self, other: Ball) -> bool:
        """Whether both are the same but for 5 % of the radius."""
        apart = float(np.linalg.norm(self.centre - other.centre))
        return apart + abs(self.radius - other.radius) < 0.05 * self.radius


class Solid(NamedTuple):
    """A shape.

    Attributes:
        kind: ``sphere``, ``cylinder``, ``capsule``, ``box`` or ``mesh``.
        pose: its pose ``(4, 4)``.
        size: radius; radius and length; or three lengths [m].
        corners: of a mesh or a box ``(N, 3)`` [m], in the frame of ``pose``'s parent.
    """

    kind: str
    pose: FloatArray
    size: FloatArray
    corners: FloatArray


KNOWN = ("sphere", "cylinder", "box", "mesh")
"""Shapes that a URDF may have."""
NOTHING = np.zeros((0, 3))


def solids_of(
    tree: UrdfTree, link: str, pose: FloatArray, tag: str, finder: MeshFinder
) -> Iterator[Solid]:
    """The shapes of a link.

    Meshes that are missing or cannot be read are left out.

    Args:
        tree: the robot.
        link: the link's name.
        pose: the link's pose ``(4, 4)`` in the frame that is wanted.
        tag: ``collision`` or ``visual``.
        finder: where meshes are.
    """
    where = f"{tree.label}: link {link}"
    for shape in tree.links[link].findall(tag):
        geometry = shape.find("geometry")
        place = pose @ placement_of(shape, where)
        for element in [] if geometry is None else list(geometry):
            solid = _solid(element, place, where, finder)
            if solid is not None:
                yield solid


def _solid(element: Element, pose: FloatArray, where: str, finder: MeshFinder) -> Solid | None:
    """A shape; ``None`` for a mesh that is missing."""
    if element.tag == "sphere":
        return Solid("sphere", pose, _sizes(element, ("radius",), where), NOTHING)
    if element.tag in ("cylinder", "capsule"):
        return Solid(element.tag, pose, _sizes(element, ("radius", "length"), where), NOTHING)
    if element.tag == "box":
        size = numbers(element.get("size", ""), 3, f"{where}: size of its box")
        signs = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T
        return Solid("box", pose, size, _placed(pose, signs * size))
    path = finder.find(element.get("filename", "")) if element.tag == "mesh" else None
    corners = None if path is None else mesh_corners(path)
    if corners is None:
        return None
    return Solid("mesh", pose, np.zeros(0), _placed(pose, corners * mesh_scale(element, where)))


def mesh_scale(element: Element, where: str) -> FloatArray:
    """Scales ``(3,)`` of a mesh along its axes."""
    return numbers(element.get("scale", "1 1 1"), 3, f"{where}: scale of its mesh")


def write_known_shapes(tree: UrdfTree) -> list[str]:
    """Leave no shape that readers of URDFs do not know.

    Capsules, which some simulators write, become a cylinder and two balls. Other shapes go.

    Returns:
        What was done, in sentences.
    """
    capsules, gone = [], []
    for name, link in tree.links.items():
        for shape in [*link.findall("collision"), *link.findall("visual")]:
            geometry = shape.find("geometry")
            kind = "" if geometry is None or not len(geometry) else geometry[0].tag
            if kind == "capsule":
                _write_capsule(link, shape, f"{tree.label}: link {name}")
                capsules.append(name)
            elif kind not in KNOWN:
                link.remove(shape)
                gone.append(f"{kind or 'an empty one'} of {name}")
    done = [f"capsules are cylinders with balls: {', '.join(dict.fromkeys(capsules))}"]
    left_out = [f"shapes that a URDF does not have are left out: {first_of(gone, 6)}"]
    return done * bool(capsules) + left_out * bool(gone)


def _write_capsule(link: Element, shape: Element, where: str) -> None:
    """Put what a URDF knows in the place of a capsule."""
    geometry = shape.find("geometry")
    assert geometry is not None
    radius, length = _sizes(geometry[0], ("radius", "length"), where)
    place = placement_of(shape, where)
    link.remove(shape)
    add_capsule(link, shape.tag, place, radius, length)


def add_capsule(link: Element, tag: str, place: FloatArray, radius: float, length: float) -> None:
    """Add a capsule as a cylinder and two balls, because a URDF has no capsules.

    Args:
        link: the link.
        tag: ``collision`` or ``visual``.
        place: the capsule's pose in the link ``(4, 4)``; its axis is z.
        radius, length: its radius, and its length between the middles of the balls [m].
    """
    add_solid(link, tag, place, "cylinder", radius=radius, length=length)
    for end in (-0.5 * length, 0.5 * length):
        move = np.eye(4)
        move[2, 3] = end
        add_solid(link, tag, place @ move, "sphere", radius=radius)


def add_solid(link: Element, tag: str, place: FloatArray, kind: str, **sizes: float) -> None:
    """Add a shape ``kind`` with sizes [m] at a pose ``(4, 4)`` in a link."""
    values = {name: repr(float(value)) for name, value in sizes.items()}
    ElementTree.SubElement(add_geometry(link, tag, place), kind, values)


def add_geometry(link: Element, tag: str, place: FloatArray) -> Element:
    """Add a shape's place, a pose ``(4, 4)`` in a link; gives its ``<geometry>``, still empty."""
    shape = ElementTree.SubElement(link, tag)
    set_origin(shape, place)
    return ElementTree.SubElement(shape, "geometry")


def _sizes(element: Element, names: tuple[str, ...], where: str) -> FloatArray:
    """Positive lengths of a shape."""
    values = [float(numbers(element.get(name, ""), 1, f"{where}: {name} of its {element.tag}")[0])
              for name in names]  # fmt: skip
    if min(values) <= 0.0:
        raise RobotError(f"{where}: a {element.tag} of size {values}; sizes must be positive")
    if max(values) > FARTHEST:  # the cube of a huge radius would be no number
        raise RobotError(f"{where}: a {element.tag} of size {values}, above {FARTHEST:g} m")
    return np.array(values)


def _placed(pose: FloatArray, points: FloatArray) -> FloatArray:
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def farthest(solids: list[Solid]) -> FloatArray:
    """The point of some shapes ``(3,)`` that is farthest from the origin, roughly [m]."""
    points = [NOTHING]
    for solid in solids:
        if len(solid.corners):
            points.append(solid.corners)
        else:
            half = solid.size[1] / 2.0 if len(solid.size) > 1 else 0.0
            centre, axis = solid.pose[:3, 3], solid.pose[:3, 2] * half
            points.append(np.array([centre - axis, centre + axis]))
    every = np.concatenate(points)
    return np.asarray(every[np.linalg.norm(every, axis=1).argmax()])


def end_ball(solid: Solid, along: FloatArray) -> Ball:
    """The ball at the end of a shape.

    Args:
        solid: the shape.
        along: unit vector ``(3,)`` along the leg, towards its end.
    """
    centre = solid.pose[:3, 3]
    if solid.kind == "sphere":
        return Ball(centre, float(solid.size[0]))
    if len(solid.corners):
        return _corner_ball(solid.corners, along)
    radius, length = (float(v) for v in solid.size)
    axis = solid.pose[:3, 2] * (1.0 if solid.pose[:3, 2] @ along >= 0.0 else -1.0)
    if solid.kind == "cylinder" and axis @ along < SLENDER:
        return Ball(centre, radius)
    # The balls at a capsule's ends are beyond its length, and those of a stick within.
    beyond = length / 2.0 if solid.kind == "capsule" else length / 2.0 - radius
    return Ball(centre + beyond * axis, radius)


def rolling_ball(
    solids: list[Solid], along: FloatArray, axis: FloatArray, largest: float
) -> Ball | None:
    """The ball on which shapes roll over flat ground; ``None`` where they do not roll like a ball.

    It is the smallest one that covers how far the shapes reach towards the ground, for ground that
    leans by up to :data:`LEAN` against the leg: a linear program in its centre and radius.

    Args:
        solids: the shapes of the lower leg.
        along: unit vector ``(3,)`` along it, towards its end.
        axis: unit vector ``(3,)`` of the knee's axis.
        largest: largest radius [m].
    """
    from scipy.optimize import linprog

    flat = along - (along @ axis) * axis
    flat /= max(float(np.linalg.norm(flat)), 1e-9)
    pitch, roll = (a.ravel() for a in np.meshgrid(
        np.linspace(-LEAN[0], LEAN[0], 41), np.linspace(-LEAN[1], LEAN[1], 5)))  # fmt: skip
    aside = np.outer(np.cos(pitch), flat) + np.outer(np.sin(pitch), np.cross(axis, flat))
    ways = np.cos(roll)[:, None] * aside + np.sin(roll)[:, None] * axis
    reach = np.max([_reach(solid, ways) for solid in solids], axis=0) + COVER
    rows = np.column_stack([ways, np.ones(len(ways))])
    found = linprog(rows.sum(axis=0), A_ub=-rows, b_ub=-reach,
                    bounds=[(None, None)] * 3 + [(0.0, largest)])  # fmt: skip
    if found.x is None:
        return None
    centre, radius = np.round(found.x[:3], 6), round(float(found.x[3]), 6)
    good = float((rows @ found.x - reach).max()) < ROLLS * radius
    return Ball(centre, radius) if good else None


def _reach(solid: Solid, ways: FloatArray) -> FloatArray:
    """How far a shape reaches along unit vectors ``(N, 3)`` [m]."""
    if len(solid.corners):
        return np.asarray((ways @ solid.corners.T).max(axis=1))
    middle, along = ways @ solid.pose[:3, 3], np.abs(ways @ solid.pose[:3, 2])
    radius, half = float(solid.size[0]), float(solid.size[1:].sum()) / 2.0
    round_ = 1.0 if solid.kind != "cylinder" else np.sqrt(np.maximum(1.0 - along**2, 0.0))
    return np.asarray(middle + half * along + radius * round_)


def _corner_ball(corners: FloatArray, along: FloatArray) -> Ball:
    """The ball at the end of a cloud of corners: fitted, or as wide as the end."""
    heights = corners @ along
    top, length = float(heights.max()), float(np.ptp(heights))
    end = corners[heights >= top - SLAB * length]
    fitted = _fitted_ball(end, SLAB * length)
    if fitted is not None:
        return fitted
    across = end - np.outer(end @ along, along)
    radius = max(float(np.ptp(across @ side)) / 2.0 for side in _sides(along))
    radius = min(radius, SLAB * length)
    middle = (across.min(axis=0) + across.max(axis=0)) / 2.0
    return Ball(middle - (middle @ along) * along + (top - radius) * along, radius)


def _fitted_ball(points: FloatArray, size: float) -> Ball | None:
    """A ball through points, where they lie on one that is no larger than ``4 size``."""
    if len(points) < 8 or size <= 0.0:
        return None
    system = np.column_stack([2.0 * points, np.ones(len(points))])
    solution, _, rank, _ = np.linalg.lstsq(system, (points**2).sum(axis=1), rcond=None)
    square = float(solution[3] + solution[:3] @ solution[:3])
    if rank < 4 or not square > 0.0:
        return None
    radius = float(np.sqrt(square))
    errors = np.linalg.norm(points - solution[:3], axis=1) - radius
    good = 0.1 * size < radius < 4.0 * size and float(np.abs(errors).max()) < 0.15 * radius
    return Ball(np.asarray(solution[:3]), radius) if good else None


def _sides(along: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Two unit vectors that are square to ``along`` and each other."""
    first = np.cross(along, np.eye(3)[int(np.abs(along).argmin())])
    first /= np.linalg.norm(first)
    return first, np.cross(along, first)
