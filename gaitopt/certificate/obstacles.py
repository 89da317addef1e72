"""What a certificate says of obstacles: nothing of the robot touches one, at any instant.

A shape and an obstacle come closer no faster than the shape moves. Measured along the way that the
shape can have gone at most, their distance is a function of slope one at most, and its least value
is found to any width by looking where it may lie lowest, until it can lie no lower.
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from pinocchio import coal

from gaitopt.certificate.check import Check, judged
from gaitopt.certificate.enclosure import Pieces, chain_to, speed_bound
from gaitopt.certificate.self_collision import CONTACT, Pair, without_meshes
from gaitopt.certificate.trace import configurations
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.obstacles import Obstacle

NAME = "obstacles cleared"
RESOLUTION = 5e-4
"""How closely the least distance is enclosed [m]."""
ROUNDING = 1e-6
"""How far off a distance of coal's may be [m]."""
FINEST = 1e-6
"""The same where it comes out at the limit [m]."""
SLACK = 5e-6
"""Shortfall of a promised distance that counts as rounding [m]."""
MOST_LOOKS = 200_000
SIDES = 96
"""Tangents that stand for a full turn of a rounded section: 0.06 % of its radius outside it."""
THIN = 0.02
"""Radius of the lines that stand for meshes, where the foot has none [m]."""


def obstacles_cleared(plan: Plan) -> Check | None:
    """No part of the robot comes nearer to an obstacle than the plan says, or touches one.

    The distance is held to ``plan.settings.clearance`` where obstacles come with such a promise.
    The shapes are the collision shapes of the URDF. Where those are meshes, or missing, a leg's
    part is a line between its joints, as thick as the foot, and the body a flat box between the
    hips; the check says so.

    Returns:
        ``worst`` is a lower bound on the distance at all times, and ``bound`` how far it lies below
        the least distance that was seen, at ``when``. ``None`` where the plan knows of no obstacle.
    """
    obstacles = plan.settings.obstacles
    if not obstacles:
        return None
    limit = max(float(getattr(plan.settings, "clearance", 0.0)) - SLACK, CONTACT)
    shapes = robot_shapes(plan.robot)
    pieces = Pieces.of(plan.path)
    pairs = _pairs(plan, shapes, pieces, obstacles)
    found = _least(plan, shapes.geometry, pieces, pairs, limit)
    note = ""
    if shapes.stand_ins:
        note = f"without meshes: lines stand for {', '.join(shapes.stand_ins)}"
    # A table shows the place or the note: who reads it should know of the stand-ins.
    where = f"{found.name} ({note})" if note else found.name
    check = judged(NAME, found.bound, limit, "m apart", ">=", bound=found.seen - found.bound,
                   when=found.when, where=where)  # fmt: skip
    if found.seen >= limit > found.bound:
        note = f"seen {found.seen:.6g} m apart, proven {found.bound:.6g} m of {limit:.6g} m"
        return replace(check, status="unchecked", worst=float("nan"), note=note)
    return replace(check, note=note)


@dataclass(frozen=True, eq=False)
class Shapes:
    """What of a robot can touch an obstacle.

    Attributes:
        geometry: Pinocchio's geometry model.
        links: the link that each of its shapes belongs to.
        stand_ins: links whose own shapes are meshes or missing.
    """

    geometry: Any
    links: tuple[str, ...]
    stand_ins: tuple[str, ...]


def robot_shapes(robot: Quadruped) -> Shapes:
    """The robot's collision shapes, lines and a flat box standing for meshes."""
    model = robot.model
    text, meshed = without_meshes(robot.urdf)
    geometry = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    links = [str(model.frames[shape.parentFrame].name) for shape in geometry.geometryObjects]
    whole = {int(shape.parentJoint) for shape in geometry.geometryObjects}
    whole -= {int(model.frames[model.getFrameId(link, pin.BODY)].parentJoint) for link in meshed}
    stand_ins = []
    for joint, link, shape, placement in _stand_ins(robot):
        if joint not in whole:
            name = f"{link} as a line"
            geometry.addGeometryObject(pin.GeometryObject(name, joint, placement, shape))
            links.append(link)
            stand_ins.append(link)
    return Shapes(geometry, tuple(links), tuple(stand_ins))


def _stand_ins(robot: Quadruped) -> list[tuple[int, str, Any, Any]]:
    """For the body and each part of each leg its joint, its link, and a shape with its place."""
    model = robot.model
    radius = robot.foot_radius or THIN
    hips = np.array([leg.hip for leg in robot.legs.values()])
    low, high = hips.min(axis=0) - radius, hips.max(axis=0) + radius
    middle = pin.SE3(robot.body_axes, robot.body_axes @ ((low + high) / 2.0))
    out = [(1, "the body", coal.Box(*(high - low).tolist()), middle)]
    for leg in LEGS:
        joints = [int(model.getJointId(name)) for name in robot.legs[leg].joints]
        ends = [model.jointPlacements[joint].translation for joint in joints[1:]]
        ends.append(model.frames[model.getFrameId(robot.legs[leg].foot)].placement.translation)
        for joint, end in zip(joints, ends, strict=True):
            length = float(np.linalg.norm(end))
            turn = pin.Quaternion.FromTwoVectors(np.array([0.0, 0.0, 1.0]), np.array(end))
            place = pin.SE3(turn.matrix(), np.array(end) / 2.0)
            out.append((joint, _link(model, joint), coal.Capsule(radius, length), place))
    return out


def _link(model: Any, joint: int) -> str:
    """The first link that a joint moves."""
    return next(
        str(frame.name)
        for frame in model.frames
        if frame.parentJoint == joint and frame.type == pin.BODY
    )


