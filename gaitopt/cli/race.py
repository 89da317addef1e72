"""The command ``gaitopt race``: the same footholds walked by several methods, side by side."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gaitopt.cli.options import (
    CollisionsOption,
    ComOption,
    FollowOption,
    FootholdsOption,
    FrictionOption,
    HeadingOption,
    HeightOption,
    JobsOption,
    JsonOption,
    MarginOption,
    ReachOption,
    SeedOption,
    SeedsOption,
    SequenceOption,
    SwingHeightOption,
    Timing,
    TimingOption,
)
from gaitopt.cli.results.deliver import show_page
from gaitopt.cli.results.options import (
    MeshesOption,
    MeshFolderOption,
    OpenOption,
    OutOption,
    OverwriteOption,
)
from gaitopt.cli.results.report import Report
from gaitopt.cli.results.run_folder import record_run, run_folder
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.support import (
    file_name,
    force_limits,
    load_inputs,
    make_folder,
    plan_options,
    progress_bar,
    run_name,
)
from gaitopt.errors import InputError

if TYPE_CHECKING:
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.studies.race_standings import Standings
    from gaitopt.terrain.footholds import Footholds
    from gaitopt.viewing.replay.mesh_files import MeshFolders

ColumnsOption = Annotated[
    int | None,
    typer.Option(help="Columns for each leg on random terrains; 17 by default, as in the paper.",
                 min=2, max=1000, rich_help_panel="What walks where", show_default=False),
]  # fmt: skip
RowsOption = Annotated[
    str | None,
    typer.Option(help="Rows of the table by name, as in ssm,swing,height; all by default. The "
                 "paper's method is always among them.", show_default=False, metavar="NAMES"),
]  # fmt: skip
PAGE, PICTURE, TABLE = "race.html", "race.png", "race.csv"
"""Names of the files that are written, beside the plans."""
CertifyOption = Annotated[bool, typer.Option(help="Certify every plan.")]
BoundOption = Annotated[bool, typer.Option(help="Compute lower bounds on the times.")]


@takes_robot("wang2020")
def race(
    robot: RobotChoice,
    footholds: FootholdsOption = None,
    seed: SeedOption = None,
    seeds: SeedsOption = 1,
    columns: ColumnsOption = None,
    rows: RowsOption = None,
    stability_margin: MarginOption = None,
    body_height: HeightOption = None,
    swing_height: SwingHeightOption = None,
    sequence: SequenceOption = "RH,RF,LH,LF",
    reach_fraction: ReachOption = 1.0,
    heading: HeadingOption = 0.0,
    follow_terrain: FollowOption = False,
    com: ComOption = None,
    timing: TimingOption = Timing.velocity,
    friction: FrictionOption = None,
    certify: CertifyOption = True,
    collisions: CollisionsOption = True,
    bound: BoundOption = True,
    jobs: JobsOption = -1,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    show: OpenOption = False,
    meshes: MeshesOption = False,
    mesh_folder: MeshFolderOption = None,
    as_json: JsonOption = False,
) -> None:
    """Race the paper's method against the time-optimal walks, side by side in one page.

    With --timing forces all rows but the paper's are timed by contact forces. A race over several
    terrains writes race.csv line by line, so that a race that was stopped leaves what it has found.
    """
    from gaitopt.studies.race import race as run_race
    from gaitopt.studies.race import race_many, row_names, shared_settings

    if footholds is not None and (seeds > 1 or columns is not None):
        raise InputError("--footholds excludes --seeds and --columns: a CSV is one terrain")
    names = row_names(None if rows is None else rows.split(","), timing.value)
    model, places = _inputs(robot, footholds, seed, columns)
    name = run_name("race", model, footholds, seed) + (f"-{seeds}-terrains" if seeds > 1 else "")
    folder = run_folder(out, name, overwrite, (PAGE, PICTURE, TABLE))
    report = Report(as_json, {"command": "race"})
    options = plan_options(
        stability_margin, body_height, swing_height, sequence, reach_fraction, heading,
        follow_terrain,
    )  # fmt: skip
    options["com"] = None if com is None else com.value
    options["forces"] = force_limits(friction)
    # Wrong settings are refused here, before anything is written.
    options = {"timing": timing.value} | shared_settings(model, places, options, timing.value)
    checks: dict[str, Any] = {"certify": certify, "collisions": collisions, "bound": bound}
    if seeds > 1:
        # The table is there from the first line on, and with it the folder.
        folder = folder.settled()
        make_folder(folder.path)
    with progress_bar("racing") as tick:
        if seeds == 1:
            found = run_race(model, places, names, progress=tick, **checks, **options).standings
        else:
            first = seed or 0
            found = race_many(
                model, range(first, first + seeds), names, columns=len(places), jobs=jobs,
                table=folder.path / TABLE, progress=tick, **checks, **options,
            )  # fmt: skip
    report.table(found.table())
    report.add(
        robot=found.robot, steps=found.steps, timing=found.timing, finishes=found.finishes
    )  # fmt: skip
    with folder.writing() as (made, place):
        files = _write(found, made, meshes if mesh_folder is None else mesh_folder)
        record_run(made, {"command": "race", "arguments": sys.argv[1:], "files": list(files)})
    plans = [name for name in files if name.startswith("plan_")]
    files = {name: what for name, what in files.items() if name not in plans}
    if plans:
        files["plan_*.npz"] = f"{len(plans)} plans: gaitopt verify, simulate, replay"
    if seeds > 1:
        files[TABLE] = "a line for each walk"
    report.files({place / name: what for name, what in files.items()})
    report.end()
    if show and PAGE in files:
        show_page(place / PAGE, report)
    if any(finish.verdict in ("failed", "violated") for finish in found.finishes):
        raise typer.Exit(1)


def _inputs(
    robot: RobotChoice, footholds: Path | None, seed: int | None, columns: int | None
) -> tuple[Quadruped, Footholds]:
    """The robot, and the footholds of the first terrain."""
    if columns is None:
        return load_inputs(robot, footholds, seed)
    from gaitopt.terrain.columns import s_columns

    model = robot.load()
    return model, s_columns(seed or 0, columns=columns, robot=model)


def _write(found: Standings, folder: Path, meshes: MeshFolders) -> dict[str, str]:
    """Write the picture, and replay and plans of the first terrain; what each file is, by name."""
    from gaitopt.viewing.figures.files import save_figure
    from gaitopt.viewing.figures.race import plot_race
    from gaitopt.viewing.replay.race import race_replay

    files: dict[str, str] = {}
    with progress_bar("writing replay, picture and plans") as tick:
        times = {row: found.values(row, "time") for row in found.rows}
        save_figure(plot_race(times), folder / PICTURE)
        tick(1, 3)
        if found.plans:
            verdicts = None if found.timing == Timing.velocity.value else found.verdicts
            race_replay(found.plans, folder / PAGE, verdicts=verdicts, meshes=meshes)
            files[PAGE] = "the race: open it in a browser"
        tick(2, 3)
        files[PICTURE] = "the time of each row"
        for name, plan in found.plans.items():
            plan.save(folder / f"plan_{file_name(name, '_')}.npz")
            files[f"plan_{file_name(name, '_')}.npz"] = f"the plan of row {name}"
        tick(3, 3)
    return files
