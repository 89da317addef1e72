"""The command ``gaitopt stride``: over an obstacle, and the study of the swings that do it."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from gaitopt.cli_options import OutOption
from gaitopt.cli_support import make_folder, progress_bar, terminal
from gaitopt.errors import InputError, MissingPackageError

if TYPE_CHECKING:
    from gaitopt.planning.plan import Plan
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.terrain.obstacles import Obstacle

PAPER_BOARD = (0.11, 0.04)
"""Height and width of the paper's board [m], for its robot."""
PAPER_MARGIN = 0.03
"""The paper's distance between foot and board [m]."""
PAPER_HIPS = 0.72
"""Height of its hips over its feet [m]; obstacles for other robots are to their scale."""


class Shape(str, Enum):
    """Section of an obstacle."""

    rectangular = "rectangular"
    round = "round"
    triangular = "triangular"


StriderOption = Annotated[
    str,
    typer.Option("--robot", help="A robot's name (see [bold]gaitopt robot --list[/]) or a URDF "
                 "file.", rich_help_panel="What strides over what"),
]  # fmt: skip
ShapeOption = Annotated[
    Shape, typer.Option(help="Section of the obstacle.", rich_help_panel="What strides over what")
]
HeightOption = Annotated[
    float | None,
    typer.Option(help="Height of the obstacle, in metres; the paper's 0.11 to the robot's scale "
                 "by default.", rich_help_panel="What strides over what", show_default=False),
]  # fmt: skip
WidthOption = Annotated[
    float | None,
    typer.Option(help="Width of its section, in metres; the paper's 0.04 to the robot's scale by "
                 "default. A round one is as wide as it is high.",
                 rich_help_panel="What strides over what", show_default=False),
]  # fmt: skip
PositionOption = Annotated[
    float | None,
    typer.Option(help="Its place ahead of the middle of the robot, in metres; by default where "
                 "the robot gets to in its stride.",
                 rich_help_panel="What strides over what", show_default=False),
]  # fmt: skip
ClearanceOption = Annotated[
    float | None,
    typer.Option("--margin", help="Distance that feet keep from it, in metres; the paper's 0.03 "
                 "to the robot's scale by default.", rich_help_panel="How", show_default=False),
]  # fmt: skip
StabilityOption = Annotated[
    float | None,
    typer.Option("--stability-margin", help="Static stability margin, in metres; the planner's "
                 "own by default.", rich_help_panel="How", show_default=False),
]  # fmt: skip
StudyOption = Annotated[
    bool,
    typer.Option("--study", help="Instead, print the study of the paper's swing: our splines, the "
                 "paper's, TOPP-RA's, and uniform scaling."),
]  # fmt: skip


def obstacle_for(
    robot: Quadruped,
    shape: Shape,
    height: float | None,
    width: float | None,
    position: float,
) -> Obstacle:
    """The obstacle that the options describe, on the ground below a robot's feet."""
    from gaitopt.terrain import obstacles

    usual = [round(size * scale_of(robot), 3) for size in PAPER_BOARD]
    high = usual[0] if height is None else height
    place = (position, 0.0, -robot.foot_radius)
    if shape is Shape.round:
        if width is not None and width != high:
            raise InputError("a round obstacle is as wide as it is high: leave --width out")
        return obstacles.round_obstacle(high, position=place)
    make = {
        Shape.rectangular: obstacles.rectangular_obstacle,
        Shape.triangular: obstacles.triangular_obstacle,
    }[shape]
    return make(high, usual[1] if width is None else width, position=place)


def scale_of(robot: Quadruped) -> float:
    """Size of a robot's legs against those of the paper's robot."""
    from gaitopt.robots.catalog import load_robot

    return robot.standing_height / load_robot("frog1").standing_height


def print_study() -> None:
    """The table of the paper's swing; without TOPP-RA where that is not installed."""
    from gaitopt.optimize.spline_reference import compare_splines

    note = ""
    with progress_bar("optimising swings"):
        try:
            comparison = compare_splines()
        except MissingPackageError as missing:
            comparison, note = compare_splines(with_toppra=False), f"\n{missing}"
    terminal().print(escape(comparison.table() + note))
