"""What a user tells of a file with ground, and how parts of it are checked."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import GroundError, InputError
from gaitopt.inputs import as_text, check_array, check_count, check_number
from gaitopt.terrain.height_map import HeightMap

RESOLUTION = 0.02
"""Distance of the points of a grid that meshes and clouds are put on [m]: that of made grounds."""


@dataclass(frozen=True)
class Options:
    """The options of :func:`gaitopt.load_ground`; ``None`` for those that are not given."""

    resolution: float | None = None
    heights: tuple[float, float] | None = None
    origin: tuple[float, float] | None = None
    unit: float | None = None
    method: str | None = None
    layer: str | None = None
    topic: str | None = None
    message: int | None = None

    def checked(self) -> Options:
        """The same options.

        Raises:
            InputError: one is out of its range.
        """
        if self.resolution is not None:
            check_number("resolution", self.resolution, 1e-6, 1e3, "m")
        if self.unit is not None:
            check_number("unit", self.unit, 1e-6, 1e6, "m")
        if self.message is not None:
            check_count("message", self.message, -(10**9), 10**9)
        for name in ("heights", "origin"):
            pair = getattr(self, name)
            if pair is not None:
                _check_pair(name, pair)
        for name in ("method", "layer", "topic"):
            text = getattr(self, name)
            if text is not None and not isinstance(text, str):
                raise InputError(f"{name} must be a text, got {as_text(text)}")
        return self

    def only(self, kind: str, *allowed: str) -> Options:
        """The same options, when only those were given that a kind of file takes.

        Raises:
            InputError: another one was given.
        """
        for field in fields(self):
            if field.name not in allowed and getattr(self, field.name) is not None:
                raise InputError(
                    f"{kind} take no option {field.name}; they take {', '.join(allowed)}"
                )
        return self

    def needed_resolution(self, kind: str) -> float:
        """The resolution, of a kind of file that tells none.

        Raises:
            GroundError: it was not given.
        """
        if self.resolution is None:
            raise GroundError(
                f"{kind} tell no scale: give the distance between neighbouring points in metres, "
                "for instance resolution=0.02"
            )
        return self.resolution

    def placed(self, z: FloatArray, resolution: float, origin: object = (0.0, 0.0)) -> HeightMap:
        """The map of heights ``(nx, ny)`` at the origin that was given, or else at this one."""
        return HeightMap(z, resolution, origin if self.origin is None else self.origin)  # type: ignore[arg-type]

    def moved(self, ground: HeightMap) -> HeightMap:
        """A map at the origin that was given, if one was."""
        return ground if self.origin is None else self.placed(ground.z, ground.resolution)


def _check_pair(name: str, pair: object) -> None:
    try:
        values = check_array(name, pair)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.shape != (2,) or not np.isfinite(values).all():
        raise InputError(f"{name} must be two numbers [m], got {as_text(pair)}")
