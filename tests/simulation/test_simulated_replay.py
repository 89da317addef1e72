"""A walk in physics beside its plan, in one page."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Plan, Quadruped, Trajectory
from gaitopt.conventions import FloatArray
from gaitopt.robots.rotations import rpy_to_quaternion
from gaitopt.simulation.result import MissedFoothold, MissReason
from gaitopt.terrain.columns import s_columns
from gaitopt.viewing.replay.page import render
from gaitopt.viewing.replay.physics.contacts import FLICKER, settled_contacts
from gaitopt.viewing.replay.physics.happened import what_happened
from gaitopt.viewing.replay.physics.missed_scene import ALARM, MISSED
from gaitopt.viewing.replay.plan_page import GHOST, plan_page, plan_scene
from gaitopt.viewing.replay.replay import replay
from gaitopt.viewing.replay.scene import Polygon, Tubes


@pytest.fixture(scope="module")
def walk(wang: Quadruped) -> Plan:
    return gaitopt.plan_crawl(wang, gaitopt.s_columns(3, columns=2), timing="velocity")


@pytest.fixture(scope="module")
def motion(walk: Plan) -> Trajectory:
    """A stand-in for physics: the plan, sampled, drifting and turning."""
    planned = walk.sample(0.02)
    drift = np.linspace(0.0, 0.05, len(planned))[:, None]
    q = planned.q.copy()
    q[:, :3] += drift * [0.0, 1.0, 0.0]
    q[:, 3:7] = rpy_to_quaternion(np.hstack([0.5 * drift, -drift, 2.0 * drift]))
    return Trajectory(planned.t, q, planned.v.copy(), planned.contacts.copy(), planned.cog.copy(),
                      planned.feet.copy(), planned.legs, planned.joint_names)  # fmt: skip


def test_the_simulated_robot_stands_beside_a_ghost_of_the_planned(
    walk: Plan, motion: Trajectory
) -> None:
    scene = plan_scene(walk, simulated=motion)
    planned = [p for n in scene.nodes if n.path[0] == "robot" for p in n.parts]
    real = [p for n in scene.nodes if n.path[0] == "simulated" for p in n.parts]
    assert len(planned) == len(real) > 0
    assert max(p.appearance.opacity for p in planned) <= GHOST
    assert max(p.appearance.opacity for p in real) == 1.0
    assert plan_page(walk, simulated=motion).follow == "/simulated/base"
    assert any("pale: the plan" in fact for fact in plan_page(walk, simulated=motion).facts)


def test_meshes_are_in_the_page_once(tmp_path: Path) -> None:
    """The ghost is drawn as bars."""
    robot = gaitopt.load_robot("anymal_c")
    plan = gaitopt.plan_crawl(robot, s_columns(0, columns=2, robot=robot), timing="velocity")
    scene = plan_scene(plan, meshes=True, simulated=plan.sample(0.02))
    kinds = {root: {type(p.shape).__name__ for n in scene.nodes if n.path[0] == root
                    for p in n.parts} for root in ("robot", "simulated")}  # fmt: skip
    assert "Surface" in kinds["simulated"] and "Surface" not in kinds["robot"]


def test_what_is_shown_is_what_was_simulated(walk: Plan, motion: Trajectory) -> None:
    shown = what_happened(walk, motion).walk.at(motion.t)
    assert np.abs(shown.q[:, :3] - motion.q[:, :3]).max() < 2e-3
    flip = np.sign(np.einsum("ni,ni->n", shown.q[:, 3:7], motion.q[:, 3:7]))[:, None]
    assert np.abs(flip * shown.q[:, 3:7] - motion.q[:, 3:7]).max() < 1e-3
    assert np.abs(shown.q[-1, 7:] - motion.q[-1, 7:]).max() < 1e-9


@dataclass(frozen=True)
class Result:
    """A stand-in for the result of a simulation."""

    motion: Trajectory
    plan_times: FloatArray
    torques: FloatArray
    forces: FloatArray
    finished: bool
    verdict: str
    missed: tuple[MissedFoothold, ...]


@pytest.fixture(scope="module")
def fall(motion: Trajectory) -> Result:
    """The same walk, which ends during the third step; its second foothold was missed."""
    end = int(len(motion) * 0.7)
    arrays = {name: getattr(motion, name)[:end].copy()
              for name in ("t", "q", "v", "contacts", "cog", "feet")}  # fmt: skip
    cut = Trajectory(**arrays, legs=motion.legs, joint_names=motion.joint_names)
    missed = (MissedFoothold(1, "RF", 0.05, MissReason.BESIDE),
              MissedFoothold(3, "LF", 0.2, MissReason.NEVER_REACHED))  # fmt: skip
    return Result(cut, cut.t.copy(), np.zeros((end, 12)), np.ones((end, 4, 3)), False,
                  "failed: the robot fell", missed)  # fmt: skip


def test_captions_and_support_are_those_of_what_happened(walk: Plan, motion: Trajectory) -> None:
    """A foot that stays on the ground all the time has no flight, whatever the plan says."""
    held, first = motion.contacts.copy(), walk.swings[0]
    held[:, LEGS.index(first.leg)] = True
    kept = replace(motion, contacts=held)
    phases = what_happened(walk, kept).walk.phases
    assert all(first.leg in phase.support for phase in phases)
    flown = {leg for phase in phases for leg in phase.flying}
    assert flown == set(LEGS) - {first.leg}
    told = [c.label for c in plan_page(walk, simulated=kept).captions]
    assert not any(f"swing {first.leg}" in text for text in told)
    # Undisturbed, they are the plan's, to a sample of 20 ms.
    same = [p for p in what_happened(walk, motion).walk.phases if p.kind == "swing"]
    planned = [p for p in walk.phases if p.kind == "swing"]
    assert [(p.leg, p.step) for p in same] == [(p.leg, p.step) for p in planned]
    assert max(abs(a.start - b.start) for a, b in zip(same, planned, strict=True)) < 0.021


def test_support_polygons_stand_where_the_feet_are(walk: Plan, motion: Trajectory) -> None:
    scene = plan_scene(walk, simulated=motion)
    happened = what_happened(walk, motion).walk
    for node in scene.nodes:
        if node.path[0] != "support" or not node.path[-1].isdigit():
            continue
        phase = happened.phases[int(node.path[-1])]
        feet = happened.at([phase.start + phase.duration / 2.0]).feet[0]
        shapes = [p.shape for p in node.parts if isinstance(p.shape, Polygon)]
        apart = np.linalg.norm(shapes[0].vertices[:, None, :2] - feet[:, :2], axis=2)
        assert apart.min(axis=1).max() < 1e-9


def test_a_fall_is_marked_and_the_page_ends_with_it(walk: Plan, fall: Result) -> None:
    page = plan_page(walk, simulated=fall)
    end = float(fall.motion.t[-1])
    assert end < page.scene.duration < end + 3.0 < walk.duration
    assert page.captions[-1].start == pytest.approx(end)
    assert page.captions[-1].label == f"fell at {end:.1f} s"
    assert page.captions[-1].colour == ALARM
    (label,) = [one for one in page.labels if one.kind == "event"]
    assert label.name == f"fell at {end:.1f} s" and label.since == pytest.approx(end)
    assert "failed: the robot fell" in render(page)
    # Feet that were never where the plan has them have crosses at their footholds.
    (node,) = [n for n in page.scene.nodes if n.path == MISSED]
    (part,) = node.parts
    assert isinstance(part.shape, Tubes)
    middles = [line.mean(axis=0)[:2] for line in part.shape.lines[::2]]
    expected = [walk.swings[i].foot_end[:2] for i in (1, 3)]
    np.testing.assert_allclose(middles, expected, atol=1e-9)
    assert ("footholds that were missed", ALARM) in page.legend


def test_a_motion_that_ends_early_did_not_finish(walk: Plan, fall: Result) -> None:
    page = plan_page(walk, simulated=fall.motion)
    assert any("before the plan" in fact for fact in page.facts)
    assert not any(one.kind == "event" for one in plan_page(walk).labels)


def test_the_ghost_waits_when_the_plan_does(walk: Plan, motion: Trajectory) -> None:
    clock = np.maximum(motion.t - 1.0, 0.0)
    size = (len(motion), 12)
    result = Result(motion, clock, np.zeros(size), np.zeros((len(motion), 4, 3)), True, "", ())
    ghost = what_happened(walk, result).ghost.at(motion.t)
    assert np.abs(ghost.q[:, :3] - walk.at(clock).q[:, :3]).max() < 2e-3


def test_contacts_that_flicker_are_none() -> None:
    times = 0.01 * np.arange(200)
    rng = np.random.default_rng(0)
    contacts = np.repeat(rng.random((10, 4)) < 0.5, 20, axis=0)
    shaken = contacts.copy()
    shaken[[30, 31, 130], 1] = ~shaken[[30, 31, 130], 1]
    assert np.array_equal(settled_contacts(times, shaken), contacts)
    assert FLICKER < 0.09


def test_the_page_is_written_and_small(walk: Plan, motion: Trajectory, tmp_path: Path) -> None:
    file = replay(walk, tmp_path / "both.html", simulated=motion)
    assert file.stat().st_size < 3e6
    assert "what happened in physics" in file.read_text("utf-8")


def test_another_robots_motion_is_refused(walk: Plan, motion: Trajectory) -> None:
    a1 = gaitopt.load_robot("a1")
    plan = gaitopt.plan_crawl(
        a1, s_columns(0, columns=2, robot=a1), body_height=0.25, timing="velocity"
    )
    with pytest.raises(gaitopt.InputError, match="has the joints"):
        plan_scene(plan, simulated=motion)
