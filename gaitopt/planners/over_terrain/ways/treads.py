"""Ways of walking whose steps fit the treads of stairs: every foot stands alike on every tread.

With a step of half a tread each foot lands twice on each tread, always at the same two distances
from its edges. If front and hind feet are a whole number of steps apart, this holds for all legs at
once, and one cycle that is possible leads up all of the stairs. Usual steps drift over the treads
instead, until feet come to where a leg does not reach, or are too near to an edge.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray, frozen
from gaitopt.planners.over_terrain.course import SPACING, Course
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import with_settings
from gaitopt.terrain.height_map import HeightMap

LEAST_RISER = 0.15
"""Least height of a riser, in standing heights: lower ones need no care."""
RISER_DEPTH = 0.05
"""Depth along the course in which a riser rises [m]: two cells of the usual maps, and some more."""
LEAST_EDGES = 3
"""Edges that make stairs: two treads of the same depth."""
UNEVEN = 0.15
"""By how much the treads of the same stairs may differ in depth, and how far an edge may be from
where the other side of the robot meets it, in treads."""
STRAIGHT = 0.1
"""How far the body may turn on stairs, and face aside of its way [rad]."""
DEEPEST = 3.0
"""Depth of the deepest tread that steps are fitted to, in usual steps: on deeper ones usual steps
have room for all feet."""
LEAST_PARTS = 2
"""Steps to a tread, at least: with one, all feet would rise by a whole riser in each cycle. Chosen:
anymal_c and hyq find no way with one on treads that are as deep as their usual steps."""
WHOLE = 0.05
"""By what a step may be longer than the usual one, as a share."""
FITS = ((0.22, 0.75), (0.35, 1.0), (0.1, 0.75), (0.45, 0.75))
"""How far from the lower edge of a tread feet land first, in steps, and the stance, before it is
rounded to a whole number of steps. Chosen: of places 0.05 to 0.2 apart wang2020 goes up its steep
stairs without a dead end from 0.1 and from 0.2 to 0.24, anymal_c from 0.17 to 0.5, both with the
short stance; hyq from 0.3 to 0.4 with the long one; go2 from any with either. On the way down the
same places are reached from above."""
HIGH = 0.35
"""Height of risers, in standing heights, from which on fitted steps with a short stance are tried
before anything else. Chosen: with risers of 0.42 ways over stairs are found sooner so for go2,
anymal_c and wang2020; go2 walks over them in less time, anymal_c in more (docs/terrain.md). hyq
with risers of 0.26 needs its usual stance, if any of this."""


@dataclass(frozen=True)
class Stairs:
    """Edges of equal treads along a course.

    Attributes:
        first, last: where the first and the last edge are, in progress of the course [m].
        tread: distance of neighbouring edges [m].
        riser: mean height of an edge [m].
        up: whether they go up.
        turned: whether the body goes backward over them.
    """

    first: float
    last: float
    tread: float
    riser: float
    up: bool
    turned: bool


@dataclass(frozen=True, eq=False)
class FittedWay:
    """A way of walking that fits some stairs.

    Attributes:
        settings: of the search.
        course: with its cycles.
        high: whether risers are so high that usual steps rarely lead over them.
    """

    settings: TerrainSettings
    course: Course
    high: bool


def fitted_ways(search: Search, asked: Mapping[str, Any]) -> tuple[FittedWay, ...]:
    """Ways of walking that fit the stairs along the course of a search; none where there are none.

    Args:
        search: with the usual settings.
        asked: settings by name that were given; a step that was asked for is not changed.
    """
    course, usual = search.course, search.judge.settings
    if asked.get("step_length") is not None:
        return ()
    aside = float(np.abs(search.judge.usual_feet[:, 1]).mean())
    height = search.judge.robot.standing_height
    ground = search.judge.surfaces.ground
    stairs = [
        some for some in stairs_along(ground, course, aside, LEAST_RISER * height)
        if some.tread <= DEEPEST * usual.step_length
    ]  # fmt: skip
    if not stairs:
        return ()
    parts = np.ceil(stairs[0].tread / usual.step_length / (1.0 + WHOLE))
    step = round(stairs[0].tread / max(int(parts), LEAST_PARTS), 4)
    front, hind = _ends(search.judge.hips[:, 0])
    if 2.0 * (front - hind) < step:
        # Front and hind feet would be a step apart only with twice the usual stance.
        return ()
    high = max(some.riser for some in stairs) >= HIGH * height
    ways = []
    for phase, stance in FITS if high else sorted(FITS, key=lambda fit: -fit[1]):
        if asked.get("stance") is None:
            own = replace(usual, step_length=step, stance=_whole_stance(search, stance, step))
        else:
            own = replace(usual, step_length=step)
        feet = with_settings(search, own).judge.usual_feet[:, 0]
        marks = _marks(course.length, stairs, step, phase, feet)
        ways.append(FittedWay(own, replace(course, marks=frozen(marks)), high))
    return tuple(ways)


def stairs_along(ground: HeightMap, course: Course, aside: float, riser: float) -> list[Stairs]:
    """The stairs that a course leads over straight ahead or backward, in their order.

    Args:
        ground: the map.
        course: where the body goes.
        aside: distance of the feet from the course [m]; both sides have to meet the same edges.
        riser: least height of a riser [m].
    """
    sides = [_edges(ground, course, sign * aside, riser) for sign in (-1.0, 1.0)]
    (one, rise), (other, also) = sides
    if len(one) != len(other) or (np.sign(rise) != np.sign(also)).any():
        return []
    edges, up, found, begin = (one + other) / 2.0, rise > 0.0, [], 0
    for end in range(1, len(edges) + 1):
        if end < len(edges) and _goes_on(edges[begin : end + 1], up[begin : end + 1]):
            continue
        some = edges[begin:end]
        tread = float(some[-1] - some[0]) / max(len(some) - 1, 1)
        skew = float(np.abs(one[begin:end] - other[begin:end]).max())
        ahead = _heading(course, float(some[0]), float(some[-1]))
        if len(some) >= LEAST_EDGES and skew <= UNEVEN * tread and ahead:
            ends, high = (float(some[0]), float(some[-1])), float(np.abs(rise[begin:end]).mean())
            found.append(Stairs(*ends, tread, high, bool(up[begin]), ahead < 0))
        begin = end
    return found


def _edges(
    ground: HeightMap, course: Course, aside: float, riser: float
) -> tuple[FloatArray, FloatArray]:
    """Where a line beside the course meets risers ``(n,)`` [m], and how much each rises [m]."""
    count = max(int(np.ceil(course.length / SPACING)), 1)
    along = np.linspace(0.0, course.length, count + 1)
    poses = course.at(along)
    left = np.column_stack([-np.sin(poses[:, 2]), np.cos(poses[:, 2])])
    z = ground.height(poses[:, :2] + aside * left)
    half = max(round(RISER_DEPTH / 2.0 / (course.length / count)), 1)
    rise = np.zeros(len(z))
    rise[half:-half] = np.nan_to_num(z[2 * half :] - z[: -2 * half]) if len(z) > 2 * half else 0.0
    steep = np.abs(rise) >= riser
    ends = np.flatnonzero(np.diff(np.concatenate([[False], steep, [False]]).astype(int)))
    pairs = ends.reshape(-1, 2)
    middle = np.array([(along[a] + along[b - 1]) / 2.0 for a, b in pairs])
    most = np.array([rise[a:b][np.abs(rise[a:b]).argmax()] for a, b in pairs])
    return middle.reshape(-1), most.reshape(-1)


def _goes_on(edges: FloatArray, up: np.ndarray) -> bool:
    """Whether the last of some edges belongs to the same stairs as those before it."""
    if up[-1] != up[0]:
        return False
    treads = np.diff(edges)
    return bool(np.ptp(treads) <= UNEVEN * treads.mean())


def _heading(course: Course, first: float, last: float) -> int:
    """1 where the body faces along its straight way between two places, -1 where it goes backward.

    It is 0 where it turns, or faces aside of its way.
    """
    poses = course.at(np.linspace(first, last, 9))
    moves = np.diff(poses[:, :2], axis=0)
    if (np.linalg.norm(moves, axis=1) <= 0.0).any() or np.ptp(poses[:, 2]) > STRAIGHT:
        return 0
    aside = np.arctan2(moves[:, 1], moves[:, 0]) - poses[1:, 2]
    ahead, off = np.cos(aside), np.abs(np.sin(aside))
    if off.max() > STRAIGHT:
        return 0
    return 1 if ahead.min() > 0.0 else -1


def _whole_stance(search: Search, share: float, step: float) -> float:
    """A stance near to a share of the usual one, with front and hind feet whole steps apart."""
    front, hind = _ends(search.judge.usual_feet[:, 0])
    length = (front - hind) / search.judge.settings.stance
    return round(max(round(share * length / step), 1) * step / length, 4)


def _ends(ahead: FloatArray) -> tuple[float, float]:
    """How far front and hind feet are ahead of the body centre [m], from those of four legs."""
    # The base of some robots is ahead of all hips, or behind them.
    hind, front = np.sort(ahead).reshape(2, 2).mean(axis=1)
    return float(front), float(hind)


def _marks(
    length: float, stairs: Sequence[Stairs], step: float, phase: float, feet: FloatArray
) -> FloatArray:
    """Progress at the ends of all cycles, with that at the start ``(cycles + 1,)`` [m].

    Where feet are on stairs, cycles end where the feet fit the treads; between stairs, and before
    and after them, cycles share the way evenly.

    Args:
        length: of the course [m].
        stairs: along it.
        step: that fits the treads of the first ones; elsewhere steps are no longer [m].
        phase: distance of footholds from the lower end of a tread, in steps.
        feet: how far each foot is ahead of the body centre ``(4,)`` [m].
    """
    front, hind = _ends(feet)
    fitted = [0.0]
    for some in stairs:
        ahead, behind = (-hind, -front) if some.turned else (front, hind)
        own = some.tread / max(round(some.tread / step), 1)
        offset = (phase if some.up else 1.0 - phase) * own
        begin = max(some.first - ahead - own, fitted[-1] + own / 2.0)
        end = min(some.last - behind + own, length - own / 2.0)
        start = some.first + offset - ahead
        start += own * np.ceil((begin - start) / own)
        fitted += np.arange(start, end + 1e-9, own).tolist()
    marks = [0.0]
    for place in [*fitted[1:], length]:
        way = place - marks[-1]
        count = max(int(np.ceil(way / step / (1.0 + WHOLE))), 1)
        marks += [marks[-1] + way * (k + 1) / count for k in range(count)]
    return np.array(marks)
