"""Figures as PNG files. A file that cannot be written completely is not written at all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from gaitopt.errors import InputError
from gaitopt.files import StrPath, written_whole
from gaitopt.viewing.figures.panels import Panels, figure_of, figures_for_files

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from PIL.Image import Image

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

    # A palette is enough for lines on white, and makes files three times smaller. The default way
    # to choose it, median cut, could give two legs the same colour where few pixels have it.
    # Rounds of k-means would take as long as all the rest; colours are off by 14 of 255 at most
    # without them, and by 17 with two.
    small = pixels_of(figure_of(drawn)).quantize(
        COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
    )
    # The highest level of compression takes seven times as long and saves 8 %.
    with written_whole(path, binary=True) as stream:
        small.save(stream, format="PNG", dpi=(DPI, DPI))
    return path


def pixels_of(figure: Figure) -> Image:
    """A figure in colours, at :data:`DPI`."""
    from PIL import Image

    buffer = BytesIO()
    with _laid_out(figure):
        # Here it only passes through memory, as plain pixels.
        figure.savefig(buffer, format="tiff", dpi=DPI)
    return Image.open(buffer).convert("RGB")


@contextmanager
def _laid_out(figure: Figure) -> Iterator[None]:
    """A figure has its layout inside the block, and no engine for it.

    ``Figure.savefig`` would draw a figure with an engine twice, the first time for the layout only.
    """
    engine, dpi = figure.get_layout_engine(), figure.dpi
    # Another resolution would change the size of a window.
    if engine is None or figure.canvas.manager is not None:
        yield
        return
    figure.dpi = DPI
    try:
        # As in Figure.draw: what has no compressed layout keeps the places of its axes.
        with suppress(ValueError):
            engine.execute(figure)
        figure.set_layout_engine(None)
        yield
    finally:
        figure.set_layout_engine(engine)
        figure.dpi = dpi
