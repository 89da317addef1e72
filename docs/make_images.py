"""Make the pictures of README and docs: ``python docs/make_images.py replay``.

One function an image, named as the file in ``docs/images``. Without a name all are made.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from gaitopt.planning.crawl import plan_crawl
from gaitopt.robots.catalog import load_robot
from gaitopt.terrain.columns import s_columns

IMAGES = Path(__file__).parent / "images"


def replay(target: Path) -> None:
    """The replay of the paper's walk in the middle of a swing, as Chromium draws it."""
    from gaitopt.viewing.replay import replay as write_replay

    plan = plan_crawl(load_robot("wang2020"), s_columns(0))
    # In the middle of the walk, a swing at the very margin: the COG on the inner triangle's side.
    swings = [p for p in plan.phases if p.kind == "swing" and p.margin < plan.margin + 1e-6]
    middle = min(swings, key=lambda p: abs(p.start - 0.55 * plan.duration))
    moment = middle.start + 0.6 * middle.duration
    with tempfile.TemporaryDirectory() as folder:
        page = write_replay(plan, Path(folder) / "replay.html")
        photograph(f"{page.as_uri()}#t={moment:.3f}&paused", target, (1280, 720))


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
        Image.open(raw).convert("RGB").quantize(256).save(target, optimize=True)


ALL: dict[str, Callable[[Path], None]] = {"replay": replay}


def main(names: list[str]) -> None:
    """Make the named pictures, or all."""
    unknown = [name for name in names if name not in ALL]
    if unknown:
        raise SystemExit(f"unknown picture {unknown[0]!r}; known are {', '.join(ALL)}")
    IMAGES.mkdir(exist_ok=True)
    for name in names or ALL:
        target = IMAGES / f"{name}.png"
        ALL[name](target)
        print(f"{target.name}: {target.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
