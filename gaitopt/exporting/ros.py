"""A plan's motion for a robot's joint controllers, in the format of ROS's messages."""

from __future__ import annotations

import json

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.files import StrPath, written_whole
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan


def export_ros(plan: Plan, path: StrPath, dt: float | None = None) -> None:
    """Write the joints' motion as YAML in the format of ``trajectory_msgs/JointTrajectory``.

    It holds ``joint_names``, and ``points`` with ``positions`` [rad], ``velocities`` [rad/s] and
    ``time_from_start`` (``sec``, ``nanosec``). A controller that interpolates linearly follows the
    knots of a path of degree one exactly, save that times are rounded to nanoseconds.

    Args:
        plan: the plan.
        path: the file; it is complete, or not there at all.
        dt: time between points [s]; by default points are the plan's own knots. With a large
            ``dt`` the feet's paths lose their corners.

    Raises:
        InputError: ``dt`` is no positive time, or the file cannot be written.
    """
    check_kind("plan", plan, Plan)
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
    """Numbers as a YAML list in one line."""
    return "[" + ", ".join(f"{value:.12g}" for value in values) + "]"
