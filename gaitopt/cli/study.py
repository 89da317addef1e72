"""The command ``gaitopt study``: many terrains on all cores."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gaitopt.cli.options import (
    FreeOption,
    JobsOption,
    Objective,
    SeedOption,
    SpeedOption,
)
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.support import file_name, parse_speed, print_files, progress_bar, terminal
from gaitopt.files import written_whole


@takes_robot("wang2020")
def study(
    robot: RobotChoice,
    table: Annotated[
        Path, typer.Argument(help="CSV file that rows are appended to.", metavar="TABLE")
    ] = Path("study.csv"),
    seed: SeedOption = None,
    seeds: Annotated[int, typer.Option(help="How many terrains, from --seed on.", min=1)] = 100,
    objective: Annotated[
        list[Objective] | None, typer.Option(help="Objectives; may be given more than once.")
    ] = None,
    stability_margin: Annotated[
        list[float] | None, typer.Option(help="Margins in metres; may be given more than once.")
    ] = None,
    speed: SpeedOption = "max",
    with_physics: Annotated[
        bool, typer.Option("--simulate", help="Also simulate every plan with physics.")
    ] = False,
    collisions: Annotated[
        bool, typer.Option("--collisions", help="Also check for self-collisions.")
    ] = False,
    free: FreeOption = None,
    jobs: JobsOption = -1,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Compute on the Dask cluster at this address.", metavar="ADDRESS"),
    ] = None,
) -> None:
    """Plan, certify and simulate walks over many terrains on all cores.

    A study that was stopped continues where its table ends.
    """
    from gaitopt.studies.study import grid, run_study
    from gaitopt.studies.study_report import plot_study, study_table

    walks = grid(
        range(seed or 0, (seed or 0) + seeds),
        robots=(_source(robot, table),),
        objectives=[o.value for o in objective or [Objective.distance]],
        stability_margins=stability_margin or [None],
        speed=parse_speed(speed),
        free=free,
        collisions=collisions,
        simulate=with_physics,
    )
    with progress_bar(f"{len(walks)} walks") as tick:
        rows = run_study(walks, table, jobs=jobs, scheduler=scheduler, progress=tick)
    terminal().print(study_table(rows))
    picture = table.with_suffix(".png")
    with written_whole(picture, binary=True) as stream:
        plot_study(rows).savefig(stream, format="png", dpi=150)
    print_files({table: "a row for each walk", picture: "the results as a picture"})


def _source(robot: RobotChoice, table: Path) -> str:
    """What a study loads: the robot's name or file; with options, a file as gaitopt reads it.

    The file lies beside the table. Its name has digits of its content, because walks of the same
    robot are done only once.
    """
    if not robot.options:
        return robot.source
    found = robot.load()
    stem = f"{table.stem}-{file_name(found.name) or 'robot'}-{found.sha256[:8]}"
    path = table.with_name(f"{stem}.urdf")
    with written_whole(path) as stream:
        stream.write(found.urdf)
    return str(path)
