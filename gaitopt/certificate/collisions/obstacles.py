"""Check of obstacles: no part of the robot comes too near to one, at any instant.

A shape and an obstacle come closer no faster than the shape moves. Let ``w`` be how far the shape
can have moved at most since the start. As a function of ``w`` their distance has slopes between -1
and 1, so two values bound it from below on the interval between them. The interval with the lowest
bound is halved where the bound is lowest, until bound and least distance are close [Shubert1972].
"""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from pinocchio import coal

from gaitopt.certificate.check import Check, Verdict, judged
from gaitopt.certificate.collisions.pair_search import CONTACT
from gaitopt.certificate.collisions.self_collision import without_meshes
from gaitopt.certificate.enclosure import Pieces, chain_to, speed_bound
from gaitopt.certificate.placements import configurations
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.obstacles import Obstacle

NAME = "obstacles cleared"
RESOLUTION = 5e-4
"""How closely the least distance is enclosed [m]. Chosen: half a millimetre more or less is of no
interest where the distance is far from its limit."""
ROUNDING = 1e-6
"""How far off a distance of coal's may be [m]: its solver (GJK) stops at this tolerance."""
FINEST = 1e-6
"""How closely the least distance is enclosed where it lies at the limit [m]: not finer than
:data:`ROUNDING`."""
SLACK = 5e-6
"""Shortfall of a promised distance that counts as rounding [m]: :data:`ROUNDING`, :data:`FINEST`,
and what the planner's own search leaves open, rounded up."""
MOST_QUERIES = 200_000
"""Most distances that are computed. Walks over a board take some 10 000."""
SIDES = 96
"""Tangents that replace a full turn of a rounded section: it grows by 0.06 % of its radius at most,
``1 / cos(pi / 96) - 1``."""
THIN = 0.02
"""Radius of the lines that replace meshes, where the foot is no ball [m]. Chosen: about that of the
feet and shanks of the robots at hand."""


@dataclass(frozen=True, eq=False)
class Pair:
    """A shape and an obstacle, and how far the shape can have moved over time.

    Attributes:
        index: of the collision pair in Pinocchio's geometry model.
        name: of the shape, and of the obstacle where there are several.
        travelled: bound on the distance moved, at the start and at the end of each piece
            ``(P + 1,)`` [m].
    """

    index: int
    name: str
    travelled: FloatArray


def obstacles_cleared(plan: Plan) -> Check | None:
    """No part of the robot comes nearer to an obstacle than the plan says, or touches one.

    The shapes are the collision shapes of the URDF. Where those are meshes, or missing, a leg's
    part counts as a line between its joints, as thick as the foot, and the body as a flat box
    between the hips; the check says so.

    Returns:
        A check whose ``worst`` is a lower bound on the distance at all times, and whose ``bound``
        tells how far that lies below the least distance that was computed, at ``when``. ``None``
        where the plan knows of no obstacle.
    """
    if not plan.settings.obstacles:
        return None
    limit = max(plan.settings.obstacle_clearance - SLACK, CONTACT)
    shapes = robot_shapes(plan.robot)
    pieces = Pieces.of(plan.path)
    pairs = _pairs(plan, shapes, pieces, plan.settings.obstacles)
    found = _least(plan, shapes.geometry, pieces, pairs, limit)
    note = ""
    if shapes.stand_ins:
        note = f"without meshes: lines stand for {', '.join(shapes.stand_ins)}"
    # A table shows the place or the note, and its reader should know of the stand-ins.
    where = f"{found.name} ({note})" if note else found.name
    check = judged(NAME, found.bound, limit, "m apart", ">=", bound=found.seen - found.bound,
                   when=found.when, where=where)  # fmt: skip
    if found.seen >= limit > found.bound:
        note = f"seen {found.seen:.6g} m apart, proven {found.bound:.6g} m of {limit:.6g} m"
        return replace(check, status=Verdict.UNCHECKED, worst=float("nan"), note=note)
    return replace(check, note=note)


@dataclass(frozen=True, eq=False)
class Shapes:
    """What of a robot can touch an obstacle.

    Attributes:
        geometry: Pinocchio's geometry model.
        links: the link that each of its shapes belongs to.
        stand_ins: links whose own shapes are meshes or missing, and are replaced.
    """

    geometry: Any
    links: tuple[str, ...]
    stand_ins: tuple[str, ...]


def robot_shapes(robot: Quadruped) -> Shapes:
    """The robot's collision shapes, with lines and a flat box in place of meshes.

    :mod:`gaitopt.robots.collisions.shapes` makes such shapes for the planners. The certificate
    keeps its own on purpose: a mistake in the planners' shapes is not repeated here.
    """
    model = robot.model
    text, meshed = without_meshes(robot.urdf)
    geometry = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    links = [str(model.frames[shape.parentFrame].name) for shape in geometry.geometryObjects]
    whole = {int(shape.parentJoint) for shape in geometry.geometryObjects}
    whole -= {int(model.frames[model.getFrameId(link, pin.BODY)].parentJoint) for link in meshed}
    stand_ins = []
    for joint, link, shape, placement in stand_in_shapes(robot):
        if joint not in whole:
            name = f"{link} as a line"
            geometry.addGeometryObject(pin.GeometryObject(name, joint, placement, shape))
            links.append(link)
            stand_ins.append(link)
    return Shapes(geometry, tuple(links), tuple(stand_ins))


