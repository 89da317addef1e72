"""Figures as PNG files, each whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from gaitopt.errors import InputError
from gaitopt.files import StrPath, written_whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DPI = 150


def write_figures(figures: Mapping[str, Callable[[], Figure]], folder: StrPath) -> list[Path]:
    """Draw figures and write each to ``folder/name.png``; the folder is made when missing.

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
    return [save_figure(draw(), target / f"{name}.png") for name, draw in figures.items()]


def save_figure(figure: Figure, path: Path) -> Path:
    """Write one figure as a PNG file."""
    from PIL import Image

    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI)
    # A palette of 256 colours is plenty for lines on white, and a third of the size. Median cut,
    # the default, would give two legs one colour where few pixels have them.
    small = Image.open(buffer).convert("RGB").quantize(
        256, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE
    )  # fmt: skip
    with written_whole(path, binary=True) as stream:
        small.save(stream, format="PNG", dpi=(DPI, DPI), optimize=True)
    return path
