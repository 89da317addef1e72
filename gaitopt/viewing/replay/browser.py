"""Open a replay in the web browser of this machine."""

from __future__ import annotations

import os
import tempfile
import webbrowser
from pathlib import Path

from gaitopt.errors import InputError
from gaitopt.files import StrPath
from gaitopt.plan.plan import Plan
from gaitopt.viewing.ground_search import GroundSearch
from gaitopt.viewing.replay.mesh_files import MeshFolders
from gaitopt.viewing.replay.replay import replay_html


def view(
    plan: Plan,
    *,
    title: str | None = None,
    meshes: MeshFolders = False,
    folder: StrPath | None = None,
    search: GroundSearch | None = None,
) -> Path:
    """Write a plan's replay to a new temporary file and open it in the default browser.

    The file is a page that needs neither a server nor a network. Only the user of this process can
    read it. It is not deleted when Python ends, since the browser may still load it; the system
    empties its temporary folder from time to time. To keep a replay, write it with
    :func:`gaitopt.replay`.

    Args:
        plan: the motion.
        title, meshes, search: as for :func:`gaitopt.replay`.
        folder: where the file is made; the system's temporary folder by default. Some browsers
            cannot read files there, for instance Firefox as a snap on Ubuntu; then give a folder in
            your home.

    Returns:
        The path of the file. If no browser could be started, open it yourself.

    Raises:
        InputError: the folder does not exist or cannot be written to, or a mesh is missing.
    """
    page = replay_html(plan, title=title, meshes=meshes, search=search)
    try:
        # mkstemp makes files with mode 0600, whatever the umask is.
        handle, name = tempfile.mkstemp(prefix="gaitopt-", suffix=".html", dir=folder)
        with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as stream:
            stream.write(page)
    except OSError as error:
        raise InputError(
            f"cannot write a replay into {folder or tempfile.gettempdir()}: "
            f"{error.strerror or error}; give folder=, where files may be written"
        ) from error
    open_in_browser(name)
    return Path(name)


def open_in_browser(path: StrPath) -> bool:
    """Open a file in the default browser; return whether a browser was started."""
    return webbrowser.open(Path(path).resolve().as_uri())
