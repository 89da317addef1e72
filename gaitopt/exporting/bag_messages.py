"""Messages of ROS 2, made without ROS."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import UnknownNameError
from gaitopt.terrain.height_map import HeightMap

GRID_MAP: Final = {
    "grid_map_msgs/msg/GridMapInfo": (
        "float64 resolution\nfloat64 length_x\nfloat64 length_y\ngeometry_msgs/Pose pose\n"
    ),
    "grid_map_msgs/msg/GridMap": (
        "std_msgs/Header header\ngrid_map_msgs/GridMapInfo info\nstring[] layers\n"
        "string[] basic_layers\nstd_msgs/Float32MultiArray[] data\nuint16 outer_start_index\n"
        "uint16 inner_start_index\n"
    ),
}
"""Fields of the messages that ROS itself does not have."""
NUMBERS: Final = {
    "float64": np.float64, "float32": np.float32, "uint8": np.uint8, "int32": np.int32,
    "uint16": np.uint16, "uint32": np.uint32, "bool": np.bool_,
}  # fmt: skip


class Messages:
    """Makes messages from plain values; fields that are not given are zero or empty."""

    def __init__(self) -> None:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        # Its messages are those of later releases, too.
        self.store: Any = get_typestore(Stores.ROS2_HUMBLE)
        for name, text in GRID_MAP.items():
            self.store.register(get_types_from_msg(text, name))

    def make(self, name: str, values: Mapping[str, Any]) -> Any:
        """A message of the type ``name``, with the fields in ``values``.

        Raises:
            UnknownNameError: the message has no such field.
        """
        from rosbags.interfaces import Nodetype

        fields = dict(self.store.fielddefs[name][1])
        unknown = set(values) - set(fields)
        if unknown:
            raise UnknownNameError(f"{name} has no field {sorted(unknown)[0]}")
        made = {}
        for field, (kind, inside) in fields.items():
            value = values.get(field)
            if kind == Nodetype.NAME:
                made[field] = self.make(inside, value or {})
            elif kind == Nodetype.BASE:
                made[field] = ("" if inside[0] == "string" else 0) if value is None else value
            else:
                (item, of), _ = inside
                made[field] = self._many(item == Nodetype.NAME, of, value)
        return self.store.types[name](**made)

    def _many(self, nested: bool, of: Any, values: Iterable[Any] | None) -> Any:
        """A list of messages or texts, or an array of numbers."""
        if nested:
            return [self.make(of, value) for value in values or []]
        if of[0] == "string":
            return list(values or [])
        return np.array([] if values is None else values, dtype=NUMBERS[of[0]])

    def packed(self, name: str, values: Mapping[str, Any]) -> bytes:
        """The message as the bytes that a bag holds."""
        return bytes(self.store.serialize_cdr(self.make(name, values), name))


def stamped(time: int, frame: str) -> dict[str, Any]:
    """A header at a time in nanoseconds."""
    return {"stamp": {"sec": time // 10**9, "nanosec": time % 10**9}, "frame_id": frame}


def vector(values: FloatArray) -> dict[str, float]:
    """The fields x, y, z."""
    return dict(zip("xyz", map(float, values), strict=True))


def pose(position: FloatArray, quaternion: FloatArray) -> dict[str, Any]:
    """A pose of a place and a quaternion w, x, y, z."""
    return {"position": vector(position), "orientation": rotation(quaternion)}


def rotation(quaternion: FloatArray) -> dict[str, float]:
    """The fields of a quaternion w, x, y, z."""
    return dict(zip("wxyz", map(float, quaternion), strict=True))


def marker(
    time: int, kind: int, number: int, name: str, points: FloatArray, size: float,
    colour: tuple[float, float, float, float],
) -> dict[str, Any]:  # fmt: skip
    """A marker of points in the world, as lines or balls of this width [m]."""
    return {
        "header": stamped(time, "world"), "ns": name, "id": number, "type": kind,
        "pose": {"orientation": {"w": 1.0}},
        "scale": {"x": size, "y": size, "z": size},
        "color": dict(zip("rgba", colour, strict=True)),
        "points": [vector(p) for p in points],
    }  # fmt: skip


def grid_map(time: int, ground: HeightMap) -> dict[str, Any]:
    """The ground as a grid_map, with the layer ``elevation``.

    Its rows run against x and its columns against y, and the numbers stand column by column.
    """
    rows, columns = ground.z.shape
    size = ground.resolution
    middle = np.array(ground.origin) + 0.5 * size * np.array([rows - 1, columns - 1])
    turned = ground.z[::-1, ::-1]
    sides = [
        {"label": "column_index", "size": columns, "stride": rows * columns},
        {"label": "row_index", "size": rows, "stride": rows},
    ]
    return {
        "header": stamped(time, "world"),
        "info": {
            "resolution": size, "length_x": rows * size, "length_y": columns * size,
            "pose": pose(np.append(middle, 0.0), np.array([1.0, 0.0, 0.0, 0.0])),
        },
        "layers": ["elevation"], "basic_layers": ["elevation"],
        "data": [{"layout": {"dim": sides}, "data": turned.ravel(order="F")}],
    }  # fmt: skip
