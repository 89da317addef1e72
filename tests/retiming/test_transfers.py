"""Timings in which feet take over their loads slowly: what they keep, and how it is judged."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from timings import Pair

import gaitopt
from gaitopt import ForceLimits, Plan, retimed
from gaitopt.certificate.forces import contact_forces
from gaitopt.certificate.phase_forces import times_of_stances
from gaitopt.plan.load_transfer import TOUCH_SHARE
from gaitopt.retiming.retimed import TURNING_LOAD_TIME, retimed_gently

TIME = 0.1
LIMITS = ForceLimits(transfer_time=TIME)


def shares_beyond(plan: Plan, time: float) -> float:
    """By how much normal forces exceed what feet may bear, as a share of the weight.

    With times since landings and until lift-offs that are read off the swings, one foot at a time.
    """
    found = gaitopt.contact_forces(plan, dt=0.002)
    worst = -np.inf
    for leg, name in enumerate(gaitopt.LEGS):
        swings = [swing for swing in plan.swings if swing.leg == name]
        changes = np.array([t for swing in swings for t in (swing.start, swing.end)])
        own = found.standing[:, leg]
        near = np.abs(found.times[own, None] - changes).min(axis=1)
        bears = found.forces[own, leg, 2] / found.weight
        worst = max(worst, float((bears - 0.02 - TOUCH_SHARE - near / time).max()))
    return worst


def gentle_everywhere(plan: Plan, time: float) -> bool:
    """Whether there are forces at all instants with which loads go over within a time [s]."""
    promised = plan.settings.promised_forces
    assert promised is not None
    asked = replace(promised, transfer_time=time)
    return bool(gaitopt.contact_forces(plan, asked, dt=0.002).feasible.all())


@pytest.fixture(scope="module", params=["a1", "wang2020"])
def transferred(request: pytest.FixtureRequest, pairs: dict[str, Pair]) -> tuple[Pair, Plan]:
    """A pair of plans, and the course timed with slow transfers of loads."""
    pair = pairs[request.param]
    return pair, retimed(pair.old, LIMITS)


def test_feet_take_over_their_loads_slowly(transferred: tuple[Pair, Plan]) -> None:
    pair, plan = transferred
    assert shares_beyond(plan, TIME) <= 1e-7
    assert shares_beyond(pair.new, TIME) > 0.1


def test_the_certificate_keeps_the_promise(transferred: tuple[Pair, Plan]) -> None:
    pair, plan = transferred
    certificate = gaitopt.verify(plan, collisions=False)
    certificate.raise_for_violations()
    check = certificate["contact forces"]
    assert check.promised and "a foot takes over the weight in 100 ms" in check.note
    jumping = contact_forces(pair.new, LIMITS)
    assert jumping.status == "violated" and jumping.worst < -0.05 * plan.robot.mass * 9.81
    twice = contact_forces(plan, replace(LIMITS, transfer_time=2.0 * TIME))
    assert twice.status == "violated"


def test_a_rest_that_is_cut_short_is_found(transferred: tuple[Pair, Plan]) -> None:
    """Nothing else changes: the motion rests there, and only a load goes over in less time."""
    _, plan = transferred
    path = plan.path
    still = np.flatnonzero((np.ptp(path.coefficients[:-1], axis=0) == 0.0).all(axis=1)
                           & (path.coefficients[:-1] == 0.0).all(axis=(0, 2)))  # fmt: skip
    longest = int(still[np.diff(path.times)[still].argmax()])
    cut = 0.6 * float(np.diff(path.times)[longest])
    times = path.times.copy()
    times[longest + 1 :] -= cut
    begin = path.times[longest]
    owner = next(i for i, p in enumerate(plan.phases)
                 if p.start - 1e-9 <= begin < p.end - 1e-9)  # fmt: skip
    phases = [
        replace(p, start=p.start - cut * (i > owner), duration=p.duration - cut * (i == owner))
        for i, p in enumerate(plan.phases)
    ]
    shorter = replace(plan, path=replace(path, times=times), phases=tuple(phases))
    assert contact_forces(shorter, ForceLimits()).status == "ok"
    check = contact_forces(shorter, LIMITS)
    assert check.status == "violated" and abs(check.when - begin) < 2.0 * TIME


def test_longer_transfers_take_more_time_and_none_takes_none(pairs: dict[str, Pair]) -> None:
    pair = pairs["a1"]
    taken = [retimed(pair.old, ForceLimits(transfer_time=t)).duration for t in (0.03, 0.1, 0.3)]
    assert [pair.new.duration, *taken] == sorted([pair.new.duration, *taken])
    # Two feet land in the middle of four steps, and each takes over less than the weight.
    assert taken[2] < pair.new.duration + 4 * 0.3
    jumping = retimed(pair.old, ForceLimits(transfer_time=0.0))
    assert (jumping.path.times == pair.new.path.times).all()


def test_a_smooth_course_slows_down_where_feet_change(smooth: Pair) -> None:
    plan = retimed(smooth.old, LIMITS)
    assert smooth.new.duration < plan.duration
    gaitopt.verify(plan, collisions=False).raise_for_violations()
    assert shares_beyond(plan, TIME) <= 1e-7


def test_a_walk_is_planned_with_it_and_kept_in_its_file(tmp_path: Path) -> None:
    robot = gaitopt.load_robot("go2")
    columns = gaitopt.s_columns(0, columns=2, robot=robot)
    plan = gaitopt.plan_route(robot, columns, free="dynamic", forces=LIMITS)
    plan.save(tmp_path / "plan.npz")
    again = gaitopt.load_plan(tmp_path / "plan.npz")
    assert again.settings.promised_forces == LIMITS
    gaitopt.verify(again, collisions=False).raise_for_violations()


def test_the_certificate_counts_the_times_of_stances_from_phases(a1_walk: Plan) -> None:
    times = times_of_stances(a1_walk)
    assert times.shape == (len(a1_walk.phases), 4, 2)
    for number, phase in enumerate(a1_walk.phases):
        for leg, name in enumerate(gaitopt.LEGS):
            if name not in phase.support:
                assert np.isnan(times[number, leg]).all()
                continue
            own = [swing for swing in a1_walk.swings if swing.leg == name]
            before = [s.end for s in own if s.end <= phase.start + 1e-9]
            after = [s.start for s in own if s.start >= phase.end - 1e-9]
            assert times[number, leg, 0] == pytest.approx(max(before, default=-np.inf))
            assert times[number, leg, 1] == pytest.approx(min(after, default=np.inf))


def test_gentle_loads_are_a_wish_within_what_was_promised(wang: gaitopt.Quadruped) -> None:
    """Loads can go over within the time that is wished for, and little time is lost."""
    columns = gaitopt.s_columns(0, columns=2)
    plan = gaitopt.plan_route(wang, columns, free="posture", stability_margin=0.02)
    jumping, gentle = (retimed_gently(plan, None, 0.0, time) for time in (0.0, 0.05))
    assert gentle.settings == plan.settings
    assert gaitopt.verify(gentle, collisions=False).ok
    assert gentle.duration < 1.03 * jumping.duration
    assert gentle_everywhere(gentle, 0.05)
    assert not gentle_everywhere(jumping, 0.05)
    # So it is with another timing of the plan. The plan's own looks at the times of its
    # spline, and keeps most of it in those that come out.
    for own, time in ((gaitopt.retimed(plan), TURNING_LOAD_TIME), (plan, TURNING_LOAD_TIME / 1.5)):
        assert gentle_everywhere(own, time)
        assert not gentle_everywhere(jumping, time)
    # What limits promise themselves comes first.
    slow = [retimed_gently(plan, LIMITS, 0.0, time) for time in (0.0, 0.05)]
    assert slow[0].duration == slow[1].duration
