"""From the poses of a time-optimal route to a dense, exactly timed path and its phases.

Between the knots of the problem the body moves along straight lines, and standing legs follow by
exact inverse kinematics on a dense grid. A flying leg moves straight in joint space (or along its
box). Every dense interval then takes the arc-length time ``max |dq| / w``: joint velocities are
within their limits whatever the solver did.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray, rotation_z
from gaitopt.errors import SolverError
from gaitopt.motion.body_and_feet import base_poses, slip_between
from gaitopt.optimize.route.legs import BODY, FOOT, ORIENTATION, StackedLegs
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.dense import SLIP_TOLERANCE, Dense
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.robots.quadruped import Quadruped

FIRST_PARTS = 4
MOST_PARTS = 512


def densify(
    robot: Quadruped,
    settings: RouteSettings,
    knots: RouteKnots,
    legs: StackedLegs,
    poses: FloatArray,
) -> Dense:
    """A dense path through the poses of all knots.

    Raises:
        SolverError: standing feet cannot be held in place between knots, or the solution leaves a
            leg's reach.
    """
    parts = np.full(len(poses) - 1, FIRST_PARTS)
    while True:
        dense, slip = _attempt(robot, settings, knots, legs, poses, parts)
        owner = np.repeat(np.arange(len(parts)), parts)
        worst = np.zeros(len(parts))
        np.maximum.at(worst, owner, slip)
        coarse = worst > SLIP_TOLERANCE
        if not coarse.any():
            return dense
        if (parts[coarse] >= MOST_PARTS).any() or not np.isfinite(slip).all():
            k = int(np.argmax(np.where(np.isfinite(worst), worst, np.inf)))
            raise SolverError(
                f"step {knots.step[k]}: standing feet leave their places by {worst[k]:.2g} m "
                f"between knots, even with {MOST_PARTS} parts; take reach_fraction below 1"
            )
        # The error of a chord goes like the square of its length.
        more = np.ceil(parts * np.sqrt(1.2 * worst / SLIP_TOLERANCE)).astype(int)
        parts = np.where(coarse, np.minimum(more, MOST_PARTS), parts)


def _attempt(
    robot: Quadruped,
    settings: RouteSettings,
    knots: RouteKnots,
    legs: StackedLegs,
    poses: FloatArray,
    parts: np.ndarray,
) -> tuple[Dense, FloatArray]:
    """The path with so many parts to each interval, and how far feet slip in each part."""
    owner = np.repeat(np.arange(len(parts)), parts)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
    ends = (place + 1.0) / parts[owner]
    begins = place / parts[owner]
    flying = np.zeros((len(owner), 4))
    flying[np.arange(len(owner)), knots.leg[owner]] = knots.swings[owner]
    sides = [
        _standing(legs, knots, poses, owner, share, flying, not settings.free.swing)
        for share in (begins, ends)
    ]
    taken, slowest = _times(settings, knots, legs, poses, owner, flying, sides)
    times = np.concatenate([[0.0], taken])
    # Times are rounded to their spacing; a little more of it keeps every velocity in its limit.
    times[times > 0.0] += 2.0 * np.spacing(times.sum())
    centre = np.concatenate([sides[0][0][:1], sides[1][0]])
    columns = robot.leg_joint_columns
    joints = np.tile(robot.neutral_joints(), (len(centre), 1))
    joints[0, columns] = sides[0][2][0].ravel()
    joints[1:, columns] = sides[1][2].reshape(-1, 12)
    turns = np.concatenate([sides[0][1][:1], sides[1][1]])
    body = base_poses(robot, settings.heading, centre, turns)
    places = knots.feet[owner] @ rotation_z(settings.heading).T
    slip = slip_between(robot, np.concatenate([body, joints], axis=1), places, flying == 0.0)
    at = np.concatenate([[0], np.cumsum(parts)])
    order = columns[slowest]
    return Dense(body, centre, joints, np.cumsum(times), order, at), slip


def _standing(
    legs: StackedLegs,
    knots: RouteKnots,
    poses: FloatArray,
    owner: np.ndarray,
    share: FloatArray,
    flying: FloatArray,
    box: bool,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Body centre, turn and joints ``(N, 4, 3)`` at shares of intervals; a flying leg's in box."""
    s = share[:, None]
    mixed = poses[owner] * (1.0 - s) + poses[owner + 1] * s
    ends = _feet_at_knots(knots, poses)
    feet = np.where(flying[..., None] > 0, 0.0, knots.feet[owner])
    which = knots.leg[owner]
    foot = ends[owner, which] * (1.0 - s) + ends[owner + 1, which] * s
    mixed[:, FOOT] = foot
    joints = legs.joints(mixed, feet, flying)
    if not box:
        # Straight in joint space; timed later.
        rows = np.flatnonzero(flying.any(axis=1))
        joints[rows, which[rows]] = np.nan
    return mixed[:, BODY], mixed[:, ORIENTATION], joints


