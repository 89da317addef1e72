"""From the poses of a straight walk to a dense path in which every piece takes its exact time.

Between two knots the body moves along a straight line, and the legs that stand follow by exact
inverse kinematics on a dense grid. A leg that flies on a free curve moves along a straight line in
joint space; a foot that flies along its box follows the box. Every piece of the path takes the time
``max |dq| / w`` over all joints with their velocity limits ``w``. So joint velocities are within
their limits whatever the solver's answer is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, rotation_z
from gaitopt.errors import SolverError
from gaitopt.motion.body_and_feet import base_poses, slip_between
from gaitopt.optimize.route.legs import BODY, FOOT, JOINTS, ORIENTATION, StackedLegs
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.phase_by_phase.timing import SLIP_TOLERANCE
from gaitopt.planners.time_optimal.dense import DensePath
from gaitopt.planners.time_optimal.knots import Flying, RouteKnots
from gaitopt.robots.quadruped import Quadruped

FIRST_PIECES = 4
"""Pieces into which every interval is cut at first."""
MOST_PIECES = 512
"""Most pieces of an interval: feet that slip even then are at a singularity of a leg."""
SLIP_RESERVE = 1.2
"""Factor by which the slip is overestimated where the number of pieces is chosen."""


def densify(
    robot: Quadruped,
    settings: RouteSettings,
    knots: RouteKnots,
    legs: StackedLegs,
    poses: FloatArray,
) -> DensePath:
    """A dense path through the poses of all knots ``(K, 9)``.

    Raises:
        SolverError: standing feet leave their footholds between knots, or the poses leave a leg's
            reach.
    """
    counts = np.full(len(poses) - 1, FIRST_PIECES)
    while True:
        pieces = _cut(knots, counts)
        dense = _dense_path(robot, settings, knots, legs, poses, pieces)
        slip = _slip(robot, settings, knots, dense, pieces)
        worst = np.zeros(len(counts))
        # Out of reach the slip is not a number.
        with np.errstate(invalid="ignore"):
            np.maximum.at(worst, pieces.interval, slip)
        coarse = worst > SLIP_TOLERANCE
        if not coarse.any():
            return dense
        if (counts[coarse] >= MOST_PIECES).any() or not np.isfinite(slip).all():
            k = int(np.argmax(np.where(np.isfinite(worst), worst, np.inf)))
            raise SolverError(
                f"step {knots.step[k]}: standing feet leave their places by {worst[k]:.2g} m "
                f"between knots, even with {MOST_PIECES} parts; take reach_fraction below 1",
                step=int(knots.step[k]),
            )
        # The slip in the middle of a piece falls with the square of its length.
        more = np.ceil(counts * np.sqrt(SLIP_RESERVE * worst / SLIP_TOLERANCE)).astype(int)
        counts = np.where(coarse, np.minimum(more, MOST_PIECES), counts)


class _Pieces(NamedTuple):
    """The pieces into which intervals are cut.

    Attributes:
        interval: the interval that each piece is part of ``(N,)``.
        begin, end: where it begins and ends, as shares of the interval ``(N,)``.
        flying: which foot flies.
        is_last: whether it is the last piece of its interval ``(N,)``.
    """

    interval: np.ndarray
    begin: FloatArray
    end: FloatArray
    flying: Flying
    is_last: np.ndarray

    @property
    def counts(self) -> np.ndarray:
        """Number of pieces of each interval ``(K - 1,)``."""
        return np.bincount(self.interval)


def _cut(knots: RouteKnots, counts: np.ndarray) -> _Pieces:
    """Cut every interval into so many pieces ``(K - 1,)`` of equal length."""
    interval = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(interval)) - np.repeat(np.cumsum(counts) - counts, counts)
    of_interval = counts[interval]
    flying = knots.flying_on_intervals.at(interval)
    return _Pieces(interval, number / of_interval, (number + 1.0) / of_interval, flying,
                   number == of_interval - 1)  # fmt: skip


def _dense_path(
    robot: Quadruped,
    settings: RouteSettings,
    knots: RouteKnots,
    legs: StackedLegs,
    poses: FloatArray,
    pieces: _Pieces,
) -> DensePath:
    """The path with these pieces."""
    begin, end = (_poses_at(knots, poses, pieces, share) for share in (pieces.begin, pieces.end))
    feet, in_air = knots.feet[pieces.interval], (~pieces.flying.stands).astype(np.float64)
    begin_joints, end_joints = (legs.joints(pose, feet, in_air) for pose in (begin, end))
    need = np.abs(end_joints - begin_joints).reshape(-1, JOINTS) / legs.velocity_limits.ravel()
    # Out of reach there are no angles: that shows as slip.
    need = np.nan_to_num(need, nan=0.0)
    if settings.free.swing:
        need = np.where(np.repeat(pieces.flying.stands, 3, axis=1), need, 0.0)
    taken, slowest = need.max(axis=1), need.argmax(axis=1)
    if settings.free.swing:
        at_knots = legs.joints(poses, knots.feet, knots.in_air)
        taken, slowest, whole = _with_flying_legs(knots, legs, at_knots, pieces, taken, slowest)
        shares = _shares_of_time(pieces, taken, whole)
        for joints, share in zip((begin_joints, end_joints), shares, strict=True):
            _fill_in_flying_legs(joints, at_knots, pieces, share)
    times = np.concatenate([[0.0], taken])
    # Times are rounded to their spacing; two more of it keep every velocity within its limit.
    times[times > 0.0] += 2.0 * np.spacing(times.sum())
    through = np.concatenate([begin[:1], end])
    joints = np.tile(robot.neutral_joints(), (len(through), 1))
    joints[:, robot.leg_joint_columns] = np.concatenate([begin_joints[:1], end_joints]).reshape(
        -1, JOINTS
    )
    base = base_poses(robot, settings.heading, through[:, BODY], through[:, ORIENTATION])
    at = np.concatenate([[0], np.cumsum(pieces.counts)])
    return DensePath(base, through[:, BODY], joints, np.cumsum(times),
                     robot.leg_joint_columns[slowest], at)  # fmt: skip


def _slip(
    robot: Quadruped, settings: RouteSettings, knots: RouteKnots, dense: DensePath, pieces: _Pieces
) -> FloatArray:
    """How far standing feet are from their footholds in the middle of each piece ``(N,)`` [m]."""
    places = knots.feet[pieces.interval] @ rotation_z(settings.heading).T
    return slip_between(robot, dense.values, places, pieces.flying.stands)


def _poses_at(
    knots: RouteKnots, poses: FloatArray, pieces: _Pieces, share: FloatArray
) -> FloatArray:
    """Poses at shares of the pieces' intervals ``(N, 9)``, along straight lines between knots.

    The foot is that of the interval's leg, in the air or not.
    """
    interval, leg, s = pieces.interval, pieces.flying.leg, share[:, None]
    feet = knots.feet_at_knots(poses[:, FOOT])
    out = poses[interval] * (1.0 - s) + poses[interval + 1] * s
    out[:, FOOT] = feet[interval, leg] * (1.0 - s) + feet[interval + 1, leg] * s
    return np.asarray(out)


def _with_flying_legs(
    knots: RouteKnots,
    legs: StackedLegs,
    at_knots: FloatArray,
    pieces: _Pieces,
    taken: FloatArray,
    slowest: np.ndarray,
) -> tuple[FloatArray, np.ndarray, FloatArray]:
    """Times of all pieces, and the joints that set them, when legs fly on free curves.

    Where a flying leg needs more time for an interval than the other legs, all pieces of the
    interval are stretched by the same factor.

    Args:
        knots, legs: of the walk.
        at_knots: joint angles at all knots ``(K, 4, 3)`` [rad].
        pieces: of the path.
        taken: time of each piece by the standing legs ``(N,)`` [s].
        slowest: the joint that sets it, leg by leg ``(N,)``.

    Returns:
        Times, joints, and the times of whole intervals ``(K - 1,)`` [s].
    """
    swing = np.flatnonzero(knots.is_swing)
    leg = knots.leg[swing]
    need = np.abs(at_knots[swing + 1, leg] - at_knots[swing, leg]) / legs.velocity_limits[leg]
    own, own_joint = np.zeros(len(knots.step)), np.zeros(len(knots.step), dtype=int)
    own[swing], own_joint[swing] = need.max(axis=1), 3 * leg + need.argmax(axis=1)
    others = np.bincount(pieces.interval, taken, minlength=len(own))
    interval = pieces.interval
    with np.errstate(divide="ignore", invalid="ignore"):
        stretched = np.where(
            others[interval] > 0.0,
            taken * (own / others)[interval],
            own[interval] * (1.0 / pieces.counts)[interval],
        )
    waits = (own > others)[interval]
    taken = np.where(waits, stretched, taken)
    return taken, np.where(waits, own_joint[interval], slowest), np.maximum(others, own)


def _shares_of_time(
    pieces: _Pieces, taken: FloatArray, whole: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Share of its interval's time that has passed at each piece's begin and end ``(N,)``.

    Args:
        pieces: of the path.
        taken: time of each piece ``(N,)`` [s].
        whole: time of each interval ``(K - 1,)`` [s].
    """
    until = np.concatenate([[0.0], np.cumsum(taken)])
    first = np.concatenate([[0], np.cumsum(pieces.counts)])[:-1]
    interval = pieces.interval
    with np.errstate(divide="ignore", invalid="ignore"):
        end = (until[1:] - until[first][interval]) / whole[interval]
    end = np.where(whole[interval] > 0.0, end, 1.0)
    end = np.where(pieces.is_last, 1.0, np.clip(end, 0.0, 1.0))
    begin = np.where(pieces.begin == 0.0, 0.0, np.append(0.0, end[:-1]))
    return begin, end


def _fill_in_flying_legs(
    joints: FloatArray, at_knots: FloatArray, pieces: _Pieces, share: FloatArray
) -> None:
    """Write the angles of flying legs into ``joints (N, 4, 3)``: straight lines in joint space.

    Args:
        joints: of all legs; only those of flying legs are changed.
        at_knots: joint angles at all knots ``(K, 4, 3)`` [rad].
        pieces: of the path.
        share: share of the interval's time at which the angles are wanted ``(N,)``.
    """
    flying = np.flatnonzero(pieces.flying.flies)
    interval, leg, s = pieces.interval[flying], pieces.flying.leg[flying], share[flying, None]
    joints[flying, leg] = at_knots[interval, leg] * (1.0 - s) + at_knots[interval + 1, leg] * s
