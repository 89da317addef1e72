"""Figures without pixels, which take most of the time: for tests that look at names of files."""

from __future__ import annotations

from typing import Any

from PIL import Image


def save_without_pixels(figure: object, file: Any, **_: Any) -> None:
    """Instead of ``Figure.savefig``: a PNG file that shows nothing."""
    Image.new("RGB", (4, 4)).save(file, format="PNG")
