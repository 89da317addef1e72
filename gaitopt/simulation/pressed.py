"""How deep feet are pressed into the ground of a robot that begins in motion.

MuJoCo's contacts are soft: the ground carries a foot only where the foot is a little below the
surface. A robot at rest sinks in before its walk begins. One that moves cannot wait, and on the
surface it would fall by that depth at first, faster than slow joints may turn.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.simulation.model import SimModel, import_mujoco
from gaitopt.simulation.touching import Touching

ROUNDS = 8
"""How often depths are computed anew: how hard a contact is depends on how deep it is. Measured on
walks of wang2020, a1, go2 and hyq: the last round changes them by at most 0.6 %."""
FIRST_DEPTH = 1e-4
"""Depth at which contacts are looked at first [m]; less than feet sink in under a robot's
weight."""
DEEPEST = 5e-3
"""Greatest depth [m]; in the same walks feet sink in by 0.1 to 1.1 mm."""


def press_in(sim: SimModel, touching: Touching, data: Any, loads: FloatArray) -> None:
    """Lower and tilt the body of a state until the ground pushes with planned forces.

    Joint angles stay. With four feet depths are met in the least squares.

    Args:
        sim: the model.
        touching: tells how hard the contacts of each foot are.
        data: MuJoCo's state, with feet on the ground; its base is moved.
        loads: planned normal forces ``(4,)`` [N]; 0 for feet in the air.
    """
    mujoco, legs = import_mujoco(), np.flatnonzero(loads > 0.0)
    begin = np.array(data.qpos)
    mujoco.mj_forward(sim.model, data)
    if not len(legs):
        return
    arms = data.site_xpos[list(sim.sites)][legs] - begin[:3]
    axes = data.xmat[sim.base].reshape(3, 3)
    # Heights of feet change by -sink + w_x y - w_y x, for a small turn w about the base.
    size = float(np.abs(arms[:, :2]).max())
    rows = np.stack([-np.ones(len(legs)), arms[:, 1] / size, -arms[:, 0] / size], axis=1)
    depths = np.full(len(legs), FIRST_DEPTH)
    for _ in range(ROUNDS):
        sink, about_x, about_y = np.linalg.lstsq(rows, -depths, rcond=None)[0]
        change = np.zeros(sim.model.nv)
        change[2] = -sink
        change[3:6] = np.array([about_x, about_y, 0.0]) / size @ axes
        data.qpos[:] = begin
        mujoco.mj_integratePos(sim.model, data.qpos, change, 1.0)
        mujoco.mj_forward(sim.model, data)
        hardness = touching.hardness(data)[legs]
        wanted = loads[legs] / np.where(hardness > 0.0, hardness, np.inf)
        wanted = np.where(hardness > 0.0, np.minimum(wanted, DEEPEST), depths + FIRST_DEPTH)
        # Deeper contacts are harder, so that depths would alternate about those that are wanted.
        depths = (depths + wanted) / 2.0
