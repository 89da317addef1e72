"""What of a robot must be clear of columns: convex parts of its links, without the feet.

Planners look at these; the certificate makes its own, so that an error in one of the two is seen by
the other (:mod:`gaitopt.certificate.ground.solids`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.at_many_poses.chain import Chain
from gaitopt.robots.collisions.shapes import known_shapes, lines_of_limbs
from gaitopt.robots.quadruped import Quadruped

FOOT = 1.25
"""A part that lies within this many radii of the middle of a foot is the foot itself, as the
certificate has it."""
MOST_PARTS = 4
"""Most parts that a shape is cut into across its longest side."""
RIM = 24
"""Points that stand for the rim of a cylinder."""
LINKS = ("hip", "thigh", "shank")
"""Names of a leg's links, from the body on."""
TRUNK = "trunk"
"""Name of what belongs to no leg."""


class Solid(NamedTuple):
    """A convex solid on a link.

    Attributes:
        joint: number of the joint that carries it.
        shape: coal's.
        turn, origin: of its frame in that of the joint ``(3, 3)`` and ``(3,)`` [m].
        centre: of the box around it, in its own frame ``(3,)`` [m].
        half: of the sides of this box ``(3,)`` [m].
    """

    joint: int
    shape: Any
    turn: FloatArray
    origin: FloatArray
    centre: FloatArray
    half: FloatArray

    @classmethod
    def of(cls, joint: int, shape: Any, turn: FloatArray, origin: FloatArray) -> Solid:
        """A solid from coal's shape and its place in the joint's frame."""
        shape.computeLocalAABB()
        low, high = (np.array(x) for x in (shape.aabb_local.min_, shape.aabb_local.max_))
        return cls(joint, shape, turn, origin, (low + high) / 2.0, (high - low) / 2.0)

    @property
    def corners(self) -> FloatArray:
        """Corners of the box around it, in the joint's frame ``(8, 3)`` [m]."""
        signs = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
        return np.asarray(self.origin + (self.centre + signs * self.half) @ self.turn.T)

    @property
    def outline(self) -> tuple[FloatArray, float]:
        """Points in the joint's frame ``(n, 3)``: balls of this radius about them hold it [m]."""
        points, extra = _outline(self.shape)
        return np.asarray(self.origin + points @ self.turn.T), extra

    @property
    def middle(self) -> FloatArray:
        """Middle of this box, in the joint's frame ``(3,)`` [m]."""
        return np.asarray(self.origin + self.turn @ self.centre)

    @property
    def radius(self) -> float:
        """Of the ball around this box [m]."""
        return float(np.linalg.norm(self.half))


class JointBoxes(NamedTuple):
    """Boxes around what joints carry, along the axes of the joints' frames.

    Attributes:
        joint: numbers of the joints ``(k,)``.
        centre: ``(3, k)`` [m].
        half: half of the sides ``(3, k)`` [m].
    """

    joint: np.ndarray
    centre: FloatArray
    half: FloatArray


