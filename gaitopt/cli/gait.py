"""The commands ``gaitopt trot`` and ``gaitopt gait``: gaits by velocity."""

from __future__ import annotations

from math import nan
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from gaitopt.cli.completion import complete_gait
from gaitopt.cli.grouped_options import takes_options
from gaitopt.cli.options import FrictionOption, Timing, TimingOption
from gaitopt.cli.results.deliver import FIGURES, PLAN, Delivery, deliver
from gaitopt.cli.results.options import Results, result_options
from gaitopt.cli.results.report import Report
from gaitopt.cli.results.run_folder import run_folder
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.support import file_name, force_limits, progress_bar
from gaitopt.errors import InputError
from gaitopt.plan.record import GaitRecord

if TYPE_CHECKING:
    from gaitopt.plan.plan import Plan

FAST = "wang2020-fast"
"""The default robot: the paper's 17 deg/s are too slow for these gaits."""
ON_LINE = 5e-4
"""A ZMP that is no farther from the line between two feet is on it, in words [m]. Chosen here: the
balance's usual tolerance is 0.35 mm for feet that are 0.7 m apart."""


class Usual(NamedTuple):
    """What a gait does where nothing else is asked for.

    Attributes:
        speed: [m/s].
        distance: at full speed [m].
        cycle: [s].
    """

    speed: float
    distance: float
    cycle: float


USUAL = {"trot": Usual(0.3, 1.5, 0.5)}
"""The trot of [Wang2024]."""
OTHERS = Usual(0.1, 1.0, 1.0)
"""All other gaits. Chosen: a walk that every robot of the catalogue with quick joints can do."""

ForwardOption = Annotated[
    float | None,
    typer.Option("--speed", help="Forward speed, in m/s; 0.3 for the trot, 0.1 for other gaits.",
                 rich_help_panel="Motion", show_default=False),
]  # fmt: skip
SidewaysOption = Annotated[
    float, typer.Option(help="Speed to the left, in m/s.", rich_help_panel="Motion")
]
YawOption = Annotated[
    float, typer.Option(help="Turning to the left, in rad/s.", rich_help_panel="Motion")
]
DistanceOption = Annotated[
    float | None,
    typer.Option(help="Distance at full speed, in metres; acceleration and slowing down come in "
                 "addition. 1.5 for the trot, 1 for other gaits.", rich_help_panel="Motion",
                 show_default=False),
]  # fmt: skip
DurationOption = Annotated[
    float | None,
    typer.Option(help="Time at full speed, in seconds, instead of --distance.",
                 rich_help_panel="Motion", show_default=False),
]  # fmt: skip
CycleOption = Annotated[
    float | None,
    typer.Option("--cycle", help="Duration of a cycle, in seconds; 0.5 for the trot, 1 for other "
                 "gaits.", rich_help_panel="Gait", show_default=False),
]  # fmt: skip
DutyOption = Annotated[
    float | None,
    typer.Option("--duty", help="Share of the cycle for which each foot stands; the gait's own by "
                 "default.", rich_help_panel="Gait", show_default=False),
]  # fmt: skip
SwingOption = Annotated[
    str,
    typer.Option(help="Swing curve: polynomial, cycloid, sine arch, half-ellipse, trapezoid, box.",
                 rich_help_panel="Gait"),
]  # fmt: skip
SwayOption = Annotated[
    bool | None,
    typer.Option("--sway/--straight", help="Move the body sideways to keep its balance, or not. "
                 "With the timing forces it has to; otherwise by default it sways where a foot "
                 "stands for more than half of the cycle.",
                 rich_help_panel="Gait", show_default=False),
]  # fmt: skip
HeightOption = Annotated[
    float | None,
    typer.Option("--body-height", help="Height of the hips, in metres; 0.7 of the leg's reach by "
                 "default.", rich_help_panel="Gait", show_default=False),
]  # fmt: skip
SwingHeightOption = Annotated[
    float | None,
    typer.Option("--swing-height", help="How far feet rise, in metres; 0.15 of the body's height "
                 "by default.", rich_help_panel="Gait", show_default=False),
]  # fmt: skip
AccelerationOption = Annotated[
    float | None,
    typer.Option(help="Limit of every joint's acceleration, in rad/s^2.",
                 rich_help_panel="Motion", show_default=False),
]  # fmt: skip


