"""Options on what a command writes and says, which all commands that plan share."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitopt.cli.options import JsonOption

if TYPE_CHECKING:
    from gaitopt.viewing.replay.mesh_files import MeshFolders

PANEL = "What is written"


def _written(text: str, *names: str, **more: Any) -> Any:
    return typer.Option(*names, help=text, rich_help_panel=PANEL, **more)


OutOption = Annotated[
    Path | None,
    _written("Folder for the results. By default each run gets a new one in out/, named after "
             "command and robot.", metavar="DIR", show_default=False),
]  # fmt: skip
OverwriteOption = Annotated[
    bool, _written("Replace the files of an earlier run in --out.", "--overwrite")
]

ReplaceOption = Annotated[bool, typer.Option("--overwrite", help="Replace files that are there.")]

OpenOption = Annotated[bool, _written("Open the replay in the browser.", "--open")]
MeshesOption = Annotated[
    bool, _written("Draw the robot with its meshes, where they are found.", "--meshes")
]
MeshFolderOption = Annotated[
    Path | None,
    _written("Draw the robot with its meshes, which are in this folder.", metavar="DIR",
             show_default=False),
]  # fmt: skip


@dataclass(frozen=True)
class Results:
    """What was asked for.

    Attributes:
        out: folder; ``None`` for a new one.
        overwrite: whether files of an earlier run are replaced.
        show: whether the replay is opened in the browser.
        fast: whether figures, and what plans are compared with, are left out.
        simulate: whether the plan is also walked in physics.
        as_json: whether a program reads the report.
        meshes: whether the robot is drawn with its meshes, or a folder in which they are.
    """

    out: Path | None
    overwrite: bool
    show: bool
    fast: bool
    simulate: bool
    as_json: bool
    meshes: MeshFolders


def result_options(
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    show: OpenOption = False,
    fast: Annotated[
        bool, _written("Leave out figures, and plans to compare with.", "--fast")
    ] = False,
    simulate: Annotated[
        bool,
        _written("Also walk the plan in physics; the replay shows both.", "--simulate"),
    ] = False,
    meshes: MeshesOption = False,
    mesh_folder: MeshFolderOption = None,
    as_json: JsonOption = False,
) -> Results:  # fmt: skip
    """What the options ask for."""
    drawn = meshes if mesh_folder is None else mesh_folder
    return Results(out, overwrite, show, fast, simulate, as_json, drawn)
