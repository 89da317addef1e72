"""The course of a polyline: its lines, its chains, and rounded corners."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import Plan, retimed
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.motion.path import MotionPath
from gaitopt.plan.com_margin import margins_over
from gaitopt.retiming import rounds
from gaitopt.retiming.straight import StraightCourse, straight_course

Array = NDArray[np.float64]


def walk(name: str = "go2", **options: object) -> Plan:
    robot = gaitopt.load_robot(name)
    return gaitopt.plan_crawl(
        robot, gaitopt.s_columns(0, columns=2, robot=robot), timing="velocity", **options
    )


@pytest.fixture(scope="module")
def boxes() -> Plan:
    return walk()


def foot_of(course: StraightCourse, chain: int, count: int = 400) -> Array:
    """The flying foot's places along a chain ``(count, 3)``."""
    first, last = course.chains[chain], course.chains[chain + 1]
    s = np.linspace(course.edges[first], course.edges[last], count)
    piece = np.clip(np.searchsorted(course.edges, s, side="right") - 1, first, last - 1)
    (leg,) = np.flatnonzero(~course.standing[first])
    return course.feet(s, piece)[:, leg]


def swing_chains(course: StraightCourse) -> list[int]:
    flies = ~course.standing[course.chains[:-1]].all(axis=1)
    return np.flatnonzero(flies).tolist()


def test_without_rounding_every_line_is_a_chain(boxes: Plan) -> None:
    """A still body and a box: three lines of the foot for every step, and one of the body."""
    course = straight_course(boxes, 0.0)
    moves = sum(p.kind == "stance" and p.duration > 0.0 for p in boxes.phases)
    assert len(course.chains) - 1 == moves + 3 * len(boxes.swings)
    assert (np.diff(course.chains) == 1).all()


def test_a_motion_too_small_to_count_is_no_jump(boxes: Plan) -> None:
    """The body's move ends half a nanometre early, and does the rest in a line of its own."""
    move = next(phase for phase in boxes.phases if phase.kind == "stance" and phase.duration > 0.0)
    values, times = boxes.path.knots(), boxes.path.times
    end = int(np.searchsorted(times, move.start + move.duration - 1e-9))
    early = np.array(values[end])
    early[0] -= 5e-10
    time = times[end] - 0.1 * (times[end] - times[end - 1])
    path = MotionPath.polyline(np.insert(times, end, time), np.insert(values, end, early, 0))
    course = straight_course(replace(boxes, path=path), 0.4)
    assert len(course.chains) == len(straight_course(boxes, 0.4).chains)
    piece = np.arange(len(course.edges) - 2)
    ends, begins = (course.states(course.edges[1:-1], piece + k)[0] for k in (0, 1))
    assert np.abs(ends - begins).max() < 1e-13


def test_with_rounding_every_swing_is_one_chain(boxes: Plan) -> None:
    course = straight_course(boxes, 0.4)
    chains = swing_chains(course)
    assert len(chains) == len(boxes.swings)
    # Three lines and two corners; the body's moves are one line each.
    assert {int(np.diff(course.chains)[c]) for c in chains} == {5}


@pytest.mark.parametrize("rounding", [0.1, 0.4, 0.5])
def test_a_rounded_box_stays_near_its_corners_and_inside(boxes: Plan, rounding: float) -> None:
    """It leaves the box by at most its reach times sqrt(2) - 1, and rises as high."""
    course = straight_course(boxes, rounding)
    for chain, swing in zip(swing_chains(course), boxes.swings, strict=True):
        foot = foot_of(course, chain)
        start, end = swing.foot_start, swing.foot_end
        top = max(start[2], end[2]) + boxes.settings.swing_height
        assert foot[0] == pytest.approx(start, abs=1e-9)
        assert foot[-1] == pytest.approx(end, abs=1e-9)
        assert foot[:, 2].max() == pytest.approx(top, abs=1e-9)
        along = (foot - start)[:, :2] @ (end - start)[:2] / np.linalg.norm((end - start)[:2])
        length = np.linalg.norm((end - start)[:2])
        assert along.min() > -1e-9 and along.max() < length + 1e-9
        sides = np.minimum(np.minimum(along, length - along), top - foot[:, 2])
        assert sides.max() <= 0.5 * rounding * max(length, boxes.settings.swing_height)


