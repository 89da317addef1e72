"""Walks up and across a ramp in physics: the controller knows where balls touch the ground."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, HeightMap, Plan, Quadruped

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


@pytest.fixture(scope="module", params=[0.0, np.pi / 2.0], ids=["up", "across"])
def ramp(request: pytest.FixtureRequest) -> Plan:
    robot = gaitopt.load_robot("go2")
    return gaitopt.plan_crawl(robot, on_a_ramp(robot, request.param), speed=0.1)


def test_a_ramp_is_walked_closely_where_its_normals_are_known(ramp: Plan) -> None:
    """A controller that takes the ground for level errs by the radius times the sine."""
    result = gaitopt.simulate(ramp)
    assert result.passed and result.bumps == (), str(result)
    assert result.body_error < 1.5e-3 and result.tilt < np.radians(0.3)
    unaware = replace(ramp, footholds=ramp.footholds.with_(normals=None))
    assert gaitopt.simulate(unaware).body_error > 1.5 * result.body_error
