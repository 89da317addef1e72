"""Files of ground with faults, of each kind that gaitopt writes or makes here."""

from __future__ import annotations

import io
from functools import cache
from typing import Any

import numpy as np

import gaitopt
from benchmarks.fuzz.calls import folder, ground
from benchmarks.fuzz.mutations import damaged, mutated
from benchmarks.fuzz.outcome import Outcome, outcome

CASES = 10_000


def cases() -> list[int]:
    """Seeds of the faults."""
    return list(range(CASES))


@cache
def _sound() -> dict[str, bytes]:
    """Sound files by their ending."""
    from PIL import Image

    z = np.add.outer(np.arange(12.0), np.arange(9.0)) / 100
    array, picture, tiff = io.BytesIO(), io.BytesIO(), io.BytesIO()
    np.save(array, z)
    Image.fromarray((z * 1000).astype(np.uint8)).save(picture, "PNG")
    Image.fromarray(z.astype(np.float32)).save(tiff, "TIFF")
    ground().save(folder() / "sound.npz")
    rows = "\n".join(f"{x:g},{y:g},{x * y:g}" for x in range(6) for y in range(5))
    obj = "".join(f"v {x} {y} {x * y / 50}\n" for x in range(3) for y in range(3))
    ply = ("ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\n"
           "property float z\nend_header\n" + obj.replace("v ", ""))  # fmt: skip
    stl = ("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
           "endloop\nendfacet\nendsolid a\n")  # fmt: skip
    return {
        "npy": array.getvalue(), "png": picture.getvalue(), "tif": tiff.getvalue(),
        "npz": (folder() / "sound.npz").read_bytes(), "csv": rows.encode(),
        "obj": (obj + "f 1 2 4\nf 2 5 4\n").encode(), "ply": ply.encode(), "stl": stl.encode(),
    }  # fmt: skip


def run(case: int) -> Outcome:
    """Read ground with faults."""
    endings = sorted(_sound())
    ending = endings[case % len(endings)]
    data = _sound()[ending]
    text = ending in ("csv", "obj", "ply", "stl") and case % 3
    data = mutated(data.decode(), case).encode("utf-8", "replace") if text else damaged(data, case)
    path = folder() / f"faulty.{ending}"
    path.write_bytes(data)
    options: dict[str, Any] = {"png": {"heights": (0.0, 0.2), "resolution": 0.1}, "npz": {}}.get(
        ending, {"resolution": 0.1}
    )
    return outcome(lambda: gaitopt.load_ground(path, **options), _nonsense)


def _nonsense(found: Any) -> str:
    if not np.isfinite(found.z[found.known]).all() or not found.known.any():
        return "heights that are no numbers"
    low, high = found.height_range
    return "" if max(abs(low), abs(high)) < 1e6 else "heights beyond all measure"
