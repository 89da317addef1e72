"""Footholds: for each leg, the places where its foot stands, in the order of the walk."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from numbers import Real
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.errors import FootholdsError
from gaitopt.files import StrPath, read_bounded, written_whole
from gaitopt.robots.leg_names import leg_named
from gaitopt.terrain.foothold_csv import FARTHEST, parse_footholds, write_footholds

CSV_LIMIT = 50_000_000
"""Most bytes of CSV that are read: about a million footholds."""
OPEN_GROUND_RADIUS = 0.02
"""Radius of the disc that takes a column's place on open ground [m]: that of the columns of
[Wang2020], Section II.B, so that a walk over open ground is held to what theirs is."""


@dataclass(frozen=True, eq=False)
class Footholds:
    """Places of the foot frames in the world, the same number for every leg.

    The first foothold of a leg is where its foot stands at the start. A walk over ``n`` footholds
    of each leg has ``4 (n - 1)`` steps. Where the foot is a ball (``robot.foot_radius``), the foot
    frame is its centre and the ground lies that much lower: :meth:`raised` turns points on the
    ground into footholds.

    Args:
        points: for each of ``"LF" "LH" "RH" "RF"`` an array ``(n, 3)`` [m], ``n >= 1``. Names like
            ``"FL"`` or ``"front_left"`` are understood, too, also in CSV files.
        radius: radius of the column under each foothold [m]; ``None`` for open ground. How far
            from a foothold a foot may land is :attr:`landing_radius`.

    Raises:
        FootholdsError: a leg is missing, unknown or named twice, a shape is not ``(n, 3)``, legs
            have different numbers of footholds, a coordinate is not finite, or the radius is not
            positive.
    """

    points: Mapping[str, FloatArray]
    radius: float | None = None

    def __init__(self, points: Mapping[str, ArrayLike], radius: float | None = None) -> None:
        if not isinstance(points, Mapping):
            raise FootholdsError(
                f"footholds must map {', '.join(LEGS)} to arrays (n, 3), got "
                f"{type(points).__name__}"
            )
        named = _by_leg(points)
        arrays = {leg: _checked(leg, named[leg]) for leg in LEGS}
        counts = {leg: len(a) for leg, a in arrays.items()}
        if len(set(counts.values())) > 1:
            raise FootholdsError(
                "every leg needs the same number of footholds, got "
                + ", ".join(f"{leg} {n}" for leg, n in counts.items())
            )
        if radius is not None and not (isinstance(radius, Real) and 0 < radius < np.inf):
            raise FootholdsError(f"radius must be a positive length in metres, got {radius!r}")
        object.__setattr__(self, "points", MappingProxyType(arrays))
        object.__setattr__(self, "radius", None if radius is None else float(radius))

    def __getitem__(self, leg: str) -> FloatArray:
        return self.points[leg]

    def __len__(self) -> int:
        """Number of footholds of each leg."""
        return len(self.points[LEGS[0]])

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Footholds)
            and self.radius == other.radius
            and np.array_equal(self.array, other.array)
        )

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[object, ...]:
        return (Footholds, (dict(self.points), self.radius))

    def __repr__(self) -> str:
        where = "open ground" if self.radius is None else f"columns of {2e3 * self.radius:g} mm"
        return f"Footholds({len(self)} a leg, {self.steps} steps, {where})"

    @property
    def landing_radius(self) -> float:
        """How far from a foothold a foot stands on it [m], seen from above.

        The column's radius, or :data:`OPEN_GROUND_RADIUS` on open ground.
        """
        return OPEN_GROUND_RADIUS if self.radius is None else self.radius

    @property
    def steps(self) -> int:
        """Number of steps of a walk over all footholds."""
        return 4 * (len(self) - 1)

    @cached_property
    def array(self) -> FloatArray:
        """All footholds ``(4, n, 3)`` [m], legs in the order of :data:`gaitopt.LEGS`."""
        return frozen([self.points[leg] for leg in LEGS])

    def raised(self, height: float) -> Footholds:
        """The same footholds moved up by ``height`` [m], for instance by a foot's radius."""
        lift = np.array([0.0, 0.0, height])
        return Footholds({leg: p + lift for leg, p in self.points.items()}, self.radius)

    def to_csv(self, path: StrPath) -> None:
        """Write ``leg,step,x,y,z`` lines, below a comment with the columns' radius.

        :meth:`from_csv` gives back every number exactly. On open ground there is no comment.

        Raises:
            InputError: the file cannot be written.
        """
        with written_whole(path) as stream:
            write_footholds(stream, self.points, self.radius)

    @classmethod
    def from_csv(cls, path: StrPath, radius: float | None = None) -> Footholds:
        """Read footholds from a CSV file with the header ``leg,step,x,y,z``.

        Steps count from 0 for each leg, in any order of lines, without gaps. Lines above the header
        that begin with ``#`` are comments; ``# column radius [m]: 0.02`` tells the columns' radius.

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
        points, stored = parse_footholds(text, str(path))
        return cls(points, stored if radius is None else radius)


def _by_leg(points: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
    """The footholds of each of :data:`gaitopt.LEGS`, whose names may be others.

    Raises:
        FootholdsError: a leg is missing, unknown, or there under two names.
    """
    names = {name: leg_named(name) if isinstance(name, str) else None for name in points}
    unknown = [str(name) for name, leg in names.items() if leg is None]
    missing = [leg for leg in LEGS if leg not in names.values()]
    if unknown or missing:
        raise FootholdsError(
            f"footholds are needed for the legs {', '.join(LEGS)}"
            + (f"; missing: {', '.join(missing)}" if missing else "")
            + (f"; unknown: {', '.join(unknown)}" if unknown else "")
        )
    if len(names) > len(LEGS):
        raise FootholdsError(f"two of the names {', '.join(names)} are of one leg")
    return {leg: points[name] for name, leg in names.items() if leg is not None}


def _checked(leg: str, points: ArrayLike) -> FloatArray:
    """The footholds of a leg as a read-only array ``(n, 3)``."""
    try:
        array = np.asarray(points)
        array = array if np.iscomplexobj(array) else frozen(array)
    except (TypeError, ValueError) as error:
        raise FootholdsError(f"footholds of {leg} are no array of numbers: {error}") from error
    if np.iscomplexobj(array):
        raise FootholdsError(f"footholds of {leg} are no array of numbers: complex numbers")
    if array.ndim != 2 or array.shape[1] != 3 or len(array) < 1:
        raise FootholdsError(
            f"footholds of {leg} must have the shape (n, 3) with n >= 1, got {array.shape}"
        )
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1) | (np.abs(array) > FARTHEST).any(axis=1))
    if bad.size:
        raise FootholdsError(
            f"foothold {bad[0]} of {leg} is {array[bad[0]].tolist()}; coordinates must be finite "
            f"and below {FARTHEST:g} m"
        )
    return array
