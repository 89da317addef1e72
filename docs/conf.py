"""How Sphinx builds the site: ``make docs``, or ``sphinx-build -W docs docs/_build/html``."""

from __future__ import annotations

import gaitopt

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
