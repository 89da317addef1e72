"""Commands that take a plan file: ``replay``, ``verify``, ``simulate``, ``figures``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from gaitopt.cli.options import (
    FRICTIONS,
    CollisionsOption,
    ForcesOption,
    JsonOption,
    PlanArgument,
)
from gaitopt.cli.results.documents import certificate_document, simulation_document
from gaitopt.cli.results.options import MeshesOption, MeshFolderOption, ReplaceOption
from gaitopt.cli.results.report import Report
from gaitopt.cli.results.run_folder import record_run, refuse_existing, refuse_pictures, run_folder
from gaitopt.cli.robot_options import RobotChoice, takes_robot
from gaitopt.cli.support import open_plan, progress_bar
from gaitopt.errors import InputError

if TYPE_CHECKING:
    from gaitopt.dynamics.contacts import ForceLimits
    from gaitopt.plan.plan import Plan
    from gaitopt.viewing.replay.mesh_files import MeshFolders


NamedOption = Annotated[
    Path | None, typer.Option("--out", help="The same as the second argument.", metavar="PATH")
]


def replay(
    plan: PlanArgument,
    out: Annotated[
        Path | None,
        typer.Argument(help="The HTML file; PLAN with .html by default.", metavar="HTML"),
    ] = None,
    show: Annotated[bool, typer.Option("--open", help="Also open it in the browser.")] = False,
    meshes: MeshesOption = False,
    mesh_folder: MeshFolderOption = None,
    video: Annotated[
        Path | None,
        typer.Option(help="Write a video instead, drawn by a browser without a window: .gif or "
                     ".webp, and .mp4 or .webm with ffmpeg.", metavar="FILE"),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(help="Length of the video; the motion's by default, at most 20 s."),
    ] = None,
    look: Annotated[
        str,
        typer.Option(help="What the video shows, as in the address of a replay: follow, curves, "
                     "view=side, view=front, view=back, view=top; joined by &.", metavar="WORDS"),
    ] = "follow",
    named: NamedOption = None,
    overwrite: ReplaceOption = False,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Write a plan's replay as one HTML file that plays in any browser, or as a video."""
    from gaitopt.viewing.replay.browser import open_in_browser
    from gaitopt.viewing.replay.replay import replay as write_replay

    if video is None and (seconds is not None or look != "follow"):
        raise InputError("--seconds and --look are of a video: give --video FILE as well")
    out = _one_name(out, named, "HTML")
    target = out or plan.with_suffix(".html") if video is None or out is not None or show else None
    refuse_existing(target, video, overwrite=overwrite)
    loaded = open_plan(plan)
    drawn = meshes if mesh_folder is None else mesh_folder
    report = Report(as_json, {"command": "replay"})
    if video is not None:
        _write_video(loaded, video, seconds, look, drawn)
        report.files({video: ""})
    if target is not None:
        write_replay(loaded, target, meshes=drawn)
        report.files({target: ""})
        if show and not open_in_browser(target):
            report.say("no browser could be started: open the file by hand")
    report.end()


def _one_name(place: Path | None, named: Path | None, word: str) -> Path | None:
    """What is to be written, as the second argument or as ``--out`` says."""
    if place is not None and named is not None:
        raise InputError(f"{word} and --out exclude each other: give one of them")
    return named if place is None else place


def _write_video(
    plan: Plan,
    video: Path,
    seconds: float | None,
    look: str,
    meshes: MeshFolders,
) -> None:
    """Write a video."""
    from gaitopt.viewing.replay.video.video import replay_video

    with progress_bar("drawing frames") as tick:
        replay_video(plan, video, seconds=seconds, view=look, progress=tick, meshes=meshes)


RunOnOption = Annotated[
    str | None,
    typer.Option(
        help="The robot that it is to run on, by name or file: the plan's own may not be stronger.",
        metavar="ROBOT",
    ),
]


