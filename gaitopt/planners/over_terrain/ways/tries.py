"""Searches for footholds, ever wider ones, with ways of walking that are tried one after the other.

A way of walking is a length of the steps and a length of the stance. Short steps go up and down
high stairs. A short stance goes up steep ones: a body that is pitched by the slope has its hips
nearer to one another, as seen from above, and its hind feet would stay behind out of reach.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from gaitopt.conventions import Progress
from gaitopt.errors import InputError
from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import EXHAUSTIVE_TIMES, TerrainSettings
from gaitopt.planners.over_terrain.setup import first_layer, result_of, with_settings
from gaitopt.planners.over_terrain.states import Layer

STEP_SHARES = (1.0, 0.7, 0.5)
"""Lengths of steps that are tried one after the other where none is given, as shares of the usual
one. Shorter steps go up and down higher stairs, and take more time."""
SHORT_STANCES = ((0.7, 0.7), (0.8, 0.6), (0.5, 0.55))
"""Shares of the usual step and of the standing robot's stance that are tried after these, where no
stance is given. Chosen: with the first anymal_c goes up risers of 17 and 18 cm on treads of 28 cm,
and not with a stance of 0.85; with the last risers of 17 cm on treads of 25 cm; with the second
wang2020 crosses stones on which other ways end."""
FURTHER = ((0.85, 0.85), (0.35, 0.7), (1.2, 0.85))
"""The same, which only an exhaustive search tries besides."""
UPHILL = 0.35
"""Pitch of the body at a dead end, nose up, from which on short stances are tried first [rad].
Chosen: stairs that need them have slopes of 0.5 and more, and on the way down they rarely help."""
NARROW = 4
"""Widest beam with which all ways are tried before a wider one, in widths of the first."""
FINE_TIMES = 2.0
"""Time of a search that looks as finely as there is a way to, in times of one. Chosen: hyq finds a
way over 3 m of stones in 12 s, on which all usual ones end within a step of one another."""


@dataclass(frozen=True, eq=False)
class Tries:
    """The searches that are made one after the other until one reaches the goal.

    Attributes:
        search: with the usual settings.
        ways: settings of the ways of walking, in the order in which they are tried.
        progress: called with (steps done, steps in all) of the search that is made.
        begin: time at which the first one begins, by ``time.perf_counter`` [s].
        clock: the same in processor time, by ``time.thread_time`` [s].
    """

    search: Search
    ways: tuple[TerrainSettings, ...]
    progress: Progress | None
    begin: float
    clock: float

    def result(self) -> TerrainSearch:
        """The first that reaches the goal, or the one that gets farthest."""
        tried: list[TerrainSearch] = []
        for found in self._one_by_one(tried):
            if found.complete:
                return _better(self.search, found, self.begin, self.clock)
            tried.append(found)
        # Of those that got as far, the last one looked most.
        farthest = max(reversed(tried), key=lambda found: found.share)
        late = any(found.late for found in tried)
        return replace(farthest, late=late, ways=len({_way(found) for found in tried}),
                       spread=_spread(tried))  # fmt: skip

    def _one_by_one(self, tried: list[TerrainSearch]) -> Iterator[TerrainSearch]:
        """What one search after the other finds, until the time is over.

        Args:
            tried: what those before found, which did not reach the goal.
        """
        usual, course = self.search.judge.settings, self.search.course
        once, end = usual.longest(course.length), self.clock + usual.longest_in_all(course.length)
        narrow = min(usual.width_limit, NARROW * usual.width)
        blocked = course.blocked and not usual.exhaustive
        # A way may be there that the coarse grid does not show; no other stance makes one.
        ways = [w for w in self.ways if not (blocked and w.stance != usual.stance)]
        if usual.exhaustive:
            # What the usual search finds is found, too.
            yield from self._narrow(ways, narrow, False, once / 2.0 / EXHAUSTIVE_TIMES, end, tried)
        yield from self._narrow(ways, narrow, usual.exhaustive, once / 2.0, end, tried)
        if usual.width_limit == narrow or blocked:
            return
        # Those that got farthest may pass with a finer look, or with a wider beam.
        farthest = sorted(tried, key=lambda found: -found.share)
        # Who asks for narrow beams asks for a quick answer.
        coarse = usual.exhaustive or usual.width_limit < TerrainSettings.width_limit
        for near, fine, width in (
            *((near, True, narrow) for near in farthest if not coarse),
            *((near, near.fine, usual.width_limit) for near in farthest),
        ):
            if time.thread_time() >= end:
                return
            searching = self._searching(replace(near.settings, width_limit=width), fine)
            most = FINE_TIMES * once if fine else once
            yield self._found(searching, first_layer(searching), most, end)

    def _narrow(
        self, ways: Sequence[TerrainSettings], width: int, fine: bool, most: float, end: float,
        tried: Sequence[TerrainSearch],
    ) -> Iterator[TerrainSearch]:  # fmt: skip
        """Searches with narrow beams, one way of walking after the other.

        Args:
            ways: of walking.
            width: of the widest beam.
            fine: whether steps are looked at as finely as there is a way to.
            most: processor time of each [s].
            end: processor time at which the last one ends [s].
            tried: what those before found.
        """
        left = list(ways)
        while left:
            searching = self._searching(replace(left.pop(0), width_limit=width), fine)
            try:
                first = first_layer(searching)
            except InputError:
                if not tried:
                    raise
                continue
            found = self._found(searching, first, most, end)
            yield found
            if _pitched(found) > UPHILL:
                usual = self.search.judge.settings.stance
                left.sort(key=lambda way: way.stance == usual)

    def _searching(self, settings: TerrainSettings, fine: bool) -> Search:
        return replace(with_settings(self.search, settings), fine=fine)

    def _found(self, searching: Search, first: Layer, most: float, end: float) -> TerrainSearch:
        """One search, which may take ``most`` seconds and ends at a processor time [s]."""
        until = min(time.thread_time() + most, end)
        found = searching.run([first], self.progress, self.search.effort, until)
        return result_of(searching, found, self.begin)


def _way(found: TerrainSearch) -> tuple[float, float]:
    """The lengths of step [m] and stance of a search."""
    return found.settings.step_length, found.settings.stance


def _spread(tried: Sequence[TerrainSearch]) -> float:
    """How far the ends of searches are from one another along the course [m]."""
    ends = [found.share * found.course.length for found in tried]
    return max(ends) - min(ends)


def _pitched(found: TerrainSearch) -> float:
    """How far the body is pitched at the end of what was found, nose up [rad]."""
    postures = found.footholds.postures
    return 0.0 if postures is None else -float(postures[-1, 2])


def ways_of(usual: TerrainSettings, asked: Mapping[str, Any]) -> tuple[TerrainSettings, ...]:
    """Ways of walking to try one after the other; what was asked for stays.

    Args:
        usual: the settings of the first one.
        asked: settings by name that were given.
    """
    shares = STEP_SHARES if asked.get("step_length") is None else (1.0,)
    pairs = [(share, usual.stance) for share in shares]
    if asked.get("stance") is None:
        given = len(shares) == 1
        stances = SHORT_STANCES + (FURTHER if usual.exhaustive else ())
        pairs += [(1.0 if given else share, stance) for share, stance in stances]
    return tuple(
        replace(usual, step_length=round(share * usual.step_length, 4), stance=stance)
        for share, stance in pairs
    )


def shorter_steps(usual: float, settings: TerrainSettings, asked: Mapping[str, Any]) -> list[float]:
    """Shorter lengths of steps [m] than those of some settings, where none is asked for.

    Args:
        usual: length of the usual steps [m].
        settings: of a search.
        asked: settings by name that were given.
    """
    lengths = [round(share * usual, 4) for share in STEP_SHARES]
    if asked.get("step_length") is not None or settings.step_length not in lengths:
        return []
    return [length for length in lengths if length < settings.step_length]


def _better(search: Search, best: TerrainSearch, begin: float, clock: float) -> TerrainSearch:
    """The cheapest walk that ever wider beams find until the time is over."""
    until = clock + best.settings.time_budget
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
