"""A scene as commands for meshcat's viewer, which is used without its server."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from typing import Any

import numpy as np

from gaitopt.viewing.replay.scene import (
    Appearance,
    Ball,
    Box,
    Cylinder,
    Dots,
    Draped,
    Part,
    Relief,
    Scene,
    Segments,
    Shape,
    Surface,
    Track,
)

FLOAT32 = 0x17
"""MessagePack extension type that meshcat's viewer reads as a JavaScript Float32Array."""

_TYPES = {"position": "vector3", "quaternion": "quaternion", "visible": "boolean"}
"""Types of three.js for the kinds of tracks."""
_Y_TO_Z = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""Turns y to z: cylinders of three.js are along y, those of URDFs along z."""
CYLINDER_SIDES = 32
"""Flat sides of a cylinder. Chosen here: enough to look round."""


def commands(scene: Scene) -> list[bytes]:
    """The scene as messages for the viewer's ``handle_command_bytearray``, in this order.

    Height maps and what lies on them are left out: they are in
    :func:`gaitopt.viewing.replay.ground.encoding.ground_data`. The same scene always gives the same
    bytes.
    """
    import umsgpack
    from meshcat.commands import SetAnimation, SetProperty, SetTransform
    from meshcat.path import Path

    lowered: list[dict[str, Any]] = [
        SetProperty("visible", False, Path((name,))).lower() for name in ("Grid", "Axes")
    ]
    names = (f"id{i}" for i in count())
    for node in scene.nodes:
        parts = [p for p in node.parts if not isinstance(p.shape, Relief | Draped | Dots)]
        if parts:
            path = Path(node.path).lower()
            lowered.append({"type": "set_object", "object": _group(parts, names), "path": path})
        lowered.append(SetTransform(node.pose, Path(node.path)).lower())
    lowered.append(SetAnimation(_Animation(scene), play=False).lower())
    return [umsgpack.packb(_plain(command)) for command in lowered]


class _Animation:
    """The tracks of a scene, for ``meshcat.commands.SetAnimation``.

    meshcat's own ``Animation`` writes each key as an object. three.js also reads arrays of times
    and values, which take a quarter of the bytes.
    """

    def __init__(self, scene: Scene) -> None:
        self.tracks: dict[tuple[str, ...], list[Track]] = {}
        for track in scene.tracks:
            self.tracks.setdefault(track.path, []).append(track)

    def lower(self) -> list[dict[str, Any]]:
        """The animation as dictionaries; the name is that of meshcat's protocol."""
        return [
            {
                "path": "/" + "/".join(path),
                "clip": {"fps": 1, "name": "motion", "tracks": [_lower_track(t) for t in tracks]},
            }
            for path, tracks in self.tracks.items()
        ]


def _lower_track(track: Track) -> dict[str, Any]:
    """One track as a dictionary."""
    values = track.values
    return {
        "name": f".{track.kind}",
        "type": _TYPES[track.kind],
        "times": _floats(track.times),
        "values": [bool(v) for v in values] if track.kind == "visible" else _floats(values),
    }


def _group(parts: list[Part], names: Iterator[str]) -> dict[str, Any]:
    """The parts of a node as one group of three.js; equal shapes and materials occur once."""
    data: dict[str, Any] = {"metadata": {"version": 4.5, "type": "Object"}}
    data |= {"geometries": [], "materials": []}
    known: dict[Any, str] = {}
    children = []
    for part in parts:
        style = (
            part.appearance,
            isinstance(part.shape, Segments),
            getattr(part.shape, "smooth", True),
        )
        if part.shape not in known:
            known[part.shape] = _add(data, _geometry(part.shape), next(names))
            if isinstance(part.shape, Surface) and part.appearance.lit and part.shape.smooth:
                data["geometries"][-1]["data"]["attributes"]["normal"] = _normals(part.shape)
        if style not in known:
            known[style] = _add(data, _material(*style), next(names))
        children.append(_child(part, known[part.shape], known[style], next(names)))
    data["object"] = {"uuid": next(names), "type": "Group", "children": children}
    return data


def _add(data: dict[str, Any], element: Any, name: str) -> str:
    """Add a geometry or material of meshcat to a group, with our name instead of a random one."""
    element.uuid = name
    element.lower_in_object(data)
    return name


def _child(part: Part, geometry: str, material: str, name: str) -> dict[str, Any]:
    """One part of a group."""
    pose = part.pose @ _Y_TO_Z if isinstance(part.shape, Cylinder) else part.pose
    return {
        "uuid": name,
        "type": "LineSegments" if isinstance(part.shape, Segments) else "Mesh",
        "geometry": geometry,
        "material": material,
        "matrix": [float(x) for x in pose.T.ravel()],
        "castShadow": part.appearance.casts_shadow,
        "receiveShadow": part.appearance.lit,
        "renderOrder": part.appearance.layer,
    }


def _geometry(shape: Shape) -> Any:
    """A shape as a geometry of meshcat."""
    from meshcat import geometry

    if isinstance(shape, Box):
        return geometry.Box(list(shape.size))
    if isinstance(shape, Ball):
        return geometry.Sphere(shape.radius)
    if isinstance(shape, Cylinder):
        cylinder = geometry.Cylinder(shape.length, shape.radius)
        cylinder.radialSegments = CYLINDER_SIDES
        return cylinder
    if isinstance(shape, Segments):
        return geometry.PointsGeometry(np.ascontiguousarray(shape.points.T, dtype=np.float32))
    assert isinstance(shape, Surface)
    return geometry.TriangularMeshGeometry(shape.vertices, shape.faces)


def _material(appearance: Appearance, thin: bool, smooth: bool) -> Any:
    """A material of meshcat: of ``thin`` lines, or of surfaces that look ``smooth`` or flat."""
    from meshcat import geometry

    kind = geometry.LineBasicMaterial if thin else geometry.MeshBasicMaterial
    extra: dict[str, Any] = {}
    if appearance.lit and not thin:
        kind = geometry.MeshPhongMaterial
        extra = {"shininess": 35, "specular": 0x2A2A2A, "flatShading": not smooth}
    if appearance.opacity < 1 or appearance.layer < 0:
        # Flat marks lie upon each other: one that is drawn first must not hide a later one.
        extra["depthWrite"] = False
    return kind(color=int(appearance.colour.lstrip("#"), 16), opacity=appearance.opacity, **extra)


def _normals(surface: Surface) -> dict[str, Any]:
    """Normals at the vertices of a smooth surface: means over their triangles, weighted by area."""
    from meshcat.geometry import pack_numpy_array

    a, b, c = (surface.vertices[surface.faces[:, i]] for i in range(3))
    out = np.zeros_like(surface.vertices, dtype=np.float64)
    for corner in range(3):
        np.add.at(out, surface.faces[:, corner], np.cross(b - a, c - a))
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-30)
    return dict(pack_numpy_array(out.T))


def _floats(array: Any) -> Any:
    """Numbers as a Float32Array."""
    import umsgpack

    flat = np.ascontiguousarray(array, dtype="<f4").ravel()
    return umsgpack.Ext(FLOAT32, flat.tobytes())


def _plain(value: Any) -> Any:
    """The same with numbers of Python instead of NumPy's, which cannot be packed."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return value.item() if isinstance(value, np.generic) else value
