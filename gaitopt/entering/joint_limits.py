"""What joints allow of an entry: their angles, velocities and accelerations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.bounds import derivative_range, largest_sizes
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import joints_from_feet
from gaitopt.robots.whole_body_rates import base_twist, joint_rates

ROUNDING = 5e-7
"""Share by which a velocity or an acceleration may exceed its limit by rounding: half of what a
certificate allows."""
ACCELERATION = "joint acceleration"
"""Begin of the names of limits of accelerations."""
AT_BEGIN = 1e-6
"""The same of a state, whose rates are known to that."""


class Fault(NamedTuple):
    """A limit that an entry exceeds.

    Attributes:
        share: by how much, as a share of the limit, or of the weight.
        limit: its name.
        value, allowed: what is needed, and what there is.
        unit: of both.
        time: when it is exceeded most [s].
        of_forces: whether it is one on forces, which are looked for where joints keep their limits.
    """

    share: float
    limit: str
    value: float
    allowed: float
    unit: str
    time: float
    of_forces: bool = False


@dataclass(frozen=True, eq=False)
class JointLimits:
    """Limits of the joints.

    Attributes:
        robot: has those of velocities.
        most: the accelerations that are promised ``(nj,)`` [rad/s^2]; infinite for none.
        angles: lower and upper limits of angles ``(2, nj)`` [rad]; knees may be narrower than the
            robot's (:func:`bent_knees`).
    """

    robot: Quadruped
    most: FloatArray
    angles: FloatArray

    def velocity_use(self, base: FloatArray, feet: FloatArray) -> FloatArray:
        """Joint velocities as shares of their limits ``(C, N, nj)``; infinite out of reach.

        Args:
            base: columns of the base and their rates ``(2, C, N, 6)``, or more derivatives.
            feet: in the world, and their velocities ``(2, C, N, 4, 3)``, or more derivatives.
        """
        rpy = base[0, ..., 3:]
        joints, reached = joints_from_feet(
            self.robot, base[0, ..., :3], rpy, feet[0], on_unreachable="mask"
        )
        twist = base_twist(rpy, base[1, ..., :3], base[1, ..., 3:])
        speeds = joint_rates(self.robot, rpy, joints, twist, feet[1], on_singular="nan")
        use = np.abs(speeds) / self.robot.velocity_limits
        use[~np.asarray(reached.all(axis=-1))] = np.inf
        return np.asarray(np.nan_to_num(use, nan=np.inf))

    def at_instants(
        self, angles: FloatArray, accelerations: FloatArray, times: FloatArray
    ) -> Fault | None:
        """The limit of an angle or an acceleration that is exceeded, if one is.

        Args:
            angles, accelerations: at instants ``(N, nj)`` [rad], [rad/s^2].
            times: of the instants ``(N,)`` [s].
        """
        beyond = self._positions(angles, angles, times)
        return beyond or self._accelerations(np.abs(accelerations), times)

    def along(self, path: MotionPath) -> Fault | None:
        """The limit that is exceeded at any instant of a path, if one is."""
        starts = path.times[:-1]
        use = largest_sizes(path, 1)[:, BASE_COLUMNS:] / self.robot.velocity_limits
        if use[0].max() <= 1.0 + AT_BEGIN:
            use[0] = np.minimum(use[0], 1.0)
        if use.max() > 1.0 + ROUNDING:
            return self.velocity(use, starts)
        low, high = (part[:, BASE_COLUMNS:] for part in derivative_range(path))
        beyond = self._positions(low, high, starts)
        return beyond or self._accelerations(largest_sizes(path, 2)[:, BASE_COLUMNS:], starts)

    def velocity(self, use: FloatArray, times: FloatArray) -> Fault:
        """The joint velocity that exceeds its limit most.

        Args:
            use: as a share of the limit ``(N, nj)``.
            times: ``(N,)`` [s].
        """
        row, joint = (int(i) for i in np.unravel_index(int(use.argmax()), use.shape))
        limit, share = float(self.robot.velocity_limits[joint]), float(use[row, joint])
        return Fault(share - 1.0, f"joint velocity {self.robot.joint_names[joint]}", share * limit,
                     limit, "rad/s", float(times[row]))  # fmt: skip

    def _accelerations(self, sizes: FloatArray, times: FloatArray) -> Fault | None:
        """The joint acceleration that exceeds its limit most, if one does."""
        use = sizes / self.most
        row, joint = (int(i) for i in np.unravel_index(int(use.argmax()), use.shape))
        if use[row, joint] <= 1.0 + ROUNDING:
            return None
        name, needed = self.robot.joint_names[joint], float(sizes[row, joint])
        return Fault(float(use[row, joint]) - 1.0, f"{ACCELERATION} {name}", needed,
                     float(self.most[joint]), "rad/s^2", float(times[row]))  # fmt: skip

    def _positions(self, least: FloatArray, most: FloatArray, times: FloatArray) -> Fault | None:
        """The joint angle that is farthest beyond a limit, if one is."""
        low, high = self.angles
        over = np.maximum(low - least, most - high)
        row, joint = (int(i) for i in np.unravel_index(int(over.argmax()), over.shape))
        if not over[row, joint] > 0.0:
            return None
        above = most[row, joint] > high[joint]
        end = float((high if above else low)[joint])
        value = float((most if above else least)[row, joint])
        own = float(self.robot.position_limits[int(above), joint])
        what = "joint position" if end == own else "reach_fraction, a limit of the knee"
        return Fault(float(over[row, joint]), f"{what} {self.robot.joint_names[joint]}",
                     value, end, "rad", float(times[row]))  # fmt: skip


def bent_knees(robot: Quadruped, reach_fraction: float, joints: FloatArray) -> FloatArray:
    """Limits of joint angles with which legs are no straighter than a plan promises.

    The distance of a foot from its leg's pitch axis falls as the knee bends, so that a share of the
    straight leg is a limit of the knee. A leg that is straighter at the begin may stay as it is.

    Args:
        robot: the robot; legs of other axes than roll-pitch-pitch keep their own limits.
        reach_fraction: share of the legs' reach that is used.
        joints: at the begin ``(nj,)`` [rad].

    Returns:
        Lower and upper limits ``(2, nj)`` [rad].
    """
    limits = np.array(robot.position_limits)
    for name, leg in robot.legs.items():
        column = robot.leg_columns[name][-1]
        if leg.is_general or not reach_fraction < 1.0:
            continue
        # The knee's bending, from 0 (straight) to pi, is side * angle + shift.
        side, shift = leg.knee * leg.signs[-1], leg.knee * leg.zeros[1]
        now = side * joints[column] + shift
        ends = np.clip(side * limits[:, column] + shift, 0.0, np.pi)
        squares, product = leg.upper**2 + leg.lower**2, 2.0 * leg.upper * leg.lower
        longest = reach_fraction**2 * (squares + product * np.cos(ends.min()))
        least = min(np.arccos(np.clip((longest - squares) / product, -1.0, 1.0)), now)
        if 0.0 <= least <= np.pi:
            straightest = side * (least - shift)
            row = 0 if side > 0.0 else 1
            limits[row, column] = (max if side > 0.0 else min)(limits[row, column], straightest)
    return limits
