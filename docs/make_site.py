"""Build the site with all its versions: ``python docs/make_site.py``.

Every tag ``v...`` of the repository gets a folder of its own in ``docs/_build/site``, and what is
in the working tree is ``latest``. Each page lists the versions at its top, once there are several.
A tag that was built before is not built again. Without tags there is only ``latest``.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).parents[1]
SITE = ROOT / "docs" / "_build" / "site"
LATEST = "latest"


def in_order(tags: Iterable[str]) -> list[str]:
    """Tags that are versions, as ``v0.10.1``, the newest first."""
    numbers = {tag: tuple(map(int, found[1].split(".")))
               for tag in tags if (found := re.fullmatch(r"v(\d+(?:\.\d+)*)", tag))}  # fmt: skip
    return sorted(numbers, key=lambda tag: numbers[tag], reverse=True)


def tags() -> list[str]:
    """The versions that the repository has."""
    listed = subprocess.run(["git", "tag", "--list", "v*"], cwd=ROOT, check=True,
                            capture_output=True, text=True)  # fmt: skip
    return in_order(listed.stdout.split())


def build(source: Path, version: str, versions: list[str]) -> None:
    """Build the pages of one version."""
    # The code of that version is the one whose functions the pages show.
    environment = {**os.environ, "GAITOPT_VERSIONS": ",".join(versions),
                   "PYTHONPATH": str(source)}  # fmt: skip
    subprocess.run([sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html",
                    str(source / "docs"), str(SITE / version)],
                   cwd=source, env=environment, check=True)  # fmt: skip


def build_tag(tag: str, versions: list[str]) -> None:
    """Build the pages of a tag from its own files."""
    with tempfile.TemporaryDirectory() as folder:
        archive = Path(folder) / "files.tar"
        subprocess.run(["git", "archive", "--output", str(archive), tag], cwd=ROOT, check=True)
        subprocess.run(["tar", "-xf", str(archive), "-C", folder], check=True)
        build(Path(folder), tag, versions)


def main() -> None:
    """Build what is missing, and the page that leads to the latest version."""
    known = tags()
    versions = [LATEST, *known]
    for tag in known:
        if not (SITE / tag / "index.html").is_file():
            build_tag(tag, versions)
    build(ROOT, LATEST, versions)
    (SITE / "index.html").write_text(
        f'<!DOCTYPE html><meta http-equiv="refresh" content="0; url={LATEST}/index.html">\n'
        f'<a href="{LATEST}/index.html">gaitopt</a>\n', "utf-8",
    )  # fmt: skip
    print(f"open {SITE / 'index.html'}: {', '.join(versions)}")


if __name__ == "__main__":
    main()
