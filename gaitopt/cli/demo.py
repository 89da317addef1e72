"""The command ``gaitopt demo``: a whole walk, from planning to physics, in the browser."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from gaitopt.cli.completion import complete_robot
from gaitopt.cli.grouped_options import takes_options
from gaitopt.cli.results.deliver import PLAN, Delivery, deliver
from gaitopt.cli.results.options import Results, result_options
from gaitopt.cli.results.report import Report
from gaitopt.cli.results.run_folder import run_folder
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.support import file_name, progress_bar, random_terrain, summarise

if TYPE_CHECKING:
    from gaitopt.robots.quadruped import Quadruped

RobotArgument = Annotated[
    str,
    typer.Argument(help="A robot's name, or a file: URDF, xacro or MJCF.", metavar="ROBOT",
                   autocompletion=complete_robot),
]  # fmt: skip
PAGE = "demo.html"


@takes_robot("go2", RobotArgument)
@takes_options("results", result_options)
def demo(
    robot: RobotChoice,
    results: Results,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the replay in the browser.")
    ] = True,
) -> None:
    """See a robot walk: plan, certify, walk in physics, and open the replay in the browser.

    The robot crosses columns along an S that fit its size, 16 steps with each leg. It is drawn with
    its meshes where they are found.
    """
    from gaitopt.planners.crawl import plan_crawl

    model = robot.load()
    run = f"demo-{file_name(model.name) or 'robot'}"
    folder = run_folder(results.out, run, results.overwrite, (PAGE, PLAN))
    with progress_bar("planning") as tick:
        plan = plan_crawl(model, random_terrain(model, 0), progress=tick)
    meshes = results.meshes or _has_meshes(robot, model)
    asked = replace(results, fast=True, simulate=True, meshes=meshes,
                    show=results.show or browser)  # fmt: skip
    report = Report(results.as_json, {"command": "demo"})
    raise typer.Exit(deliver(Delivery(plan, summarise(plan), PAGE), folder, asked, report))


def _has_meshes(robot: RobotChoice, model: Quadruped) -> bool:
    """Whether example-robot-data has meshes of a robot."""
    from gaitopt.robots.catalog import EXAMPLE_ROBOTS, example_urdf
    from gaitopt.robots.files.meshes import found_meshes

    name = robot.source.strip().lower()
    if name not in EXAMPLE_ROBOTS:
        return False
    found = found_meshes(model.urdf, example_urdf(name).parent, [])
    return bool(found) and all(path is not None for path in found.values())