def _pairs(plan: Plan, shapes: Shapes, pieces: Pieces, obstacles: Sequence[Obstacle]) -> list[Pair]:
    """Every shape of the robot with every obstacle."""
    geometry = shapes.geometry
    rates = pieces.largest(1)
    moving = list(geometry.geometryObjects)
    moved = [way_in_world(plan.robot.model, shape, rates, pieces) for shape in moving]
    out = []
    for number, obstacle in enumerate(obstacles, 1):
        name = f"obstacle {number}"
        solid = pin.GeometryObject(name, 0, pin.SE3.Identity(), obstacle_solid(obstacle))
        index = geometry.addGeometryObject(solid)
        beside = "" if len(obstacles) == 1 else f" and {name}"
        for i, way in enumerate(moved):
            geometry.addCollisionPair(pin.CollisionPair(i, index))
            pair = len(geometry.collisionPairs) - 1
            out.append(Pair(pair, f"{shapes.links[i]}{beside}", way))
    return out


def obstacle_solid(obstacle: Obstacle) -> Any:
    """An obstacle as a convex solid of coal's, in the world; around it where it is rounded."""
    vertices, faces = obstacle.mesh(SIDES)
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(vertices))
    triangles.extend([coal.Triangle(*face) for face in faces.tolist()])
    return coal.Convex(points, triangles)


def way_in_world(model: Any, shape: Any, rates: FloatArray, pieces: Pieces) -> FloatArray:
    """Bound on the way of a shape's points in the world up to each piece's end ``(P + 1,)``."""
    shape.geometry.computeLocalAABB()
    radius = float(shape.geometry.aabb_radius)
    centre = shape.placement.act(np.array(shape.geometry.aabb_center))
    chain = chain_to(model, shape.parentJoint, centre, radius)
    base = np.linalg.norm(rates[:, :3], axis=1) + chain.base * rates[:, 3:6].sum(axis=1)
    way = (base + speed_bound(chain, rates)) * pieces.lengths
    return np.concatenate([[0.0], np.cumsum(way)])


class _Least(NamedTuple):
    """The least distance that was seen [m], when [s], of what; no distance is below ``bound``."""

    seen: float
    when: float
    name: str
    bound: float


class _Stretch(NamedTuple):
    """A stretch of a pair's way, ``start`` to ``end``, the distances there, and how low between."""

    lowest: float
    pair: int
    start: float
    end: float
    at_start: float
    at_end: float

    @classmethod
    def of(cls, pair: int, start: float, end: float, at_start: float, at_end: float) -> _Stretch:
        return cls((at_start + at_end - (end - start)) / 2.0, pair, start, end, at_start, at_end)


class _Looks:
    """Looks at one pair at one place of its way, and remembers the nearest that was seen."""

    def __init__(self, plan: Plan, geometry: Any, pieces: Pieces, pairs: list[Pair]) -> None:
        self._plan, self._geometry, self._pairs = plan, geometry, pairs
        self._data, self._placed = plan.robot.model.createData(), geometry.createData()
        self._times = np.append(pieces.starts, pieces.starts[-1] + pieces.lengths[-1])
        self.best = _Least(np.inf, 0.0, "", np.inf)

    def distance(self, k: int, way: float) -> float:
        """Distance of pair ``k`` [m] where its shape has gone ``way`` at most."""
        pair, model = self._pairs[k], self._plan.robot.model
        time = float(np.interp(way, pair.travelled, self._times))
        q = configurations(self._plan.path.evaluate([time]))[0]
        pin.updateGeometryPlacements(model, self._data, self._geometry, self._placed, q)
        found = pin.computeDistance(self._geometry, self._placed, pair.index)
        distance = float(found.min_distance)
        if distance < self.best.seen:
            self.best = _Least(distance, time, pair.name, distance)
        return distance

    def whole(self, k: int) -> _Stretch:
        """All of the way of pair ``k``."""
        end = float(self._pairs[k].travelled[-1])
        return _Stretch.of(k, 0.0, end, self.distance(k, 0.0), self.distance(k, end))


def _least(plan: Plan, geometry: Any, pieces: Pieces, pairs: list[Pair], limit: float) -> _Least:
    """The least distance of all pairs, enclosed to :data:`RESOLUTION`; closer near the limit."""
    looks = _Looks(plan, geometry, pieces, pairs)
    agenda = [looks.whole(k) for k in range(len(pairs))]
    heapq.heapify(agenda)
    for _ in range(MOST_LOOKS):
        low = agenda[0]
        if looks.best.seen - low.lowest <= _width(looks.best.seen, limit):
            break
        heapq.heappop(agenda)
        # Where the two slopes from the ends meet is where the distance may be lowest.
        middle = (low.start + low.end + low.at_start - low.at_end) / 2.0
        middle = min(max(middle, low.start), low.end)
        at_middle = looks.distance(low.pair, middle)
        for start, end, a, b in ((low.start, middle, low.at_start, at_middle),
                                 (middle, low.end, at_middle, low.at_end)):  # fmt: skip
            heapq.heappush(agenda, _Stretch.of(low.pair, start, end, a, b))
    best = looks.best
    return best._replace(bound=min(agenda[0].lowest, best.seen) - ROUNDING)


def _width(seen: float, limit: float) -> float:
    """How closely to enclose: near the limit closely enough to tell whether it is kept."""
    if seen < limit:
        return RESOLUTION
    return min(RESOLUTION, max(seen - limit - ROUNDING, FINEST))
