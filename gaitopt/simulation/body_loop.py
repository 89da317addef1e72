"""Whether the body's spring and damper are stable at the rate at which the controller is called.

Between two calls the controller's forces stay as they are, while the body moves on. A damper that
takes away more than twice the velocity within a call makes it grow. The gains are in proportion to
the robot's mass and stance (:mod:`gaitopt.control.gains`). A body that is far narrower than its
stance is turned about its length more quickly than they expect, and the controller is called more
often for it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitopt.control.gains import ControlGains
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.quadruped import Quadruped
from gaitopt.simulation.settings import SimulationSettings

LARGEST_GROWTH = 1.001
"""Factor from one call to the next up to which motions do not grow, but for rounding. Of 190 robot
files six have 1.06 to 1.44 in calls every 6 ms, and all others at most 1. The largest is that of a
quadruped_model, whose feet lost the ground again and again, so that it missed a foothold."""
ROUNDING = 1e-9
"""Singular values of the feet's Jacobian below this share of the largest are zero."""


class BodyLoop(NamedTuple):
    """A robot that stands on four feet which do not move, linear about its standing pose.

    Small displacements ``z`` from it obey ``inertia z'' = -own z' - bends z - damps z'_k - holds
    z_k``, with the ``z_k`` and ``z'_k`` that the controller saw when it was called last.

    Attributes:
        inertia: of robot and motors ``(n, n)``.
        own, bends: damping and stiffness of joints and their servos, which act all the time.
        damps, holds: damping and stiffness of the body's spring, which the controller knows.
    """

    inertia: FloatArray
    own: FloatArray
    bends: FloatArray
    damps: FloatArray
    holds: FloatArray

    def growth(self, interval: float) -> float:
        """The largest factor by which a motion grows from one call to the next; below 1 none does.

        It is that of the exact solution between calls an ``interval`` [s] apart, and infinite where
        gains or dampings are so large that it cannot be computed.
        """
        n = len(self.inertia)
        system = np.zeros((4 * n, 4 * n))
        system[:n, n : 2 * n] = np.eye(n)
        felt = np.hstack([self.bends, self.own, self.holds, self.damps])
        system[n : 2 * n] = -np.linalg.solve(self.inertia, felt)
        with np.errstate(over="ignore", invalid="ignore"):
            moved = _exponential(interval * system)[: 2 * n]
        if not np.isfinite(moved).all():
            return np.inf
        # What was seen at the call is where the interval begins.
        return float(np.abs(np.linalg.eigvals(moved[:, : 2 * n] + moved[:, 2 * n :])).max())


def body_loop(robot: Quadruped, gains: ControlGains) -> BodyLoop:
    """The loop of a robot that stands as it does by default.

    Args:
        robot: the robot, with masses.
        gains: of its controller and servos.
    """
    import pinocchio as pin

    model = robot.model
    data, q = model.createData(), pin.neutral(model)
    q[7:] = robot.standing_joints()
    inertia = np.triu(pin.crba(model, data, q))  # with the model's armature
    inertia += np.triu(inertia, 1).T
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    feet = [pin.getFrameJacobian(model, data, model.getFrameId(robot.legs[leg].foot),
                                 pin.LOCAL_WORLD_ALIGNED)[:3] for leg in LEGS]  # fmt: skip
    _, sizes, ways = np.linalg.svd(np.vstack(feet))
    free = ways[int((sizes > ROUNDING * sizes[0]).sum()) :].T
    body, joints = free[:6], free[6:]
    held = np.repeat([gains.body_stiffness, gains.rotation_stiffness], 3)
    damped = np.repeat([gains.body_damping, gains.rotation_damping], 3)
    rubs = gains.joint_damping + np.asarray(model.damping)[6:]
    return BodyLoop(
        free.T @ inertia @ free,
        joints.T @ (rubs[:, None] * joints),
        gains.joint_stiffness * joints.T @ joints,
        body.T @ (damped[:, None] * body),
        body.T @ (held[:, None] * body),
    )


def called_in_time(
    settings: SimulationSettings, robot: Quadruped, gains: ControlGains
) -> SimulationSettings:
    """The settings with the controller called often enough for no motion to grow.

    It is called at every step of the physics at most.
    """
    loop = body_loop(robot, gains)
    for every in range(settings.control_every, 1, -1):
        if loop.growth(every * settings.timestep) <= LARGEST_GROWTH:
            return replace(settings, control_every=every)
    return replace(settings, control_every=1)


def _exponential(matrix: FloatArray) -> FloatArray:
    """Matrix exponential, by Pade's approximation with scaling and squaring."""
    from scipy.linalg import expm

    return np.asarray(expm(matrix))
