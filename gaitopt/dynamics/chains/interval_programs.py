"""Linear programs along paths: what forces, torques and joints allow on every interval.

Unknowns are the path acceleration, the squared path speed where the interval begins, and at both
ends the coordinates of the contact forces, all in units that make them of order one. The rows of
all intervals with the same standing feet are computed at once, without a loop.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import GRAVITY, BoolArray, FloatArray
from gaitopt.dynamics.chains.program_sequence import LinearProgram
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.path_intervals import PathIntervals, TimingLimits
from gaitopt.dynamics.path_rows import place_rows
from gaitopt.dynamics.small_programs import NO_BOUND
from gaitopt.dynamics.whole_body import PathDynamics
from gaitopt.robots.quadruped import Quadruped

LEAST_ROW = 1e-6
"""Size of a row below which it is not scaled to one: a millionth of the weight or of a torque limit
is rounding."""


@dataclass(frozen=True, eq=False)
class IntervalPrograms:
    """The rows of all intervals: ``low <= matrix @ unknowns <= high``.

    The last two rows of a program bound the squared speed at the interval's begin and at its end.

    Attributes:
        programs: of every interval, with its rows.
        units: unit of the first two unknowns of each interval ``(K,)`` [1/s^2].
        edges: size by which the last row of each interval was divided ``(K,)``.
    """

    programs: list[LinearProgram]
    units: FloatArray
    edges: FloatArray


def interval_programs(
    robot: Quadruped,
    dynamics: PathDynamics,
    intervals: PathIntervals,
    limits: ForceLimits,
    timing: TimingLimits,
) -> IntervalPrograms:
    """The programs of all intervals.

    Args:
        robot: the robot.
        dynamics: at all samples.
        intervals: between samples.
        limits: on forces and torques.
        timing: on joint velocities and accelerations.
    """
    count = len(intervals)
    units = path_units(robot, dynamics, intervals, timing)
    programs: list[LinearProgram | None] = [None] * count
    edges = np.ones(count)
    patterns, member = np.unique(intervals.standing, axis=0, return_inverse=True)
    for i, pattern in enumerate(patterns):
        own = np.flatnonzero(member.ravel() == i)
        matrix, low, high, sizes = _rows(
            robot, dynamics, intervals, limits, timing, pattern, own, units[own]
        )
        edges[own] = sizes
        for place, k in enumerate(own.tolist()):
            programs[k] = LinearProgram(matrix[place], low[place], high[place])
    return IntervalPrograms([p for p in programs if p is not None], units, edges)


def path_units(
    robot: Quadruped, dynamics: PathDynamics, intervals: PathIntervals, timing: TimingLimits
) -> FloatArray:
    """Unit of path acceleration and squared speed, one for each chain ``(K,)`` [1/s^2].

    It is what takes a force of half the weight, or what joint velocities allow, whichever is less.
    """
    sizes = np.abs(dynamics.acceleration[:, :6]).max(axis=1) / (robot.mass * GRAVITY)
    out = np.empty(len(intervals))
    for first, last in zip(intervals.first[:-1], intervals.first[1:], strict=True):
        samples = np.append(intervals.begin[first:last], intervals.end[last - 1])
        reach = float(sizes[samples].max())
        unit = 0.5 / reach if reach > 0.0 else np.inf
        tops = timing.squares[samples]
        fastest = float(tops[tops > 0.0].max(initial=0.0)) or 1.0
        out[first:last] = min(unit, fastest) if np.isfinite(fastest) else min(unit, NO_BOUND)
    return out


def _rows(
    robot: Quadruped,
    dynamics: PathDynamics,
    intervals: PathIntervals,
    limits: ForceLimits,
    timing: TimingLimits,
    pattern: BoolArray,
    own: np.ndarray,
    units: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Rows of the intervals ``own (n,)``, on which the feet of ``pattern`` stand.

    Returns:
        ``matrix (n, m, k)``, ``low`` and ``high (n, m)``, and the sizes of the last rows ``(n,)``.
    """
    samples, places = np.unique(
        np.concatenate([intervals.begin[own], intervals.end[own]]), return_inverse=True
    )
    points = place_rows(robot, dynamics, limits, pattern, samples, timing)
    here, there = places[: len(own)], places[len(own) :]
    n, free = len(own), points.by_z.shape[2]
    varies = np.ones(n) if intervals.even is None else np.where(intervals.even[own], 0.0, 1.0)
    step = 2.0 * intervals.lengths[own] * varies
    sizes = [points.by_u.shape[1]] * 2
    if np.isfinite(timing.acceleration):
        sizes += [timing.first.shape[1]] * 2
    last = sum(sizes)
    matrix = np.zeros((n, last + 2, 2 + 2 * free))
    low, high = np.empty((n, last + 2)), np.empty((n, last + 2))
    parts = _slices(sizes)
    unit = units[:, None]
    for at, index in ((0, here), (1, there)):
        rows = parts[at]
        by_x = points.by_x[index]
        by_u = points.by_u[index] + at * step[:, None] * by_x
        matrix[:, rows, 0], matrix[:, rows, 1] = unit * by_u * varies[:, None], unit * by_x
        matrix[:, rows, 2 + at * free : 2 + (at + 1) * free] = points.by_z[index]
        low[:, rows], high[:, rows] = points.low[index], points.high[index]
    if len(parts) > 2:
        scale = unit / timing.acceleration
        for at, sample in ((0, intervals.begin[own]), (1, intervals.end[own])):
            rows, bend = parts[2 + at], timing.second[sample]
            gain = timing.first[sample] + at * step[:, None] * bend
            matrix[:, rows, 0] = scale * gain * varies[:, None]
            matrix[:, rows, 1] = scale * bend
            low[:, rows], high[:, rows] = -1.0, 1.0
    matrix[:, last:, 1], matrix[:, last + 1, 0] = 1.0, step * varies
    low[:, last:], high[:, last:] = 0.0, NO_BOUND
    size = np.sqrt(np.einsum("nmk,nmk->nm", matrix, matrix))
    size[size < LEAST_ROW] = 1.0
    matrix /= size[..., None]
    low = np.where(low > -NO_BOUND, low / size, -NO_BOUND)
    high = np.where(high < NO_BOUND, high / size, NO_BOUND)
    return matrix, low, high, size[:, -1]


def _slices(sizes: list[int]) -> list[slice]:
    """Where parts of these sizes stand, one after the other."""
    ends = np.cumsum(sizes).tolist()
    return [slice(end - size, end) for size, end in zip(sizes, ends, strict=True)]
