"""The error of a search that finds no way, and what would help."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from gaitopt.errors import TerrainError
from gaitopt.planners.over_terrain.beam.ending import Ending
from gaitopt.planners.over_terrain.pairs import Cause
from gaitopt.planners.over_terrain.result import TerrainSearch

_CURES = {
    Cause.APART: "another start or goal",
    Cause.MARGIN: "a smaller stability_margin",
    Cause.REACH: "shorter steps (step_length), a larger reach_fraction, or another body_height",
    Cause.SWING: "a smaller clearance or swing_height, or another body_height",
    Cause.ROLL: "shorter steps (step_length), or another body_height",
    Cause.LIMB: "a smaller limb_clearance, or a larger body_height",
    Cause.TRUNK: "a smaller limb_clearance, or a larger body_height",
    Cause.TOUCH: "shorter steps (step_length), a smaller freedom, or another body_height",
    Cause.FORCE: "lower reserves of forces, more friction, shorter steps (step_length), or a "
    "smaller follow",
    Cause.GROUND: "a larger freedom, a smaller edge_margin, or another way round (waypoints)",
    Cause.PLAN: "a smaller stability_margin, or lower reserves of forces",
}

TOLD = 2
"""Causes that an error tells; all of them are in its ``refused``."""
NEAR_EDGE = 1.4
"""Distance from the map's edge within which trunk and limbs may come above unknown ground, in body
heights. Chosen: half of the trunk's length of all robots that were tried is less."""


def no_way(search: TerrainSearch, detail: str = "") -> TerrainError:
    """The error for a search that did not reach the goal.

    Args:
        search: the search.
        detail: what the planner of the walk said last, if anything.
    """
    if search.ended in (Ending.NO_GOAL, Ending.NO_START):
        return _no_room(search)
    step = search.footholds.steps
    share = step / max(search.steps, 1)
    where = np.round(search.course.at(search.course.length * share)[:2], 2).tolist()
    words = [
        f"no way over the ground was found: after {step} of {search.steps} steps the next one "
        f"({search.next_leg}) is not possible, {share:.0%} of the way, with the body near {where}"
    ]
    causes = in_order(search.refused)
    if causes:
        total = sum(count for _, count in causes)
        most = "; ".join(f"{cause} ({count} of {total} tries)" for cause, count in causes[:TOLD])
        words.append(f"why: {most}")
    if detail:
        words.append(detail)
    if search.ways > 1:
        words.append(
            f"{search.ways} ways of walking were tried, which ended within "
            f"{search.spread:.2f} m of one another"
        )
    if search.wall is not None:
        words.append(
            f"no way round is seen on the map, and at {np.round(search.wall, 2).tolist()} none of "
            "the poses of the body that were tried stands"
        )
    if search.late:
        words.append(_time_over(search))
    elif search.ended is Ending.TRIES:
        words.append("the search ended because its tries were used up, so there may be a way")
    worst = causes[0][0] if causes else Cause.GROUND
    if worst in (Cause.LIMB, Cause.TRUNK):
        words += _edge_near(search, share) + _holes_near(search, share)
    words.append(f"what may help: {_cure(search, worst)}")
    return TerrainError("; ".join(words), step, search.next_leg, dict(search.refused), search)


def _no_room(search: TerrainSearch) -> TerrainError:
    """The error where nothing was searched, since the body cannot stand at an end of the way."""
    start = search.ended is Ending.NO_START
    where = "start" if start else "goal"
    x, y = search.course.poses[0 if start else -1, :2]
    share, far = (0.0 if start else 1.0), NEAR_EDGE * search.settings.body_height
    (x0, x1), (y0, y1) = search.layers.ground.extent
    gap = min(x - x0, x1 - x, y - y0, y1 - y)
    words = [
        f"the robot cannot stand at the {where} ({x:.4g}, {y:.4g}), so nothing was searched",
        "why: " + " or ".join(str(cause) for cause, _ in in_order(search.refused)),
    ]
    words += _edge_near(search, share) + _holes_near(search, share)
    if gap < far:
        words.append(f"move the {where} by {far - gap:.2f} m away from the edge")
    else:
        words.append(f"move the {where} to known ground with room for the robot")
    return TerrainError("; ".join(words), 0, search.next_leg, dict(search.refused), search)


