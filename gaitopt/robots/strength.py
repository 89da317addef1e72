"""Whether a robot's torque limits are enough to stand."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import GRAVITY
from gaitopt.robots.quadruped import Quadruped


def strength_warnings(robot: Quadruped) -> list[str]:
    """A warning, if joints are too weak to hold the robot standing with a quarter on each foot.

    The weight of the legs' own links is left out. Files have such limits where their writer did not
    know them.
    """
    weak = []
    angles = robot.standing_joints()
    for name, leg in robot.legs.items():
        columns = list(robot.leg_columns[name])
        push = np.array([0.0, 0.0, robot.mass * GRAVITY / len(robot.legs)])
        needed = np.abs(push @ leg.jacobian(angles[columns]))
        limits = robot.effort_limits[columns]
        weak += [
            f"{joint} {torque:.3g} of {limit:.3g}"
            for joint, torque, limit in zip(leg.joints, needed, limits, strict=True)
            if torque > limit
        ]
    if not weak:
        return []
    more = f" and {len(weak) - 4} more" if len(weak) > 4 else ""
    return [
        f"torque limits are too small to stand [N m]: {', '.join(weak[:4])}{more}; if they are "
        "placeholders, give effort_limits= in N m"
    ]
