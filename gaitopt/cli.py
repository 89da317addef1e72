"""The command line: ``gaitopt walk``, ``compare``, ``verify``, ``replay``, ``figures``, and more.

Mistakes of the user's end in one line and exit code 2, without a traceback.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from gaitopt.errors import GaitoptError, InfeasibleStepError, InputError
from gaitopt.files import written_whole

if TYPE_CHECKING:
    from gaitopt.planning.plan import Plan
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.terrain.footholds import Footholds

app = typer.Typer(
    name="gaitopt",
    help="Plan the fastest statically stable walk of a four-legged robot over given footholds.",
    epilog="Start with: gaitopt walk",
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


class Objective(str, Enum):
    """Where the COG goes before each swing."""

    distance = "distance"
    margin = "margin"


RobotOption = Annotated[
    str,
    typer.Option(help="A robot's name (see [bold]gaitopt robot --list[/]) or a URDF file.",
                 rich_help_panel="What walks where"),
]  # fmt: skip
FootholdsOption = Annotated[
    Path | None,
    typer.Option(help="CSV file with the columns leg,step,x,y,z, in metres.", metavar="CSV",
                 rich_help_panel="What walks where"),
]  # fmt: skip
SeedOption = Annotated[
    int | None,
    typer.Option(help="Seed of the random S-shaped columns, when no CSV is given.", min=0,
                 rich_help_panel="What walks where"),
]  # fmt: skip
ObjectiveOption = Annotated[
    Objective,
    typer.Option(help="Move the COG as little as possible, or to the largest stability margin.",
                 rich_help_panel="How"),
]  # fmt: skip
SpeedOption = Annotated[
    str,
    typer.Option(help="'max', or a speed of body and feet in m/s (within the joint limits).",
                 rich_help_panel="How"),
]  # fmt: skip
MarginOption = Annotated[
    float, typer.Option(help="Stability margin S0, in metres.", rich_help_panel="How")
]
HeightOption = Annotated[
    float | None,
    typer.Option(help="Height of the hips above the footholds, in metres; 0.40 for wang2020, "
                 "else 0.7 of the leg's reach.", rich_help_panel="How", show_default=False),
]  # fmt: skip
SwingHeightOption = Annotated[
    float | None,
    typer.Option(help="How far feet rise above the higher end of a swing, in metres; 0.07 for "
                 "wang2020, else to scale.", rich_help_panel="How", show_default=False),
]  # fmt: skip
SequenceOption = Annotated[
    str, typer.Option(help="Order of the legs in a cycle.", rich_help_panel="How")
]
ReachOption = Annotated[
    float, typer.Option(help="Share of the legs' reach to use, up to 1.", rich_help_panel="How")
]
HeadingOption = Annotated[
    float, typer.Option(help="Direction the body faces, in radians from x.", rich_help_panel="How")
]
FollowOption = Annotated[
    bool,
    typer.Option("--follow-terrain", help="Keep the body's height above the feet, not constant.",
                 rich_help_panel="How"),
]  # fmt: skip
OutOption = Annotated[Path, typer.Option(help="Folder for the results.", metavar="DIR")]
PlanArgument = Annotated[Path, typer.Argument(help="A plan file (.npz).", metavar="PLAN")]


@app.command()
def walk(
    robot: RobotOption = "wang2020",
    footholds: FootholdsOption = None,
    seed: SeedOption = None,
    objective: ObjectiveOption = Objective.distance,
    speed: SpeedOption = "max",
    stability_margin: MarginOption = 0.02,
    body_height: HeightOption = None,
    swing_height: SwingHeightOption = None,
    sequence: SequenceOption = "RH,RF,LH,LF",
    reach_fraction: ReachOption = 1.0,
    heading: HeadingOption = 0.0,
    follow_terrain: FollowOption = False,
    out: OutOption = Path("out"),
) -> None:
    """Plan a walk, compare it with the paper's baselines, and write plan, replay and figures."""
    from gaitopt.checking.balance import com_margin
    from gaitopt.planning.crawl import plan_crawl
    from gaitopt.studies.compare import compare as run_comparison
    from gaitopt.viewing.plots import save_figures
    from gaitopt.viewing.replay import replay as write_replay

    model, places = _inputs(robot, footholds, seed)
    settings = _settings(
        model, places, stability_margin, body_height, swing_height, sequence, reach_fraction,
        heading, follow_terrain,
    )  # fmt: skip
    with _progress("planning") as tick:
        plan = plan_crawl(model, places, objective.value, _speed(speed), progress=tick, **settings)
    with _progress("comparing with the baselines") as tick:
        comparison = run_comparison(model, places, progress=tick, **settings)
    _make_folder(out)
    with _progress("writing plan, replay and figures") as tick:
        plan.save(out / "plan.npz")
        tick(1, 3)
        write_replay(plan, out / "walk.html")
        tick(2, 3)
        figures = save_figures(
            plan, out / "figures", comparison=_drawn(plan, comparison.plans),
            com_margin=com_margin(plan),
        )  # fmt: skip
        tick(3, 3)
    console = _console()
    console.print(comparison.table())
    console.print(escape(_summary(plan)))
    console.print(f"[bold]{escape(str(out / 'walk.html'))}[/]  the replay: open it in a browser")
    console.print(
        f"[bold]{escape(str(out / 'plan.npz'))}[/]   the plan: gaitopt.load_plan, gaitopt export"
    )
    console.print(f"[bold]{escape(str(out / 'figures'))}[/]    {len(figures)} figures")


