"""Walks up and across a ramp in physics: the controller knows where balls touch the ground."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, HeightMap, Quadruped

pytest.importorskip("mujoco")

TILT = np.radians(15.0)


def on_a_ramp(robot: Quadruped, towards: float) -> Footholds:
    """Footholds of level ground on a ramp that rises in a direction; the body follows it."""
    flat = gaitopt.s_columns(0, columns=2, robot=robot)
    rise = np.tan(TILT) * np.array([np.cos(towards), np.sin(towards)])
    level = HeightMap(np.zeros((150, 120)), 0.02, (-1.3, -1.2))
    ground = level.with_heights(rise[0] * level.x[:, None] + rise[1] * level.y[None, :])
    balls = {leg: ground.ball(flat[leg][:, :2], robot.foot_radius) for leg in LEGS}
    points = {leg: ball.centres for leg, ball in balls.items()}
    order = ("RF", "LH", "LF", "RH")
    made = [{leg: int(leg in order[:n]) for leg in LEGS} for n in range(len(order) + 1)]
    heights = [np.mean([points[leg][row[leg], 2] for leg in LEGS]) for row in made]
    above = robot.standing_height * np.cos(TILT)
    roll, pitch = TILT * np.sin(towards), -TILT * np.cos(towards)
    return Footholds(
        points, ground=ground, order=order,
        normals={leg: ball.normals for leg, ball in balls.items()},
        postures=[[height + above, roll, pitch, 0.0] for height in heights],
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "towards", "most"),
    [("go2", 0.0, 2.5e-3), ("go2", np.pi / 2.0, 2e-3), ("anymal_c", 2.5, 2e-3)],
    ids=["up", "across", "down and across"],
)
def test_a_ramp_is_walked_as_planned(name: str, towards: float, most: float) -> None:
    """As fast as forces about the normals of the ramp allow."""
    robot = gaitopt.load_robot(name)
    result = gaitopt.simulate(gaitopt.plan_crawl(robot, on_a_ramp(robot, towards)))
    assert result.passed and result.bumps == (), str(result)
    # Up the ramp go2 is 2.0 to 2.2 mm off when it stops, in steps of the physics of 0.25 to 1 ms.
    assert result.body_error < most and result.tilt < np.radians(0.5)


def test_a_controller_that_takes_a_ramp_for_level_errs() -> None:
    """By the radius of the balls times the sine of the slope, where they touch the ground."""
    robot = gaitopt.load_robot("go2")
    plan = gaitopt.plan_crawl(robot, on_a_ramp(robot, 0.0), speed=0.3)
    unaware = replace(plan, footholds=plan.footholds.with_(normals=None))
    ours, theirs = gaitopt.simulate(plan).body_error, gaitopt.simulate(unaware).body_error
    assert ours < 1e-3 and theirs > 1.5 * ours
