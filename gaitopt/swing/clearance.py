"""The proof that the curve a foot flies clears an obstacle, and paths laid so that it does.

A leg flies another curve than the path of its waypoints: :func:`least_clearance` bounds how near
that comes at any instant, and :func:`clear_path` moves the waypoints until it clears.

Source: none; [Shao2011], Section III.A, looks at the path alone.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError, SolverError
from gaitopt.swing.obstacle_paths import (
    MOST_WAYPOINTS,
    PAPER_COUNT,
    ObstaclePath,
    Pattern,
    Section,
    obstacle_path,
    path_room,
)

CLEARANCE_TOLERANCE = 2e-5
"""Between the clearance that is proven and the least one that was seen [m], unless asked else."""
LEAST_ROOM = 1e-4
"""How far beyond the margin the ends of a path must stand that is to clear in flight [m]."""
_FINEST = 1e-6
_ROUNDS = 8
_MORE_WAYPOINTS = 4
_LOOKS = 2_000_000


class Flown(Protocol):
    """A curve that a foot flies: a place at each time, and how fast it moves at most."""

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
        proven: no point of the curve is nearer [m]; negative inside.
        seen: distance of the nearest point that was looked at [m].
        time: when that is [s].
    """

    proven: float
    seen: float
    time: float


def least_clearance(
    flown: Flown, obstacle: Section, tolerance: float = CLEARANCE_TOLERANCE
) -> Clearance:
    """Least distance between a flown curve and an obstacle, at all times and not only at samples.

    No foot is faster than ``flown.speeds``, so it stays within half a piece's duration times that
    of the piece's middle. Pieces that may hold the least distance are halved until what is proven
    and what was seen differ by ``tolerance``.

    Args:
        flown: the curve.
        obstacle: what it may come near to.
        tolerance: at least 1e-6 [m].

    Raises:
        InputError: the tolerance is finer.
        SolverError: that takes more than two million looks.
    """
    if not tolerance >= _FINEST:
        raise InputError(f"tolerance must be at least {_FINEST:g} m, got {tolerance!r}")
    starts, lengths = flown.times[:-1].copy(), np.diff(flown.times)
    speeds = flown.speeds
    seen, when, proven, looks = np.inf, 0.0, np.inf, 0
    while starts.size:
        middles = starts + lengths / 2.0
        distances = obstacle.distance(flown.place(middles))
        looks += len(middles)
        nearest = int(distances.argmin())
        if distances[nearest] < seen:
            seen, when = float(distances[nearest]), float(middles[nearest])
        bounds = distances - speeds * lengths / 2.0
        open_ = bounds < seen - tolerance
        proven = min(proven, float(bounds[~open_].min(initial=np.inf)))
        if looks > _LOOKS or not np.isfinite(distances).all():
            raise SolverError(f"the clearance of a flown curve was not found within {looks} looks")
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

    Where the curve through the waypoints cuts into the margin, the path is laid farther out by as
    much, and given more waypoints where that is not enough or there is no room.

    Args:
        fly: makes the flown curve from waypoints ``(n, 3)`` [m].
        start, end, obstacle, margin, pattern, count: as in
            :func:`gaitopt.swing.obstacle_paths.obstacle_path`.

    Returns:
        The path, the curve flown through its waypoints, and its clearance from the obstacle
        swollen by ``margin``: proven to be at least 0.

    Raises:
        InputError: as there, an end is within 0.1 mm of the margin, and whatever
            ``fly`` raises.
        SolverError: no path was found within 8 rounds.
    """
    room = path_room(start, end, obstacle, margin)
    if room < LEAST_ROOM:
        raise InputError(
            f"start and end stand {room:.2g} m beyond the margin of {margin:g} m beside the "
            f"obstacle, and need {LEAST_ROOM:g} m; stand farther away or lessen the margin"
        )
    keep_out = obstacle.inflated(margin)
    extra, clearance = 0.0, Clearance(-np.inf, -np.inf, 0.0)
    for attempt in range(_ROUNDS):
        path = obstacle_path(start, end, obstacle, margin + extra, pattern=pattern, count=count)
        flown = fly(path.waypoints)
        clearance = least_clearance(flown, keep_out)
        if clearance.proven < 0.0 and clearance.seen > 2.0 * _FINEST:
            clearance = least_clearance(flown, keep_out, clearance.seen / 2.0)
        if clearance.proven >= 0.0:
            return path, flown, clearance
        wanted = extra - 1.1 * clearance.proven
        if wanted > room or attempt % 2:
            count = min(count + _MORE_WAYPOINTS, MOST_WAYPOINTS)
        extra = min(wanted, room)
    raise SolverError(
        f"the curve flown over the obstacle comes up to {-clearance.proven:.2g} m into its margin "
        f"of {margin:g} m at {clearance.time:.3g} s, after {_ROUNDS} rounds with up to {count} "
        "waypoints; stand farther from the obstacle, or lessen the margin"
    )
