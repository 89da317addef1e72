"""Stands in for ROS 2 on machines without it: the modules that a node imports, and a robot behind.

Messages have the fields of ROS's own definitions (from rosbags, and control_msgs as published), and
like rclpy's they refuse fields that they do not have and values of another type. The controller
is :class:`trajectory_controller.TrajectoryController`.
"""

from __future__ import annotations

import types
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from trajectory_controller import FIELDS, Refused, TrajectoryController

STORE = get_typestore(Stores.ROS2_HUMBLE)
TOLERANCE = "string name\nfloat64 position\nfloat64 velocity\nfloat64 acceleration\n"
GOAL = (
    "trajectory_msgs/JointTrajectory trajectory\ncontrol_msgs/JointTolerance[] path_tolerance\n"
    "control_msgs/JointTolerance[] goal_tolerance\n"
    "builtin_interfaces/Duration goal_time_tolerance\n"
)
RESULT = "int32 error_code\nstring error_string\n"
FEEDBACK = (
    "std_msgs/Header header\nstring[] joint_names\ntrajectory_msgs/JointTrajectoryPoint desired\n"
    "trajectory_msgs/JointTrajectoryPoint actual\ntrajectory_msgs/JointTrajectoryPoint error\n"
)
for _name, _text in (("JointTolerance", TOLERANCE), ("Goal", GOAL), ("Result", RESULT),
                     ("Feedback", FEEDBACK)):  # fmt: skip
    STORE.register(get_types_from_msg(_text, f"control_msgs/msg/{_name}"))
PATH_TOLERANCE_VIOLATED = -4


class Message:
    """A message that has only the fields of its definition, with values of their types."""

    KIND = ""

    def __init__(self, **values: Any) -> None:
        for name, (kind, inside) in STORE.fielddefs[self.KIND][1]:
            if kind == Nodetype.NAME:
                start: Any = message(inside)()
            elif kind == Nodetype.BASE:
                start = {"string": "", "bool": False}.get(inside[0], 0)
                start = 0.0 if inside[0].startswith("float") else start
            else:
                start = []
            setattr(self, name, values.pop(name, start))
        assert not values, f"{self.KIND} has no fields {sorted(values)}"

    def __setattr__(self, name: str, value: Any) -> None:
        kind, inside = dict(STORE.fielddefs[self.KIND][1])[name]
        if kind == Nodetype.NAME:
            assert isinstance(value, message(inside)), name
        elif kind == Nodetype.BASE:
            python = {"string": str, "bool": bool}.get(inside[0], int)
            python = float if inside[0].startswith("float") else python
            assert type(value) is python, f"{self.KIND}.{name} = {value!r}"
        elif inside[0][0] == Nodetype.BASE and inside[0][1][0].startswith("float"):
            assert all(type(x) is float for x in value), f"{self.KIND}.{name}"
        object.__setattr__(self, name, value)


_CLASSES: dict[str, type[Message]] = {}


def message(kind: str) -> type[Message]:
    if kind not in _CLASSES:
        _CLASSES[kind] = type(kind.split("/")[-1], (Message,), {"KIND": kind})
    return _CLASSES[kind]


def from_rosbags(made: Any) -> Any:
    """A message of rosbags as one of these."""
    kind = made.__msgtype__
    values = {}
    for name, (node, _) in STORE.fielddefs[kind][1]:
        value = getattr(made, name)
        if node == Nodetype.NAME:
            value = from_rosbags(value)
        elif isinstance(value, np.ndarray):
            value = value.tolist()
        elif isinstance(value, list) and value and hasattr(value[0], "__msgtype__"):
            value = [from_rosbags(v) for v in value]
        values[name] = value
    return message(kind)(**values)


@dataclass
class World:
    """A robot with a controller.

    Attributes:
        joints: of the controller.
        present: angles by joint.
        stray: how far a joint is from what it is told, by time [rad].
        interrupt: while what the user presses Ctrl-C: ``"sending"`` or ``"playing"`` the plan.
        context: whether ROS may be talked to. Its own handler of Ctrl-C ends that.
    """

    joints: list[str]
    present: dict[str, float]
    stray: Callable[[float], float] = lambda time: 0.0
    interrupt: str = ""
    context: bool = True
    own_handlers: bool = True
    controller: str = "joint_trajectory_controller"
    logged: list[str] = field(default_factory=list)
    goals: list[Any] = field(default_factory=list)
    moved: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None
    cancelled: bool = False

    def accept(self, goal: Any) -> bool:
        self.goals.append(goal)
        plain = {
            "joint_names": list(goal.trajectory.joint_names),
            "points": [
                {name: list(getattr(p, name)) for name in (*FIELDS, "effort")}
                | {"time_from_start": {"sec": p.time_from_start.sec,
                                       "nanosec": p.time_from_start.nanosec}}
                for p in goal.trajectory.points
            ],
        }  # fmt: skip
        taken = TrajectoryController(self.joints)
        try:
            taken.accept(plain, np.array([self.present[j] for j in self.joints]))
        except Refused as error:
            self.logged.append(f"controller: {error}")
            return False
        self.moved = taken.sampled()
        return True

    def run(self, goal: Any, feedback: Callable[[Any], None]) -> Any:
        """Follow the trajectory; the result."""
        assert self.moved is not None
        allowed = {t.name: t.position for t in goal.path_tolerance}
        for time in self.moved[0][::20]:
            off = self.stray(float(time))
            errors = [off] + [0.0] * (len(self.joints) - 1)
            point = message("trajectory_msgs/msg/JointTrajectoryPoint")(positions=errors)
            feedback(message("control_msgs/msg/Feedback")(joint_names=self.joints, error=point))
            if abs(off) > allowed[self.joints[0]]:
                return message("control_msgs/msg/Result")(
                    error_code=PATH_TOLERANCE_VIOLATED, error_string="path tolerance violated"
                )
        return message("control_msgs/msg/Result")(error_code=0)


