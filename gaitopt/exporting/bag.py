"""Bags of ROS 2 as MCAP files, written without ROS; Foxglove and RViz show them."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.errors import MissingPackageError
from gaitopt.exporting import bag_messages as told
from gaitopt.exporting import ros
from gaitopt.exporting.format import Format
from gaitopt.exporting.interpolation import INTERPOLATIONS, LONGEST_GAP, choose_points
from gaitopt.exporting.links import LinkMotion, link_motion, moving_links
from gaitopt.exporting.names import check_names
from gaitopt.exporting.sampled import Exported, Samples, Source
from gaitopt.files import written_whole
from gaitopt.inputs import check_choice
from gaitopt.plan.com_margin import true_com

STEP: Final = 0.02
"""Default time between messages [s]: joint states are usually published at 50 Hz."""
BEGIN: Final = 10**9
"""Time of the plan's begin in the bag [ns]: 0 means "the latest" to TF."""
LINES, BALLS = 4, 7
"""Kinds of markers: LINE_STRIP and SPHERE_LIST."""
THICKNESS: Final = 0.01
"""Width of lines, and of the ball at the centre of mass [m]."""


class Entry(NamedTuple):
    """A message of a bag: its topic, its type, when [ns], its fields, whether it stays valid."""

    topic: str
    kind: str
    time: int
    values: dict[str, Any]
    stays: bool = False


def write_bag(
    source: Source,
    path: Path,
    dt: float | None = None,
    *,
    interpolation: str = "cubic",
    error: float = ros.JOINT_ERROR,
) -> Exported:
    """Write a bag: one MCAP file. The plan begins 1 s after the bag's time 0.

    Args:
        source: what is exported.
        path: the file.
        dt: time between joint states, transforms and so on [s]; 0.02 by default.
        interpolation, error: of the joint trajectory, as for the format ``ros2``.

    Raises:
        MissingPackageError: rosbags is not installed.
    """
    check_choice("interpolation", interpolation, INTERPOLATIONS)
    samples = source.samples(STEP if dt is None else dt)
    points = choose_points(source, interpolation, error, LONGEST_GAP, 0.0, source.plan.duration)
    # Without efforts: most controllers refuse them. The joint states have them.
    quiet = replace(source, with_forces=False)
    trajectory = ros.message(quiet, points, interpolation, ros.OFFSET)
    entries = [Entry("/joint_trajectory", "trajectory_msgs/msg/JointTrajectory", BEGIN,
                     trajectory, True)]  # fmt: skip
    entries += _once(source)
    entries += _over_time(samples)
    count = _write(path, sorted(entries, key=lambda entry: entry.time))
    return Exported((path,), {"messages": float(count), "joint error [rad]": points.joint_error,
                              "peak velocity [share of limit]": points.peak})  # fmt: skip


def _once(source: Source) -> Iterator[Entry]:
    """What stays as it is: the robot, links that do not move in their joints, the ground."""
    robot, ground = source.plan.robot, source.plan.footholds.ground
    yield Entry("/robot_description", "std_msgs/msg/String", BEGIN, {"data": robot.urdf}, True)
    fixed = {"transforms": list(_fixed_links(source))}
    yield Entry("/tf_static", "tf2_msgs/msg/TFMessage", BEGIN, fixed, True)
    if ground is not None:
        values = told.grid_map(BEGIN, ground)
        yield Entry("/ground", "grid_map_msgs/msg/GridMap", BEGIN, values, True)
    places = np.concatenate([source.plan.footholds[leg] for leg in LEGS])
    places = places - [0.0, 0.0, robot.foot_radius]
    ball = told.marker(BEGIN, BALLS, 0, "footholds", places, 2 * THICKNESS, (0.2, 0.6, 0.3, 1.0))
    yield Entry("/footholds", "visualization_msgs/msg/MarkerArray", BEGIN, {"markers": [ball]},
                True)  # fmt: skip


def _fixed_links(source: Source) -> Iterator[dict[str, Any]]:
    """Transforms of links that are fixed to a moving one."""
    import pinocchio as pin

    model = source.plan.robot.model
    moving = {}
    for name in _tree(source):
        frame = model.frames[model.getFrameId(name, pin.FrameType.BODY)]
        moving[int(frame.parentJoint)] = frame
    for frame in model.frames:
        carrier = moving.get(int(frame.parentJoint))
        if frame.type != pin.FrameType.BODY or carrier is None or carrier.name == frame.name:
            continue
        place = pin.SE3ToXYZQUAT(carrier.placement.inverse() * frame.placement)
        names = check_names([str(frame.name)], "link")
        yield _transform(BEGIN, str(carrier.name), names[0], place[:3], place[[6, 3, 4, 5]])


def _tree(source: Source) -> tuple[str, ...]:
    """The base, and the link that each joint moves."""
    count = len(source.plan.robot.joint_names) + 1
    return moving_links(source.plan.robot)[:count]


def _transform(
    time: int, parent: str, child: str, place: np.ndarray, turn: np.ndarray
) -> dict[str, Any]:
    inside = {"translation": told.vector(place), "rotation": told.rotation(turn)}
    return {"header": told.stamped(time, parent), "child_frame_id": child, "transform": inside}


