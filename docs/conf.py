"""How Sphinx builds the site: ``make docs``, or ``sphinx-build -W docs docs/_build/html``."""

from __future__ import annotations

from typing import TYPE_CHECKING

import gaitopt

if TYPE_CHECKING:
    from sphinx.application import Sphinx

project = "gaitopt"
author = "The gaitopt authors"
copyright = author
version = release = gaitopt.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.napoleon",
]
exclude_patterns = ["_build"]

myst_enable_extensions = ["deflist", "dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
# Attributes are documented in the docstring of their class: members would repeat them.
napoleon_use_ivar = True
napoleon_numpy_docstring = False

html_theme = "furo"
html_title = f"gaitopt {release}"
html_show_sphinx = False


def escape_bars(app: object, what: str, name: str, obj: object, options: object,
                lines: list[str]) -> None:  # fmt: skip
    """Docstrings write magnitudes as ``|x|``, which reStructuredText takes for substitutions."""
    for i, line in enumerate(lines):
        parts = line.split("``")
        parts[::2] = [part.replace("|", r"\|") for part in parts[::2]]
        lines[i] = "``".join(parts)


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("autodoc-process-docstring", escape_bars)
