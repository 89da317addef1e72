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
    matrices, lows, highs = [], [], []

    def add(by_u: FloatArray, by_x: FloatArray, by_z: FloatArray | None, at: int,
            low: FloatArray, high: FloatArray) -> None:  # fmt: skip
        block = np.zeros((n, by_u.shape[1], 2 + 2 * free))
        block[:, :, 0], block[:, :, 1] = by_u * varies[:, None], by_x
        if by_z is not None:
            block[:, :, 2 + at * free : 2 + (at + 1) * free] = by_z
        matrices.append(block)
        lows.append(low)
        highs.append(high)

    unit = units[:, None]
    for at, index in ((0, here), (1, there)):
        by_u = points.by_u[index] + at * step[:, None] * points.by_x[index]
        add(unit * by_u, unit * points.by_x[index], points.by_z[index], at,
            points.low[index], points.high[index])  # fmt: skip
    if np.isfinite(timing.acceleration):
        for at, sample in ((0, intervals.begin[own]), (1, intervals.end[own])):
            bend = timing.second[sample]
            gain = timing.first[sample] + at * step[:, None] * bend
            scale = unit / timing.acceleration
            ones = np.ones(gain.shape)
            add(scale * gain, scale * bend, None, 0, -ones, ones)
    one = np.ones((n, 1))
    add(0.0 * one, one, None, 0, 0.0 * one, NO_BOUND * one)
    add(step[:, None], one, None, 0, 0.0 * one, NO_BOUND * one)
    matrix, low, high = (np.concatenate(parts, axis=1) for parts in (matrices, lows, highs))
    size = np.linalg.norm(matrix, axis=2)
    size[size < LEAST_ROW] = 1.0
    matrix /= size[..., None]
    low = np.where(low > -NO_BOUND, low / size, -NO_BOUND)
    high = np.where(high < NO_BOUND, high / size, NO_BOUND)
    return matrix, low, high, size[:, -1]
