"""What several commands need: inputs, settings, folders, progress bars, and what they print."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.errors import InputError

if TYPE_CHECKING:
    from gaitopt.cli.robot_options import RobotChoice
    from gaitopt.dynamics.contacts import ForceLimits
    from gaitopt.plan.plan import Plan
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.terrain.footholds import Footholds


LONGEST_SHARE = 4.0
"""Plans that take longer than so many times the plan's time are not drawn beside it. Chosen here:
the shortest line still covers a quarter of the axis."""
MOST_NAMED = 8
"""Most files of plans that a message names. Chosen: they fit into a few lines."""
TABLE_WIDTH = 150
"""Width of tables where the output is no terminal: the widest table, that of ``gaitopt race``."""


def load_inputs(
    robot: RobotChoice, footholds: Path | None, seed: int | None
) -> tuple[Quadruped, Footholds]:
    """The robot and the footholds that the options name.

    Args:
        robot: the robot.
        footholds: a CSV file, or ``None`` for random columns.
        seed: of the random columns; 0 by default.

    Raises:
        InputError: both a file and a seed are given.
        RobotError: the robot is unknown, or its file cannot be read.
        FootholdsError: the file cannot be read.
    """
    from gaitopt.terrain.footholds import Footholds

    if footholds is not None and seed is not None:
        raise InputError("--footholds and --seed exclude each other: give one of them")
    model = robot.load()
    if footholds is not None:
        return model, Footholds.from_csv(footholds)
    return model, random_terrain(model, seed or 0)


def random_terrain(model: Quadruped, seed: int) -> Footholds:
    """The S-shaped columns of a seed, in proportion to the robot's size."""
    from gaitopt.terrain.columns import s_columns

    return s_columns(seed, robot=model)


def run_name(command: str, model: Quadruped, footholds: Path | None, seed: int | None) -> str:
    """Name of a run's folder: command, robot, and what it walks on."""
    where = file_name(footholds.stem) if footholds is not None else f"seed{seed or 0}"
    return f"{command}-{file_name(model.name) or 'robot'}-{where or 'footholds'}"


def plan_options(
    stability_margin: float | None,
    body_height: float | None,
    swing_height: float | None,
    sequence: str,
    reach_fraction: float,
    heading: float,
    follow_terrain: bool,
) -> dict[str, Any]:
    """Keywords of ``plan_crawl`` from options; ``None`` stands for the planner's default."""
    return {
        "stability_margin": stability_margin,
        "body_height": body_height,
        "swing_height": swing_height,
        "sequence": sequence,
        "reach_fraction": reach_fraction,
        "heading": heading,
        "follow_terrain": follow_terrain,
    }


def force_limits(
    friction: float | None, transfer_time: float | None = None, objective: str = "distance"
) -> ForceLimits | None:
    """Limits with the options ``--friction`` and ``--transfer-time``.

    Without them ``None``, the planner's default.
    """
    from gaitopt.dynamics.contacts import ForceLimits
    from gaitopt.plan.settings.crawl import FRICTION_OF_MARGIN

    if transfer_time is None:
        return None if friction is None else ForceLimits(friction=friction)
    usual = FRICTION_OF_MARGIN if objective == "margin" else ForceLimits().friction
    return ForceLimits(
        friction=usual if friction is None else friction, transfer_time=transfer_time
    )


def parse_speed(text: str) -> Any:
    """The option ``--speed``: ``"max"``, or a number [m/s].

    Raises:
        InputError: it is neither.
    """
    if text == "max":
        return "max"
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--speed must be 'max' or a number of m/s, got {text!r}") from None


def make_folder(folder: Path) -> None:
    """Make a folder and those above it.

    Raises:
        InputError: it cannot be made; says why.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder {folder}: {error.strerror or error}") from error


def open_plan(path: Path) -> Plan:
    """Read a plan file, or the one plan in the folder of a run.

    Raises:
        PlanFileError: that fails, or the folder holds several plans, or none.
    """
    from gaitopt.plan.plan_file import load_plan

    return load_plan(_plan_in(path) if path.is_dir() else path)


def _plan_in(folder: Path) -> Path:
    """The plan file in a folder; raises PlanFileError where there is not just one."""
    from gaitopt.errors import PlanFileError

    plans = sorted(folder.glob("*.npz"))
    if len(plans) == 1:
        return plans[0]
    if plans:
        names = ", ".join(str(plan) for plan in plans[:MOST_NAMED])
        more = f" and {len(plans) - MOST_NAMED} more" if len(plans) > MOST_NAMED else ""
        raise PlanFileError(f"{folder} holds {len(plans)} files of plans; give one: {names}{more}")
    raise PlanFileError(f"{folder} is a folder without a plan file (.npz); give the plan's file")


def drawable(plan: Plan, plans: Mapping[str, Plan]) -> dict[str, Plan]:
    """The plans of a comparison that can be drawn over one axis of time.

    At the 5 mm/s of [Wang2020], Table II, a walk takes an hour: beside it all others would be too
    short to see.

    Args:
        plan: the plan whose figures are drawn; it replaces the plan with the same settings.
        plans: of the comparison, by name.
    """
    return {
        name: plan if other.settings == plan.settings else other
        for name, other in plans.items()
        if other.duration <= LONGEST_SHARE * plan.duration
    }


def summarise(plan: Plan) -> str:
    """Describe a plan in one sentence."""
    what = "ZMP margin" if not plan.settings.static else "margin"
    of = " of the true COM" if plan.settings.true_com else ""
    return (
        f"{plan.robot.name} takes {len(plan.swings)} steps over {plan.distance:.2f} m in "
        f"{plan.duration:.1f} s ({1e3 * plan.mean_speed:.2f} mm/s), {what}{of} at least "
        f"{1e3 * plan.margin:.1f} mm"
    )


def terminal(markup: bool = True) -> Any:
    """The console that tables are printed to, with their full width where it is no terminal.

    Args:
        markup: whether words in brackets are rich's markup, as ``[bold]``.
    """
    from rich.console import Console

    console = Console(highlight=False, markup=markup)
    if console.is_terminal:
        return console
    return Console(highlight=False, markup=markup, width=TABLE_WIDTH)


def print_files(files: Mapping[Path, str]) -> None:
    """Print the paths of files that were written, and what each is."""
    from rich.markup import escape

    for path, what in files.items():
        terminal().print(f"[bold]{escape(str(path))}[/]  {what}".rstrip())


def file_name(name: str, filler: str = "-") -> str:
    """A name in lower case for a file, with ``filler`` for all but letters and digits."""
    return "".join(c if c.isalnum() else filler for c in name).strip(filler).lower()


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar named ``what``; the value is a function of (done, in all)."""
    from gaitopt.viewing.notebook import progress

    with progress.progress_bar(what) as tick:
        yield tick
