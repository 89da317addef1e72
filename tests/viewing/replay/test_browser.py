"""A replay in the browser: one private file, opened as it is, without a server."""

from __future__ import annotations

import os
import stat
import tempfile
import threading
import webbrowser
from pathlib import Path
from urllib.parse import unquote, urlparse

import pytest

import gaitopt
from gaitopt.errors import InputError
from gaitopt.viewing.replay.browser import open_in_browser, view
from gaitopt.viewing.replay.replay import replay_html


@pytest.fixture(scope="module")
def walk() -> gaitopt.Plan:
    return gaitopt.plan_crawl(
        gaitopt.load_robot("wang2020"),
        gaitopt.s_columns(0, columns=2, forward=0.09),
        timing="velocity",
    )


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """What the browser was asked to open; temporary files go to ``tmp_path``."""
    addresses: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda url: not addresses.append(url))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return addresses


def test_the_browser_opens_the_replay_from_a_file(walk: gaitopt.Plan, opened: list[str]) -> None:
    path = view(walk, title="a walk")
    (url,) = opened
    assert urlparse(url).scheme == "file" and Path(unquote(urlparse(url).path)) == path
    assert path.read_text("utf-8") == replay_html(walk, title="a walk")
    assert path.suffix == ".html"


def test_nobody_else_can_read_the_file(walk: gaitopt.Plan, opened: list[str]) -> None:
    before = os.umask(0)
    try:
        path = view(walk)
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_no_server_runs_and_each_view_is_a_file_of_its_own(
    walk: gaitopt.Plan, opened: list[str], tmp_path: Path
) -> None:
    threads = set(threading.enumerate())
    paths = {view(walk), view(walk)}
    assert len(paths) == 2 and set(tmp_path.iterdir()) == paths
    assert set(threading.enumerate()) == threads


def test_the_folder_may_be_chosen_and_its_name_be_any(
    walk: gaitopt.Plan, opened: list[str], tmp_path: Path
) -> None:
    folder = tmp_path / "Läufe #1 100%"
    folder.mkdir()
    path = view(walk, folder=folder)
    assert path.parent == folder
    assert Path(unquote(urlparse(opened[0]).path)) == path and not urlparse(opened[0]).fragment


def test_a_folder_that_is_missing_is_named(walk: gaitopt.Plan, opened: list[str]) -> None:
    with pytest.raises(InputError, match=r"cannot write a replay into nowhere: .*give folder="):
        view(walk, folder="nowhere")
    assert opened == []


def test_a_relative_path_is_opened_from_anywhere(
    opened: list[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    assert open_in_browser("walk.html")
    assert opened == [(tmp_path / "walk.html").as_uri()]
