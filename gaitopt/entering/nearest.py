"""``nearest_state``: the state next to a measured one from which a plan may begin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.entering.begin import (
    HIGH,
    SLIDING,
    check_few_feet,
    check_joint_rates,
    foot_velocities,
)
from gaitopt.entering.within_limits import SAME_JOINT, place_within_limits
from gaitopt.errors import InputError
from gaitopt.inputs import check_kind
from gaitopt.plan.state import State
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import feet_from_joints
from gaitopt.robots.whole_body_rates import joint_rates
from gaitopt.terrain.footholds import Footholds


@dataclass(frozen=True, eq=False)
class NearestState:
    """A state from which a plan may begin, and what it has changed.

    Attributes:
        state: that one.
        joints: by how much each joint has to turn to get there ``(nj,)`` [rad].
        body: by how much the base has to move, in the world ``(3,)`` [m].
        turn: angle by which it has to turn [rad].
        changes: what was changed, in words; empty where the state is feasible as it is.
    """

    state: State
    joints: FloatArray
    body: FloatArray
    turn: float
    changes: tuple[str, ...]

    def __repr__(self) -> str:
        return f"NearestState({'; '.join(self.changes) or 'as it is'})"


def nearest_state(
    robot: Quadruped, state: State, footholds: Footholds | None = None
) -> NearestState:
    """The state next to a given one whose joints keep their limits, and whose feet stand.

    A robot that lies with folded legs has its knees at their ends, or a little beyond; what an
    estimator measures is inexact. Plans begin within all limits. The robot first goes
    to this state, by its servos. Feet that stand stay where they are. The body moves as little as
    possible until all joints are within their limits and no links touch. Joints of legs in the air
    move back by themselves.

    Args:
        robot: from :func:`gaitopt.load_robot`.
        state: what was measured.
        footholds: where feet stand, if that is known. A standing foot that is above or below its
            foothold by no more than the landing radius is put onto it; one that is higher counts as
            in the air.

    Returns:
        The state, and what was changed.

    Raises:
        InputError: this is no robot or no state, or the state is that of another robot.
        InfeasibleStateError: no state near this one is feasible; tells which limit is in the way.
    """
    check_kind("robot", robot, Quadruped)
    check_kind("state", state, State)
    if state.joint_names != robot.joint_names:
        raise InputError(
            f"the state is that of a robot with the joints {', '.join(state.joint_names)}, and "
            f"{robot.name} has {', '.join(robot.joint_names)}"
        )
    support, feet, words = _standing_feet(robot, state, footholds)
    base, angles = place_within_limits(robot, state, support, feet)
    words += _told(robot, state, base, angles)
    v, of_rates = _rates(robot, state, support, base, angles)
    near = State.of(robot, base[:3], base[3:], angles, support=support)
    q = near.q if np.abs(near.q - state.q).max() > SAME_JOINT else state.q
    found = State(q, v, support, robot.joint_names)
    moved = np.trace(rpy_to_matrix(base[3:]) @ rpy_to_matrix(state.columns[3:6]).T)
    return NearestState(
        found, frozen(angles - state.q[7:]), frozen(base[:3] - state.q[:3]),
        float(np.arccos(np.clip((moved - 1.0) / 2.0, -1.0, 1.0))), (*words, *of_rates),
    )  # fmt: skip


def _standing_feet(
    robot: Quadruped, state: State, footholds: Footholds | None
) -> tuple[tuple[str, ...], FloatArray, list[str]]:
    """Legs that stand, where all feet are to be ``(4, 3)``, and what was changed.

    Raises:
        InfeasibleStateError: fewer than two feet stand.
    """
    feet = feet_from_joints(robot, state.q[:3], state.columns[3:6], state.q[7:])
    support, words = list(state.support), []
    for i, leg in enumerate(LEGS):
        if footholds is None or leg not in support:
            continue
        high = float(feet[i, 2] - footholds[leg][0, 2])
        if high > footholds.landing_radius:
            support.remove(leg)
            words.append(f"foot {leg} is in the air, {1e3 * high:.1f} mm above its foothold")
        elif abs(high) > HIGH:
            feet[i, 2] -= high
            side = "down" if high > 0.0 else "up"
            words.append(f"foot {leg} {1e3 * abs(high):.1f} mm {side}, onto its foothold")
    check_few_feet(len(support))
    return tuple(support), feet, words


def _told(robot: Quadruped, state: State, base: FloatArray, angles: FloatArray) -> list[str]:
    """What was changed of the posture, in words."""
    low, high = robot.position_limits
    over = np.maximum(low - state.q[7:], state.q[7:] - high)
    words = [
        f"joint {robot.joint_names[k]} was {over[k]:.3g} rad beyond its limit"
        for k in np.flatnonzero(over > 0.0).tolist()
    ]
    far = angles - state.q[7:]
    moved = base[:3] - state.q[:3]
    if np.abs(moved).max() > SAME_JOINT:
        words.append(
            f"the body moves by {1e3 * np.linalg.norm(moved):.1f} mm ({1e3 * moved[2]:+.1f} mm up)"
        )
    if np.abs(far).max() > SAME_JOINT:
        worst = int(np.abs(far).argmax())
        words.append(f"joints turn by at most {abs(far[worst]):.3g} rad "
                     f"({robot.joint_names[worst]})")  # fmt: skip
    return words


def _rates(
    robot: Quadruped, state: State, support: tuple[str, ...], base: FloatArray, angles: FloatArray
) -> tuple[FloatArray, list[str]]:
    """Velocities ``(nv,)`` with which standing feet do not slide, and what was changed.

    Raises:
        InfeasibleStateError: a joint of a standing leg would turn faster than it can.
    """
    speeds = foot_velocities(robot, state)
    turned = rpy_to_matrix(state.columns[3:6])
    linear, angular = turned @ state.v[:3], turned @ state.v[3:6]
    now = rpy_to_matrix(base[3:])
    twist = np.concatenate([linear @ now, angular @ now])
    still = np.array(speeds)
    own = [LEGS.index(leg) for leg in support]
    still[own] = 0.0
    rates = joint_rates(robot, base[3:], angles, twist, still)
    words = [
        f"foot {LEGS[i]} slid at {np.linalg.norm(speeds[i]):.3f} m/s and stands"
        for i in own if np.linalg.norm(speeds[i]) > SLIDING
    ]  # fmt: skip
    flying = np.setdiff1d(robot.leg_joint_columns,
                          [k for leg in support for k in robot.leg_columns[leg]])  # fmt: skip
    most = robot.velocity_limits[flying]
    kept = np.clip(state.v[6:][flying], -most, most)
    for column, before, after in zip(flying, state.v[6:][flying], kept, strict=True):
        if abs(before - after) > 0.0:
            words.append(f"joint {robot.joint_names[column]} turned at {abs(before):.3f} rad/s, "
                         f"now at its limit of {abs(after):.3f} rad/s")  # fmt: skip
    rates[flying] = kept
    check_joint_rates(robot, rates)
    return np.concatenate([twist, rates]), words
