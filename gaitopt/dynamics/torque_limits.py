"""Limits of joint torques: what the robot's file states, and how they fall with the speed.

A motor has its whole torque up to a speed. From there the torque that drives its joint falls along
a line, and at the speed without load it is zero. A torque that brakes the joint keeps its limit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.inputs import check_shape
from gaitopt.robots.abilities import placeholder_torque
from gaitopt.robots.quadruped import Quadruped


@dataclass(frozen=True, eq=False)
class EffortLimits:
    """Torque limits of a robot's joints, and which joints have none.

    Attributes:
        limits: in the order of :attr:`Quadruped.joint_names` ``(nj,)`` [N m]; ``inf`` for joints
            whose limit is not known. Read-only.
        unknown: names of these joints.
    """

    limits: FloatArray
    unknown: tuple[str, ...]


def effort_limits(robot: Quadruped) -> EffortLimits:
    """Torque limits of the joints of ``robot``, without placeholders.

    A joint has no known limit when its URDF states none or zero, or a number that no leg of this
    robot can need (:func:`gaitopt.robots.abilities.placeholder_torque`).
    """
    stated = robot.effort_limits
    limits = frozen(np.where(stated >= placeholder_torque(robot), np.inf, stated))
    unknown = np.flatnonzero(~np.isfinite(limits)).tolist()
    return EffortLimits(limits, tuple(robot.joint_names[joint] for joint in unknown))


@dataclass(frozen=True, eq=False)
class TorqueLines:
    """Speeds at which the torques of joints begin to fall, and at which they end.

    Attributes:
        knee, no_load: in the order of :attr:`Quadruped.joint_names` ``(nj,)`` [rad/s]; ``inf`` for
            joints whose torque does not fall. Read-only.
    """

    knee: FloatArray
    no_load: FloatArray

    @property
    def span(self) -> FloatArray:
        """Speed over which the whole torque falls to zero ``(nj,)`` [rad/s]; ``inf`` for none."""
        falls = np.isfinite(self.no_load)
        return np.where(falls, self.no_load - np.where(falls, self.knee, 0.0), np.inf)

    def left(self, speeds: FloatArray) -> FloatArray:
        """Share of the driving torque that a joint has at its speed ``(..., nj)``.

        Args:
            speeds: of the joints ``(..., nj)`` [rad/s].
        """
        falls = np.isfinite(self.no_load)
        no_load = np.where(falls, self.no_load, 0.0)
        share = (no_load - np.abs(speeds)) / np.where(falls, self.span, 1.0)
        return np.where(falls, np.clip(share, 0.0, 1.0), 1.0)


def torque_lines(robot: Quadruped, limits: ForceLimits) -> TorqueLines | None:
    """How the torques of the joints fall with their speeds; ``None`` where none does.

    Where both the robot's motors and ``limits`` have a line, the lower speed counts of each pair:
    the torque is then nowhere above either line.

    Args:
        robot: the robot.
        limits: its :attr:`ForceLimits.torque_line` and :attr:`ForceLimits.speed_share`.
    """
    knee, no_load = robot.torque_lines
    if limits.torque_line is not None:
        # Without a velocity limit the speed is no share of anything: the torque does not fall.
        known = np.isfinite(robot.velocity_limits)
        unit = np.where(known, robot.velocity_limits, 1.0)
        knee = np.minimum(knee, np.where(known, limits.torque_line.knee * unit, np.inf))
        no_load = np.minimum(no_load, np.where(known, limits.torque_line.no_load * unit, np.inf))
    if not np.isfinite(no_load).any():
        return None
    return TorqueLines(frozen(limits.speed_share * knee), frozen(limits.speed_share * no_load))


def torque_bounds(
    robot: Quadruped, limits: ForceLimits, joint_velocities: ArrayLike
) -> tuple[FloatArray, FloatArray]:
    """Lower and upper limits of the joint torques, each ``(..., nj)`` [N m].

    ``-inf`` and ``inf`` for joints whose limit is not known.

    Args:
        robot: the robot, with the lines of torque over speed of its motors.
        limits: the share of the torques that may be used, and another such line.
        joint_velocities: in the order of :attr:`Quadruped.joint_names` ``(..., nj)`` [rad/s].

    Raises:
        InputError: ``joint_velocities`` has another shape.
    """
    speeds = check_shape("joint_velocities", joint_velocities, len(robot.joint_names))
    largest = limits.torque_share * effort_limits(robot).limits
    lines = torque_lines(robot, limits)
    if lines is None:
        both = np.broadcast_to(largest, speeds.shape)
        return -both, both
    known = np.isfinite(largest)
    # An unknown limit stays unknown also where the motor has no torque left.
    driving = np.where(known, np.where(known, largest, 0.0) * lines.left(speeds), np.inf)
    return -np.where(speeds < 0.0, driving, largest), np.where(speeds > 0.0, driving, largest)
