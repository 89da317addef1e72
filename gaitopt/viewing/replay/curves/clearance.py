"""How far legs and trunk are above a height map, straight down, at instants.

Points on the surfaces of the robot's collision shapes are looked at, where meshes count as lines
from joint to joint and a box for the body. This is for looking: the certificate judges all points
at all times.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.collisions.shapes import robot_shapes
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.height_map import HeightMap

NEAR_FOOT = 3.0
"""Points as near as this to the foot count as the foot, in radii of the foot."""
ALONG, AROUND = 5, 8
"""Points along a line or an edge, and around a cylinder. Chosen: a few centimetres apart."""
MOST_INSTANTS = 2000
"""Most instants that are looked at; between them the values are interpolated. Half a second."""


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points of a robot's links.

    Attributes:
        joints: number of Pinocchio's joint with which each moves ``(m,)``.
        places: in the joint's frame ``(m, 3)`` [m].
        radii: of the ball around each ``(m,)`` [m].
    """

    joints: np.ndarray
    places: FloatArray
    radii: FloatArray


@dataclass(frozen=True, eq=False)
class Clearance:
    """The lowest gap at each instant ``(N,)`` [m], and its upper end ``(N, 3)`` [m]."""

    gap: FloatArray
    place: FloatArray


def clearance_over(
    robot: Quadruped, ground: HeightMap, times: FloatArray, q: FloatArray
) -> Clearance | None:
    """The clearance of configurations ``q (N, nq)`` over a map.

    ``None`` where no instant has known ground below the robot. Places with unknown ground below
    are left out.
    """
    import pinocchio as pin

    points = surface_points(robot)
    chosen = np.unique(np.linspace(0, len(times) - 1, MOST_INSTANTS).round().astype(int))
    data, poses = robot.model.createData(), []
    links, link_of = np.unique(points.joints, return_inverse=True)
    for row in q[chosen]:
        pin.forwardKinematics(robot.model, data, row)
        poses.append([data.oMi[int(link)].homogeneous for link in links])
    moved = np.array(poses)[:, link_of]
    places = moved[..., :3, 3] + np.einsum("nmij,mj->nmi", moved[..., :3, :3], points.places)
    places[..., 2] -= points.radii
    heights = ground.height(places[..., :2])
    gap = np.where(np.isfinite(heights), places[..., 2] - heights, np.inf)
    lowest = gap.argmin(axis=1)
    rows = np.arange(len(chosen))
    gaps = gap[rows, lowest]
    if not np.isfinite(gaps).any():
        return None
    known = np.isfinite(gaps)
    at, nearest = times[chosen][known], places[rows, lowest][known]
    # The nearest point jumps from link to link, so it is not interpolated.
    index = np.clip(np.searchsorted(at, times, side="right") - 1, 0, None)
    return Clearance(np.interp(times, at, gaps[known]), nearest[index])


def surface_points(robot: Quadruped) -> SurfacePoints:
    """Points on the shapes of a robot's links, without those of its feet."""
    shapes, feet = robot_shapes(robot), {}
    for leg in LEGS:
        frame = robot.model.frames[robot.model.getFrameId(robot.legs[leg].foot)]
        feet[int(frame.parentJoint)] = np.array(frame.placement.translation)
    joints, places, radii = [], [], []
    for shape in shapes.geometry.geometryObjects:
        joint = max(int(shape.parentJoint), 1)
        own, radius = _points_of(shape.geometry)
        own = own @ np.asarray(shape.placement.rotation).T + shape.placement.translation
        if joint in feet:
            away = np.linalg.norm(own - feet[joint], axis=1)
            own = own[away > NEAR_FOOT * max(robot.foot_radius, radius)]
        joints += [joint] * len(own)
        places.append(own)
        radii += [radius] * len(own)
    every = np.concatenate(places) if places else np.zeros((0, 3))
    return SurfacePoints(np.array(joints, dtype=int), every, np.array(radii, dtype=np.float64))


def _points_of(solid: Any) -> tuple[FloatArray, float]:
    """Points of a shape of Pinocchio's, in its frame ``(n, 3)`` [m], and the radius around them."""
    part = np.linspace(-1.0, 1.0, ALONG)
    if hasattr(solid, "halfSide"):
        corner = np.array(np.meshgrid(*[part] * 3)).reshape(3, -1).T
        on_surface = np.abs(corner).max(axis=1) == 1.0
        return corner[on_surface] * np.ravel(solid.halfSide), 0.0
    if hasattr(solid, "halfLength"):
        line = np.column_stack([np.zeros((ALONG, 2)), part * solid.halfLength])
        if type(solid).__name__ == "Capsule":
            return line, float(solid.radius)
        angle = 2.0 * np.pi * np.arange(AROUND) / AROUND
        ring = solid.radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(AROUND)])
        return (line[:, None] + ring).reshape(-1, 3), 0.0
    if type(solid).__name__ == "Sphere":
        return np.zeros((1, 3)), float(solid.radius)
    return np.zeros((0, 3)), 0.0
