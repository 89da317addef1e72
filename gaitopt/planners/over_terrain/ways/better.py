"""A better walk than the first one, where there is time for it."""

from __future__ import annotations

import time
from dataclasses import replace

from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.setup import first_layer, result_of, with_settings


def better(search: Search, best: TerrainSearch, begin: float, clock: float) -> TerrainSearch:
    """The cheapest walk that ever wider beams find until the time is over."""
    until = clock + best.settings.time_budget
    search = replace(search, course=best.course)
    settings, limit = best.settings, search.judge.settings.width_limit
    while time.thread_time() < until:
        settings = replace(settings, width=2 * settings.width)
        if settings.width > limit:
            break
        wider = with_settings(search, settings)
        found = wider.run([first_layer(wider)], until=until)
        if found.complete and float(found.layers[-1].cost.min()) < best.cost:
            best = result_of(wider, found, begin)
    return best
