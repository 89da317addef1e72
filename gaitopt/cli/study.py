"""The command ``gaitopt study``: many terrains on all cores."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from gaitopt.cli.interrupts import keeping
from gaitopt.cli.options import (
    FRICTIONS,
    FreeOption,
    JobsOption,
    JsonOption,
    Objective,
    SeedOption,
    SpeedOption,
    Timing,
    TimingOption,
)
from gaitopt.cli.results.report import Report
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.support import file_name, parse_speed, progress_bar
from gaitopt.errors import InputError
from gaitopt.files import written_whole


def _map(text: str, **limits: Any) -> Any:
    """An option of walks over height maps, with its help."""
    return typer.Option(help=text, rich_help_panel="Walks over height maps", **limits)


OWN_ROBOT = "wang2020"


@takes_robot(OWN_ROBOT)
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
        bool, typer.Option("--simulate", "--physics", help="Also simulate every plan with physics.")
    ] = False,
    collisions: Annotated[
        bool | None,
        typer.Option(
            help="Whether to check for self-collisions; by default on height maps and with forces.",
            show_default=False,
        ),
    ] = None,
    free: FreeOption = None,
    timing: TimingOption = Timing.velocity,
    steps: Annotated[
        int,
        typer.Option(
            "--columns", help="Columns a leg; the first is where it stands.", min=1, max=1000
        ),
    ] = 17,
    every_robot: Annotated[
        bool, typer.Option("--every-robot", help="All robots that have names, not just --robot.")
    ] = False,
    terrain: Annotated[
        list[str] | None,
        _map(
            "Walk over height maps of this kind, as rubble or stairs; may be given more than once.",
            metavar="NAME",
        ),
    ] = None,
    difficulty: Annotated[
        list[float] | None,
        _map("From 0, easy, to 1; may be given more than once; 0.5 by default.", min=0.0, max=1.0),
    ] = None,
    length: Annotated[
        float | None, _map("From start to goal, in metres; 3 by default.", metavar="METRES")
    ] = None,
    size: Annotated[
        list[str] | None,
        _map(
            "A size of the ground in metres or radians, as height=0.1 for rubble, instead of what "
            "follows from the difficulty.",
            metavar="NAME=NUMBER",
        ),
    ] = None,
    friction: Annotated[
        float | None,
        _map(
            "Friction between feet and ground; 0.6 by default.", min=FRICTIONS[0], max=FRICTIONS[1]
        ),
    ] = None,
    widest: Annotated[
        int | None,
        _map(
            "Width up to which maps are searched once more before they count as not solvable, "
            "384 by default; 0 leaves that open.",
            min=0,
        ),
    ] = None,
    jobs: JobsOption = -1,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Compute on the Dask cluster at this address.", metavar="ADDRESS"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Plan, certify and simulate walks over many terrains on all cores.

    The terrains are columns, or with --terrain height maps over which footholds are searched for.
    With --simulate a second table tells whether planner, certificate and physics agree. A study
    that was stopped continues where its table ends.
    """
    count = range(seed or 0, (seed or 0) + seeds)
    columns = {"--objective": objective, "--stability-margin": stability_margin, "--free": free,
               "--speed": None if speed == "max" else speed,
               "--timing": None if timing is Timing.velocity else timing.value,
               "--columns": None if steps == 17 else steps,
               "--every-robot": every_robot or None}  # fmt: skip
    maps = {"--difficulty": difficulty, "--length": length, "--size": size,
            "--friction": friction, "--widest": widest}  # fmt: skip
    how: dict[str, Any] = {"jobs": jobs, "scheduler": scheduler}
    report = Report(as_json, {"command": "study"})
    if terrain:
        _refuse(columns, "is for walks over columns: leave out --terrain")
        on_maps = _map_fields(difficulty, length, size)
        on_maps |= {"collisions": collisions is not False, "simulate": with_physics,
                    "friction": friction}  # fmt: skip
        on_maps |= {} if widest is None else {"exhaustive": widest}
        _study_maps(count, [_source(robot, table)], terrain, on_maps, table, how, report)
        return
    _refuse(maps, "is for walks over height maps: give --terrain as well")
    from gaitopt.robots.catalog import robot_names
    from gaitopt.studies.study import grid, run_study
    from gaitopt.studies.study_report import plot_study, study_table

    if every_robot and (robot.options or robot.source != OWN_ROBOT):
        raise InputError(
            "--every-robot takes robots as they are: leave out --robot, and how one is read"
        )
    walks = grid(
        count,
        robots=robot_names() if every_robot else (_source(robot, table),),
        objectives=[o.value for o in objective or [Objective.distance]],
        stability_margins=stability_margin or [None],
        speed=parse_speed(speed),
        free=free,
        timing=timing.value,
        columns=steps,
        collisions=timing is Timing.forces if collisions is None else collisions,
        simulate=with_physics,
    )
    with _counting(table, len(walks)) as tick:
        rows = run_study(walks, table, progress=tick, **how)
    report.add(rows=rows)
    if with_physics:
        from gaitopt.studies.agreement import agreement_table

        report.table(agreement_table(rows))
    _show(study_table(rows), plot_study(rows), table, report)
    _exit_where_all_failed(rows)


