"""The command ``gaitopt export``: a plan's motion for other programs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from gaitopt.cli.options import JsonOption, PlanArgument
from gaitopt.cli.results.options import ReplaceOption
from gaitopt.cli.results.report import Report
from gaitopt.cli.results.run_folder import refuse_existing
from gaitopt.cli.support import open_plan
from gaitopt.errors import InputError


def export(
    plan: PlanArgument,
    out: Annotated[
        Path | None, typer.Argument(help="The file to write.", metavar="FILE")
    ] = None,
    format: Annotated[
        str | None,
        typer.Option(help="Its format; by default what the ending of FILE says.", metavar="NAME"),
    ] = None,
    csv: Annotated[
        Path | None, typer.Option(help="Write the motion as a table.", metavar="FILE")
    ] = None,
    ros: Annotated[
        Path | None,
        typer.Option(help="Write the joints' motion as a JointTrajectory in YAML.", metavar="FILE"),
    ] = None,
    dt: Annotated[
        float | None,
        typer.Option(help="Time between samples, in seconds; the format's own by default."),
    ] = None,
    joints: Annotated[
        str | None,
        typer.Option(help="A controller's parameter file (YAML), or names of joints with commas "
                     "between them: which joints the file has, in which order. OLD=NEW gives a "
                     "joint another name.", metavar="JOINTS"),
    ] = None,
    controller: Annotated[
        str | None, typer.Option(help="The controller in a parameter file with several.")
    ] = None,
    prefix: Annotated[str, typer.Option(help="Begins every joint's name in the file.")] = "",
    forces: Annotated[
        bool | None, typer.Option(help="Write joint torques and contact forces, too.")
    ] = None,
    ramp: Annotated[
        float,
        typer.Option(help="Seconds in which a plan that moves at its ends gets up to its pace."),
    ] = 0.2,
    option: Annotated[
        list[str] | None,
        typer.Option("--set", help="An option of the format, as in interpolation=quintic.",
                     metavar="NAME=VALUE"),
    ] = None,
    overwrite: ReplaceOption = False,
    as_json: JsonOption = False,
) -> None:  # fmt: skip
    """Write a plan's motion for robots, simulators and learning code."""
    from gaitopt.exporting.export import FORMATS
    from gaitopt.exporting.export import export as write
    from gaitopt.exporting.tables import export_csv
    from gaitopt.robots.xml_text import shown

    if csv is None and ros is None and out is None:
        known = "; ".join(f"{f.name} ({f.summary})" for f in FORMATS.values())
        raise InputError(f"nothing to write: give a FILE, and --format with one of {known}")
    if csv == ros and csv is not None:
        raise InputError(f"--csv and --ros both name {csv}; give two files")
    refuse_existing(out, csv, ros, overwrite=overwrite)
    loaded = open_plan(plan)
    report = Report(as_json, {"command": "export"})
    numbers: dict[str, dict[str, float]] = {}
    notes: dict[str, tuple[str, ...]] = {}
    if csv is not None:
        export_csv(loaded, csv, dt)
        report.files({csv: ""})
    asked = [(out, format, _options(option)), (ros, "ros2", {})]
    for path, kind, options in asked:
        if path is None:
            continue
        done = write(loaded, path, kind, dt=dt, joints=_joints(joints), prefix=prefix,
                     controller=controller, forces=forces, ramp=ramp, **options)  # fmt: skip
        told = ", ".join(f"{name} {value:.6g}" for name, value in done.numbers.items())
        report.files({file: "" for file in done.files[:-1]} | {done.files[-1]: escape(told)})
        numbers[str(path)], notes[str(path)] = dict(done.numbers), done.notes
        for note in done.notes:
            report.say(escape(shown(note)))
    report.add(numbers=numbers, notes=notes)
    report.end()


def _joints(given: str | None) -> str | list[str] | dict[str, str] | None:
    """Joints of the file: the path of a parameter file, names, or new names by old ones."""
    if given is None or given.endswith((".yaml", ".yml")) or not set(given) & set(",="):
        return given
    parts = [part.partition("=") for part in given.split(",")]
    if any(equals for _, equals, _ in parts):
        return {old.strip(): (new or old).strip() for old, _, new in parts}
    return [name.strip() for name, _, _ in parts]


def _options(given: list[str] | None) -> dict[str, float | str]:
    """Options of a format from ``name=value``; what looks like a number is one."""
    out: dict[str, float | str] = {}
    for text in given or []:
        name, equals, value = text.partition("=")
        if not equals or not name:
            raise InputError(f"--set needs NAME=VALUE, got {text!r}")
        try:
            out[name.strip()] = float(value)
        except ValueError:
            out[name.strip()] = value.strip()
    return out
