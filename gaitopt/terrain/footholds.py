"""Footholds: for each leg, the places where its foot stands, one after another."""

from __future__ import annotations

import csv
import io
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

CSV_HEADER = ("leg", "step", "x", "y", "z")
CSV_LIMIT = 50_000_000
"""Most bytes of CSV that are read."""
FARTHEST = 1e6
"""Coordinates beyond this are taken for a mistake [m]."""


@dataclass(frozen=True, eq=False)
class Footholds:
    """Places of the foot frames in the world, the same number for every leg.

    The first foothold of a leg is where its foot stands at the start; a walk over ``n`` footholds
    a leg has ``4 (n - 1)`` steps. Where the foot is a ball (``robot.foot_radius``), the foot frame
    is its centre and the ground lies that much lower: :meth:`raised` turns points on the ground
    into footholds.

    Args:
        points: for each of ``"LF" "LH" "RH" "RF"`` an array ``(n, 3)`` [m], ``n >= 1``.
        radius: radius of the column under each foothold [m]; ``None`` for open ground.

    Raises:
        FootholdsError: a leg is missing or unknown, a shape is not ``(n, 3)``, the numbers
            differ, or a coordinate is not finite.
    """

    points: Mapping[str, FloatArray]
    radius: float | None = None

    def __init__(self, points: Mapping[str, ArrayLike], radius: float | None = None) -> None:
        if not isinstance(points, Mapping):
            raise FootholdsError(
                f"footholds must map {', '.join(LEGS)} to arrays (n, 3), got "
                f"{type(points).__name__}"
            )
        unknown = [str(leg) for leg in points if leg not in LEGS]
        missing = [leg for leg in LEGS if leg not in points]
        if unknown or missing:
            raise FootholdsError(
                f"footholds are needed for the legs {', '.join(LEGS)}"
                + (f"; missing: {', '.join(missing)}" if missing else "")
                + (f"; unknown: {', '.join(unknown)}" if unknown else "")
            )
        arrays = {leg: _checked(leg, points[leg]) for leg in LEGS}
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
        """Number of footholds a leg."""
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
        """Write ``leg,step,x,y,z`` lines; every number survives the round trip exactly."""
        with written_whole(path) as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(CSV_HEADER)
            for leg, points in self.points.items():
                for step, point in enumerate(points):
                    writer.writerow([leg, step, *(repr(float(c)) for c in point)])

    @classmethod
    def from_csv(cls, path: StrPath, radius: float | None = None) -> Footholds:
        """Read footholds from a CSV file with the header ``leg,step,x,y,z``.

        Steps count from 0 for each leg, in any order of lines, without gaps.

        Args:
            path: the file.
            radius: radius of the columns [m]; the file does not hold it.

        Raises:
            FootholdsError: the file cannot be read or a line is wrong; the message names the line.
        """
        try:
            text = read_bounded(path, CSV_LIMIT, FootholdsError).decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise FootholdsError(f"{path} is no text in UTF-8 (byte {error.start})") from error
        return cls(_parse_csv(text, str(path)), radius)


def _checked(leg: str, points: ArrayLike) -> FloatArray:
    if np.iscomplexobj(points):
        raise FootholdsError(f"footholds of {leg} are no array of numbers: complex numbers")
    try:
        array = frozen(points)
    except (TypeError, ValueError) as error:
        raise FootholdsError(f"footholds of {leg} are no array of numbers: {error}") from error
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


def _parse_csv(text: str, name: str) -> dict[str, list[list[float]]]:
    reader = csv.reader(io.StringIO(text))
    found: dict[str, dict[int, list[float]]] = {}
    try:
        header = [c.strip().lower() for c in next(reader, [])]
        if tuple(header) != CSV_HEADER:
            raise FootholdsError(
                f"{name}, line 1: the header must be {','.join(CSV_HEADER)}, got "
                f"{','.join(header)[:80] or 'nothing'}"
            )
        for row in reader:
            if row and any(cell.strip() for cell in row):
                _parse_row(row, f"{name}, line {reader.line_num}", found)
    except csv.Error as error:
        raise FootholdsError(f"{name}, line {reader.line_num}: {error}") from error
    for leg, steps in found.items():
        gap = next((k for k in range(len(steps)) if k not in steps), None)
        if gap is not None:
            raise FootholdsError(f"{name}: leg {leg} has no step {gap}; steps count 0, 1, 2, ...")
    return {leg: [steps[k] for k in range(len(steps))] for leg, steps in found.items()}


def _parse_row(row: list[str], where: str, found: dict[str, dict[int, list[float]]]) -> None:
    if len(row) != len(CSV_HEADER):
        raise FootholdsError(f"{where}: {len(row)} fields where 5 are needed (leg,step,x,y,z)")
    leg, step_text, *coordinates = (cell.strip() for cell in row)
    if leg not in LEGS:
        raise FootholdsError(f"{where}: leg {leg[:20]!r} is unknown; legs are {', '.join(LEGS)}")
    try:
        step = int(step_text)
    except ValueError:
        raise FootholdsError(f"{where}: step {step_text[:20]!r} is no whole number") from None
    values = []
    for axis, text in zip("xyz", coordinates, strict=True):
        try:
            value = float(text)
        except ValueError:
            raise FootholdsError(f"{where}: {axis} is {text[:20]!r}, no number") from None
        if not abs(value) <= FARTHEST:
            raise FootholdsError(
                f"{where}: {axis} is {text[:20]}; it must be finite and below {FARTHEST:g} m"
            )
        values.append(value)
    if step < 0 or step in found.setdefault(leg, {}):
        problem = "is negative" if step < 0 else "stands there twice"
        raise FootholdsError(f"{where}: step {step} of leg {leg} {problem}")
    found[leg][step] = values
