"""Motions for a robot's joint controllers, in the shape of ROS's messages."""

from __future__ import annotations

import json

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.files import StrPath, written_whole
from gaitopt.plan.plan import Plan


def export_ros(plan: Plan, path: StrPath, dt: float | None = None) -> None:
    """Write the joints' motion as YAML in the shape of ``trajectory_msgs/JointTrajectory``.

    ``joint_names`` and ``points`` with ``positions`` [rad], ``velocities`` [rad/s] and
    ``time_from_start`` (``sec``, ``nanosec``). A controller that joins the points by straight
    lines follows a plan's own knots exactly, but for the rounding of times to nanoseconds.

    Args:
        plan: the plan.
        path: the file, written whole or not at all.
        dt: time between points [s]; by default the plan's own knots. A coarse ``dt`` cuts the
            corners of the feet's paths.

    Raises:
        InputError: ``dt`` is no positive time, or the file cannot be written.
    """
    motion = plan.knots() if dt is None else plan.sample(dt)
    nanoseconds = np.rint(motion.t * 1e9).astype(np.int64)
    positions, velocities = motion.q[:, 7:], motion.v[:, 6:]
    with written_whole(path) as stream:
        stream.write(
            f"# {plan.robot.name}: {plan.duration:.3f} s, {len(motion)} points\n".replace("\r", " ")
        )
        stream.write("header:\n  stamp: {sec: 0, nanosec: 0}\n  frame_id: ''\njoint_names:\n")
        stream.writelines(f"- {json.dumps(name)}\n" for name in motion.joint_names)
        stream.write("points:\n")
        for time, q, v in zip(nanoseconds.tolist(), positions, velocities, strict=True):
            stream.write(
                f"- positions: {_flow(q)}\n  velocities: {_flow(v)}\n"
                f"  time_from_start: {{sec: {time // 10**9}, nanosec: {time % 10**9}}}\n"
            )


def _flow(values: FloatArray) -> str:
    return "[" + ", ".join(f"{value:.12g}" for value in values) + "]"
