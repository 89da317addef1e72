"""How far the balls of standing feet roll, from one place of the body to the next.

The foot of a plan keeps its place while it stands, and its leg turns. The ball of a real foot rolls
as its leg turns: its centre moves by the radius times the angle. The controller lets it land before
its foothold by half of the way. What is left must be well below the landing radius of the
footholds, for feet that slide a little need a part of it, too.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.terrain.footholds import OPEN_GROUND_RADIUS

MOST_ROLLED = 0.65 * OPEN_GROUND_RADIUS
"""Half of the way that a foot may roll on one foothold [m]. Chosen: in physics feet slide by up to
9 mm beside that, and 20 mm are allowed."""
PLANNED = MOST_ROLLED + 1e-3
"""The same for a plan, whose body may be some millimetres from where the search has it [m]."""


def at_rest(count: int) -> FloatArray:
    """What :func:`rolled_on` begins with, for a number of states ``(N, 4, 3, 2)``."""
    return np.zeros((count, len(LEGS), 3, 2))


def feet_angles(
    limbs: Limbs, feet: FloatArray, before: FloatArray, after: FloatArray
) -> FloatArray:
    """Angles of the legs for two poses of the body ``(2, K, 4, 3)`` [rad].

    Args:
        limbs: the robot's links.
        feet: where the four feet stand ``(K, 4, 3)`` [m].
        before, after: x, y, z, roll, pitch, yaw of the body centre ``(K, 6)``.
    """
    legs = [limbs.robot.legs[leg] for leg in LEGS]
    local = np.stack([limbs.local(feet, before), limbs.local(feet, after)])
    return np.stack([leg.inverse(local[:, :, k]) for k, leg in enumerate(legs)], axis=2)


def rolled_on(
    limbs: Limbs, angles: FloatArray, before: FloatArray, after: FloatArray, rolled: FloatArray
) -> FloatArray:
    """Where the balls of feet have rolled to when the body has moved on.

    Args:
        limbs: the robot's links.
        angles: of the legs, before and after, from :func:`feet_angles` ``(2, K, 4, 3)`` [rad].
        before, after: x, y, z, roll, pitch, yaw of the body centre ``(K, 6)``.
        rolled: how far each foot has rolled along x and y since it landed, and the least and the
            largest of it so far ``(K, 4, 3, 2)`` [m].

    Returns:
        The same after the body's move.
    """
    count, out = len(before), rolled.copy()
    body = limbs.body(np.concatenate([before, after]))
    for k in range(len(LEGS)):
        turns = limbs.spheres.placements(k, np.concatenate(angles[:, :, k]), body)[-1].turns
        turn = _rotation_vectors(turns[count:] @ np.swapaxes(turns[:count], -1, -2))
        # A ball that turns about y by an angle rolls along x by the radius times the angle.
        out[:, k, 0] += limbs.robot.foot_radius * np.stack([turn[:, 1], -turn[:, 0]], axis=1)
    out[:, :, 1] = np.minimum(out[:, :, 1], out[:, :, 0])
    out[:, :, 2] = np.maximum(out[:, :, 2], out[:, :, 0])
    return np.asarray(out)


def half_ways(rolled: FloatArray) -> FloatArray:
    """Half of the way that each foot has rolled on its foothold ``(K, 4)`` [m]."""
    return np.asarray(0.5 * np.linalg.norm(rolled[:, :, 2] - rolled[:, :, 1], axis=-1))


def _rotation_vectors(turns: FloatArray) -> FloatArray:
    """Rotation vectors ``(K, 3)`` [rad] of rotations ``(K, 3, 3)`` by less than half a turn."""
    sine = 0.5 * np.stack(
        [turns[:, j, i] - turns[:, i, j] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1
    )
    size = np.linalg.norm(sine, axis=1)
    angle = np.arctan2(size, 0.5 * (np.trace(turns, axis1=1, axis2=2) - 1.0))
    return np.asarray(sine * (angle / np.maximum(size, 1e-12))[:, None])
