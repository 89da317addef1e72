"""Bounds on the clearance of a foot's curve over an obstacle, and paths whose curves clear it.

A leg flies another curve than the path through its waypoints. :func:`least_clearance` bounds how
near the curve comes to the obstacle at any instant, and :func:`clear_path` moves the waypoints
until it keeps its distance.

[Shao2011], Section III.A, considers the path alone; this module has no source.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError, SolverError
from gaitopt.inputs import as_text
from gaitopt.swing.obstacle_paths import (
    MOST_WAYPOINTS,
    PAPER_COUNT,
    ObstaclePath,
    Pattern,
    Section,
    obstacle_path,
    path_space,
)

CLEARANCE_TOLERANCE = 2e-5
"""Largest difference between the clearance that is proven and the least one that was computed [m],
by default. Chosen: far below the margins that are asked for."""
LEAST_SPACE = 1e-4
"""How far outside the margin the ends of a path must be, for the curve to clear it [m]: the curve
needs some space in which to leave the path."""
_FINEST = 1e-6
"""Smallest tolerance [m]."""
_ATTEMPTS = 8
"""How often the path is moved at most. Chosen."""
_MORE_WAYPOINTS = 4
"""Waypoints that are added where moving the path is not enough. Chosen."""
_MOST_POINTS = 2_000_000
"""Most points of a curve whose distance is computed, so that a call ends."""


class Flown(Protocol):
    """A curve that a foot flies, with a bound on its speed."""

    @property
    def times(self) -> FloatArray:
        """Knots ``(K,)``, increasing [s]."""

    @property
    def speeds(self) -> FloatArray:
        """Bound on the foot's speed between knots ``(K - 1,)`` [m/s]."""

    def place(self, times: FloatArray) -> FloatArray:
        """Places at ``times (N,)`` in the world ``(N, 3)`` [m]."""


class Clearance(NamedTuple):
    """How near a flown curve comes to an obstacle.

    Attributes:
        proven: no point of the curve is nearer to the obstacle [m]; negative inside it.
        seen: the least distance that was computed [m].
        time: when that is [s].
    """

    proven: float
    seen: float
    time: float


def least_clearance(
    flown: Flown, obstacle: Section, tolerance: float = CLEARANCE_TOLERANCE
) -> Clearance:
    """Least distance between a flown curve and an obstacle, at all times and not only at samples.

    The foot is not faster than ``flown.speeds``. So during a piece it is no farther from its place
    in the middle of the piece than the speed times half the duration. Pieces in which the least
    distance may be are halved, until what is proven and what was computed differ by ``tolerance``.

    Args:
        flown: the curve.
        obstacle: what it may come near to.
        tolerance: at least 1e-6 [m].

    Raises:
        InputError: the tolerance is finer.
        SolverError: more than two million points of the curve would be needed.
    """
    if not tolerance >= _FINEST:
        raise InputError(f"tolerance must be at least {_FINEST:g} m, got {as_text(tolerance)}")
    starts, lengths = flown.times[:-1].copy(), np.diff(flown.times)
    speeds = flown.speeds
    seen, when, proven, points = np.inf, 0.0, np.inf, 0
    while starts.size:
        middles = starts + lengths / 2.0
        distances = obstacle.distance(flown.place(middles))
        points += len(middles)
        nearest = int(distances.argmin())
        if distances[nearest] < seen:
            seen, when = float(distances[nearest]), float(middles[nearest])
        bounds = distances - speeds * lengths / 2.0
        open_ = bounds < seen - tolerance
        proven = min(proven, float(bounds[~open_].min(initial=np.inf)))
        if points > _MOST_POINTS or not np.isfinite(distances).all():
            raise SolverError(
                f"the clearance of a flown curve was not found with {points} of its points"
            )
        starts, lengths, speeds = starts[open_], lengths[open_] / 2.0, speeds[open_]
        starts, lengths, speeds = (
            np.concatenate([starts, starts + lengths]), np.tile(lengths, 2), np.tile(speeds, 2),
        )  # fmt: skip
    return Clearance(min(proven, seen), seen, when)


F = TypeVar("F", bound=Flown)


def clear_path(
    fly: Callable[[FloatArray], F],
    start: ArrayLike,
    end: ArrayLike,
    obstacle: Section,
    margin: float,
    *,
    pattern: Pattern = "parabola",
    count: int = PAPER_COUNT,
) -> tuple[ObstaclePath, F, Clearance]:
    """A path whose *flown* curve keeps ``margin`` from the obstacle at every instant.

    Where the curve through the waypoints enters the margin, the path is moved outwards by as much.
    Where that is not enough, or the path's ends do not allow it, it gets more waypoints.

    Args:
        fly: makes the flown curve from waypoints ``(n, 3)`` [m].
        start, end, obstacle, margin, pattern, count: as in
            :func:`gaitopt.swing.obstacle_paths.obstacle_path`.

    Returns:
        The path, the curve that is flown through its waypoints, and the curve's clearance from the
        obstacle enlarged by ``margin``, which is proven to be at least 0.

    Raises:
        InputError: as there; an end is within 0.1 mm of the margin; and whatever ``fly`` raises.
        SolverError: no path was found in 8 attempts.
    """
    space = path_space(start, end, obstacle, margin)
    if space < LEAST_SPACE:
        raise InputError(
            f"start and end stand {space:.2g} m beyond the margin of {margin:g} m beside the "
            f"obstacle, and need {LEAST_SPACE:g} m; stand farther away or reduce the margin"
        )
    keep_out = obstacle.inflated(margin)
    extra, clearance = 0.0, Clearance(-np.inf, -np.inf, 0.0)
    for attempt in range(_ATTEMPTS):
        path = obstacle_path(start, end, obstacle, margin + extra, pattern=pattern, count=count)
        flown = fly(path.waypoints)
        clearance = least_clearance(flown, keep_out)
        if clearance.proven < 0.0 and clearance.seen > 2.0 * _FINEST:
            clearance = least_clearance(flown, keep_out, clearance.seen / 2.0)
        if clearance.proven >= 0.0:
            return path, flown, clearance
        wanted = extra - 1.1 * clearance.proven
        if wanted > space or attempt % 2:
            count = min(count + _MORE_WAYPOINTS, MOST_WAYPOINTS)
        extra = min(wanted, space)
    raise SolverError(
        f"the curve flown over the obstacle comes up to {-clearance.proven:.2g} m into its margin "
        f"of {margin:g} m at {clearance.time:.3g} s, after {_ATTEMPTS} attempts with up to {count} "
        "waypoints; stand farther from the obstacle, or reduce the margin"
    )
