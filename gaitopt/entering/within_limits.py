"""The nearest place of the body at which joints keep their limits and links are apart."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.entering.begin import check_apart
from gaitopt.errors import InfeasibleStateError
from gaitopt.optimize.quadratic import QuadraticSolver
from gaitopt.plan.state import State
from gaitopt.robots.collisions.pairs import TOUCHING, CollisionPairs
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import matrix_to_rpy, rpy_to_matrix
from gaitopt.robots.whole_body import feet_from_joints, joints_from_feet

INSIDE = 1e-3
"""How far inside its limits every joint then is [rad]: more than rounding."""
ROUNDS = 30
"""Most corrections of the body. Usual are three to six."""
LARGEST_TURN = 0.2
"""Largest turn of the body in one correction [rad]; it moves by as much of its height."""
APART = 2.0 * TOUCHING
"""How far apart links then are [m]."""
NEAR, MOST_PAIRS = 5e-3, 8
"""Links that are nearer are looked at [m], and how many of their pairs."""
SMALL = 1e-5
"""Difference of places of the body from which derivatives of distances come, in body heights and
radians."""
FARTHEST = 0.5
"""Farthest that a joint may turn, for a state to be near [rad]."""
SAME_JOINT = 1e-9
"""Joints that differ by less are the same [rad]."""


def place_within_limits(
    robot: Quadruped, state: State, support: tuple[str, ...], feet: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """A place of the body at which all joints are within their limits.

    The body moves by as little as possible, in the least squares of its place in body heights and
    of its turn: a sequence of quadratic programs, each with the joints' derivatives of that place.

    Args:
        robot: the robot.
        state: what was measured.
        support: legs that stand.
        feet: where all feet are to be ``(4, 3)`` [m].

    Returns:
        Columns of the base ``(6,)`` [m, rad] and angles of all joints ``(nj,)`` [rad].

    Raises:
        InfeasibleStateError: no such place is near.
    """
    low, high = (np.array(each) for each in robot.position_limits)
    inside = np.minimum(INSIDE, 0.25 * (high - low))
    low, high = low + inside, high - inside
    angles, base = robot.neutral_joints(), np.array(state.columns[:6])
    angles[robot.leg_joint_columns] = state.q[7:][robot.leg_joint_columns]
    standing = np.array([column for leg in support for column in robot.leg_columns[leg]])
    others = np.setdiff1d(robot.leg_joint_columns, standing)
    angles[others] = np.clip(angles[others], low[others], high[others])
    begin, size = np.array(base), robot.standing_height
    # What is already within its limits, if only just, stays.
    low, high = np.minimum(low, _kept(robot, angles, 0)), np.maximum(high, _kept(robot, angles, 1))
    pairs = CollisionPairs.of(robot)
    solver = QuadraticSolver(6, 2 * len(standing) + MOST_PAIRS)
    for _ in range(ROUNDS):
        slopes, misses = _derivatives(robot, support, base, angles, feet)
        scaled = slopes * np.array([size] * 3 + [1.0] * 3)
        close, gaps = _gaps(pairs, angles, standing, scaled)
        over = np.maximum(low - angles, angles - high)[standing].max(initial=0.0)
        touch = gaps.min(initial=np.inf) < TOUCHING
        if over <= 0.0 and not touch and np.abs(misses).max(initial=0.0) <= SAME_JOINT:
            break
        now = angles[standing] + misses
        gone = np.append((base[:3] - begin[:3]) / size, _turn_from(begin[3:], base[3:]))
        rows = np.concatenate([scaled, -scaled, close])
        least = np.concatenate([low[standing] - now, now - high[standing], APART - gaps])
        step, _ = solver.solve(np.eye(6), gone, rows, least)
        step *= min(1.0, LARGEST_TURN / max(float(np.abs(step).max()), 1e-12))
        angles[standing] += misses + scaled @ step
        base = np.concatenate([
            base[:3] + size * step[:3],
            matrix_to_rpy(_small_turn(step[3:]) @ rpy_to_matrix(base[3:])),
        ])  # fmt: skip
    _check_found(robot, state, support, base, angles, feet)
    check_apart(robot, angles)
    own = np.array([leg in support for leg in LEGS])
    feet_now = feet_from_joints(robot, base[:3], base[3:], angles)
    feet_now[own] = feet[own]
    return base, joints_from_feet(robot, base[:3], base[3:], feet_now)


def _kept(robot: Quadruped, angles: FloatArray, side: int) -> FloatArray:
    """Limits on one side for joints that are within the robot's; none for others."""
    limit = robot.position_limits[side]
    within = angles >= limit if side == 0 else angles <= limit
    return np.where(within, angles, -np.inf if side else np.inf)


