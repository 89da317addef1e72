"""Plays a plan that gaitopt exported (.yaml, .json or .mcap) with joint_trajectory_controller.

A node for ROS 2: run it with the Python of your ROS installation, which needs no gaitopt:

    python3 play_plan.py walk.yaml --controller joint_trajectory_controller --slower 4

It looks at where the joints are, refuses to begin far from the plan's first posture, sends the
plan once, says how far joints stray from it, and cancels the motion on Ctrl-C. Its exit code is 0
where the controller reports success.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import rclpy
from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTolerance
from rclpy.action import ActionClient
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

FIELDS = ("positions", "velocities", "accelerations")


def read(path: str) -> JointTrajectory:
    """The trajectory in a file."""
    if Path(path).suffix == ".mcap":
        return read_bag(path)
    text = Path(path).read_text("utf-8")
    if Path(path).suffix == ".json":
        plain = json.loads(text)
    else:
        import yaml

        plain = yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    trajectory = JointTrajectory(joint_names=plain["joint_names"])
    for values in plain["points"]:
        point = JointTrajectoryPoint()
        for name in (*FIELDS, "effort"):
            if values.get(name):
                setattr(point, name, [float(x) for x in values[name]])
        point.time_from_start.sec = values["time_from_start"]["sec"]
        point.time_from_start.nanosec = values["time_from_start"]["nanosec"]
        trajectory.points.append(point)
    return trajectory


def read_bag(path: str) -> JointTrajectory:
    """The trajectory in a bag."""
    import rosbag2_py
    from rclpy.serialization import deserialize_message

    reader = rosbag2_py.SequentialReader()
    reader.open(
        rosbag2_py.StorageOptions(uri=path, storage_id="mcap"),
        rosbag2_py.ConverterOptions("", ""),
    )
    while reader.has_next():
        topic, data, _ = reader.read_next()
        if topic == "/joint_trajectory":
            return deserialize_message(data, JointTrajectory)
    raise SystemExit(f"{path} has no topic /joint_trajectory")


def seconds(point: JointTrajectoryPoint) -> float:
    return point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec


def slowed(trajectory: JointTrajectory, factor: float) -> JointTrajectory:
    """The same path, ``factor`` times as slow. Efforts belong to the old pace and are left out."""
    first = seconds(trajectory.points[0])
    for point in trajectory.points:
        later = round(1e9 * (first + factor * (seconds(point) - first)))
        point.time_from_start.sec, point.time_from_start.nanosec = divmod(later, 10**9)
        point.velocities = [v / factor for v in point.velocities]
        point.accelerations = [a / factor**2 for a in point.accelerations]
        if factor != 1.0:
            point.effort = []
    return trajectory


class PlanPlayer(Node):
    """Sends one trajectory, and watches the joints."""

    def __init__(self, trajectory: JointTrajectory, asked: argparse.Namespace) -> None:
        super().__init__("plan_player")
        self.trajectory, self.asked = trajectory, asked
        self.present: dict[str, float] = {}
        self.worst = 0.0
        self.create_subscription(JointState, "/joint_states", self.on_state, 10)
        action = f"/{asked.controller}/follow_joint_trajectory"
        self.client = ActionClient(self, FollowJointTrajectory, action)

    def on_state(self, state: JointState) -> None:
        # Some publishers tell of velocities or efforts alone.
        if len(state.name) == len(state.position):
            self.present.update(zip(state.name, state.position, strict=True))

    def on_feedback(self, message) -> None:
        errors = [abs(x) for x in message.feedback.error.positions]
        if errors and max(errors) > self.worst + 0.01:
            self.worst = max(errors)
            joint = message.feedback.joint_names[errors.index(self.worst)]
            self.get_logger().info(f"{joint} is {self.worst:.3f} rad from the plan")

    def refusal(self) -> str:
        """Why the plan must not begin now; empty where it may."""
        for _ in range(50):
            if set(self.trajectory.joint_names) <= set(self.present):
                break
            rclpy.spin_once(self, timeout_sec=0.1)
        missing = [j for j in self.trajectory.joint_names if j not in self.present]
        if missing:
            return f"/joint_states does not tell of {', '.join(missing)}"
        first = zip(self.trajectory.joint_names, self.trajectory.points[0].positions, strict=True)
        away = {joint: abs(self.present[joint] - q) for joint, q in first}
        joint = max(away, key=away.get)
        if away[joint] > self.asked.near:
            return (
                f"{joint} is {away[joint]:.3f} rad from the plan's first posture (--near "
                f"{self.asked.near}); bring the robot there first"
            )
        if not self.client.wait_for_server(timeout_sec=5.0):
            return f"there is no controller {self.asked.controller}"
        return ""

    def play(self) -> int:
        """Play the plan; the exit code of the program."""
        if refusal := self.refusal():
            self.get_logger().error(refusal)
            return 2
        goal = FollowJointTrajectory.Goal()
        goal.trajectory = self.trajectory
        goal.path_tolerance = [
            JointTolerance(name=joint, position=self.asked.stray)
            for joint in self.trajectory.joint_names
        ]
        sent = self.client.send_goal_async(goal, feedback_callback=self.on_feedback)
        try:
            self.wait_for(sent)
            if not sent.result().accepted:
                self.get_logger().error("the controller refused the plan; its log says why")
                return 2
            done = sent.result().get_result_async()
            self.wait_for(done)
        except KeyboardInterrupt:
            return self.cancel(sent)
        result = done.result().result
        self.get_logger().info(
            f"result {result.error_code} {result.error_string}; joints strayed {self.worst:.3f} rad"
        )
        return 0 if result.error_code == FollowJointTrajectory.Result.SUCCESSFUL else 1

    def wait_for(self, future, longest: float = float("inf")) -> bool:
        """Whether it is done within so many seconds; looks for Ctrl-C ten times a second."""
        while not future.done() and longest > 0.0:
            rclpy.spin_until_future_complete(self, future, timeout_sec=0.1)
            longest -= 0.1
        return future.done()

    def cancel(self, sent) -> int:
        """Cancel the plan, also where the controller has not answered yet."""
        answered = self.wait_for(sent, 5.0)
        if answered and sent.result().accepted:
            answered = self.wait_for(sent.result().cancel_goal_async(), 5.0)
        if answered:
            self.get_logger().warning("cancelled: the controller holds the joints")
        else:
            self.get_logger().error("the controller does not answer: press the emergency stop")
        return 1


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    parser.add_argument("--controller", default="joint_trajectory_controller")
    slower = "times as slow as the plan; 1 for trots and paces, which fall where they are slow"
    parser.add_argument("--slower", type=float, default=4.0, help=slower)
    parser.add_argument("--near", type=float, default=0.1, help="first posture within so much, rad")
    parser.add_argument("--stray", type=float, default=0.3, help="stop beyond this error, rad")
    asked = parser.parse_args(arguments)
    if not asked.slower >= 1.0:
        parser.error("--slower must be at least 1")
    # ROS's own handler of Ctrl-C ends all communication, and the plan could not be cancelled.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    player = PlanPlayer(slowed(read(asked.file), asked.slower), asked)
    try:
        return player.play()
    finally:
        player.destroy_node()
        rclpy.shutdown()


if __name__ == "__main__":
    sys.exit(main())