@takes_robot(FAST)
@takes_options("results", result_options)
def trot(
    robot: RobotChoice,
    results: Results,
    speed: ForwardOption = None,
    sideways: SidewaysOption = 0.0,
    yaw_rate: YawOption = 0.0,
    distance: DistanceOption = None,
    duration: DurationOption = None,
    acceleration_limit: AccelerationOption = None,
    cycle: CycleOption = None,
    duty: DutyOption = None,
    swing: SwingOption = "polynomial",
    sway: SwayOption = None,
    body_height: HeightOption = None,
    swing_height: SwingHeightOption = None,
    timing: TimingOption = Timing.forces,
    friction: FrictionOption = None,
) -> None:
    """Trot at a speed, as in [Wang2024]: the same as gaitopt gait trot."""
    _gait(
        "trot", robot, speed, sideways, yaw_rate, distance, duration, acceleration_limit, cycle,
        duty, swing, sway, body_height, swing_height, timing, friction, results,
    )  # fmt: skip


@takes_robot(FAST)
@takes_options("results", result_options)
def gait(
    name: Annotated[
        str, typer.Argument(help="walk, quasi-static, trot, pace, bound, pronk, wave; or a crawl's "
                            "order of legs, as in RH,RF,LF,LH.", autocompletion=complete_gait),
    ],
    robot: RobotChoice,
    results: Results,
    speed: ForwardOption = None,
    sideways: SidewaysOption = 0.0,
    yaw_rate: YawOption = 0.0,
    distance: DistanceOption = None,
    duration: DurationOption = None,
    acceleration_limit: AccelerationOption = None,
    cycle: CycleOption = None,
    duty: DutyOption = None,
    swing: SwingOption = "polynomial",
    sway: SwayOption = None,
    body_height: HeightOption = None,
    swing_height: SwingHeightOption = None,
    timing: TimingOption = Timing.forces,
    friction: FrictionOption = None,
) -> None:  # fmt: skip
    """Plan any gait at a commanded velocity, and write plan, replay and figures."""
    _gait(
        name, robot, speed, sideways, yaw_rate, distance, duration, acceleration_limit, cycle,
        duty, swing, sway, body_height, swing_height, timing, friction, results,
    )  # fmt: skip


def _gait(
    name: str, robot: RobotChoice, speed: float | None, sideways: float, yaw_rate: float,
    distance: float | None, duration: float | None, acceleration_limit: float | None,
    cycle: float | None,
    duty: float | None, swing: str, sway: bool | None, body_height: float | None,
    swing_height: float | None, timing: Timing, friction: float | None, results: Results,
) -> None:  # fmt: skip
    """Plan a gait, and write plan, replay and figures."""
    from gaitopt.gait.gaits import gait as named
    from gaitopt.planners.by_velocity.planner import plan_gait
    from gaitopt.viewing.figures.gait_figures import save_gait_figures

    if distance is not None and duration is not None:
        raise InputError("--distance and --duration exclude each other: give one of them")
    usual = USUAL.get(name.strip().lower(), OTHERS)
    schedule = named(name, usual.cycle if cycle is None else cycle, duty)
    forward = usual.speed if speed is None else speed
    if duration is None and not (forward or sideways):
        raise InputError("a gait on the spot has no distance: give --duration")
    if duration is None and distance is None:
        distance = usual.distance
    model = robot.load()
    page = f"{file_name(name)}.html"
    run = f"{file_name(name)}-{file_name(model.name) or 'robot'}"
    folder = run_folder(results.out, run, results.overwrite, (page, PLAN, FIGURES))
    with progress_bar("planning") as tick:
        plan = plan_gait(
            model, schedule, velocity=(forward, sideways), yaw_rate=yaw_rate,
            distance=distance, duration=duration,
            acceleration_limit=acceleration_limit, swing=swing, sway=sway,
            body_height=body_height, swing_height=swing_height, timing=timing.value,
            forces=force_limits(friction), progress=tick,
        )  # fmt: skip
    walked = Delivery(plan, describe(plan), page, save_gait_figures)
    report = Report(results.as_json, {"command": "gait"})
    raise typer.Exit(deliver(walked, folder, results, report))


def describe(plan: Plan) -> str:
    """Describe the plan of a gait in one sentence."""
    record = plan.record
    flight = record.flight or 0.0 if isinstance(record, GaitRecord) else 0.0
    margin = nan if record.zmp_margin is None else record.zmp_margin
    where = f"is at worst {1e3 * abs(margin):.1f} mm "
    where += "inside its support" if margin > 0 else "beyond its support line or polygon"
    forced = plan.settings.promised_forces is not None
    if forced and abs(margin) < ON_LINE:
        where = "keeps to its support line"
    whose = "contact forces exist, and the ZMP of the robot" if forced else (
        "the ZMP of the body's centre"
    )  # fmt: skip
    return (
        f"{plan.robot.name} takes {len(plan.swings)} steps over {plan.distance:.2f} m in "
        f"{plan.duration:.2f} s; {whose} {where}"
        + (f"; no foot stands for {flight:.0%} of the time" if flight else "")
    )
