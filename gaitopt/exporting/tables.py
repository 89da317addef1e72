"""A plan's motion as a table."""

from __future__ import annotations

import csv

import numpy as np

from gaitopt.files import StrPath, written_whole
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan

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
        InputError: ``dt`` is no positive time, or the file cannot be written.
    """
    check_kind("plan", plan, Plan)
    motion = plan.knots() if dt is None else plan.sample(dt)
    joints = motion.joint_names
    header = ["t", *_BASE, *joints, *_TWIST, *(f"{j}_velocity" for j in joints)]
    header += [f"cog_{axis}" for axis in "xyz"]
    header += [f"{leg}_contact" for leg in motion.legs]
    header += [f"{leg}_{axis}" for leg in motion.legs for axis in "xyz"]
    numbers = np.column_stack(
        [motion.t, motion.q, motion.v, motion.cog, motion.contacts,
         motion.feet.reshape(len(motion), -1)]
    )  # fmt: skip
    with written_whole(path) as stream:
        csv.writer(stream, lineterminator="\n").writerow(header)
        np.savetxt(stream, numbers, fmt="%.12g", delimiter=",")
