"""The process in which cases run: ``python -m benchmarks.fuzz.child KIND SEED FIRST LAST``.

It writes a line before and after each case, so that its parent knows which case never ends.
"""

from __future__ import annotations

import importlib
import json
import os
import resource
import sys
import tempfile
import warnings

MEMORY = 6_000_000_000
"""Most memory that a case may ask for [bytes]: libraries ask for several gigabytes of addresses
before anything is computed."""


def main() -> None:
    """Run some cases, and report each."""
    kind, seed, first, last = sys.argv[1], *map(int, sys.argv[2:5])
    told = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    os.dup2(1, 2)
    os.environ["MPLBACKEND"] = "agg"
    warnings.simplefilter("ignore")
    kinds = importlib.import_module(f"benchmarks.fuzz.{kind}")
    cases = chosen(kinds.cases(), seed)
    # Wrong paths may be right ones: what is written then does not stay here.
    os.chdir(tempfile.mkdtemp(prefix="gaitopt-fuzz-"))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    for index in range(first, min(last, len(cases))):
        print(json.dumps([index, "begin", cases[index]]), file=told)
        found = kinds.run(cases[index])
        print(json.dumps([index, found.kind, found.words[:300]]), file=told)


def chosen(cases: list, seed: int) -> list:  # type: ignore[type-arg]
    """The cases in an order of a seed."""
    import random

    return random.Random(seed).sample(cases, len(cases))


if __name__ == "__main__":
    main()
