"""MuJoCo: ``qpos``, ``qvel`` and ``ctrl`` over time, and key frames, for a model in MJCF.

In MuJoCo a free joint's ``qpos`` is position, then quaternion w, x, y, z; its ``qvel`` is the
linear velocity in the world's axes, then the angular velocity in the body's. Joints are in the
order of the model, which is found by their names.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError, MissingPackageError
from gaitopt.exporting.format import Format
from gaitopt.exporting.mujoco_model import Addresses, addresses, check_kinematics, made_model
from gaitopt.exporting.sampled import Exported, Samples, Source
from gaitopt.exporting.servo_gains import servo_gains
from gaitopt.files import StrPath, written_whole
from gaitopt.robots.files.mjcf.compiled import model_of_file

STEP: Final = 0.002
"""Default time between samples [s]: MuJoCo's own default time step."""


def write_mujoco(
    source: Source,
    path: Path,
    dt: float | None = None,
    *,
    mjcf: StrPath | None = None,
    kp: float | None = None,
    kd: float | None = None,
) -> Exported:
    """Write the motion as ``.npz`` and its key frames as ``<name>.keyframes.xml``.

    Args:
        source: what is exported.
        path: the ``.npz`` file.
        dt: time between samples [s]; 0.002 by default.
        mjcf: the user's own model. By default one is made from the robot's URDF and written as
            ``<name>.xml``, which includes the key frames.
        kp, kd: gains of the position servos of the model that is made [N m/rad, N m s/rad].

    Raises:
        MissingPackageError: MuJoCo is not installed.
        InputError: the model lacks a joint, or is another robot.
    """
    mujoco = _mujoco()
    samples = source.samples(STEP if dt is None else dt)
    keyframes = path.with_suffix(".keyframes.xml")
    made = path.with_suffix(".xml") if mjcf is None else None
    if mjcf is None:
        gains = servo_gains(source.plan.robot, kp, kd)
        text, model = made_model(mujoco, source, gains, keyframes.name)
    else:
        if kp is not None or kd is not None:
            raise InputError("kp and kd are gains of the model that is made; the MJCF has its own")
        text, model = "", model_of_file(mjcf)
    where = addresses(mujoco, model, source)
    qpos, qvel, ctrl = _vectors(samples, model, where)
    error = check_kinematics(mujoco, model, source, where, samples, qpos)
    if made is not None:
        with written_whole(made) as stream:
            stream.write(text)
    with written_whole(keyframes) as stream:
        stream.write(_keyframes(samples, qpos, qvel, ctrl))
    arrays: dict[str, Any] = {
        "time": samples.times, "qpos": qpos, "qvel": qvel, "ctrl": ctrl,
        "joint_names": np.array(source.order.names), "contacts": samples.motion.contacts,
    }  # fmt: skip
    if samples.torques is not None:
        arrays["torques"] = samples.torques
    with written_whole(path, binary=True) as stream:
        np.savez_compressed(stream, **arrays)
    files = (path, keyframes) if made is None else (path, keyframes, made)
    return Exported(files, {"samples": float(len(samples)), "difference [m]": error}, where.notes)


def _mujoco() -> Any:
    try:
        import mujoco
    except ImportError as error:
        raise MissingPackageError(
            "exporting for MuJoCo needs the package mujoco: pip install 'gaitopt[sim]'"
        ) from error
    return mujoco


def _vectors(
    samples: Samples, model: Any, where: Addresses
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """MuJoCo's vectors over time: ``(N, nq)``, ``(N, nv)`` and ``(N, nu)``."""
    count = len(samples)
    qpos = np.tile(np.asarray(model.qpos0, dtype=np.float64), (count, 1))
    qvel, ctrl = np.zeros((count, model.nv)), np.zeros((count, model.nu))
    position, quaternion, twist = where.base_of(samples)
    qpos[:, where.free_qpos : where.free_qpos + 3] = position
    qpos[:, where.free_qpos + 3 : where.free_qpos + 7] = quaternion
    qvel[:, where.free_qvel : where.free_qvel + 6] = twist
    qpos[:, where.qpos] = samples.positions
    qvel[:, where.qvel] = samples.velocities
    for actuator, (column, ratio, of) in where.actuators.items():
        told = {"position": samples.positions, "velocity": samples.velocities,
                "torque": samples.torques}[of]  # fmt: skip
        if told is not None:
            ctrl[:, actuator] = ratio * told[:, column]
    return qpos, qvel, ctrl


def _keyframes(samples: Samples, qpos: FloatArray, qvel: FloatArray, ctrl: FloatArray) -> str:
    """Key frames at both ends and where a phase begins, as a file to include."""
    starts = [0.0, *(p.start for p in samples.source.plan.phases), samples.times[-1]]
    rows = np.unique(np.searchsorted(samples.times, np.array(starts) - 1e-9))
    root = ElementTree.Element("mujoco")
    parent = ElementTree.SubElement(root, "keyframe")
    for number, row in enumerate(rows.clip(0, len(samples) - 1)):
        values = {"time": samples.times[row : row + 1], "qpos": qpos[row], "qvel": qvel[row],
                  "ctrl": ctrl[row]}  # fmt: skip
        told = {n: " ".join(f"{x:.12g}" for x in v) for n, v in values.items() if len(v)}
        ElementTree.SubElement(parent, "key", {"name": f"plan_{number}", **told})
    ElementTree.indent(root)
    return ElementTree.tostring(root, encoding="unicode") + "\n"


FORMAT = Format(
    name="mujoco",
    summary="qpos, qvel and ctrl in .npz, with key frames in MJCF",
    suffixes=(),
    write=write_mujoco,
    options=("mjcf", "kp", "kd"),
)
