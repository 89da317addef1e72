"""The commands ``gaitopt walk`` and ``compare``: walks over given footholds."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from gaitopt.cli.grouped_options import takes_options
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
    JsonOption,
    MarginOption,
    Objective,
    ObjectiveOption,
    ReachOption,
    SeedOption,
    SeedsOption,
    SequenceOption,
    SpeedOption,
    SwingHeightOption,
    Timing,
    TimingOption,
    TransferOption,
)
from gaitopt.cli.results.beside import beside, prepare_figures
from gaitopt.cli.results.deliver import FIGURES, PLAN, Delivery, More, deliver, read_beside
from gaitopt.cli.results.options import Results, result_options
from gaitopt.cli.results.report import Report
from gaitopt.cli.results.run_folder import run_folder
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.support import (
    drawable,
    force_limits,
    load_inputs,
    parse_speed,
    plan_options,
    progress_bar,
    random_terrain,
    run_name,
    summarise,
)
from gaitopt.errors import InputError

if TYPE_CHECKING:
    from gaitopt.plan.plan import Plan
    from gaitopt.studies.compare import Comparison
    from gaitopt.terrain.footholds import Footholds


@takes_robot("wang2020")
@takes_options("results", result_options)
def walk(
    robot: RobotChoice,
    results: Results,
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
    transfer_time: TransferOption = None,
) -> None:
    """Plan a walk, compare it with the paper's baselines, and write plan, replay and figures.

    Exit code 1 where the certificate finds a promise violated, or physics fails (--simulate).
    """
    with beside(wanted=True) as helper:
        if helper is not None and not results.fast:
            helper.begin(prepare_figures)
        model, places = load_inputs(robot, footholds, seed)
        shapes = None if helper is None or results.meshes else read_beside(helper, model)
        name = run_name("walk", model, footholds, seed)
        folder = run_folder(results.out, name, results.overwrite, ("walk.html", PLAN, FIGURES))
        report = Report(results.as_json, {"command": "walk"})
        options = plan_options(
            stability_margin, body_height, swing_height, sequence, reach_fraction, heading,
            follow_terrain,
        )  # fmt: skip
        from gaitopt.planners.crawl import plan_crawl

        with progress_bar("planning") as tick:
            plan = plan_crawl(
                model, places, objective=objective.value, speed=parse_speed(speed), free=free,
                com=None if com is None else com.value, acceleration_limit=acceleration_limit,
                horizon=horizon, timing=timing.value, progress=tick,
                forces=force_limits(friction, transfer_time, objective.value), **options,
            )  # fmt: skip

        def more() -> More:
            comparison = None if results.fast else _baselines(plan, places, options)
            others = {} if comparison is None else drawable(plan, comparison.plans)
            return More(_told(plan, comparison, objective, report), partial(_compared, others))

        walked = Delivery(
            plan, summarise(plan), "walk.html", _figures, more=more, shapes=shapes
        )  # fmt: skip
        raise typer.Exit(deliver(walked, folder, results, report, helper))


def _baselines(plan: Plan, places: Footholds, options: dict[str, Any]) -> Comparison:
    """The baselines of the paper: they walk at the plan's body height, in its order of legs."""
    from gaitopt.studies.compare import compare as run_comparison

    found = plan.settings.to_dict()
    options = options | {name: found[name] for name in ("body_height", "sequence")}
    with progress_bar("comparing with the baselines") as tick:
        return run_comparison(plan.robot, places, progress=tick, **options)


def _told(
    plan: Plan, comparison: Comparison | None, objective: Objective, report: Report
) -> tuple[str, ...]:
    """Report the comparison; the value is what else there is to say of the plan."""
    from gaitopt.planners.phase_by_phase.fitting_height import plan_touches

    told = []
    if plan_touches(plan):
        told.append("its legs touch each other or the trunk")
    if comparison is not None:
        report.table(comparison.table())
        report.add(baselines=comparison.outcomes)
        paper = comparison.plans.get("proposed")
        if objective is Objective.time and paper is not None and plan.duration:
            times = paper.duration / plan.duration
            told.append(f"{times:.2f} times as fast as the paper's method")
    return tuple(told)


def _figures(plan: Plan, folder: Path) -> list[Path]:
    """Draw the figures of a walk that show no other plan."""
    from gaitopt.plan.com_margin import com_margin
    from gaitopt.viewing.figures.crawl_figures import save_figures_alone

    return save_figures_alone(plan, folder, com_margin(plan))


def _compared(others: Mapping[str, Plan], plan: Plan, folder: Path) -> list[Path]:
    """Draw the figure that shows a walk beside other plans."""
    from gaitopt.viewing.figures.crawl_figures import save_compared

    return save_compared(plan, folder, others)


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
    as_json: JsonOption = False,
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
    report = Report(as_json, {"command": "compare"})
    report.table(comparison.table())
    report.add(outcomes=comparison.outcomes, infeasible=comparison.infeasible)
    report.end()
