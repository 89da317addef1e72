"""Links of a robot over time: places, rotations and velocities in the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.exporting.names import check_names
from gaitopt.exporting.sampled import Samples
from gaitopt.robots.quadruped import Quadruped


@dataclass(frozen=True, eq=False)
class LinkMotion:
    """Links at ``N`` samples.

    Attributes:
        names: of the links.
        positions: ``(N, L, 3)`` [m].
        quaternions: w, x, y, z ``(N, L, 4)``.
        linear, angular: velocities in the world's axes, each ``(N, L, 3)`` [m/s, rad/s].
    """

    names: tuple[str, ...]
    positions: FloatArray
    quaternions: FloatArray
    linear: FloatArray
    angular: FloatArray


def moving_links(robot: Quadruped) -> tuple[str, ...]:
    """The base, one link for every joint, and the feet.

    Raises:
        InputError: a name is not safe to write.
    """
    import pinocchio as pin

    first: dict[int, str] = {}
    for frame in robot.model.frames:
        if frame.type == pin.FrameType.BODY and frame.parentJoint > 0:
            first.setdefault(int(frame.parentJoint), str(frame.name))
    feet = [robot.legs[leg].foot for leg in LEGS]
    names = [first[j] for j in sorted(first)]
    return check_names([*names, *(foot for foot in feet if foot not in names)], "link")


def link_motion(samples: Samples, names: tuple[str, ...]) -> LinkMotion:
    """Where links are, and how they move."""
    import pinocchio as pin

    model = samples.source.plan.robot.model
    data: Any = model.createData()
    ids = [model.getFrameId(name, pin.FrameType.BODY) for name in names]
    count, q, v = len(samples), samples.vectors.q, samples.vectors.v
    places, turns = np.empty((count, len(ids), 3)), np.empty((count, len(ids), 4))
    rates = np.empty((count, len(ids), 6))
    for row in range(count):
        pin.forwardKinematics(model, data, q[row], v[row])
        pin.updateFramePlacements(model, data)
        for k, frame in enumerate(ids):
            pose = pin.SE3ToXYZQUAT(data.oMf[frame])
            places[row, k], turns[row, k] = pose[:3], pose[[6, 3, 4, 5]]
            rates[row, k] = pin.getFrameVelocity(
                model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            ).vector
    return LinkMotion(names, places, turns, rates[..., :3], rates[..., 3:])
