"""A scene in the words of meshcat's viewer: packed commands, without any server."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from typing import Any

import numpy as np

from gaitopt.viewing.replay.scene import (
    Ball,
    Box,
    Cylinder,
    Look,
    Node,
    Part,
    Scene,
    Segments,
    Shape,
    Surface,
    Track,
)

FLOAT32 = 0x17
"""MessagePack extension type that meshcat's viewer reads as a JavaScript Float32Array."""

_TYPES = {"position": "vector3", "quaternion": "quaternion", "visible": "boolean"}
_STAND_UP = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""three.js draws cylinders along y, URDFs along z."""


def commands(scene: Scene) -> list[bytes]:
    """The scene as messages for ``viewer.handle_command_bytearray``, to be handled in order.

    The same scene gives the same bytes.
    """
    import umsgpack
    from meshcat.commands import SetAnimation, SetProperty, SetTransform
    from meshcat.path import Path

    lowered: list[dict[str, Any]] = [
        SetProperty("visible", False, Path((name,))).lower() for name in ("Grid", "Axes")
    ]
    names = (f"id{i}" for i in count())
    for node in scene.nodes:
        if node.parts:
            path = Path(node.path).lower()
            lowered.append({"type": "set_object", "object": _group(node, names), "path": path})
        lowered.append(SetTransform(node.pose, Path(node.path)).lower())
    lowered.append(SetAnimation(_Clips(scene), play=False).lower())
    return [umsgpack.packb(_plain(command)) for command in lowered]


class _Clips:
    """What ``meshcat.commands.SetAnimation`` asks of an animation: to be lowered.

    meshcat's own ``Animation`` spells out each key; three.js reads arrays of times and values as
    well, in a quarter of the bytes.
    """

    def __init__(self, scene: Scene) -> None:
        self.tracks: dict[tuple[str, ...], list[Track]] = {}
        for track in scene.tracks:
            self.tracks.setdefault(track.path, []).append(track)

    def lower(self) -> list[dict[str, Any]]:
        return [
            {
                "path": "/" + "/".join(path),
                "clip": {"fps": 1, "name": "motion", "tracks": [_lower_track(t) for t in tracks]},
            }
            for path, tracks in self.tracks.items()
        ]


def _lower_track(track: Track) -> dict[str, Any]:
    values = track.values
    return {
        "name": f".{track.kind}",
        "type": _TYPES[track.kind],
        "times": _floats(track.times),
        "values": [bool(v) for v in values] if track.kind == "visible" else _floats(values),
    }


def _group(node: Node, names: Iterator[str]) -> dict[str, Any]:
    """All parts of a node as one three.js group; equal shapes and looks are sent once."""
    data: dict[str, Any] = {"metadata": {"version": 4.5, "type": "Object"}}
    data |= {"geometries": [], "materials": []}
    known: dict[Any, str] = {}
    children = []
    for part in node.parts:
        style = (part.look, isinstance(part.shape, Segments), getattr(part.shape, "smooth", True))
        if part.shape not in known:
            known[part.shape] = _add(data, _geometry(part.shape), next(names))
            if isinstance(part.shape, Surface) and part.look.lit and part.shape.smooth:
                data["geometries"][-1]["data"]["attributes"]["normal"] = _normals(part.shape)
        if style not in known:
            known[style] = _add(data, _material(*style), next(names))
        children.append(_child(part, known[part.shape], known[style], next(names)))
    data["object"] = {"uuid": next(names), "type": "Group", "children": children}
    return data


def _add(data: dict[str, Any], element: Any, name: str) -> str:
    """Put a geometry or material of meshcat's among a group's, under a name of ours."""
    element.uuid = name
    element.lower_in_object(data)
    return name


def _child(part: Part, geometry: str, material: str, name: str) -> dict[str, Any]:
    pose = part.pose @ _STAND_UP if isinstance(part.shape, Cylinder) else part.pose
    return {
        "uuid": name,
        "type": "LineSegments" if isinstance(part.shape, Segments) else "Mesh",
        "geometry": geometry,
        "material": material,
        "matrix": [float(x) for x in pose.T.ravel()],
        "castShadow": part.look.casts,
        "receiveShadow": part.look.lit,
        "renderOrder": part.look.layer,
    }


def _geometry(shape: Shape) -> Any:
    from meshcat import geometry

    if isinstance(shape, Box):
        return geometry.Box(list(shape.size))
    if isinstance(shape, Ball):
        return geometry.Sphere(shape.radius)
    if isinstance(shape, Cylinder):
        made = geometry.Cylinder(shape.length, shape.radius)
        made.radialSegments = 32
        return made
    if isinstance(shape, Segments):
        return geometry.PointsGeometry(np.ascontiguousarray(shape.points.T, dtype=np.float32))
    return geometry.TriangularMeshGeometry(shape.vertices, shape.faces)


def _material(look: Look, thin: bool, smooth: bool) -> Any:
    from meshcat import geometry

    kind = geometry.LineBasicMaterial if thin else geometry.MeshBasicMaterial
    extra: dict[str, Any] = {}
    if look.lit and not thin:
        kind = geometry.MeshPhongMaterial
        extra = {"shininess": 35, "specular": 0x2A2A2A, "flatShading": not smooth}
    if look.opacity < 1 or look.layer < 0:
        # Flat marks lie on one another: what is drawn first must not hide what comes after.
        extra["depthWrite"] = False
    return kind(color=int(look.colour.lstrip("#"), 16), opacity=look.opacity, **extra)


def _normals(surface: Surface) -> dict[str, Any]:
    """Normals of a smooth surface's vertices: the mean of their triangles', by area."""
    from meshcat.geometry import pack_numpy_array

    a, b, c = (surface.vertices[surface.faces[:, i]] for i in range(3))
    out = np.zeros_like(surface.vertices, dtype=np.float64)
    for corner in range(3):
        np.add.at(out, surface.faces[:, corner], np.cross(b - a, c - a))
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-30)
    return dict(pack_numpy_array(out.T))


def _floats(array: Any) -> Any:
    import umsgpack

    flat = np.ascontiguousarray(array, dtype="<f4").ravel()
    return umsgpack.Ext(FLOAT32, flat.tobytes())


def _plain(value: Any) -> Any:
    """The same with NumPy's numbers turned into Python's, which is what can be packed."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return value.item() if isinstance(value, np.generic) else value
