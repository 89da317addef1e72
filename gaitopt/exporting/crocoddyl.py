"""A first guess for optimal control with Pinocchio and Crocoddyl: states, torques, contacts.

Crocoddyl's state is Pinocchio's configuration and velocity one after the other; its control of a
floating base is the torques of all joints. Its contacts hold frames: torques are those of forces
that act at the feet's frames, and not at the bottom of their balls.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.exporting.format import Format
from gaitopt.exporting.sampled import Exported, Source
from gaitopt.files import written_whole

STEP: Final = 0.01
"""Default time between nodes [s]: the usual one of Crocoddyl's examples with quadrupeds."""


def write_warm_start(source: Source, path: Path, dt: float | None = None) -> Exported:
    """Write ``xs``, ``us`` and the contact schedule as ``.npz``.

    Args:
        source: what is exported.
        path: the file.
        dt: time between nodes [s]; 0.01 by default.

    Raises:
        InputError: the joints are not those of the model, in its order.
    """
    robot = source.plan.robot
    if source.order.names != robot.joint_names:
        raise InputError(
            "the format crocoddyl has the model's own joints: leave out joints, prefix"
        )
    step = STEP if dt is None else dt
    at_frames = replace(robot, notes=replace(robot.notes, foot_radius=0.0))
    samples = replace(source, plan=replace(source.plan, robot=at_frames)).samples(step)
    vectors = samples.vectors
    arrays: dict[str, Any] = {
        "dt": np.float64(step),
        "time": samples.times,
        "xs": np.concatenate([vectors.q, vectors.v], axis=1),
        "accelerations": vectors.a,
        "contacts": samples.motion.contacts,
        "foot_frames": np.array([robot.legs[leg].foot for leg in LEGS]),
        "foot_positions": samples.motion.feet,
        "joint_names": np.array(robot.joint_names),
        "urdf": np.array(robot.urdf),
        "armature": np.array(robot.model.armature),
    }
    if samples.forces is not None:
        arrays["us"] = samples.forces.torques[:-1]
        arrays["contact_forces"] = samples.forces.forces
    note = "no us: this plan promises no torques (gaitopt.retimed makes one that does)"
    with written_whole(path, binary=True) as stream:
        np.savez_compressed(stream, **arrays)
    return Exported(
        (path,), {"nodes": float(len(samples))}, () if samples.forces is not None else (note,)
    )


FORMAT = Format(
    name="crocoddyl",
    summary="a first guess for optimal control: xs, us and contacts in .npz, as Crocoddyl has them",
    suffixes=(),
    write=write_warm_start,
)
