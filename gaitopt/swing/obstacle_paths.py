"""Paths of a foot over an obstacle: waypoints in three patterns.

The patterns ``"box"``, ``"trapezoid"`` and ``"parabola"`` (the mixed parabola of [Shao2011]) lead
over a convex section that is enlarged by a safety margin. The path itself clears the section by
construction. A leg flies another curve, which has only the waypoints in common with the path; what
that clears is computed in :mod:`gaitopt.swing.clearance`.

Source: [Shao2011], Section III.A and Fig. 3.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, Protocol, get_args

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_array, is_real, is_whole
from gaitopt.swing.mixed_parabola import Corner, parabola_corners
from gaitopt.swing.trapezoid_path import box_path_corners, trapezoid_corners

Pattern = Literal["box", "trapezoid", "parabola"]
PATTERNS: Final[tuple[Pattern, ...]] = get_args(Pattern)
PAPER_COUNT = 13
"""Waypoints of the path of [Shao2011]."""
MOST_WAYPOINTS = 1000
"""Most waypoints of a path; more are taken for a mistake."""
_SAME = 1e-8
"""Difference of places that counts as rounding [m]: a tangent from a point on an arc is known to
the square root of rounding."""


class Section(Protocol):
    """What a path needs of an obstacle, as :class:`gaitopt.terrain.obstacles.Obstacle` has it."""

    @property
    def core(self) -> tuple[tuple[float, float], ...]:
        """Corners ``(x, z)`` of the convex core in the obstacle's frame [m]."""

    @property
    def rounding(self) -> float:
        """Distance from the core up to which points belong to the section [m]."""

    def inflated(self, margin: float) -> Section:
        """The obstacle enlarged by ``margin`` [m] on all sides."""

    def to_local(self, points: ArrayLike) -> FloatArray:
        """World points ``(..., 3)`` in the obstacle's frame [m]."""

    def to_world(self, points: ArrayLike) -> FloatArray:
        """The inverse of :meth:`to_local`."""

    def distance(self, points: ArrayLike) -> FloatArray:
        """Signed distance of world points ``(..., 3)`` from the obstacle ``(...)`` [m]."""


@dataclass(frozen=True, eq=False)
class ObstaclePath:
    """A path over an obstacle.

    Attributes:
        pattern: ``"box"``, ``"trapezoid"`` or ``"parabola"``.
        margin: distance from the obstacle that the path keeps [m].
        waypoints: ``(n, 3)`` in the world [m]; the first and last are the path's ends.
        controls: control points a, b, c of the pieces that make the path ``(P, 3, 3)`` [m]: each
            piece is the parabola ``(1 - s)^2 a + 2 s (1 - s) b + s^2 c``; on straight pieces b is
            the middle.
    """

    pattern: str
    margin: float
    waypoints: FloatArray
    controls: FloatArray

    def __post_init__(self) -> None:
        object.__setattr__(self, "waypoints", frozen(self.waypoints))
        object.__setattr__(self, "controls", frozen(self.controls))

    def points(self, per_piece: int = 64) -> FloatArray:
        """Points of the path itself ``(P per_piece + 1, 3)`` [m], from its start to its end."""
        s = (np.arange(per_piece) / per_piece)[:, None]
        a, b, c = (self.controls[:, None, k] for k in range(3))
        inner = (1.0 - s) ** 2 * a + 2.0 * s * (1.0 - s) * b + s**2 * c
        return np.concatenate([inner.reshape(-1, 3), self.controls[-1:, 2]])

    @property
    def length(self) -> float:
        """Length of the path [m]."""
        nodes, weights = np.polynomial.legendre.leggauss(32)
        s = ((nodes + 1.0) / 2.0)[:, None]
        first, second = np.diff(self.controls, axis=1).transpose(1, 0, 2)[:, :, None]
        speed = np.linalg.norm(2.0 * ((1.0 - s) * first + s * second), axis=-1)
        return float((speed @ weights).sum() / 2.0)


