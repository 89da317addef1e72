"""The margin of the centre of mass on smooth walks: all of it is kept, and little more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.smooth.between import (
    with_body_moved_inward,
    with_corrected_margins,
)
from gaitopt.planners.time_optimal.smooth.build import build_smooth
from gaitopt.planners.time_optimal.smooth.guess import rough_guess
from gaitopt.planners.time_optimal.smooth.rounds import FoundMotion, best_motion
from gaitopt.planners.time_optimal.smooth.window import SmoothWindow
from gaitopt.planners.time_optimal.walk import prepare_route


@pytest.fixture(scope="module")
def walk(wang: gaitopt.Quadruped) -> tuple[SmoothWindow, FoundMotion]:
    """Four steps along splines with a level body, before they are timed by forces."""
    settings = gaitopt.RouteSettings.for_robot(wang, free="swing", stability_margin=0.02)
    route = prepare_route(wang, gaitopt.s_columns(0, columns=2, robot=wang), settings)
    knots, base = build_route(route)
    problem = build_smooth(base, knots, route)
    poses, spans = rough_guess(route, problem.time_unit)
    window = SmoothWindow.whole(route, replace(problem, poses=poses), knots, spans)
    return window, best_motion(window)[0]


def test_a_walk_keeps_its_margin_and_little_more(walk: tuple[SmoothWindow, FoundMotion]) -> None:
    """Control points keep more of it than the motion between them: rows are lowered by that."""
    window, found = walk
    motion = found.motion
    beyond = motion.margins(dynamic=False) - window.wanted_margins(motion)
    assert beyond.min() >= 0.0
    least = [beyond[a : b + 1].min() for a, b in motion.knots.flights]
    assert np.median(least) <= 2e-4


def test_rows_change_by_what_the_motion_has_too_much(
    walk: tuple[SmoothWindow, FoundMotion],
) -> None:
    """Rows that hold the motion are lowered; in later rounds none is."""
    window, found = walk
    problem, motion = found.solutions[-1].problem, found.motion
    assert problem.com is not None
    before = problem.com.offset
    lower = with_corrected_margins(problem, window, motion, only_upward=False).com
    same = with_corrected_margins(problem, window, motion, only_upward=True).com
    assert lower is not None and same is not None
    assert (lower.offset <= before).all() and (same.offset == before).all()


def test_a_margin_that_misses_a_little_is_mended(walk: tuple[SmoothWindow, FoundMotion]) -> None:
    """The body moves inward by what is missing; where much is missing nothing is changed."""
    window, found = walk
    problem = found.solutions[-1].problem
    motion = with_body_moved_inward(problem, window, found.motion)
    assert np.abs(motion.poses - found.motion.poses).max() <= 1e-4
    more = replace(window.route.settings, stability_margin=0.02 + 5e-5)
    stricter = replace(window, route=replace(window.route, settings=more))
    mended = with_body_moved_inward(problem, stricter, found.motion)
    first = window.knots.phase_ends[1]
    wanted = stricter.wanted_margins(mended)[first:]
    assert (mended.margins(dynamic=False)[first:] >= wanted - 1e-9).all()
    assert np.abs(mended.poses - found.motion.poses).max() <= 1e-3
    far = replace(window.route.settings, stability_margin=0.021)
    much = replace(window, route=replace(window.route, settings=far))
    assert with_body_moved_inward(problem, much, found.motion) is found.motion


def test_a_margin_is_kept_between_the_samples_of_the_planner() -> None:
    """With nothing kept for what lies between them 6 um of the margin were missing in this walk."""
    wang = gaitopt.load_robot("wang2020")
    columns = gaitopt.s_columns(9, columns=5, robot=wang)
    plan = gaitopt.plan_crawl(wang, columns, objective="time", free="height")
    certificate = gaitopt.verify(plan, collisions=False)
    assert certificate["margin of the true COM"].status == "ok"
