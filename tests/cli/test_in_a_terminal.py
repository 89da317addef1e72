"""The main commands as people see them: in a terminal of 80 columns."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from terminal import COLUMNS, Run, Screen, in_terminal

import gaitopt


def looks_well(run: Run) -> str:
    """The text on the screen; no line is cut, no word broken."""
    text = run.screen.text
    assert run.screen.broken == [], text
    assert max(map(len, text.splitlines())) <= COLUMNS
    assert "…" not in text and "Traceback" not in text
    return text


def test_the_screen_is_drawn_as_a_terminal_does_it() -> None:
    screen = Screen()
    screen.write("x" * 79 + " word\r\nplanning 1\r\x1b[2Kplanning 2\r\n\x1b[1A\x1b[2Kdone\x1b[0m")
    assert screen.text.splitlines() == ["x" * 79, "word", "done"] and screen.broken == []
    screen = Screen()
    screen.write("a" * 78 + "\x1b[1")
    screen.write("m broken")
    assert screen.broken == ["broken"]


def test_commands_are_listed_and_the_first_one_is_named(tmp_path: Path) -> None:
    run = in_terminal([], tmp_path)
    text = looks_well(run)
    assert run.code == 0 and "Start with: gaitopt demo" in text
    for name in ("walk", "terrain", "verify", "simulate", "replay", "export", "robot"):
        assert f"│ {name} " in text


def test_a_robot_s_tables_have_a_line_for_each_leg_and_joint(tmp_path: Path) -> None:
    run = in_terminal(["robot", "go2"], tmp_path)
    text = looks_well(run)
    assert run.code == 0 and "no warnings" in text
    robot = gaitopt.load_robot("go2")
    for name, leg in robot.legs.items():
        x, y, z = (f"{value:.3f}" for value in leg.hip)
        (line,) = [one for one in text.splitlines() if one.startswith(f" {name} ")]
        assert f"{x} {y} {z}" in line and f"{leg.least_reach:.3f} .. {leg.reach:.3f}" in line
        for i, joint in enumerate(leg.joints):
            (line,) = [one for one in text.splitlines() if joint in one and "│" in one]
            assert f"{leg.velocity_limits[i]:.4g}" in line


def test_a_mistake_is_told_in_whole_words(tmp_path: Path) -> None:
    np.save(tmp_path / "map.npy", np.zeros((20, 20)))
    run = in_terminal(["terrain", "map.npy", "--goal", "1,0"], tmp_path)
    text = looks_well(run)
    assert run.code == 2 and len(text.splitlines()) > 1
    assert " ".join(text.split()).startswith("gaitopt: map.npy: .npy files tell no scale: give the "
                                             "distance between neighbouring points")  # fmt: skip


def test_a_walk_ends_with_its_files_and_a_verdict_and_its_bars_are_gone(tmp_path: Path) -> None:
    gaitopt.s_columns(0, columns=2).to_csv(tmp_path / "mine.csv")
    run = in_terminal(["walk", "--footholds", "mine.csv", "--fast"], tmp_path)
    text = looks_well(run)
    assert run.code == 0 and "━━━" not in text
    words = " ".join(text.split())
    assert "replay: open it in a browser" in words and "certified at every instant" in words
    assert words.endswith("gaitopt simulate out/walk-wang2020-mine/plan.npz")


def test_ctrl_c_of_the_keyboard_stops_before_the_plan_and_leaves_the_folder_as_it_was(
    tmp_path: Path,
) -> None:
    # Planned for seconds, so that the key comes in time on a machine that does much else, too.
    run = in_terminal(["walk", "--objective", "time"], tmp_path, stop_after="planning")
    text = looks_well(run)
    assert run.code == 130 and "certified" not in text
    assert text.endswith("stopped") or "stopped" in text.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", ["walk", "terrain", "export"])
def test_help_fits(command: str, tmp_path: Path) -> None:
    run = in_terminal([command, "--help"], tmp_path)
    assert run.code == 0 and "[OPTIONS]" in looks_well(run)
