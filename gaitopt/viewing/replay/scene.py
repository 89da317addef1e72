"""A scene as data: solids on a tree of frames, and keyframes that move or hide the frames.

The files ``*_scene.py`` make scenes of a plan: of its robot, terrain, obstacles, and support
polygons. ``page.py`` writes a scene as HTML. Several scenes are put together with :func:`joined`.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

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

    A ``smooth`` surface is shaded as if it had no edges.
    """

    vertices: FloatArray
    faces: np.ndarray
    smooth: bool = True


@dataclass(frozen=True, eq=False)
class Segments:
    """Thin lines: ``points (2 k, 3)`` [m] are both ends of each line in turn."""

    points: FloatArray


@dataclass(frozen=True, eq=False)
class Dots:
    """Square dots ``size`` [m] wide at ``points (n, 3)`` [m]."""

    points: FloatArray
    size: float


@dataclass(frozen=True, eq=False)
class Heights:
    """A height map that is drawn.

    Attributes:
        z: heights ``(nx, ny)`` [m]; NaN where nothing is drawn.
        step: distance of the points [m].
        origin: x and y of ``z[0, 0]`` [m].
    """

    z: FloatArray
    step: float
    origin: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Relief:
    """The surface of a height map; the browser makes its triangles.

    Without ``codes`` it is coloured by height. With them ``(nx, ny)`` it is a thin cover, and the
    cell around each point has the colour ``palette[code]``.
    """

    heights: Heights
    codes: NDArray[np.uint8] | None = None
    palette: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Draped:
    """Convex polygons, each ``(n, 2)`` [m], laid upon the surface of a height map."""

    heights: Heights
    polygons: tuple[FloatArray, ...]


@dataclass(frozen=True, eq=False)
class Tubes:
    """Round tubes with open ends of a radius [m] along polylines, each ``(n, 3)`` [m], n >= 2.

    The browser makes their triangles.
    """

    lines: tuple[FloatArray, ...]
    radius: float


@dataclass(frozen=True, eq=False)
class Polygon:
    """A convex polygon ``vertices (n, 3)`` [m], counter-clockwise, n >= 3.

    With a ``border`` it is only a strip of this width along its sides, on the inside [m]. The
    browser makes its triangles.
    """

    vertices: FloatArray
    border: float = 0.0


Shape = Box | Ball | Cylinder | Surface | Segments | Dots | Relief | Draped | Tubes | Polygon


@dataclass(frozen=True)
class Appearance:
    """Colour and shading of a shape.

    Attributes:
        colour: ``"#rrggbb"``.
        opacity: from 0, invisible, to 1, opaque.
        lit: whether light and shadows change its colour, which they do not for marks and lines.
        casts_shadow: whether it casts a shadow.
        layer: order of drawing; higher ones are drawn later. Shapes in layers below zero are
            background, which hides nothing.
    """

    colour: str
    opacity: float = 1.0
    lit: bool = True
    casts_shadow: bool = True
    layer: int = 0


@dataclass(frozen=True, eq=False)
class Part:
    """A shape with its appearance, and its pose ``(4, 4)`` in the frame to which it belongs."""

    shape: Shape
    appearance: Appearance
    pose: FloatArray = field(default_factory=lambda: np.eye(4))


@dataclass(frozen=True, eq=False)
class Node:
    """A frame of the tree: its pose ``(4, 4)`` in the frame above it, and its parts."""

    path: FramePath
    parts: tuple[Part, ...] = ()
    pose: FloatArray = field(default_factory=lambda: np.eye(4))


@dataclass(frozen=True, eq=False)
class Track:
    """Keyframes of one property of one frame.

    Attributes:
        path: the frame.
        kind: ``"position"``: values ``(k, 3)`` [m] with straight lines between them;
            ``"quaternion"``: values ``(k, 4)`` in the order x, y, z, w, with a turn about one axis
            at constant speed between them (slerp); or ``"visible"``: values ``(k,)``, each valid
            until the next key.
        times: of the keys ``(k,)`` [s], not decreasing. Two keys at the same time make a jump.
        values: of the keys. The first and the last one also hold before and after the keys.
    """

    path: FramePath
    kind: Literal["position", "quaternion", "visible"]
    times: FloatArray
    values: FloatArray | BoolArray


@dataclass(frozen=True, eq=False)
class Scene:
    """Frames and keyframes.

    Attributes:
        nodes: the frames; each comes after the frame above it.
        tracks: the keyframes.
        duration: of the motion [s].
    """

    nodes: tuple[Node, ...]
    tracks: tuple[Track, ...] = ()
    duration: float = 0.0


def joined(scenes: Iterable[Scene]) -> Scene:
    """One scene with the contents of all, as long as the longest of them."""
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
    """A track that shows a frame only from ``start`` to ``end`` [s] of a motion.

    ``duration`` is that of the motion [s].
    """
    times, values = [start], [True]
    if start > 0:
        times, values = [0.0, start], [False, True]
    if end < duration:
        times, values = [*times, end], [*values, False]
    return Track(path, "visible", np.array(times), np.array(values))
