"""``gaitopt stride``, run as a user runs it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import Result

import gaitopt
from gaitopt import Plan
from gaitopt.cli.stride import (
    Shape,
    describe,
    first_stride,
    limits_of,
    obstacle_for,
    scale_of,
)
from gaitopt.planners.over_obstacle import failure

Command = Callable[..., Result]


@pytest.fixture(scope="module")
def written(command: Command, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder that ``gaitopt stride`` fills, and what it prints."""
    folder = tmp_path_factory.mktemp("stride") / "out"
    result = command("stride", "--out", str(folder))
    assert result.exit_code == 0, result.output
    return folder, result.output


@pytest.fixture(scope="module")
def planned(written: tuple[Path, str]) -> Plan:
    return gaitopt.load_plan(written[0] / "plan.npz")


def test_stride_writes_plan_replay_and_figures(written: tuple[Path, str]) -> None:
    folder, said = written
    assert {p.name for p in folder.iterdir()} == {
        "plan.npz", "stride.html", "figures", "run.json"}  # fmt: skip
    assert (folder / "stride.html").stat().st_size < 3_000_000
    assert (folder / "plan.npz").stat().st_size < 5_000_000
    figures = {p.stem for p in (folder / "figures").glob("*.png")}
    assert {"striding_fig06_joints", "striding_fig07_cog"} < figures and len(figures) >= 9
    for words in ("stride.html", "plan.npz", "figures", "110 mm high and 40 mm wide"):
        assert words in said


def test_what_it_says_is_what_the_plan_does(written: tuple[Path, str], planned: Plan) -> None:
    said = " ".join(written[1].split())
    assert describe(planned) in said
    assert f"{planned.robot.name} takes {len(planned.swings)} steps" in said
    assert f"in {planned.duration:.1f} s" in said
    assert f"margin at least {1e3 * planned.margin:.1f} mm" in said


def test_frog1_ends_on_the_other_side_of_the_papers_board(planned: Plan) -> None:
    feet = planned.at([0.0, planned.duration]).feet
    (board,) = planned.settings.obstacles  # type: ignore[attr-defined]
    assert (board.height, board.width) == (0.11, 0.04)
    across = board.to_local(feet)[..., 0]
    assert (across[0] < -0.02).all() and (across[1] > 0.02).all()


def test_a_front_leg_goes_first(planned: Plan) -> None:
    swing = first_stride(planned)
    assert swing.leg == "RF" and swing.foot_start[0] < -0.02 < 0.02 < swing.foot_end[0]
    assert sum(s.foot_start[0] * s.foot_end[0] < 0.0 for s in planned.swings) == 4


def test_its_joints_keep_the_limits_of_table_1(planned: Plan) -> None:
    grid = np.linspace(0.0, planned.duration, 20_001)
    hips = [6 + planned.robot.joint_names.index(f"{leg}_HFE") for leg in gaitopt.LEGS]
    knees = [6 + planned.robot.joint_names.index(f"{leg}_KFE") for leg in gaitopt.LEGS]
    for order, hip, knee in ((1, 10.0, 20.0), (2, 20.0, 20.0), (3, 40.0, 50.0)):
        rates = np.degrees(np.abs(planned.path.evaluate(grid, derivative=order)))
        assert rates[:, hips].max() <= hip * (1.0 + 1e-9)
        assert rates[:, knees].max() <= knee * (1.0 + 1e-9)


def test_the_study_prints_its_table(command: Command) -> None:
    result = command("stride", "--study")
    assert result.exit_code == 0, result.output
    for words in ("ours, least time", "8.4982", "by hand", "TOPP-RA", "interval"):
        assert words in result.output


def test_an_obstacle_that_is_too_high_is_refused_with_one_that_is_possible(
    error_of: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """(The search for it takes seconds and is tested with the planner.)"""
    lower = gaitopt.rectangular_obstacle(0.09, 0.04)
    monkeypatch.setattr(failure, "_largest", lambda *_: lower)
    words = error_of("stride", "--robot", "wang2020", "--height", "0.5")
    assert "wang2020 does not get over this obstacle" in words
    assert "with these settings it gets over one 0.09 m high" in words


def test_mistakes_name_what_is_wrong(command: Command, error_of: Callable[..., str]) -> None:
    assert "unknown robot" in error_of("stride", "--robot", "nope")
    assert "leave --width out" in error_of("stride", "--shape", "round", "--width", "0.2")
    assert "height must be a finite length" in error_of("stride", "--height", "-1")
    assert command("stride", "--shape", "oval").exit_code == 2


def test_what_is_left_out_is_the_papers_to_the_robots_scale() -> None:
    frog, wang = gaitopt.load_robot("frog1"), gaitopt.load_robot("wang2020")
    assert scale_of(frog) == 1.0
    board = obstacle_for(Shape.rectangular, None, None, 0.5, 1.0)
    assert (board.height, board.width) == (0.11, 0.04) and board.position == (0.5, 0.0, 0.0)
    small = obstacle_for(Shape.rectangular, None, None, 0.0, scale_of(wang))
    assert small.height / 0.11 == pytest.approx(0.40 / 0.56, abs=0.005)
    assert limits_of(wang) == {} and set(limits_of(frog)) == {"acceleration_limit", "jerk_limit"}


@pytest.mark.parametrize("shape", list(Shape))
def test_every_shape_has_the_size_that_was_asked_for(shape: Shape) -> None:
    width = None if shape is Shape.round else 0.07
    obstacle = obstacle_for(shape, 0.05, width, 0.0, 1.0)
    assert obstacle.shape == shape.value
    assert obstacle.height == pytest.approx(0.05)
    assert obstacle.width == pytest.approx(0.05 if width is None else width)
