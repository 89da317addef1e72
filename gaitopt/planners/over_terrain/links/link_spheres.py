"""A robot's links as balls that cover them, and where they are for many postures at once.

The search asks very often whether limbs and trunk are clear of the ground. So every collision shape
is covered by a few balls. They reach a little beyond the shapes, which is on the safe side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.planners.over_terrain.links.near_foot import COARSE, SPACING, points_near_foot, thinned
from gaitopt.robots.collisions.shapes import robot_shapes
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import zero_configuration

STRETCH = 0.6
"""Side of the cells that a shape is divided into, as a share of its thickness. Chosen: the balls
then reach little beyond the shape, and there are not too many of them."""
MOST_CELLS = 12
"""Most cells along each side of a shape."""
ROUND = 24
"""Corners that stand for a circle."""
SAMPLES = 2.0
"""Points on the surface of a shape for each length of a cell."""
LARGEST_CELL = 0.2
"""Largest side of a cell as a share of the legs' reach: balls of thick trunks reach little beyond
them then."""
NEAR_FOOT = 2.0
"""Balls of the shank as near as this to the foot, in radii of the foot, count as the foot."""
STEEP = 1.5
"""Tangent of the slope, from one ball of the trunk to another, from which on the upper one cannot
touch the ground before the lower one does. Chosen: trunks tilt by less than the 34 degrees that are
left to the vertical."""


class LinkBalls(NamedTuple):
    """Balls that cover the shapes of one link, in the body frame of the zero configuration.

    Attributes:
        centres: ``(n, 3)`` [m].
        radii: ``(n,)`` [m].
    """

    centres: FloatArray
    radii: FloatArray

    def chosen(self, which: BoolArray) -> LinkBalls:
        """Some of the balls."""
        return LinkBalls(self.centres[which], self.radii[which])


class Placements(NamedTuple):
    """Rotations and places of links.

    Attributes:
        turns: ``(N, 3, 3)``.
        shifts: ``(N, 3)`` [m].
    """

    turns: FloatArray
    shifts: FloatArray

    def moved(self, points: FloatArray) -> FloatArray:
        """Points that move with the link ``(N, n, 3)``, given at no rotation ``(n, 3)`` [m]."""
        return np.asarray(points @ np.swapaxes(self.turns, -1, -2) + self.shifts[:, None])


@dataclass(frozen=True, eq=False)
class LinkSpheres:
    """The balls of a robot's trunk and legs, and the hinges that move them.

    Attributes:
        trunk: balls that move with the body.
        legs: for each leg the balls of its links, from the body to the foot; those at the foot are
            left out, since it stands on the ground.
        near_feet: for each leg points of the shank next to the foot, where no balls are
            ``(n, 3)`` [m].
        few_near_feet: fewer of them.
        points: a point on each hinge's axis at the zero configuration ``(4, 3, 3)`` [m].
        axes: the hinges' unit axes ``(4, 3, 3)``. Points and axes are in the body frame.
    """

    trunk: LinkBalls
    legs: tuple[tuple[LinkBalls, ...], ...]
    near_feet: tuple[FloatArray, ...]
    few_near_feet: tuple[FloatArray, ...]
    points: FloatArray
    axes: FloatArray

    @property
    def radii(self) -> FloatArray:
        """Radii of all balls ``(n,)`` [m]."""
        links = [self.trunk, *(balls for leg in self.legs for balls in leg)]
        return np.concatenate([balls.radii for balls in links])

    def placements(self, leg: int, joints: FloatArray, body: Placements) -> list[Placements]:
        """Where the links of a leg are.

        Args:
            leg: index of the leg.
            joints: its joint angles ``(N, 3)`` [rad].
            body: where the body is.
        """
        turn, shift = body
        out = []
        for link, (point, axis) in enumerate(zip(self.points[leg], self.axes[leg], strict=True)):
            own = _about(axis, joints[:, link])
            shift = shift + (turn @ (point - own @ point)[..., None])[..., 0]
            turn = turn @ own
            out.append(Placements(turn, shift))
        return out


@lru_cache(maxsize=16)
def link_spheres(robot: Quadruped) -> LinkSpheres:
    """The balls of a robot whose legs have three joints."""
    import pinocchio as pin

    model, data = robot.model, robot.model.createData()
    pin.computeJointJacobians(model, data, zero_configuration(robot))
    to_body = robot.body_axes.T
    joints = [[int(model.getJointId(j)) for j in robot.legs[leg].joints] for leg in LEGS]
    axes = np.array([
        [to_body @ data.J[3:, model.joints[j].idx_v] for j in row] for row in joints
    ])  # fmt: skip
    points = np.array([[to_body @ data.oMi[j].translation for j in row] for row in joints])
    found: dict[int, list[LinkBalls]] = {}
    hulls: dict[int, list[FloatArray]] = {}
    largest = LARGEST_CELL * robot.legs[LEGS[0]].reach
    for joint, corners in _solids(robot):
        placed = (data.oMi[joint].rotation @ corners.T).T + data.oMi[joint].translation
        hulls.setdefault(joint, []).append(placed @ to_body.T)
        found.setdefault(joint, []).append(covering_balls(placed @ to_body.T, largest))
    owned = {j for row in joints for j in row}
    trunk = _joined([b for j, each in found.items() if j not in owned for b in each])
    legs = tuple(tuple(_joined(found.get(j, [])) for j in row) for row in joints)
    near_feet = tuple(_near_foot(robot, leg, hulls.get(row[-1], []), own[-1])
                      for leg, row, own in zip(LEGS, joints, legs, strict=True))  # fmt: skip
    side = max(COARSE * robot.foot_radius, 1e-6)
    return LinkSpheres(
        trunk=_lower(trunk),
        legs=tuple(_without_foot(robot, leg, own) for leg, own in zip(LEGS, legs, strict=True)),
        near_feet=near_feet, few_near_feet=tuple(thinned(points, side) for points in near_feet),
        points=points, axes=axes,
    )  # fmt: skip


def _without_foot(
    robot: Quadruped, leg: str, links: tuple[LinkBalls, ...]
) -> tuple[LinkBalls, ...]:
    """A leg's balls without those at its foot."""
    balls = links[-1]
    foot = robot.legs[leg].forward(np.zeros(3))
    away = np.linalg.norm(balls.centres - foot, axis=1)
    return (*links[:-1], balls.chosen(away >= NEAR_FOOT * robot.foot_radius + balls.radii))