def obstacle_path(
    start: ArrayLike,
    end: ArrayLike,
    obstacle: Section,
    margin: float,
    *,
    pattern: Pattern = "parabola",
    count: int = PAPER_COUNT,
) -> ObstaclePath:
    """Waypoints over an obstacle, in the vertical plane through both ends.

    Three waypoints are at each corner, and the rest are spread over the straight pieces. The foot
    counts as a point: the radius of a ball is to be added to ``margin``.

    Args:
        start: where the foot lifts off ``(3,)`` [m].
        end: where it touches down ``(3,)`` [m], on the obstacle's other side.
        obstacle: what is in the way; its ends are ignored, as if it were infinitely long.
        margin: distance to keep from it [m]; it must be positive, because it rounds the corners.
        pattern: ``"box"``, ``"trapezoid"`` or ``"parabola"``.
        count: number of waypoints with both ends.

    Raises:
        InputError: unknown pattern, too few waypoints for the pattern's corners, a number that is
            not finite, or an end that stands within the margin beside the obstacle.
    """
    plane = _Plane.between(start, end, obstacle, margin)
    try:
        shape = _SHAPES[pattern]
    except (KeyError, TypeError):
        raise InputError(
            f"pattern {pattern!r} is unknown; there are {', '.join(PATTERNS)}"
        ) from None
    corners = shape(plane.start, plane.end, plane.core, plane.radius)
    stops, pieces = _laid_out(plane, corners, rounded=pattern == "parabola")
    # Without a straight piece there is no place for more waypoints.
    most = MOST_WAYPOINTS if any(open_ for _, open_ in stops) else len(stops)
    if not (is_whole(count) and len(stops) <= count <= most):
        raise InputError(
            f"count must be a whole number from {len(stops)}, for the corners and ends of this "
            f"{pattern} path, to {most}; got {as_text(count)}"
        )
    waypoints = _filled(stops, int(count))
    return ObstaclePath(
        pattern=pattern,
        margin=float(margin),
        waypoints=plane.to_world(waypoints),
        controls=plane.to_world(pieces),
    )


def path_lengths(
    start: ArrayLike, end: ArrayLike, obstacle: Section, margin: float
) -> dict[Pattern, float]:
    """Length of each pattern's path between the same ends [m]; errors as :func:`obstacle_path`."""
    enough = 40  # the number of waypoints does not change the path, and no path needs more
    return {
        pattern: obstacle_path(start, end, obstacle, margin, pattern=pattern, count=enough).length
        for pattern in PATTERNS
    }


def path_space(start: ArrayLike, end: ArrayLike, obstacle: Section, margin: float) -> float:
    """How much larger a path's margin can be until one of its ends is in it [m].

    Args:
        start, end, obstacle, margin: as in :func:`obstacle_path`.

    Raises:
        InputError: a number is not finite, or an end stands within the margin already.
    """
    return _Plane.between(start, end, obstacle, margin).space


class _Plane(NamedTuple):
    """The vertical plane of a swing over an obstacle, seen so that the foot goes to the right.

    Attributes:
        obstacle: what is in the way.
        sense: 1 where the foot goes along the obstacle's x axis, else -1.
        start, end: of the swing in the plane ``(2,)`` [m].
        side: places of both ends along the obstacle [m].
        core: corners of the section's core in the plane ``(k, 2)`` [m].
        radius: distance from the core that the path keeps [m].
    """

    obstacle: Section
    sense: float
    start: FloatArray
    end: FloatArray
    side: tuple[float, float]
    core: FloatArray
    radius: float

    @classmethod
    def between(cls, start: ArrayLike, end: ArrayLike, obstacle: Section, margin: float) -> _Plane:
        """The plane of a swing.

        Raises:
            InputError: a number is not finite, or an end is not beside the obstacle and its margin.
        """
        try:
            ends = np.array([check_array("start", start), check_array("end", end)])
        except ValueError:  # An InputError is one; so is what NumPy says of unequal shapes.
            ends = np.empty(0)
        if ends.shape != (2, 3) or not np.isfinite(ends).all():
            raise InputError(
                f"start and end must be three finite numbers each, got {as_text(start)}, "
                f"{as_text(end)}"
            )
        if not (is_real(margin) and 0.0 < margin < np.inf):
            raise InputError(f"margin must be a positive length in metres, got {as_text(margin)}")
        local = obstacle.to_local(ends)
        sense = 1.0 if local[1, 0] >= local[0, 0] else -1.0
        core = np.array(obstacle.core) * [sense, 1.0]
        flat = local[:, [0, 2]] * [sense, 1.0]
        side = float(local[0, 1]), float(local[1, 1])
        radius = obstacle.rounding + margin
        plane = cls(obstacle, sense, flat[0], flat[1], side, core, radius)
        if plane.space < -_SAME:
            raise InputError(
                f"start and end are {core[:, 0].min() - flat[0, 0]:.4g} and "
                f"{flat[1, 0] - core[:, 0].max():.4g} m beside the obstacle's core, and need "
                f"{radius:.4g} m (its rounding and the margin) each, on opposite sides of it; "
                "stand farther away or reduce the margin"
            )
        return plane

    @property
    def space(self) -> float:
        """How much larger the margin can be until an end is in it [m]."""
        before = self.core[:, 0].min() - self.start[0]
        after = self.end[0] - self.core[:, 0].max()
        return float(min(before, after)) - self.radius

    def to_world(self, points: FloatArray) -> FloatArray:
        """Points ``(..., 2)`` of the plane in the world ``(..., 3)``."""
        share = (points[..., 0] - self.start[0]) / (self.end[0] - self.start[0])
        y = self.side[0] + share * (self.side[1] - self.side[0])
        local = np.stack([self.sense * points[..., 0], y, points[..., 1]], axis=-1)
        return self.obstacle.to_world(local)


