"""The command ``gaitopt robot``: what gaitopt found in a robot's URDF."""

from __future__ import annotations

from typing import Annotated

import typer

from gaitopt.cli.support import terminal


def robot(
    name: Annotated[str, typer.Argument(help="A robot's name or a URDF file.")] = "wang2020",
    list_names: Annotated[
        bool, typer.Option("--list", help="List the names of all robots.")
    ] = False,
) -> None:
    """Show what gaitopt found in a robot's URDF: legs, lengths, reach and limits."""
    from gaitopt.cli.robot_table import robot_table
    from gaitopt.robots.catalog import load_robot, robot_names

    if list_names:
        terminal().print("\n".join(robot_names()))
    else:
        terminal().print(robot_table(load_robot(name)))
