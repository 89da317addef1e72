"""What the commands do around their work: inputs, settings, folders, progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.errors import InfeasibleStepError, InputError
from gaitopt.gait.crawl import WANG_SEQUENCE

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
    from gaitopt.studies.terrains import s_columns_for

    return s_columns_for(model, seed)


def plan_settings(
    model: Quadruped,
    places: Footholds,
    stability_margin: float,
    body_height: float | None,
    swing_height: float | None,
    sequence: str,
    reach_fraction: float,
    heading: float,
    follow_terrain: bool,
) -> dict[str, Any]:
    """Settings of plan_crawl from the options; what was left open fits the robot."""
    settings = {
        "stability_margin": stability_margin,
        # The paper's 7 cm, to the scale of the robot.
        "swing_height": round(0.175 * model.standing_height, 4)
        if swing_height is None
        else swing_height,
        "sequence": "free" if sequence == "free" else tuple(s.strip() for s in sequence.split(",")),
        "reach_fraction": reach_fraction,
        "heading": heading,
        "follow_terrain": follow_terrain,
    }
    if body_height is None:
        body_height = fitting_height(model, places, settings)
    return {**settings, "body_height": body_height}


def fitting_height(model: Quadruped, places: Footholds, settings: dict[str, Any]) -> float:
    """The robot's standing height, or a higher one where its joints' limits need it."""
    from gaitopt.planners.crawl import plan_crawl

    usual = model.standing_height
    if settings["sequence"] == "free":
        settings = {**settings, "sequence": WANG_SEQUENCE}
    for height in (usual, *(round(usual * k / 14, 2) for k in (15, 16, 17))):
        try:
            plan_crawl(model, places, body_height=height, **settings)
        except InfeasibleStepError:
            continue
        return height
    return usual


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

    At the 5 mm/s of the paper's third row a walk takes an hour, and would squash all others.
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