def _derivatives(
    robot: Quadruped, support: tuple[str, ...], base: FloatArray, angles: FloatArray,
    feet: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """How the joints of standing legs follow the body, and what they miss.

    Returns:
        Derivatives ``(3 k, 6)`` by the base's place [rad/m] and turn about the world's axes, and
        the changes of angles ``(3 k,)`` that bring feet back onto their places [rad].
    """
    turned = rpy_to_matrix(base[3:]) @ robot.body_axes
    places = feet_from_joints(robot, base[:3], base[3:], angles)
    slopes, misses = [], []
    for leg in support:
        columns = list(robot.leg_columns[leg])
        i = LEGS.index(leg)
        jacobian = turned @ robot.legs[leg].jacobian(angles[columns])
        inverse = np.linalg.pinv(jacobian, rcond=1e-6)
        arm = places[i] - base[:3]
        # d foot = d place + turn x arm + jacobian d angles = 0.
        cross = np.array([[0.0, arm[2], -arm[1]], [-arm[2], 0.0, arm[0]], [arm[1], -arm[0], 0.0]])
        slopes.append(-inverse @ np.hstack([np.eye(3), cross]))
        misses.append(inverse @ (feet[i] - places[i]))
    return np.concatenate(slopes), np.concatenate(misses)


def _gaps(
    pairs: CollisionPairs | None, angles: FloatArray, standing: np.ndarray, slopes: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Distances of links that are near one another, and their derivatives by the body's place.

    Args:
        pairs: of links; ``None`` where their shapes are not known.
        angles: of all joints ``(nj,)`` [rad].
        standing: joints of standing legs ``(3 k,)``.
        slopes: of their angles by the body's place ``(3 k, 6)``.

    Returns:
        Derivatives ``(MOST_PAIRS, 6)`` and distances ``(MOST_PAIRS,)`` [m]; 0 and :data:`NEAR`
        where fewer are near.
    """
    rows, gaps = np.zeros((MOST_PAIRS, 6)), np.full(MOST_PAIRS, NEAR)
    if pairs is None:
        return rows, gaps
    around = np.repeat(angles[None], 7, axis=0)
    around[1:, standing] += SMALL * slopes.T
    now = pairs.distances(around[:1, pairs.columns])[0]
    near = np.argsort(now)[:MOST_PAIRS]
    near = near[now[near] < NEAR]
    if len(near):
        found = pairs.distances(around[:, pairs.columns], near.tolist())
        rows[: len(near)] = (found[1:] - found[0]).T / SMALL
        gaps[: len(near)] = found[0]
    return rows, gaps


def _turn_from(first: FloatArray, now: FloatArray) -> FloatArray:
    """The turn from one roll, pitch and yaw to another, as a vector ``(3,)`` [rad]."""
    import pinocchio as pin

    return np.asarray(pin.log3(rpy_to_matrix(now) @ rpy_to_matrix(first).T))


def _small_turn(vector: FloatArray) -> FloatArray:
    import pinocchio as pin

    return np.asarray(pin.exp3(vector))


def _check_found(
    robot: Quadruped, state: State, support: tuple[str, ...], base: FloatArray,
    angles: FloatArray, feet: FloatArray,
) -> None:  # fmt: skip
    """Refuse a place that is not within the limits, or not near.

    Raises:
        InfeasibleStateError: names the joint, and by how much.
    """
    low, high = robot.position_limits
    over = np.maximum(low - angles, angles - high)
    worst = int(over.argmax())
    own = [LEGS.index(leg) for leg in support]
    places = feet_from_joints(robot, base[:3], base[3:], angles)
    off = float(np.linalg.norm((places - feet)[own], axis=1).max())
    if over[worst] > SAME_JOINT or off > SAME_JOINT:
        name = robot.joint_names[worst]
        raise InfeasibleStateError(
            f"start: no place of the body over these feet was found at which all joints keep their "
            f"limits; {name} remains {max(float(over[worst]), 0.0):.3g} rad beyond its own, and "
            f"feet {1e3 * off:.3g} mm off; move the feet",
            f"joint position {name}", float(over[worst]), 0.0, "rad",
        )  # fmt: skip
    far = np.abs(angles - state.q[7:])[robot.leg_joint_columns]
    worst = int(far.argmax())
    if far[worst] > FARTHEST:
        name = robot.joint_names[int(robot.leg_joint_columns[worst])]
        raise InfeasibleStateError(
            f"start: the nearest state within all limits is not near: joint {name} would have to "
            f"turn by {far[worst]:.3g} rad, at most {FARTHEST} rad count as near; move it first",
            f"joint position {name}", float(far[worst]), FARTHEST, "rad",
        )  # fmt: skip
