"""The true centre of mass in Area A of [Wang2020], eq. (10), in place of the body centre.

The true centre of mass (COM) is not the body centre, and it moves in the body while a foot swings.
How far it is from the body centre depends on the target that is looked for. So the targets are
found anew until the distances from the sides that they were found for hold for them.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, OTHER_LEGS, FloatArray
from gaitopt.optimize.route.centre_of_mass import MassDistribution
from gaitopt.plan.com_margin import true_com
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.steps import CrawlSteps, feet_in_body
from gaitopt.planners.phase_by_phase.swing_polylines import swing_polylines
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import configuration, joints_from_feet_in_body
from gaitopt.stability.support import triangle_half_planes

PLACES = 5
"""Places on each edge of a swing at which the COM is looked at."""
RESERVE = 2e-5
"""Length that is added to what was found, for what is between those places [m]."""


def shifts_at_rest(robot: Quadruped, steps: CrawlSteps, start: FloatArray) -> FloatArray:
    """How much nearer than the body centre the COM is to each side, in the first stance ``(S, 3)``.

    Args:
        robot, steps: the walk.
        start: body centre at the start ``(3,)`` [m], in the heading frame.
    """
    turn = None if steps.turns is None else steps.turns[:1]
    local = feet_in_body(robot, steps.feet[:1], start[None], turn)
    offset = _com_in_body(robot, joints_from_feet_in_body(robot, local))
    if steps.swing_turns is not None:
        # As if the legs kept their angles: a first guess.
        offsets = (steps.swing_turns @ offset[0])[:, :2]
        return np.asarray(-np.einsum("sij,sj->si", _normals(steps), offsets) + RESERVE)
    return np.asarray(-np.einsum("sij,j->si", _normals(steps), offset[0, :2]) + RESERVE)


def shifts_in_swings(steps: CrawlSteps, offsets: FloatArray) -> FloatArray:
    """How much nearer than the body centre the COM comes to each side during swings ``(S, 3)`` [m].

    Args:
        steps: the walk.
        offsets: of the COM during each swing ``(S, n, 2)`` [m].
    """
    return nearer(_normals(steps), offsets)


def nearer(normals: FloatArray, offsets: FloatArray) -> FloatArray:
    """How much nearer than the body centre the COM comes to half-planes during swings ``(S, k)``.

    Args:
        normals: inward normals of the half-planes of each step ``(S, k, 2)``.
        offsets: of the COM during each swing ``(S, n, 2)`` [m]; NaN where it is not known.
    """
    less = -np.einsum("sij,snj->sni", normals, offsets)
    return np.asarray(np.nan_to_num(less, nan=-np.inf).max(axis=1) + RESERVE)


def com_in_swings(
    robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings, cogs: FloatArray
) -> FloatArray:
    """Horizontal places of the COM from the body centre during swings ``(S, n, 2)`` [m].

    They are NaN where a leg does not reach its foot; such a step is refused later, with the reason.

    Args:
        robot, steps, settings: the walk.
        cogs: body centre during each swing ``(S, 3)`` [m], in the heading frame.
    """
    starts = steps.feet[np.arange(len(steps.legs)), steps.indices]
    corners = swing_polylines(settings.swing, starts, steps.targets, steps.lifts)
    share = np.arange(PLACES)[:, None] / PLACES
    inner = corners[:, :-1, None] + np.diff(corners, axis=1)[:, :, None] * share
    foot = np.concatenate([inner.reshape(len(corners), -1, 3), corners[:, -1:]], axis=1)
    count = foot.shape[1]
    feet = np.repeat(steps.feet[:, None], count, axis=1)
    feet[np.arange(len(foot)), :, steps.indices] = foot
    turns = None if steps.swing_turns is None else np.repeat(steps.swing_turns, count, axis=0)
    local = feet_in_body(
        robot, feet.reshape(-1, len(LEGS), 3), np.repeat(cogs, count, axis=0), turns
    )
    with np.errstate(invalid="ignore"):
        joints = joints_from_feet_in_body(robot, local)
    offsets = _com_in_body(robot, joints)
    if turns is not None:
        offsets = (turns @ offsets[..., None])[..., 0]
    return np.asarray(offsets[:, :2].reshape(-1, count, 2))


def _com_in_body(robot: Quadruped, joints: FloatArray) -> FloatArray:
    """The COM from the body centre in the body frame ``(N, 3)`` [m], at joint angles ``(N, nj)``.

    It is NaN where an angle is.
    """
    if all(leg.has_roll and not leg.is_general for leg in robot.legs.values()):
        by_leg = joints[:, robot.leg_joint_columns].reshape(-1, len(LEGS), 3)
        return MassDistribution.of(robot).com_in_body(by_leg)
    robot.require_masses()
    # Not in closed form: legs with other axes than roll-pitch-pitch, or two joints.
    still = np.zeros((len(joints), 3))
    coms = true_com(robot, configuration(robot, still, still, joints))
    return np.asarray(coms @ robot.body_axes - robot.centre)


def _normals(steps: CrawlSteps) -> FloatArray:
    """Inward normals of the support triangles' sides ``(S, 3, 2)``."""
    standing = OTHER_LEGS[steps.indices][..., None]
    corners = np.take_along_axis(steps.feet[..., :2], standing, axis=1)
    return triangle_half_planes(corners)[0]