def _study_maps(
    seeds: range, robots: list[str], terrains: list[str], others: dict[str, Any], table: Path,
    how: dict[str, Any], report: Report,
) -> None:  # fmt: skip
    """A study of made grounds."""
    from gaitopt.studies.terrain_report import plot_terrain_study, terrain_table
    from gaitopt.studies.terrain_study import run_terrain_study, terrain_grid
    from gaitopt.terrain.maps.catalogue import GROUNDS

    for name in terrains:
        if name not in GROUNDS:
            raise InputError(f"there is no ground named {name!r}; there are {', '.join(GROUNDS)}")
    walks = terrain_grid(seeds, robots=robots, terrains=terrains, **others)
    with _counting(table, len(walks)) as tick:
        rows = run_terrain_study(walks, table, progress=tick, **how)
    report.add(rows=rows)
    _show(terrain_table(rows), plot_terrain_study(rows), table, report)
    _exit_where_all_failed(rows)


@contextmanager
def _counting(table: Path, walks: int) -> Iterator[Callable[[int, int], None]]:
    """Show how far a study is, and say so when it is stopped.

    What is kept is counted in the table: a signal may come between a row and its progress.
    """
    done, lines = 0, 0

    def words() -> str:
        kept = done + (_lines(table) - lines if lines else 0)
        return f"{table} keeps {kept} of {walks} walks, and the same command goes on there"

    with progress_bar(f"{walks} walks") as tick, keeping(words):

        def progress(count: int, total: int) -> None:
            nonlocal done, lines
            if not lines:
                done, lines = count, _lines(table)
            tick(count, total)

        yield progress


def _lines(table: Path) -> int:
    """Lines of a file, each with its end; none where there is no file."""
    try:
        return table.read_bytes().count(b"\n")
    except OSError:
        return 0


def _exit_where_all_failed(rows: Sequence[Mapping[str, str]]) -> None:
    """End with an error where no walk has a result."""
    from gaitopt.studies.tables import as_cell

    if rows and all(row["status"] == "error" for row in rows):
        print(f"gaitopt: every walk ended in an error; the first: {as_cell(rows[0]['message'])}",
              file=sys.stderr)  # fmt: skip
        raise typer.Exit(2)


def _map_fields(
    difficulty: list[float] | None, length: float | None, size: list[str] | None
) -> dict[str, Any]:
    """Fields of walks over height maps from options; only those that were given.

    Raises:
        InputError: a size is not written as its help says.
    """
    from gaitopt.studies.terrain_study import sizes_of

    fields = {
        "difficulties": difficulty, "length": length,
        "sizes": ",".join(size) if size else None,
    }  # fmt: skip
    sizes_of(",".join(size or []))
    return {name: value for name, value in fields.items() if value is not None}


def _refuse(options: dict[str, Any], why: str) -> None:
    """Refuse options that were given; raises InputError that says why."""
    for name, value in options.items():
        if value is not None:
            raise InputError(f"{name} {why}")


def _show(summary: Any, drawn: Any, table: Path, report: Report) -> None:
    """Report a study's summary, and write its picture beside the table."""
    from gaitopt.viewing.figures.files import save_figure

    report.table(summary)
    picture = table.with_suffix(".png")
    save_figure(drawn, picture)
    report.files({table: "a row for each walk", picture: "the results as a picture"})
    report.end()


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
