"""Frames a second of replays in a browser without a graphics card.

``python -m benchmarks.speed.frames``

Headless Chromium draws with SwiftShader, on the processor. A machine with a graphics card, however
small, draws many times as many frames; this is the worst that can happen to a reader. The processor
time of a frame does not depend on what else the machine does. The last column is what is left with
a graphics card: the page's scripts and layout, without the drawing.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from pathlib import Path

import gaitopt
from gaitopt.studies.race import race
from gaitopt.viewing.replay.race import race_replay
from gaitopt.viewing.replay.video.chromium import chromium

SECONDS, REPETITIONS = 2.0, 3
SIZES = ((1280, 720), (736, 420), (420, 800))
COUNT = """new Promise((done) => {
  const start = performance.now();
  let frames = 0;
  const once = () => {
    frames++;
    if (performance.now() - start < @MS@) requestAnimationFrame(once);
    else done(1000 * frames / (performance.now() - start));
  };
  window.gaitopt.setPlaying(true);
  requestAnimationFrame(once);
})"""
SCRIPTS = """(() => {
  const { seek, draw, viewer, setPlaying } = window.gaitopt;
  setPlaying(false);
  viewer.renderer.render = () => {};
  let least = Infinity;
  for (let k = 0; k < 600; k += 5) {
    const start = performance.now();
    for (let i = k; i < k + 5; i++) {
      seek(1 + i / 60);
      draw();
      document.body.offsetHeight;
    }
    least = Math.min(least, (performance.now() - start) / 5);
  }
  return least;
})()"""
"""The least time of a frame without drawing [ms]."""


def processor_time() -> float:
    """Processor time of all processes below this one [s]."""
    parents: dict[int, int] = {}
    spent: dict[int, float] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                fields = (entry / "stat").read_text().rsplit(")", 1)[1].split()
            except OSError:
                continue
            parents[int(entry.name)] = int(fields[1])
            spent[int(entry.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def below(process: int) -> bool:
        while process in parents:
            process = parents[process]
            if process == os.getpid():
                return True
        return False

    return sum(time for process, time in spent.items() if below(process))


def pages(folder: Path) -> dict[str, Path]:
    """Replays by what they show."""
    wang, go2 = gaitopt.load_robot("wang2020"), gaitopt.load_robot("go2")
    columns = gaitopt.plan_crawl(wang, gaitopt.s_columns(0))
    ground = gaitopt.make_ground("rubble", seed=1, difficulty=0.6, robot=go2)
    rubble = gaitopt.plan_terrain(go2, ground, (1.0, 0.0), start=(0.0, 0.0, 0.0))
    found = race(wang, gaitopt.s_columns(0, columns=3), certify=False, bound=False)
    made = {"64 steps over columns, with curves": gaitopt.replay(columns, folder / "columns.html"),
            "go2 over rubble": gaitopt.replay(rubble, folder / "rubble.html")}  # fmt: skip
    return {**made, "race of 8 lanes": race_replay(found.plans, folder / "race.html")}


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    asked = parser.parse_args()
    print("| replay | " + " | ".join(f"{w} × {h}" for w, h in SIZES) + " | scripts |")
    print("|---|" + "---|" * (len(SIZES) + 1))
    with tempfile.TemporaryDirectory() as folder, chromium() as browser:
        for name, page in pages(Path(folder)).items():
            cells = []
            for size in SIZES:
                browser.open(f"{page.as_uri()}#t=1", size)
                script = COUNT.replace("@MS@", str(1000.0 * asked.seconds))
                before, rates = processor_time(), []
                for _ in range(REPETITIONS):
                    rates.append(browser.run(script))
                frames = sum(rates) * asked.seconds
                spent = (processor_time() - before) / frames
                # Others may use the machine: the best of a few.
                cells.append(f"{max(rates):.1f}; {1e3 * spent:.0f} ms")
            cells.append(f"{browser.run(SCRIPTS):.2f} ms")
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
