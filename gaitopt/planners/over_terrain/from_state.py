"""Footholds of a walk over a map, for a robot that stands elsewhere than at their start."""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.entering.begin import HIGH
from gaitopt.entering.standing_up import body_yaw
from gaitopt.errors import InfeasibleStateError
from gaitopt.gait.crawl import WANG_SEQUENCE
from gaitopt.plan.state import State
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import feet_from_joints
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.height_map import HeightMap


def pose_of(robot: Quadruped, state: State) -> FloatArray:
    """Where the body of a state is, and where it faces: x, y, yaw ``(3,)`` [m, rad]."""
    to_world = rpy_to_matrix(state.columns[3:6]) @ robot.body_axes
    centre = state.columns[:3] + to_world @ robot.centre
    return np.append(centre[:2], body_yaw(robot, state))


def reached_from(
    robot: Quadruped, state: State, footholds: Footholds, swing_height: float
) -> Footholds:
    """The footholds with steps to the first of them before, of the feet that stand elsewhere.

    Feet in the air land on their first footholds.

    Args:
        robot: the robot.
        state: its state.
        footholds: on a height map, with an order of the legs.
        swing_height: of the steps that are added [m].

    Raises:
        InfeasibleStateError: a foot that stands is not on the ground; tells which, and how far.
    """
    assert footholds.ground is not None and footholds.order is not None
    feet = feet_from_joints(robot, state.columns[:3], state.columns[3:6], state.q[7:])
    normals = _normals(robot, state, footholds.ground, feet)
    away = np.linalg.norm(feet - [footholds[leg][0] for leg in LEGS], axis=1)
    moves = [
        leg
        for leg in WANG_SEQUENCE
        if leg in state.support and away[LEGS.index(leg)] > footholds.landing_radius
    ]

    def before(of_legs: Any, first: Any) -> dict[str, FloatArray] | None:
        if of_legs is None:
            return None
        return {
            leg: np.concatenate([np.asarray(first(leg))[None], of_legs[leg]])
            if leg in moves else np.array(of_legs[leg])
            for leg in LEGS
        }  # fmt: skip

    def again(of_steps: FloatArray | None) -> FloatArray | None:
        if of_steps is None:
            return None
        return np.concatenate([np.repeat(of_steps[:1], len(moves), axis=0), of_steps])

    friction = footholds.friction
    return footholds.with_(
        points=before(footholds.points, lambda leg: feet[LEGS.index(leg)]),
        normals=before(footholds.normals, lambda leg: normals[LEGS.index(leg)]),
        friction=before(friction, lambda leg: friction[leg][0] if friction else 0.0),
        swing_heights=before(footholds.swing_heights, lambda _: swing_height),
        order=(*moves, *footholds.order), postures=again(footholds.postures),
        body_places=again(footholds.body_places),
    )  # fmt: skip


def _normals(robot: Quadruped, state: State, ground: HeightMap, feet: FloatArray) -> FloatArray:
    """Normals of the ground below the feet that stand ``(4, 3)``.

    Raises:
        InfeasibleStateError: one of them is not on the ground.
    """
    below = ground.ball(feet[:, :2], robot.foot_radius)
    for i, leg in enumerate(LEGS):
        off = float(feet[i, 2] - below.centres[i, 2])
        # A comparison with NaN is false: there the ground is not known.
        if leg in state.support and not abs(off) <= HIGH:
            raise InfeasibleStateError(
                f"start: foot {leg} stands {1e3 * off:.1f} mm above the ground of the map, at most "
                f"{1e3 * HIGH:g} mm are allowed; move the map, or leave the leg out of support "
                "where it is in the air",
                f"contact {leg}", off, HIGH, "m",
            )  # fmt: skip
    return np.array(below.normals)
