"""Progress bars of notebooks and terminals."""

from __future__ import annotations

import sys
from types import SimpleNamespace
from typing import Any

import pytest

import gaitopt
from gaitopt.viewing.notebook import progress


@pytest.fixture
def cell(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What a cell of a notebook shows, one picture after the other."""
    shown: list[str] = []

    class Handle:
        def update(self, html: Any) -> None:
            shown.append(html.data)

    def display(html: Any, display_id: bool) -> Handle:
        assert display_id
        shown.append(html.data)
        return Handle()

    notebook = SimpleNamespace(get_ipython=lambda: SimpleNamespace(kernel=object()))
    monkeypatch.setitem(sys.modules, "IPython", notebook)  # type: ignore[misc]
    view = SimpleNamespace(HTML=lambda data: SimpleNamespace(data=data), display=display)
    monkeypatch.setitem(sys.modules, "IPython.display", view)  # type: ignore[misc]
    monkeypatch.setattr(progress, "EVERY", 0.0)
    return shown


def test_a_notebook_shows_each_step_of_a_planner_and_then_nothing(
    cell: list[str], wang: gaitopt.Quadruped
) -> None:
    with gaitopt.progress_bar("planning <16> steps") as tick:
        plan = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=2), progress=tick)
    assert "planning &lt;16&gt; steps" in cell[1] and f"of {len(plan.swings)}" in cell[-2]
    done = [int(text.split('value="')[1].split('"')[0]) for text in cell[1:-1]]
    # A planner begins anew with other body heights.
    assert set(done) == set(range(1, len(plan.swings) + 1)) and done[-1] == len(plan.swings)
    assert cell[0] == cell[-1] == ""


def test_the_bar_goes_when_a_planner_fails(cell: list[str]) -> None:
    with pytest.raises(gaitopt.InputError), gaitopt.progress_bar("planning") as tick:
        tick(1, 2)
        raise gaitopt.InputError("no")
    assert cell[-1] == ""


def test_pictures_of_a_bar_are_not_made_more_often_than_one_can_see(
    cell: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "EVERY", 3600.0)
    monkeypatch.setattr(progress.time, "monotonic", lambda: 1e6)
    with gaitopt.progress_bar("planning") as tick:
        for i in range(1000):
            tick(i, 1000)
    assert len(cell) == 3


def test_files_get_no_bar(capfd: pytest.CaptureFixture[str]) -> None:
    with gaitopt.progress_bar("planning") as tick:
        tick(1, 2)
    assert capfd.readouterr() == ("", "")
