"""Refusals of the search over terrain, judged by a finer and wider search.

``python -m benchmarks.planning.refusals --rows FILE [--time-limit 50] [--out FILE]`` takes the
walks of a table of made grounds (``benchmarks.physics.terrain_table``) for which no way was found.
It searches once more over each of these grounds, with ``exhaustive=True``: four times the
footholds, 23 places of the body, twenty heights and tilts of the body for each step, all orders of
the legs in a cycle, more ways of walking, and 2.5 times the time. Where a way is found, the walk
over it is planned and certified. ``--walks robot/ground/seed/difficulty,...`` takes walks in place
of a table. With ``--poses`` nothing is searched for: it prints which share of random poses of the
body stands along the course, each leg by itself, at the place where fewest and at that where most
do. Where none stands, there may be a wall.

A refusal is *confirmed* where all of these searches met a dead end with their widest beam, *solved*
where there is a certified walk, and *open* where the time was over or their tries were used up
(the column ``words`` says which). Rows go to a file as they come, and those that are there are not
made again.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import gaitopt
from gaitopt.planners.over_terrain.beam.ending import Ending
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import search_for
from gaitopt.planners.over_terrain.ways.room_to_stand import standing_shares
from gaitopt.studies.result_table import rows_so_far
from gaitopt.studies.terrain_study import TERRAIN_COLUMNS

COLUMNS = ("robot", "terrain", "seed", "difficulty", "friction", "verdict", "share", "step_length",
           "stance", "seconds", "words")  # fmt: skip
LENGTH = 3.0
"""Of the ways that are given one by one [m]."""


class Refused(NamedTuple):
    """A walk for which no way was found: its ground, and the friction of the search."""

    robot: str
    terrain: str
    seed: str
    difficulty: str
    friction: str = ""
    length: float = LENGTH


def refused_rows(table: Path) -> list[Refused]:
    """The walks of a table for which no way was found."""
    rows = [row.cells for row in rows_so_far(table, TERRAIN_COLUMNS).values()]
    return [
        Refused(row["robot"], row["terrain"], row["seed"], row["difficulty"], row["friction"],
                float(row["length"]))
        for row in rows if row["status"] == "no way"
    ]  # fmt: skip


def judged(walk: Refused, time_limit: float | None) -> dict[str, Any]:
    """What a finer and wider search says of a walk."""
    robot = gaitopt.load_robot(walk.robot)
    ground = gaitopt.make_ground(
        walk.terrain, seed=int(walk.seed), difficulty=float(walk.difficulty), robot=robot,
        length=walk.length,
    )  # fmt: skip
    way, start = (robot, ground, (walk.length, 0.0)), (0.0, 0.0, 0.0)
    friction = float(walk.friction) if walk.friction else None
    begin = time.process_time()
    search = gaitopt.search_terrain(
        *way, start=start, friction=friction, exhaustive=True, time_limit=time_limit
    )
    seconds = time.process_time() - begin
    confirmed = search.ended is Ending.EXHAUSTED
    verdict, words = "confirmed" if confirmed else "open", str(search.ended)
    if search.complete:
        verdict, words = _walked(way, start, search)
    return {
        **walk._asdict(), "verdict": verdict, "share": round(search.share, 3), "words": words,
        "step_length": search.settings.step_length, "stance": search.settings.stance,
        "seconds": round(seconds, 1),
    }  # fmt: skip


def poses_that_stand(walk: Refused, count: int) -> tuple[float, float]:
    """The least and the largest share of random poses that stand at places along the course."""
    robot = gaitopt.load_robot(walk.robot)
    ground = gaitopt.make_ground(
        walk.terrain, seed=int(walk.seed), difficulty=float(walk.difficulty), robot=robot,
        length=walk.length,
    )  # fmt: skip
    settings = TerrainSettings.for_robot(robot)
    search = search_for(robot, ground, (walk.length, 0.0), (0.0, 0.0, 0.0), settings)
    places = search.course.at(np.linspace(0.0, search.course.length, 31))
    random = np.random.default_rng(0)
    shares = standing_shares(search.judge, search.stands, places, count, random)
    return float(shares.min()), float(shares.max())


def _walked(way: tuple[Any, ...], start: tuple[float, ...], search: Any) -> tuple[str, str]:
    """Whether the walk over footholds that were found is planned and certified, or why not."""
    try:
        plan = gaitopt.plan_terrain(*way, start=start, search=search)
    except gaitopt.GaitoptError as error:
        return "footholds only", " ".join(str(error).split())
    outcome = gaitopt.verify(plan).outcome
    return ("solved" if outcome == "certified" else "footholds only"), str(outcome)


def main(arguments: Sequence[str] | None = None) -> int:
    """Judge the refusals, and print how many are confirmed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.planning.refusals",
                                     description=__doc__.partition("\n")[0])  # fmt: skip
    parser.add_argument("--rows", type=Path, help="table of benchmarks.physics.terrain_table")
    parser.add_argument("--walks", help="robot/ground/seed/difficulty, joined by commas")
    parser.add_argument("--time-limit", type=float, help="of each search [s]; usually 200 over 3 m")
    parser.add_argument("--out", type=Path, default=Path("refusals.csv"), help="rows go here")
    parser.add_argument("--poses", type=int, help="how many to try at each of 31 places")
    options = parser.parse_args(arguments)
    walks = refused_rows(options.rows) if options.rows else []
    walks += [Refused(*text.split("/")) for text in (options.walks or "").split(",") if text]
    if options.poses:
        for walk in walks:
            least, most = poses_that_stand(walk, options.poses)
            print(*walk[:4], f"{least:.1%} to {most:.1%} of {options.poses} poses stand")
        return 0
    done: list[dict[str, Any]] = []
    if options.out.exists():
        with options.out.open(newline="") as stream:
            done = list(csv.DictReader(stream))
    keys = {tuple(str(row[name]) for name in COLUMNS[:5]) for row in done}
    for walk in walks:
        if tuple(walk[:5]) in keys:
            continue
        row = judged(walk, options.time_limit)
        with options.out.open("a", newline="") as stream:
            writer = csv.DictWriter(stream, COLUMNS, extrasaction="ignore")
            if stream.tell() == 0:
                writer.writeheader()
            writer.writerow(row)
        done.append(row)
        print(*(row[name] for name in COLUMNS[:-1]), flush=True)
    counts = Counter(str(row["verdict"]) for row in done)
    print(", ".join(f"{count} {verdict}" for verdict, count in counts.most_common()))
    return 0


if __name__ == "__main__":
    sys.exit(main())
