"""The process that draws figures beside a command: it gives what this one would, and ends."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

import gaitopt
from gaitopt.cli.results import beside as module
from gaitopt.cli.results.beside import Beside, beside
from gaitopt.cli.results.deliver import read_beside
from gaitopt.errors import InputError
from gaitopt.viewing.figures.crawl_figures import save_figures
from gaitopt.viewing.replay import robot_shapes


def process_of(helper: Beside) -> int:
    return helper._process.pid


def is_there(number: int) -> bool:
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_cores", lambda: 2)


def test_the_process_draws_the_figures_that_this_one_draws(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, short_plan: gaitopt.Plan
) -> None:
    two_cores(monkeypatch)
    with beside(wanted=True) as helper:
        assert helper is not None
        drawn = helper.begin(save_figures, short_plan, tmp_path / "there")
        refused = helper.begin(save_figures, short_plan, Path(f"/dev/null/{tmp_path.name}"))
        here = save_figures(short_plan, tmp_path / "here")
        there = drawn()
        # An error comes through, and the process goes on.
        with pytest.raises(InputError, match="cannot make the folder"):
            refused()
        number = process_of(helper)
    assert [path.name for path in there] == [path.name for path in here]
    # Those of this process have no pixels (conftest.py).
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in there)
    assert not is_there(number)


def test_work_of_a_process_that_is_lost_is_done_here(monkeypatch: pytest.MonkeyPatch) -> None:
    two_cores(monkeypatch)
    with beside(wanted=True) as helper:
        assert helper is not None
        answer = helper.begin(os.getpid)
        helper._process.kill()
        helper._process.wait()
        again = helper.begin(os.getpid)
        assert again() == os.getpid()
        assert answer() in (os.getpid(), process_of(helper))


def test_answers_may_be_asked_for_in_any_order_and_more_than_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    two_cores(monkeypatch)
    with beside(wanted=True) as helper:
        assert helper is not None
        # More than a pipe holds: this process does not wait until it is read.
        long = helper.begin(len, b"x" * 3_000_000)
        numbers = [helper.begin(abs, -k) for k in range(5)]
        where = helper.begin(os.getpid)
        assert where() == process_of(helper)
        assert [numbers[k]() for k in (3, 0, 4, 4)] == [3, 0, 4, 4] and long() == 3_000_000


def test_what_was_not_sent_goes_with_the_process(monkeypatch: pytest.MonkeyPatch) -> None:
    two_cores(monkeypatch)
    with beside(wanted=True) as helper:
        assert helper is not None
        os.kill(process_of(helper), signal.SIGSTOP)
        helper.begin(len, b"x" * 3_000_000)
    assert not is_there(process_of(helper))


def test_replays_are_the_same_with_shapes_that_the_process_read(
    monkeypatch: pytest.MonkeyPatch, short_plan: gaitopt.Plan, tmp_path: Path
) -> None:
    two_cores(monkeypatch)
    gaitopt.replay(short_plan, tmp_path / "here.html")
    with beside(wanted=True) as helper:
        assert helper is not None
        shapes = read_beside(helper, short_plan.robot)()
    monkeypatch.setattr(robot_shapes, "_known", {})
    monkeypatch.setattr(robot_shapes, "read_parts", None)  # It is not read here.
    robot_shapes.remember_parts(short_plan.robot, shapes)
    gaitopt.replay(short_plan, tmp_path / "there.html")
    assert (tmp_path / "here.html").read_bytes() == (tmp_path / "there.html").read_bytes()


def test_there_is_no_process_without_a_core_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    two_cores(monkeypatch)
    with beside(wanted=False) as helper:
        assert helper is None
    monkeypatch.setattr(module, "_cores", lambda: 1)
    with beside(wanted=True) as helper:
        assert helper is None


def test_the_process_ends_where_the_command_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    two_cores(monkeypatch)
    with pytest.raises(InputError), beside(wanted=True) as helper:
        assert helper is not None
        raise InputError("no plan")
    assert not is_there(process_of(helper)) and module._running == []
