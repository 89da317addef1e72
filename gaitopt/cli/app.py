"""The command line: ``gaitopt walk``, ``compare``, ``verify``, ``replay``, ``figures``, and more.

Mistakes of the user's end in one line and exit code 2, without a traceback.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.markup import escape

from gaitopt.cli.gait import gait, trot
from gaitopt.cli.options import (
    AccelerationOption,
    CollisionsOption,
    Com,
    ComOption,
    FollowOption,
    FootholdsOption,
    FreeOption,
    HeadingOption,
    HeightOption,
    HorizonOption,
    JobsOption,
    MarginOption,
    Objective,
    ObjectiveOption,
    OutOption,
    PlanArgument,
    ReachOption,
    RobotOption,
    SeedOption,
    SeedsOption,
    SequenceOption,
    SpeedOption,
    SwingHeightOption,
)
from gaitopt.cli.race import race
from gaitopt.cli.stride import stride
from gaitopt.cli.support import (
    drawable,
    load_inputs,
    make_folder,
    open_plan,
    parse_speed,
    plan_options,
    progress_bar,
    random_terrain,
    summarise,
    terminal,
)
from gaitopt.errors import GaitoptError, InputError
from gaitopt.files import written_whole

app = typer.Typer(
    name="gaitopt",
    help="Plan the fastest statically stable walk of a four-legged robot over given footholds.",
    epilog="Start with: gaitopt walk",
    add_completion=False,
    rich_markup_mode="rich",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.command()
def walk(
    robot: RobotOption = "wang2020",
    footholds: FootholdsOption = None,
    seed: SeedOption = None,
    objective: ObjectiveOption = Objective.distance,
    speed: SpeedOption = "max",
    stability_margin: MarginOption = None,
    body_height: HeightOption = None,
    swing_height: SwingHeightOption = None,
    sequence: SequenceOption = "RH,RF,LH,LF",
    reach_fraction: ReachOption = 1.0,
    heading: HeadingOption = 0.0,
    follow_terrain: FollowOption = False,
    free: FreeOption = None,
    com: ComOption = Com.body,
    acceleration_limit: AccelerationOption = None,
    horizon: HorizonOption = None,
    out: OutOption = Path("out"),
) -> None:
    """Plan a walk, compare it with the paper's baselines, and write plan, replay and figures."""
    from gaitopt.plan.com_margin import com_margin
    from gaitopt.planners.crawl import plan_crawl
    from gaitopt.studies.compare import compare as run_comparison
    from gaitopt.viewing.figures.crawl_figures import save_figures
    from gaitopt.viewing.replay.replay import replay as write_replay

    model, places = load_inputs(robot, footholds, seed)
    options = plan_options(
        stability_margin, body_height, swing_height, sequence, reach_fraction, heading,
        follow_terrain,
    )  # fmt: skip
    with progress_bar("planning") as tick:
        plan = plan_crawl(
            model, places, objective=objective.value, speed=parse_speed(speed), free=free,
            com=com.value, acceleration_limit=acceleration_limit, horizon=horizon, progress=tick,
            **options,
        )  # fmt: skip
    # The baselines walk at the same height and in the same order of legs.
    found = plan.settings.to_dict()
    options |= {name: found[name] for name in ("body_height", "sequence")}
    with progress_bar("comparing with the baselines") as tick:
        comparison = run_comparison(model, places, progress=tick, **options)
    make_folder(out)
    with progress_bar("writing plan, replay and figures") as tick:
        plan.save(out / "plan.npz")
        tick(1, 3)
        write_replay(plan, out / "walk.html")
        tick(2, 3)
        figures = save_figures(
            plan, out / "figures", comparison=drawable(plan, comparison.plans),
            com_margin=com_margin(plan),
        )  # fmt: skip
        tick(3, 3)
    console = terminal()
    console.print(comparison.table())
    console.print(escape(summarise(plan)))
    paper = comparison.plans.get("proposed")
    if objective is Objective.time and paper is not None and plan.duration:
        console.print(f"{paper.duration / plan.duration:.2f} times as fast as the paper's method")
    console.print(f"[bold]{escape(str(out / 'walk.html'))}[/]  the replay: open it in a browser")
    console.print(
        f"[bold]{escape(str(out / 'plan.npz'))}[/]   the plan: gaitopt.load_plan, gaitopt export"
    )
    console.print(f"[bold]{escape(str(out / 'figures'))}[/]    {len(figures)} figures")


