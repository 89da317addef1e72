"""What searches that did not reach the goal say together."""

from __future__ import annotations

from collections.abc import Sequence

from gaitopt.planners.over_terrain.beam.ending import Ending
from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.settings import TerrainSettings


def ended_of(tried: Sequence[TerrainSearch]) -> Ending:
    """What is open about searches that did not reach the goal, or that nothing is.

    One that ended with its time or tries is forgotten where a later one along the same course, in
    the same way of walking, at least as wide and as fine, came to its end.
    """
    ended = Ending.EXHAUSTED
    for k, found in enumerate(tried):
        if found.ended is Ending.EXHAUSTED or any(_covers(o, found) for o in tried[k + 1 :]):
            continue
        ended = found.ended if ended is not Ending.TIME else ended
    return ended


def _covers(later: TerrainSearch, found: TerrainSearch) -> bool:
    """Whether a later search came to its end, and looked at all that one before looked at."""
    same = later.course is found.course and way_of(later) == way_of(found)
    # One that went on with more freedom did not begin at the start.
    same &= later.settings.freedom == found.settings.freedom
    wider = later.settings.width_limit >= found.settings.width_limit
    return same and wider and later.fine >= found.fine and later.ended is Ending.EXHAUSTED


def farthest_of_each(tried: Sequence[TerrainSearch]) -> list[TerrainSearch]:
    """The farthest search of each way of walking, the way that got farthest first."""
    best: dict[tuple[float, float], TerrainSearch] = {}
    for found in tried:
        if way_of(found) not in best or found.share > best[way_of(found)].share:
            best[way_of(found)] = found
    return sorted(best.values(), key=lambda found: -found.share)


def way_of(found: TerrainSearch) -> tuple[float, float]:
    """The lengths of step [m] and stance of a search."""
    return found.settings.step_length, found.settings.stance


def spread_of(tried: Sequence[TerrainSearch]) -> float:
    """How far the ends of searches are from one another along the course [m]."""
    ends = [found.share * found.course.length for found in tried]
    return max(ends) - min(ends)


def walks(found: TerrainSearch, ways: Sequence[TerrainSettings]) -> bool:
    """Whether a search was one of some ways of walking."""
    return way_of(found) in {(way.step_length, way.stance) for way in ways}


def pitched(found: TerrainSearch) -> float:
    """How far the body is pitched at the end of what was found, nose up [rad]."""
    postures = found.footholds.postures
    return 0.0 if postures is None else -float(postures[-1, 2])
