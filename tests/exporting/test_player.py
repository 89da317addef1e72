"""The example node of the page "From plan to robot", with a stand-in for ROS 2 and a robot."""

from __future__ import annotations

import types
from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt import Plan

pytest.importorskip("rosbags", reason="needs pip install 'gaitopt[ros]'")
pytest.importorskip("mcap", reason="needs pip install mcap-ros2-support")

from ros_stand_in import World, with_ros

SCRIPT = Path(__file__).parents[2] / "docs" / "examples" / "play_plan.py"


@pytest.fixture(scope="module")
def files(a1_walk: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("player")
    for name in ("walk.yaml", "walk.json", "walk.mcap"):
        gaitopt.export(a1_walk, folder / name)
    return folder


def robot_at(plan: Plan, off: float = 0.0) -> World:
    first = plan.at([0.0]).q[0, 7:] + off
    names = [str(n) for n in plan.robot.joint_names]
    # The controller's own order is another one.
    return World(names[::-1], dict(zip(names, first.tolist(), strict=True)))


@pytest.mark.parametrize("name", ["walk.yaml", "walk.json", "walk.mcap"])
def test_the_node_plays_each_kind_of_file(
    a1_walk: Plan, files: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    world = robot_at(a1_walk, 0.02)
    player = with_ros(world, monkeypatch, SCRIPT)
    assert player.main([str(files / name), "--slower", "2"]) == 0, world.logged
    assert world.moved is not None
    times, positions, velocities = world.moved
    path = a1_walk.at(np.clip((times - 1.0) / 2.0, 0.0, a1_walk.duration)).q[:, 7:][:, ::-1]
    walking = times >= 1.0
    assert np.abs(positions - path)[walking].max() < 1.1e-3
    share = np.abs(velocities) / a1_walk.robot.velocity_limits[::-1]
    assert share.max() < 0.4, "half of the plan's 0.66"
    assert "result 0" in world.logged[-1]


def test_it_does_not_begin_far_from_the_first_posture(
    a1_walk: Plan, files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = robot_at(a1_walk, 0.5)
    player = with_ros(world, monkeypatch, SCRIPT)
    assert player.main([str(files / "walk.yaml")]) == 2
    assert "0.500 rad from the plan's first posture" in world.logged[-1] and not world.goals
    assert player.main([str(files / "walk.yaml"), "--near", "0.6"]) == 0


def test_a_joint_that_strays_ends_the_motion(
    a1_walk: Plan, files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = robot_at(a1_walk)
    world.stray = lambda time: 0.1 * time
    player = with_ros(world, monkeypatch, SCRIPT)
    assert player.main([str(files / "walk.yaml"), "--slower", "6"]) == 1
    assert "result -4" in world.logged[-1]
    assert any("rad from the plan" in line for line in world.logged)


def test_what_the_controller_refuses_and_what_is_missing_is_told(
    a1_walk: Plan, files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = robot_at(a1_walk)
    world.joints = world.joints[1:]
    player = with_ros(world, monkeypatch, SCRIPT)
    assert player.main([str(files / "walk.yaml")]) == 2
    assert "refused the plan" in world.logged[-1]
    assert player.main([str(files / "walk.yaml"), "--controller", "arm"]) == 2
    assert "no controller arm" in world.logged[-1]
    del world.present["FL_hip_joint"]
    assert player.main([str(files / "walk.yaml")]) == 2
    assert "does not tell of FL_hip_joint" in world.logged[-1]


@pytest.mark.parametrize("meanwhile", ["sending", "playing"])
def test_ctrl_c_cancels_the_motion(
    a1_walk: Plan, files: Path, monkeypatch: pytest.MonkeyPatch, meanwhile: str
) -> None:
    """Also where ROS's own handler of Ctrl-C would end all communication at once."""
    world = robot_at(a1_walk)
    world.interrupt = meanwhile
    player = with_ros(world, monkeypatch, SCRIPT)
    assert player.main([str(files / "walk.yaml")]) == 1
    assert world.cancelled and world.context


def test_states_without_positions_are_read_over(
    a1_walk: Plan, files: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    world = robot_at(a1_walk)
    player = with_ros(world, monkeypatch, SCRIPT)
    state = player.JointState(name=["wheel"], velocity=[0.0])
    node = player.PlanPlayer(None, types.SimpleNamespace(controller="legs"))
    node.on_state(state)
    assert node.present == {}