app.command()(trot)
app.command()(gait)
app.command()(race)
app.command()(stride)


@app.command()
def compare(
    robot: RobotOption = "wang2020",
    footholds: FootholdsOption = None,
    seed: SeedOption = None,
    seeds: SeedsOption = 1,
    stability_margin: MarginOption = None,
    body_height: HeightOption = None,
    swing_height: SwingHeightOption = None,
    sequence: SequenceOption = "RH,RF,LH,LF",
    reach_fraction: ReachOption = 1.0,
    heading: HeadingOption = 0.0,
    follow_terrain: FollowOption = False,
) -> None:
    """Print Table II: the paper's method, the largest margin, and fixed speeds."""
    from gaitopt.studies.compare import compare as run_comparison

    if footholds is not None and seeds > 1:
        raise InputError("--footholds and --seeds exclude each other: a CSV is one terrain")
    model, first = load_inputs(robot, footholds, seed)
    options = plan_options(
        stability_margin, body_height, swing_height, sequence, reach_fraction, heading,
        follow_terrain,
    )  # fmt: skip
    terrains: Any = first
    if footholds is None:
        first_seed = seed or 0
        terrains = [(s, random_terrain(model, s)) for s in range(first_seed, first_seed + seeds)]
    with progress_bar(f"planning on {seeds} terrain{'s' if seeds > 1 else ''}") as tick:
        comparison = run_comparison(model, terrains, progress=tick, **options)
    terminal().print(comparison.table())


@app.command()
def replay(
    plan: PlanArgument,
    out: Annotated[
        Path | None,
        typer.Argument(help="The HTML file; PLAN with .html by default.", metavar="HTML"),
    ] = None,
    show: Annotated[
        bool, typer.Option("--open", help="Also open it in the browser.")
    ] = False,
) -> None:
    """Write a plan's replay as one HTML file that plays in any browser."""
    from gaitopt.viewing.replay.browser import open_in_browser
    from gaitopt.viewing.replay.replay import replay as write_replay

    loaded = open_plan(plan)
    target = out or plan.with_suffix(".html")
    write_replay(loaded, target)
    terminal().print(f"[bold]{escape(str(target))}[/]")
    if show and not open_in_browser(target):
        terminal().print("no browser could be started: open the file by hand")


@app.command()
def verify(
    plan: PlanArgument,
    collisions: CollisionsOption = True,
) -> None:
    """Certify a plan for every instant; exit code 0 when it is, 1 when it is not."""
    from gaitopt.certificate.verify import verify as certify

    certificate = certify(open_plan(plan), collisions=collisions)
    terminal().print(certificate.table())
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
    """Walk a plan in physics (MuJoCo).

    Exit code 0 when every foot gets to its foothold with joint velocities within the limits (and
    the servos' tolerance), 1 when not.
    """
    from gaitopt.simulation.simulate import simulate as run_simulation
    from gaitopt.viewing.replay.replay import replay as write_replay

    loaded = open_plan(plan)
    with progress_bar("simulating") as tick:
        tick(0, 1)
        result = run_simulation(loaded)
        tick(1, 1)
    terminal().print(escape(str(result)))
    if out is not None:
        write_replay(loaded, out, simulated=result.motion)
        terminal().print(f"[bold]{escape(str(out))}[/]")
    if not result.passed:
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
    free: FreeOption = None,
    jobs: JobsOption = -1,
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
    terminal().print(
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
    from gaitopt.viewing.figures.crawl_figures import save_figures

    loaded = open_plan(plan)
    make_folder(out)
    for path in save_figures(loaded, out, step=step):
        terminal().print(escape(str(path)))


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
    loaded = open_plan(plan)
    for path, write in ((csv, export_csv), (ros, export_ros)):
        if path is not None:
            write(loaded, path, dt)
            terminal().print(f"[bold]{escape(str(path))}[/]")


@app.command()
def robot(
    name: Annotated[str, typer.Argument(help="A robot's name or a URDF file.")] = "wang2020",
    list_names: Annotated[bool, typer.Option("--list", help="List the names known.")] = False,
) -> None:
    """Show what gaitopt reads off a robot: legs, lengths, reach and limits."""
    from gaitopt.cli.robot_table import robot_table
    from gaitopt.robots.catalog import load_robot, robot_names

    if list_names:
        terminal().print("\n".join(robot_names()))
    else:
        terminal().print(robot_table(load_robot(name)))


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


if __name__ == "__main__":
    main()
