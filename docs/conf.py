"""How Sphinx builds the site: ``make docs``, or ``sphinx-build -W docs docs/_build/html``."""

from __future__ import annotations

import gc
import inspect
import os
from pathlib import Path
from typing import TYPE_CHECKING

from docutils import nodes
from docutils.parsers.rst import Directive, directives
from docutils.utils.math.latex2mathml import tex2mathml

import gaitopt

if TYPE_CHECKING:
    from sphinx.application import Sphinx
    from sphinx.writers.html5 import HTML5Translator

# The trees of all pages stay until the end. To look through them for objects that nobody needs took
# a third of the time of a build.
gc.set_threshold(100_000, 20, 100)

project = "gaitopt"
author = "The gaitopt authors"
copyright = author
version = release = gaitopt.__version__

extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_build"]

# Notebooks are kept without outputs. `make docs` runs them, so that the site shows what they make;
# without GAITOPT_NOTEBOOKS they are shown as they are, which is quick.
nb_execution_mode = os.environ.get("GAITOPT_NOTEBOOKS", "off")
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_merge_streams = True


def copy_notebooks() -> None:
    """Put the notebooks below this folder, where Sphinx finds them, with links from there."""
    here = Path(__file__).parent
    (here / "notebooks").mkdir(exist_ok=True)
    for notebook in (here.parent / "notebooks").glob("*.ipynb"):
        copy = here / "notebooks" / notebook.name
        text = notebook.read_text("utf-8").replace("](../docs/", "](../")
        if not copy.is_file() or copy.read_text("utf-8") != text:
            copy.write_text(text, "utf-8")


copy_notebooks()

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
html_static_path = ["_static"]
# Set by make_site.py: the versions of the site, which lie in folders beside each other.
versions = [name for name in os.environ.get("GAITOPT_VERSIONS", "").split(",") if name]
html_css_files = ["site.css"]
# Formulas as MathML, which browsers draw themselves: the site needs no network and no script.
html_math_renderer = "mathml"


def mathml(tex: str, block: bool) -> str:
    """A formula as MathML; docutils 0.21 renamed the argument."""
    if "as_block" in inspect.signature(tex2mathml).parameters:
        return str(tex2mathml(tex, as_block=block))
    return str(tex2mathml(tex, inline=not block))


def visit_inline(self: HTML5Translator, node: nodes.math) -> None:
    """Write a formula in the text."""
    self.body.append(mathml(node.astext(), block=False))
    raise nodes.SkipNode


def visit_block(self: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula in a line of its own."""
    self.body.append(f'<div class="math-block">{mathml(node.astext(), block=True)}</div>')
    raise nodes.SkipNode


class Replay(Directive):
    """A replay of the gallery that plays in the page, and the command that made it.

    ``make docs`` makes the replays. A site that is built without them says so in their places.
    """

    required_arguments = 1
    has_content = True
    option_spec = {"command": directives.unchanged_required}  # noqa: RUF012

    def run(self) -> list[nodes.Node]:
        """The nodes of the page."""
        name = self.arguments[0]
        caption = nodes.container(classes=["replay-caption"])
        self.state.nested_parse(self.content, self.content_offset, caption)
        command = nodes.literal_block(text="$ " + self.options["command"], language="text")
        if not (Path(__file__).parent / "_static" / "replays" / f"{name}.html").is_file():
            missing = nodes.paragraph(
                text="The replay is not here: this site was not built by make docs."
            )
            return [caption, missing, command]
        page = f"_static/replays/{name}.html"
        frame = (f'<iframe class="replay" loading="lazy" title="replay: {name}" '
                 f'src="{page}#paused"></iframe>')  # fmt: skip
        return [caption, nodes.raw("", frame, format="html"), command]


def escape_bars(
    app: object, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    """Docstrings write magnitudes as ``|x|``, which reStructuredText takes for substitutions."""
    for i, line in enumerate(lines):
        parts = line.split("``")
        parts[::2] = [part.replace("|", r"\|") for part in parts[::2]]
        lines[i] = "``".join(parts)


def links_to_versions(page: str) -> str:
    """What stands above a page: links to all versions, also from pages in folders."""
    up = "../" * (1 + page.count("/"))
    links = " · ".join(f'<a href="{up}{name}/index.html">{name}</a>' for name in versions)
    return f"Versions: {links}"


def list_versions(
    app: object, page: str, template: str, context: dict[str, object], doctree: object
) -> None:
    """Put the versions above a page, once there are several."""
    if len(versions) > 1:
        context["theme_announcement"] = links_to_versions(page)


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.add_directive("replay", Replay)
    app.connect("autodoc-process-docstring", escape_bars)
    app.connect("html-page-context", list_versions)
    app.add_html_math_renderer("mathml", (visit_inline, None), (visit_block, None))
