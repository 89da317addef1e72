"""Replays as videos: each frame is the page itself, drawn by a browser without a window."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.errors import InputError, MissingPackageError, SolverError
from gaitopt.files import StrPath, written_whole
from gaitopt.inputs import as_text, check_kind, check_number
from gaitopt.plan.plan import Plan
from gaitopt.viewing.replay.replay import replay_html
from gaitopt.viewing.replay.video.chromium import chromium, find_browser

ENCODERS = {
    ".mp4": ("-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart"),
    ".webm": ("-c:v", "libvpx-vp9", "-pix_fmt", "yuv420p"),
}
"""What ffmpeg is asked for by the end of the file's name."""
PICTURES = (".gif", ".webp")
"""Animated pictures, which need no encoder."""
LONGEST = 20.0
"""Longest video where no length is asked for [s]. Chosen: as long as people look."""
RATES = {".gif": 12.0, ".webp": 15.0}
"""Frames a second of animated pictures, which are large; videos have 30."""
MOST_FRAMES = 5000
"""Most frames: a browser draws a few of them a second."""
COLOURS = 128
"""Colours of a frame of a GIF; it may have 256, and is smaller with fewer."""


def replay_video(
    plan: Plan,
    path: StrPath,
    *,
    seconds: float | None = None,
    rate: float | None = None,
    size: tuple[int, int] = (1280, 720),
    view: str = "follow",
    progress: Callable[[int, int], None] | None = None,
    **shown: Any,
) -> Path:
    """Write a plan's replay as a video.

    A browser without a window draws every frame, so the video shows what the page shows. It needs
    Chromium or Chrome; an ``.mp4`` or ``.webm`` needs ffmpeg, too: on the PATH, or that of
    ``pip install 'gaitopt[video]'``. Linux and macOS only.

    Args:
        plan: the motion.
        path: the file, whose name ends in .gif, .webp, .mp4 or .webm.
        seconds: length of the video [s]; that of the motion by default, at most 20.
        rate: frames a second; 12 in a GIF, 15 in a WebP, 30 otherwise.
        size: width and height [pixels], even numbers.
        view: what the address of a replay may say, as ``"follow&curves"`` or ``"view=side"``.
        progress: called with the frames that are done, and all frames.
        shown: ``title``, ``meshes``, ``simulated`` and ``search``, as for :func:`gaitopt.replay`.

    Returns:
        The path of the file.

    Raises:
        InputError: the end of the name is unknown, a number is out of range, or the file cannot be
            written.
        MissingPackageError: there is no browser, or no ffmpeg.
        SolverError: the browser or ffmpeg failed.
    """
    check_kind("plan", plan, Plan)
    if not isinstance(path, str | os.PathLike):
        raise InputError(f"path must be the name of a file, got {as_text(path)}")
    kind = Path(path).suffix.lower()
    if kind not in (*PICTURES, *ENCODERS):
        known = ", ".join((*PICTURES, *ENCODERS))
        raise InputError(f"a video's name must end in {known}, got {as_text(Path(path).name)}")
    for name, pixels in zip(("width", "height"), size, strict=True):
        if isinstance(pixels, bool) or not 100 <= int(pixels) <= 4000 or int(pixels) % 2:
            raise InputError(
                f"{name} must be an even number from 100 to 4000, got {as_text(pixels)}"
            )
    rate = RATES.get(kind, 30.0) if rate is None else check_number("rate", rate, 1.0, 120.0, "1/s")
    if seconds is None:
        seconds = min(max(plan.duration, 1.0), LONGEST)
    count = int(np.ceil(check_number("seconds", seconds, 0.1, 600.0, "s") * rate)) + 1
    if count > MOST_FRAMES:
        raise InputError(f"a video has at most {MOST_FRAMES} frames, and {seconds:g} s at {rate:g} "
                         f"a second are {count}: ask for less")  # fmt: skip
    find_browser()
    ffmpeg = None if kind in PICTURES else find_ffmpeg(kind)
    frames = _frames(replay_html(plan, **shown), count, size, view, progress)
    with written_whole(path, binary=True) as stream:
        if ffmpeg is None:
            _write_pictures(frames, stream, kind, rate)
        else:
            _encode(frames, stream, kind, rate, ffmpeg)
    return Path(path)


def find_ffmpeg(kind: str) -> str:
    """The path of ffmpeg: that on the PATH, or else that of the package imageio-ffmpeg.

    Raises:
        MissingPackageError: there is neither.
    """
    found = shutil.which("ffmpeg")
    if found is not None:
        return found
    try:
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        raise MissingPackageError(
            f"no ffmpeg to write {kind}: run \"pip install 'gaitopt[video]'\" or 'apt install "
            "ffmpeg', or name a .gif, which needs none"
        ) from error


def _frames(
    page: str, count: int, size: tuple[int, int], view: str,
    progress: Callable[[int, int], None] | None,
) -> Iterator[bytes]:  # fmt: skip
    """Pictures of a page at ``count`` times from its start to its end, as PNG files."""
    with tempfile.TemporaryDirectory(prefix="gaitopt-") as folder, chromium() as browser:
        file = Path(folder) / "replay.html"
        file.write_text(page, "utf-8")
        browser.open(f"{file.as_uri()}#paused&film&{view}", size)
        end = float(browser.run("window.gaitopt.duration"))
        for number, moment in enumerate(np.linspace(0.0, end, count).tolist()):
            browser.run(f"window.gaitopt.seek({moment}); window.gaitopt.draw()")
            yield browser.picture()
            if progress is not None:
                progress(number + 1, count)


def _write_pictures(frames: Iterator[bytes], stream: Any, kind: str, rate: float) -> None:
    """An animated picture of all frames."""
    from PIL import Image

    pictures = []
    for data in frames:
        image: Any = Image.open(BytesIO(data)).convert("RGB")
        if kind == ".gif":
            image = image.quantize(COLOURS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
        pictures.append(image)
    pictures[0].save(stream, format=kind[1:], save_all=True, append_images=pictures[1:],
                     duration=round(1e3 / rate), loop=0)  # fmt: skip


def _encode(frames: Iterator[bytes], stream: Any, kind: str, rate: float, ffmpeg: str) -> None:
    """A video of all frames, made by ffmpeg."""
    with tempfile.TemporaryDirectory(prefix="gaitopt-") as folder:
        made = Path(folder) / f"video{kind}"
        command = [ffmpeg, "-loglevel", "error", "-f", "image2pipe", "-c:v", "png",
                   "-framerate", f"{rate:g}", "-i", "-", *ENCODERS[kind], str(made)]  # fmt: skip
        with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
            assert process.stdin is not None
            try:
                for data in frames:
                    process.stdin.write(data)
                process.stdin.close()
            except BrokenPipeError:
                pass  # it has ended, and says why below
            said = b"" if process.stderr is None else process.stderr.read()
        if process.returncode or not made.is_file():
            raise SolverError(f"ffmpeg failed: {said.decode(errors='replace').strip()[-300:]}")
        with made.open("rb") as source:
            shutil.copyfileobj(source, stream)
