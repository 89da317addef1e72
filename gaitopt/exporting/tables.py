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


def export_csv(plan: Plan, path: StrPath, dt: float | None = None) -> None:
    """Write the sampled motion as CSV: a header of names, then one line for each sample.

    The columns are those of :meth:`gaitopt.Trajectory.table`.

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
    header, numbers = motion.table(order.names, order.columns)
    with written_whole(path) as stream:
        csv.writer(stream, lineterminator="\n").writerow(header)
        np.savetxt(stream, numbers, fmt="%.12g", delimiter=",")


FORMAT = Format(
    name="csv",
    summary="a table: body, joints, feet and contacts over time",
    suffixes=(".csv",),
    write=write_table,
)