@dataclass(frozen=True, eq=False)
class LimbParts:
    """The parts of a robot's links.

    Attributes:
        chain: of its joints.
        solids: the parts.
        legs: whose link each part belongs to; ``""`` for the trunk.
        links: which link it is: one of :data:`LINKS`, or :data:`TRUNK`.
    """

    chain: Chain
    solids: tuple[Solid, ...]
    legs: tuple[str, ...]
    links: tuple[str, ...]

    @cached_property
    def ends(self) -> tuple[float, ...]:
        """How far from its joint each part is at most [m]."""
        return tuple(float(np.linalg.norm(part.middle)) + part.radius for part in self.solids)

    @cached_property
    def boxes(self) -> JointBoxes:
        """The boxes around all that each joint carries."""
        joints = sorted({part.joint for part in self.solids})
        corners = [np.concatenate([part.corners for part in self.solids if part.joint == joint])
                   for joint in joints]  # fmt: skip
        low = np.stack([points.min(axis=0) for points in corners], axis=1)
        high = np.stack([points.max(axis=0) for points in corners], axis=1)
        return JointBoxes(np.array(joints), (low + high) / 2.0, (high - low) / 2.0)

    @cached_property
    def outlines(self) -> dict[int, list[tuple[FloatArray, float]]]:
        """The outlines of the parts that each joint carries."""
        return {
            joint: [part.outline for part in self.solids if part.joint == joint]
            for joint in {part.joint for part in self.solids}
        }

    def lowest(self, poses: FloatArray, enough: float) -> float:
        """How low any part comes [m].

        Where boxes around all that a joint carries stay above ``enough``, they are not looked into.

        Args:
            poses: of base and joints, as in a path ``(N, 6 + nj)`` [m, rad].
            enough: height of interest [m].
        """
        sine, cosine = np.sin(poses[:, 3:5].T), np.cos(poses[:, 3:5].T)
        up = np.stack([-sine[1], cosine[1] * sine[0], cosine[1] * cosine[0]])
        ups, heights = self.chain.ups(poses[:, 6:], up)
        heights += poses[:, 2]
        joint, centre, half = self.boxes
        own = ups[:, joint]
        away = (centre[..., None] * own).sum(axis=0) - (half[..., None] * np.abs(own)).sum(axis=0)
        bottoms = (heights[joint] + away).min(axis=1)
        least = float(bottoms.min())
        if least >= enough:
            return least
        for k in np.flatnonzero(bottoms < enough).tolist():
            number = int(joint[k])
            bottoms[k] = min(
                float((heights[number] + points @ ups[:, number]).min()) - extra
                for points, extra in self.outlines[number]
            )
        return float(bottoms.min())


@lru_cache(maxsize=32)
def limb_parts(robot: Quadruped) -> LimbParts | None:
    """The parts of a robot's links; ``None`` where a joint is no hinge, or feet are points.

    Boxes, cylinders and hulls of meshes are cut across their longest sides, so that the part that
    is the foot can be left out. A line stands for a link without a shape, and a box for such a
    trunk.
    """
    chain = Chain.of(robot.model)
    if chain is None or not robot.foot_radius > 0.0:
        return None
    feet = _feet(robot)
    solids = [part for shape in known_shapes(robot) for part in _cut(*shape)]
    solids = [part for part in solids if not _is_foot(part, feet, robot.foot_radius)]
    shaped = {part.joint for part in solids}
    for joint, _, line, place in lines_of_limbs(robot):
        if joint not in shaped:
            own = _ended_at_the_ball(line) if joint in feet else line
            solids.append(Solid.of(joint, own, place.rotation.copy(), place.translation.copy()))
    owners = _owners(robot)
    legs, links = zip(*(owners.get(part.joint, ("", TRUNK)) for part in solids), strict=True)
    return LimbParts(chain, tuple(solids), legs, links)


def _ended_at_the_ball(line: Any) -> Any:
    """A capsule that is as thick as the foot, shorter by its radius at both ends."""
    from pinocchio import coal

    return coal.Capsule(line.radius, max(2.0 * (line.halfLength - line.radius), 1e-6))


def _owners(robot: Quadruped) -> dict[int, tuple[str, str]]:
    """Leg and link that each joint moves."""
    return {
        int(robot.model.getJointId(joint)): (leg, link)
        for leg in LEGS
        for joint, link in zip(
            robot.legs[leg].joints, LINKS[-len(robot.legs[leg].joints) :], strict=True
        )
    }


def _feet(robot: Quadruped) -> dict[int, FloatArray]:
    """Middle of the foot in the frame of the joint that carries it ``(3,)`` [m]."""
    frames = [robot.model.frames[robot.model.getFrameId(robot.legs[leg].foot)] for leg in LEGS]
    return {int(frame.parentJoint): frame.placement.translation.copy() for frame in frames}