def _cure(search: TerrainSearch, worst: Cause) -> str:
    """What may help where a cause refused most."""
    if search.wall is not None:
        return f"another goal or start, or a way round on a larger map; or {_CURES[worst]}"
    further = "a finer and wider search (exhaustive)"
    if search.settings.exhaustive:
        further = "another goal or start, or more time (time_limit)"
    return f"{_CURES[worst]}; or {further}"


def no_plan(
    search: TerrainSearch, step: int, detail: str, plans: int, late: bool = False
) -> TerrainError:
    """The error where footholds were found again and again, and the walk over them refused.

    Args:
        search: the last search, which reached the goal.
        step: that was refused last; -1 where the planner did not say which.
        detail: why.
        plans: how many walks were refused.
        late: whether the time was over before another way was found.
    """
    leg = search.order[step] if step >= 0 else ""
    # Counted from 0, as the planner's own words do.
    where = f"step {step} ({leg})" if step >= 0 else "the whole of it"
    ended = f"{_time_over(search)}; " if late else ""
    message = (
        f"footholds to the goal were found ({search.steps} steps), and no walk over them: {where} "
        f"was refused last, of {plans} in all; {detail}; {ended}what may help: "
        f"{_CURES[Cause.PLAN]}, another body_height, or shorter steps (step_length)"
    )
    return TerrainError(message, step, leg, {Cause.PLAN: plans}, search)


def also_tried(error: TerrainError, lengths: Sequence[float], others: int) -> TerrainError:
    """The error of a walk over a way that was found, where nothing else helped either.

    Args:
        error: of the walk.
        lengths: shorter steps that were tried along the same course [m].
        others: walks that were tried over other ways.
    """
    message = str(error)
    if lengths:
        steps = " and ".join(f"{length:g}" for length in lengths)
        message += f"; steps of {steps} m were tried, too"
    if others:
        message += f"; so were {others} other way{'s' if others > 1 else ''} to the goal"
    return TerrainError(message, error.step, error.leg, dict(error.refused), error.search)


def _edge_near(search: TerrainSearch, share: float) -> list[str]:
    """What is said where the map's edge is near the body, at a share of the way."""
    x, y = search.course.at(search.course.length * share)[:2]
    (x0, x1), (y0, y1) = search.layers.ground.extent
    gap = min(x - x0, x1 - x, y - y0, y1 - y)
    if gap >= NEAR_EDGE * search.settings.body_height:
        return []
    return [
        f"the map's edge is {gap:.2f} m from the body, and nothing may be beyond it: a larger map "
        "may help"
    ]


def _holes_near(search: TerrainSearch, share: float) -> list[str]:
    """What is said where points of the map near the body are unknown, at a share of the way."""
    ground, far = search.layers.ground, NEAR_EDGE * search.settings.body_height
    x, y = search.course.at(search.course.length * share)[:2]
    near = np.ix_(np.abs(ground.x - x) <= far, np.abs(ground.y - y) <= far)
    count = int((~ground.known[near]).sum())
    if not count:
        return []
    return [
        f"the map is unknown at {count} of its points within {far:.2f} m of the body, and nothing "
        "may be above them: heights can be put there (filled)"
    ]


def _time_over(search: TerrainSearch) -> str:
    longest = search.settings.longest_in_all(search.course.length)
    return (
        f"the search ended because its time was over, {longest:.3g} s, so there may be a way "
        "(time_limit)"
    )


def in_order(refused: Mapping[Cause, int]) -> list[tuple[Cause, int]]:
    """Causes that refused something, the most frequent first."""
    return sorted(((c, n) for c, n in refused.items() if n), key=lambda pair: -pair[1])
