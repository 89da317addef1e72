"""Figures without pixels, which take most of the time: for tests that look at names of files."""

from __future__ import annotations

from typing import Any

from PIL import Image


def without_pixels(figure: object) -> Any:
    """Instead of ``gaitopt.viewing.figures.files.pixels_of``: a picture that shows nothing."""
    return Image.new("RGB", (4, 4))
