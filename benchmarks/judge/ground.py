"""Checks of the ground and of collisions: the feet's balls, points of limbs, pairs of shapes."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from benchmarks.judge.motion import Finding, Motion, at_least, at_most
from gaitopt import LEGS
from gaitopt.conventions import FloatArray

TOUCHING, SUNK, AT_ENDS = 1e-3, 1e-5, 5e-4
"""Limits for standing feet, limbs, and flying feet near their footholds [m]."""
APART = 1e-4
"""Least distance of shapes from one another and from obstacles [m]."""
OWN_BALL = 1.25
"""Parts of a leg within so many radii of the foot's centre are the foot."""
POSES = 150
"""Poses at which limbs are looked at."""
ROUNDING = 1e-6
"""Of distances [m]; chosen here."""


def gaps(motion: Motion, points: FloatArray, radius: float) -> FloatArray | None:
    """How far balls about ``points (N, 3)`` are above the ground [m]; ``None`` if none is known.

    Above columns the exact distance. Above a map the vertical distance of the ball from points
    below it, which is not less than the distance, and has the same sign but for the grid.
    """
    footholds, robot = motion.plan.footholds, motion.robot
    if footholds.ground is not None:
        steps = np.linspace(-1.0, 1.0, 13) * radius
        aside = np.array([(x, y) for x in steps for y in steps if np.hypot(x, y) <= radius])
        lower = np.sqrt(np.maximum(radius**2 - (aside**2).sum(axis=1), 0.0))
        places = points[:, None, :2] + aside
        heights = footholds.ground.height(places.reshape(-1, 2)).reshape(places.shape[:2])
        return np.asarray((points[:, None, 2] - lower - heights).min(axis=1))
    if footholds.radius is None:
        return None
    least = np.full(len(points), np.inf)
    for leg in LEGS:
        for top in footholds[leg] - np.array([0.0, 0.0, robot.foot_radius]):
            aside = np.hypot(*(points[:, :2] - top[:2]).T) - footholds.radius
            above = points[:, 2] - top[2]
            outside = np.hypot(np.maximum(aside, 0.0), np.maximum(above, 0.0))
            inside = np.minimum(np.maximum(aside, above), 0.0)
            least = np.minimum(least, outside + inside)
    return least - radius