def _is_foot(part: Solid, feet: dict[int, FloatArray], radius: float) -> bool:
    """Whether a part lies within a foot, or hardly beyond it."""
    if part.joint not in feet:
        return False
    points, extra = part.outline
    away = points - feet[part.joint]
    return bool(np.linalg.norm(away, axis=1).max() + extra <= FOOT * radius)


def _outline(shape: Any) -> tuple[FloatArray, float]:
    """Points ``(n, 3)``: balls of this radius about them hold a shape [m]."""
    kind = type(shape).__name__
    if kind == "Sphere":
        return np.zeros((1, 3)), float(shape.radius)
    if kind == "Capsule":
        return np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]) * shape.halfLength, float(shape.radius)
    if kind == "Cylinder":
        turns = 2.0 * np.pi * np.arange(RIM) / RIM
        ring = shape.radius * np.stack([np.cos(turns), np.sin(turns), 0.0 * turns], axis=1)
        up = np.array([0.0, 0.0, shape.halfLength])
        return np.concatenate([ring - up, ring + up]), 0.0
    if kind == "Box":
        signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
        return np.asarray(signs * np.array(shape.halfSide)), 0.0
    return np.array(shape.points()), 0.0


def _cut(joint: int, shape: Any, place: Any) -> list[Solid]:
    """A shape, cut across its longest side where it is long."""
    from pinocchio import coal

    turn, origin = place.rotation.copy(), place.translation.copy()
    whole = Solid.of(joint, shape, turn, origin)
    axis = int(whole.half.argmax())
    across = float(np.delete(whole.half, axis).max())
    count = min(int(whole.half[axis] / max(across, 1e-6)), MOST_PARTS)
    kind = type(shape).__name__
    if count < 2 or kind in ("Sphere", "Capsule") or (kind == "Cylinder" and axis != 2):
        return [whole]
    if kind not in ("Box", "Cylinder"):
        return [Solid.of(joint, part, turn, origin) for part in _slabs(shape, axis, count)]
    step, out = 2.0 * whole.half[axis] / count, []
    sides = 2.0 * whole.half
    sides[axis] = step
    for k in range(count):
        part = coal.Box(*sides.tolist()) if kind == "Box" else coal.Cylinder(shape.radius, step)
        shift = (k + 0.5) * step - whole.half[axis]
        out.append(Solid.of(joint, part, turn, origin + shift * turn[:, axis]))
    return out


def _slabs(hull: Any, axis: int, count: int) -> list[Any]:
    """A convex hull cut across an axis into slabs of equal thickness, each coal's."""
    from scipy.spatial import ConvexHull  # a robot with hulls has imported it

    corners = np.array(hull.points())
    faces = ConvexHull(corners).simplices
    starts, ends = corners[faces].reshape(-1, 3), corners[np.roll(faces, -1, axis=1)].reshape(-1, 3)
    along, low, high = corners[:, axis], corners[:, axis].min(), corners[:, axis].max()
    cuts = np.linspace(low, high, count + 1)
    rings = [np.empty((0, 3))]
    for cut in cuts[1:-1].tolist():
        # Each edge comes from both of its sides; the one that goes up is enough.
        up = (starts[:, axis] < cut) & (ends[:, axis] >= cut)
        a, b = starts[up], ends[up]
        rings.append(a + ((cut - a[:, axis]) / (b[:, axis] - a[:, axis]))[:, None] * (b - a))
    rings.append(np.empty((0, 3)))
    return [
        _convex(np.concatenate([corners[(along >= cuts[k]) & (along <= cuts[k + 1])],
                                rings[k], rings[k + 1]]))
        for k in range(count)
    ]  # fmt: skip


def _convex(corners: FloatArray) -> Any:
    """The convex hull of points as coal's solid."""
    from gaitopt.robots.files.hulls import convex_hull

    return convex_hull(tuple(corners.ravel().tolist()))
