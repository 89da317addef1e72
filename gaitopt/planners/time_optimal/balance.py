"""Static stability of the true centre of mass: its rows at knots, and its margin between them.

With ``com="model"`` rows of the problem keep the true centre of mass inside the support polygon at
every knot. Between two knots it leaves the straight line by a little. So its margin is measured
along the dense path, and where the margin is too small between two knots, the rows at both are
raised: they ask for more.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, rotation_z
from gaitopt.optimize.route.centre_of_mass import ComRows, MassDistribution
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.dense import RESERVE_KEPT, DensePath
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.support import SupportSides, support_sides
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix

COM_OVERCORRECTION = 1.1
"""Factor by which a row is raised more than was measured to be missing."""
LEAST_COM_RAISE = 2e-6
"""Least by which a row is raised [m]."""


def com_rows(robot: Quadruped, settings: RouteSettings, knots: RouteKnots) -> ComRows:
    """Rows by which the true centre of mass keeps the stability margin at every knot but the first.

    At the first knot nothing can be chosen.
    """
    sides, rows = _sides_of_intervals(knots), _row_numbers(knots)
    margin = settings.stability_margin + settings.margin_reserve
    return ComRows(
        MassDistribution.of(robot), rows.knot, sides.normal[rows.interval, rows.side],
        sides.offset[rows.interval, rows.side] + margin,
    )  # fmt: skip


def dense_com(robot: Quadruped, settings: RouteSettings, dense: DensePath) -> FloatArray:
    """The true centre of mass at all dense knots ``(N, 3)`` [m], in the heading frame."""
    columns = [c for leg in LEGS for c in robot.leg_columns[leg]]
    local = MassDistribution.of(robot).com_in_body(dense.joints[:, columns].reshape(-1, 4, 3))
    turned = rotation_z(-settings.heading) @ rpy_to_matrix(dense.base[:, 3:]) @ robot.body_axes
    return np.asarray(dense.body_centre + np.einsum("nij,nj->ni", turned, local))


def margin_shortfall(
    robot: Quadruped, settings: RouteSettings, knots: RouteKnots, dense: DensePath
) -> FloatArray:
    """By how much the true centre of mass comes too near to each side ``(K - 1, 12)`` [m].

    The largest amount on each interval; negative where the margin is kept, and minus infinity where
    there is no side. The margin that is asked for includes :data:`RESERVE_KEPT` of the reserve. On
    the first interval it is not more than the margin with which the robot stands at first.
    """
    sides = _sides_of_intervals(knots)
    com = dense_com(robot, settings, dense)[:, :2]
    pieces = np.diff(dense.at_knots)
    interval = np.repeat(np.arange(len(pieces)), pieces)
    begin, end = ((sides.normal[interval] @ p[..., None])[..., 0] for p in (com[:-1], com[1:]))
    least = np.minimum.reduceat(np.minimum(begin, end), dense.at_knots[:-1], axis=0)
    wanted = sides.offset + settings.stability_margin + settings.margin_reserve * RESERVE_KEPT
    wanted[0] = np.minimum(wanted[0], begin[0])
    return np.asarray(wanted - least)


def with_raised_com_rows(rows: ComRows, knots: RouteKnots, shortfall: FloatArray) -> ComRows:
    """The rows, raised beside the intervals on which the margin is too small.

    Args:
        rows: from :func:`com_rows`, perhaps raised before.
        knots: of the same problem.
        shortfall: from :func:`margin_shortfall` ``(K - 1, 12)`` [m].
    """
    phase, numbers = _phase_of_intervals(knots), _row_numbers(knots)
    missing = np.zeros(len(numbers.knot))
    for beside in (numbers.knot - 1, numbers.knot):
        interval = np.clip(beside, 0, len(shortfall) - 1)
        # An interval of another phase has other sides.
        same = (interval == beside) & (phase[interval] == phase[numbers.interval])
        missing = np.maximum(missing, np.where(same, shortfall[interval, numbers.side], 0.0))
    raised = np.where(missing > 0.0, COM_OVERCORRECTION * missing + LEAST_COM_RAISE, 0.0)
    return replace(rows, offset=rows.offset + raised)


def _sides_of_intervals(knots: RouteKnots) -> SupportSides:
    """Sides of the support polygon during every interval."""
    return support_sides(knots.feet[:-1], knots.flying_on_intervals)


def _phase_of_intervals(knots: RouteKnots) -> np.ndarray:
    """Number of the phase that each interval is part of ``(K - 1,)``."""
    return 2 * knots.step + knots.is_swing


class _RowNumbers(NamedTuple):
    """Which side each row keeps, and at which knot.

    Attributes:
        knot: of each row ``(M,)``.
        interval: an interval that begins or ends there, and has this side ``(M,)``.
        side: number of the side among those of the interval ``(M,)``.
    """

    knot: np.ndarray
    interval: np.ndarray
    side: np.ndarray


def _row_numbers(knots: RouteKnots) -> _RowNumbers:
    """A row for every side of the polygon of each phase, at all knots of the phase.

    So a knot at which a phase ends and another begins has the sides of both.
    """
    begins = np.append(True, np.diff(_phase_of_intervals(knots)) != 0)
    begins[0] = False
    first = np.flatnonzero(begins)
    intervals = np.concatenate([np.arange(len(begins)), first])
    at = np.concatenate([np.arange(len(begins)) + 1, first])
    row, side = np.nonzero(_sides_of_intervals(knots).exists[intervals])
    return _RowNumbers(at[row], intervals[row], side)
