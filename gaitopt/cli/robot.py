"""The command ``gaitopt robot``: what gaitopt found in a robot's file, and what to look at."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitopt.cli.support import file_name, make_folder, print_files, random_terrain, terminal
from gaitopt.errors import InputError

if TYPE_CHECKING:
    from gaitopt.robots.quadruped import Quadruped

DRAWING = "What is written"


def _reading(text: str, metavar: str | None = None) -> Any:
    """An option that says how the file is read, with its help."""
    return typer.Option(help=text, metavar=metavar, rich_help_panel="How the file is read")


def robot(
    name: Annotated[
        str, typer.Argument(help="A robot's name, or a file: URDF, xacro or MJCF.")
    ] = "wang2020",
    list_names: Annotated[
        bool, typer.Option("--list", help="List the names of all robots.")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for a drawing (HTML), the URDF as gaitopt reads it, and "
                     "footholds of the robot's size to edit (CSV).", rich_help_panel=DRAWING),
    ] = None,
    show: Annotated[
        bool, typer.Option("--open", help="Open the drawing in the browser.",
                           rich_help_panel=DRAWING)
    ] = False,
    mesh_folder: Annotated[
        Path | None,
        typer.Option(help="Draw the robot with its meshes, which are in this folder.",
                     rich_help_panel=DRAWING),
    ] = None,
    foot_radius: Annotated[float | None, _reading("Radius of the feet, in metres.")] = None,
    masses: Annotated[
        str | None,
        _reading("'shapes' estimates masses from the links' shapes, 'none' does without."),
    ] = None,
    velocity_limit: Annotated[
        float | None, _reading("Velocity limit of all joints, in rad/s.")
    ] = None,
    effort_limit: Annotated[float | None, _reading("Torque limit of all joints, in N m.")] = None,
    motor_inertia: Annotated[
        float | None, _reading("Inertia of motor and gear at every joint, in kg m².")
    ] = None,
    torque_line: Annotated[
        tuple[float, float] | None,
        _reading("Two speeds of all joints, in rad/s, with a space between them (10 30): up to the "
                 "first a motor has its whole torque, and at the second none.", "FULL NONE"),
    ] = None,
    leg: Annotated[
        list[str] | None, _reading("Foot link or last joint of a leg, as LF=NAME; four times.")
    ] = None,
    foot: Annotated[list[str] | None, _reading("Link of a leg's foot, as LF=NAME.")] = None,
    pose: Annotated[
        list[str] | None, _reading("Where a joint of no leg is locked, as JOINT=RADIANS.")
    ] = None,
    package_folder: Annotated[list[Path] | None, _reading("Folder with ROS packages.")] = None,
    argument: Annotated[
        list[str] | None, _reading("Argument of a xacro file, as NAME=VALUE.")
    ] = None,
) -> None:  # fmt: skip
    """Show what gaitopt found in a robot's file, what it guessed, and every doubt with its cure."""
    import warnings

    from gaitopt.cli.robot_table import robot_notes, robot_table
    from gaitopt.errors import RobotWarning
    from gaitopt.robots.catalog import load_robot, robot_names

    if list_names:
        terminal().print("\n".join(robot_names()))
        return
    folders = package_folder or []
    with warnings.catch_warnings():
        # The notes say the same, below the table.
        warnings.simplefilter("ignore", RobotWarning)
        found = load_robot(
            name, legs=_pairs("--leg", leg) or None, feet=_pairs("--foot", foot) or None,
            foot_radius=foot_radius, pose=_numbers("--pose", pose), masses=masses,
            velocity_limits=velocity_limit, effort_limits=effort_limit,
            motor_inertia=motor_inertia, torque_line=torque_line, package_folders=folders,
            xacro_arguments=_pairs("--argument", argument),
        )  # fmt: skip
    terminal().print(robot_table(found))
    for line in robot_notes(found, Path(name), folders):
        terminal().print(line)
    if out is not None or show:
        _write(found, out or Path(), show, mesh_folder)


def _write(found: Quadruped, out: Path, show: bool, mesh_folder: Path | None) -> None:
    """Write the drawing, the URDF and footholds."""
    from gaitopt.files import written_whole
    from gaitopt.viewing.replay.browser import open_in_browser
    from gaitopt.viewing.replay.robot_page import draw_robot

    make_folder(out)
    stem = file_name(found.name) or "robot"
    drawing, urdf, table = (out / f"{stem}{end}" for end in (".html", ".urdf", "-footholds.csv"))
    draw_robot(found, drawing, meshes=False if mesh_folder is None else mesh_folder)
    with written_whole(urdf) as stream:
        stream.write(found.urdf)
    random_terrain(found, 0).to_csv(table)
    print_files({
        drawing: "the robot with legs, axes, feet and limits",
        urdf: "the robot as gaitopt reads it; --robot takes it",
        table: "footholds of its size; --footholds takes them",
    })  # fmt: skip
    if show and not open_in_browser(drawing):
        terminal().print("no browser could be started: open the file by hand")


def _pairs(option: str, given: list[str] | None) -> dict[str, str]:
    """Values by name of an option ``NAME=VALUE``.

    Raises:
        InputError: one has no ``=``.
    """
    pairs = {}
    for text in given or []:
        name, mark, value = text.partition("=")
        if not mark or not name:
            raise InputError(f"{option} takes NAME=VALUE, got {text!r}")
        pairs[name] = value
    return pairs


def _numbers(option: str, given: list[str] | None) -> dict[str, float]:
    """Numbers by name of an option ``NAME=NUMBER``; raises InputError where one is none."""
    try:
        return {name: float(value) for name, value in _pairs(option, given).items()}
    except ValueError as error:
        raise InputError(f"{option} takes NAME=NUMBER: {error}") from None
