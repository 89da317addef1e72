"""A replay in the web browser of this machine."""

from __future__ import annotations

import os
import tempfile
import webbrowser
from pathlib import Path

from gaitopt.errors import InputError
from gaitopt.files import StrPath
from gaitopt.plan.plan import Plan
from gaitopt.viewing.replay.replay import replay_html


def view(
    plan: Plan,
    *,
    title: str | None = None,
    meshes: bool | StrPath = False,
    folder: StrPath | None = None,
) -> Path:
    """Write a plan's replay to a new temporary file and open it in the default browser.

    The file is one page that needs neither a server nor a network. Only the user of this process
    can read it. It stays when Python ends, so that the browser can load it at leisure; delete it,
    or leave that to the system, which empties its temporary folder. To keep a replay, write it with
    :func:`gaitopt.replay`.

    Args:
        plan: the motion.
        title, meshes: as for :func:`gaitopt.replay`.
        folder: where the file is made; the system's temporary folder by default. A browser that is
            confined, such as Firefox as a snap on Ubuntu, may not read there: give a folder in your
            home then.

    Returns:
        The path of the file. Where no browser could be started, open it by hand.

    Raises:
        InputError: the folder does not exist or cannot be written to, or a mesh is missing.
    """
    page = replay_html(plan, title=title, meshes=meshes)
    try:
        # Its mode is 0600, whatever the umask is.
        handle, name = tempfile.mkstemp(prefix="gaitopt-", suffix=".html", dir=folder)
        with os.fdopen(handle, "w", encoding="utf-8") as stream:
            stream.write(page)
    except OSError as error:
        raise InputError(
            f"cannot write a replay into {folder or tempfile.gettempdir()}: "
            f"{error.strerror or error}; give folder=, where files may be written"
        ) from error
    open_in_browser(name)
    return Path(name)


def open_in_browser(path: StrPath) -> bool:
    """Open a file in the default browser; whether a browser was started."""
    return webbrowser.open(Path(path).resolve().as_uri())
