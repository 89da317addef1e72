"""Low-level commands at a fixed rate, in the order of Unitree's SDK.

Each motor is told an angle, a velocity, two gains and a torque, and makes the torque
``kp (q - angle) + kd (dq - velocity) + tau``. The SDK counts motors leg by leg, front right, front
left, rear right, rear left, and in each from hip to knee: its names are FR_0, FR_1, FR_2, FL_0 and
so on.
"""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Final

import numpy as np

from gaitopt.errors import InputError
from gaitopt.exporting.format import Format
from gaitopt.exporting.sampled import Exported, Source
from gaitopt.exporting.servo_gains import servo_gains
from gaitopt.files import written_whole

STEP: Final = 0.002
"""Default period [s]: the examples of the SDK send commands at 500 Hz."""
ORDER: Final = (("FR", "RF"), ("FL", "LF"), ("RR", "RH"), ("RL", "LH"))
"""Legs of the SDK in its order, with gaitopt's names."""
VALUES: Final = ("q", "dq", "kp", "kd", "tau")


def write_unitree(
    source: Source,
    path: Path,
    dt: float | None = None,
    *,
    kp: float | None = None,
    kd: float | None = None,
) -> Exported:
    """Write a table: ``time``, and for every motor ``q``, ``dq``, ``kp``, ``kd``, ``tau``.

    Args:
        source: what is exported.
        path: the file.
        dt: period of the commands [s]; 0.002 by default.
        kp, kd: gains of all motors [N m/rad, N m s/rad].

    Raises:
        InputError: a leg has not three joints, or joints are left out.
    """
    robot = source.plan.robot
    if source.order.left_out or source.order.names != robot.joint_names:
        raise InputError("the format unitree has its own order and names: leave out joints, prefix")
    names: list[str] = []
    legs: list[int] = []
    for theirs, leg in ORDER:
        if len(robot.leg_columns[leg]) != 3:
            raise InputError(f"{robot.name}: leg {leg} has not the three motors of the SDK")
        names += [f"{theirs}_{k}" for k in range(3)]
        legs += robot.leg_columns[leg]
    columns: np.ndarray = np.array(legs)
    samples = source.samples(STEP if dt is None else dt)
    stiffness, damping = servo_gains(robot, kp, kd)
    torques = samples.torques
    told = np.zeros((len(samples), len(columns), len(VALUES)))
    told[..., 0] = samples.vectors.q[:, 7 + columns]
    told[..., 1] = samples.vectors.v[:, 6 + columns]
    told[..., 2], told[..., 3] = stiffness, damping
    if torques is not None:
        told[..., 4] = torques[:, columns]
    with written_whole(path) as stream:
        header = ["time", *(f"{name}_{value}" for name in names for value in VALUES)]
        csv.writer(stream, lineterminator="\n").writerow(header)
        rows = np.column_stack([samples.times, told.reshape(len(samples), -1)])
        np.savetxt(stream, rows, fmt="%.9g", delimiter=",")
    note = "tau is 0: this plan promises no torques (gaitopt.retimed makes one that does)"
    return Exported(
        (path,),
        {"samples": float(len(samples)), "kp [N m/rad]": stiffness, "kd [N m s/rad]": damping},
        () if torques is not None else (note,),
    )


FORMAT = Format(
    name="unitree",
    summary="low-level commands (q, dq, kp, kd, tau) in CSV, in the order of Unitree's SDK",
    suffixes=(),
    write=write_unitree,
    options=("kp", "kd"),
)
