"""The command ``gaitopt robot``: what gaitopt found in a robot's file, and what to look at."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitopt.cli.completion import complete_robot
from gaitopt.cli.options import JsonOption
from gaitopt.cli.results.report import Report
from gaitopt.cli.results.run_folder import RunFolder, record_run, run_folder
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.support import file_name, random_terrain

if TYPE_CHECKING:
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.viewing.replay.mesh_files import MeshFolders

DRAWING = "What is written"


RobotArgument = Annotated[
    str,
    typer.Argument(
        help="A robot's name, or a file: URDF, xacro or MJCF.",
        metavar="ROBOT",
        autocompletion=complete_robot,
    ),
]


@takes_robot("wang2020", RobotArgument)
def robot(
    choice: RobotChoice,
    list_names: Annotated[
        bool, typer.Option("--list", help="List the names of all robots.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for a drawing (HTML), the URDF as gaitopt reads it, and "
                     "footholds of the robot's size to edit (CSV). With --open alone they get a "
                     "new one in out/.", rich_help_panel=DRAWING),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace such files in --out.",
                           rich_help_panel=DRAWING)
    ] = False,
    show: Annotated[
        bool, typer.Option("--open", help="Open the drawing in the browser.",
                           rich_help_panel=DRAWING)
    ] = False,
    meshes: Annotated[
        bool, typer.Option("--meshes", help="Draw the robot with its meshes, where they are found.",
                           rich_help_panel=DRAWING)
    ] = False,
    mesh_folder: Annotated[
        Path | None,
        typer.Option(help="Draw the robot with its meshes, which are in this folder.",
                     rich_help_panel=DRAWING),
    ] = None,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Show what gaitopt found in a robot's file, what it guessed, and every doubt with its cure."""
    import warnings

    from gaitopt.cli.robot_table import robot_document, robot_notes, robot_tables
    from gaitopt.errors import RobotWarning
    from gaitopt.robots.catalog import robot_names

    if list_names:
        names = Report(as_json, {"command": "robot", "names": robot_names()})
        names.say("\n".join(robot_names()))
        names.end()
        return
    with warnings.catch_warnings():
        # The notes say the same, below the table.
        warnings.simplefilter("ignore", RobotWarning)
        found = choice.load()
    report = Report(as_json, {"command": "robot", **robot_document(found)})
    for table in robot_tables(found):
        report.table(table)
    folders = choice.options.get("package_folders", [])
    for line in robot_notes(found, choice.source, folders):
        report.say(line)
    if out is not None or show:
        drawn = meshes if mesh_folder is None else mesh_folder
        stem = file_name(found.name) or "robot"
        written = [f"{stem}{end}" for end in (".html", ".urdf", "-footholds.csv")]
        folder = run_folder(out, f"robot-{stem}", overwrite, written)
        _write(found, folder, written, show, drawn, report)
    report.end()


def _write(
    found: Quadruped, folder: RunFolder, names: list[str], show: bool, meshes: MeshFolders,
    report: Report,
) -> None:  # fmt: skip
    """Write the drawing, the URDF and footholds."""
    from gaitopt.files import written_whole
    from gaitopt.viewing.replay.browser import open_in_browser
    from gaitopt.viewing.replay.robot_page import draw_robot

    with folder.writing() as (made, place):
        drawing, urdf, table = (made / name for name in names)
        draw_robot(found, drawing, meshes=meshes)
        with written_whole(urdf) as stream:
            stream.write(found.urdf)
        random_terrain(found, 0).to_csv(table)
        record_run(made, {"command": "robot", "files": names})
    drawing, urdf, table = (place / name for name in names)
    report.files({
        drawing: "the robot with legs, axes, feet and limits",
        urdf: "the robot as gaitopt reads it; --robot takes it",
        table: "footholds of its size; --footholds takes them",
    })  # fmt: skip
    if show and not open_in_browser(drawing):
        report.say("no browser could be started: open the file by hand")
