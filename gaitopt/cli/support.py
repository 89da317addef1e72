"""What the commands do around their work: inputs, settings, folders, progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.errors import InputError
from gaitopt.gait.crawl import FREE_ORDER

if TYPE_CHECKING:
    from gaitopt.plan.plan import Plan
    from gaitopt.robots.quadruped import Quadruped
    from gaitopt.terrain.footholds import Footholds


def load_inputs(
    robot: str, footholds: Path | None, seed: int | None
) -> tuple[Quadruped, Footholds]:
    from gaitopt.robots.catalog import load_robot
    from gaitopt.terrain.footholds import Footholds

    if footholds is not None and seed is not None:
        raise InputError("--footholds and --seed exclude each other: give one of them")
    model = load_robot(robot)
    if footholds is not None:
        return model, Footholds.from_csv(footholds)
    return model, random_terrain(model, seed or 0)


def random_terrain(model: Quadruped, seed: int) -> Footholds:
    """The random columns of this seed, to the robot's size."""
    from gaitopt.terrain.columns import s_columns

    return s_columns(seed, robot=model)


def plan_options(
    stability_margin: float | None,
    body_height: float | None,
    swing_height: float | None,
    sequence: str,
    reach_fraction: float,
    heading: float,
    follow_terrain: bool,
) -> dict[str, Any]:
    """Settings of plan_crawl from the options; what was left open is left to the planner."""
    free = sequence == FREE_ORDER
    return {
        "stability_margin": stability_margin,
        "body_height": body_height,
        "swing_height": swing_height,
        "sequence": FREE_ORDER if free else tuple(s.strip() for s in sequence.split(",")),
        "reach_fraction": reach_fraction,
        "heading": heading,
        "follow_terrain": follow_terrain,
    }


def parse_speed(text: str) -> Any:
    """``'max'``, or a number of m/s."""
    if text == "max":
        return "max"
    try:
        return float(text)
    except ValueError:
        raise InputError(f"--speed must be 'max' or a number of m/s, got {text!r}") from None


def make_folder(folder: Path) -> None:
    """Make a folder, or say why it cannot be made."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder {folder}: {error.strerror or error}") from error


def open_plan(path: Path) -> Plan:
    """Read a plan file."""
    from gaitopt.plan.plan import load_plan

    return load_plan(path)


def drawable(plan: Plan, plans: Mapping[str, Plan]) -> dict[str, Plan]:
    """The plans of a comparison that fit into one picture with ``plan``, which is one of them.

    At the 5 mm/s of [Wang2020], Table II, a walk takes an hour, and would squash all others.
    """
    return {
        name: plan if other.settings == plan.settings else other
        for name, other in plans.items()
        if other.duration <= 4.0 * plan.duration
    }


def summarise(plan: Plan) -> str:
    """A plan in one sentence."""
    what = "ZMP margin" if not plan.settings.static else "margin"
    of = " of the true COM" if plan.settings.true_com else ""
    return (
        f"{plan.robot.name} takes {len(plan.swings)} steps over {plan.distance:.2f} m in "
        f"{plan.duration:.1f} s ({1e3 * plan.mean_speed:.2f} mm/s), {what}{of} at least "
        f"{1e3 * plan.margin:.1f} mm"
    )


def terminal() -> Any:
    """Where to print tables: wide enough where nobody watches."""
    from rich.console import Console

    console = Console(highlight=False)
    # A table needs its columns: where nobody watches, take the width that it needs.
    return console if console.is_terminal else Console(highlight=False, width=150)


@contextmanager
def progress_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """A progress bar that calls can advance with (done, in all)."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
               TimeElapsedColumn())  # fmt: skip
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
