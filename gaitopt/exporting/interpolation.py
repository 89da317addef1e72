"""What a trajectory controller makes of points, and points of which it makes the plan's motion.

joint_trajectory_controller joins points by a polynomial each: a straight line where they have
positions, a cubic where they have velocities as well, a quintic with accelerations too. Its page
"Trajectory Representation" says so. It does not look at limits between points.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.exporting.sampled import Source

INTERPOLATIONS: Final = ("linear", "cubic", "quintic")
"""What the controller does with points: the number of derivatives that they have."""
NANOSECOND: Final = 1e-9
"""Times of messages are whole numbers of these [s]."""
LONGEST_GAP: Final = 0.1
"""Longest time between points [s]: a controller that replaces a trajectory needs one nearby."""
SHORTEST_GAP: Final = 1e-4
"""Gaps are not halved below this [s]: a tenth of the period of a controller at 1 kHz."""
WITHIN: Final = 1e-6
"""How far rounding of written numbers may lead beyond a velocity limit, as a share of it."""
MOST_SLOWED: Final = 1.01
"""Largest factor by which points are made later so that limits are kept between them."""
RESERVE: Final = 0.95
"""Share of the joint error that may be seen at the places that are looked at: between 17 of them a
smooth difference is larger by 1 % at most."""
CORNER: Final = 1e-6
"""Largest jump of a joint's velocity that is no corner [rad/s]: planners round at 1e-8."""
_INSIDE: Final = np.linspace(0.0, 1.0, 19)[1:-1]
"""Places between two points at which the joint error is looked at; rounded corners are cut most in
the middle."""


@dataclass(frozen=True, eq=False)
class Points:
    """Points of a trajectory.

    Attributes:
        times: from the part's beginning ``(N,)`` [s], whole nanoseconds.
        plan_times: instants of the plan that they belong to ``(N,)`` [s].
        positions: ``(N, n)`` [rad].
        velocities: ``(N, n)`` [rad/s].
        accelerations: ``(N, n)`` [rad/s^2].
        joint_error: largest distance of the interpolated joints from the plan's [rad].
        peak: largest interpolated velocity, as a share of the joint's limit: a bound.
        slowed: by which factor they are later than in the plan.
    """

    times: FloatArray
    plan_times: FloatArray
    positions: FloatArray
    velocities: FloatArray
    accelerations: FloatArray
    joint_error: float
    peak: float
    slowed: float = 1.0


def hermite(
    ends: tuple[FloatArray, ...], other: tuple[FloatArray, ...], lengths: FloatArray, s: float
) -> FloatArray:
    """Interpolated positions at the share ``s`` of every gap ``(N - 1, n)``.

    The polynomial of degree ``2 k - 1`` that has ``k`` given derivatives at both ends, in the form
    of Bernstein: with derivatives at an end, the control points next to it are given.

    Args:
        ends, other: positions, then derivatives in order, at the beginnings and at the ends of the
            gaps, each ``(N - 1, n)``; one, two or three of them.
        lengths: of the gaps ``(N - 1,)`` [s].
        s: from 0 to 1.
    """
    h = lengths[:, None]
    if len(ends) == 1:
        control = [ends[0], other[0]]
    elif len(ends) == 2:
        control = [ends[0], ends[0] + ends[1] * h / 3, other[0] - other[1] * h / 3, other[0]]
    else:
        control = [
            ends[0], ends[0] + ends[1] * h / 5, ends[0] + 2 * ends[1] * h / 5 + ends[2] * h**2 / 20,
            other[0] - 2 * other[1] * h / 5 + other[2] * h**2 / 20, other[0] - other[1] * h / 5,
            other[0],
        ]  # fmt: skip
    while len(control) > 1:
        control = [(1 - s) * a + s * b for a, b in pairwise(control)]
    return control[0]


def velocity_bounds(
    ends: tuple[FloatArray, ...], other: tuple[FloatArray, ...], lengths: FloatArray
) -> FloatArray:
    """Bounds on the interpolated speeds in every gap ``(N - 1, n)`` [rad/s].

    A polynomial lies within the range of its control points; those of its derivative are given by
    the ends, and the middle one by the mean.
    """
    h = lengths[:, None]
    mean = (other[0] - ends[0]) / h
    if len(ends) == 1:
        return np.abs(mean)
    if len(ends) == 2:
        control = [ends[1], 3 * mean - ends[1] - other[1], other[1]]
    else:
        second, fourth = ends[1] + ends[2] * h / 4, other[1] - other[2] * h / 4
        control = [ends[1], second, 5 * mean - ends[1] - other[1] - second - fourth, fourth,
                   other[1]]  # fmt: skip
    return np.asarray(np.abs(control).max(axis=0))


def choose_points(
    source: Source, kind: str, error: float, gap: float, start: float, end: float
) -> Points:
    """Points of which the controller's own interpolation keeps to the plan.

    Gaps are halved until the interpolated joints are within ``error`` of the plan's, and their
    speeds within the joints' limits. Where the plan's velocity jumps, two points stand around the
    corner, which the controller rounds.

    Args:
        source: what is exported; at rest at ``start`` and ``end``.
        kind: one of :data:`INTERPOLATIONS`.
        error: largest distance of a joint from the plan's [rad].
        gap: longest time between points [s].
        start, end: of the part [s].

    Raises:
        InputError: a velocity limit is exceeded between points, however near they are; names the
            joint.
    """
    order = INTERPOLATIONS.index(kind)
    times = _first_times(source, order, error, gap, start, end)
    while True:
        found = _points(source, times, start, end)
        ends, other, lengths = _gaps(found, order)
        off = _errors(source, found, order)
        fast = velocity_bounds(ends, other, lengths) > source.velocity_limits * (1 + 0.1 * WITHIN)
        wrong = ((off > RESERVE * error) | fast.any(axis=1)) & (lengths > 2 * SHORTEST_GAP)
        if not wrong.any():
            break
        middles = found.plan_times[:-1][wrong] + 0.5 * np.diff(found.plan_times)[wrong]
        times = _whole(np.union1d(found.plan_times, middles), start)
    return _within_limits(source, found, order, float(off.max(initial=0.0)))


