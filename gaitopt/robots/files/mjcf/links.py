"""Bodies, shapes and limits of a MuJoCo model as elements of a URDF."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.robots.files.masses import add_inertial
from gaitopt.robots.files.origins import Element
from gaitopt.robots.files.shapes import add_capsule, add_geometry, add_solid
from gaitopt.robots.rotations import quaternion_to_matrix

HINGE, SLIDE, BALL, FREE = 3, 2, 1, 0
"""MuJoCo's numbers of the types of joints."""


def body_name(model: Any, body: int) -> str:
    """A body's name, or one made from its number."""
    return str(model.body(body).name) or f"body {body}"


def joint_name(model: Any, joint: int) -> str:
    """A joint's name, or one made from its number."""
    return str(model.joint(joint).name) or f"joint {joint}"


def pose_of(position: Any, quaternion: Any) -> FloatArray:
    """A pose ``(4, 4)`` from a place and a quaternion w x y z."""
    w, x, y, z = (float(v) for v in quaternion)
    out = np.eye(4)
    out[:3, :3] = quaternion_to_matrix([x, y, z, w])
    out[:3, 3] = position
    return out


def add_body_inertial(model: Any, body: int, shift: FloatArray, link: Element) -> None:
    """Add a body's mass and inertia.

    Args:
        model: MuJoCo's.
        body: its number.
        shift: origin of the link in the body's frame ``(3,)`` [m].
        link: the link.
    """
    mass = float(model.body_mass[body])
    if not mass > 0.0:
        return
    place = pose_of(model.body_ipos[body] - shift, model.body_iquat[body])
    moments = np.diag(np.array(model.body_inertia[body], dtype=np.float64))
    add_inertial(link, mass, place[:3, 3], place[:3, :3] @ moments @ place[:3, :3].T)


def add_geom(
    mujoco: Any,
    model: Any,
    geom: int,
    shift: FloatArray,
    link: Element,
    meshes: Mapping[str, tuple[str, str]],
) -> None:
    """Add a shape: as a collision shape where it can touch something, else as a visual one.

    Args:
        mujoco, model: the package, and the model.
        geom: the shape's number.
        shift: origin of the link in the body's frame ``(3,)`` [m].
        link: the link.
        meshes: file and scale of the meshes, by name.
    """
    touches = bool(model.geom_contype[geom] or model.geom_conaffinity[geom])
    tag = "collision" if touches else "visual"
    kind, size = int(model.geom_type[geom]), np.array(model.geom_size[geom], dtype=np.float64)
    place = pose_of(model.geom_pos[geom] - shift, model.geom_quat[geom])
    kinds = mujoco.mjtGeom
    if kind == int(kinds.mjGEOM_SPHERE):
        add_solid(link, tag, place, "sphere", radius=size[0])
    elif kind == int(kinds.mjGEOM_CYLINDER):
        add_solid(link, tag, place, "cylinder", radius=size[0], length=2.0 * size[1])
    elif kind == int(kinds.mjGEOM_CAPSULE):
        add_capsule(link, tag, place, size[0], 2.0 * size[1])
    elif kind in (int(kinds.mjGEOM_BOX), int(kinds.mjGEOM_ELLIPSOID)):
        lengths = " ".join(repr(2.0 * float(s)) for s in size)
        ElementTree.SubElement(add_geometry(link, tag, place), "box", size=lengths)
    elif kind == int(kinds.mjGEOM_MESH):
        number = int(model.geom_dataid[geom])
        found = meshes.get(str(model.mesh(number).name))
        if found is not None:
            # MuJoCo moves a mesh to its centre of mass and turns it to its axes of inertia.
            own = pose_of(model.mesh_pos[number], model.mesh_quat[number])
            geometry = add_geometry(link, tag, place @ np.linalg.inv(own))
            ElementTree.SubElement(geometry, "mesh", filename=found[0], scale=found[1])


def joint_limit(model: Any, joint: int, effort: float, element: Element) -> None:
    """Add a joint's limits, and its damping and friction.

    MJCF knows no velocity limits. The effort limit [N m] is what its actuators state.

    Raises:
        RobotError: one of these is not a finite number.
    """
    low, high = (float(v) for v in model.jnt_range[joint])
    if not model.jnt_limited[joint]:
        low = high = 0.0
    ElementTree.SubElement(element, "limit", lower=repr(low), upper=repr(high),
                           effort=repr(effort), velocity="0")  # fmt: skip
    dof = int(model.jnt_dofadr[joint])
    damping = float(np.ravel(model.dof_damping[dof])[0])
    friction = float(model.dof_frictionloss[dof])
    numbers = {"range": low, "upper range": high, "damping": damping, "frictionloss": friction}
    for name, value in {**numbers, "torque limit": effort}.items():
        if not np.isfinite(value):
            raise RobotError(f"{name} of the joint {joint_name(model, joint)!r} is {value!r}")
    if damping > 0.0 or friction > 0.0:
        ElementTree.SubElement(element, "dynamics", damping=repr(damping), friction=repr(friction))
