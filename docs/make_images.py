"""Make the pictures of README and docs: ``python docs/make_images.py replay``.

One function an image, named as the file in ``docs/images``. Without a name all are made.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.planners.crawl import plan_crawl
from gaitopt.planners.over_terrain.planner import plan_terrain, search_terrain
from gaitopt.robots.catalog import load_robot
from gaitopt.terrain.columns import s_columns
from gaitopt.terrain.maps.catalogue import make_ground

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gaitopt.plan.plan import Plan
    from gaitopt.planners.over_terrain.result import TerrainSearch

IMAGES = Path(__file__).parent / "images"


def replay(target: Path) -> None:
    """The replay of the paper's walk in the middle of a swing, as Chromium draws it."""
    from gaitopt.viewing.replay.replay import replay as write_replay

    plan = plan_crawl(load_robot("wang2020"), s_columns(0), timing="velocity")
    # In the middle of the walk, a swing at the very margin: the COG on the inner triangle's side.
    swings = [p for p in plan.phases if p.kind == "swing" and p.margin < plan.margin + 1e-6]
    middle = min(swings, key=lambda p: abs(p.start - 0.55 * plan.duration))
    moment = middle.start + 0.6 * middle.duration
    with tempfile.TemporaryDirectory() as folder:
        page = write_replay(plan, Path(folder) / "replay.html")
        photograph(f"{page.as_uri()}#t={moment:.3f}&paused", target, (1280, 720))


def replay_curves(target: Path) -> None:
    """A walk that is timed by contact forces, with its curves below."""
    from gaitopt.viewing.replay.replay import replay as write_replay

    plan = plan_crawl(load_robot("wang2020"), s_columns(0))
    with tempfile.TemporaryDirectory() as folder:
        page = write_replay(plan, Path(folder) / "replay.html")
        photograph(f"{page.as_uri()}#t=40&paused&curves", target, (1280, 800))


def _over_rubble() -> tuple[Plan, TerrainSearch]:
    """A walk of go2 over rubble, and the search for its footholds."""
    robot = load_robot("go2")
    ground = make_ground("rubble", seed=0, difficulty=0.6, robot=robot, length=2.0)
    search = search_terrain(robot, ground, (2.0, 0.0), start=(0.0, 0.0, 0.0))
    return plan_terrain(robot, ground, (2.0, 0.0), start=(0.0, 0.0, 0.0), search=search), search