@app.command()
def compare(
    robot: RobotOption = "wang2020",
    footholds: FootholdsOption = None,
    seed: SeedOption = None,
    seeds: Annotated[
        int, typer.Option(help="Compare on this many random terrains, from --seed on.", min=1,
                          max=10_000, rich_help_panel="What walks where"),
    ] = 1,
    stability_margin: MarginOption = 0.02,
    body_height: HeightOption = None,
    swing_height: SwingHeightOption = None,
    sequence: SequenceOption = "RH,RF,LH,LF",
    reach_fraction: ReachOption = 1.0,
    heading: HeadingOption = 0.0,
    follow_terrain: FollowOption = False,
) -> None:  # fmt: skip
    """Print Table II: the paper's method, the largest margin, and fixed speeds."""
    from gaitopt.studies.compare import compare as run_comparison

    if footholds is not None and seeds > 1:
        raise InputError("--footholds and --seeds exclude each other: a CSV is one terrain")
    model, first = _inputs(robot, footholds, seed)
    settings = _settings(
        model, first, stability_margin, body_height, swing_height, sequence, reach_fraction,
        heading, follow_terrain,
    )  # fmt: skip
    terrains: Any = first
    if footholds is None:
        first_seed = seed or 0
        terrains = [(s, _inputs_terrain(model, s)) for s in range(first_seed, first_seed + seeds)]
    with _progress(f"planning on {seeds} terrain{'s' if seeds > 1 else ''}") as tick:
        comparison = run_comparison(model, terrains, progress=tick, **settings)
    _console().print(comparison.table())


@app.command()
def replay(
    plan: PlanArgument,
    out: Annotated[
        Path | None,
        typer.Argument(help="The HTML file; PLAN with .html by default.", metavar="HTML"),
    ] = None,
    show: Annotated[
        bool, typer.Option("--open", help="Also serve it on this machine and open a browser.")
    ] = False,
) -> None:
    """Write a plan's replay as one HTML file that plays in any browser."""
    from gaitopt.viewing.live import view
    from gaitopt.viewing.replay import replay as write_replay

    loaded = _load(plan)
    target = out or plan.with_suffix(".html")
    write_replay(loaded, target)
    _console().print(f"[bold]{escape(str(target))}[/]")
    if show:
        with view(loaded) as url:
            _console().print(f"serving {url} on this machine only; press Enter to stop")
            sys.stdin.readline()


@app.command()
def verify(
    plan: PlanArgument,
    collisions: Annotated[
        bool, typer.Option(help="Look for self-collisions, which takes most of the time.")
    ] = True,
) -> None:
    """Certify a plan for every instant; exit code 0 when it is, 1 when it is not."""
    from gaitopt.checking.certificate import verify as certify

    certificate = certify(_load(plan), collisions=collisions)
    _console().print(certificate.table())
    if not certificate.ok:
        raise typer.Exit(1)


