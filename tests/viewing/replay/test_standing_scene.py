"""The regions in which forces hold the robot, in replays."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import gaitopt
from gaitopt import ForceLimits, Plan
from gaitopt.plan.com_margin import true_com
from gaitopt.plan.standing_regions import swing_region
from gaitopt.viewing.replay.replay import replay_html
from gaitopt.viewing.replay.scene import Polygon
from gaitopt.viewing.replay.standing_scene import STANDING, standing_scene


@pytest.fixture(scope="module")
def plan() -> Plan:
    """Every foot keeps a tenth of the weight."""
    robot = gaitopt.load_robot("a1")
    ground = gaitopt.s_columns(0, columns=2, robot=robot)
    return gaitopt.plan_crawl(robot, ground, forces=ForceLimits(reserve=0.1), body_height=0.25)


def test_every_swing_has_its_region_while_it_lasts(plan: Plan) -> None:
    scene = standing_scene(plan)
    assert [node.path for node in scene.nodes[:1]] == [STANDING]
    shown = {node.path[-1]: node for node in scene.nodes[1:]}
    assert list(shown) == [str(i) for i, p in enumerate(plan.phases) if p.kind == "swing"]
    for track in scene.tracks:
        phase = plan.phases[int(track.path[-1])]
        region = swing_region(plan, phase)
        visible = track.times[np.asarray(track.values, dtype=bool)]
        np.testing.assert_allclose(visible, [phase.start])
        assert region is not None
        (part,) = shown[track.path[-1]].parts
        assert isinstance(part.shape, Polygon)
        # The outer corners of the line are the region's.
        apart = part.shape.vertices[None, :, :2] - region.vertices[:, None]
        assert np.linalg.norm(apart, axis=2).min(axis=1).max() < 1e-6


def test_the_centre_of_mass_is_inside(plan: Plan) -> None:
    for phase in plan.phases:
        if phase.kind == "swing":
            region = swing_region(plan, phase)
            assert region is not None
            motion = plan.at(np.linspace(phase.start, phase.end, 9)[1:-1])
            assert region.contains(true_com(plan.robot, motion.q)).all()


def test_a_button_hides_it(plan: Plan) -> None:
    data = re.search(r'id="data">(.*?)</script>', replay_html(plan))
    assert data is not None
    (switch,) = json.loads(data.group(1))["switches"]
    assert switch["name"] == "Region" and switch["frame"] == "/".join(STANDING)


def test_without_forces_nothing_is_drawn(plan: Plan) -> None:
    quick = gaitopt.plan_crawl(plan.robot, plan.footholds, timing="velocity")
    assert standing_scene(quick).nodes == ()
    assert '"switches":[]' in replay_html(quick)
