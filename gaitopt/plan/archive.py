"""Plan files: an ``.npz`` of plain arrays and one JSON header. Loading one executes nothing."""

from __future__ import annotations

import io
import json
import zipfile
from typing import Any

import numpy as np

from gaitopt.errors import PlanFileError

FORMAT = "gaitopt-plan"
VERSION = 1
"""Version of files with what every version of gaitopt understands."""
GROUND_VERSION = 2
"""Version of files whose footholds have more than places and a radius."""
ENTRY_VERSION = 3
"""Version of files whose plans begin in a given state."""
FILE_LIMIT = 300_000_000
"""Most bytes of a plan file that are read."""
CONTENT_LIMIT = 1_000_000_000
"""Most bytes that a plan file may unpack to."""

_ARRAYS = ("footholds", "times", "coefficients")
_FURTHER_ARRAYS = ("normals", "friction", "swing_heights", "postures", "body_places", "ground")


def version_of(ground: bool, entry: bool) -> int:
    """The oldest version of files that holds all of a plan.

    Args:
        ground: whether its footholds have more than places and a radius.
        entry: whether it begins in a given state.
    """
    if entry:
        return ENTRY_VERSION
    return GROUND_VERSION if ground else VERSION


def _unpack(data: bytes, name: str) -> tuple[dict[str, Any], dict[str, Any]]:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        content = sum(entry.file_size for entry in archive.infolist())
        if content > CONTENT_LIMIT:
            raise PlanFileError(
                f"{name} would unpack to {content / 1e9:.1f} GB; at most {CONTENT_LIMIT / 1e9:.0f} "
                "GB are read"
            )
        broken = archive.testzip()
        if broken:
            raise PlanFileError(f"{name}: the part {broken} is damaged; ask for the file again")
    with np.load(io.BytesIO(data), allow_pickle=False) as stored:
        missing = [key for key in ("header", *_ARRAYS) if key not in stored]
        if missing:
            raise PlanFileError(f"{name} is no plan file: it has no part {', '.join(missing)}")
        header = json.loads(stored["header"].tobytes().decode("utf-8"))
        if not isinstance(header, dict) or header.get("format") != FORMAT:
            raise PlanFileError(f"{name} is no plan file: its header is of another kind")
        if header.get("version") not in (VERSION, GROUND_VERSION, ENTRY_VERSION):
            raise PlanFileError(
                f"{name} is a plan of version {header.get('version')!r}; this gaitopt reads "
                f"versions {VERSION} to {ENTRY_VERSION}"
            )
        further = [key for key in _FURTHER_ARRAYS if key in stored]
        return header, {key: stored[key] for key in (*_ARRAYS, *further)}
