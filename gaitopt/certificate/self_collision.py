"""Check of self-collision at every instant, by conservative advancement [Mirtich1996].

Two shapes that are ``d`` apart cannot touch before they have moved by ``d`` together, and how far
they move at most is known from the joints' rates. So a pair's distance is computed again only when
that may have happened, and no instant is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike
from pinocchio import coal
from scipy.spatial import ConvexHull, QhullError

from gaitopt.certificate.check import Check, judged, unchecked
from gaitopt.certificate.enclosure import Pieces, chain_to, speed_bound
from gaitopt.certificate.trace import configurations
from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped

NAME = "self-collision"
CONTACT = 1e-4
"""Clearance below which a pair counts as touching [m]. Chosen: far above the errors of coal's
distances, and small against the play of a robot's joints."""
HULL = "(hull "
"""In the names of hulls."""
ROUGH = 2e-3
"""Distance below which a pair with a convex hull is left out, when the robot stands [m]. Chosen: a
hull fills the hollows of its mesh, so that thighs beside a trunk touch it at once; the distances of
robots at hand are 1.3 mm at most or 15 mm at least."""
MOST_ROUNDS = 100_000
"""Most distances of a pair that are computed, at some 20 us each. A walk of 64 steps takes 300 to
500."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two shapes, and how far they can have moved relative to each other over time.

    Attributes:
        index: of the collision pair in Pinocchio's geometry model.
        name: both shapes.
        travelled: bound on the distance moved, at the start and at the end of each piece
            ``(P + 1,)`` [m].
    """

    index: int
    name: str
    travelled: FloatArray


def self_collision(plan: Plan) -> Check:
    """No two links of different legs touch, and no leg touches the body.

    Shapes of one leg, and the body with each leg's first link, are left out: they meet at their
    joints. Meshes count as their convex hulls, where their files were found when the robot was
    loaded. Pairs that overlap when the robot stands square are left out as well, and hulls that are
    less than 2 mm apart then, because there the shapes are too large; the check says which. That
    stance comes from the closed form of the robot's legs (:class:`gaitopt.Leg`), which is held
    against Pinocchio when a robot is loaded.
    """
    geometry = _geometry(plan)
    if geometry is None:
        return unchecked(
            NAME, "m", "collision shapes are meshes whose files were not found when the robot was "
            "loaded, or missing", CONTACT,
        )  # fmt: skip
    pieces = Pieces.of(plan.path)
    pairs = _pairs(plan, geometry, pieces)
    pairs, overlapping = _apart_when_standing(plan, geometry, pairs)
    if not pairs:
        return unchecked(
            NAME, "m", "the URDF has no pair of collision shapes to keep apart", CONTACT
        )
    found, finished = _advance(plan, geometry, pieces, pairs)
    if not finished:
        words = f"some pairs are so near that {MOST_ROUNDS} steps do not lead to the end"
        return unchecked(NAME, "m", words, CONTACT)
    hulls = "; meshes count as their convex hulls" * bool(plan.robot.notes.hulls)
    left_out = f"; left out, as they touch when it stands: {', '.join(overlapping)}"
    return judged(NAME, found.clearance, CONTACT, "m apart", ">=", when=found.when,
                  where=found.name + hulls + left_out * bool(overlapping))  # fmt: skip


def _geometry(plan: Plan) -> Any:
    """Pinocchio's collision shapes; meshes are their convex hulls, which the robot's notes hold.

    ``None`` where there is no hull for a link that has meshes.
    """
    robot, model = plan.robot, plan.robot.model
    if links_without_hulls(robot):
        return None
    text, _ = without_meshes(robot.urdf)
    geometry = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    for number, (link, numbers) in enumerate(robot.notes.hulls):
        index = model.getFrameId(link, pin.FrameType.BODY)
        if index >= model.nframes:
            raise RobotError(f"{robot.name}: there is no link {link!r}, which has a hull")
        frame = model.frames[index]
        name, joint = f"{link} (hull {number})", int(frame.parentJoint)
        solid = pin.GeometryObject(name, joint, frame.placement, convex_solid(numbers))
        geometry.addGeometryObject(solid)
    return geometry


def links_without_hulls(robot: Quadruped) -> tuple[str, ...]:
    """Links with collision meshes whose hulls are not known: with one, nothing can be checked."""
    _, meshed = without_meshes(robot.urdf)
    known = {link for link, _ in robot.notes.hulls}
    return tuple(link for link in meshed if link not in known)


def convex_solid(numbers: ArrayLike) -> Any:
    """A convex solid of coal's, from the coordinates of its corners. It must not be changed.

    Raises:
        RobotError: the corners lie in a plane.
    """
    return _solid(np.asarray(numbers, dtype=np.float64).tobytes())


@lru_cache(maxsize=512)
def _solid(data: bytes) -> Any:
    """The solid of these coordinates; a robot with meshes has some dozens, and is judged often."""
    corners = np.frombuffer(data).reshape(-1, 3)
    try:
        hull = ConvexHull(corners)
    except (QhullError, ValueError) as error:
        raise RobotError(f"a hull of the robot's meshes is flat: {str(error)[:100]}") from error
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(corners[hull.vertices]))
    place = np.zeros(len(corners), dtype=np.intp)
    place[hull.vertices] = np.arange(len(hull.vertices))
    triangles.extend([coal.Triangle(*face) for face in place[hull.simplices].tolist()])
    return coal.Convex(points, triangles)


