"""Searches for footholds, ever wider ones, with ways of walking that are tried one after the other.

A way of walking is a length of the steps and a length of the stance. Short steps go up and down
high stairs. A short stance goes up steep ones: a body that is pitched by the slope has its hips
nearer to one another, as seen from above, and its hind feet would stay behind out of reach.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray, Progress
from gaitopt.errors import InputError
from gaitopt.planners.over_terrain.beam.ending import Ending
from gaitopt.planners.over_terrain.course import Course
from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import EXHAUSTIVE_TIMES, TerrainSettings
from gaitopt.planners.over_terrain.setup import along, first_layer, result_of, with_settings
from gaitopt.planners.over_terrain.states import Found, Layer
from gaitopt.planners.over_terrain.ways.better import better
from gaitopt.planners.over_terrain.ways.kinds import PATIENT
from gaitopt.planners.over_terrain.ways.outcomes import (
    ended_of,
    farthest_of_each,
    pitched,
    spread_of,
    walks,
    way_of,
)
from gaitopt.planners.over_terrain.ways.room_at_ends import no_room_at_ends
from gaitopt.planners.over_terrain.ways.room_to_stand import no_room
from gaitopt.planners.over_terrain.ways.treads import FittedWay

UPHILL = 0.35
"""Pitch of the body at a dead end, nose up, from which on short stances are tried first [rad].
Chosen: stairs that need them have slopes of 0.5 and more, and on the way down they rarely help."""
NARROW = 4
"""Widest beam with which all ways are tried before a wider one, in widths of the first."""
ASIDE = (-0.25, 0.25, -0.5, 0.5)
"""How far beside the course other ways lead, in standing heights. Chosen: wang2020 crosses rubble
and stones there on which every way along the course ended (docs/terrain_table.md)."""
OVER = 1.25
"""Way over which the course leads there, in standing heights."""
SAME = 5e-3
"""Ground whose height differs by no more than this counts as the same [m]."""
SOON = 2
"""Ways of walking, from the first one on, that are tried beside the course before others are tried
along it. Chosen: of 13 grounds on which a search took more than 3 s a metre, eight are crossed
beside the course with the usual steps, and four with the next shorter ones."""
FINE_TIMES = 2.0
"""Time of a search that looks as finely as there is a way to, in times of one. Chosen: hyq finds a
way over 3 m of stones in 12 s, on which all usual ones end within a step of one another."""
FREER_ON, BACK_ON = 1.75, (12, 24)
"""Freedom of the steps, in times of what it was, with which a search goes on from before its dead
end, and from how many steps before. Chosen: anymal_c crosses a valley so (hills of seed 25,
docs/terrain_table.md), and not with the same freedom from the start on."""
ONWARD = 3
"""Other searches that go on so: those that got farthest."""
LAST = 0.2
"""Share of the time of all searches that is kept for those that go on so. Chosen: the way over that
valley takes 10 of the 16 s that this leaves over 3 m."""


class Tries:
    """The searches that are made one after the other until one reaches the goal.

    It remembers where it stopped: after one that reached the goal it can go on.

    Args:
        search: with the usual settings.
        ways: settings of the ways of walking, in the order in which they are tried.
        fitted: ways of walking that fit stairs along the course, which are tried first.
        progress: called with (steps done, steps in all) of the search that is made.
        began: times at which work on the first search began, by ``time.perf_counter`` and
            ``time.thread_time`` [s]; now, where they are not given.
    """

    def __init__(
        self, search: Search, ways: Sequence[TerrainSettings], fitted: Sequence[FittedWay] = (),
        progress: Progress | None = None, began: tuple[float, float] | None = None,
    ) -> None:  # fmt: skip
        self.search, self.ways, self.fitted = search, tuple(ways), tuple(fitted)
        self.progress = progress
        self.begin, self.clock = began or (time.perf_counter(), time.thread_time())
        self.end = self.clock + search.judge.settings.longest_in_all(search.course.length)
        """Processor time at which the last search ends, by ``time.thread_time`` [s]."""
        self._begun = False
        """Whether a search was made, so that one without stands at its start is left out."""
        self._failed: list[TerrainSearch] = []
        self._ends: list[tuple[Search, Found]] = []
        """Searches that did not reach the goal, with what they found."""
        # Who asks for narrow beams asks for a quick answer.
        self.quick = search.judge.settings.width_limit < TerrainSettings.width_limit
        self._kept = 0.0 if self.quick else LAST * (self.end - self.clock)
        """Time before the end at which searches from the start end, for those that go on [s]."""
        self._cut = False
        """Whether a search was not made, because the time for it was over."""
        self._rest = self._one_by_one(self._failed)

    def result(self) -> TerrainSearch:
        """The first that reaches the goal, or the one that gets farthest."""
        none = self._no_room_at_ends()
        if none is not None:
            return none
        found = self.next_way()
        if found is not None:
            return better(self.search, found, self.begin, self.clock)
        tried = self._failed
        # Of those that got as far, the last one looked most.
        farthest = max(reversed(tried), key=lambda found: found.share)
        ended = ended_of(tried)
        if self.wall is not None and not self.search.judge.settings.exhaustive:
            ended = Ending.WALLED
        if ended is Ending.EXHAUSTED and (self._cut or time.thread_time() >= self.end):
            ended = Ending.TIME
        ways = len({way_of(found) for found in tried})
        return replace(farthest, ended=ended, wall=self.wall, ways=ways, spread=spread_of(tried))

    def next_way(self, end: float | None = None) -> TerrainSearch | None:
        """The next search that reaches the goal; ``None`` where no further one does.

        Args:
            end: processor time at which the last search ends, where it is another than at first.
        """
        self.end = self.end if end is None else end
        for found in self._rest:
            if found.complete:
                return found
            self._failed.append(found)
        return None

    def _no_room_at_ends(self) -> TerrainSearch | None:
        """What is found where the body cannot stand at the goal or start: nothing is searched."""
        aside = max(ASIDE) * self.search.judge.robot.standing_height
        none = no_room_at_ends(self.search, self.ways, aside)
        if none is None:
            return None
        ended, causes = none
        first, width = first_layer(self.search), self.search.judge.settings.width
        tried = np.empty(0, dtype=int)
        found = Found((first,), 4 * self.search.cycles, causes, tried, width, 0, ended)
        return result_of(self.search, found, self.begin)

    @cached_property
    def wall(self) -> FloatArray | None:
        """Where no pose of the body stands and no way round is seen ``(2,)`` [m]; or ``None``."""
        search, course = self.search, self.search.course
        return no_room(search.judge, search.stands, course) if course.blocked else None

    def _one_by_one(self, tried: list[TerrainSearch]) -> Iterator[TerrainSearch]:
        """What one search after the other finds, until the time is over.

        Args:
            tried: what those before found, which did not reach the goal.
        """
        usual = self.search.judge.settings
        once = usual.longest(self.search.course.length)
        narrow = min(usual.width_limit, NARROW * usual.width)
        # In an exhaustive search, too, what the usual one finds is found.
        first = once / EXHAUSTIVE_TIMES if usual.exhaustive else once
        # Most ways that get there meet no dead end.
        least, most = min(usual.width, narrow), first / 2.0
        if self.fitted and not self.fitted[0].high:
            yield from self._in_turn(self.ways[:1], least, False, most, tried)
        yield from self._on_treads(least, most)
        aside = not self.quick and not self.fitted and self._other_ground_beside
        soon = self.ways[: SOON if aside else 1]
        for way in soon:
            yield from self._in_turn([way], least if aside else narrow, False, most, tried)
            if self.wall is not None and not usual.exhaustive:
                return
            yield from self._beside([way] if aside else [], most)
        yield from self._in_turn(self.ways[len(soon) :], least, False, most, tried)
        far = [found.settings for found in farthest_of_each(tried) if not walks(found, soon)]
        yield from self._beside(far if aside else [], most)
        if narrow > least:
            yield from self._on_treads(narrow, most)
            yield from self._in_turn(
                self.ways if aside else self.ways[1:], narrow, False, most, tried
            )
        if usual.width_limit == narrow:
            return
        if usual.exhaustive:
            yield from self._in_turn(self.ways, narrow, True, once, tried)
        # Those that got farthest may pass with a finer look, or with a wider beam.
        farthest = farthest_of_each(tried)
        fine = [(near, True, narrow) for near in farthest if not (self.quick or usual.exhaustive)]
        wide = [(near, usual.exhaustive, usual.width_limit) for near in farthest]
        for near, finely, width in fine + wide:
            searching = self._searching(replace(near.settings, width_limit=width), finely)
            if near.course.marks is not None:
                searching = along(searching, near.course)
            yield from self._found(searching, FINE_TIMES * once if finely else once)
        if not self.quick:
            yield from self._onward(narrow, most)

    def _in_turn(
        self, ways: Sequence[TerrainSettings], width: int, fine: bool, most: float,
        tried: Sequence[TerrainSearch],
    ) -> Iterator[TerrainSearch]:  # fmt: skip
        """Searches with narrow beams, one way of walking after the other.

        Args:
            ways: of walking.
            width: of the widest beam.
            fine: whether steps are looked at as finely as there is a way to.
            most: processor time of each [s].
            tried: what those before found.
        """
        left = list(ways)
        while left:
            if any(pitched(found) > UPHILL for found in tried):
                usual = self.search.judge.settings.stance
                left.sort(key=lambda way: way.stance == usual)
            searching = self._searching(replace(left.pop(0), width_limit=width), fine)
            yield from self._found(searching, most)

    def _on_treads(self, width: int, most: float) -> Iterator[TerrainSearch]:
        """Searches with steps that fit the treads of stairs, each as in :meth:`_in_turn`."""
        for way in self.fitted:
            searching = self._searching(replace(way.settings, width_limit=width), False)
            try:
                yield from self._found(along(searching, way.course), most)
            except InputError:
                # No stands near where its feet would be at the start: others have some.
                continue

    @cached_property
    def _courses_beside(self) -> list[Course]:
        height = self.search.judge.robot.standing_height
        return [self.search.course.beside(aside * height, OVER * height) for aside in ASIDE]

    @cached_property
    def _other_ground_beside(self) -> bool:
        """Whether the ground beside the course is another one; on stairs it is not."""
        ground, poses = self.search.judge.surfaces.ground, self.search.course.poses
        here = ground.height(poses[:, :2])
        there = [ground.height(course.poses[:, :2]) for course in self._courses_beside]
        # A comparison with NaN, which is unknown ground, is false.
        return any(not (np.abs(other - here) <= SAME).all() for other in there)

    def _beside(self, ways: Sequence[TerrainSettings], most: float) -> Iterator[TerrainSearch]:
        """Searches beside the course.

        Args:
            ways: of walking.
            most: processor time of each [s].
        """
        for way in ways:
            narrow = replace(way, width_limit=way.width)
            searching = self._searching(narrow, False)
            for course in self._courses_beside:
                yield from self._found(along(searching, course), most)

    def _onward(self, width: int, most: float) -> Iterator[TerrainSearch]:
        """Searches that go on from before dead ends, with more freedom of the steps.

        Args:
            width: of the widest beam.
            most: processor time of each [s].
        """
        self._kept = 0.0
        usual = self.ways[0]
        if usual.freedom != TerrainSettings.for_robot(self.search.judge.robot).freedom:
            # It was asked for.
            return
        before = len(self._ends)
        steps, stances = ({w.step_length for w in self.ways}, {w.stance for w in self.ways})
        # Where only one of either is tried, it was asked for.
        if len(steps) > 1 and len(stances) > 1:
            step, stance = round(PATIENT[0] * usual.step_length, 4), PATIENT[1]
            patient = replace(usual, step_length=step, stance=stance, width_limit=width)
            yield from self._found(self._searching(patient, False), most)
        latest = self._ends[before:]
        for searching, found in (
            latest + sorted(self._ends[:before], key=_share)[: -ONWARD - 1 : -1]
        ):
            settings = searching.judge.settings
            freer = replace(settings, freedom=FREER_ON * settings.freedom, width_limit=width)
            for back in BACK_ON:
                layers = found.layers[: max(len(found.layers) - back, 1)]
                yield from self._found(with_settings(searching, freer), most, layers)

    def _searching(self, settings: TerrainSettings, fine: bool) -> Search:
        return replace(with_settings(self.search, settings), fine=fine)

    def _found(
        self, searching: Search, most: float, layers: Sequence[Layer] = ()
    ) -> Iterator[TerrainSearch]:
        """One search, which may take ``most`` seconds; none where the time of all is over."""
        now, end = time.thread_time(), self.end - self._kept
        self._cut |= now >= end
        # The first one is made in any case: there is a result.
        if now >= end and self._begun:
            return
        try:
            begin = layers or [first_layer(searching)]
        except InputError:
            # No stands near where its feet would be at the start: those of others had some.
            if not self._begun:
                raise
            return
        self._begun = True
        found = searching.run(begin, self.progress, self.search.effort, min(now + most, end))
        if not found.complete:
            self._ends.append((searching, found))
        yield result_of(searching, found, self.begin)


def _share(end: tuple[Search, Found]) -> float:
    """Share of the steps to the goal that a search made."""
    return len(end[1].layers) / end[1].steps
