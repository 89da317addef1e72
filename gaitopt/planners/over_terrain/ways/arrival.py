"""The end of a walk over a map: on the last footholds the body moves to the goal."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.entering.ending import ended
from gaitopt.errors import InfeasibleStateError, InputError
from gaitopt.plan.plan import Plan
from gaitopt.plan.rolled_feet import first_rolling_step
from gaitopt.plan.state import State
from gaitopt.planners.over_terrain.from_state import pose_of
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.links.rolling import PLANNED
from gaitopt.planners.over_terrain.search import Search
from gaitopt.robots.collisions.along_paths import path_touches
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import matrix_to_rpy, rpy_to_matrix
from gaitopt.robots.whole_body import base_of_body, configuration

SHARES = (1.0, 0.75, 0.5, 0.25)
"""Shares of the way to the goal that are tried one after the other."""
SAMPLES = 17
"""Places on this way at which legs and trunk are looked at."""
THERE = 1e-3
"""A body that is no farther from the goal than this stays where it is [m, rad]."""


def arrived(plan: Plan, search: Search) -> Plan:
    """The walk of a plan, with the body at the goal in the end, or as near to it as it gets.

    After the last step the body stands where the centre of mass keeps its margin on three feet.
    From there it moves straight to the goal, on four feet and as fast as forces allow. It is then
    turned as the course is at its end, and lies over its feet as usual. Where legs do not reach,
    or something touches, it moves less far.

    Args:
        plan: of a walk over the course of the search, which rests in the end.
        search: the search.
    """
    if plan.settings.promised_forces is None:
        return plan
    goal = search.course.poses[-1]
    feet = np.array([[plan.footholds[leg][-1] for leg in LEGS]])
    posture = search.judge.posture_over(feet, goal[2:])[0]
    end = plan.state(plan.duration)
    begin = np.concatenate([pose_of(plan.robot, end)[:2], _posture(plan, end)])
    way = np.append(goal[:2], posture) - begin
    way[5] = (way[5] + np.pi) % (2.0 * np.pi) - np.pi
    if max(np.linalg.norm(way[:2]), abs(way[5])) <= THERE:
        return plan
    for share in SHARES:
        poses = begin + share * np.linspace(0.0, 1.0, SAMPLES)[:, None] * way
        joints = _joints(search, feet[0], poses)
        if joints is None:
            continue
        columns = _columns(plan.robot, end, joints)
        if not _clear(search.limbs, poses, joints, columns):
            continue
        try:
            there = ended(plan, _state(plan.robot, poses[-1], columns[-1]))
        except (InfeasibleStateError, InputError):
            continue
        if first_rolling_step(there, PLANNED) is None:
            return there
    return plan


def off_goal(plan: Plan, goal: FloatArray) -> float:
    """How far the body is beside a goal ``(2,)`` when a plan ends, as seen from above [m]."""
    return float(np.linalg.norm(pose_of(plan.robot, plan.state(plan.duration))[:2] - goal[:2]))


def _posture(plan: Plan, state: State) -> FloatArray:
    """Height of the body centre, and roll, pitch and yaw of the body ``(4,)`` [m, rad]."""
    turned = rpy_to_matrix(state.columns[3:6]) @ plan.robot.body_axes
    height = state.columns[2] + (turned @ plan.robot.centre)[2]
    return np.append(height, matrix_to_rpy(turned))


def _joints(search: Search, feet: FloatArray, poses: FloatArray) -> FloatArray | None:
    """Angles of the legs ``(n, 4, 3)`` [rad] for feet and poses of the body; None out of reach."""
    count = len(poses)
    local = search.limbs.local(np.repeat(feet[None], count, axis=0), poses)
    angles, kept = zip(*(search.judge.within(k, local[:, k]) for k in range(4)), strict=True)
    return np.stack(angles, axis=1) if np.all(kept) else None


def _clear(limbs: Limbs, poses: FloatArray, joints: FloatArray, columns: FloatArray) -> bool:
    """Whether nothing touches the ground, and no link another one."""
    return bool(
        limbs.clear(poses, joints).all()
        and limbs.near_feet_clear(poses, joints).all()
        and not path_touches(limbs.robot, columns)
    )


def _columns(robot: Quadruped, rest: State, joints: FloatArray) -> FloatArray:
    """All joints ``(n, nj)`` [rad], with the angles of the legs ``(n, 4, 3)`` [rad]."""
    columns = np.repeat(rest.q[None, 7:], len(joints), axis=0)
    columns[:, robot.leg_joint_columns] = joints.reshape(len(joints), -1)
    return columns


def _state(robot: Quadruped, pose: FloatArray, columns: FloatArray) -> State:
    """The state at rest on four feet with the body in a pose ``(6,)`` and these joints."""
    base = base_of_body(robot, pose[:3], rpy_to_matrix(pose[3:]))
    q = configuration(robot, base[:3], base[3:], columns)
    return State(q, np.zeros(6 + len(columns)), LEGS, robot.joint_names)
