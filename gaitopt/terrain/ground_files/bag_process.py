"""Reads one grid_map message of a bag, in a process of its own.

A bag may be packed so that it fills all memory, or be damaged so that reading it never ends: the
process has limits. Run as a script. It reads a JSON object from its input (``path``, ``topic``,
``message``) and prints a line of JSON that describes the message, and then the numbers of all its
layers as 32-bit floats. It imports nothing of gaitopt, so that it starts quickly; the lines
that limit the process stand in the script for xacro files as well.
"""

from __future__ import annotations

import json
import sys
from collections import deque
from pathlib import Path
from typing import Any

MOST_MEMORY = 2_000_000_000
"""Most bytes of memory that the process may take."""
MOST_SECONDS = 120
"""Most seconds of computing time."""
KIND = "grid_map_msgs/msg/GridMap"
"""Type of the messages."""

# Bags of ROS 2 in SQLite files hold no definitions of messages before the release Iron.
_DEFINITIONS = {
    "grid_map_msgs/msg/GridMapInfo": (
        "float64 resolution\nfloat64 length_x\nfloat64 length_y\ngeometry_msgs/Pose pose\n"
    ),
    KIND: (
        "std_msgs/Header header\ngrid_map_msgs/GridMapInfo info\nstring[] layers\n"
        "string[] basic_layers\nstd_msgs/Float32MultiArray[] data\nuint16 outer_start_index\n"
        "uint16 inner_start_index\n"
    ),
}


def main() -> int:
    """Read the message; the exit code is 0 if that worked, and 2 where it is not in the bag."""
    try:
        import resource  # not on every system

        resource.setrlimit(resource.RLIMIT_AS, (MOST_MEMORY, MOST_MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (MOST_SECONDS, MOST_SECONDS))
    except (ImportError, OSError, ValueError):
        pass
    asked = json.load(sys.stdin)
    from rosbags.highlevel import AnyReader

    path = Path(asked["path"])
    # Other files hold the definitions, and those of ROS take a third of a second.
    types = None if path.suffix in (".bag", ".mcap") else _types()
    with AnyReader([path], default_typestore=types) as reader:
        topics = {c.topic: c for c in reader.connections if c.msgtype == KIND}
        if not topics:
            others = sorted({c.msgtype for c in reader.connections})
            return _refuse(f"it has no messages of the type {KIND}, but {', '.join(others)}")
        name = asked["topic"] or (next(iter(topics)) if len(topics) == 1 else None)
        if name not in topics:
            names = ", ".join(sorted(topics))
            told = f"has no topic {name}" if name else f"has {len(topics)} topics"
            return _refuse(f"it {told} with grid maps; choose one with topic=...: {names}")
        connections = [c for c in reader.connections if c.topic == name and c.msgtype == KIND]
        wanted, count = asked["message"], 0
        kept: deque[bytes] = deque(maxlen=max(-wanted, 1))
        for _, _, data in reader.messages(connections=connections):
            if wanted < 0 or count == wanted:
                kept.append(data)
            count += 1
        if len(kept) < max(-wanted, 1):
            return _refuse(f"the topic {name} has {count} messages, and none with number {wanted}")
        content, numbers = described(reader.deserialize(kept[0], KIND))
        sys.stdout.buffer.write(json.dumps(content).encode() + b"\n" + numbers)
    return 0


def _types() -> Any:
    """Definitions of messages for bags that hold none."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.LATEST)
    for name, text in _DEFINITIONS.items():
        store.register(get_types_from_msg(text, name))
    return store


def described(message: Any) -> tuple[dict[str, Any], bytes]:
    """What a grid_map message tells, and the numbers of all its layers as 32-bit floats."""
    info, parts = message.info, list(message.data)
    pose = info.pose
    told = {
        "resolution": float(info.resolution),
        "position": [float(pose.position.x), float(pose.position.y)],
        "orientation": [float(getattr(pose.orientation, name)) for name in "xyzw"],
        "layers": [str(name) for name in message.layers],
        "start": [int(message.outer_start_index), int(message.inner_start_index)],
        "sides": [[[str(d.label), int(d.size)] for d in p.layout.dim] for p in parts],
        "offsets": [int(p.layout.data_offset) for p in parts],
        "counts": [len(p.data) for p in parts],
    }
    return told, b"".join(part.data.astype("<f4").tobytes() for part in parts)


def _refuse(reason: str) -> int:
    sys.stderr.write(reason)
    return 2


if __name__ == "__main__":
    # The folder of this script has modules whose names others need, too.
    sys.path[:] = [entry for entry in sys.path if Path(entry) != Path(__file__).parent]
    try:
        sys.exit(main())
    except Exception as error:  # whatever a file makes the reader raise is told to the user
        sys.stderr.write(f"{type(error).__name__}: {error}")
        sys.exit(1)
