"""A scene as pure data: solids on a tree of frames, and keyframes that move or hide the frames.

Planner's results are turned into a :class:`Scene` by ``robot_scene.py`` (what walks) and
``route_scene.py`` (what it walks on); ``page.py`` writes a scene as HTML. Scenes add up with
:func:`joined`, so that several robots, or obstacles, can share a page.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray

FramePath = tuple[str, ...]
"""Names from the root of the tree to a frame. A frame moves with the frames above it."""


@dataclass(frozen=True)
class Box:
    """A box around the origin, ``size`` along x, y, z [m]."""

    size: tuple[float, float, float]


@dataclass(frozen=True)
class Ball:
    """A ball around the origin [m]."""

    radius: float


@dataclass(frozen=True)
class Cylinder:
    """A cylinder around the origin, its axis along z [m]."""

    radius: float
    length: float


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles: ``vertices (n, 3)`` [m] and ``faces (m, 3)``, indices of their corners.

    A ``smooth`` surface is shaded as if it were round across its edges.
    """

    vertices: FloatArray
    faces: np.ndarray
    smooth: bool = True


@dataclass(frozen=True, eq=False)
class Segments:
    """Thin lines: ``points (2 k, 3)`` [m], the ends of each segment one after the other."""

    points: FloatArray


Shape = Box | Ball | Cylinder | Surface | Segments


@dataclass(frozen=True)
class Look:
    """How a shape is painted.

    Attributes:
        colour: ``"#rrggbb"``.
        opacity: 1 opaque, 0 invisible.
        lit: whether light and shadow fall on it; marks and lines are drawn in their plain colour.
        casts: whether it casts a shadow.
        layer: order of drawing. What lies below zero is a backdrop, which hides nothing.
    """

    colour: str
    opacity: float = 1.0
    lit: bool = True
    casts: bool = True
    layer: int = 0


@dataclass(frozen=True, eq=False)
class Part:
    """A shape with its look and its pose ``(4, 4)`` in the frame that carries it."""

    shape: Shape
    look: Look
    pose: FloatArray = field(default_factory=lambda: np.eye(4))


@dataclass(frozen=True, eq=False)
class Node:
    """A frame of the tree: its pose ``(4, 4)`` in the frame above, and what it carries."""

    path: FramePath
    parts: tuple[Part, ...] = ()
    pose: FloatArray = field(default_factory=lambda: np.eye(4))


@dataclass(frozen=True, eq=False)
class Track:
    """Keyframes of one property of one frame.

    Attributes:
        path: the frame.
        kind: ``"position"`` ``(k, 3)`` [m], joined by straight lines; ``"quaternion"`` ``(k, 4)``
            in the order x, y, z, w, joined by turning about one axis at constant speed (slerp); or
            ``"visible"`` ``(k,)``, which holds until the next key.
        times: ``(k,)`` [s], not decreasing. Two keys at one time make a jump.
        values: see ``kind``; before the first and after the last key its value holds.
    """

    path: FramePath
    kind: Literal["position", "quaternion", "visible"]
    times: FloatArray
    values: FloatArray | BoolArray


@dataclass(frozen=True, eq=False)
class Scene:
    """Frames and keyframes.

    Attributes:
        nodes: the frames, each after the frame above it.
        tracks: the keyframes.
        duration: of the motion [s].
    """

    nodes: tuple[Node, ...]
    tracks: tuple[Track, ...] = ()
    duration: float = 0.0


def joined(scenes: Iterable[Scene]) -> Scene:
    """All scenes in one; it lasts as long as the longest."""
    every = tuple(scenes)
    return Scene(
        nodes=tuple(node for scene in every for node in scene.nodes),
        tracks=tuple(track for scene in every for track in scene.tracks),
        duration=max((scene.duration for scene in every), default=0.0),
    )


def pose(translation: Iterable[float], rotation: FloatArray | None = None) -> FloatArray:
    """A pose ``(4, 4)`` from a translation ``(3,)`` [m] and a rotation matrix ``(3, 3)``."""
    out = np.eye(4)
    out[:3, 3] = np.asarray(list(translation), dtype=np.float64)
    if rotation is not None:
        out[:3, :3] = rotation
    return out


def shown_during(path: FramePath, start: float, end: float, duration: float) -> Track:
    """A track that shows a frame from ``start`` to ``end`` [s] of a motion of ``duration``."""
    times, values = [start], [True]
    if start > 0:
        times, values = [0.0, start], [False, True]
    if end < duration:
        times, values = [*times, end], [*values, False]
    return Track(path, "visible", np.array(times), np.array(values))
