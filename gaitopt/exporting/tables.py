"""A plan's motion as a table."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from gaitopt.exporting.format import Format
from gaitopt.exporting.joint_order import JointOrder, joint_order
from gaitopt.exporting.sampled import Exported, Source
from gaitopt.files import StrPath, written_whole
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory

_BASE = ("base_x", "base_y", "base_z", "base_qx", "base_qy", "base_qz", "base_qw")
_TWIST = ("base_vx", "base_vy", "base_vz", "base_wx", "base_wy", "base_wz")


def export_csv(plan: Plan, path: StrPath, dt: float | None = None) -> None:
    """Write the sampled motion as CSV: a header of names, then one line for each sample.

    Columns: ``t`` [s]; base position [m] and quaternion (xyzw); each joint's angle [rad] under its
    name; base twist in the base's frame [m/s, rad/s]; each joint's velocity [rad/s] as
    ``<joint>_velocity``; the body centre ``cog_x`` ... [m]; for each leg ``<leg>_contact`` (0 or 1)
    and its foot ``<leg>_x`` ... [m].

    Args:
        plan: the plan.
        path: the file; it is complete, or not there at all.
        dt: time between samples [s]; by default samples are the plan's own knots. Between them the
            joints of a path of degree one move linearly, so that nothing is lost.

    Raises:
        InputError: ``dt`` is no positive time, a joint's name is not safe in a table, or the file
            cannot be written.
    """
    check_kind("plan", plan, Plan)
    order = joint_order(plan.robot.joint_names)
    _write_table(plan.knots() if dt is None else plan.sample(dt), order, path)


def write_table(source: Source, path: Path, dt: float | None = None) -> Exported:
    """Write the table of :func:`export_csv`, with the joints of the file."""
    motion = source.plan.knots() if dt is None else source.plan.sample(dt)
    _write_table(motion, source.order, path)
    return Exported((path,), {"samples": float(len(motion))})


def _write_table(motion: Trajectory, order: JointOrder, path: StrPath) -> None:
    joints = order.names
    header = ["t", *_BASE, *joints, *_TWIST, *(f"{j}_velocity" for j in joints)]
    header += [f"cog_{axis}" for axis in "xyz"]
    header += [f"{leg}_contact" for leg in motion.legs]
    header += [f"{leg}_{axis}" for leg in motion.legs for axis in "xyz"]
    numbers = np.column_stack(
        [motion.t, motion.q[:, :7], motion.q[:, 7 + order.columns], motion.v[:, :6],
         motion.v[:, 6 + order.columns], motion.cog, motion.contacts,
         motion.feet.reshape(len(motion), -1)]
    )  # fmt: skip
    with written_whole(path) as stream:
        csv.writer(stream, lineterminator="\n").writerow(header)
        np.savetxt(stream, numbers, fmt="%.12g", delimiter=",")


FORMAT = Format(
    name="csv",
    summary="a table: body, joints, feet and contacts over time",
    suffixes=(".csv",),
    write=write_table,
)
