"""Lower bounds of dependencies are those that ``make lowest`` wrote down."""

from __future__ import annotations

import runpy
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BOUNDS = runpy.run_path(str(ROOT / ".ci" / "bounds.py"))["bounds"]


def test_the_bounds_are_those_that_make_lowest_wrote_down() -> None:
    stated = BOUNDS((ROOT / "pyproject.toml").read_text("utf-8"))
    written = (ROOT / ".ci" / "lowest.txt").read_text("utf-8").splitlines()
    assert stated == written, "bounds changed: run `make PYTHON=python3.10 lowest`, commit its file"


def test_bounds_of_python_packages_and_extras_are_read() -> None:
    text = 'requires-python = ">=3.9"\ndependencies = [\n    "a-b>=1.2",\n    "c[d]==3",\n]\n'
    assert BOUNDS(text) == ["a-b>=1.2", "c[d]==3", "python>=3.9"]
    assert BOUNDS('x = ["a-b>=1.3"]') == ["a-b>=1.3"]