class Future:
    def __init__(self, work: Callable[[], Any]) -> None:
        self.work, self.value, self.ready = work, None, False

    def done(self) -> bool:
        return self.ready

    def result(self) -> Any:
        return self.value


def modules(world: World) -> dict[str, Any]:
    """The modules of ROS, by name."""

    class Logger:
        def info(self, text: str) -> None:
            world.logged.append(text)

        error = warning = info

    class Node:
        def __init__(self, name: str) -> None:
            self.subscriptions: list[tuple[type[Message], Callable[[Any], None]]] = []

        def create_subscription(self, kind: Any, topic: str, call: Any, depth: int) -> None:
            assert topic == "/joint_states" and depth > 0
            self.subscriptions.append((kind, call))

        def get_logger(self) -> Logger:
            return Logger()

        def destroy_node(self) -> None: ...

    class Handle:
        def __init__(self, goal: Any, feedback: Any) -> None:
            self.accepted = world.accept(goal)
            self.goal, self.feedback = goal, feedback

        def get_result_async(self) -> Future:
            def work() -> Any:
                pressed("playing")
                result = world.run(
                    self.goal, lambda m: self.feedback(types.SimpleNamespace(feedback=m))
                )
                return types.SimpleNamespace(result=result)

            return Future(work)

        def cancel_goal_async(self) -> Future:
            def work() -> None:
                world.cancelled = True

            return Future(work)

    class ActionClient:
        def __init__(self, node: Node, kind: Any, name: str) -> None:
            self.there = name == f"/{world.controller}/follow_joint_trajectory"

        def wait_for_server(self, timeout_sec: float) -> bool:
            return self.there

        def send_goal_async(self, goal: Any, feedback_callback: Any) -> Future:
            def work() -> Handle:
                pressed("sending")
                return Handle(goal, feedback_callback)

            return Future(work)

    def spin_once(node: Node, timeout_sec: float) -> None:
        for kind, call in node.subscriptions:
            call(kind(name=list(world.present), position=list(world.present.values())))

    def pressed(meanwhile: str) -> None:
        if world.interrupt == meanwhile:
            world.interrupt, world.context = "", not world.own_handlers
            raise KeyboardInterrupt

    def spin_until_future_complete(node: Node, future: Future, timeout_sec: float) -> None:
        assert world.context, "context is invalid"
        future.value = future.work()
        future.ready = True

    def init(signal_handler_options: str = "ALL") -> None:
        world.own_handlers = signal_handler_options != "NO"

    class SequentialReader:
        def open(self, storage: Any, converter: Any) -> None:
            assert storage.storage_id == "mcap"
            from mcap.reader import make_reader

            with Path(storage.uri).open("rb") as stream:
                self.left = [(c.topic, m.data, m.log_time)
                             for _, c, m in make_reader(stream).iter_messages()]  # fmt: skip

        def has_next(self) -> bool:
            return bool(self.left)

        def read_next(self) -> Any:
            return self.left.pop(0)

    action = type("FollowJointTrajectory", (), {
        "Goal": message("control_msgs/msg/Goal"),
        "Result": type("Result", (message("control_msgs/msg/Result"),), {"SUCCESSFUL": 0}),
    })  # fmt: skip

    def module(**names: Any) -> Any:
        return types.SimpleNamespace(**names)

    return {
        "rclpy": module(init=init, shutdown=lambda: None, spin_once=spin_once,
                        spin_until_future_complete=spin_until_future_complete),
        "rclpy.node": module(Node=Node),
        "rclpy.action": module(ActionClient=ActionClient),
        "rclpy.signals": module(SignalHandlerOptions=module(NO="NO", ALL="ALL")),
        "rclpy.serialization": module(
            deserialize_message=lambda data, kind: from_rosbags(
                STORE.deserialize_cdr(data, kind.KIND))),
        "control_msgs.action": module(FollowJointTrajectory=action),
        "control_msgs.msg": module(JointTolerance=message("control_msgs/msg/JointTolerance")),
        "sensor_msgs.msg": module(JointState=message("sensor_msgs/msg/JointState")),
        "trajectory_msgs.msg": module(
            JointTrajectory=message("trajectory_msgs/msg/JointTrajectory"),
            JointTrajectoryPoint=message("trajectory_msgs/msg/JointTrajectoryPoint")),
        "rosbag2_py": module(
            SequentialReader=SequentialReader,
            StorageOptions=lambda uri, storage_id: module(uri=uri, storage_id=storage_id),
            ConverterOptions=lambda before, after: None),
    }  # fmt: skip


def with_ros(world: World, patch: pytest.MonkeyPatch, script: Path) -> Any:
    """The script's names, with these modules in place of ROS."""
    import sys

    for name, made in modules(world).items():
        patch.setitem(sys.modules, name, made)
        patch.setitem(sys.modules, name.split(".")[0], modules(world).get(name.split(".")[0], made))
    patch.setitem(sys.modules, "rclpy", modules(world)["rclpy"])
    space: dict[str, Any] = {"__name__": "play_plan", "__doc__": "Plays a plan.\n"}
    exec(compile(script.read_text("utf-8"), str(script), "exec"), space)
    return types.SimpleNamespace(**space)
