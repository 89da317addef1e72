"""Ways to run ``gaitopt`` inside the test process, and a plan file."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import pytest
from typer.testing import CliRunner, Result

from gaitopt import GaitoptError, Plan
from gaitopt.cli.app import app, main
from gaitopt.cli.results import beside
from gaitopt.viewing.figures import crawl_figures, gait_figures


class Finished(NamedTuple):
    """Exit code and output of a whole run, as a shell sees them."""

    code: int
    stdout: str
    stderr: str


@pytest.fixture(scope="module", autouse=True)
def figures_without_pixels(no_pixels: None) -> Iterator[None]:
    """All commands write their figures without pixels, and in this process, where that is so."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(beside, "_cores", lambda: 1)
        yield


@pytest.fixture(scope="session")
def command() -> Callable[..., Result]:
    """Runs ``gaitopt`` with some arguments; gives exit code, output and exception."""
    return lambda *arguments: CliRunner().invoke(app, list(arguments))


@pytest.fixture(scope="session")
def error_of(command: Callable[..., Result]) -> Callable[..., str]:
    """The text of the error that some arguments end in."""

    def text(*arguments: str) -> str:
        result = command(*arguments)
        assert isinstance(result.exception, GaitoptError), result.output
        return str(result.exception)

    return text


@pytest.fixture
def shell(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., Finished]:
    """Runs ``gaitopt`` as a shell would, with its one-line errors, but in this process."""

    def run(*arguments: str) -> Finished:
        monkeypatch.setattr(sys, "argv", ["gaitopt", *arguments])
        capsys.readouterr()
        with pytest.raises(SystemExit) as exit_:
            main()
        return Finished(int(exit_.value.code or 0), *capsys.readouterr())

    return run


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Commands write no figures: drawing takes most of their time, and other tests look at them."""
    monkeypatch.setattr(crawl_figures, "save_figures", lambda *a, **k: [])
    monkeypatch.setattr(gait_figures, "save_gait_figures", lambda *a, **k: [])


@pytest.fixture(scope="module")
def plan_file(short_plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a short walk, in a folder of its own."""
    path = tmp_path_factory.mktemp("plan") / "plan.npz"
    short_plan.save(path)
    return path
