"""A scene as commands for meshcat's viewer, which is used without its server."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import count
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.viewing.meshcat_parts import meshcat_module
from gaitopt.viewing.replay.numbers import packed
from gaitopt.viewing.replay.passing import passing_paths
from gaitopt.viewing.replay.scene import (
    Appearance,
    Ball,
    Box,
    Cylinder,
    Dots,
    Draped,
    Part,
    Polygon,
    Relief,
    Scene,
    Segments,
    Shape,
    Surface,
    Track,
    Tubes,
)

TIME_UNIT, VALUE_UNIT, QUATERNION_UNIT = 1e-6, 1e-5, 1e-6
"""Units in which keyframes are written [s], [m] or [rad], and of quaternions. Chosen: a tenth of
the replay's tolerances; in half a unit of time a joint at 30 rad/s turns by 0.02 mrad."""
SAME_PLANE = 1e-9
"""Turns about one axis are quaternions in a plane; this is rounding."""

_Y_TO_Z = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""Turns y to z: cylinders of three.js are along y, those of URDFs along z."""
MADE_THERE = Relief | Draped | Dots | Tubes | Polygon
"""Shapes whose triangles the browser makes."""
CYLINDER_SIDES = 32
"""Flat sides of a cylinder. Chosen here: enough to look round."""


def commands(scene: Scene) -> list[bytes]:
    """The scene as messages for the viewer's ``handle_command_bytearray``, in this order.

    Parts whose triangles the browser makes are left out: they are in
    :func:`gaitopt.viewing.replay.ground.encoding.ground_data`. So are frames that are shown for
    some time only, and keyframes. The same scene always gives the same bytes.
    """
    import umsgpack

    command, place = meshcat_module("commands"), meshcat_module("path").Path
    lowered: list[dict[str, Any]] = [
        command.SetProperty("visible", False, place((name,))).lower() for name in ("Grid", "Axes")
    ]
    names = (f"id{i}" for i in count())
    hidden = passing_paths(scene)
    for node in scene.nodes:
        if node.path in hidden:
            continue
        parts = [p for p in node.parts if not isinstance(p.shape, MADE_THERE)]
        if parts:
            path = place(node.path).lower()
            lowered.append({"type": "set_object", "object": _group(parts, names), "path": path})
        lowered.append(command.SetTransform(node.pose, place(node.path)).lower())
    return [umsgpack.packb(_plain(each)) for each in lowered]


def track_data(track: Track) -> dict[str, Any]:
    """The keyframes of a frame for the page's script; ``motion.js`` moves frames along them.

    Turns about a fixed axis, which are those of joints, are one angle a key.
    """
    values = np.asarray(track.values, dtype=np.float64)
    kind, plane = str(track.kind), None
    if kind == "quaternion":
        found = _in_a_plane(values)
        if found is not None:
            kind, (plane, values) = "turn", found
    unit = QUATERNION_UNIT if kind == "quaternion" else VALUE_UNIT
    out = {"frame": list(track.path), "kind": kind, "times": packed(track.times, TIME_UNIT),
           "values": packed(values, unit)}  # fmt: skip
    return out if plane is None else {**out, "plane": plane}


def _in_a_plane(turns: FloatArray) -> tuple[list[list[float]], FloatArray] | None:
    """Two orthonormal quaternions, and the angles ``(k,)`` from the first one towards the second.

    ``None`` where the turns ``(k, 4)`` have no common axis.
    """
    first = turns[0] / np.linalg.norm(turns[0])
    rest = turns - np.outer(turns @ first, first)
    largest = rest[np.argmax(np.linalg.norm(rest, axis=1))]
    if np.linalg.norm(largest) < SAME_PLANE:
        return [first.tolist(), [0.0] * 4], np.zeros(len(turns))
    second = largest / np.linalg.norm(largest)
    beside = rest - np.outer(rest @ second, second)
    if np.abs(beside).max() > SAME_PLANE:
        return None
    # From key to key by the shorter way, as slerp takes it: a quaternion equals its opposite.
    angles = np.unwrap(np.arctan2(turns @ second, turns @ first), period=np.pi)
    return [first.tolist(), second.tolist()], angles


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
    geometry = meshcat_module("geometry")
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
    geometry = meshcat_module("geometry")
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
    a, b, c = (surface.vertices[surface.faces[:, i]] for i in range(3))
    out = np.zeros_like(surface.vertices, dtype=np.float64)
    for corner in range(3):
        np.add.at(out, surface.faces[:, corner], np.cross(b - a, c - a))
    out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-30)
    return dict(meshcat_module("geometry").pack_numpy_array(out.T))


def _plain(value: Any) -> Any:
    """The same with numbers of Python instead of NumPy's, which cannot be packed."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return value.item() if isinstance(value, np.generic) else value
