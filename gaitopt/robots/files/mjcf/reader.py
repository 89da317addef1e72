"""MJCF, the models of MuJoCo, read by MuJoCo itself and written as a URDF.

MuJoCo's own reader knows everything that an MJCF may hold: default classes, angles in degrees,
frames, inertias that follow from shapes. What it makes of the file is written down link by link,
and the URDF's kinematics and masses are compared with MuJoCo's.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import MissingPackageError, RobotError
from gaitopt.robots.files.masses import add_inertial
from gaitopt.robots.files.meshes import MeshFinder
from gaitopt.robots.files.mjcf.actuators import motor_of
from gaitopt.robots.files.mjcf.check import AGREEMENT, disagreement, refuse_disagreement
from gaitopt.robots.files.mjcf.compiled import compiled
from gaitopt.robots.files.mjcf.links import (
    BALL,
    FREE,
    HINGE,
    SLIDE,
    add_body_inertial,
    add_geom,
    body_name,
    joint_limit,
    joint_name,
    pose_of,
)
from gaitopt.robots.files.mjcf.text import MjcfText
from gaitopt.robots.files.mjcf.touching import touching_shapes
from gaitopt.robots.files.notes import Notes, first_of
from gaitopt.robots.files.options import ReadOptions
from gaitopt.robots.files.origins import rotation_about, set_origin
from gaitopt.robots.files.prepare import prepared_urdf

PART_MASS, PART_SIZE = 1e-9, 0.01
"""Mass [kg] and size [m] of a link between two joints of the same body, which is nothing: other
readers refuse links that move and have no mass. Chosen: far less than any part of a robot."""
STANDING = ("home", "stand", "init")
"""Words in the names of key frames in which a robot stands."""


def read_mjcf(
    text: str, label: str, folder: Path | None, options: ReadOptions
) -> tuple[str, Notes]:
    """The URDF of the robot in an MJCF, made ready, and what was read and guessed.

    Raises:
        MissingPackageError: MuJoCo is not installed.
        RobotError: the file cannot be read, or holds no robot.
    """
    try:
        import mujoco
    except ImportError as error:
        raise MissingPackageError(
            f"{label} is MJCF; reading it needs the package mujoco: pip install 'gaitopt[sim]'"
        ) from error
    cleaned = MjcfText(text, label, folder, MeshFinder(folder, options.package_folders))
    model = compiled(mujoco, cleaned, label)
    writer = _Writer(mujoco, model, cleaned, label)
    written = writer.write()
    try:
        urdf, notes = prepared_urdf(*written, label, folder, options)
    except RobotError:
        writer.refuse_loops({})  # which may be why there are no four legs
        raise
    writer.refuse_loops(notes.locked)
    how: Any = {"locked": notes.locked, "masses": options.masses is None}
    if disagreement(mujoco, model, writer.base, urdf, **how) > AGREEMENT:
        # Axes that were made square differ from MuJoCo's: those of the file may not.
        exact, _ = prepared_urdf(*written, label, folder, options, square=False)
        refuse_disagreement(disagreement(mujoco, model, writer.base, exact, **how), label)
    return urdf, notes


class _Writer:
    """Writes a MuJoCo model as a URDF."""

    def __init__(self, mujoco: Any, model: Any, cleaned: MjcfText, label: str) -> None:
        self.mujoco, self.model, self.cleaned, self.label = mujoco, model, cleaned, label
        self.root = ElementTree.Element("robot", name=cleaned.name or label)
        # Where the frame of a body's link is in the body's frame: at the joint.
        self.shifts: dict[int, FloatArray] = {}
        self.armature: dict[str, float] = {}
        self.torque_lines: dict[str, tuple[float, float]] = {}
        self.base = self._base()

    def write(self) -> tuple[str, Notes]:
        """The URDF, and notes."""
        model, base = self.model, self.base
        self.shifts[base] = np.zeros(3)
        self._add_link(base)
        for body in range(base + 1, model.nbody):
            if self._below(body, base):
                self._add_body(body)
        done = f"MuJoCo read this MJCF; the body is {body_name(model, base)}"
        missing = self.cleaned.missing
        many, them = (
            ("1 mesh is", "it") if len(missing) == 1 else (f"{len(missing)} meshes are", "them")
        )
        lost = (
            f"{many} missing ({first_of(missing)}): shapes made of {them} are left out; put {them} "
            "where the file says (git lfs pull, if Git LFS keeps them), or give package_folders="
        )
        lines = f"the torques of {first_of(list(self.torque_lines))} fall with the speed, by their "
        told = (f"{lines}actuators' gain and bias",) if self.torque_lines else ()
        notes = Notes(
            kind="mjcf", standing=self._standing(), armature=self.armature,
            torque_lines=self.torque_lines, done=(done, *told),
            own=touching_shapes(self.mujoco, model, self.shifts),
            warnings=(lost,) if missing else (),
        )  # fmt: skip
        return ElementTree.tostring(self.root, encoding="unicode"), notes

    def _base(self) -> int:
        """The body that is free, or else the one on the world; with most joints below it."""
        model = self.model
        free = [int(model.jnt_bodyid[j]) for j in range(model.njnt) if model.jnt_type[j] == FREE]
        roots = free or [b for b in range(1, model.nbody) if model.body_parentid[b] == 0]
        counts = [sum(self._below(int(b), root) for b in model.jnt_bodyid) for root in roots]
        if not counts or max(counts) == 0:
            raise RobotError(f"{self.label}: this MJCF has no body with joints below it")
        return roots[int(np.argmax(counts))]

    def _standing(self) -> dict[str, float]:
        """Joint positions of the key frame of standing; empty without one."""
        model = self.model
        frames = {name: numbers for name, numbers in self.cleaned.keyframes.items()
                  if len(numbers) == model.nq}  # fmt: skip
        named = [name for name in frames if any(word in name.lower() for word in STANDING)]
        chosen = named[0] if named else next(iter(frames), None)
        if chosen is None:
            return {}
        out = {}
        for j in range(model.njnt):
            if model.jnt_type[j] == HINGE:
                try:
                    out[joint_name(model, j)] = float(frames[chosen][model.jnt_qposadr[j]])
                except ValueError:
                    return {}
        return out if np.isfinite(list(out.values())).all() else {}

    def _below(self, body: int, top: int) -> bool:
        """Whether a body is ``top``, or below it."""
        while body > top:
            body = int(self.model.body_parentid[body])
        return body == top

    def refuse_loops(self, locked: Mapping[str, float]) -> None:
        """Refuse legs that are bound to something, as parallel and five-bar legs are.

        Args:
            locked: joints that do not move, by name: what binds only them, as the fingers of a
                gripper, does not matter.

        Raises:
            RobotError: a body or a joint that moves is bound.
        """
        model, kinds, base = self.model, self.mujoco.mjtEq, self.base
        name = {int(kinds.mjEQ_CONNECT): "connect", int(kinds.mjEQ_WELD): "weld",
                int(kinds.mjEQ_JOINT): "joint"}  # fmt: skip
        for i in range(model.neq):
            kind = int(model.eq_type[i])
            first, second = int(model.eq_obj1id[i]), int(model.eq_obj2id[i])
            if kind == int(kinds.mjEQ_JOINT):
                joints = [j for j in (first, second) if j >= 0]
                bodies = [int(model.jnt_bodyid[j]) for j in joints]
                names = [joint_name(model, j) for j in joints]
            elif int(model.eq_objtype[i]) == int(self.mujoco.mjtObj.mjOBJ_BODY):
                bodies = [first, second]
                joints = [j for body in bodies for j in self._joints_above(body)]
                names = [body_name(model, b) for b in bodies]
            else:
                continue
            own = any(bodies) and all(self._below(body, base) for body in bodies if body > 0)
            if own and any(joint_name(model, j) not in locked for j in joints):
                raise RobotError(
                    f"{self.label}: {' and '.join(names)} are bound by an <equality> "
                    f"({name.get(kind, 'equality')}), as in a parallel or five-bar linkage; "
                    "gaitopt plans for serial legs: describe the leg by joints that move on their "
                    "own"
                )

    def _joints_above(self, body: int) -> list[int]:
        """The joints between the base and a body, or the world."""
        out: list[int] = []
        while body > self.base:
            first = int(self.model.body_jntadr[body])
            out += range(first, first + int(self.model.body_jntnum[body]))
            body = int(self.model.body_parentid[body])
        return out

    def _add_body(self, body: int) -> None:
        """Add a body with its joints; several joints make links next to nothing between them."""
        model = self.model
        parent = int(model.body_parentid[body])
        place = pose_of(model.body_pos[body], model.body_quat[body])
        # From the parent's link, whose frame is shifted against the parent's body.
        start = np.eye(4)
        start[:3, 3] = -self.shifts[parent]
        place, link = start @ place, body_name(model, parent)
        first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
        shift = np.zeros(3)
        for k, joint in enumerate(range(first, first + count)):
            last = k == count - 1
            anchor = np.array(model.jnt_pos[joint], dtype=np.float64)
            move = np.eye(4)
            move[:3, 3] = anchor - shift
            child = body_name(model, body) if last else f"{body_name(model, body)} part {k}"
            self._add_joint(joint, link, child, place @ move)
            place, link, shift = np.eye(4), child, anchor
            if not last:
                part = ElementTree.SubElement(self.root, "link", name=child)
                add_inertial(part, PART_MASS, np.zeros(3), PART_MASS * PART_SIZE**2 * np.eye(3))
        if count == 0:
            self._fixed(body, link, place)
        self.shifts[body] = shift
        self._add_link(body)

    def _fixed(self, body: int, link: str, place: FloatArray) -> None:
        """Add a body without joints."""
        name = body_name(self.model, body)
        joint = ElementTree.SubElement(self.root, "joint", name=f"{name} fixed", type="fixed")
        set_origin(joint, place)
        ElementTree.SubElement(joint, "parent", link=link)
        ElementTree.SubElement(joint, "child", link=name)

    def _add_joint(self, joint: int, parent: str, child: str, place: FloatArray) -> None:
        """Add a joint; the joint's zero may be elsewhere than the model's first pose (``ref``)."""
        model = self.model
        kind = int(model.jnt_type[joint])
        name = joint_name(model, joint)
        axis = np.array(model.jnt_axis[joint], dtype=np.float64)
        address = int(model.jnt_qposadr[joint])
        start = float(model.qpos0[address]) if kind in (HINGE, SLIDE) else 0.0
        types = {HINGE: "revolute", SLIDE: "prismatic", BALL: "ball", FREE: "floating"}
        element = ElementTree.SubElement(self.root, "joint", name=name, type=types[kind])
        back = np.eye(4)
        if kind == HINGE:
            back[:3, :3] = rotation_about(axis, -start)
        elif kind == SLIDE:
            back[:3, 3] = -start * axis
        set_origin(element, place @ back)
        ElementTree.SubElement(element, "parent", link=parent)
        ElementTree.SubElement(element, "child", link=child)
        ElementTree.SubElement(element, "axis", xyz=" ".join(repr(float(a)) for a in axis))
        if kind in (HINGE, SLIDE):
            motor = motor_of(self.mujoco, model, joint, f"{self.label}: joint {name}")
            joint_limit(model, joint, motor.effort, element)
            if motor.inertia > 0.0:
                self.armature[name] = motor.inertia
            if motor.line is not None:
                self.torque_lines[name] = motor.line

    def _add_link(self, body: int) -> None:
        """Add a body's link: its inertia and shapes."""
        model, shift = self.model, self.shifts[body]
        link = ElementTree.SubElement(self.root, "link", name=body_name(model, body))
        add_body_inertial(model, body, shift, link)
        first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
        for geom in range(first, first + count):
            add_geom(self.mujoco, model, geom, shift, link, self.cleaned.meshes)
