"""Options that say which ground is meant: a file, or ground that is made."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitopt.cli.grouped_options import numbers
from gaitopt.errors import GroundError, InputError

if TYPE_CHECKING:
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.terrain.height_map import HeightMap

PLACED = (".png", ".tif", ".tiff", ".npy")
"""Files that tell no place: without --origin they lie with y = 0 in their middle. So do .npz files
with an array alone."""

PIXEL, WHITE = 0.02, 0.3
"""Scale of a PNG where none is given: distance of the pixels [m], and height of white as a share
of the robot's standing height. Chosen: about a foot, and what is stepped on."""


class Filling(str, Enum):
    """What is put in place of unknown heights."""

    nearest = "nearest"
    highest = "highest"
    lowest = "lowest"


class Method(str, Enum):
    """Which point of a cloud counts."""

    highest = "highest"
    median = "median"


@dataclass(frozen=True)
class GroundChoice:
    """What the options say of the ground.

    Attributes:
        reading: keywords of :func:`gaitopt.load_ground`; only those that were given.
        making: keywords of :func:`gaitopt.make_ground`; only those that were given.
        grid: distance of the points of the grid that the map is put on [m].
        fill: what is put in place of unknown heights.
    """

    reading: dict[str, Any]
    making: dict[str, Any]
    grid: float | None
    fill: str | None

    def load(self, source: str, robot: Quadruped) -> HeightMap:
        """The ground in a file, or the made ground of a name.

        Raises:
            GroundError: there is no such file or ground, or the file cannot be read.
            InputError: an option is out of range, or does not fit the ground.
            MissingPackageError: as for :func:`gaitopt.load_ground`.
        """
        ground = self.made(source, robot) if is_made(source) else self._read(Path(source), robot)
        if self.fill is not None:
            ground = ground.filled(self.fill)
        return ground if self.grid is None else ground.resampled(self.grid)

    def made(self, name: str, robot: Quadruped) -> HeightMap:
        """Made ground to a robot's size."""
        from gaitopt.terrain.maps.catalogue import make_ground

        other = [n for n in self.reading if n != "resolution"]
        if other:
            raise InputError(f"--{other[0]} says how a file is read, and {name} is made ground")
        return make_ground(name, robot=robot, **{**self.reading, **self.making})

    def _read(self, path: Path, robot: Quadruped) -> HeightMap:
        """The ground in a file; a PNG without a scale gets one to the robot's size."""
        from gaitopt.terrain.ground_files.load import load_ground
        from gaitopt.terrain.maps.catalogue import ground_names

        if not path.exists():
            raise GroundError(
                f"there is no file {path}, and no ground of this name is made; those are "
                f"{', '.join(ground_names())}"
            )
        if self.making:
            name = next(iter(self.making)).replace("_", "-")
            raise InputError(f"--{name} is for ground that is made, and {path} is a file")
        reading = dict(self.reading)
        if path.suffix.lower() == ".png" and not {"resolution", "heights"} <= reading.keys():
            reading = {**_scale(robot), **reading}
            low, high = reading["heights"]
            typer.echo(
                f"{path.name} tells no scale: {1e3 * reading['resolution']:g} mm a pixel, black "
                f"{low:g} m and white {high:g} m high; --resolution and --heights change it",
                err=True,
            )
        try:
            ground = load_ground(path, **reading)
        except GroundError as error:
            raise GroundError(in_ground_options(str(error))) from error
        except InputError as error:
            raise InputError(in_ground_options(str(error))) from error
        if "origin" not in self.reading and self._is_placed(path):
            middle = ground.resolution * (ground.shape[1] - 1) / 2.0
            ground = replace(ground, origin=(0.0, -middle))
        return ground

    def _is_placed(self, path: Path) -> bool:
        """Whether a file tells no place."""
        from gaitopt.terrain.ground_files.arrays import tells_place

        kind = path.suffix.lower()
        return kind in PLACED or (
            kind == ".npz" and not tells_place(path, self.reading.get("layer"))
        )


def _scale(robot: Quadruped) -> dict[str, Any]:
    """The scale of a PNG that fits a robot."""
    return {"resolution": PIXEL, "heights": (0.0, round(WHITE * robot.standing_height, 2))}


def is_made(source: str) -> bool:
    """Whether a name is that of ground which is made."""
    from gaitopt.terrain.maps.catalogue import ground_names

    return source in ground_names()


