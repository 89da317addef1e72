"""The commands ``gaitopt walk`` and ``compare``: walks over given footholds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rich.markup import escape

from gaitopt.cli.options import (
    AccelerationOption,
    ComOption,
    FollowOption,
    FootholdsOption,
    FreeOption,
    FrictionOption,
    HeadingOption,
    HeightOption,
    HorizonOption,
    MarginOption,
    Objective,
    ObjectiveOption,
    OutOption,
    ReachOption,
    SeedOption,
    SeedsOption,
    SequenceOption,
    SpeedOption,
    SwingHeightOption,
    Timing,
    TimingOption,
)
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.support import (
    drawable,
    force_limits,
    load_inputs,
    make_folder,
    parse_speed,
    plan_options,
    print_files,
    progress_bar,
    random_terrain,
    summarise,
    terminal,
)
from gaitopt.errors import InputError


@takes_robot("wang2020")
def walk(
    robot: RobotChoice,
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
    com: ComOption = None,
    acceleration_limit: AccelerationOption = None,
    horizon: HorizonOption = None,
    timing: TimingOption = Timing.forces,
    friction: FrictionOption = None,
    out: OutOption = Path("out"),
) -> None:
    """Plan a walk, compare it with the paper's baselines, and write plan, replay and figures."""
    from gaitopt.plan.com_margin import com_margin
    from gaitopt.planners.crawl import plan_crawl
    from gaitopt.planners.phase_by_phase.planner import plan_touches
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
            com=None if com is None else com.value, acceleration_limit=acceleration_limit,
            horizon=horizon, timing=timing.value, forces=force_limits(friction), progress=tick,
            **options,
        )  # fmt: skip
    # The baselines walk at the same body height and in the same order of legs.
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
    if plan_touches(plan):
        console.print("its legs touch each other or the trunk: gaitopt verify tells where and when")
    paper = comparison.plans.get("proposed")
    if objective is Objective.time and paper is not None and plan.duration:
        console.print(f"{paper.duration / plan.duration:.2f} times as fast as the paper's method")
    print_files({
        out / "walk.html": "the replay: open it in a browser",
        out / "plan.npz": "the plan: gaitopt verify, simulate, export",
        out / "figures": f"{len(figures)} figures",
    })  # fmt: skip


@takes_robot("wang2020")
def compare(
    robot: RobotChoice,
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
    timing: TimingOption = Timing.velocity,
) -> None:
    """Print Table II of the paper: its method beside the largest margin and fixed speeds."""
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
        comparison = run_comparison(model, terrains, timing=timing.value, progress=tick, **options)
    terminal().print(comparison.table())
