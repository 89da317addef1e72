"""The command ``gaitopt race``: the same footholds walked by several methods, side by side."""

from __future__ import annotations

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
    MarginOption,
    OutOption,
    ReachOption,
    SeedOption,
    SeedsOption,
    SequenceOption,
    SwingHeightOption,
    Timing,
    TimingOption,
)
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.support import (
    file_name,
    force_limits,
    load_inputs,
    make_folder,
    plan_options,
    print_files,
    progress_bar,
    terminal,
)
from gaitopt.errors import InputError
from gaitopt.files import written_whole

if TYPE_CHECKING:
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.studies.race_standings import Standings
    from gaitopt.terrain.footholds import Footholds

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
    out: OutOption = Path("out"),
    jobs: JobsOption = -1,
) -> None:
    """Race the paper's method against the time-optimal walks, side by side in one page.

    With --timing forces all rows but the paper's are timed by contact forces.
    """
    from gaitopt.studies.race import race as run_race
    from gaitopt.studies.race import race_many, row_names, shared_settings

    if footholds is not None and (seeds > 1 or columns is not None):
        raise InputError("--footholds excludes --seeds and --columns: a CSV is one terrain")
    names = row_names(None if rows is None else rows.split(","), timing.value)
    model, places = _inputs(robot, footholds, seed, columns)
    options = plan_options(
        stability_margin, body_height, swing_height, sequence, reach_fraction, heading,
        follow_terrain,
    )  # fmt: skip
    options["com"] = None if com is None else com.value
    options["forces"] = force_limits(friction)
    # Wrong settings are refused here, before anything is written.
    options = {"timing": timing.value} | shared_settings(model, places, options, timing.value)
    checks: dict[str, Any] = {"certify": certify, "collisions": collisions, "bound": bound}
    make_folder(out)
    with progress_bar("racing") as tick:
        if seeds == 1:
            found = run_race(model, places, names, progress=tick, **checks, **options).standings
        else:
            first = seed or 0
            found = race_many(
                model, range(first, first + seeds), names, columns=len(places), jobs=jobs,
                table=out / "race.csv", progress=tick, **checks, **options,
            )  # fmt: skip
    terminal().print(found.table())
    _write(found, out)
    if seeds > 1:
        print_files({out / "race.csv": "a line for each walk"})
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


def _write(found: Standings, out: Path) -> None:
    """Write the picture, and replay and plans of the first terrain, and print what was written."""
    from gaitopt.viewing.figures.race import plot_race
    from gaitopt.viewing.replay.race import race_replay

    files: dict[Path, str] = {}
    with progress_bar("writing replay, picture and plans") as tick:
        picture = out / "race.png"
        with written_whole(picture, binary=True) as stream:
            figure: Any = plot_race({row: found.values(row, "time") for row in found.rows})
            figure.savefig(stream, format="png", dpi=150)
        files[picture] = "the time of each row"
        tick(1, 3)
        for name, plan in found.plans.items():
            plan.save(out / f"plan_{file_name(name, '_')}.npz")
        tick(2, 3)
        if found.plans:
            verdicts = None if found.timing == Timing.velocity.value else found.verdicts
            page = race_replay(found.plans, out / "race.html", verdicts=verdicts)
            files = {page: "the race: open it in a browser", **files}
            plans = f"{len(found.plans)} plans: gaitopt verify, simulate, replay"
            files[out / "plan_*.npz"] = plans
        tick(3, 3)
    print_files(files)
