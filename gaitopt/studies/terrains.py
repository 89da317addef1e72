"""Test terrains in the size of a robot."""

from __future__ import annotations

import numpy as np

from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.columns import PAPER_STEP, s_columns
from gaitopt.terrain.footholds import Footholds

_WANG_REACH = 0.57


def s_columns_for(robot: Quadruped, seed: int = 0, columns: int = 17) -> Footholds:
    """The S-shaped columns of the paper, with feet below this robot's hips and steps to its size.

    Lengths grow with the robot's leg length; for wang2020 this is :func:`gaitopt.s_columns`.

    Args:
        robot: the robot.
        seed: of the random offsets.
        columns: columns a leg; each step is as long as the paper's, to scale.
    """
    scale = round(float(np.mean([leg.reach for leg in robot.legs.values()])) / _WANG_REACH, 6)
    length, width = robot.stance_size
    return s_columns(
        seed,
        columns=columns,
        forward=PAPER_STEP * scale * max(columns - 1, 1),
        amplitude=0.10 * scale,
        wavelength=1.5 * scale,
        jitter=0.02 * scale,
        body_length=length,
        body_width=width,
        diameter=0.04 * scale,
    )
