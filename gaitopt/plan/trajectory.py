"""A plan's motion at instants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitopt.conventions import BoolArray, ByValue, FloatArray
from gaitopt.errors import InputError, MissingPackageError
from gaitopt.inputs import as_text, check_kind, is_real

MAX_SAMPLES = 20_000_000
"""Most samples of a plan that are made."""
LONGEST_STEP = 1e9
"""Largest time between samples that is taken for one [s]."""
_BASE = ("base_x", "base_y", "base_z", "base_qx", "base_qy", "base_qz", "base_qw")
_TWIST = ("base_vx", "base_vy", "base_vz", "base_wx", "base_wy", "base_wz")


@dataclass(frozen=True, eq=False)
class Trajectory(ByValue):
    """A plan sampled in time; all arrays are read-only.

    Attributes:
        t: times ``(N,)`` [s].
        q: configurations ``(N, nq)``, Pinocchio's for ``plan.robot.model``: base position,
            quaternion xyzw, joints. This is the model of ``plan.robot.urdf``, in which a joint
            without an end has one angle, and joints of no leg are fixed; Pinocchio's own reading of
            the robot's file may have more numbers (:func:`gaitopt.file_configurations`).
        v: velocities ``(N, nv)``, Pinocchio's: base twist in the base's frame, joint rates.
        contacts: which feet stand ``(N, 4)``.
        cog: body centre ``(N, 3)`` [m].
        feet: foot frames ``(N, 4, 3)`` [m].
        legs: names of the columns of ``contacts`` and ``feet``.
        joint_names: names of the joint columns of ``q[:, 7:]`` and ``v[:, 6:]``.
    """

    t: FloatArray
    q: FloatArray
    v: FloatArray
    contacts: BoolArray
    cog: FloatArray
    feet: FloatArray
    legs: tuple[str, ...]
    joint_names: tuple[str, ...]

    def __post_init__(self) -> None:
        for name in ("t", "q", "v", "contacts", "cog", "feet"):
            check_kind(name, getattr(self, name), np.ndarray)
            getattr(self, name).setflags(write=False)

    def __repr__(self) -> str:
        span = f", {self.t[0]:.3f} to {self.t[-1]:.3f} s" if len(self) else ""
        return f"Trajectory({len(self)} samples{span}, {len(self.joint_names)} joints)"

    def __len__(self) -> int:
        return len(self.t)

    def table(
        self, names: tuple[str, ...] | None = None, columns: np.ndarray | None = None
    ) -> tuple[list[str], FloatArray]:
        """The motion as names of columns, and a table of numbers ``(N, columns)``.

        Columns: ``t`` [s]; base position [m] and quaternion (xyzw); each joint's angle [rad] under
        its name; base twist in the base's frame [m/s, rad/s]; each joint's velocity [rad/s] as
        ``<joint>_velocity``; the body centre ``cog_x`` ... [m]; for each leg ``<leg>_contact`` (0
        or 1) and its foot ``<leg>_x`` ... [m].

        Args:
            names: of the joints in the table.
            columns: their places in :attr:`joint_names`; all of these by default.
        """
        names = self.joint_names if names is None else names
        columns = np.arange(len(names)) if columns is None else columns
        header = ["t", *_BASE, *names, *_TWIST, *(f"{name}_velocity" for name in names)]
        header += [f"cog_{axis}" for axis in "xyz"]
        header += [f"{leg}_contact" for leg in self.legs]
        header += [f"{leg}_{axis}" for leg in self.legs for axis in "xyz"]
        numbers = np.column_stack(
            [self.t, self.q[:, :7], self.q[:, 7 + columns], self.v[:, :6], self.v[:, 6 + columns],
             self.cog, self.contacts, self.feet.reshape(len(self), -1)]
        )  # fmt: skip
        return header, numbers

    def to_dataframe(self) -> Any:
        """A ``pandas.DataFrame`` with the columns of :meth:`table`; its index is the time.

        Contacts are true or false. ``.to_xarray()`` of pandas makes a ``xarray.Dataset`` of it.

        Raises:
            MissingPackageError: pandas is not installed.
        """
        try:
            import pandas
        except ImportError as error:
            raise MissingPackageError(
                "a data frame needs the package pandas: pip install 'gaitopt[learning]'"
            ) from error
        header, numbers = self.table()
        frame = pandas.DataFrame(numbers, columns=header).set_index("t")
        return frame.astype({f"{leg}_contact": bool for leg in self.legs})


def sample_times(duration: float, dt: float) -> FloatArray:
    """Every ``dt`` seconds from 0, and the very end ``(N,)`` [s].

    Raises:
        InputError: ``dt`` is not a positive time, or asks for too many samples.
    """
    if not is_real(dt) or not 0 < dt <= LONGEST_STEP:
        raise InputError(f"dt must be a positive time in seconds, got {as_text(dt)}")
    if duration / dt > MAX_SAMPLES:
        raise InputError(
            f"dt = {dt:g} s asks for {duration / dt:.3g} samples of {duration:.1f} "
            f"s; at most {MAX_SAMPLES:.0e} are made, so take dt >= "
            f"{duration / MAX_SAMPLES:.2g} s"
        )
    count = int(np.ceil(duration / dt - 1e-9))
    return np.append(np.arange(count) * float(dt), duration)
