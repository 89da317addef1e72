"""Joint trajectories for ROS 2, judged by the rules of the controller that takes them."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from trajectory_controller import Refused, TrajectoryController, seconds

import gaitopt
from gaitopt import InputError, Plan
from gaitopt.exporting.at_rest import at_rest
from gaitopt.exporting.ros import check_stops

KINDS = ("linear", "cubic", "quintic")


def message_of(path: Path) -> dict[str, Any]:
    text = path.read_text("utf-8")
    # libyaml's parser: the pure one takes seconds for a walk.
    fast = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    return json.loads(text) if path.suffix == ".json" else yaml.load(text, fast)


def joints_of(plan: Plan, times: np.ndarray) -> np.ndarray:
    return plan.at(np.clip(times, 0.0, plan.duration)).q[:, 7:]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("which", "suffix"), [("smooth", ".yaml"), ("polyline", ".json"), ("trot", ".yaml")]
)
def test_the_controllers_own_interpolation_keeps_to_plan_and_limits(
    a1_walk: Plan, short_plan: Plan, flying: Callable[[str], Plan], tmp_path: Path,
    kind: str, suffix: str, which: str,
) -> None:  # fmt: skip
    plan = {"smooth": a1_walk, "polyline": short_plan}.get(which) or flying("trot")
    file = tmp_path / f"walk{suffix}"
    done = gaitopt.export(plan, file, interpolation=kind, offset=0.5)
    message = message_of(file)
    controller = TrajectoryController(list(plan.robot.joint_names))
    controller.accept(message)
    assert seconds(message["points"][0]) == 0.5
    assert len(controller.values) == KINDS.index(kind) + 1
    for rates in controller.values[1:]:
        assert not rates[[0, -1]].any(), "at rest at both ends"
    times, positions, velocities = controller.sampled()
    resting = at_rest(plan)
    assert positions == pytest.approx(joints_of(resting, times - 0.5), abs=1e-3 + 1e-9)
    assert np.abs(positions - joints_of(resting, times - 0.5)).max() <= (
        done.numbers["joint error [rad]"] * 1.1 + 1e-9
    )
    peak = (np.abs(velocities) / plan.robot.velocity_limits).max()
    assert peak <= min(1.0, done.numbers["peak velocity [share of limit]"]) * (1 + 2e-6)
    # The whole path is followed, in the same places.
    assert positions[-1] == pytest.approx(plan.at([plan.duration]).q[0, 7:], abs=1e-9)


def test_points_at_full_rate_would_break_the_limits_that_chosen_ones_keep(
    short_plan: Plan,
) -> None:
    """What was exported before: the plan's velocities at equal steps, over corners."""
    motion = short_plan.sample(0.01)
    naive = TrajectoryController(list(motion.joint_names))
    stamps = [{"sec": int(t), "nanosec": int(t % 1 * 1e9)} for t in motion.t]
    points = [{"positions": q, "velocities": v, "time_from_start": s}
              for q, v, s in zip(motion.q[:, 7:].tolist(), motion.v[:, 6:].tolist(), stamps,
                                 strict=True)]  # fmt: skip
    with pytest.raises(Refused, match="last point moves"):
        naive.accept({"joint_names": list(motion.joint_names), "points": points})
    points[-1]["velocities"] = [0.0] * len(motion.joint_names)
    naive.accept({"joint_names": list(motion.joint_names), "points": points})
    peak = np.abs(naive.sampled()[2]) / short_plan.robot.velocity_limits
    assert peak.max() > 1.2


def test_a_finer_error_is_kept(a1_walk: Plan, tmp_path: Path) -> None:
    done = gaitopt.export(a1_walk, tmp_path / "a.yaml", error=1e-5, interpolation="quintic")
    assert done.numbers["joint error [rad]"] <= 1e-5
    controller = TrajectoryController(list(a1_walk.robot.joint_names))
    controller.accept(message_of(tmp_path / "a.yaml"))
    times, positions, _ = controller.sampled()
    assert np.abs(positions - joints_of(a1_walk, times - 1.0)).max() <= 1e-5


def test_the_robot_is_fetched_from_where_it_is(a1_walk: Plan, tmp_path: Path) -> None:
    gaitopt.export(a1_walk, tmp_path / "a.yaml", offset=2.0)
    controller = TrajectoryController(list(a1_walk.robot.joint_names))
    present = joints_of(a1_walk, np.zeros(1))[0] + 0.2
    controller.accept(message_of(tmp_path / "a.yaml"), present)
    times, positions, velocities = controller.sampled()
    assert positions[0] == pytest.approx(present)
    # 0.2 rad in 2 s from rest to rest: a cubic's peak is 1.5 times the mean.
    assert np.abs(velocities[times <= 2.0]).max() == pytest.approx(1.5 * 0.2 / 2.0, rel=0.01)


