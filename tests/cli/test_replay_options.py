"""Options of the commands that write replays: meshes, and videos."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

import gaitopt
from gaitopt.cli.app import app

WITH_A_REPLAY = ("walk", "gait", "trot", "stride", "race", "terrain", "demo", "robot", "simulate",
                 "replay")  # fmt: skip


@pytest.mark.parametrize("name", WITH_A_REPLAY)
def test_every_command_with_a_replay_draws_meshes(name: str) -> None:
    told = CliRunner().invoke(app, [name, "--help"], env={"COLUMNS": "200"}).output
    assert "--meshes" in told and "--mesh-folder" in told


@pytest.fixture(scope="module")
def plan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    robot = gaitopt.load_robot("wang2020")
    made = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2), timing="velocity")
    path = tmp_path_factory.mktemp("plan") / "plan.npz"
    made.save(path)
    return path


def test_a_video_that_cannot_be_made_is_one_line_with_its_cure(
    plan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    error_of: Callable[..., str],
) -> None:  # fmt: skip
    monkeypatch.setenv("PATH", str(tmp_path))
    told = error_of("replay", str(plan), "--video", str(tmp_path / "walk.gif"))
    assert "no Chromium or Chrome on the PATH" in told and "apt install chromium" in told
    wrong = error_of("replay", str(plan), "--video", str(tmp_path / "walk.avi"))
    assert "must end in .gif, .webp, .mp4, .webm" in wrong
    assert not list(tmp_path.iterdir())


def test_options_of_videos_need_a_video(plan: Path, error_of: Callable[..., str]) -> None:
    for option in (("--seconds", "3"), ("--look", "curves")):
        told = error_of("replay", str(plan), *option)
        assert "give --video FILE as well" in told


def test_the_simulation_s_replay_tells_what_happened(
    plan: Path, tmp_path: Path, command: Callable[..., Result]
) -> None:
    pytest.importorskip("mujoco")
    page = tmp_path / "both.html"
    assert command("simulate", str(plan), "--out", str(page)).exit_code == 0
    text = page.read_text("utf-8")
    assert "what happened in physics" in text and "physics: passed" in text
    assert re.search(r'"torque":\{"rows":\d+', text)
