"""The process that draws figures beside a command: it gives what this one would, and ends."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import gaitopt
from gaitopt.cli.results import beside as module
from gaitopt.cli.results.beside import Beside, beside
from gaitopt.errors import InputError
from gaitopt.viewing.figures.crawl_figures import save_figures


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
