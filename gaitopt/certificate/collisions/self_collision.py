"""Check of self-collision at every instant: which shapes a robot has, and which may not touch.

:mod:`gaitopt.certificate.collisions.pair_search` looks for the smallest clearance.
"""

from __future__ import annotations

from collections import Counter
from functools import lru_cache
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike
from pinocchio import coal

from gaitopt.certificate.check import Check, judged, unchecked
from gaitopt.certificate.collisions.pair_search import CONTACT, MOST_ROUNDS, Pair, PairSearch
from gaitopt.certificate.enclosure import Pieces, chain_to, speed_bound
from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped

NAME = "self-collision"
HULL = "(hull "
"""In the names of hulls."""
ROUGH = 2e-3
"""Distance below which a pair with a convex hull is left out, when the robot stands [m]. Chosen: a
hull fills the hollows of its mesh, so that thighs beside a trunk touch it at once; the distances of
robots at hand are 1.3 mm at most or 15 mm at least."""


def self_collision(plan: Plan) -> Check:
    """No two links of different legs touch, and no leg touches the body.

    Shapes of one leg, and the body with each leg's first link, are left out: they meet at their
    joints. Meshes count as their convex hulls, where their files were found when the robot was
    loaded; a trunk's mesh counts as hulls of its parts where one hull is much larger. Pairs that
    overlap when the robot stands square are left out as well, and hulls that are less than 2 mm
    apart then, because there the shapes are too large; the check says which. That stance comes from
    the closed form of the robot's legs (:class:`gaitopt.Leg`), which is held against Pinocchio when
    a robot is loaded.
    """
    geometry = _geometry(plan)
    if geometry is None:
        return unchecked(
            NAME, "m", "collision shapes are meshes whose files were not found when the robot was "
            "loaded, or missing", CONTACT,
        )  # fmt: skip
    pieces = Pieces.of(plan.path)
    pairs, overlapping = _apart_when_standing(plan, geometry, _pairs(plan, geometry))
    if not pairs:
        return unchecked(
            NAME, "m", "the URDF has no pair of collision shapes to keep apart", CONTACT
        )
    moved = _moved(plan.robot.model, geometry, pieces)
    found, finished = PairSearch(plan, geometry, pieces, pairs, moved).run()
    if not finished:
        words = f"some pairs are so near that {MOST_ROUNDS} steps do not lead to the end"
        return unchecked(NAME, "m", words, CONTACT)
    words = words_of_hulls(plan.robot)
    hulls = f"; {words}" * bool(words)
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


def words_of_hulls(robot: Quadruped) -> str:
    """How meshes count; empty where there are none.

    A link with more hulls than meshes has some that were cut, because one hull is much larger.
    """
    hulls = Counter(link for link, _ in robot.notes.hulls)
    meshes = Counter(
        link.get("name")
        for link in ElementTree.fromstring(robot.urdf).iter("link")
        for _ in link.iterfind("collision/geometry/mesh")
    )
    cut = [f"{link} in {n} parts" for link, n in hulls.items() if n > max(meshes[link], 1)]
    parts = f", those of {' and '.join(cut)}" if cut else ""
    return f"meshes count as their convex hulls{parts}" if hulls else ""


def convex_solid(numbers: ArrayLike) -> Any:
    """A convex solid of coal's, from the coordinates of its corners. It must not be changed.

    Raises:
        RobotError: the corners lie in a plane.
    """
    return _solid(np.asarray(numbers, dtype=np.float64).tobytes())


@lru_cache(maxsize=512)
def _solid(data: bytes) -> Any:
    """The solid of these coordinates; a robot with meshes has some dozens, and is judged often."""
    from scipy.spatial import ConvexHull, QhullError  # late: few robots have meshes

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


def _pairs(plan: Plan, geometry: Any) -> list[Pair]:
    """The pairs of shapes that must not touch; they are added to ``geometry``."""
    model, shapes = plan.robot.model, list(geometry.geometryObjects)
    joints = [int(shape.parentJoint) for shape in shapes]
    above = [int(model.parents[joint]) for joint in joints]
    legs = [_leg_of(model, joint) for joint in joints]
    names = [shape.name for shape in shapes]
    out: list[Pair] = []
    for i in range(len(shapes)):
        for j in range(i):
            body_and_first_link = 1 in (joints[i], joints[j]) and 1 in (above[i], above[j])
            if legs[i] == legs[j] or body_and_first_link:
                continue
            geometry.addCollisionPair(pin.CollisionPair(j, i))
            out.append(Pair(len(out), f"{names[j]} and {names[i]}", (j, i)))
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
        gap = pin.computeDistance(geometry, data, pair.number).min_distance
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


def _moved(model: Any, geometry: Any, pieces: Pieces) -> FloatArray:
    """Bounds on how far shapes have moved relative to the base at knots ``(S, P + 1)`` [m]."""
    rates = pieces.largest(1)
    out = np.zeros((len(geometry.geometryObjects), len(pieces.starts) + 1))
    for row, shape in zip(out, geometry.geometryObjects, strict=True):
        shape.geometry.computeLocalAABB()
        radius = float(shape.geometry.aabb_radius)
        centre = shape.placement.act(np.array(shape.geometry.aabb_center))
        chain = chain_to(model, shape.parentJoint, centre, radius)
        if chain.columns:
            np.cumsum(speed_bound(chain, rates) * pieces.lengths, out=row[1:])
    return out


@lru_cache(maxsize=8)
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