def _over_time(samples: Samples) -> Iterator[Entry]:
    """What changes: joints, transforms, contacts, forces, markers."""
    source = samples.source
    robot = source.plan.robot
    names = _tree(source)
    links = link_motion(samples, names)
    feet = link_motion(samples, tuple(robot.legs[leg].foot for leg in LEGS))
    parents = [names[int(robot.model.parents[j]) - 1] if j > 1 else "world"
               for j in range(1, len(names) + 1)]  # fmt: skip
    masses = true_com(robot, samples.vectors.q) if robot.mass > 0.0 else samples.motion.cog
    for i, time in enumerate(BEGIN + np.rint(samples.times * 1e9).astype(np.int64)):
        stamp = int(time)
        joints = {"header": told.stamped(stamp, ""), "name": list(source.order.names),
                  "position": samples.positions[i], "velocity": samples.velocities[i]}  # fmt: skip
        if samples.torques is not None:
            joints["effort"] = samples.torques[i]
        yield Entry("/joint_states", "sensor_msgs/msg/JointState", stamp, joints)
        yield Entry("/tf", "tf2_msgs/msg/TFMessage", stamp,
                    {"transforms": list(_transforms(links, parents, i, stamp))})  # fmt: skip
        for k, leg in enumerate(LEGS):
            contact = {"data": bool(samples.motion.contacts[i, k])}
            yield Entry(f"/foot_contacts/{leg}", "std_msgs/msg/Bool", stamp, contact)
            if samples.forces is not None:
                turn = _matrix(feet.quaternions[i, k])
                force = told.vector(turn.T @ samples.forces.forces[i, k])
                wrench = {"header": told.stamped(stamp, feet.names[k]), "wrench": {"force": force}}
                yield Entry(f"/foot_forces/{leg}", "geometry_msgs/msg/WrenchStamped", stamp, wrench)
        yield Entry("/stability", "visualization_msgs/msg/MarkerArray", stamp,
                    {"markers": _stability(samples, i, stamp, masses[i])})  # fmt: skip


def _transforms(
    links: LinkMotion, parents: list[str], row: int, time: int
) -> Iterator[dict[str, Any]]:
    """Each moving link in its parent's frame, the base in the world."""
    where = {name: k for k, name in enumerate(links.names)}
    for k, (name, parent) in enumerate(zip(links.names, parents, strict=True)):
        place, turn = links.positions[row, k], _matrix(links.quaternions[row, k])
        if parent != "world":
            above = where[parent]
            back = _matrix(links.quaternions[row, above]).T
            place, turn = back @ (place - links.positions[row, above]), back @ turn
        yield _transform(time, parent, name, place, _quaternion(turn))


def _matrix(quaternion: np.ndarray) -> np.ndarray:
    import pinocchio as pin

    return np.array(pin.Quaternion(np.roll(quaternion, -1)).matrix())


def _quaternion(matrix: np.ndarray) -> np.ndarray:
    import pinocchio as pin

    return np.asarray(np.roll(pin.Quaternion(matrix).coeffs(), 1))


def _stability(samples: Samples, row: int, time: int, mass: np.ndarray) -> list[dict[str, Any]]:
    """The support polygon around the standing feet, and the centre of mass above it."""
    feet = samples.motion.feet[row][samples.motion.contacts[row]]
    feet = feet - [0.0, 0.0, samples.source.plan.robot.foot_radius]
    # LEGS go once around the body, so that their feet do, too.
    around = np.concatenate([feet, feet[:1]])
    below = np.array([*mass[:2], around[:, 2].mean() if len(around) else 0.0])
    return [
        told.marker(time, LINES, 0, "support", around, THICKNESS, (0.1, 0.4, 0.9, 1.0)),
        told.marker(time, BALLS, 1, "com", np.array([mass, below]), 3 * THICKNESS,
                    (0.9, 0.3, 0.1, 1.0)),
    ]  # fmt: skip


def _write(path: Path, entries: list[Entry]) -> int:
    """Write the entries, in the order of time, and count them."""
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
    except ImportError as error:
        raise MissingPackageError(
            "writing bags needs the package rosbags: pip install 'gaitopt[ros]'"
        ) from error
    messages = told.Messages()
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / "plan"
        with Writer(bag, version=8, storage_plugin=StoragePlugin.MCAP) as writer:
            connections: dict[str, Any] = {}
            for entry in entries:
                if entry.topic not in connections:
                    connections[entry.topic] = writer.add_connection(
                        entry.topic, entry.kind, typestore=messages.store,
                        offered_qos_profiles=[_quality(entry.stays)],
                    )  # fmt: skip
                data = messages.packed(entry.kind, entry.values)
                writer.write(connections[entry.topic], entry.time, data)
        (file,) = bag.glob("*.mcap")
        with written_whole(path, binary=True) as stream:
            stream.write(file.read_bytes())
    return len(entries)


def _quality(stays: bool) -> Any:
    """How messages are delivered: those that stay valid also to who comes later."""
    from rosbags import interfaces as ros2

    never = ros2.QosTime(0, 0)
    durability = ros2.QosDurability.TRANSIENT_LOCAL if stays else ros2.QosDurability.VOLATILE
    return ros2.Qos(ros2.QosHistory.KEEP_LAST, 10, ros2.QosReliability.RELIABLE, durability,
                    never, never, ros2.QosLiveliness.AUTOMATIC, never, False)  # fmt: skip


FORMAT = Format(
    name="mcap",
    summary="a bag of ROS 2: joint trajectory, joint states, TF, contacts, forces, markers, ground",
    suffixes=(".mcap",),
    write=write_bag,
    options=("interpolation", "error"),
)