def test_efforts_are_those_of_the_planned_forces(a1_walk: Plan, tmp_path: Path) -> None:
    gaitopt.export(a1_walk, tmp_path / "a.yaml", forces=True)
    message = message_of(tmp_path / "a.yaml")
    with pytest.raises(Refused, match="effort"):
        TrajectoryController(message["joint_names"]).accept(message)
    TrajectoryController(message["joint_names"], effort=True).accept(message)
    times = np.array([seconds(p) for p in message["points"]]) - 1.0
    found = gaitopt.contact_forces(a1_walk, times=np.clip(times, 0, a1_walk.duration))
    told = np.array([p["effort"] for p in message["points"]])
    assert told[:-1] == pytest.approx(found.torques[:-1], abs=1e-6)
    assert np.diff(times).max() <= 0.01 + 1e-9


def test_no_efforts_for_velocities_that_jump(short_plan: Plan, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="retimed"):
        gaitopt.export(short_plan, tmp_path / "a.yaml", forces=True)


def test_a_long_walk_comes_in_parts_each_from_rest_to_rest(
    short_plan: Plan, tmp_path: Path
) -> None:
    done = gaitopt.export(short_plan, tmp_path / "walk.yaml", part_time=8.0)
    assert len(done.files) == 4
    end = None
    for file in done.files:
        message = message_of(file)
        controller = TrajectoryController(list(short_plan.robot.joint_names))
        controller.accept(message)
        assert not controller.values[1][[0, -1]].any()
        assert controller.times[-1] - controller.times[0] <= 8.0
        if end is not None:
            assert controller.values[0][0] == pytest.approx(end, abs=1e-9)
        end = controller.values[0][-1]
    assert end == pytest.approx(short_plan.at([short_plan.duration]).q[0, 7:], abs=1e-9)


def test_a_stop_that_no_forces_make_is_refused(a1_walk: Plan) -> None:
    """The plan promises contact forces, and stops between parts must not break that promise."""
    check_stops(at_rest(a1_walk, 0.2, [0.41]))
    with pytest.raises(InputError, match=r"no contact forces .* longer ramp"):
        check_stops(at_rest(a1_walk, 0.004, [0.41]))


def test_parts_that_are_too_short_are_refused(
    flying: Callable[[str], Plan], tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="no place to stop"):
        gaitopt.export(flying("trot"), tmp_path / "walk.yaml", part_time=0.3)
    assert not list(tmp_path.iterdir())


def test_a_plan_that_moves_at_its_ends_says_so_or_is_refused(
    short_plan: Plan, a1_walk: Plan, tmp_path: Path
) -> None:
    done = gaitopt.export(short_plan, tmp_path / "a.yaml")
    assert "moves at its ends" in done.notes[0]
    assert gaitopt.export(a1_walk, tmp_path / "a.yaml").notes == ()
    with pytest.raises(InputError, match=r"moves at 0\.000 s"):
        gaitopt.export(short_plan, tmp_path / "b.yaml", ramp=0.0)
    assert not (tmp_path / "b.yaml").exists()


def test_a_ramp_keeps_the_path_and_the_certificate(short_plan: Plan) -> None:
    resting = at_rest(short_plan, 0.3, stops=[5.0])
    assert resting.duration == pytest.approx(short_plan.duration + 0.6)
    assert np.abs(resting.path.evaluate([0.0, 5.3, resting.duration], 1)).max() < 1e-9
    assert resting.path.jumps().max() < 1e-12
    assert (
        np.abs(resting.at(resting.path.times).v).max() <= np.abs(short_plan.knots().v).max() + 1e-9
    )
    # Before and after the ramps it is the same motion, half a ramp later each time.
    times = np.linspace(0.2, 4.8, 50)
    assert resting.at(times + 0.15).q == pytest.approx(short_plan.at(times).q, abs=1e-9)
    later = np.linspace(5.2, short_plan.duration - 0.2, 50)
    assert resting.at(later + 0.45).q == pytest.approx(short_plan.at(later).q, abs=1e-9)
    assert gaitopt.verify(resting, collisions=False, forces=None).outcome != "violated"


def test_a_speed_limit_between_points_is_an_error_that_names_the_joint(
    a1_walk: Plan, tmp_path: Path
) -> None:
    """A planted fault: the plan's robot has become weaker than its plan."""
    from dataclasses import replace

    from gaitopt.robots.urdf_text import with_velocity_limit

    fastest = np.abs(a1_walk.sample(1e-5).v[:, 6:]).max()
    weak = gaitopt.Quadruped.from_urdf(
        with_velocity_limit(a1_walk.robot.urdf, 0.9 * fastest), a1_walk.robot.name
    )
    faulty = replace(a1_walk, robot=weak)
    with pytest.raises(InputError, match=r"joint \w+ would reach 11\d\.\d % .* plan.slowed\(1\.1"):
        gaitopt.export(faulty, tmp_path / "a.yaml")
    nearly = gaitopt.Quadruped.from_urdf(
        with_velocity_limit(a1_walk.robot.urdf, 0.995 * fastest), a1_walk.robot.name
    )
    done = gaitopt.export(replace(a1_walk, robot=nearly), tmp_path / "a.yaml", error=1e-5)
    assert "times as slow" in done.notes[-1]
    controller = TrajectoryController(list(nearly.joint_names))
    controller.accept(message_of(tmp_path / "a.yaml"))
    assert (np.abs(controller.sampled()[2]) / nearly.velocity_limits).max() <= 1 + 1e-6