def feet_and_ground(motion: Motion) -> list[Finding]:
    """Standing feet touch the ground, and flying ones are clear of it."""
    radius, plan = motion.robot.foot_radius, motion.plan
    off, clear, stands, flies = [], [], [], []
    every = max(1, len(motion.times) // 1500) if plan.footholds.ground is not None else 1
    for i, leg in enumerate(LEGS):
        gap = gaps(motion, motion.feet[::every, i], radius)
        if gap is None or radius == 0.0:
            return []
        for start, end, _ in motion.stances(leg):
            here = motion.during(start, end)[::every]
            # Both ends count also where a foot stands for no time at all.
            feet = motion.places(plan.path.evaluate([start, end]))[0][:, i]
            ends = gaps(motion, feet, radius)
            off.append(np.abs(np.append(gap[here], ends)).max())
            stands.append(f"{leg}, {start:.3f} to {end:.3f} s")
        for swing in (s for s in plan.swings if s.leg == leg):
            here = motion.during(swing.start, swing.end)[::every]
            feet = motion.feet[::every, i][here]
            near = np.minimum(*(np.linalg.norm(feet - end, axis=1)
                                for end in (swing.foot_start, swing.foot_end)))  # fmt: skip
            allowed = np.where(near <= radius, AT_ENDS, 0.0)
            clear.append((gap[here] + allowed).min(initial=np.inf))
            flies.append(f"{leg}, {swing.start:.3f} to {swing.end:.3f} s")
    return [
        at_most("feet on the ground", off, TOUCHING, stands),
        at_least("flying feet clear of the ground", clear, -ROUNDING, flies),
    ]


def limbs(motion: Motion) -> list[Finding]:
    """Points on shapes against ground and obstacles, and pairs of shapes against one another."""
    geometry = _shapes(motion)
    poses = np.unique(np.linspace(0, len(motion.times) - 1, POSES).astype(int))
    ground, obstacles = [], []
    when = [f"{motion.times[k]:.3f} s" for k in poses]
    data = geometry.createData()
    clouds = [_surface(shape.geometry) for shape in geometry.geometryObjects]
    in_the_way = motion.plan.settings.obstacles
    footholds = motion.plan.footholds
    highest = (
        footholds.array[..., 2].max()
        if footholds.ground is None
        else (footholds.ground.height_range[1])
    )
    for k in poses:
        q = motion.configuration(motion.values[k])
        pin.updateGeometryPlacements(motion.model, motion.data, geometry, data, q)
        points = [motion.feet[k]]
        for place, cloud in zip(data.oMg, clouds, strict=True):
            points.append(cloud @ place.rotation.T + place.translation)
        joined = np.concatenate(points)
        low = joined[joined[:, 2] < highest]
        away = np.linalg.norm(low[:, None] - motion.feet[k], axis=2).min(axis=1)
        outer = low[away > OWN_BALL * motion.robot.foot_radius]
        found = gaps(motion, outer, 0.0) if len(outer) and motion.robot.foot_radius else None
        if found is not None:
            ground.append(float(found.min()))
        for obstacle in in_the_way:
            balls = obstacle.distance(motion.feet[k]) - motion.robot.foot_radius
            others = obstacle.distance(joined)
            obstacles.append(min(float(balls.min()), float(others.min())))
    out = [] if not ground else [
        at_least("legs and trunk clear of the ground", ground, -SUNK - ROUNDING, when)]  # fmt: skip
    if obstacles:
        out.append(at_least("obstacles cleared", obstacles, APART - ROUNDING, "some pose"))
    return [*out, *_pairs(motion, geometry, poses)]


def _pairs(motion: Motion, geometry: pin.GeometryModel, poses: np.ndarray) -> list[Finding]:
    """Distances between legs, and between legs and body, that do not touch in the standing pose."""
    owner = {motion.model.getJointId(name): leg
             for leg in LEGS for name in motion.robot.legs[leg].joints}  # fmt: skip
    of = [owner.get(shape.parentJoint, "") for shape in geometry.geometryObjects]
    for i in range(len(of)):
        for j in range(i):
            if of[i] != of[j]:
                geometry.addCollisionPair(pin.CollisionPair(j, i))
    if not len(geometry.collisionPairs):
        return []
    data, rest = geometry.createData(), np.zeros(motion.model.nq)
    rest[6], rest[7:] = 1.0, motion.robot.standing_joints()
    least = [np.inf] * len(geometry.collisionPairs)
    pin.computeDistances(motion.model, motion.data, geometry, data, rest)
    apart = [result.min_distance > APART for result in data.distanceResults]
    for k in poses:
        q = motion.configuration(motion.values[k])
        pin.computeDistances(motion.model, motion.data, geometry, data, q)
        least = [min(a, r.min_distance) for a, r in zip(least, data.distanceResults, strict=True)]
    names = [shape.name for shape in geometry.geometryObjects]
    pairs = [f"{names[p.first]}, {names[p.second]}" for p in geometry.collisionPairs]
    kept = [n for n, free in enumerate(apart) if free]
    return [at_least("self-collision", [least[n] for n in kept], APART - ROUNDING,
                     [pairs[n] for n in kept])]  # fmt: skip


def _shapes(motion: Motion) -> pin.GeometryModel:
    """The boxes, cylinders and balls of the URDF; meshes are left out."""
    root = ElementTree.fromstring(motion.robot.urdf)
    for link in root.iter("link"):
        for shape in link.findall("collision"):
            if shape.find("geometry/mesh") is not None:
                link.remove(shape)
    text = ElementTree.tostring(root, encoding="unicode")
    return pin.buildGeomFromUrdfString(motion.model, text, pin.GeometryType.COLLISION)


def _surface(shape: object) -> FloatArray:
    """Points on the surface of a box, cylinder or ball ``(N, 3)``, in its own frame."""
    kind = type(shape).__name__
    turns = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    if kind == "Box":
        line = np.linspace(-1.0, 1.0, 9)
        grid = np.array([(x, y, z) for x in line for y in line for z in line])
        return np.asarray(grid[np.abs(grid).max(axis=1) == 1.0] * shape.halfSide)  # type: ignore[attr-defined]
    if kind in ("Cylinder", "Capsule"):
        radius, half = shape.radius, shape.halfLength  # type: ignore[attr-defined]
        return np.array([(radius * np.cos(t), radius * np.sin(t), z)
                         for t in turns for z in np.linspace(-half, half, 25)])  # fmt: skip
    if kind == "Sphere":
        heights = np.linspace(-1.0, 1.0, 13)
        return (
            np.array(
                [
                    (np.sqrt(1 - h * h) * np.cos(t), np.sqrt(1 - h * h) * np.sin(t), h)
                    for t in turns
                    for h in heights
                ]
            )
            * shape.radius
        )  # type: ignore[attr-defined]
    return np.empty((0, 3))