def _feet_at_knots(knots: RouteKnots, poses: FloatArray) -> FloatArray:
    """All four feet at every knot ``(K, 4, 3)``."""
    return np.where(knots.flying[..., None] > 0, poses[:, None, FOOT], knots.feet)


def _times(
    settings: RouteSettings,
    knots: RouteKnots,
    legs: StackedLegs,
    poses: FloatArray,
    owner: np.ndarray,
    flying: FloatArray,
    sides: list[tuple[FloatArray, FloatArray, FloatArray]],
) -> tuple[FloatArray, np.ndarray]:
    """Time of every part, and the joint that sets it; fills in the joints of flying legs."""
    rates = legs.velocity_limits.ravel()
    need = (np.abs(sides[1][2] - sides[0][2])).reshape(-1, 12) / rates
    need = np.nan_to_num(need, nan=0.0)
    taken, slowest = need.max(axis=1), need.argmax(axis=1)
    if not settings.free.swing:
        return taken, slowest
    at_knots = legs.joints(poses, knots.feet, knots.flying)
    k = np.flatnonzero(knots.swings)
    way = at_knots[k + 1, knots.leg[k]] - at_knots[k, knots.leg[k]]
    use = np.abs(way) / legs.velocity_limits[knots.leg[k]]
    own, own_joint = np.zeros(len(knots.step)), np.zeros(len(knots.step), dtype=int)
    own[k], own_joint[k] = use.max(axis=1), 3 * knots.leg[k] + use.argmax(axis=1)
    whole = np.bincount(owner, taken, minlength=len(own))
    # Where the flying leg is slower than the body, the body waits for it evenly.
    slower = own > whole
    even = 1.0 / np.bincount(owner)
    with np.errstate(divide="ignore", invalid="ignore"):
        stretched = np.where(
            whole[owner] > 0, taken * (own / whole)[owner], own[owner] * even[owner]
        )
    taken = np.where(slower[owner], stretched, taken)
    slowest = np.where(slower[owner], own_joint[owner], slowest)
    whole = np.maximum(whole, own)
    run = np.cumsum(taken)
    first = np.concatenate([[0.0], run])[np.concatenate([[0], np.cumsum(np.bincount(owner))])[:-1]]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(whole[owner] > 0, (run - first[owner]) / whole[owner], 1.0)
    last = np.append(owner[1:] != owner[:-1], True)
    share = np.where(last, 1.0, np.clip(share, 0.0, 1.0))
    before = np.where(np.append(True, owner[1:] != owner[:-1]), 0.0, np.append(0.0, share[:-1]))
    rows = np.flatnonzero(flying.any(axis=1))
    leg = knots.leg[owner[rows]]
    a, b = at_knots[owner[rows], leg], at_knots[owner[rows] + 1, leg]
    for side, s in ((0, before), (1, share)):
        part = s[rows, None]
        sides[side][2][rows, leg] = a * (1.0 - part) + b * part
    return taken, slowest
