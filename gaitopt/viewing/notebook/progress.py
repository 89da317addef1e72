"""How far a planner is: below the cell of a notebook, or in the terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from importlib import import_module
from typing import Any, Final

from gaitopt.conventions import Progress
from gaitopt.inputs import check_kind

EVERY: Final = 0.1
"""Least time between two pictures of a bar [s]. Chosen: more often cannot be read."""


@contextmanager
def progress_bar(text: str) -> Iterator[Progress]:
    """A bar that shows how far a planner, a race or a study is.

    It is below the cell of a notebook, or in the terminal; where nobody looks, as in a file, there
    is none. It goes when the work is done::

        with gaitopt.progress_bar("planning") as progress:
            plan = gaitopt.plan_terrain(robot, ground, goal, progress=progress)

    Args:
        text: what is being done.

    Yields:
        A function of how much is done and how much there is in all, for arguments with the name
        ``progress``.
    """
    check_kind("text", text, str)
    show = _in_notebook()
    if show is None:
        with _in_terminal(text) as drawn:
            yield drawn
        return
    shown, last = show(""), 0.0

    def tick(done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= EVERY:
            shown(bar(text, done, total))
            last = now

    try:
        yield tick
    finally:
        shown("")


def bar(text: str, done: int, total: int) -> str:
    """A bar as HTML."""
    most = max(total, 1)
    return f'{escape(text)} <progress value="{done}" max="{most}"></progress> {done} of {total}'


def _in_notebook() -> Callable[[str], Callable[[str], None]] | None:
    """What shows HTML below the cell and changes it; ``None`` outside of notebooks."""
    ipython = sys.modules.get("IPython")
    if ipython is None or not hasattr(ipython.get_ipython(), "kernel"):
        return None
    view: Any = import_module("IPython.display")

    def show(html: str) -> Callable[[str], None]:
        handle = view.display(view.HTML(html), display_id=True)

        def update(text: str) -> None:
            handle.update(view.HTML(text))

        return update

    return show


@contextmanager
def _in_terminal(text: str) -> Iterator[Progress]:
    """A bar in the terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
               TimeElapsedColumn())  # fmt: skip
    console = Console(stderr=True)
    # Where nobody looks at it, a bar would leave empty lines.
    hidden = not console.is_terminal
    with Bar(*columns, console=console, transient=True, disable=hidden) as drawn:
        task = drawn.add_task(text, total=None)
        yield lambda done, total: drawn.update(task, completed=done, total=total)
