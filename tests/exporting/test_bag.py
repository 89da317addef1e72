"""Bags of ROS 2, read back by the reader of MCAP's own project."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ground_walks import bumpy_walk
from scipy.spatial.transform import Rotation
from trajectory_controller import TrajectoryController

import gaitopt
from gaitopt import LEGS, Plan
from gaitopt.plan.com_margin import true_com

pytest.importorskip("rosbags", reason="needs pip install 'gaitopt[ros]'")
reading = pytest.importorskip("mcap_ros2.reader", reason="needs pip install mcap-ros2-support")


def messages(path: Path) -> dict[str, list[tuple[int, Any]]]:
    """Times and messages by topic."""
    found = defaultdict(list)
    for message in reading.read_ros2_messages(str(path)):
        found[message.channel.topic].append((message.log_time_ns, message.ros_msg))
    return dict(found)


@pytest.fixture(scope="module")
def bag(a1_walk: Plan, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    path = tmp_path_factory.mktemp("bag") / "walk.mcap"
    gaitopt.export(a1_walk, path)
    return messages(path)


def motion_of(plan: Plan, told: list[tuple[int, Any]]) -> Any:
    times = np.array([t for t, _ in told]) * 1e-9 - 1.0
    return plan.at(np.clip(times, 0.0, plan.duration))


def test_the_bag_has_all_topics(bag: dict[str, Any]) -> None:
    each = {f"/foot_{what}/{leg}" for what in ("contacts", "forces") for leg in LEGS}
    assert set(bag) == each | {
        "/joint_trajectory", "/joint_states", "/tf", "/tf_static", "/robot_description",
        "/footholds", "/stability",
    }  # fmt: skip


def test_joint_states_are_the_plans(a1_walk: Plan, bag: dict[str, Any]) -> None:
    told = bag["/joint_states"]
    motion = motion_of(a1_walk, told)
    assert told[0][1].name == list(a1_walk.robot.joint_names)
    assert np.array([m.position for _, m in told]) == pytest.approx(motion.q[:, 7:])
    forces = gaitopt.contact_forces(a1_walk, times=motion.t)
    efforts = np.array([m.effort for _, m in told])
    assert efforts[:-1] == pytest.approx(forces.torques[:-1])
    stamps = [m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for _, m in told]
    assert stamps == [t for t, _ in told]


def test_the_trajectory_is_one_that_the_controller_takes(
    a1_walk: Plan, bag: dict[str, Any]
) -> None:
    ((_, told),) = bag["/joint_trajectory"]
    points = [
        {
            "positions": list(p.positions), "velocities": list(p.velocities),
            "accelerations": list(p.accelerations), "effort": list(p.effort),
            "time_from_start": {"sec": p.time_from_start.sec,
                                "nanosec": p.time_from_start.nanosec},
        }
        for p in told.points
    ]  # fmt: skip
    controller = TrajectoryController(list(a1_walk.robot.joint_names))
    controller.accept({"joint_names": list(told.joint_names), "points": points})
    times, positions, velocities = controller.sampled()
    here = a1_walk.at(np.clip(times - 1.0, 0, a1_walk.duration)).q[:, 7:]
    assert np.abs(positions - here).max() <= 1e-3 + 1e-9
    assert (np.abs(velocities) / a1_walk.robot.velocity_limits).max() <= 1.0


def test_transforms_lead_from_the_world_to_the_feet(a1_walk: Plan, bag: dict[str, Any]) -> None:
    fixed = bag["/tf_static"][0][1].transforms
    motion = motion_of(a1_walk, bag["/tf"])
    for row in (0, 17, -1):
        tree = {t.child_frame_id: t for t in (*fixed, *bag["/tf"][row][1].transforms)}
        for i, leg in enumerate(LEGS):
            place, name = np.zeros(3), a1_walk.robot.legs[leg].foot
            while name != "world":
                t = tree[name].transform
                turn = Rotation.from_quat([getattr(t.rotation, k) for k in "xyzw"])
                place = turn.apply(place) + [getattr(t.translation, k) for k in "xyz"]
                name = tree[name].header.frame_id
            assert place == pytest.approx(motion.feet[row, i], abs=1e-9)


def test_contacts_and_wrenches_hold_the_robot(a1_walk: Plan, bag: dict[str, Any]) -> None:
    motion = motion_of(a1_walk, bag["/tf"])
    for i, leg in enumerate(LEGS):
        assert [m.data for _, m in bag[f"/foot_contacts/{leg}"]] == motion.contacts[:, i].tolist()
        sizes = [np.linalg.norm([getattr(m.wrench.force, k) for k in "xyz"])
                 for _, m in bag[f"/foot_forces/{leg}"]]  # fmt: skip
        expected = gaitopt.contact_forces(a1_walk, times=motion.t).forces[:, i]
        assert sizes[:-1] == pytest.approx(np.linalg.norm(expected, axis=1)[:-1], abs=1e-6)
        # The force stands in the foot's own frame, which has turned with the shank.
        assert bag[f"/foot_forces/{leg}"][0][1].header.frame_id == a1_walk.robot.legs[leg].foot


def test_markers_show_footholds_support_and_the_centre_of_mass(
    a1_walk: Plan, bag: dict[str, Any]
) -> None:
    (balls,) = bag["/footholds"][0][1].markers
    assert len(balls.points) == sum(a1_walk.footholds.counts.values())
    assert balls.points[0].z == pytest.approx(
        a1_walk.footholds["LF"][0, 2] - a1_walk.robot.foot_radius
    )
    motion = motion_of(a1_walk, bag["/stability"])
    masses = true_com(a1_walk.robot, motion.q)
    for row, (_, told) in enumerate(bag["/stability"]):
        lines, ball = told.markers
        assert len(lines.points) == motion.contacts[row].sum() + 1
        where = ball.points[0]
        assert [where.x, where.y, where.z] == pytest.approx(masses[row], abs=1e-9)


def test_the_ground_comes_back_as_it_was(tmp_path: Path) -> None:
    plan = bumpy_walk()
    ground = plan.footholds.ground
    assert ground is not None
    gaitopt.export(plan, tmp_path / "walk.mcap", dt=0.5)
    back = gaitopt.load_ground(tmp_path / "walk.mcap")
    assert back.resolution == pytest.approx(ground.resolution)
    assert back.origin == pytest.approx(ground.origin, abs=1e-9)
    assert back.z == pytest.approx(ground.z, abs=1e-6, nan_ok=True)


def test_the_robots_own_urdf_is_in_the_bag(a1_walk: Plan, bag: dict[str, Any]) -> None:
    assert bag["/robot_description"][0][1].data == a1_walk.robot.urdf
