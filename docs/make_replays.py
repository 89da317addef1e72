"""Make the replays of the gallery: ``python docs/make_replays.py go2_rubble``.

Each runs the command that ``docs/gallery.md`` shows below it, and keeps the page that the command
writes as ``docs/_static/replays/<name>.html``, which git ignores. Without a name all are made that
are missing or older than the code.
"""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

DOCS = Path(__file__).parent
FOLDER = DOCS / "_static" / "replays"
LARGEST = 5_000_000
"""Largest page of a replay [bytes]."""


def commands() -> dict[str, list[str]]:
    """The commands of the gallery, by the names of their replays."""
    text = (DOCS / "gallery.md").read_text("utf-8")
    found = re.findall(r"^```\{replay\} (\w+)\n:command: gaitopt (.+)$", text, flags=re.M)
    return {name: shlex.split(command) for name, command in found}


def make(name: str, command: list[str]) -> Path:
    """Run a command and keep its replay."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        subprocess.run([sys.executable, "-m", "gaitopt", *command, "--out", str(out)], check=True,
                       stdout=subprocess.DEVNULL)  # fmt: skip
        (page,) = out.glob("*.html")
        size = page.stat().st_size
        if size > LARGEST:
            raise SystemExit(f"{name}: the page has {size / 1e6:.1f} MB; take a shorter walk")
        FOLDER.mkdir(parents=True, exist_ok=True)
        return Path(shutil.copyfile(page, FOLDER / f"{name}.html"))


def is_new(page: Path) -> bool:
    """Whether a page is there, and newer than all of the code."""
    code = (DOCS.parent / "gaitopt").rglob("*.*")
    return page.is_file() and page.stat().st_mtime > max(p.stat().st_mtime for p in code)


def main(names: list[str]) -> None:
    """Make the named replays, or all that are not there."""
    known = commands()
    unknown = [name for name in names if name not in known]
    if unknown:
        raise SystemExit(f"unknown replay {unknown[0]!r}; known are {', '.join(known)}")
    for name in names or known:
        if names or not is_new(FOLDER / f"{name}.html"):
            page = make(name, known[name])
            print(f"{page.name}: {page.stat().st_size / 1e6:.2f} MB", flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