def in_ground_options(text: str) -> str:
    """A message of ``load_ground`` with the options of the command line in place of keywords."""
    text = re.sub(r"\b(heights|origin)=\((\S+), (\S+)\)", r"--\1 \2,\3", text)
    text = re.sub(r"\b(resolution|unit|message)=(?=[-\d.])", r"--\1 ", text)
    text = re.sub(r"\b(layer|topic|method)=(?:'(\w+)'|(\.\.\.))", r"--\1 \2\3", text)
    return re.sub(r"\boption (\w+);", r"option --\1;", text)


def _file(text: str, metavar: str | None = None) -> Any:
    """An option that says how a file is read, with its help."""
    return typer.Option(help=text, metavar=metavar, rich_help_panel="Ground from a file")


def _made(text: str, metavar: str | None = None, **limits: Any) -> Any:
    """An option of made ground, with its help."""
    return typer.Option(help=text, metavar=metavar, rich_help_panel="Ground that is made", **limits)


def ground_options(
    resolution: Annotated[
        float | None,
        _file("Distance between neighbouring points, in metres; a PNG: 0.02.", "METRES")
    ] = None,
    heights: Annotated[
        str | None,
        _file("Heights of black and of white in a PNG, in metres: 0,0.15. Without it white is as "
              "high as 0.3 of the standing height.", "LOW,HIGH")
    ] = None,
    origin: Annotated[
        str | None,
        _file("x and y of the map's lowest corner, in metres. Without it images and arrays begin "
              "at x = 0, with y = 0 in their middle; other files, also saved maps, say "
              "where they are.", "X,Y"),
    ] = None,
    unit: Annotated[
        float | None, _file("Unit of a mesh or a cloud of points: 0.001 for millimetres.", "METRES")
    ] = None,
    method: Annotated[
        Method | None, _file("Height where a cloud has several points.")
    ] = None,
    layer: Annotated[
        str | None, _file("Array of an npz file, or layer of a grid map.", "NAME")
    ] = None,
    topic: Annotated[str | None, _file("Topic of the grid maps in a bag.", "NAME")] = None,
    message: Annotated[int | None, _file("Number of the message in a bag; -1: the last.")] = None,
    grid: Annotated[
        float | None, _file("Put the map on a grid with this distance, in metres.", "METRES")
    ] = None,
    fill: Annotated[
        Filling | None,
        _file("Put heights in place of unknown ones: those of the nearest known points, or the "
              "highest or lowest around a hole. That is a guess, for you to judge."),
    ] = None,
    seed: Annotated[int | None, _made("Seed of the ground; 0 by default.", min=0)] = None,
    difficulty: Annotated[
        float | None, _made("From 0, easy, to 1; 0.5 by default.", min=0.0, max=1.0)
    ] = None,
    length: Annotated[
        float | None, _made("From start to goal, in metres; 3 by default.", "METRES")
    ] = None,
    size: Annotated[
        list[str] | None,
        _made("A size of the ground instead of what follows from the difficulty, in metres or "
              "radians, as riser=0.1 for stairs; the page on terrain lists them.", "NAME=NUMBER"),
    ] = None,
) -> GroundChoice:  # fmt: skip
    """What the options say of the ground.

    Raises:
        InputError: an option is not written as its help says.
    """
    reading = {
        "resolution": resolution,
        "heights": None if heights is None else numbers("--heights", heights, 2),
        "origin": None if origin is None else numbers("--origin", origin, 2),
        "unit": unit, "method": None if method is None else method.value,
        "layer": layer, "topic": topic, "message": message,
    }  # fmt: skip
    making = {"seed": seed, "difficulty": difficulty, "length": length, **_sizes(size)}
    return GroundChoice(
        {k: v for k, v in reading.items() if v is not None},
        {k: v for k, v in making.items() if v is not None},
        grid, None if fill is None else fill.value,
    )  # fmt: skip


def _sizes(given: list[str] | None) -> dict[str, float]:
    """Sizes by name; raises InputError where one is no number."""
    sizes: dict[str, float] = {}
    for text in given or []:
        name, mark, value = text.partition("=")
        try:
            sizes[name] = float(value)
        except ValueError:
            mark = ""
        if not mark or not name:
            raise InputError(f"--size takes NAME=NUMBER, got {text!r}")
    return sizes
