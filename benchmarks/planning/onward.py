"""A refusal of the search over terrain, judged by going on from before its dead end in other ways.

``python -m benchmarks.planning.onward anymal_c/hills/25/1.0 [--step 0.5] [--stance 0.7]`` searches
with steps and a stance that are given as shares of the usual ones, without a limit of time. From
some steps before its dead end it goes on with more freedom of the steps and lower bodies, one after
the other, until one of these searches reaches the goal. The walk over what is found is planned,
certified and walked in physics. A way that is found so shows that a refusal is none; where none is
found, nothing is shown. What it finds does not depend on the machine.
"""

from __future__ import annotations

import argparse
import itertools
import sys
import time
from collections.abc import Sequence
from dataclasses import replace

import gaitopt
from benchmarks.planning.refusals import Refused
from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import first_layer, result_of, search_for, with_settings
from gaitopt.planners.over_terrain.states import Found

WIDEST = 24
"""Widest beam of each search."""
BACK = (12, 8, 16, 24, 32)
"""Steps before the dead end from which it goes on."""
FREEDOMS, HEIGHTS = (1.75, 1.3, 1.0), (0.92, 1.0, 0.85)
"""What it goes on with, as shares of the usual freedom and height of the body."""
START = (0.0, 0.0, 0.0)


def way_on(search: Search) -> TerrainSearch | None:
    """What a search finds that goes on from before its dead end; ``None`` where no way is found."""
    begin, settings = time.perf_counter(), search.judge.settings
    first = search.run([first_layer(search)])
    if first.complete:
        return result_of(search, first, begin)
    print(f"dead end after {len(first.layers) - 1} of {first.steps} steps", flush=True)
    for back, freedom, height in itertools.product(BACK, FREEDOMS, HEIGHTS):
        other = with_settings(search, replace(
            settings, freedom=freedom * settings.freedom, body_height=height * settings.body_height,
        ))  # fmt: skip
        found: Found = other.run(list(first.layers[: max(len(first.layers) - back, 1)]))
        print(f"{back} steps back, freedom {freedom:g}, height {height:g}: "
              f"{len(found.layers) - 1} steps", flush=True)  # fmt: skip
        if found.complete:
            return result_of(other, found, begin)
    return None


def main(arguments: Sequence[str] | None = None) -> int:
    """Go on from before the dead end, and walk what is found."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.planning.onward",
                                     description=__doc__.partition("\n")[0])  # fmt: skip
    parser.add_argument("walk", help="robot/ground/seed/difficulty, over 3 m")
    parser.add_argument("--step", type=float, default=0.5, help="share of the usual step")
    parser.add_argument("--stance", type=float, default=0.7, help="share of the usual stance")
    options = parser.parse_args(arguments)
    walk = Refused(*options.walk.split("/"))
    robot = gaitopt.load_robot(walk.robot)
    ground = gaitopt.make_ground(walk.terrain, seed=int(walk.seed), robot=robot,
                                 difficulty=float(walk.difficulty), length=walk.length)  # fmt: skip
    usual = TerrainSettings.for_robot(robot)
    settings = replace(usual, step_length=options.step * usual.step_length, stance=options.stance,
                       width_limit=WIDEST)  # fmt: skip
    goal, begin = (walk.length, 0.0), time.process_time()
    found = way_on(search_for(robot, ground, goal, START, settings))
    print(f"search: {time.process_time() - begin:.1f} s of processor time")
    if found is None:
        print("no way was found")
        return 1
    plan = gaitopt.plan_terrain(robot, ground, goal, start=START, search=found)
    print(f"walk of {plan.duration:.1f} s: {gaitopt.verify(plan).outcome}", flush=True)
    print(f"in physics: {'passed' if gaitopt.simulate(plan).passed else 'not passed'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
