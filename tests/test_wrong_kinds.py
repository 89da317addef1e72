"""What is no object of the right class is refused by a typed error, whatever function it is."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from enum import Enum
from functools import cache, partial
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt.errors import GaitoptError
from gaitopt.exporting.joint_order import joint_order


def takers() -> list[str]:
    """Public functions and classes that need an argument; enumerations have Python's own error."""
    found = []
    for name in gaitopt.__all__:
        value: Any = getattr(gaitopt, name)
        if not callable(value) or inspect.isabstract(value):
            continue
        if inspect.isclass(value) and issubclass(value, (BaseException, Enum)):
            continue
        if _needed(value):
            found.append(name)
    return found


def _needed(function: Callable[..., Any]) -> list[inspect.Parameter]:
    """The parameters that must be given."""
    parameters = inspect.signature(function).parameters.values()
    kinds = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    return [p for p in parameters if p.default is p.empty and p.kind not in kinds]


@pytest.mark.parametrize("value", ["walk", None])
@pytest.mark.parametrize("name", takers())
def test_a_text_or_nothing_in_place_of_every_argument(name: str, value: object) -> None:
    """Values that hold what they are given, and check nothing, are no error."""
    function: Any = getattr(gaitopt, name)
    alone = [p.name for p in _needed(function) if p.kind is not inspect.Parameter.KEYWORD_ONLY]
    named = [p.name for p in _needed(function) if p.kind is inspect.Parameter.KEYWORD_ONLY]
    try:
        function(*[value for _ in alone], **dict.fromkeys(named, value))
    except GaitoptError as error:
        assert str(error)


ROWS = np.full((4, 3), np.nan)
MASKED = np.ma.masked_array(np.zeros(3), [True, False, False])


class Evil:
    """What cannot even be shown."""

    def __repr__(self) -> str:
        raise RuntimeError


