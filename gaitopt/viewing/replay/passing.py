"""Parts of a scene that are visible during some time only, as data for the page's ``passing.js``.

An example is the support polygon of a phase.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gaitopt.viewing.replay.ground.encoding import GroundData, part_data
from gaitopt.viewing.replay.scene import FramePath, Node, Scene

TIME_DIGITS = 6
"""Decimals of times [s]."""


def passing_paths(scene: Scene) -> set[FramePath]:
    """The frames of a scene that are visible during some time only."""
    return {track.path for track in scene.tracks if track.kind == "visible"}


def passing_data(scene: Scene, maps: GroundData) -> list[dict[str, Any]]:
    """These frames in groups: one for each parent frame, in the order of their times.

    Of a group at most one frame is visible at a time, for example the support polygon of the
    present phase.

    Args:
        scene: the scene.
        maps: takes height maps and points.
    """
    times = {t.path: _span(t.times, np.asarray(t.values, dtype=np.bool_), scene.duration)
             for t in scene.tracks if t.kind == "visible"}  # fmt: skip
    groups: dict[FramePath, list[dict[str, Any]]] = {}
    for node in scene.nodes:
        if node.path in times:
            groups.setdefault(node.path[:-1], []).append(_frame(node, *times[node.path], maps))
    return [
        {"frame": list(path), "frames": sorted(frames, key=lambda f: float(f["start"]))}
        for path, frames in groups.items()
    ]


def _frame(node: Node, start: float, end: float, maps: GroundData) -> dict[str, Any]:
    parts = [part_data(part, maps) for part in node.parts]
    return {
        "name": node.path[-1],
        "start": round(start, TIME_DIGITS),
        "end": round(end, TIME_DIGITS),
        "parts": [data for data in parts if data is not None],
    }


def _span(times: np.ndarray, shown: np.ndarray, duration: float) -> tuple[float, float]:
    """From when to when a track shows its frame [s].

    The end lies after ``duration`` where the track does not hide the frame again.
    """
    first = int(np.argmax(shown))
    later = np.flatnonzero(~shown[first:])
    end = float(times[first + later[0]]) if len(later) else duration + 1.0
    return float(times[first]), end