def stand_in_shapes(robot: Quadruped) -> list[tuple[int, str, Any, Any]]:
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
    moved = [distance_moved(plan.robot.model, shape, rates, pieces) for shape in moving]
    out = []
    for number, obstacle in enumerate(obstacles, 1):
        name = f"obstacle {number}"
        solid = pin.GeometryObject(name, 0, pin.SE3.Identity(), obstacle_solid(obstacle))
        index = geometry.addGeometryObject(solid)
        beside = "" if len(obstacles) == 1 else f" and {name}"
        for i, travelled in enumerate(moved):
            geometry.addCollisionPair(pin.CollisionPair(i, index))
            pair = len(geometry.collisionPairs) - 1
            out.append(Pair(pair, f"{shapes.links[i]}{beside}", travelled))
    return out


def obstacle_solid(obstacle: Obstacle) -> Any:
    """An obstacle as a convex solid of coal's, in the world; a rounded one lies within it."""
    vertices, faces = obstacle.mesh(SIDES)
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(vertices))
    triangles.extend([coal.Triangle(*face) for face in faces.tolist()])
    return coal.Convex(points, triangles)


def distance_moved(model: Any, shape: Any, rates: FloatArray, pieces: Pieces) -> FloatArray:
    """Bound on how far a shape's points have moved in the world, up to each knot ``(P + 1,)`` [m].

    Args:
        model, shape: Pinocchio's.
        rates: largest first derivatives of all columns ``(P, n)``.
        pieces: of the path.
    """
    shape.geometry.computeLocalAABB()
    radius = float(shape.geometry.aabb_radius)
    centre = shape.placement.act(np.array(shape.geometry.aabb_center))
    chain = chain_to(model, shape.parentJoint, centre, radius)
    base = np.linalg.norm(rates[:, :3], axis=1) + chain.base * rates[:, 3:6].sum(axis=1)
    moved = (base + speed_bound(chain, rates)) * pieces.lengths
    return np.concatenate([[0.0], np.cumsum(moved)])


class _Least(NamedTuple):
    """The least distance of all pairs.

    Attributes:
        seen: the least that was computed [m].
        when: at which time [s].
        name: of which pair.
        bound: lower bound on the distance of all pairs at all times [m].
    """

    seen: float
    when: float
    name: str
    bound: float


class _Interval(NamedTuple):
    """An interval of how far a pair's shape can have moved, and the pair's distances at its ends.

    Attributes:
        lowest: lower bound on the distance in between [m]; first, so that a heap sorts by it.
        pair: index of the pair.
        start, end: the interval [m].
        at_start, at_end: distances there [m].
    """

    lowest: float
    pair: int
    start: float
    end: float
    at_start: float
    at_end: float

    @classmethod
    def of(cls, pair: int, start: float, end: float, at_start: float, at_end: float) -> _Interval:
        """The interval with its bound: where lines of slope -1 and 1 from its ends meet."""
        return cls((at_start + at_end - (end - start)) / 2.0, pair, start, end, at_start, at_end)

    @property
    def middle(self) -> float:
        """Where the distance may be lowest, within the interval [m]."""
        meeting = (self.start + self.end + self.at_start - self.at_end) / 2.0
        return min(max(meeting, self.start), self.end)


class _Distances:
    """Computes the distances of pairs, and remembers the least.

    Attributes:
        best: the least distance so far.
    """

    def __init__(self, plan: Plan, geometry: Any, pieces: Pieces, pairs: list[Pair]) -> None:
        self._plan, self._geometry, self._pairs = plan, geometry, pairs
        self._data, self._placed = plan.robot.model.createData(), geometry.createData()
        self._times = np.append(pieces.starts, pieces.starts[-1] + pieces.lengths[-1])
        self.best = _Least(np.inf, 0.0, "", np.inf)

    def distance(self, k: int, moved: float) -> float:
        """Distance of pair ``k`` [m] when its shape can have ``moved`` so far [m]."""
        pair, model = self._pairs[k], self._plan.robot.model
        time = float(np.interp(moved, pair.travelled, self._times))
        q = configurations(self._plan.path.evaluate([time]))[0]
        pin.updateGeometryPlacements(model, self._data, self._geometry, self._placed, q)
        found = pin.computeDistance(self._geometry, self._placed, pair.index)
        distance = float(found.min_distance)
        if distance < self.best.seen:
            self.best = _Least(distance, time, pair.name, distance)
        return distance

    def whole(self, k: int) -> _Interval:
        """The whole walk of pair ``k`` as one interval."""
        end = float(self._pairs[k].travelled[-1])
        return _Interval.of(k, 0.0, end, self.distance(k, 0.0), self.distance(k, end))


def _least(plan: Plan, geometry: Any, pieces: Pieces, pairs: list[Pair], limit: float) -> _Least:
    """The least distance of all pairs, enclosed to :data:`RESOLUTION`; closer near the limit."""
    distances = _Distances(plan, geometry, pieces, pairs)
    agenda = [distances.whole(k) for k in range(len(pairs))]
    heapq.heapify(agenda)
    for _ in range(MOST_QUERIES):
        low = agenda[0]
        if distances.best.seen - low.lowest <= _width(distances.best.seen, limit):
            break
        heapq.heappop(agenda)
        middle = low.middle
        at_middle = distances.distance(low.pair, middle)
        for start, end, a, b in ((low.start, middle, low.at_start, at_middle),
                                 (middle, low.end, at_middle, low.at_end)):  # fmt: skip
            heapq.heappush(agenda, _Interval.of(low.pair, start, end, a, b))
    best = distances.best
    return best._replace(bound=min(agenda[0].lowest, best.seen) - ROUNDING)


def _width(seen: float, limit: float) -> float:
    """How closely to enclose [m]: near the limit closely enough to tell whether it is kept."""
    if seen < limit:
        return RESOLUTION
    return min(RESOLUTION, max(seen - limit - ROUNDING, FINEST))