@cache
def calls() -> dict[str, Callable[[], object]]:
    """Calls with an array, or another thing that cannot be compared, where a text belongs."""
    robot = gaitopt.load_robot("wang2020")
    footholds = gaitopt.s_columns(0, columns=2, robot=robot)
    points = {leg: footholds[leg] for leg in gaitopt.LEGS}
    first = {leg: footholds[leg][0] for leg in gaitopt.LEGS}
    board = gaitopt.rectangular_obstacle(0.1, 0.1)
    curve = gaitopt.swing_curve("cycloid", np.zeros(3), np.ones(3), 0.1, 1.0)
    ground = gaitopt.HeightMap(np.zeros((4, 5)), 0.1)
    plan, route, stride = gaitopt.plan_crawl, gaitopt.plan_route, gaitopt.plan_stride
    state = partial(gaitopt.GaitStateMachine, gaitopt.trot(0.5), 2)
    cog = partial(gaitopt.build_cog_problem, robot, first, 0.4)
    return {
        "a text that is an array": lambda: plan(robot, footholds, timing=ROWS),
        "and of a route": lambda: route(robot, footholds, timing=ROWS),
        "and of a stride": lambda: stride(
            robot, gaitopt.rectangular_obstacle(0.03, 0.03), timing=ROWS
        ),
        "an objective that is an array": lambda: plan(robot, footholds, objective=ROWS),
        "legs that are numbers": lambda: plan(robot, footholds, sequence=ROWS),
        "freedoms in one number": lambda: route(robot, footholds, free=np.array(1.0)),
        "freedoms in a mapping": lambda: gaitopt.Freedoms.of({}),
        "a leg that is an array": lambda: state(first=ROWS),
        "a leg without a name": lambda: cog(np.zeros(2), swing="", foothold=first["LF"]),
        "a place that is a table": lambda: cog(ROWS),
        "a method that is an array": lambda: ground.filled(ROWS),
        "an order that is none": lambda: gaitopt.Footholds(points, order=True),
        "a delay beyond all floats": lambda: gaitopt.SimulationSettings(sensing_delay=2**2000),
        "a push that is none": lambda: gaitopt.SimulationSettings(pushes=(np.nan,)),
        "an error of columns that is none": lambda: gaitopt.SimulationSettings(
            column_errors=(np.nan,)
        ),
        "errors of columns in rows of numbers": lambda: gaitopt.SimulationSettings(
            column_errors=[np.full(3, np.nan)]
        ),
        "an angle beyond all floats": lambda: gaitopt.round_obstacle(0.03, yaw=2**2000),
        "an unknown objective": lambda: cog(np.zeros(2), objective="x" * 50),
        "freedoms that are no texts": lambda: gaitopt.Freedoms.of(np.zeros(0)),
        "terrains in one number": lambda: gaitopt.compare(robot, np.array(1.0)),
        "legs of a figure": lambda: gaitopt.plot_joint_curves(plan(robot, footholds), legs=ROWS),
        "legs that stand are an array": lambda: gaitopt.feasible_region(
            robot, np.array([first[leg] for leg in gaitopt.LEGS]), support=ROWS
        ),
        "times in a set": lambda: gaitopt.swing_events(gaitopt.trot(0.5), 2, {0.5, 0.6}),
        "a length beyond all numbers": lambda: gaitopt.s_columns(0, forward=2**70),
        "a name that no file has": lambda: gaitopt.load_ground("x" * 5000),
        "a foot at infinity": lambda: gaitopt.support_margin(
            np.full((4, 2), np.inf), [True] * 4, np.zeros(2)
        ),
        "a time that is none": lambda: curve.velocity(np.nan),
        "joints that are none": lambda: joint_order(("a",), joints=1e300),
        "an infinite angle": lambda: gaitopt.feet_from_joints(
            robot, np.zeros(3), np.full(3, np.inf), robot.standing_joints
        ),
        "a set as velocity": lambda: gaitopt.GaitSettings(velocity={0.1, 0.2}),
        "a text as velocity": lambda: gaitopt.GaitSettings(velocity="12"),
        "a span of time as number": lambda: gaitopt.trot(np.timedelta64(5, "s")),
        "numbers behind a mask": lambda: gaitopt.swing_curve(
            "cycloid", MASKED, np.ones(3), 0.1, 1.0
        ),
        "letters as numbers": lambda: curve.position(bytearray(b"ab")),
        "what cannot be shown": lambda: gaitopt.CrawlSettings(body_height=Evil()),
        "a path of no letters": lambda: plan(robot, footholds).save("a\ud800b"),
        "points of an obstacle": lambda: board.distance(["a", "b", "c"]),
        "places of an obstacle": lambda: board.height_at(1.0),
        "an obstacle of an array": lambda: gaitopt.Obstacle(ROWS, ((0.0, 0.1),), 0.1),
        "a robot that is none": lambda: gaitopt.CrawlSettings.for_robot({}),
        "footholds beyond the last": lambda: footholds.after(dict.fromkeys(points, 2), ()),
        "footholds from behind": lambda: footholds.after(dict.fromkeys(points, -1), ()),
        "a leg of no name": lambda: footholds[ROWS],
        "limits that are no pair": lambda: ground.cropped(x=0.1),
        "freedoms that are numbers": lambda: gaitopt.Freedoms(height=np.nan),
        "a file that is none": lambda: gaitopt.Quadruped.from_urdf(None),
        "a factor that is an array": lambda: plan(robot, footholds).phases[0].slowed(ROWS),
        "limits on forces in a list": lambda: gaitopt.ForceLimits.from_dict([1, 2]),
    }


@pytest.mark.parametrize("name", calls())
def test_what_is_no_text_or_no_list_is_refused(name: str) -> None:
    with pytest.raises(GaitoptError):
        calls()[name]()


def test_what_a_mask_hides_is_unknown_ground() -> None:
    heights = np.ma.masked_array(np.zeros((3, 4)), np.zeros((3, 4), np.bool_))
    heights[1, 1] = np.ma.masked
    ground = gaitopt.HeightMap(heights, 0.1)
    assert np.argwhere(~ground.known).tolist() == [[1, 1]]


def test_a_long_value_is_cut_in_messages() -> None:
    with pytest.raises(GaitoptError) as caught:
        gaitopt.CrawlSettings(body_height=list(range(10**5)))
    assert len(str(caught.value)) < 200


def test_no_poses_have_no_joints() -> None:
    robot = gaitopt.load_robot("wang2020")
    assert gaitopt.joints_from_feet(robot, np.zeros(3), np.zeros((0, 3)), np.zeros((4, 3)),
                                    on_unreachable="mask")[0].shape == (0, 12)  # fmt: skip
