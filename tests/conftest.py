"""Robots and plans that many tests share; loaded once."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from functools import cache

import pytest
from drawing import without_pixels
from hypothesis import HealthCheck, settings

import gaitopt
from gaitopt import Footholds, Plan, Quadruped

# On a loaded machine an example may take long, to be made or to be run: that is no fault of the
# code. Every run has the same examples, so that a change is blamed for nothing but itself; others,
# and more of them, are tried with `pytest --hypothesis-profile=random`.
PATIENT = {"deadline": None, "suppress_health_check": [HealthCheck.too_slow]}
settings.register_profile("same", **PATIENT, derandomize=True, max_examples=50)
settings.register_profile("random", **PATIENT, print_blob=True, max_examples=200)
settings.load_profile("same")


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Iterator[None]:
    """Collect tests without looking for objects that nobody needs.

    Eight thousand tests are a million objects that stay until the end. To look through them again
    and again took seven of the eighteen seconds in which they are collected, and later a second a
    time. In tests, too, it is looked less often than by itself: 3 % of their processor time went to
    it.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.set_threshold(20_000, 20, 20)
        gc.enable()


LONGEST = (
    "test_docs", "test_notebooks", "test_app", "test_verify", "test_simulate", "test_benchmarks",
    "test_plan_terrain", "test_plan_stride", "test_forces_in_physics", "test_gaits_with_forces",
    "test_explore_in_a_browser", "test_used_in_a_browser", "test_terrain_study", "test_interrupted",
    "test_terrain", "test_crawl", "test_plan_route", "test_flight", "test_race", "test_results",
    "test_free_order", "test_smooth_plans", "test_video", "test_ground", "test_replay",
    "test_race_in_a_browser", "test_explore", "test_gait_figures", "test_crawl_figures",
)  # fmt: skip
"""Modules that take longest; the order of the others does not matter."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Let the longest modules begin first: the last one keeps one worker busy, and the rest wait.

    By itself pytest-xdist begins with those of the most tests (``--no-loadscope-reorder``).
    """
    rank = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.path.stem, len(rank)))


@pytest.fixture(scope="module")
def no_pixels() -> Iterator[None]:
    """Figures are drawn up, but their files hold no pixels: those take most of the time.

    For tests that look at the names of files. What figures show is tested in ``tests/viewing``.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gaitopt.viewing.figures.files.pixels_of", without_pixels)
        yield


@pytest.fixture(scope="session")
def wang() -> Quadruped:
    return gaitopt.load_robot("wang2020")


@pytest.fixture(scope="session")
def columns() -> Footholds:
    return gaitopt.s_columns(0)


@pytest.fixture(scope="session")
def plan(wang: Quadruped, columns: Footholds) -> Plan:
    """The main job: the paper's method over the 64 steps of the first random terrain."""
    return gaitopt.plan_crawl(wang, columns, timing="velocity")


@pytest.fixture(scope="session")
def short_plan(wang: Quadruped) -> Plan:
    """Two cycles, eight steps."""
    return gaitopt.plan_crawl(wang, gaitopt.s_columns(3, columns=3), timing="velocity")


@pytest.fixture(scope="session")
def a1_walk() -> Plan:
    """Four steps of a1, as fast as forces allow."""
    robot = gaitopt.load_robot("a1")
    return gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot))


@pytest.fixture(scope="session")
def flying() -> Callable[[str], Plan]:
    """Short gaits whose body flies or pitches, by name: ``"trot"``, ``"pronk"``, ``"bound"``."""

    @cache
    def planned(name: str) -> Plan:
        robot, gait, asked = {
            "trot": (
                "go2",
                gaitopt.trot(0.5, 0.4),
                {"velocity": 0.5, "ramp": 0.4, "duration": 0.5},
            ),
            "pronk": ("a1", gaitopt.pronk(0.5), {"velocity": 0.2, "ramp": 0.5, "duration": 0.2}),
            "bound": ("a1", gaitopt.bound(0.3), {"velocity": 0.2, "ramp": 0.3, "duration": 0.2}),
        }[name]
        return gaitopt.plan_gait(gaitopt.load_robot(robot), gait, **asked)

    return planned
