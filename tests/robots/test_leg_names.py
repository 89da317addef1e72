"""Legs under any of their names, wherever a user names one."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt.conventions import LEGS
from gaitopt.gait.state_machine import GaitStateMachine
from gaitopt.optimize.posture.problem import BodyPose, build_posture_problem
from gaitopt.robots.numbering import number_of

NAMES = {
    "vendors": ("FL", "RL", "RR", "FR"),
    "small": ("lf", "lh", "rh", "rf"),
    "words": ("front_left", "rear_left", "rear_right", "front_right"),
    "back": ("Left-Front", "left back", "BR", "FORE_RIGHT"),
}
each_way = pytest.mark.parametrize("names", NAMES.values(), ids=NAMES)


@cache
def wang() -> gaitopt.Quadruped:
    return gaitopt.load_robot("wang2020")


FEET = {"LF": (0.2, 0.15, 0.0), "LH": (-0.2, 0.15, 0.0), "RH": (-0.2, -0.15, 0.0),
        "RF": (0.2, -0.15, 0.0)}  # fmt: skip


@each_way
def test_a_robot_s_legs_have_all_names(names: tuple[str, ...]) -> None:
    robot, schedule = wang(), gaitopt.trot(0.5)
    for leg, name in zip(LEGS, names, strict=True):
        assert robot.legs[name] is robot.legs[leg] and name in robot.legs
        assert robot.leg_columns[name] == robot.leg_columns[leg]
        assert schedule.touchdowns[name] == schedule.touchdowns[leg]
        assert number_of(name, "wang2020") == number_of(leg, "wang2020")
    assert tuple(robot.legs) == LEGS and len(robot.legs) == 4


def test_what_is_no_leg_is_told_with_the_legs() -> None:
    with pytest.raises(KeyError, match="'tail' is no leg; legs are LF, LH, RH, RF"):
        wang().legs["tail"]
    assert "tail" not in wang().legs and 0 not in wang().legs  # type: ignore[comparison-overlap]


@each_way
def test_footholds_orders_and_states(names: tuple[str, ...], tmp_path: Path) -> None:
    plain = gaitopt.s_columns(0, columns=2, robot=wang())
    named = {name: plain[leg] for leg, name in zip(LEGS, names, strict=True)}
    order = ("LF", "RH", "RF", "LH")
    turned = tuple(dict(zip(LEGS, names, strict=True))[leg] for leg in order)
    made = gaitopt.Footholds(named, order=turned)
    assert made == gaitopt.Footholds({leg: plain[leg] for leg in LEGS}, order=order)
    assert made.counts[names[1]] == 2
    rows = ["leg,step,x,y,z"]
    rows += [f"{name},{k},{x},{y},{z}" for name, points in named.items()
             for k, (x, y, z) in enumerate(points.tolist())]  # fmt: skip
    file = tmp_path / "footholds.csv"
    file.write_text("\n".join(rows))
    assert gaitopt.Footholds.from_csv(file) == plain.with_(radius=None)
    settings = gaitopt.CrawlSettings(sequence=turned)
    assert settings.sequence == order
    state = replace(gaitopt.State.standing(wang()), support=turned[:3])
    assert set(state.support) == set(order[:3])


@each_way
def test_gaits(names: tuple[str, ...]) -> None:
    schedule = gaitopt.walk(1.0)
    alias = dict(zip(LEGS, names, strict=True))
    events = gaitopt.swing_events(schedule, 1, first=alias["RH"])
    assert events == gaitopt.swing_events(schedule, 1, first="RH")
    machines = [GaitStateMachine(schedule, 1), GaitStateMachine(schedule, 1, first=None)]
    told = [machine.advance(0.3, {key: leg != "LF" for leg, key in keys.items()})
            for machine, keys in zip(machines, (alias, dict(zip(LEGS, LEGS, strict=True))),
                                     strict=True)]  # fmt: skip
    assert told[0] == told[1]


@each_way
def test_problems_of_one_step(names: tuple[str, ...]) -> None:
    alias = dict(zip(LEGS, names, strict=True))
    feet = {alias[leg]: place for leg, place in FEET.items()}
    ours, plain = (
        gaitopt.solve_cog(gaitopt.build_cog_problem(
            wang(), places, 0.4, (0.0, 0.0), swing=leg, foothold=(0.3, 0.15, 0.0)
        ))
        for places, leg in ((feet, alias["LF"]), (FEET, "LF"))
    )  # fmt: skip
    assert ours.position.tolist() == plain.position.tolist()
    pose = BodyPose(np.array([0.0, 0.0, 0.4]), np.zeros(3))
    problems = [
        build_posture_problem(wang(), places, pose, swing=leg)
        for places, leg in ((feet, alias["RH"]), (FEET, "RH"))
    ]
    assert problems[0].support == problems[1].support
    assert problems[0].feet.tolist() == problems[1].feet.tolist()
    area = [gaitopt.feasible_region(wang(), np.array(list(FEET.values())), support=support).area
            for support in (names[:3], LEGS[:3])]  # fmt: skip
    assert area[0] == area[1]