def _first_times(
    source: Source, order: int, error: float, gap: float, start: float, end: float
) -> FloatArray:
    """Corners, or two times around each, and others so that no gap is too long."""
    path = source.plan.path
    inside = (path.times > start) & (path.times < end)
    known = np.concatenate([[start], path.times[inside], [end]])
    sizes = path.jumps(1)[:, 6 + source.order.columns].max(axis=1, initial=0.0)
    jump = np.concatenate([[0.0], sizes, [0.0]])[: len(path.times)][inside]
    corners = np.concatenate([[False], jump > CORNER, [False]])
    if order == 0:
        # The lines between corners are the plan's own where it is a polyline.
        found = [known[corners], [start, end]]
    else:
        # A corner whose velocity jumps by d is cut by d h / 4 at most, from h before to h after.
        at, size = known[corners], np.concatenate([[0.0], jump, [0.0]])[corners]
        room = np.minimum(np.diff(known)[:-1], np.diff(known)[1:])[corners[1:-1]]
        half = np.minimum(2.0 * error / size, 0.25 * room)
        found = [at - half, at + half, [start, end]]
    times = np.unique(np.concatenate(found))
    counts = np.ceil(np.diff(times) / gap - 1e-9).astype(int).clip(1)
    filled = [np.linspace(a, b, n + 1)[:-1]
              for a, b, n in zip(times, times[1:], counts, strict=False)]  # fmt: skip
    return _whole(np.concatenate([*filled, [end]]), start)


def _whole(times: FloatArray, start: float) -> FloatArray:
    """Times ``(N,)``, in order, a whole number of nanoseconds after the part's beginning."""
    counts = np.rint((times - start) / NANOSECOND)
    # Later rather than earlier at the end, so that the last gap is not too fast.
    counts[-1] = np.ceil((times[-1] - start) / NANOSECOND - 1e-3)
    return np.asarray(start + np.unique(counts) * NANOSECOND)


def _points(source: Source, times: FloatArray, start: float, end: float) -> Points:
    """The plan at these times, and at rest at both ends of the part."""
    inside = np.clip(times, start, end)
    values = [source.joints(inside, k) for k in range(3)]
    values[0][-1] = source.joints(np.array([end]))[0]
    for rates in values[1:]:
        rates[[0, -1]] = 0.0
    return Points(
        times=np.rint((times - start) / NANOSECOND) * NANOSECOND, plan_times=times,
        positions=values[0], velocities=values[1], accelerations=values[2], joint_error=0.0,
        peak=0.0,
    )  # fmt: skip


def _gaps(
    found: Points, order: int
) -> tuple[tuple[FloatArray, ...], tuple[FloatArray, ...], FloatArray]:
    """Values at the beginnings and at the ends of gaps, and their lengths."""
    values = (found.positions, found.velocities, found.accelerations)[: order + 1]
    return tuple(v[:-1] for v in values), tuple(v[1:] for v in values), np.diff(found.times)


def _errors(source: Source, found: Points, order: int) -> FloatArray:
    """Largest distance of the interpolated joints from the plan's in every gap ``(N - 1,)``."""
    ends, other, lengths = _gaps(found, order)
    worst = np.zeros(len(lengths))
    for s in _INSIDE:
        told = hermite(ends, other, lengths, float(s))
        at = found.plan_times[:-1] + s * np.diff(found.plan_times)
        worst = np.maximum(worst, np.abs(told - source.joints(at)).max(axis=1))
    return worst


def _within_limits(source: Source, found: Points, order: int, error: float) -> Points:
    """The points, a little later where a limit is exceeded between them."""
    ends, other, lengths = _gaps(found, order)
    shares = velocity_bounds(ends, other, lengths) / source.velocity_limits
    peak = float(shares.max(initial=0.0))
    factor = 1.0 if peak <= 1 + WITHIN else peak
    if factor > MOST_SLOWED:
        gap, joint = np.unravel_index(shares.argmax(), shares.shape)
        raise InputError(
            f"joint {source.order.names[joint]} would reach {100 * peak:.1f} % of its velocity "
            f"limit at {found.plan_times[gap]:.3f} s of the plan, as the controller interpolates: "
            f"export plan.slowed({np.ceil(100 * factor) / 100:g})"
        )
    # Each gap is rounded up: none becomes too fast.
    counts = np.ceil(lengths * factor / NANOSECOND - 1e-3)
    return Points(
        times=np.concatenate([[0.0], np.cumsum(counts)]) * NANOSECOND,
        plan_times=found.plan_times, positions=found.positions,
        velocities=found.velocities / factor, accelerations=found.accelerations / factor**2,
        joint_error=error, peak=peak / factor, slowed=factor,
    )  # fmt: skip
