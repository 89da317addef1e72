"""The curves of a walk in physics."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.viewing.replay.curves.curves import Curves
from gaitopt.viewing.replay.curves.of_plan import (
    MOST_INSTANTS,
    clearance_of,
    joints_of,
    stances,
)
from gaitopt.viewing.replay.physics.contacts import touched_margins
from gaitopt.viewing.replay.physics.happened import Happened
from gaitopt.viewing.replay.scene import FramePath


def physics_curves(happened: Happened, root: FramePath) -> Curves | None:
    """The curves of a simulated motion; ``None`` where it takes no time.

    Of long motions neighbouring samples are put together: the largest shares, the least margin, and
    the mean force.

    Args:
        happened: the walk.
        root: the frame above the robot's base.
    """
    motion, robot, result = happened.motion, happened.walk.robot, happened.result
    if not happened.walk.duration > 0.0:
        return None
    step = int(np.ceil(len(motion) / MOST_INSTANTS))
    first = np.arange(0, len(motion), step)
    times = (motion.t - motion.t[0])[first]
    torque = pressing = None
    notes: tuple[str, ...] = ()
    if result is None:
        notes = ("no torques and forces: give the result of the simulation, not its motion alone",)
    else:
        use = np.abs(result.torques) / robot.effort_limits
        torque = np.maximum.reduceat(use, first)
        if not np.isfinite(robot.effort_limits).any():
            torque, notes = None, ("no torques: their limits are not known",)
        pressing = _mean(np.asarray(result.forces)[..., 2], first, len(motion))
    margin = touched_margins(happened.walk, motion) if robot.mass > 0.0 else None
    if margin is not None:
        margin = np.fmin.reduceat(margin, first)
    return Curves(
        times=times,
        standing=stances(happened.walk),
        velocity_use=np.maximum.reduceat(np.abs(motion.v[:, 6:]) / robot.velocity_limits, first),
        torque_use=torque,
        margin=margin,
        margin_name="centre of mass",
        promised=float(happened.walk.settings.stability_margin),
        pressing=pressing,
        clearance=clearance_of(happened.walk, times, motion.q[first]),
        weight=robot.mass * GRAVITY,
        notes=notes,
        joints=joints_of(robot, root),
    )


def _mean(values: FloatArray, first: np.ndarray, count: int) -> FloatArray:
    """Means of the rows between indices ``first``."""
    lengths = np.diff(np.append(first, count))
    return np.asarray(np.add.reduceat(values, first) / lengths[:, None])