@takes_robot(None, RunOnOption)
def verify(
    plan: PlanArgument,
    robot: RobotChoice | None,
    collisions: CollisionsOption = True,
    forces: ForcesOption = True,
    friction: Annotated[
        float | None,
        typer.Option(
            help="Look for contact forces with this friction, and not with that of the plan.",
            min=FRICTIONS[0],
            max=FRICTIONS[1],
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Judge a plan at every instant.

    Contact forces are looked for within the limits that the plan promises, or, where it promises
    none, within the usual ones (friction 0.6, 2 % of the weight on a foot, 90 % of the torque).

    Exit code 0 when it is certified, forces included; 3 when only its kinematics hold, or a check
    could not be made, or settings are too weak; 1 when something that it promises is violated; 2
    when the robot in the plan is not the one of its name, or of --robot, or has wider limits.
    """
    from gaitopt.certificate.certificate import Outcome
    from gaitopt.certificate.claims.known_robot import refuse_stronger
    from gaitopt.certificate.verify import verify as certify

    if friction is not None and not forces:
        raise InputError("--friction needs the check of contact forces: leave out --no-forces")
    loaded = open_plan(plan)
    if robot is not None:
        refuse_stronger(loaded.robot, robot.load())
    limits = _asked_forces(loaded, friction) if forces else None
    # The plan's own robot, once it is known to be no stronger than the one that was named.
    judged = None if robot is None else loaded.robot
    certificate = certify(loaded, judged, collisions=collisions, forces=limits)
    report = Report(as_json, {"command": "verify", **certificate_document(certificate)})
    report.table(certificate.table())
    report.end()
    codes = {Outcome.CERTIFIED: 0, Outcome.VIOLATED: 1}
    raise typer.Exit(codes.get(certificate.outcome, 3))


def _asked_forces(plan: Plan, friction: float | None) -> ForceLimits:
    """What the plan promises of forces, or the usual limits; with another friction if given."""
    from gaitopt.dynamics.contacts import ForceLimits

    limits = plan.settings.promised_forces or ForceLimits()
    return limits if friction is None else replace(limits, friction=friction)


def simulate(
    plan: PlanArgument,
    out: Annotated[
        Path | None,
        typer.Option(help="Also write a replay of plan and physics side by side.", metavar="HTML"),
    ] = None,
    balls: Annotated[
        bool,
        typer.Option("--balls", help="Let nothing but balls at the feet touch the ground: neither "
                     "limbs and trunk, nor the shapes of a robot that was read from an MJCF."),
    ] = False,
    meshes: MeshesOption = False,
    mesh_folder: MeshFolderOption = None,
    overwrite: ReplaceOption = False,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Simulate a plan with physics (MuJoCo).

    The exit code is 0 when every foot reaches its foothold and joint velocities stay within their
    limits (and the servos' tolerance), and 1 otherwise.
    """
    from gaitopt.simulation.settings import SimulationSettings
    from gaitopt.simulation.simulate import simulate as run_simulation
    from gaitopt.viewing.replay.replay import replay as write_replay

    refuse_existing(out, overwrite=overwrite)
    loaded = open_plan(plan)
    with progress_bar("simulating") as tick:
        tick(0, 1)
        result = run_simulation(loaded, SimulationSettings(own_shapes=not balls, limbs=not balls))
        tick(1, 1)
    report = Report(as_json, {"command": "simulate", **simulation_document(result)})
    report.say(escape(str(result)))
    if out is not None:
        drawn = meshes if mesh_folder is None else mesh_folder
        write_replay(loaded, out, simulated=result, meshes=drawn)
        report.files({out: ""})
    report.end()
    if not result.passed:
        raise typer.Exit(1)


def figures(
    plan: PlanArgument,
    out: Annotated[
        Path | None,
        typer.Argument(help="Folder for the figures; PLAN-figures beside the plan by default.",
                       metavar="DIR"),
    ] = None,
    step: Annotated[
        int | None,
        typer.Option(
            help="Step whose feasible area and swing are drawn; by default the one before "
            "which the body moves farthest."
        ),
    ] = None,
    named: NamedOption = None,
    overwrite: ReplaceOption = False,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Write a plan's figures as PNG files."""
    from gaitopt.plan.settings.by_velocity import GaitSettings
    from gaitopt.viewing.figures.crawl_figures import save_figures

    out = _one_name(out, named, "DIR")
    loaded = open_plan(plan)
    if step is not None and isinstance(loaded.settings, GaitSettings):
        raise InputError("--step is for walks over footholds: the figures of a gait show no step")
    folder = run_folder(out or plan.with_name(f"{plan.stem}-figures"), "figures", overwrite)
    if not overwrite:
        refuse_pictures(folder.path)
    with folder.writing() as (made, place):
        names = [path.name for path in save_figures(loaded, made, step=step)]
        record_run(made, {"command": "figures", "files": names})
    report = Report(as_json, {"command": "figures"})
    report.files({place / name: "" for name in names})
    report.end()