def _laid_out(
    plane: _Plane, corners: list[Corner], *, rounded: bool
) -> tuple[list[tuple[FloatArray, bool]], FloatArray]:
    """The waypoints that every path has, and the pieces of the path ``(P, 3, 2)``.

    Returns:
        Waypoints, each with whether further waypoints may lie on the piece before it; and pieces.
    """
    stops: list[tuple[FloatArray, bool]] = [(plane.start, False)]
    pieces: list[FloatArray] = []

    def straight_to(point: FloatArray, *, open_: bool) -> None:
        here = stops[-1][0]
        if np.hypot(*(point - here)) > _SAME:
            stops.append((point, open_))
            pieces.append(np.array([here, (here + point) / 2.0, point]))

    for corner in corners:
        straight_to(corner.before, open_=True)
        if rounded and np.hypot(*(corner.after - corner.before)) > _SAME:
            middle = (corner.before + 2.0 * corner.tip + corner.after) / 4.0
            stops += [(middle, False), (corner.after, False)]
            pieces.append(np.array(corner))
        else:
            straight_to(corner.tip, open_=False)
            straight_to(corner.after, open_=False)
    straight_to(plane.end, open_=True)
    # Where the first or last straight piece is too short to keep, the corner moves to the end.
    stops[-1] = (plane.end, stops[-1][1])
    pieces[0][0], pieces[-1][2] = plane.start, plane.end
    return stops, np.array(pieces)


def _filled(stops: list[tuple[FloatArray, bool]], count: int) -> FloatArray:
    """``count`` waypoints ``(count, 2)``: the ``stops``, and more on straight pieces between them.

    Each further waypoint goes to the piece on which they are farthest apart.
    """
    places = np.array([p for p, _ in stops])
    lengths = np.linalg.norm(np.diff(places, axis=0), axis=1)
    lengths[[not open_ for _, open_ in stops[1:]]] = 0.0
    added, left = np.zeros(len(lengths), dtype=int), count - len(stops)
    while left > 0:
        spacing = lengths / (added + 1)
        widest = np.flatnonzero(spacing > spacing.max() - _SAME)
        if len(widest) > left:
            # Where a single waypoint is left for two equal pieces, a symmetric path gets it on the
            # next longest piece, which is in its middle.
            rest = np.delete(spacing, widest)
            other = np.flatnonzero(spacing == rest.max(initial=0.0))
            widest = (other if rest.max(initial=0.0) > 0.0 else widest)[:1]
        added[widest] += 1
        left -= len(widest)
    parts = [places[:1]]
    for here, there, more in zip(places[:-1], places[1:], added, strict=True):
        parts.append(np.linspace(here, there, more + 2)[1:])
    return np.concatenate(parts)


_SHAPES = {
    "box": box_path_corners,
    "trapezoid": trapezoid_corners,
    "parabola": parabola_corners,
}
