"""Replays as videos."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from in_browser import needs_browser
from PIL import Image

import gaitopt
from gaitopt import InputError, MissingPackageError, Plan, SolverError
from gaitopt.viewing.replay.video import video
from gaitopt.viewing.replay.video.chromium import chromium
from gaitopt.viewing.replay.video.video import replay_video


@pytest.fixture(scope="module")
def plan() -> Plan:
    robot = gaitopt.load_robot("wang2020")
    return gaitopt.plan_crawl(robot, gaitopt.s_columns(3, columns=2), timing="velocity")


@needs_browser
def test_a_gif_shows_the_walk_from_its_start_to_its_end(plan: Plan, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    file = replay_video(plan, tmp_path / "walk.gif", seconds=1.0, rate=3.0, size=(320, 240),
                        view="no-shadows",
                        progress=lambda done, of: told.append((done, of)))  # fmt: skip
    assert told == [(1, 4), (2, 4), (3, 4), (4, 4)]
    assert [path.name for path in tmp_path.iterdir()] == ["walk.gif"]
    with Image.open(file) as picture:
        assert picture.size == (320, 240) and picture.n_frames == 4
        assert picture.info["loop"] == 0
        frames = []
        for number in range(4):
            picture.seek(number)
            frames.append(np.asarray(picture.convert("RGB"), dtype=float))
    for one, other in pairwise(frames):
        assert np.abs(one - other).max(axis=2).mean() > 0.5


def ffmpeg() -> str | None:
    try:
        return video.find_ffmpeg(".mp4")
    except MissingPackageError:
        return None


@needs_browser
@pytest.mark.skipif(ffmpeg() is None, reason="needs ffmpeg: pip install 'gaitopt[video]'")
@pytest.mark.parametrize("kind", [".mp4", ".webm"])
def test_videos_show_the_pictures_of_the_browser(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """ffmpeg reads the file again: as many frames as were drawn, each like its picture."""
    drawn: list[bytes] = []
    frames = video._frames

    def kept(*asked: Any) -> Iterator[bytes]:
        for data in frames(*asked):
            drawn.append(data)
            yield data

    monkeypatch.setattr(video, "_frames", kept)
    file = replay_video(plan, tmp_path / f"walk{kind}", seconds=0.5, rate=4.0, size=(200, 160),
                        view="no-shadows")  # fmt: skip
    assert [path.name for path in tmp_path.iterdir()] == [file.name]
    read = [ffmpeg() or "", "-loglevel", "error", "-i", str(file), "-f", "rawvideo",
            "-pix_fmt", "rgb24", "-"]  # fmt: skip
    pixels = subprocess.run(read, capture_output=True, check=True).stdout
    shown = np.frombuffer(pixels, np.uint8).reshape(-1, 160, 200, 3).astype(float)
    assert len(shown) == len(drawn) == 3
    pictures = np.stack([np.asarray(Image.open(BytesIO(data)).convert("RGB")) for data in drawn])
    distance = np.abs(shown[:, None] - pictures[None].astype(float)).mean(axis=(2, 3, 4))
    assert np.diag(distance).max() < 5.0
    assert (distance.argmin(axis=1) == np.arange(3)).all()


@needs_browser
def test_a_failing_ffmpeg_is_told_and_leaves_nothing(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    programs = tmp_path / "bin"
    programs.mkdir()
    (programs / "ffmpeg").write_text(
        "#!/bin/sh\ncat > /dev/null\necho no such encoder >&2\nexit 1\n"
    )
    (programs / "ffmpeg").chmod(0o755)
    monkeypatch.setenv("PATH", str(programs), prepend=os.pathsep)
    with pytest.raises(SolverError, match="ffmpeg failed: no such encoder"):
        replay_video(plan, tmp_path / "b.mp4", seconds=0.5, rate=2.0, size=(200, 160),
                     view="no-shadows")  # fmt: skip
    assert not (tmp_path / "b.mp4").exists()


def test_what_is_missing_is_told_in_one_line_with_its_cure(
    plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    programs, made = tmp_path / "bin", tmp_path / "made"
    programs.mkdir()
    made.mkdir()
    monkeypatch.setenv("PATH", str(programs))
    with pytest.raises(MissingPackageError, match=r"no Chromium .*'apt install chromium") as found:
        replay_video(plan, made / "walk.gif")
    assert "\n" not in str(found.value)
    (programs / "chromium").write_text("#!/bin/sh\nexit 0\n")
    (programs / "chromium").chmod(0o755)
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(MissingPackageError, match=r"no ffmpeg .*gaitopt\[video\].*\.gif"):
        replay_video(plan, made / "walk.mp4")
    # A program that is no browser ends at once, which is told and leaves nothing.
    with pytest.raises(SolverError, match="browser has ended"):
        replay_video(plan, made / "walk.gif", seconds=0.5)
    assert not list(made.iterdir())


def test_names_and_numbers_are_checked_first(plan: Plan, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"must end in \.gif, \.webp, \.mp4, \.webm"):
        replay_video(plan, tmp_path / "walk.avi")
    with pytest.raises(InputError, match="width must be an even number"):
        replay_video(plan, tmp_path / "walk.gif", size=(321, 200))
    with pytest.raises(InputError, match="at most 5000 frames"):
        replay_video(plan, tmp_path / "walk.gif", seconds=600.0, rate=30.0)
    with pytest.raises(InputError, match="rate must be"):
        replay_video(plan, tmp_path / "walk.gif", rate=0.0)


@needs_browser
def test_scripts_that_fail_are_errors() -> None:
    with chromium() as browser:
        browser.open("data:text/html,<body data-ready=yes>", (200, 200))
        assert browser.run("6 * 7") == 42
        with pytest.raises(SolverError, match="script failed"):
            browser.run("nothing.there")
