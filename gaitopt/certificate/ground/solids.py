"""What of a robot must be clear of the ground, as convex solids fixed to its links.

The shapes are the collision shapes of the URDF; meshes count as their convex hulls. Where there is
neither, a line between a link's joints stands for it, and a flat box for the body. Long shapes are
cut into parts, for a part has more room than the box around a whole leaning shank.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin
from pinocchio import coal

from gaitopt.certificate.collisions.obstacles import stand_in_shapes
from gaitopt.certificate.collisions.self_collision import convex_solid, without_meshes
from gaitopt.certificate.enclosure import chain_to
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.quadruped import Quadruped

FOOT_SHARE = 1.25
"""A part that lies within this many radii of the middle of a foot is the foot itself. The foot of
go2 is a mesh that reaches 1.14 radii; its radius is how far it goes downwards."""
MOST_PARTS = 4
"""Most parts that a shape is cut into. Chosen: shanks are some 6 to 12 times as long as thick, and
each part costs time."""
SIDES = 24
"""Points on the rim of a cylinder, where it is asked whether it lies within a foot: between two of
them the rim goes 0.9 % of its radius farther out."""


@dataclass(frozen=True, eq=False)
class Solid:
    """A convex solid on a link.

    Attributes:
        name: of its link.
        joint: that carries it.
        place: rotation ``(3, 3)`` and origin ``(3,)`` of the shape in the joint's frame.
        centre: middle of the box around it, in the joint's frame ``(3,)`` [m].
        half: half the sides of this box, along the axes of ``place`` ``(3,)`` [m].
        primitive: coal's ball, capsule, cylinder or box; ``None`` where it is a hull.
        hull: corners of the hull in the frame of ``place`` ``(n, 3)`` [m].
    """

    name: str
    joint: int
    place: tuple[FloatArray, FloatArray]
    centre: FloatArray
    half: FloatArray
    primitive: Any = None
    hull: FloatArray | None = None

    @classmethod
    def of(cls, name: str, joint: int, shape: Any, place: Any) -> Solid:
        """A solid from its shape and the shape's place in the joint's frame (an ``SE3``).

        Args:
            name, joint: its link, and the joint that carries it.
            shape: coal's primitive, or the corners of a hull ``(n, 3)`` [m].
            place: Pinocchio's.
        """
        hull = shape if isinstance(shape, np.ndarray) else None
        if hull is None:
            shape.computeLocalAABB()
            low, high = (np.array(x) for x in (shape.aabb_local.min_, shape.aabb_local.max_))
        else:
            low, high = hull.min(axis=0), hull.max(axis=0)
        rotation, origin = place.rotation.copy(), place.translation.copy()
        centre = origin + rotation @ ((low + high) / 2.0)
        primitive = shape if hull is None else None
        return cls(name, joint, (rotation, origin), centre, (high - low) / 2.0, primitive, hull)

    @cached_property
    def shape(self) -> Any:
        """The solid as coal's."""
        return convex_solid(self.hull) if self.hull is not None else self.primitive

    def transform(self, rotation: FloatArray, origin: FloatArray) -> Any:
        """Where coal's shape is, for the place of the joint's frame ``(3, 3)`` and ``(3,)``."""
        turn, shift = self.place
        return coal.Transform3s(rotation @ turn, rotation @ shift + origin)

    @property
    def radius(self) -> float:
        """Of the ball around it [m]."""
        return float(np.linalg.norm(self.half))

    @property
    def corners(self) -> FloatArray:
        """Corners of the box around it, in the joint's frame ``(8, 3)`` [m]."""
        signs = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
        return np.asarray(self.centre + (signs * self.half) @ self.place[0].T)


@dataclass(frozen=True, eq=False)
class Solids:
    """All solids of a robot, without its feet.

    Attributes:
        parts: the solids.
        stand_ins: links whose shapes are missing, and are replaced by lines or a box.
        hulls: whether meshes count as their convex hulls.
    """

    parts: tuple[Solid, ...]
    stand_ins: tuple[str, ...]
    hulls: bool

    @classmethod
    def of(cls, robot: Quadruped) -> Solids:
        """The solids of a robot."""
        feet = _foot_places(robot)
        own, unknown = _own_shapes(robot)
        parts = _without_feet(own, feet, robot.foot_radius)
        shaped = {part.joint for part in parts} - unknown
        lines = [
            (link, joint, _ended_at_the_ball(shape) if joint in feet else shape, place)
            for joint, link, shape, place in stand_in_shapes(robot)
            if joint not in shaped
        ]
        parts += _without_feet(lines, feet, robot.foot_radius)
        stand_ins = tuple(link for link, *_ in lines)
        return cls(tuple(parts), stand_ins, bool(robot.notes.hulls))


def farthest(model: Any, solids: Solids) -> float:
    """How far any of a robot's solids can be from its base's origin [m]."""
    chains = [chain_to(model, x.joint, x.centre, x.radius) for x in solids.parts]
    return max((chain.base for chain in chains), default=0.0)


Shape = tuple[str, int, Any, Any]
"""A link, the joint that carries it, coal's primitive or the corners of a hull, and its place in
the joint's frame."""


