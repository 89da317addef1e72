"""Bags with grid_map messages, as ROS writes them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

KIND = "grid_map_msgs/msg/GridMap"
# The definitions of ROS 2; the header stands in the info in ROS 1.
INFO = "float64 resolution\nfloat64 length_x\nfloat64 length_y\ngeometry_msgs/Pose pose\n"
REST = (
    "string[] layers\nstring[] basic_layers\nstd_msgs/Float32MultiArray[] data\n"
    "uint16 outer_start_index\nuint16 inner_start_index\n"
)


def type_store(ros: int) -> Any:
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros == 1 else Stores.ROS2_HUMBLE)
    header = "std_msgs/Header header\n"
    info, whole = (header + INFO, "") if ros == 1 else (INFO, header)
    for name, text in (("GridMapInfo", info), ("GridMap", f"{whole}GridMapInfo info\n{REST}")):
        store.register(get_types_from_msg(text, f"grid_map_msgs/msg/{name}"))
    return store


def grid_map(
    store: Any,
    heights: dict[str, np.ndarray],
    *,
    resolution: float = 0.1,
    position: tuple[float, float] = (0.0, 0.0),
    start: tuple[int, int] = (0, 0),
    labels: tuple[str, str] = ("column_index", "row_index"),
    turn: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 1.0),
    ros: int = 2,
    offset: int = 0,
) -> Any:
    """A message with layers whose matrices ``(rows, columns)`` are in the order of the buffer."""
    t = store.types

    def make(name: str, **values: Any) -> Any:
        return t[name](**values)

    stamp = make("builtin_interfaces/msg/Time", sec=1, nanosec=0)
    more = {"seq": 0} if ros == 1 else {}
    header = make("std_msgs/msg/Header", stamp=stamp, frame_id="odom", **more)
    point = make("geometry_msgs/msg/Point", x=position[0], y=position[1], z=0.0)
    turned = make("geometry_msgs/msg/Quaternion", **dict(zip("xyzw", turn, strict=True)))
    rows, columns = next(iter(heights.values())).shape
    info = make(
        "grid_map_msgs/msg/GridMapInfo", resolution=resolution, length_x=rows * resolution,
        length_y=columns * resolution, **({"header": header} if ros == 1 else {}),
        pose=make("geometry_msgs/msg/Pose", position=point, orientation=turned),
    )  # fmt: skip
    data = []
    for matrix in heights.values():
        by_column = labels[0] == "column_index"
        sizes = (columns, rows) if by_column else (rows, columns)
        strides = (rows * columns, sizes[1])
        dims = [
            make("std_msgs/msg/MultiArrayDimension", label=label, size=size, stride=stride)
            for label, size, stride in zip(labels, sizes, strides, strict=True)
        ]
        layout = make("std_msgs/msg/MultiArrayLayout", dim=dims, data_offset=offset)
        numbers = matrix.astype(np.float32).ravel(order="F" if by_column else "C")
        data.append(make("std_msgs/msg/Float32MultiArray", layout=layout, data=numbers))
    return make(
        KIND, info=info, layers=list(heights), basic_layers=[], data=data,
        outer_start_index=start[0], inner_start_index=start[1],
        **({} if ros == 1 else {"header": header}),
    )  # fmt: skip


def write_bag(
    path: Path, store: Any, messages: dict[str, list[Any]], *, kind: str = "mcap"
) -> Path:
    """Write messages by topic; the path is that of the bag: a folder, or a file for ROS 1.

    Args:
        kind: ``"mcap"``, ``"db3"`` or ``"bag"``.
    """
    if kind == "bag":
        from rosbags.rosbag1 import Writer as Writer1

        with Writer1(path) as writer:
            for topic, many in messages.items():
                connection = writer.add_connection(topic, KIND, typestore=store)
                for k, message in enumerate(many):
                    writer.write(connection, k, store.serialize_ros1(message, KIND))
        return path
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2

    plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
    with Writer2(path, version=9, storage_plugin=plugin) as writer:
        for topic, many in messages.items():
            connection = writer.add_connection(topic, KIND, typestore=store)
            for k, message in enumerate(many):
                writer.write(connection, k, store.serialize_cdr(message, KIND))
    return path
