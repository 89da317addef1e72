"""Footholds: for each leg, the places where its foot stands, in the order of the walk."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.errors import FootholdsError
from gaitopt.files import StrPath, read_bounded, written_whole
from gaitopt.inputs import as_text, check_count, check_number, check_tuple, is_real
from gaitopt.robots.leg_names import LegMapping, by_leg
from gaitopt.terrain.foothold_checks import (
    checked_friction,
    checked_normals,
    checked_of_steps,
    checked_order,
    checked_points,
    checked_swing_heights,
)
from gaitopt.terrain.foothold_columns import FootholdTable
from gaitopt.terrain.foothold_csv import FARTHEST, parse_footholds, write_footholds
from gaitopt.terrain.height_map import HeightMap

CSV_LIMIT = 50_000_000
"""Most bytes of CSV that are read: about a million footholds."""
OPEN_GROUND_RADIUS = 0.02
"""Radius of the disc that takes a column's place on open ground [m]: that of the columns of
[Wang2020], Section II.B, so that a walk over open ground is held to what theirs is."""


@dataclass(frozen=True, eq=False)
class Footholds:
    """Places of the foot frames in the world, for every leg in the order of the walk.

    The first foothold of a leg is where its foot stands at the start; every further one is a step.
    Legs may have different numbers of footholds. Where the foot is a ball (``robot.foot_radius``),
    the foot frame is its centre, and the ball touches the ground at ``centre - radius * normal``:
    :meth:`raised` turns points on level ground into footholds, :meth:`HeightMap.ball` points on any
    ground.

    Args:
        points: for each of ``"LF" "LH" "RH" "RF"`` an array ``(n, 3)`` [m], ``n >= 1``. Names like
            ``"FL"`` or ``"front_left"`` are understood, too, also in CSV files.
        radius: radius of the column under each foothold [m]; ``None`` for open ground. How far
            from a foothold a foot may land is :attr:`landing_radius`.
        normals: for each leg the unit normals of the ground there ``(n, 3)``, away from the ground;
            vertical by default.
        friction: for each leg the coefficients of friction ``(n,)``, or one number for all; by
            default that of the forces that are asked for.
        ground: the height map that the footholds stand on. Certificate, physics and replay use it.
        order: the legs in the order in which they step, over the whole walk; planners take it where
            no other order is asked for.
        swing_heights: for each leg how far the foot rises above the higher end of each of its
            swings ``(n - 1,)`` [m]; by default as the settings say.
        postures: of the body at the start and during each swing, in the order of the swings
            ``(steps + 1, 4)``: height of the body centre [m], and roll, pitch, yaw [rad], all in
            the world. By default the body is level, as high as the settings say. They go with
            ``order``.

        body_places: where the body centre is wanted, at the start and during each swing
            ``(steps + 1, 2)`` [m]; planners take the nearest places that are possible. By default
            the body moves as little as possible. They go with ``order``.

    Raises:
        FootholdsError: a leg is missing, unknown or named twice, a shape is wrong, a number is not
            finite or out of its range, or the order does not fit the numbers of footholds.
    """

    points: Mapping[str, FloatArray]
    radius: float | None = None
    normals: Mapping[str, FloatArray] | None = None
    friction: Mapping[str, FloatArray] | None = None
    ground: HeightMap | None = None
    order: tuple[str, ...] | None = None
    swing_heights: Mapping[str, FloatArray] | None = None
    postures: FloatArray | None = None
    body_places: FloatArray | None = None

    def __init__(
        self,
        points: Mapping[str, ArrayLike],
        radius: float | None = None,
        *,
        normals: Mapping[str, ArrayLike] | None = None,
        friction: float | Mapping[str, ArrayLike] | None = None,
        ground: HeightMap | None = None,
        order: Iterable[str] | None = None,
        swing_heights: Mapping[str, ArrayLike] | None = None,
        postures: ArrayLike | None = None,
        body_places: ArrayLike | None = None,
    ) -> None:
        arrays = checked_points(points)
        counts = {leg: len(a) for leg, a in arrays.items()}
        if radius is not None and not (is_real(radius) and 0 < radius <= FARTHEST):
            raise FootholdsError(
                f"radius must be a positive length of at most {FARTHEST:g} m, got {as_text(radius)}"
            )
        if ground is not None and not isinstance(ground, HeightMap):
            raise FootholdsError(f"ground must be a HeightMap, got {type(ground).__name__}")
        legs = checked_order(order, counts)
        for name, value in (
            ("points", LegMapping(arrays)),
            ("radius", None if radius is None else float(radius)),
            ("normals", checked_normals(normals, counts)),
            ("friction", checked_friction(friction, counts)),
            ("ground", ground),
            ("order", legs),
            ("swing_heights", checked_swing_heights(swing_heights, counts)),
            ("postures", checked_of_steps("postures", postures, legs, 4)),
            ("body_places", checked_of_steps("body_places", body_places, legs, 2)),
        ):
            object.__setattr__(self, name, value)

    def __getitem__(self, leg: str) -> FloatArray:
        """Footholds ``(n, 3)`` of a leg, under any of its names [m].

        Raises:
            UnknownNameError: there is no such leg.
        """
        return self.points[leg]

    def __len__(self) -> int:
        """Number of footholds of the leg that has most."""
        return max(self.counts.values())

    def __eq__(self, other: object) -> bool:
        """Whether all footholds and all that is told of them are the same."""
        return isinstance(other, Footholds) and all(
            _same(getattr(self, f.name), getattr(other, f.name)) for f in fields(self)
        )

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[object, ...]:
        values = [getattr(self, f.name) for f in fields(self)]
        return (_restored, tuple(dict(v) if isinstance(v, Mapping) else v for v in values))

    def __repr__(self) -> str:
        where = "open ground" if self.radius is None else f"columns of {2e3 * self.radius:g} mm"
        if self.ground is not None:
            where = "a height map"
        counts = set(self.counts.values())
        each = str(len(self)) if len(counts) == 1 else f"{min(counts)} to {max(counts)}"
        return f"Footholds({each} a leg, {self.steps} steps, {where})"

    @property
    def landing_radius(self) -> float:
        """How far from a foothold a foot stands on it [m], seen from above.

        The column's radius, or :data:`OPEN_GROUND_RADIUS` on open ground.
        """
        return OPEN_GROUND_RADIUS if self.radius is None else self.radius

    @cached_property
    def counts(self) -> Mapping[str, int]:
        """Number of footholds of each leg."""
        return LegMapping({leg: len(p) for leg, p in self.points.items()})

    @property
    def steps(self) -> int:
        """Number of steps of a walk over all footholds."""
        return sum(self.counts.values()) - len(LEGS)

    @cached_property
    def array(self) -> FloatArray:
        """All footholds ``(4, n, 3)`` [m], legs in the order of :data:`gaitopt.LEGS`.

        ``n`` is the number of the leg that has most; the last foothold of others is repeated.
        """
        return self._padded(self.points)

    @cached_property
    def normal_array(self) -> FloatArray:
        """Normals of the ground under all footholds ``(4, n, 3)``, as for :attr:`array`."""
        if self.normals is None:
            return frozen(np.broadcast_to([0.0, 0.0, 1.0], self.array.shape))
        return self._padded(self.normals)

    def touching(self, radius: float) -> FloatArray:
        """Where feet that are balls of ``radius`` [m] touch the ground ``(4, n, 3)`` [m].

        Raises:
            InputError: the radius is no number from 0 to 100 m.
        """
        check_number("radius", radius, 0.0, 100.0, "m")
        return frozen(self.array - radius * self.normal_array)

    def raised(self, height: float) -> Footholds:
        """The same footholds moved up by ``height`` [m], for instance by a foot's radius.

        Raises:
            FootholdsError: the height is no finite number.
        """
        if not (is_real(height) and abs(height) <= FARTHEST):
            raise FootholdsError(
                f"height must be from {-FARTHEST:g} to {FARTHEST:g} m, got {as_text(height)}"
            )
        lift = np.array([0.0, 0.0, height])
        return self.with_(points={leg: p + lift for leg, p in self.points.items()})

    def after(self, first: Mapping[str, int], order: Iterable[str]) -> Footholds:
        """The footholds of the rest of a walk.

        Args:
            first: for each leg, under any of its names, the foothold that becomes its first one.
            order: the legs in the order in which they then step.

        Raises:
            InputError: a leg has no such foothold, or these are no legs.
        """
        legs = check_tuple("order", order)
        first = by_leg("first", first)
        for leg, count in self.counts.items():
            check_count(f"the first foothold of {leg}", first.get(leg), 0, count - 1)
        made = self.steps - len(legs)

        def rest(of_legs: Mapping[str, FloatArray] | None) -> dict[str, FloatArray] | None:
            if of_legs is None:
                return None
            return {leg: array[first[leg] :] for leg, array in of_legs.items()}

        return self.with_(
            points={leg: points[first[leg] :] for leg, points in self.points.items()},
            normals=rest(self.normals), friction=rest(self.friction),
            swing_heights=rest(self.swing_heights),
            order=legs,
            postures=None if self.postures is None else self.postures[made:],
            body_places=None if self.body_places is None else self.body_places[made:],
        )  # fmt: skip

    def with_(self, **changes: Any) -> Footholds:
        """The same footholds with other values of the arguments that are named."""
        given = {f.name: getattr(self, f.name) for f in fields(self)}
        return Footholds(**{**given, **changes})

    def _padded(self, of_legs: Mapping[str, FloatArray]) -> FloatArray:
        most = len(self)
        return frozen([
            np.concatenate([a, np.repeat(a[-1:], most - len(a), axis=0)])
            for a in (of_legs[leg] for leg in LEGS)
        ])  # fmt: skip

    def to_csv(self, path: StrPath) -> None:
        """Write ``leg,step,x,y,z`` lines, below a comment with the columns' radius.

        Normals, friction, swing heights, order and postures are further columns where they are
        there. :meth:`from_csv` gives back every number exactly; the height map is not written. On
        open ground there is no comment.

        Raises:
            InputError: the file cannot be written.
        """
        with written_whole(path) as stream:
            write_footholds(
                stream,
                FootholdTable(
                    self.points, self.radius, self.normals, self.friction, self.order,
                    self.swing_heights, self.postures, self.body_places,
                ),
            )  # fmt: skip

    @classmethod
    def from_csv(cls, path: StrPath, radius: float | None = None) -> Footholds:
        """Read footholds from a CSV file with the header ``leg,step,x,y,z``.

        Steps count from 0 for each leg, in any order of lines, without gaps. Lines above the header
        that begin with ``#`` are comments; ``# column radius [m]: 0.02`` tells the columns' radius.
        Further columns may be ``nx,ny,nz`` (the unit normal), ``friction``, ``swing_height`` (of
        the swing that leads to the foothold), ``turn`` (which step of the whole walk leads to it,
        from 0 on), ``body_height,roll,pitch,yaw`` (of the body during this step; in step 0 at the
        start), and ``body_x,body_y`` (where the body centre is wanted).

        Args:
            path: the file.
            radius: radius of the columns [m], in place of the file's.

        Raises:
            FootholdsError: the file cannot be read or a line is wrong; the message names the line.
        """
        try:
            text = read_bounded(path, CSV_LIMIT, FootholdsError).decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise FootholdsError(f"{path} is no text in UTF-8 (byte {error.start})") from error
        table = parse_footholds(text, str(path))
        given = table if radius is None else table._replace(radius=radius)
        return cls(**given._asdict())


def _restored(*values: Any) -> Footholds:
    """Footholds from the values of their fields, in order."""
    return Footholds(**dict(zip((f.name for f in fields(Footholds)), values, strict=True)))


def _same(one: Any, other: Any) -> bool:
    """Whether two values of a field are the same."""
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return all(np.array_equal(one[leg], other[leg]) for leg in LEGS)
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return bool(np.array_equal(one, other))
    return type(one) is type(other) and bool(one == other)
