"""What all formats share: their names, their options, and requests that cannot be met."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import gaitopt
from gaitopt import InputError, Plan
from gaitopt.exporting.export import FORMATS
from gaitopt.motion.path import MotionPath


def test_endings_mean_one_format_each() -> None:
    endings = [suffix for f in FORMATS.values() for suffix in f.suffixes]
    assert len(endings) == len(set(endings))
    assert all(name == f.name and f.summary for name, f in FORMATS.items())


def test_wrong_requests_say_what_may_be_meant(a1_walk: Plan, tmp_path: Path) -> None:
    for call, words in (
        (lambda: gaitopt.export(a1_walk, tmp_path / "a.npz"), "ending .* give one of"),
        (lambda: gaitopt.export(a1_walk, tmp_path / "a.yaml", "ros"), "did you mean ros2"),
        (lambda: gaitopt.export(a1_walk, tmp_path / "a.yaml", eror=1), "did you mean error"),
        (lambda: gaitopt.export(a1_walk, tmp_path / "a.csv", error=1), "csv has no option 'error'"),
        (lambda: gaitopt.export(a1_walk, tmp_path / "a.yaml", interpolation="no"), "linear, cubic"),
        (lambda: gaitopt.export(a1_walk, tmp_path / "a.yaml", forces="yes"), "forces must be"),
        (lambda: gaitopt.export(a1_walk, tmp_path / "a.yaml", ramp=-1), "ramp must be"),
        (lambda: gaitopt.export(a1_walk, 3, "ros2"), "path"),  # type: ignore[arg-type]
        (lambda: gaitopt.export(a1_walk, tmp_path, "ros2"), "cannot write"),
        (lambda: gaitopt.export(a1_walk, tmp_path / "no" / "a.yaml"), "cannot write"),
        (lambda: gaitopt.export("plan", tmp_path / "a.yaml"), "plan must be"),  # type: ignore[arg-type]
    ):
        with pytest.raises(InputError, match=words):
            call()
    assert not list(tmp_path.iterdir())


def test_a_plan_that_takes_no_time_has_nothing_to_export(a1_walk: Plan, tmp_path: Path) -> None:
    still = replace(a1_walk, path=MotionPath([0.0], a1_walk.path.knots()[None, :1]), phases=())
    with pytest.raises(InputError, match="takes no time"):
        gaitopt.export(still, tmp_path / "a.yaml")


@pytest.mark.parametrize("name", ["ros2", "mcap", "mujoco", "unitree", "learning", "crocoddyl"])
def test_steps_that_are_no_times_are_refused(a1_walk: Plan, tmp_path: Path, name: str) -> None:
    for dt in (0.0, -1.0, float("nan"), True, 1e-9):
        with pytest.raises(InputError, match="dt"):
            gaitopt.export(a1_walk, tmp_path / "a", name, dt=dt)
    assert not list(tmp_path.iterdir())
