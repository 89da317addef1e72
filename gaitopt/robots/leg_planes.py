"""Legs without a roll joint: each foot stays in one plane of the body.

Where all these planes are upright and parallel to the way ahead, such a robot walks straight ahead
over footholds that lie in them: its body moves forward and back, up and down, but not sideways.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.robots.quadruped import Quadruped

UPRIGHT: Final = 1e-6
"""Largest component of a pitch axis across the body's y axis that counts as rounding [1]. Over the
length of a leg it moves a foot by less than a micrometre."""


def foot_planes(robot: Quadruped) -> FloatArray | None:
    """How far to the left of the body centre each foot's plane lies ``(4,)`` [m].

    Legs are in the order of :data:`gaitopt.LEGS`. It is ``None`` where all legs have roll joints.

    Raises:
        InputError: a leg without roll joint has a pitch axis that is not the body's y axis.
    """
    if all(leg.has_roll for leg in robot.legs.values()):
        return None
    places = np.empty(len(LEGS))
    for i, name in enumerate(LEGS):
        leg = robot.legs[name]
        axis = leg.axes[:, 1]
        off = float(np.hypot(axis[0], axis[2]))
        if off > UPRIGHT:
            raise InputError(
                f"{robot.name}: leg {name} has no roll joint, and its foot moves in a plane that "
                f"is turned by {np.arcsin(min(off, 1.0)):.3g} rad against the way ahead; such a "
                "robot cannot walk straight ahead with feet that stand still"
            )
        places[i] = leg.hip[1] + leg.lateral * axis[1] - robot.centre[1]
    return places
