"""Print the lower bounds that pyproject.toml states, one a line.

``make lowest`` writes them to ``.ci/lowest.txt`` after its tests have passed with these versions. A
test of the suite compares both, so bounds do not change unnoticed. It compares texts: that the file
was written by that command, it cannot know.
"""

from __future__ import annotations

import re
from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"


def bounds(text: str) -> list[str]:
    """The requirements with a lower bound in the text of a pyproject.toml, sorted."""
    python = re.findall(r'^requires-python = "(.+)"', text, re.MULTILINE)
    needed = re.findall(r'"([A-Za-z][\w-]*(?:\[[\w,-]+\])?[><=!~].*?)"', text)
    return sorted({f"python{version}" for version in python} | set(needed))


if __name__ == "__main__":
    print(*bounds(PROJECT.read_text("utf-8")), sep="\n")
