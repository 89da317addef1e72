"""Whether the limbs and the trunk of a planned walk touch the ground or one another on its path."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.robots.collisions.along_paths import path_touches
from gaitopt.robots.rotations import matrix_to_rpy, rpy_to_matrix

EVERY = 0.02
"""Time between the samples [s]: a limb moves a centimetre or two in it, and the search's clearance
is about as much."""
LOOKS = 4
"""Poses for each step at which all pairs of links are looked at. Chosen: wang2020 over hills
(difficulty 1, seed 20) crosses two thighs, and a look for each two steps missed it at times."""
MOST_SAMPLES = 20_000
"""Most samples; longer walks are looked at less often."""


def first_touching_step(plan: Plan, limbs: Limbs) -> int | None:
    """The first step in which limbs or trunk touch the ground, or one another; ``None`` for none.

    Where a shank touches the ground next to its foot it is the step that put the foot there, and -1
    where it stood there at the start. The path is sampled, so this is no proof; the certificate has
    one.

    Args:
        plan: over a height map.
        limbs: the robot's links over it.
    """
    count = min(int(np.ceil(plan.duration / EVERY)) + 1, MOST_SAMPLES)
    times = np.linspace(0.0, plan.duration, count)
    values = plan.path.evaluate(times)
    robot = plan.robot
    axes = rpy_to_matrix(values[:, 3:6]) @ robot.body_axes
    poses = np.concatenate([values[:, :3] + axes @ robot.centre, matrix_to_rpy(axes)], axis=1)
    joints = _leg_joints(plan, values[:, 6:])
    touching = ~replace(limbs, clearance=0.0).clear(poses, joints)
    if touching.any():
        return plan.phase_at(float(times[int(touching.argmax())])).step
    near = ~limbs.near_feet_clear(poses, joints)
    if near.any():
        first = int(near.any(axis=1).argmax())
        return _put_down(plan, LEGS[int(near[first].argmax())], float(times[first]))
    # Where links are quick, knots are nearer to one another than samples.
    times = np.union1d(times, plan.path.times)
    joints = plan.path.evaluate(times)[:, 6:]
    if not path_touches(robot, joints, LOOKS * plan.footholds.steps):
        return None
    phases = np.searchsorted(plan.phase_starts, times, side="right") - 1
    steps = np.array([phase.step for phase in plan.phases])[phases]
    return next((s for s in range(steps.max() + 1)
                 if path_touches(robot, joints[steps == s])), None)  # fmt: skip


def _put_down(plan: Plan, leg: str, time: float) -> int:
    """The step in which a foot flies at a time, or that put it where it stands; -1 for none."""
    return max((s.step for s in plan.swings if s.leg == leg and s.start <= time), default=-1)


def _leg_joints(plan: Plan, joints: FloatArray) -> FloatArray:
    """Joint angles of the legs ``(N, 4, 3)`` [rad]."""
    columns = [list(plan.robot.leg_columns[leg]) for leg in LEGS]
    return np.stack([joints[:, own] for own in columns], axis=1)
