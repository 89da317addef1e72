"""Make the pictures of the gallery of gaits: ``python docs/make_gallery.py trot walk``.

One picture a name, ``docs/images/gait_<name>.png``. Without a name all are made.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

from matplotlib.axes import Axes

from gaitopt.gait.gaits import bound, crawl, pace, pronk, quasi_static, trot, walk, wave
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.planners.by_velocity.planner import plan_gait
from gaitopt.robots.catalog import load_robot
from gaitopt.viewing.figures.panels import Panels, figure_of, new_figure
from gaitopt.viewing.figures.schedule import plot_gait_diagram, plot_margin_over_duty
from gaitopt.viewing.figures.snapshots import plot_snapshots
from gaitopt.viewing.figures.swing_curves import plot_swing_curves
from gaitopt.viewing.figures.zmp import plot_zmp

IMAGES = Path(__file__).parent / "images"

GAITS: dict[str, GaitSchedule] = {
    "walk": walk(1.6),
    "wave": wave(1.6),
    "crawl": crawl(("RH", "RF", "LF", "LH"), 1.6),
    "quasi_static": quasi_static(1.0),
    "trot": trot(0.5),
    "flying_trot": trot(0.5, 0.4),
    "pronk": pronk(0.5),
    "pace": pace(0.5),
    "bound": bound(0.5),
}


def diagram(schedule: GaitSchedule) -> Axes:
    """A gait diagram, lower than the figure of its own."""
    return plot_gait_diagram(schedule, ax=new_figure(7.0, 2.4).add_subplot())


def trot_snapshots() -> Panels:
    """The trot of [Wang2024] from the side."""
    robot = load_robot("wang2020-fast")
    plan = plan_gait(
        robot, trot(0.5), velocity=0.3, distance=1.5, swing="cycloid", timing="velocity"
    )
    return plot_snapshots(plan)


def walk_zmp() -> Panels:
    """A walk with its sway, from above."""
    robot = load_robot("wang2020-fast")
    return plot_zmp(plan_gait(robot, walk(1.6), velocity=0.1, distance=0.3, timing="velocity"))


ALL: dict[str, Callable[[], Axes | Panels]] = {
    **{name: lambda schedule=schedule: diagram(schedule) for name, schedule in GAITS.items()},
    "orders": plot_margin_over_duty,
    "swing_curves": plot_swing_curves,
    "trot_snapshots": trot_snapshots,
    "walk_zmp": walk_zmp,
}


def write(drawn: Axes | Panels, target: Path) -> None:
    """Write the figure of some axes in few colours, chosen so that thin lines keep theirs."""
    from PIL import Image

    buffer = BytesIO()
    figure_of(drawn).savefig(buffer, format="png", dpi=100)
    image = Image.open(buffer).convert("RGB")
    small = image.quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE)
    small.save(target, optimize=True)


def main(names: list[str]) -> None:
    """Make the named pictures, or all."""
    unknown = [name for name in names if name not in ALL]
    if unknown:
        raise SystemExit(f"unknown picture {unknown[0]!r}; known are {', '.join(ALL)}")
    for name in names or ALL:
        target = IMAGES / f"gait_{name}.png"
        write(ALL[name](), target)
        print(f"{target.name}: {target.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
