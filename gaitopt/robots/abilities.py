"""What sets the pace of a robot's walks: its joints, or contact forces."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import GRAVITY
from gaitopt.robots.quadruped import Quadruped

TURN = np.radians(17.0)
"""A rotation of a joint in a step [rad]: what the joints of wang2020 turn in a second ([Wang2020],
Table I)."""
FORCE_TIME_SHARE = 0.5
"""Share of the time in which a pendulum as long as a leg turns by one radian: in less than this
time forces hardly let a body change its velocity."""


def has_quick_joints(robot: Quadruped) -> bool:
    """Whether forces, and not joints, set the pace of a robot's walks.

    So it is where the slowest joint turns by :data:`TURN` in less than a share of the time in which
    a pendulum as long as a leg turns by one radian.
    """
    legs = robot.legs.values()
    slowest = min(float(leg.velocity_limits.min()) for leg in legs)
    reach = max(leg.upper + leg.lower for leg in legs)
    return bool(TURN / slowest < FORCE_TIME_SHARE * float(np.sqrt(reach / GRAVITY)))