def terrain_replay(target: Path) -> None:
    """The replay of a walk over rubble, in the middle of a swing in the middle of the walk."""
    from gaitopt.viewing.replay.replay import replay as write_replay

    plan, search = _over_rubble()
    swing = plan.swings[len(plan.swings) // 2]
    moment = (swing.start + swing.end) / 2.0
    with tempfile.TemporaryDirectory() as folder:
        page = write_replay(plan, Path(folder) / "replay.html", search=search)
        photograph(f"{page.as_uri()}#t={moment:.3f}&paused", target, (1280, 720))


def terrain_map(target: Path) -> None:
    """The same walk from above, with all places that the search tried."""
    from gaitopt.viewing.figures.files import save_figure
    from gaitopt.viewing.figures.terrain_map import plot_terrain_map

    plan, search = _over_rubble()
    save_figure(plot_terrain_map(plan, search=search), target)


def feasible_area(target: Path) -> None:
    """Areas A and B before a step at which the reach of a leg counts (hips 0.555 m high)."""
    from gaitopt.viewing.figures.crawl_figures import plot_feasible_area

    plan = plan_crawl(load_robot("wang2020"), s_columns(0), timing="velocity", body_height=0.555)
    paint(plot_feasible_area(plan, 40)[0].figure, target)


def joint_velocities(target: Path) -> None:
    """Joint velocities of the paper's walk, and of one cycle of it."""
    from gaitopt.viewing.figures.crawl_figures import plot_joint_velocities

    plan = plan_crawl(load_robot("wang2020"), s_columns(0), timing="velocity")
    paint(plot_joint_velocities(plan)[0, 0].figure, target)


def leg(target: Path) -> None:
    """The closed form's constants on a leg that has all of them: d, u, l2, l3, and its angles."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Arc

    figure = Figure(figsize=(8.4, 3.9), layout="compressed")
    side, front = figure.subplots(1, 2, width_ratios=[1.25, 1.0])
    # Offsets larger than any real leg's, so that they can be seen.
    d, u, l2, l3, roll, thigh, bend = 0.16, 0.10, 0.30, 0.27, 0.3, 0.7, -1.2
    hip, axis = np.zeros(2), np.array([0.0, -u])
    knee = axis - l2 * np.array([np.sin(thigh), np.cos(thigh)])
    foot = knee - l3 * np.array([np.sin(thigh + bend), np.cos(thigh + bend)])
    side.plot(*np.array([hip, axis, knee, foot]).T, "-o", color="#333333", linewidth=3)
    side.plot(*np.array([axis, foot]).T, "--", color="#c0392b", linewidth=1.2)
    side.plot([0, 0], [-u, -0.36], ":", color="#888888")
    straight = knee + 0.55 * (knee - axis)
    side.plot(*np.array([knee, straight]).T, ":", color="#888888")
    for text, place in {
        "hip, on the roll axis": (0.03, -0.01), "$u$": (0.015, -u / 2 - 0.01),
        "pitch axis": (0.03, -u - 0.01), "$l_2$": (-0.15, -0.20), "$l_3$": (-0.115, -0.43),
        "foot $(p_x, \\zeta)$": (-0.04, -0.59), "$s$": (-0.01, -0.42),
        "$A > 0$": (-0.135, -0.285), "$B < 0$": (-0.235, -0.48), "knee": (-0.28, -0.32),
    }.items():  # fmt: skip
        side.text(*place, text, fontsize=10)
    side.add_patch(Arc(axis, 0.28, 0.28, theta1=270 - np.degrees(thigh), theta2=270))
    ahead = 270 - np.degrees(thigh)
    side.add_patch(Arc(knee, 0.22, 0.22, theta1=ahead, theta2=ahead - np.degrees(bend)))
    side.set_title("in the leg's own plane", loc="left", fontsize=10)
    side.set(xlabel="forward [m]", ylabel="up [m]", xlim=(-0.34, 0.30), ylim=(-0.66, 0.06))
    turn = np.array([[np.cos(roll), -np.sin(roll)], [np.sin(roll), np.cos(roll)]])
    corner, end = turn @ [d, 0.0], turn @ [d, foot[1]]
    front.plot(*np.array([hip, corner, end]).T, "-o", color="#333333", linewidth=3)
    front.plot(*np.array([hip, end]).T, "--", color="#888888", linewidth=1)
    front.plot([0, 0.24], [0, 0], ":", color="#888888")
    for text, place in {
        "hip": (0.0, 0.03), "$d$": (0.09, 0.045), "$a_1$": (0.245, 0.01),
        "$-\\zeta$": (0.32, -0.22), "foot $(p_y, p_z)$": (0.36, -0.55),
    }.items():  # fmt: skip
        front.text(*place, text, fontsize=10)
    front.add_patch(Arc((0, 0), 0.36, 0.36, theta1=0, theta2=np.degrees(roll)))
    front.set_title("seen from behind, y to the left", loc="left", fontsize=10)
    front.set(xlabel="left [m]", ylabel="up [m]", xlim=(0.48, -0.10), ylim=(-0.66, 0.09))
    for ax in (side, front):
        ax.set_aspect("equal")
        ax.spines[["top", "right"]].set_visible(False)
        ax.tick_params(labelsize=8)
    paint(figure, target)


def paint(figure: Figure, target: Path) -> None:
    """Write a figure in few colours, so that it stays small."""
    from PIL import Image

    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=110)
    small = Image.open(buffer).convert("RGB").quantize(64, dither=Image.Dither.NONE)
    small.save(target, optimize=True)


def photograph(address: str, target: Path, size: tuple[int, int]) -> None:
    """A picture of a page, in few colours so that it stays small."""
    from PIL import Image

    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        raise SystemExit("this picture is taken by Chromium: install it, or put it on the PATH")
    with tempfile.TemporaryDirectory() as folder:
        raw = Path(folder) / "raw.png"
        subprocess.run(
            [browser, "--headless", "--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader",
             "--use-angle=swiftshader", "--no-first-run", "--disable-background-networking",
             "--disable-component-update", "--disable-sync", "--disable-quic",
             f"--user-data-dir={folder}/profile", f"--window-size={size[0]},{size[1]}",
             "--virtual-time-budget=4000", f"--screenshot={raw}", address],
            check=True, capture_output=True, timeout=120,
        )  # fmt: skip
        # Median cut could give two legs the same colour where few pixels have it.
        small = (
            Image.open(raw)
            .convert("RGB")
            .quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE)
        )
        small.save(target, optimize=True)


def badges(target: Path) -> None:
    """Version, Python and licence as pyproject.toml states them, beside each other."""
    stated = (Path(__file__).parents[1] / "pyproject.toml").read_text("utf-8")
    found = {key: re.findall(rf'^{key} = ">?=?([^"]+)"', stated, re.M)[0]
             for key in ("version", "requires-python", "license")}  # fmt: skip
    words = [("version", found["version"]), ("Python", f"{found['requires-python']} or later"),
             ("licence", found["license"]), ("types", "checked by mypy, strict")]  # fmt: skip
    parts, x = [], 0
    for name, value in words:
        left, right = 14 + round(6.3 * len(name)), 14 + round(6.3 * len(value))
        for begin, wide, text, colour in ((x, left, name, "#3a4350"),
                                          (x + left, right, value, "#1f6f54")):  # fmt: skip
            parts.append(
                f'<rect x="{begin}" width="{wide}" height="20" fill="{colour}"/>'
                f'<text x="{begin + wide / 2:g}" y="14" textLength="{wide - 14}">{text}</text>'
            )
        x += left + right + 6
    target.write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{x - 6}" height="20" fill="#fff" '
        'text-anchor="middle" font-family="Verdana,DejaVu Sans,sans-serif" font-size="11">'
        + "".join(parts) + "</svg>\n", "utf-8",
    )  # fmt: skip


ALL: dict[str, Callable[[Path], None]] = {
    "badges.svg": badges,
    "replay": replay,
    "replay_curves": replay_curves,
    "terrain_replay": terrain_replay,
    "terrain_map": terrain_map,
    "leg": leg,
    "feasible_area": feasible_area,
    "joint_velocities": joint_velocities,
}


def main(names: list[str]) -> None:
    """Make the named pictures, or all."""
    unknown = [name for name in names if name not in ALL]
    if unknown:
        raise SystemExit(f"unknown picture {unknown[0]!r}; known are {', '.join(ALL)}")
    IMAGES.mkdir(exist_ok=True)
    for name in names or ALL:
        target = IMAGES / (name if "." in name else f"{name}.png")
        ALL[name](target)
        print(f"{target.name}: {target.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
