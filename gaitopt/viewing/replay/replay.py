"""Replays: a plan as one HTML file that plays in any browser, or inside a notebook."""

from __future__ import annotations

import html
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gaitopt.errors import InputError, MissingPackageError
from gaitopt.files import StrPath, written_whole
from gaitopt.inputs import as_text
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory
from gaitopt.viewing.ground_search import GroundSearch
from gaitopt.viewing.replay.mesh_files import MeshFolders
from gaitopt.viewing.replay.page import render
from gaitopt.viewing.replay.physics.happened import SimulatedWalk
from gaitopt.viewing.replay.plan_page import plan_page


def replay(
    plan: Plan,
    path: StrPath,
    *,
    title: str | None = None,
    meshes: MeshFolders = False,
    simulated: Trajectory | SimulatedWalk | None = None,
    search: GroundSearch | None = None,
) -> Path:
    """Write a plan as one HTML file that plays in any browser, without a network.

    It shows the robot, the columns, the ways of feet and body, and at each instant the support
    polygon with its inside less the stability margin. Where forces are promised, it shows during
    each swing where they hold the robot's centre of mass, too; a button hides it. What moves is
    within 0.1 mm (body) and 0.1 mrad (each joint) of the plan. The address may say where to start:
    ``walk.html#t=60&paused&speed=5&follow&no-region``.

    On a height map it shows the ground instead of columns, with footholds and normals upon it; a
    button shows where feet may stand, and another one what a search tried. A map with more than
    150,000 points is cut off around the walk or drawn more coarsely, and the page says so.

    Args:
        plan: the motion.
        path: the file, which appears complete or not at all.
        title: heading; the robot's name by default.
        meshes: for robots whose URDF names mesh files. ``False`` draws them as tubes along their
            joints, in about 1 MB. ``True`` embeds example-robot-data's meshes; a folder, or
            several, the meshes found there (up to tens of MB), and leaves out links whose meshes
            are missing.
        simulated: the same plan in physics, the result of ``gaitopt.simulate(plan)`` (or its
            ``motion``, without verdict, torques and forces). It is shown in full, sampled twenty
            times a second, and the plan's robot as a ghost beside it. Support polygons, captions
            and curves are those of what happened; a fall and missed footholds are marked.
        search: for the footholds of the plan, over its height map: what it tried is shown, and the
            way that it was asked for.

    Returns:
        The path of the file.

    Raises:
        InputError: the file cannot be written, no mesh is there, or ``simulated`` is another
            robot's motion.
    """
    text = replay_html(plan, title=title, meshes=meshes, simulated=simulated, search=search)
    with written_whole(path) as stream:
        stream.write(text)
    return Path(path)


def show(
    plan: Plan,
    height: int = 500,
    *,
    title: str | None = None,
    meshes: MeshFolders = False,
    simulated: Trajectory | SimulatedWalk | None = None,
    search: GroundSearch | None = None,
) -> Any:
    """The replay inside a Jupyter notebook; see :func:`replay`.

    Args:
        plan: the motion.
        height: of the frame [pixels].
        title, meshes, simulated, search: as for :func:`replay`.

    Returns:
        An ``IPython.display.HTML``. The replay runs in a frame of its own that can reach neither
        the notebook nor the network.

    Raises:
        InputError: ``height`` is no positive whole number, or a mesh is missing.
        MissingPackageError: IPython is not installed.
    """
    return in_notebook(
        lambda: replay_html(plan, title=title, meshes=meshes, simulated=simulated, search=search),
        height,
    )


def in_notebook(page: Callable[[], str], height: int) -> Any:
    """A page in a frame of a Jupyter notebook that can reach neither notebook nor network.

    Args:
        page: makes the page's text.
        height: of the frame [pixels].

    Raises:
        InputError: ``height`` is no positive whole number.
        MissingPackageError: IPython is not installed.
    """
    if isinstance(height, bool) or not 50 <= int(height) <= 10_000:
        raise InputError(f"height must be from 50 to 10000 pixels, got {as_text(height)}")
    try:
        from IPython.display import HTML
    except ImportError as error:
        raise MissingPackageError(
            "show() needs a notebook: pip install 'gaitopt[notebook]'"
        ) from error
    inside = html.escape(page(), quote=True)
    return HTML(  # type: ignore[no-untyped-call]
        f'<div><iframe srcdoc="{inside}" sandbox="allow-scripts" title="gaitopt replay" '
        f'style="width:100%;height:{int(height)}px;border:0"></iframe></div>'
    )


def replay_html(
    plan: Plan,
    *,
    title: str | None = None,
    meshes: MeshFolders = False,
    simulated: Trajectory | SimulatedWalk | None = None,
    search: GroundSearch | None = None,
) -> str:
    """The text of :func:`replay`'s file."""
    return render(plan_page(plan, title, meshes, simulated, search))
