"""The command ``gaitopt stride``: a walk over an obstacle, and the study of the paper's swing."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape

from gaitopt.cli.grouped_options import takes_options
from gaitopt.cli.options import MarginOption, Timing
from gaitopt.cli.results.deliver import FIGURES, PLAN, Delivery, deliver
from gaitopt.cli.results.options import Results, result_options
from gaitopt.cli.results.report import Report
from gaitopt.cli.results.run_folder import run_folder
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.support import file_name, progress_bar, terminal
from gaitopt.errors import InputError, MissingPackageError
from gaitopt.plan.record import StrideRecord

if TYPE_CHECKING:
    from gaitopt.plan.plan import Plan
    from gaitopt.plan.swings import Swing
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.terrain.obstacles import Obstacle
    from gaitopt.viewing.figures.panels import Panels

PAPER_ROBOT = "frog1"
"""The robot of [Shao2011]."""
PAGE = "stride.html"
"""Name of the replay's file."""
PAPER_BOARD = (0.11, 0.04)
"""Height and width of the board that the paper's robot steps over [m]: [Shao2011], Section V."""


class Shape(str, Enum):
    """Section of an obstacle."""

    rectangular = "rectangular"
    round = "round"
    triangular = "triangular"


class Pattern(str, Enum):
    """Path over an obstacle."""

    parabola = "parabola"
    trapezoid = "trapezoid"
    box = "box"


ShapeOption = Annotated[
    Shape, typer.Option(help="Section of the obstacle.", rich_help_panel="What walks where")
]
HeightOption = Annotated[
    float | None,
    typer.Option(help="Height of the obstacle, in metres; by default the paper's 0.11, in "
                 "proportion to the robot's size.",
                 rich_help_panel="What walks where", show_default=False),
]  # fmt: skip
WidthOption = Annotated[
    float | None,
    typer.Option(help="Width of its section, in metres; by default the paper's 0.04, in proportion "
                 "to the robot's size. A round one is as wide as it is high.",
                 rich_help_panel="What walks where", show_default=False),
]  # fmt: skip
PositionOption = Annotated[
    float,
    typer.Option(help="Its place along x, in metres. The robot begins in front of it.",
                 rich_help_panel="What walks where"),
]  # fmt: skip
FootOption = Annotated[
    float | None,
    typer.Option("--margin", help="Distance that feet keep from it, in metres; the paper's 0.03, "
                 "or less for small robots.", rich_help_panel="How", show_default=False),
]  # fmt: skip
ClearanceOption = Annotated[
    float | None,
    typer.Option(help="Distance that every part of the robot keeps from it, in metres; 0.01, or "
                 "less for small robots.", rich_help_panel="How", show_default=False),
]  # fmt: skip
PatternOption = Annotated[
    Pattern, typer.Option(help="Path of a foot over it.", rich_help_panel="How")
]
StrideTimingOption = Annotated[
    Timing | None,
    typer.Option(help="What bounds the speed: contact forces, joint torques and velocities; or "
                 "joint velocities alone (nothing is promised of forces). The paper's robot frog1 "
                 "has the paper's limits and velocity by default, and all others have forces.",
                 rich_help_panel="How", show_default=False),
]  # fmt: skip
StudyOption = Annotated[
    bool,
    typer.Option("--study", help="Print the study of the paper's swing instead: our splines, the "
                 "paper's, TOPP-RA's, and uniform scaling."),
]  # fmt: skip


@takes_robot(PAPER_ROBOT)
@takes_options("results", result_options)
def stride(
    robot: RobotChoice,
    results: Results,
    shape: ShapeOption = Shape.rectangular,
    height: HeightOption = None,
    width: WidthOption = None,
    position: PositionOption = 0.0,
    margin: FootOption = None,
    clearance: ClearanceOption = None,
    stability_margin: MarginOption = None,
    pattern: PatternOption = Pattern.parabola,
    timing: StrideTimingOption = None,
    study: StudyOption = False,
) -> None:
    """Walk over an obstacle, as in [Shao2011], and write plan, replay and figures."""
    from gaitopt.planners.over_obstacle.planner import plan_stride

    if study:
        print_study()
        return
    model = robot.load()
    run = f"stride-{file_name(model.name) or 'robot'}"
    folder = run_folder(results.out, run, results.overwrite, (PAGE, PLAN, FIGURES))
    scale = scale_of(model)
    chosen = timing or (Timing.velocity if model.name == PAPER_ROBOT else Timing.forces)
    with progress_bar("planning") as tick:
        plan = plan_stride(
            model, obstacle_for(shape, height, width, position, scale),
            margin=margin, clearance=clearance, stability_margin=stability_margin,
            pattern=pattern.value, timing=chosen.value, progress=tick,
            **(limits_of(model) if chosen is Timing.velocity else {}),
        )  # fmt: skip
    crossed = Delivery(plan, describe(plan), PAGE, stride_figures)
    report = Report(results.as_json, {"command": "stride"})
    raise typer.Exit(deliver(crossed, folder, results, report))


