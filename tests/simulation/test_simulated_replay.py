"""A walk in physics beside its plan, in one page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt import Plan, Quadruped, Trajectory
from gaitopt.robots.rotations import rpy_to_quaternion
from gaitopt.terrain.columns import s_columns
from gaitopt.viewing.replay.plan_page import GHOST, plan_page, plan_scene, simulated_plan
from gaitopt.viewing.replay.replay import replay


@pytest.fixture(scope="module")
def walk(wang: Quadruped) -> Plan:
    return gaitopt.plan_crawl(wang, gaitopt.s_columns(3, columns=2), timing="velocity")


@pytest.fixture(scope="module")
def motion(walk: Plan) -> Trajectory:
    """A stand-in for physics: the plan, sampled, drifting and turning."""
    planned = walk.sample(0.02)
    drift = np.linspace(0.0, 0.05, len(planned))[:, None]
    q = planned.q.copy()
    q[:, :3] += drift * [0.0, 1.0, 0.0]
    q[:, 3:7] = rpy_to_quaternion(np.hstack([0.5 * drift, -drift, 2.0 * drift]))
    return Trajectory(planned.t, q, planned.v.copy(), planned.contacts.copy(), planned.cog.copy(),
                      planned.feet.copy(), planned.legs, planned.joint_names)  # fmt: skip


def test_the_simulated_robot_stands_beside_a_ghost_of_the_planned(
    walk: Plan, motion: Trajectory
) -> None:
    scene = plan_scene(walk, simulated=motion)
    planned = [p for n in scene.nodes if n.path[0] == "robot" for p in n.parts]
    real = [p for n in scene.nodes if n.path[0] == "simulated" for p in n.parts]
    assert len(planned) == len(real) > 0
    assert max(p.appearance.opacity for p in planned) <= GHOST
    assert max(p.appearance.opacity for p in real) == 1.0
    assert plan_page(walk, simulated=motion).follow == "/simulated/base"
    assert any("ghost" in fact for fact in plan_page(walk, simulated=motion).facts)


def test_what_is_shown_is_what_was_simulated(walk: Plan, motion: Trajectory) -> None:
    shown = simulated_plan(walk, motion).at(motion.t)
    assert np.abs(shown.q[:, :3] - motion.q[:, :3]).max() < 2e-3
    flip = np.sign(np.einsum("ni,ni->n", shown.q[:, 3:7], motion.q[:, 3:7]))[:, None]
    assert np.abs(flip * shown.q[:, 3:7] - motion.q[:, 3:7]).max() < 1e-3
    assert np.abs(shown.q[-1, 7:] - motion.q[-1, 7:]).max() < 1e-9


def test_the_page_is_written_and_small(walk: Plan, motion: Trajectory, tmp_path: Path) -> None:
    file = replay(walk, tmp_path / "both.html", simulated=motion)
    assert file.stat().st_size < 3e6
    assert "simulated in physics" in file.read_text("utf-8")


def test_another_robots_motion_is_refused(walk: Plan, motion: Trajectory) -> None:
    a1 = gaitopt.load_robot("a1")
    plan = gaitopt.plan_crawl(
        a1, s_columns(0, columns=2, robot=a1), body_height=0.25, timing="velocity"
    )
    with pytest.raises(gaitopt.InputError, match="has the joints"):
        plan_scene(plan, simulated=motion)
