"""What gaitopt reads from robot files, as a table; and whether the default walk works on each.

``python -m benchmarks.physics.robots [--walk] NAME... LABEL=FILE...`` prints a line for each robot:
by its name, or a file under a label. ``FILE;masses='file';motor_inertia=0.001`` reads it with
keywords of ``load_robot``, which are shown behind the label. With ``--walk`` it also plans the
default walk over columns of the robot's size, loads it again from its file, checks it, and
simulates it.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import gaitopt

COLUMNS = 4
"""Columns a leg: 12 steps."""
HEADER = ("robot", "kind", "mass [kg]", "joints a leg", "l₂ + l₃ [m]", "feet [mm]", "locked",
          "hips [m]", "warnings")  # fmt: skip


def read(source: str, options: Mapping[str, Any]) -> tuple[list[str], gaitopt.Quadruped | None]:
    """The cells of a robot's line, and the robot; or the error, and ``None``."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gaitopt.RobotWarning)
        try:
            robot = gaitopt.load_robot(source, **options)
        except gaitopt.GaitoptError as error:
            return [f"refused: {error}"], None
    leg = robot.legs["LF"]
    cells = [
        robot.notes.kind, f"{robot.mass:.2f}", str(len(leg.joints)),
        f"{leg.upper:.3f} + {leg.lower:.3f}", f"{1e3 * robot.foot_radius:.4g}",
        str(len(robot.notes.locked) or ""), f"{robot.standing_height:.2f}",
        ", ".join(_short(text) for text in robot.notes.warnings),
    ]  # fmt: skip
    return cells, robot


def _short(warning: str) -> str:
    """The first words of a warning."""
    known = {
        "no velocity limit": "no velocity limits",
        "velocity limits that look": "velocity placeholders",
        "effort limits that look": "torque placeholders",
        "no effort limit": "no torque limits",
        "the radius of the feet": "no foot radius",
        "the feet have radii": "feet differ",
        "the feet of L": "legs not alike",
        "inertias that no body": "odd inertias",
        "axes of the legs": "axes made square",
        "inertias are those": "inertias of shapes",
        "masses are estimated": "masses of shapes",
        "torque limits are too small": "torque limits too small to stand",
        "lower limits above": "limits exchanged",
        "xacro arguments": "xacro arguments",
        "elements that no URDF": "elements not read",
        "motors that have about": "large motor inertias",
        "joints that rub": "large joint friction",
        "the end of leg": "wide leg ends",
        "more chains than four": "more than four legs",
        "legs are in other corners": "names of other corners",
    }
    for begin, short in known.items():
        if warning.startswith(begin):
            return short
    return "meshes missing" if re.match(r"\d+ mesh", warning) else warning.split(";")[0]


def walked(robot: gaitopt.Quadruped) -> list[str]:
    """The cells of a robot's walk: its duration, whether promises are kept, and physics."""
    try:
        columns = gaitopt.s_columns(0, columns=COLUMNS, robot=robot)
        plan = gaitopt.plan_crawl(robot, columns)
    except gaitopt.GaitoptError as error:
        return [f"no walk: {str(error)[:120]}", "", ""]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "plan.npz"
        plan.save(file)
        again = gaitopt.load_plan(file)
    assert again.robot.sha256 == robot.sha256
    assert np.array_equal(again.path.coefficients, plan.path.coefficients)
    kept = gaitopt.verify(again).ok
    try:
        result = gaitopt.simulate(again)
        physics = "; ".join(re.split(", and|; ", text)[0] for text in result.failures) or "passed"
    except gaitopt.GaitoptError as error:
        physics = f"refused: {str(error)[:80]}"
    return [f"{plan.duration:.2f}", "kept" if kept else "violated", physics]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--walk", action="store_true")
    parser.add_argument("robots", nargs="+", metavar="NAME or LABEL=FILE")
    given = parser.parse_args(arguments)
    header = [*HEADER, *(("walk [s]", "promises", "physics") if given.walk else ())]
    print(f"| {' | '.join(header)} |\n|{'---|' * len(header)}")
    for text in given.robots:
        label, mark, file = text.split(";")[0].partition("=")
        options = {name: ast.literal_eval(value) for name, _, value in
                   (option.partition("=") for option in text.split(";")[1:])}  # fmt: skip
        cells, robot = read(file if mark else label, options)
        if robot is not None and given.walk:
            cells += walked(robot)
        how = "".join(f", `{name}={value!r}`" for name, value in options.items())
        print(f"| `{label}`{how} | {' | '.join(cells)} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
