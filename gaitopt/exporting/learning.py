"""Reference motions for learning by imitation, at a fixed rate, as ``.npz`` or HDF5.

The arrays for the motion have the names and shapes that Isaac Lab's motion loader reads (its task
``humanoid_amp``): frames a second, names of joints and links, joints, and links in the world with
quaternions w, x, y, z. Contacts, feet, torques and forces stand beside them.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.errors import MissingPackageError
from gaitopt.exporting.format import Format
from gaitopt.exporting.links import link_motion, moving_links
from gaitopt.exporting.sampled import Exported, Samples, Source
from gaitopt.files import written_whole

STEP: Final = 0.02
"""Default time between frames [s]: policies of legged robots usually run at 50 Hz."""
UNITS: Final = {
    "time": "s", "fps": "1/s", "dof_positions": "rad", "dof_velocities": "rad/s",
    "body_positions": "m", "body_linear_velocities": "m/s", "body_angular_velocities": "rad/s",
    "root_position": "m", "root_linear_velocity": "m/s", "root_angular_velocity": "rad/s",
    "foot_positions": "m", "torques": "N m", "contact_forces": "N",
}  # fmt: skip
"""Units of the arrays; the others have none."""


def write_learning(source: Source, path: Path, dt: float | None = None) -> Exported:
    """Write the motion as HDF5 where the path ends with ``.h5`` or ``.hdf5``, else as ``.npz``.

    Args:
        source: what is exported.
        path: the file.
        dt: time between frames [s]; 0.02 by default.

    Raises:
        MissingPackageError: HDF5 was asked for, and h5py is not installed.
    """
    arrays = motion_arrays(source.samples(STEP if dt is None else dt))
    if path.suffix.lower() in (".h5", ".hdf5"):
        _write_hdf5(path, arrays)
    else:
        with written_whole(path, binary=True) as stream:
            np.savez_compressed(stream, **arrays)
    frames = float(len(arrays["time"]))
    return Exported((path,), {"frames": frames, "frames a second": float(arrays["fps"])})


def motion_arrays(samples: Samples) -> dict[str, Any]:
    """The arrays of a file, by name."""
    robot = samples.source.plan.robot
    links = link_motion(samples, moving_links(robot))
    step = float(samples.times[1] - samples.times[0]) if len(samples) > 1 else STEP
    arrays: dict[str, Any] = {
        "fps": np.float64(1.0 / step),
        "time": samples.times,
        "dof_names": np.array(samples.source.order.names),
        "dof_positions": samples.positions,
        "dof_velocities": samples.velocities,
        "body_names": np.array(links.names),
        "body_positions": links.positions,
        "body_rotations": links.quaternions,
        "body_linear_velocities": links.linear,
        "body_angular_velocities": links.angular,
        "root_position": links.positions[:, 0],
        "root_rotation": links.quaternions[:, 0],
        "root_linear_velocity": links.linear[:, 0],
        "root_angular_velocity": links.angular[:, 0],
        "foot_names": np.array(LEGS),
        "foot_positions": samples.motion.feet,
        "contacts": samples.motion.contacts,
    }
    if samples.forces is not None:
        arrays["torques"] = samples.torques
        arrays["contact_forces"] = samples.forces.forces
    return arrays


def _write_hdf5(path: Path, arrays: dict[str, Any]) -> None:
    try:
        import h5py
    except ImportError as error:
        raise MissingPackageError(
            "writing HDF5 needs the package h5py: pip install 'gaitopt[learning]'"
        ) from error
    held = io.BytesIO()
    with h5py.File(held, "w") as file:
        for name, values in arrays.items():
            texts = np.asarray(values).dtype.kind == "U"
            data = np.asarray(values).astype(object) if texts else values
            kind = h5py.string_dtype() if texts else None
            made = file.create_dataset(name, data=data, dtype=kind)
            if name in UNITS:
                made.attrs["unit"] = UNITS[name]
    with written_whole(path, binary=True) as stream:
        stream.write(held.getvalue())


FORMAT = Format(
    name="learning",
    summary="reference motions in .npz or HDF5, as Isaac Lab's motion loader reads them",
    suffixes=(".h5", ".hdf5"),
    write=write_learning,
)
