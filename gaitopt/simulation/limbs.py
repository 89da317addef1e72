"""Limbs and trunk of a simulated robot without shapes of its own: what of them touches the ground.

The shapes are those of the URDF; meshes are their convex hulls where these are known, and otherwise
lines and a box. They touch the ground, and neither one another nor the balls at the feet. What
belongs to a foot is left out, because its ball stands for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.collisions.shapes import robot_shapes
from gaitopt.robots.quadruped import Quadruped

NEAR_FOOT, NEAR_MORE = 1.3, 0.005
"""A shape belongs to a foot, and a contact to its ball, up to this many radii of the foot from the
foot frame, and this much more [m]. Chosen: shapes of feet are balls, or near to the ball that
stands for them; a shin begins farther up."""

BEYOND_FOOT = 0.5
"""A shape that reaches farther than this share of the foot's radius beyond the foot's middle
contains the foot, and is cut there. Chosen: shanks end at the middle of the foot, or before."""

ROUND = 24
"""Corners that stand for a circle where a shape is cut: they lie inside of it by 1 % of its
radius."""

LIMB = "gaitopt limb "
"""Beginning of the names of these shapes."""


class LimbShape(NamedTuple):
    """A shape on a link.

    Attributes:
        joint: Pinocchio's number of the joint that moves the link; 1 for the trunk.
        solid: a primitive of coal's, or corners of a convex solid in the joint's frame ``(n, 3)``.
        place: of a primitive in the joint's frame.
    """

    joint: int
    solid: Any
    place: Any = None


def limb_shapes(robot: Quadruped) -> list[LimbShape]:
    """The robot's collision shapes without those of its feet."""
    feet = _feet(robot)
    out = []
    for shape in _all_shapes(robot):
        foot = feet.get(shape.joint)
        if foot is None:
            out.append(shape)
            continue
        corners = _corners(shape)
        near = NEAR_FOOT * foot.radius + NEAR_MORE
        if np.linalg.norm(corners - foot.middle, axis=1).max() <= near:
            continue
        beyond = (corners - foot.middle) @ foot.along
        if beyond.max() > BEYOND_FOOT * foot.radius:
            shape = LimbShape(shape.joint, _cut(corners, beyond))
        out.append(shape)
    return out


class _Foot(NamedTuple):
    """Middle of a foot in the frame of its last joint, where its leg points, and its radius."""

    middle: FloatArray
    along: FloatArray
    radius: float


def _feet(robot: Quadruped) -> dict[int, _Foot]:
    """The feet by the number of their last joint."""
    model, out = robot.model, {}
    for leg in LEGS:
        joint = int(model.getJointId(robot.legs[leg].joints[-1]))
        frame = model.frames[model.getFrameId(robot.legs[leg].foot)]
        middle = np.array(frame.placement.translation)
        along = middle / np.linalg.norm(middle)
        out[joint] = _Foot(middle, along, robot.foot_radius)
    return out


def _all_shapes(robot: Quadruped) -> Iterator[LimbShape]:
    """Primitives, hulls of meshes, and what replaces meshes without a hull."""
    import pinocchio as pin

    model, hulled = robot.model, set()
    for link, numbers in robot.notes.hulls:
        frame = model.frames[model.getFrameId(link, pin.FrameType.BODY)]
        corners = np.array(numbers, dtype=np.float64).reshape(-1, 3)
        turned = corners @ np.array(frame.placement.rotation).T
        hulled.add(int(frame.parentJoint))
        yield LimbShape(int(frame.parentJoint), turned + frame.placement.translation)
    shapes = robot_shapes(robot)
    for shape in shapes.geometry.geometryObjects:
        joint = int(shape.parentJoint)
        if not (str(shape.name) in shapes.stand_ins and joint in hulled):
            yield LimbShape(joint, shape.geometry, shape.placement)


def _corners(shape: LimbShape) -> FloatArray:
    """Points whose convex hull is the shape, or nearly so ``(n, 3)`` [m], in the joint's frame."""
    solid = shape.solid
    if isinstance(solid, np.ndarray):
        return np.asarray(solid)
    kind = type(solid).__name__
    if kind == "Box":
        local = _signs() * np.array(solid.halfSide)
    else:
        radius, half = float(solid.radius), float(getattr(solid, "halfLength", 0.0))
        # Rings around the axis, also of the caps of a capsule.
        rise = np.array([0.0]) if kind == "Cylinder" else 0.5 * np.pi * np.arange(4) / 3.0
        turns = 2.0 * np.pi * np.arange(ROUND) / ROUND
        rings = [
            radius * np.cos(a) * np.column_stack([np.cos(turns), np.sin(turns), np.zeros(ROUND)])
            + [0.0, 0.0, sign * (half + radius * np.sin(a))]
            for a in rise for sign in (-1.0, 1.0)
        ]  # fmt: skip
        local = np.concatenate(rings)
    return np.asarray(local @ np.array(shape.place.rotation).T + shape.place.translation)


def _signs() -> FloatArray:
    return np.asarray(np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T)


def _cut(corners: FloatArray, beyond: FloatArray) -> FloatArray:
    """The corners of what is left of a convex solid where ``beyond (n,)`` is at most 0.

    Between each corner that stays and each that goes a point is added where the line between them
    is cut; those inside of the hull do no harm.
    """
    kept, gone = beyond <= 0.0, beyond > 0.0
    share = beyond[gone] / (beyond[gone] - beyond[kept][:, None])
    line = corners[kept][:, None] - corners[gone]
    section = corners[gone] + share[..., None] * line
    return np.concatenate([corners[kept], section.reshape(-1, 3)])


def add_limbs(mujoco: Any, spec: Any, robot: Quadruped, links: dict[int, str],
              touches: dict[str, Any]) -> None:  # fmt: skip
    """Add the shapes of limbs and trunk.

    Args:
        mujoco, spec: the package, and the model that is made.
        robot: the robot.
        links: name of the link on each joint, by Pinocchio's number.
        touches: how the shapes touch others.
    """
    for number, (joint, solid, place) in enumerate(limb_shapes(robot)):
        made: dict[str, Any] = {}
        if isinstance(solid, np.ndarray):
            mesh = spec.add_mesh(name=f"gaitopt mesh {number}")
            mesh.uservert = solid.reshape(-1).tolist()
            made["meshname"], kind = mesh.name, "MESH"
        else:
            kind = type(solid).__name__.upper()
            if kind == "CAPSULE" and not solid.halfLength > 0.0:
                kind = "SPHERE"
            half = [getattr(solid, "radius", 0.0), getattr(solid, "halfLength", 0.0), 0.0]
            made["size"] = list(np.array(solid.halfSide)) if kind == "BOX" else half
            made["pos"] = list(np.array(place.translation))
            made["quat"] = _quaternion(place)
        spec.body(links[joint]).add_geom(
            name=f"{LIMB}{number}", type=getattr(mujoco.mjtGeom, f"mjGEOM_{kind}"), mass=0.0,
            **made, **touches,
        )  # fmt: skip


def _quaternion(place: Any) -> list[float]:
    """The turn of a place as a quaternion w, x, y, z."""
    import pinocchio as pin

    turn = pin.Quaternion(place.rotation).coeffs()
    return [float(turn[k]) for k in (3, 0, 1, 2)]