def _own_shapes(robot: Quadruped) -> tuple[list[Shape], set[int]]:
    """The shapes of the URDF, and the joints with meshes of which no hull is known."""
    model = robot.model
    text, meshed = without_meshes(robot.urdf)
    geometry = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    out = [
        (str(model.frames[x.parentFrame].name), int(x.parentJoint), x.geometry, x.placement)
        for x in geometry.geometryObjects
    ]
    frames = {link: model.frames[model.getFrameId(link, pin.BODY)]
              for link in [*meshed, *(link for link, _ in robot.notes.hulls)]}  # fmt: skip
    for link, numbers in robot.notes.hulls:
        frame = frames[link]
        corners = np.array(numbers, dtype=np.float64).reshape(-1, 3)
        out.append((link, int(frame.parentJoint), corners, frame.placement))
    known = {link for link, _ in robot.notes.hulls}
    return out, {int(frames[link].parentJoint) for link in meshed if link not in known}


def _without_feet(shapes: list[Shape], feet: dict[int, FloatArray], radius: float) -> list[Solid]:
    """The shapes as solids, long ones in parts, without the parts that are feet."""
    parts = [part for shape in shapes for part in _parts(*shape)]
    return [part for part in parts if not _is_foot(part, feet, radius)]


def _ended_at_the_ball(shape: Any) -> Any:
    """A line that stands for a lower leg, shorter by its radius at both ends.

    It is as thick as the ball of the foot, so it would touch the ground by itself if it went on to
    the middle of the foot.
    """
    return coal.Capsule(shape.radius, max(2.0 * (shape.halfLength - shape.radius), 1e-6))


def _foot_places(robot: Quadruped) -> dict[int, FloatArray]:
    """Middle of the foot in the frame of the joint that carries it ``(3,)`` [m]."""
    frames = [robot.model.frames[robot.model.getFrameId(robot.legs[leg].foot)] for leg in LEGS]
    return {int(f.parentJoint): f.placement.translation.copy() for f in frames}


def _is_foot(part: Solid, feet: dict[int, FloatArray], radius: float) -> bool:
    """Whether a part lies within the ball of a foot, or hardly beyond it."""
    if part.joint not in feet:
        return False
    points, extra = _outline(part)
    away = points - feet[part.joint]
    return bool(np.linalg.norm(away, axis=1).max() + extra <= FOOT_SHARE * radius)


def _outline(part: Solid) -> tuple[FloatArray, float]:
    """Points in the joint's frame ``(n, 3)``: balls of this radius about them hold a part."""
    rotation, origin = part.place
    kind = part.primitive
    if part.hull is not None:
        return origin + part.hull @ rotation.T, 0.0
    if isinstance(kind, coal.Sphere):
        return origin[None], float(kind.radius)
    if isinstance(kind, coal.Capsule):
        ends = np.array([-1.0, 1.0])[:, None] * kind.halfLength * rotation[:, 2]
        return origin + ends, float(kind.radius)
    if isinstance(kind, coal.Cylinder):
        turns = 2.0 * np.pi * np.arange(SIDES) / SIDES
        ring = kind.radius * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
        ends = kind.halfLength * np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]])
        return origin + (ends[:, None] + ring).reshape(-1, 3) @ rotation.T, 0.0
    return part.corners, 0.0


def _parts(name: str, joint: int, shape: Any, place: Any) -> list[Solid]:
    """A shape, cut along its longest side where it is long."""
    whole = Solid.of(name, joint, shape, place)
    axis = int(whole.half.argmax())
    across = float(np.delete(whole.half, axis).max())
    count = min(int(whole.half[axis] / max(across, 1e-6)), MOST_PARTS)
    upright = isinstance(shape, coal.Cylinder) and axis == 2
    if count < 2 or not (upright or isinstance(shape, (coal.Box, np.ndarray))):
        return [whole]
    if whole.hull is not None:
        parts = [(corners, 0.0) for corners in _slabs(whole.hull, axis, count)]
    else:
        step = 2.0 * whole.half[axis] / count
        shorter = _shorter(shape, axis, step)
        parts = [(shorter, (k + 0.5) * step - whole.half[axis]) for k in range(count)]
    along = place.rotation[:, axis]
    return [
        Solid.of(name, joint, part, pin.SE3(place.rotation, place.translation + shift * along))
        for part, shift in parts
    ]


def _shorter(shape: Any, axis: int, length: float) -> Any:
    """A box or an upright cylinder of another length along an axis."""
    if isinstance(shape, coal.Cylinder):
        return coal.Cylinder(shape.radius, length)
    sides = 2.0 * np.array(shape.halfSide, dtype=np.float64)
    sides[axis] = length
    return coal.Box(*sides.tolist())


def _slabs(corners: FloatArray, axis: int, count: int) -> list[FloatArray]:
    """Corners of the slabs into which a hull is cut across an axis; its own where it is flat."""
    from scipy.spatial import ConvexHull, QhullError  # late: few robots have meshes

    try:
        faces = ConvexHull(corners).simplices
    except (QhullError, ValueError):
        return [corners]
    edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)), axis=0)
    start, end = corners[edges[:, 0]], corners[edges[:, 1]]
    cuts = np.linspace(corners[:, axis].min(), corners[:, axis].max(), count + 1)
    rings = []
    for cut in cuts[1:-1]:
        crossed = (start[:, axis] < cut) != (end[:, axis] < cut)
        a, b = start[crossed], end[crossed]
        share = (cut - a[:, axis]) / (b[:, axis] - a[:, axis])
        rings.append(a + share[:, None] * (b - a))
    between = [
        (corners[:, axis] >= low) & (corners[:, axis] <= high)
        for low, high in itertools.pairwise(cuts)
    ]
    return [
        np.concatenate([corners[inside], *rings[max(k - 1, 0) : k + 1]])
        for k, inside in enumerate(between)
    ]