@app.command()
def simulate(
    plan: PlanArgument,
    out: Annotated[
        Path | None,
        typer.Option(help="Also write a replay of plan and physics side by side.", metavar="HTML"),
    ] = None,
) -> None:
    """Walk a plan in physics (MuJoCo); exit code 0 when all footholds are made, 1 when not."""
    from gaitopt.checking.simulation import simulate as run_simulation
    from gaitopt.viewing.replay import replay as write_replay

    loaded = _load(plan)
    with _progress("simulating") as tick:
        tick(0, 1)
        result = run_simulation(loaded)
        tick(1, 1)
    _console().print(escape(str(result)))
    if out is not None:
        write_replay(loaded, out, simulated=result.motion)
        _console().print(f"[bold]{escape(str(out))}[/]")
    if not result.succeeded:
        raise typer.Exit(1)


@app.command()
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
        bool, typer.Option("--simulate", help="Also walk every plan in physics.")
    ] = False,
    collisions: Annotated[
        bool, typer.Option("--collisions", help="Also look for self-collisions.")
    ] = False,
    jobs: Annotated[int, typer.Option(help="Processes; -1 for one a core.")] = -1,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Work on the Dask cluster at this address.", metavar="ADDRESS"),
    ] = None,
) -> None:
    """Plan, certify and simulate many terrains on all cores; a stopped study goes on."""
    from gaitopt.studies.study import grid, run_study
    from gaitopt.studies.study_report import plot_study, study_table

    walks = grid(
        range(seed or 0, (seed or 0) + seeds),
        robots=(robot,),
        objectives=[o.value for o in objective or [Objective.distance]],
        stability_margins=stability_margin or [0.02],
        speed=_speed(speed),
        collisions=collisions,
        simulate=with_physics,
    )
    with _progress(f"{len(walks)} walks") as tick:
        rows = run_study(walks, table, jobs=jobs, scheduler=scheduler, progress=tick)
    _console().print(study_table(rows))
    picture = table.with_suffix(".png")
    with written_whole(picture, binary=True) as stream:
        plot_study(rows).savefig(stream, format="png", dpi=150)
    _console().print(
        f"[bold]{escape(str(table))}[/]  a row a walk\n[bold]{picture}[/]  what became of them"
    )


@app.command()
def figures(
    plan: PlanArgument,
    out: Annotated[Path, typer.Argument(help="Folder for the figures.")] = Path("figures"),
    step: Annotated[
        int | None,
        typer.Option(help="Step whose feasible area and swing to draw; a telling one by default."),
    ] = None,
) -> None:
    """Write a plan's figures as PNG files."""
    from gaitopt.viewing.plots import save_figures

    loaded = _load(plan)
    _make_folder(out)
    for path in save_figures(loaded, out, step=step):
        _console().print(escape(str(path)))


@app.command()
def export(
    plan: PlanArgument,
    csv: Annotated[
        Path | None, typer.Option(help="Write the motion as a table.", metavar="FILE")
    ] = None,
    ros: Annotated[
        Path | None,
        typer.Option(help="Write the joints' motion as a JointTrajectory in YAML.", metavar="FILE"),
    ] = None,
    dt: Annotated[
        float | None,
        typer.Option(help="Time between samples, in seconds; the plan's own knots by default."),
    ] = None,
) -> None:
    """Write a plan's motion for other programs."""
    from gaitopt.exporting.ros import export_ros
    from gaitopt.exporting.tables import export_csv

    if csv is None and ros is None:
        raise InputError("nothing to write: give --csv FILE, --ros FILE, or both")
    if csv == ros:
        raise InputError(f"--csv and --ros both name {csv}; give two files")
    loaded = _load(plan)
    for path, write in ((csv, export_csv), (ros, export_ros)):
        if path is not None:
            write(loaded, path, dt)
            _console().print(f"[bold]{escape(str(path))}[/]")


@app.command()
def robot(
    name: Annotated[str, typer.Argument(help="A robot's name or a URDF file.")] = "wang2020",
    list_names: Annotated[bool, typer.Option("--list", help="List the names known.")] = False,
) -> None:
    """Show what gaitopt reads off a robot: legs, lengths, reach and limits."""
    from gaitopt.robots.catalog import load_robot, robot_names
    from gaitopt.studies.report import robot_table

    if list_names:
        _console().print("\n".join(robot_names()))
    else:
        _console().print(robot_table(load_robot(name)))


