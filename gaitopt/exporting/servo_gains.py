"""Gains of joint servos that files state, where the user gives none."""

from __future__ import annotations

from typing import Final

import numpy as np

from gaitopt.conventions import GRAVITY
from gaitopt.inputs import check_number
from gaitopt.robots.quadruped import Quadruped

SAG: Final = 0.5
"""Angle by which a servo gives way under the robot's whole weight at the end of a stretched leg
[rad]. Walks of docs/trust.md succeed in simulation with it (:mod:`gaitopt.control.gains`)."""
DAMPING_TIME: Final = 0.015
"""Damping over stiffness [s]: that of the controller where torques are fed forward."""


def servo_gains(
    robot: Quadruped, kp: float | None = None, kd: float | None = None
) -> tuple[float, float]:
    """Stiffness [N m/rad] and damping [N m s/rad] of all joints.

    Args:
        robot: the robot.
        kp, kd: what the user gives.

    Raises:
        InputError: one is out of range.
    """
    length = float(np.mean([leg.reach for leg in robot.legs.values()]))
    usual = robot.mass * GRAVITY * length / SAG
    stiffness = usual if kp is None else check_number("kp", kp, 0.0, 1e6, "N m/rad")
    damping = DAMPING_TIME * stiffness if kd is None else check_number("kd", kd, 0.0, 1e5, "N m s")
    return stiffness, damping