def _near_foot(robot: Quadruped, leg: str, hulls: list[FloatArray], balls: LinkBalls) -> FloatArray:
    """Points of a shank where its balls are left out ``(n, 3)`` [m]."""
    radius = robot.foot_radius
    if not radius > 0.0:
        return np.empty((0, 3))
    foot = robot.legs[leg].forward(np.zeros(3))
    most = NEAR_FOOT * radius + 2.0 * float(balls.radii.max(initial=0.0))
    outlines = [(corners, _surface(corners, SPACING * radius)[0]) for corners in hulls]
    return points_near_foot(outlines, foot, radius, most)


def _lower(balls: LinkBalls) -> LinkBalls:
    """The trunk's balls below which there are no others, for a trunk that tilts a little."""
    if not len(balls.radii):
        return balls
    away = balls.centres[:, None] - balls.centres[None]
    below = away[..., 2] > STEEP * np.linalg.norm(away[..., :2], axis=2)
    covered = below & (balls.radii[:, None] <= balls.radii[None] + 1e-9)
    np.fill_diagonal(covered, False)
    return balls.chosen(~covered.any(axis=1))


def covering_balls(corners: FloatArray, largest: float) -> LinkBalls:
    """Balls that cover the surface of the convex hull of points ``(n, 3)`` [m].

    The hull's box along its principal axes is divided into cells about half as large as it is
    thick, and the part of the surface in each cell gets a ball about it.

    Args:
        corners: the points.
        largest: side of a cell at most [m].
    """
    middle = corners.mean(axis=0)
    _, _, frame = np.linalg.svd(corners - middle, full_matrices=False)
    local = (corners - middle) @ frame.T
    low, high = local.min(axis=0), local.max(axis=0)
    size = np.maximum(high - low, 1e-6)
    cell = STRETCH * max(float(size.min()), float(size.max()) / MOST_CELLS)
    cell = min(cell, max(largest, float(size.max()) / MOST_CELLS))
    counts = np.clip(np.ceil(size / cell), 1, MOST_CELLS).astype(int)
    if size.min() <= largest:
        counts[int(size.argmin())] = 1
    points, spacing = _surface(local, cell / SAMPLES)
    number = np.minimum(((points - low) / size * counts).astype(int), counts - 1)
    owner = (number[:, 0] * counts[1] + number[:, 1]) * counts[2] + number[:, 2]
    centres, radii = [], []
    for k in np.unique(owner):
        own = points[owner == k]
        centre = (own.min(axis=0) + own.max(axis=0)) / 2.0
        centres.append(centre)
        radii.append(float(np.linalg.norm(own - centre, axis=1).max()) + spacing)
    return LinkBalls(np.array(centres) @ frame + middle, np.array(radii))