def main() -> None:
    """Entry point: run a command; the user's mistakes end in one line and exit code 2."""
    try:
        code = app(standalone_mode=False)
    except (KeyboardInterrupt, typer.Abort):
        print("gaitopt: stopped", file=sys.stderr)
        sys.exit(130)
    except Exception as error:
        # Typer carries a click of its own, whose errors are known by this method.
        words = getattr(error, "format_message", None)
        if words is None and not isinstance(error, GaitoptError):
            raise
        text = str(error) if words is None else words()
        print(f"gaitopt: {' '.join(text.split())}", file=sys.stderr)
        sys.exit(2)
    sys.exit(code if isinstance(code, int) else 0)


def _show_version(wanted: bool) -> None:
    if wanted:
        from gaitopt import __version__

        print(f"gaitopt {__version__}")
        raise typer.Exit()


@app.callback(invoke_without_command=True)
def options(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", help="Show the version.", callback=_show_version, is_eager=True),
    ] = False,
) -> None:
    """Plan the fastest statically stable walk of a four-legged robot over given footholds."""
    if context.invoked_subcommand is None:
        print(context.get_help())


def _inputs(robot: str, footholds: Path | None, seed: int | None) -> tuple[Quadruped, Footholds]:
    from gaitopt.robots.catalog import load_robot
    from gaitopt.terrain.footholds import Footholds

    if footholds is not None and seed is not None:
        raise InputError("--footholds and --seed exclude each other: give one of them")
    model = load_robot(robot)
    if footholds is not None:
        return model, Footholds.from_csv(footholds)
    return model, _inputs_terrain(model, seed or 0)


def _inputs_terrain(model: Quadruped, seed: int) -> Footholds:
    from gaitopt.studies.terrains import s_columns_for

    return s_columns_for(model, seed)


def _settings(
    model: Quadruped,
    places: Footholds,
    stability_margin: float,
    body_height: float | None,
    swing_height: float | None,
    sequence: str,
    reach_fraction: float,
    heading: float,
    follow_terrain: bool,
) -> dict[str, Any]:
    settings = {
        "stability_margin": stability_margin,
        # The paper's 7 cm, to the scale of the robot.
        "swing_height": round(0.175 * model.standing_height, 4)
        if swing_height is None
        else swing_height,
        "sequence": tuple(part.strip() for part in sequence.split(",")),
        "reach_fraction": reach_fraction,
        "heading": heading,
        "follow_terrain": follow_terrain,
    }
    if body_height is None:
        body_height = _fitting_height(model, places, settings)
    return {**settings, "body_height": body_height}


def _fitting_height(model: Quadruped, places: Footholds, settings: dict[str, Any]) -> float:
    """The robot's standing height, or a higher one where its joints' limits need it."""
    from gaitopt.planning.crawl import plan_crawl

    usual = model.standing_height
    for height in (usual, *(round(usual * k / 14, 2) for k in (15, 16, 17))):
        try:
            plan_crawl(model, places, body_height=height, **settings)
        except InfeasibleStepError:
            continue
        return height
    return usual


def _speed(text: str) -> Any:
    if text == "max":
        return "max"
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--speed must be 'max' or a number of m/s, got {text!r}") from None


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder {folder}: {error.strerror or error}") from error


def _load(path: Path) -> Plan:
    from gaitopt.planning.storage import load_plan

    return load_plan(path)


def _drawn(plan: Plan, plans: Mapping[str, Plan]) -> dict[str, Plan]:
    """The plans of a comparison that fit into one picture with ``plan``, which is one of them.

    At the 5 mm/s of the paper's third row a walk takes an hour, and would squash all others.
    """
    return {
        name: plan if other.settings == plan.settings else other
        for name, other in plans.items()
        if other.duration <= 4.0 * plan.duration
    }


def _summary(plan: Plan) -> str:
    return (
        f"{plan.robot.name} takes {len(plan.phases) // 2} steps over {plan.distance:.2f} m in "
        f"{plan.duration:.1f} s ({1e3 * plan.mean_speed:.2f} mm/s), margin at least "
        f"{1e3 * plan.margin:.1f} mm"
    )


def _console() -> Any:
    from rich.console import Console

    console = Console(highlight=False)
    # A table needs its columns: where nobody watches, take the width that it needs.
    return console if console.is_terminal else Console(highlight=False, width=150)


@contextmanager
def _progress(what: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar that calls can advance with (done, in all)."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
               TimeElapsedColumn())  # fmt: skip
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


if __name__ == "__main__":
    main()