def test_speed_along_a_rounded_chain_changes_little(boxes: Plan) -> None:
    """Corners are as long as a circle's arc would be, so ``s`` is nearly the way."""
    course = straight_course(boxes, 0.4)
    for chain in swing_chains(course):
        steps = np.linalg.norm(np.diff(foot_of(course, chain, 2000), axis=0), axis=1)
        assert steps.max() < 1.25 * steps.min()


@pytest.mark.parametrize("swing", ["cycloid", "trapezoid"])
def test_curved_swings_are_flown_without_stops(swing: str) -> None:
    """They take no longer than boxes, which are longer, and rise as high as asked."""
    plan, box = (retimed(walk(swing=s), rounding=0.4) for s in (swing, "box"))
    assert plan.duration < 1.05 * box.duration
    gaitopt.verify(plan, collisions=False).raise_for_violations()
    for flight in plan.swings:
        inside = np.linspace(flight.start, flight.end, 202)[10:-10]
        feet = plan.at(inside).feet[:, gaitopt.LEGS.index(flight.leg)]
        speeds = np.linalg.norm(np.diff(feet, axis=0), axis=1)
        assert speeds.min() > 0.02 * speeds.max()


def test_ways_over_an_obstacle_keep_their_corners() -> None:
    robot = gaitopt.load_robot("go2")
    footholds = gaitopt.s_columns(0, columns=2, robot=robot)
    for swing in ("trapezoid path", "parabola path"):
        plan = gaitopt.plan_crawl(robot, footholds, swing=swing)
        gaitopt.verify(plan, collisions=False).raise_for_violations()


@pytest.mark.parametrize("swing", ["box", "cycloid", "polynomial"])
@pytest.mark.parametrize("length", [0.0, 0.001, 0.02])
def test_short_steps_rise_as_high_as_long_ones(swing: str, length: float) -> None:
    """Chords of a curve turn sharply there, and a step on the spot goes straight up and down."""
    robot = gaitopt.load_robot("a1")
    first = gaitopt.s_columns(0, columns=1, robot=robot).points
    footholds = gaitopt.Footholds({leg: [p[0], p[0] + [length, 0, 0]] for leg, p in first.items()})
    plan = gaitopt.plan_crawl(robot, footholds, swing=swing)
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_a_timing_without_forces_in_the_middle_is_no_plan(
    boxes: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With one round nothing is mended, and with a coarse grid there is something to mend."""
    monkeypatch.setattr(rounds, "MOST_ROUNDS", 1)
    monkeypatch.setattr("gaitopt.retiming.corners.CORNER_INTERVALS", 4)
    with pytest.raises(SolverError, match=r"step \d+ \(\w\w\): no timing was found"):
        retimed(boxes, rounding=0.2)


def test_phases_of_a_dynamic_walk_tell_the_margin_of_the_whole_robot() -> None:
    robot = gaitopt.load_robot("wang2020")
    plan = gaitopt.plan_route(robot, gaitopt.s_columns(0, columns=2), free="dynamic")
    assert not plan.settings.static
    for phase in plan.phases:
        if phase.duration == 0.0:
            continue
        times = np.linspace(phase.start, phase.end, 52)[1:-1]
        motion = plan.at(times)
        found = gaitopt.contact_forces(plan, times=times)
        # The ZMP from contact forces: their moment about it has no horizontal part.
        points = motion.feet - [0.0, 0.0, robot.foot_radius]
        load = found.forces[..., 2]
        middle = (points * load[..., None]).sum(axis=1) / load.sum(axis=1)[:, None]
        ground = np.average(points[..., 2], axis=1, weights=motion.contacts[0].astype(float))
        pull = found.forces[..., :2] * (points[..., 2] - ground[:, None])[..., None]
        zmp = middle[:, :2] - pull.sum(axis=1) / load.sum(axis=1)[:, None]
        assert margins_over(motion, zmp).min() == pytest.approx(phase.margin, abs=2e-3)


def test_a_leg_that_becomes_straight_is_an_error_of_its_step(boxes: Plan) -> None:
    course = straight_course(boxes, 0.0)
    chain = len(course.chains) // 2
    pieces = np.arange(course.chains[chain], course.chains[chain + 1])
    lifted = course.coefficients.copy()
    # The body is so high there that no leg reaches its foot.
    lifted[-1, pieces, 2] += 1.0
    course = replace(course, coefficients=lifted)
    at = np.arange(course.chains[-1])
    with pytest.raises(InfeasibleStepError, match="step") as caught:
        course.states(course.edges[:-1], at)
    phase = boxes.phase_at(float(course.moments[pieces[0]]))
    assert (caught.value.step, caught.value.leg) == (phase.step, phase.leg)
