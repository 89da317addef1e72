"""Expands one xacro file, in a process of its own: xacro evaluates expressions that a file holds.

Run as a script. It reads a JSON object from its input (``path``, ``arguments``, ``packages``) and
prints the URDF. It imports nothing of gaitopt, so that it starts quickly.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

MOST_MEMORY = 2_000_000_000
"""Most bytes of memory that the process may take."""
MOST_SECONDS = 60
"""Most seconds of computing time."""


def main() -> int:
    """Expand the file; the exit code is 0 if that worked."""
    try:
        import resource  # not on every system

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))
    except (ImportError, OSError, ValueError):
        pass
    from xacrodoc import XacroDoc, packages

    asked = json.load(sys.stdin)
    packages.update_package_cache(asked["packages"])
    document = XacroDoc.from_file(
        asked["path"], walk_up=False, subargs=asked["arguments"], resolve_packages=False
    )
    sys.stdout.write(document.dom.toxml())
    return 0


if __name__ == "__main__":
    # The folder of this script has modules whose names others need, too.
    sys.path[:] = [entry for entry in sys.path if Path(entry) != Path(__file__).parent]
    try:
        sys.exit(main())
    except Exception as error:  # whatever a file makes xacro raise is told to the user
        sys.stderr.write(f"{type(error).__name__}: {error}")
        sys.exit(1)