def stride_figures(plan: Plan, folder: Path) -> list[Path]:
    """Draw the figures of a walk over an obstacle, with Figs. 6 to 8 of [Shao2011]."""
    from gaitopt.viewing.figures.crawl_figures import save_figures
    from gaitopt.viewing.figures.files import write_figures
    from gaitopt.viewing.figures.joint_curves import plot_joint_curves
    from gaitopt.viewing.figures.posture import plot_posture
    from gaitopt.viewing.figures.snapshots import plot_stride_snapshots

    def joints() -> Panels:
        swing = first_stride(plan)
        return plot_joint_curves(plan, [swing.leg], span=(swing.start, swing.end))

    def splines() -> Panels:
        from gaitopt.studies.swing_figures import plot_splines
        from gaitopt.studies.swing_study import compare_splines

        return plot_splines(compare_splines(with_toppra=False))

    more = {
        "striding_fig06_joints": joints,
        "striding_fig07_cog": lambda: plot_posture(plan),
        "striding_fig08_snapshots": lambda: plot_stride_snapshots(plan),
    }
    if plan.robot.name == PAPER_ROBOT:
        more["striding_fig06_splines"] = splines
    return [*save_figures(plan, folder), *write_figures(more, folder)]


def first_stride(plan: Plan) -> Swing:
    """The first swing that goes over the obstacle.

    Raises:
        InputError: no swing does, or the plan has no obstacle.
    """
    obstacle = obstacle_of(plan)
    for swing in plan.swings:
        ends = obstacle.to_local([swing.foot_start, swing.foot_end])[:, 0]
        if ends[0] * ends[1] < 0.0:
            return swing
    raise InputError("no leg strides over the obstacle in this plan")


def obstacle_of(plan: Plan) -> Obstacle:
    """The obstacle of a plan by ``plan_stride``.

    Raises:
        InputError: the plan has none.
    """
    if not plan.settings.obstacles:
        raise InputError(f"a plan of {plan.settings.planner} has no obstacle")
    return plan.settings.obstacles[0]


def obstacle_for(
    shape: Shape, height: float | None, width: float | None, position: float, scale: float
) -> Obstacle:
    """The obstacle that the options describe.

    Args:
        shape: of its section.
        height, width: of its section [m]; ``None`` for those of the paper's board times ``scale``.
        position: along x [m].
        scale: size of the robot as a multiple of the paper's robot.

    Raises:
        InputError: a size is out of range, or a round obstacle has a width.
    """
    from gaitopt.terrain import obstacles

    usual_height, usual_width = (round(size * scale, 3) for size in PAPER_BOARD)
    high = usual_height if height is None else height
    wide = usual_width if width is None else width
    place = (position, 0.0, 0.0)
    if shape is Shape.round:
        if width is not None and width != high:
            raise InputError("a round obstacle is as wide as it is high: leave --width out")
        return obstacles.round_obstacle(high, position=place)
    if shape is Shape.triangular:
        return obstacles.triangular_obstacle(high, wide, position=place)
    return obstacles.rectangular_obstacle(high, wide, position=place)


def scale_of(robot: Quadruped) -> float:
    """Size of a robot as a multiple of the paper's robot: the ratio of their standing heights."""
    from gaitopt.robots.catalog import load_robot

    return robot.standing_height / load_robot(PAPER_ROBOT).standing_height


def limits_of(robot: Quadruped) -> dict[str, Any]:
    """Limits of acceleration and jerk as keywords of ``plan_stride``.

    They are those of [Shao2011], Table I, for the paper's robot. For other robots there are none,
    so that the planner's defaults hold.
    """
    from gaitopt.studies.swing_study import PAPER_LIMITS

    if robot.name != PAPER_ROBOT:
        return {}
    return {"acceleration_limit": PAPER_LIMITS.acceleration, "jerk_limit": PAPER_LIMITS.jerk}


def describe(plan: Plan) -> str:
    """Describe a plan over an obstacle in one sentence."""
    obstacle = obstacle_of(plan)
    text = (
        f"{plan.robot.name} takes {len(plan.swings)} steps over {plan.distance:.2f} m in "
        f"{plan.duration:.1f} s, over an obstacle {1e3 * obstacle.height:.0f} mm high and "
        f"{1e3 * obstacle.width:.0f} mm wide; margin at least {1e3 * plan.margin:.1f} mm"
    )
    record = plan.record
    if isinstance(record, StrideRecord) and record.energy_margin is not None:
        text += f", {record.energy_margin:.2f} J to tip it"
    if isinstance(record, StrideRecord) and record.clearance is not None:
        text += f"; no part of it comes nearer to the obstacle than {1e3 * record.clearance:.1f} mm"
    return text


def print_study() -> None:
    """Print the table of the paper's swing; without TOPP-RA where that is not installed."""
    from gaitopt.studies.swing_study import compare_splines

    note = ""
    with progress_bar("optimising swings"):
        try:
            comparison = compare_splines()
        except MissingPackageError as missing:
            comparison, note = compare_splines(with_toppra=False), f"\n{missing}"
    terminal().print(escape(comparison.table() + note))
