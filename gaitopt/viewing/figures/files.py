"""Figures as PNG files. A file that cannot be written completely is not written at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from gaitopt.errors import InputError
from gaitopt.files import StrPath, written_whole
from gaitopt.viewing.figures.panels import Panels, figure_of, figures_for_files

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DPI = 150
"""Resolution. Chosen here: sharp on a screen, and about 100 kB a figure."""
COLOURS = 256
"""Colours of a file's palette: the most that PNG allows."""


def write_figures(
    figures: Mapping[str, Callable[[], Axes | Panels]], folder: StrPath
) -> list[Path]:
    """Draw figures and write each to ``folder/name.png``.

    Args:
        figures: functions that draw and return the axes, by name.
        folder: where to write; it is made if it does not exist.

    Raises:
        InputError: the folder cannot be made or written to.
    """
    target = Path(folder)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(
            f"cannot make the folder {target}: {error.strerror or error}; give a folder in a place "
            "that you may write to"
        ) from error
    with figures_for_files():
        return [save_figure(draw(), target / f"{name}.png") for name, draw in figures.items()]


def save_figure(drawn: Axes | Panels, path: Path) -> Path:
    """Write the figure of some axes as a PNG file and return the path.

    Raises:
        InputError: the file cannot be written.
    """
    from PIL import Image

    buffer = BytesIO()
    # It is compressed below: here it only passes through memory, as plain pixels.
    figure_of(drawn).savefig(buffer, format="tiff", dpi=DPI)
    # A palette is enough for lines on white, and makes files three times smaller. The default way
    # to choose it, median cut, could give two legs the same colour where few pixels have it.
    # Rounds of k-means would take as long as all the rest; colours are off by 14 of 255 at most
    # without them, and by 17 with two.
    small = Image.open(buffer).convert("RGB").quantize(
        COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
    )  # fmt: skip
    with written_whole(path, binary=True) as stream:
        small.save(stream, format="PNG", dpi=(DPI, DPI), optimize=True)
    return path
