"""Peak memory of one plan, as JSON: run by :mod:`benchmarks.table.fresh` in its own process."""

from __future__ import annotations

import json
import re
import resource
import sys
import tracemalloc
from pathlib import Path

import gaitopt
from benchmarks import walks


def process_peak() -> int:
    """Most memory that this process ever held at once [bytes].

    Linux passes ``ru_maxrss`` on from the process that started this one; its own is VmHWM.
    """
    status = Path("/proc/self/status")
    own = re.search(r"VmHWM:\s*(\d+) kB", status.read_text()) if status.exists() else None
    if own:
        return int(own[1]) * 1024
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


def main(steps: int) -> dict[str, int]:
    """Peak of the process after planning once, then of Python's and NumPy's own allocations."""
    robot, terrain = walks.robot(), walks.terrain(steps)
    gaitopt.plan_crawl(robot, terrain, timing="velocity")
    process = process_peak()
    tracemalloc.start()
    gaitopt.plan_crawl(robot, terrain, timing="velocity")
    return {"process": process, "plan": tracemalloc.get_traced_memory()[1]}


if __name__ == "__main__":
    print(json.dumps(main(int(sys.argv[1]))))
