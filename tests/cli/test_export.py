"""``gaitopt export`` on the command line."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from gaitopt import Plan
from gaitopt.cli.app import app
from gaitopt.errors import InputError


@pytest.fixture(scope="module")
def run(a1_walk: Plan, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Any]:
    file = tmp_path_factory.mktemp("export") / "plan.npz"
    a1_walk.save(file)
    return lambda *words: CliRunner().invoke(app, ["export", str(file), *map(str, words)])


def test_options_of_the_format_and_of_the_joints(
    run: Callable[..., Any], a1_walk: Plan, tmp_path: Path
) -> None:
    names = list(a1_walk.robot.joint_names)[::-1]
    controllers = tmp_path / "controllers.yaml"
    listed = "".join(f"\n    - r1_{name}" for name in names)
    controllers.write_text(f"legs:\n  ros__parameters:\n    joints:{listed}\n")
    out = tmp_path / "walk.json"
    done = run(out, "--joints", controllers, "--prefix", "r1_", "--set", "interpolation=quintic",
               "--set", "offset=0.5", "--forces")  # fmt: skip
    assert done.exit_code == 0, done.output
    assert "peak velocity" in done.output and "walk.json" in done.output
    told = json.loads(out.read_text())
    assert told["joint_names"] == [f"r1_{name}" for name in names]
    assert set(told["points"][0]) == {
        "positions", "velocities", "accelerations", "effort", "time_from_start"
    }  # fmt: skip
    assert told["points"][0]["time_from_start"] == {"sec": 0, "nanosec": 500_000_000}


def test_a_list_of_names_and_parts(run: Callable[..., Any], tmp_path: Path) -> None:
    done = run(tmp_path / "a.json", "--joints", "FL_hip_joint,FL_calf_joint")
    assert done.exit_code == 0 and "without the joints" in done.output
    told = json.loads((tmp_path / "a.json").read_text())
    assert told["joint_names"] == ["FL_hip_joint", "FL_calf_joint"]
    done = run(tmp_path / "b.json", "--set", "part_time=0.7")
    assert {f.name for f in tmp_path.glob("b*")} == {"b-1.json", "b-2.json"}
    assert "b-1.json" in done.output and "b-2.json" in done.output


def test_joints_under_new_names_and_many_of_them(
    run: Callable[..., Any], a1_walk: Plan, tmp_path: Path
) -> None:
    done = run(tmp_path / "a.json", "--joints", "FR_hip_joint=m0, FL_calf_joint")
    assert done.exit_code == 0, done.output
    assert json.loads((tmp_path / "a.json").read_text())["joint_names"] == ["m0", "FL_calf_joint"]
    renamed = {name: f"a_long_name_of_the_motor_of_{name}" for name in a1_walk.robot.joint_names}
    listed = ",".join(f"{old}={new}" for old, new in renamed.items())
    done = run(tmp_path / "b.json", "--joints", listed)
    assert done.exit_code == 0, done.output
    assert json.loads((tmp_path / "b.json").read_text())["joint_names"] == list(renamed.values())


def test_mistakes(run: Callable[..., Any], tmp_path: Path) -> None:
    for words, told in (
        ((), "give a FILE"),
        ((tmp_path / "a.json", "--set", "offset"), "NAME=VALUE"),
        ((tmp_path / "a.json", "--set", "ofset=1"), "did you mean offset"),
        ((tmp_path / "a.json", "--format", "mjoco"), "did you mean mujoco"),
    ):
        done = run(*words)
        assert isinstance(done.exception, InputError) and told in str(done.exception)
