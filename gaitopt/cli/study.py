"""The command ``gaitopt study``: many terrains on all cores."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gaitopt.cli.options import (
    FreeOption,
    JobsOption,
    Objective,
    RobotOption,
    SeedOption,
    SpeedOption,
)
from gaitopt.cli.support import parse_speed, print_files, progress_bar, terminal
from gaitopt.files import written_whole


def study(
    table: Annotated[
        Path, typer.Argument(help="CSV file that rows are appended to.", metavar="TABLE")
    ] = Path("study.csv"),
    robot: RobotOption = "wang2020",
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
        robots=(robot,),
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