def _pairs(plan: Plan, geometry: Any, pieces: Pieces) -> list[Pair]:
    """The pairs of shapes that must not touch; they are added to ``geometry``."""
    model = plan.robot.model
    rates = pieces.largest(1)
    moved = [_travelled(model, shape, rates, pieces) for shape in geometry.geometryObjects]
    legs = [_leg_of(model, shape.parentJoint) for shape in geometry.geometryObjects]
    out = []
    for i, first in enumerate(geometry.geometryObjects):
        for j in range(i):
            second = geometry.geometryObjects[j]
            body_and_first_link = 1 in (first.parentJoint, second.parentJoint) and 1 in (
                model.parents[first.parentJoint],
                model.parents[second.parentJoint],
            )
            if legs[i] == legs[j] or body_and_first_link:
                continue
            geometry.addCollisionPair(pin.CollisionPair(j, i))
            name = f"{second.name} and {first.name}"
            out.append(Pair(len(geometry.collisionPairs) - 1, name, moved[i] + moved[j]))
    return out


def _apart_when_standing(
    plan: Plan, geometry: Any, pairs: list[Pair]
) -> tuple[list[Pair], list[str]]:
    """The pairs that are apart when the robot stands square, and the names of the others."""
    robot = plan.robot
    q = np.concatenate([np.zeros(6), [1.0], robot.standing_joints()])
    data = geometry.createData()
    pin.updateGeometryPlacements(robot.model, robot.model.createData(), geometry, data, q)
    apart, overlapping = [], []
    for pair in pairs:
        gap = pin.computeDistance(geometry, data, pair.index).min_distance
        if gap >= (ROUGH if HULL in pair.name else CONTACT):
            apart.append(pair)
        else:
            overlapping.append(pair.name)
    return apart, overlapping


def _leg_of(model: Any, joint: int) -> int:
    """The first joint of the branch that ``joint`` belongs to; 1 for the body."""
    while joint > 1 and model.parents[joint] > 1:
        joint = model.parents[joint]
    return int(joint)


def _travelled(model: Any, shape: Any, rates: FloatArray, pieces: Pieces) -> FloatArray:
    """Bound on how far a shape's points have moved relative to the base ``(P + 1,)`` [m]."""
    shape.geometry.computeLocalAABB()
    radius = float(shape.geometry.aabb_radius)
    centre = shape.placement.act(np.array(shape.geometry.aabb_center))
    chain = chain_to(model, shape.parentJoint, centre, radius)
    moved = speed_bound(chain, rates) * pieces.lengths if chain.columns else 0.0 * pieces.lengths
    return np.concatenate([[0.0], np.cumsum(moved)])


class _Nearest(NamedTuple):
    """The smallest clearance that was computed, or that of the first contact.

    Attributes:
        clearance: of two shapes [m].
        when: it was seen [s].
        name: of the two shapes.
    """

    clearance: float
    when: float
    name: str


def _advance(plan: Plan, geometry: Any, pieces: Pieces, pairs: list[Pair]) -> tuple[_Nearest, bool]:
    """The smallest clearance, and whether all pairs were followed to the end.

    Pairs are followed together: each round computes the distance of every pair once, at a time of
    its own. No pair is followed beyond the first contact, a distance below :data:`CONTACT`.
    """
    model = plan.robot.model
    data, placed = model.createData(), geometry.createData()
    times = np.append(pieces.starts, pieces.starts[-1] + pieces.lengths[-1])
    agenda = [(0.0, pair) for pair in pairs]
    least, contact = _Nearest(np.inf, 0.0, ""), None
    for _ in range(MOST_ROUNDS):
        if not agenda:
            return contact or least, True
        moments = np.array([time for time, _ in agenda])
        ahead = []
        for (time, pair), q in zip(
            agenda, configurations(plan.path.evaluate(moments)), strict=True
        ):
            pin.updateGeometryPlacements(model, data, geometry, placed, q)
            distance = float(pin.computeDistance(geometry, placed, pair.index).min_distance)
            least = min(least, _Nearest(distance, time, pair.name))
            # A comparison with NaN is false.
            if not distance >= CONTACT:
                found = _Nearest(distance, time, pair.name)
                contact = found if contact is None or time < contact.when else contact
                continue
            # Half the clearance that counts as contact makes up for rounding.
            reached = np.interp(time, times, pair.travelled) + distance - CONTACT / 2.0
            if reached < pair.travelled[-1]:
                ahead.append((_time_of(reached, pair.travelled, times), pair))
        agenda = [(t, pair) for t, pair in ahead if contact is None or t < contact.when]
    return contact or least, contact is not None


def _time_of(distance: float, travelled: FloatArray, times: FloatArray) -> float:
    """First time [s] at which the bound on what was ``travelled`` reaches ``distance`` [m]."""
    i = int(np.searchsorted(travelled, distance, side="left"))
    share = (distance - travelled[i - 1]) / (travelled[i] - travelled[i - 1])
    return float(times[i - 1] + share * (times[i] - times[i - 1]))


def without_meshes(urdf: str) -> tuple[str, tuple[str, ...]]:
    """A URDF's text without its collision meshes, and the links that had some."""
    root = ElementTree.fromstring(urdf)
    meshed = []
    for link in root.iter("link"):
        for collision in link.findall("collision"):
            if collision.find("geometry/mesh") is not None:
                link.remove(collision)
                meshed.append(str(link.get("name")))
    return ElementTree.tostring(root, encoding="unicode"), tuple(dict.fromkeys(meshed))
