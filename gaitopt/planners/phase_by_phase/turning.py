"""Moves of a body that turns: from one given posture to the next while four feet stand.

The base goes along a straight line and its roll, pitch and yaw change evenly, so that the retiming
sees one straight line as well. A level body is moved by :mod:`.timing`.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, rotation_z
from gaitopt.motion.body_and_feet import base_poses, slip_between
from gaitopt.planners.phase_by_phase.joint_checks import check_within_reach
from gaitopt.planners.phase_by_phase.refinement import Knots, PoseAt
from gaitopt.planners.phase_by_phase.steps import CrawlSteps, feet_in_body
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import joints_from_feet_in_body


def base_targets(robot: Quadruped, steps: CrawlSteps, cogs: FloatArray) -> FloatArray:
    """The base's x, y, z, roll, pitch, yaw in the world, at the start and during each swing.

    Args:
        robot, steps: the walk; its body is turned.
        cogs: body centre there ``(S + 1, 3)`` [m], in the heading frame.

    Returns:
        ``(S + 1, 6)`` [m, rad].
    """
    assert steps.tilts is not None
    return base_poses(robot, steps.heading, cogs, steps.tilts)


def turning_pose(robot: Quadruped, steps: CrawlSteps, bases: FloatArray) -> PoseAt:
    """Base and joints along the stance moves of a body that turns.

    Args:
        robot, steps: the walk.
        bases: from :func:`base_targets`.
    """
    shifts = np.diff(bases, axis=0)
    places = steps.feet @ rotation_z(steps.heading).T

    def pose(at: Knots) -> tuple[FloatArray, FloatArray, FloatArray]:
        base = bases[at.step] + shifts[at.step] * at.share[:, None]
        feet = places[at.step]
        turns = rpy_to_matrix(base[:, 3:]) @ robot.body_axes
        centres = base[:, :3] + turns @ robot.centre
        local = feet_in_body(robot, feet, centres, turns)
        joints = joints_from_feet_in_body(robot, local)
        for i, name in enumerate(LEGS):
            check_within_reach(robot.legs[name], local[:, i], at.step, steps)
        values = np.concatenate([base, joints], axis=1)
        standing = np.ones((len(base) - 1, len(LEGS)), dtype=np.bool_)
        return base, joints, slip_between(robot, values, feet[1:], standing)

    return pose
