"""True-COM stability of a time-optimal route: its rows at knots, and what holds between them.

At knots the true centre of mass keeps its margin by rows of the problem. Between two knots it
leaves its chord a little; the dense motion is measured, and rows at the ends of an interval in
which the margin falls short are raised.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gaitopt.conventions import OTHER_LEGS, FloatArray, rotation_z
from gaitopt.optimize.route.centre_of_mass import ComRows, MassDistribution
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.stability.support import pair_lines, triangle_half_planes

if TYPE_CHECKING:
    from gaitopt.plan.settings.time_optimal import RouteSettings
    from gaitopt.planners.time_optimal.dense import Dense
    from gaitopt.planners.time_optimal.knots import RouteKnots

HASTE = 1.1
"""Factor by which rows are raised more than was seen to be needed."""
LEAST_RAISE = 2e-6
"""Least by which rows are raised [m]."""
SIDES = 12
"""Lines through ordered pairs of four feet."""


class Sides(NamedTuple):
    """Sides of the support polygon during every interval; unused ones have the normal zero.

    Attributes:
        normal: pointing inward ``(K - 1, 12, 2)``.
        offset: ``(K - 1, 12)`` [m]; minus infinity where unused.
        phase: a number of the phase that each interval is part of ``(K - 1,)``.
    """

    normal: FloatArray
    offset: FloatArray
    phase: np.ndarray


def support_sides(knots: RouteKnots) -> Sides:
    """Sides of the triangle of three feet where one flies, else of the polygon of all four."""
    count = len(knots.step)
    normal, offset = np.zeros((count, SIDES, 2)), np.full((count, SIDES), -np.inf)
    flies = np.flatnonzero(knots.swings)
    others = OTHER_LEGS[knots.leg[flies]]
    corners = np.take_along_axis(knots.feet[flies], others[..., None], axis=1)[..., :2]
    normal[flies, :3], offset[flies, :3] = triangle_half_planes(corners)
    stands = np.flatnonzero(~knots.swings)
    lines, heights, used = pair_lines(knots.feet[stands][:, :, :2])
    normal[stands] = np.where(used[..., None], lines, 0.0)
    offset[stands] = np.where(used, heights, -np.inf)
    return Sides(normal, offset, 2 * knots.step + knots.swings)


class BalanceRows(NamedTuple):
    """Which knot keeps which side.

    Attributes:
        knot: of each row ``(M,)``, never the first, which is fixed.
        interval: one of the intervals beside it, whose side it keeps ``(M,)``.
        side: number of the side ``(M,)``.
    """

    knot: np.ndarray
    interval: np.ndarray
    side: np.ndarray


def _layout(sides: Sides) -> BalanceRows:
    """A row for every side of the polygon of every phase, at all knots from its first to last."""
    first = np.append(True, np.diff(sides.phase) != 0)
    first[0] = False
    spans = np.concatenate([np.arange(len(first)), np.flatnonzero(first)])
    knots = np.concatenate([np.arange(len(first)) + 1, np.flatnonzero(first)])
    row, side = np.nonzero(np.isfinite(sides.offset[spans]))
    return BalanceRows(knots[row], spans[row], side)


def balance_rows(robot: Quadruped, settings: RouteSettings, knots: RouteKnots) -> ComRows:
    """Rows that keep the stability margin by the true centre of mass at every knot."""
    sides = support_sides(knots)
    rows = _layout(sides)
    margin = settings.stability_margin + settings.margin_reserve
    return ComRows(
        MassDistribution.of(robot), rows.knot, sides.normal[rows.interval, rows.side],
        sides.offset[rows.interval, rows.side] + margin,
    )  # fmt: skip


def dense_com(robot: Quadruped, settings: RouteSettings, dense: Dense) -> FloatArray:
    """The true centre of mass at all dense knots ``(N, 3)`` [m], in the heading frame."""
    joints = dense.joints[:, robot.leg_joint_columns].reshape(-1, 4, 3)
    local = MassDistribution.of(robot).com_in_body(joints)
    turned = rotation_z(-settings.heading) @ rpy_to_matrix(dense.body[:, 3:]) @ robot.body_axes
    return np.asarray(dense.centre + np.einsum("nij,nj->ni", turned, local))


def shortfall(
    robot: Quadruped, settings: RouteSettings, knots: RouteKnots, dense: Dense
) -> FloatArray:
    """How much of the margin the true centre of mass lacks at each side ``(K - 1, 12)`` [m].

    The largest over each interval; negative where there is more than enough. In the first interval
    no more is asked than the robot has where it stands.
    """
    sides = support_sides(knots)
    com = dense_com(robot, settings, dense)[:, :2]
    count = np.diff(dense.knots)
    owner = np.repeat(np.arange(len(count)), count)
    ends = [(sides.normal[owner] @ part[..., None])[..., 0] for part in (com[:-1], com[1:])]
    least = np.minimum.reduceat(np.minimum(*ends), dense.knots[:-1], axis=0)
    wanted = sides.offset + settings.stability_margin + settings.margin_reserve / 2.0
    wanted[0] = np.minimum(wanted[0], ends[0][0])
    return np.asarray(wanted - least)


def raised(rows: ComRows, knots: RouteKnots, short: FloatArray) -> ComRows:
    """The rows with more room beside intervals whose margin fell ``short (K - 1, 12)``."""
    sides = support_sides(knots)
    layout = _layout(sides)
    more = np.zeros(len(layout.knot))
    for beside in (layout.knot - 1, layout.knot):
        interval = np.clip(beside, 0, len(short) - 1)
        same = (interval == beside) & (sides.phase[interval] == sides.phase[layout.interval])
        more = np.maximum(more, np.where(same, short[interval, layout.side], 0.0))
    more = np.where(more > 0.0, HASTE * more + LEAST_RAISE, 0.0)
    return replace(rows, offset=rows.offset + more)