def _surface(corners: FloatArray, spacing: float) -> tuple[FloatArray, float]:
    """Points on the surface of a convex hull, and how far its other points are from them at most.

    Args:
        corners: of the hull ``(n, 3)`` [m].
        spacing: about the distance between the points [m].
    """
    try:
        hull = ConvexHull(corners)
    except (QhullError, ValueError):
        return corners, float(np.ptp(corners, axis=0).max())
    triangles = corners[hull.simplices]
    sides = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1)
    parts = np.maximum(np.ceil(sides / spacing), 1).astype(int)
    points = []
    for n in np.unique(parts):
        i, j = np.meshgrid(np.arange(n + 1), np.arange(n + 1), indexing="ij")
        u, v = i[i + j <= n] / n, j[i + j <= n] / n
        shares = np.column_stack([1.0 - u - v, u, v])
        points.append((shares @ triangles[parts == n]).reshape(-1, 3))
    # The points of a triangle are within its longest side / sqrt(3) of one of its corners.
    return np.concatenate(points), float((sides / parts).max() / np.sqrt(3.0))


def _solids(robot: Quadruped) -> list[tuple[int, FloatArray]]:
    """Collision shapes as corners of convex solids, with the joint that moves each.

    Meshes count as their hulls where these are known, and else as lines and a box
    (:func:`gaitopt.robots.collisions.shapes.robot_shapes`).
    """
    import pinocchio as pin

    model, out = robot.model, []
    hulled = set()
    for link, numbers in robot.notes.hulls:
        frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
        corners = np.array(numbers, dtype=np.float64).reshape(-1, 3)
        placed = corners @ frame.placement.rotation.T + frame.placement.translation
        out.append((int(frame.parentJoint), placed))
        hulled.add(int(frame.parentJoint))
    shapes = robot_shapes(robot)
    for shape in shapes.geometry.geometryObjects:
        if str(shape.name) in shapes.stand_ins and int(shape.parentJoint) in hulled:
            continue
        corners = _corners(shape.geometry)
        placed = corners @ shape.placement.rotation.T + shape.placement.translation
        out.append((int(shape.parentJoint), placed))
    return out


def _corners(solid: Any) -> FloatArray:
    """Points whose convex hull is a box, or nearly a ball, cylinder or capsule ``(n, 3)`` [m]."""
    angles = 2.0 * np.pi * np.arange(ROUND) / ROUND
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    kind = type(solid).__name__
    if kind == "Box":
        signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
        return np.asarray(signs * np.array(solid.halfSide))
    if kind == "Sphere":
        return _ball(float(solid.radius), circle)
    half, radius = float(solid.halfLength), float(solid.radius)
    if kind == "Capsule":
        ball, shift = _ball(radius, circle), np.array([0.0, 0.0, half])
        return np.concatenate([ball - shift, ball + shift])
    ring = radius * circle
    return np.concatenate([np.column_stack([ring, np.full(ROUND, z)]) for z in (-half, half)])


def _ball(radius: float, circle: FloatArray) -> FloatArray:
    """Points on a ball about the origin ``(n, 3)`` [m]."""
    zero = np.zeros(len(circle))
    return radius * np.concatenate([
        np.column_stack([circle, zero]), np.column_stack([circle[:, :1], zero, circle[:, 1:]]),
        np.column_stack([zero, circle]),
    ])  # fmt: skip


def _joined(balls: list[LinkBalls]) -> LinkBalls:
    if not balls:
        return LinkBalls(np.empty((0, 3)), np.empty(0))
    return LinkBalls(
        np.concatenate([b.centres for b in balls]), np.concatenate([b.radii for b in balls])
    )


def _about(axis: FloatArray, angles: FloatArray) -> FloatArray:
    """Rotations about a unit axis by angles ``(N,)``: ``(N, 3, 3)``."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, cosine = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    return np.asarray(np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross))
