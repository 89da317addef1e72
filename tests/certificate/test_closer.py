"""Where a bound alone is short of what is asked, the certificate looks more closely."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import LEGS, MotionPath, Plan, Quadruped
from gaitopt.certificate import closer
from gaitopt.certificate.closer import looked_at_closely
from gaitopt.certificate.trace import Motion, trace
from gaitopt.conventions import BoolArray, FloatArray


@pytest.fixture(scope="module")
def quick(wang: Quadruped) -> Plan:
    """A walk whose body centre has just the margin that was asked for, for long times."""
    return gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=2), timing="velocity")


def bumped(plan: Plan, segment: int, column: int, by: float) -> Plan:
    """A coordinate leaves its course on one segment, and comes back: 16 by s^2 (1 - s)^2."""
    old, length = plan.path.coefficients, float(np.diff(plan.path.times)[segment])
    new = np.zeros((max(len(old), 5), *old.shape[1:]))
    new[len(new) - len(old) :] = old
    for power, share in ((2, 1.0), (3, -2.0), (4, 1.0)):
        new[len(new) - 1 - power, segment, column] += 16.0 * by * share / length**power
    return replace(plan, path=MotionPath(plan.path.times, new))


def centre_and_feet(plan: Plan, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Body centre ``(N, 2)`` and feet ``(N, 4, 2)`` by Pinocchio."""
    robot = plan.robot
    model, data = robot.model, robot.model.createData()
    centre, feet = [], []
    for row in plan.path.evaluate(times):
        turn = pin.rpy.rpyToMatrix(*row[3:6])
        q = np.concatenate([row[:3], pin.Quaternion(turn).coeffs(), row[6:]])
        pin.framesForwardKinematics(model, data, q)
        frames = [model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
        feet.append([data.oMf[frame].translation[:2].copy() for frame in frames])
        centre.append((row[:3] + turn @ robot.body_axes @ robot.centre)[:2])
    return np.array(centre), np.array(feet)


def least_margin(plan: Plan, index: int) -> float:
    """The least margin of the body centre at samples of a phase."""
    phase = plan.phases[index]
    times = np.linspace(phase.start, phase.start + phase.duration, 400)
    centre, feet = centre_and_feet(plan, times)
    standing = [leg in phase.support for leg in LEGS]
    return min(
        gaitopt.static_stability_margin(f[standing], c) for c, f in zip(centre, feet, strict=True)
    )


def test_what_a_foot_moves_counts_only_while_it_moves(quick: Plan) -> None:
    """A standing foot that moves by 30 um for a moment takes nothing off the rest of its phase.

    The margin is tight at the begin of the phase, and the foot moves where it is not.
    """
    index = next(i for i, p in enumerate(quick.phases) if p.flying and p.leg)
    phase = quick.phases[index]
    segment = int(np.searchsorted(quick.path.times, phase.start + 0.9 * phase.duration)) - 1
    column = 6 + quick.robot.leg_columns[phase.support[0]][1]
    plan = bumped(quick, segment, column, 1e-4)
    asked, margin = plan.settings.stability_margin, least_margin(plan, index)
    assert margin == pytest.approx(asked, abs=1e-4) and margin >= asked - 1e-6
    feet = centre_and_feet(plan, np.linspace(*plan.path.times[segment : segment + 2], 20))[1]
    moved = np.linalg.norm(np.ptp(feet[:, LEGS.index(phase.support[0])], axis=0))
    assert 1e-5 < moved < 1e-4
    check = gaitopt.verify(plan, collisions=False)["margin of the body centre"]
    assert check.status == "ok" and check.worst >= asked - 1e-6


@pytest.mark.parametrize("by", [3e-6, -3e-6])
def test_margins_are_known_to_a_micrometre_where_they_are_tight(quick: Plan, by: float) -> None:
    """A promise that is 3 um less than the least margin is kept, and 3 um more is not."""
    flying = [i for i, p in enumerate(quick.phases) if p.flying and p.leg]
    margin = min(least_margin(quick, i) for i in flying)
    asked = margin + by + 1e-6  # the certificate allows a micrometre of rounding
    plan = replace(quick, settings=replace(quick.settings, stability_margin=asked))
    check = gaitopt.verify(plan, collisions=False)["margin of the body centre"]
    assert check.status == ("violated" if by > 0.0 else "ok")


def test_feet_rise_from_columns_as_thin_as_needles(a1_walk: Plan) -> None:
    """They are outside the column's radius at once, and no lower than its top."""
    thin = replace(a1_walk, footholds=a1_walk.footholds.with_(radius=2e-5))
    assert gaitopt.verify(thin, collisions=False)["swing clearance"].status == "ok"


def test_a_look_ends_where_a_sample_settles_it(quick: Plan) -> None:
    """Pieces are cut four ways while the look asks for it, and a bounded number of times."""
    motion, looks = trace(quick), []

    def look(part: Motion, owner: np.ndarray) -> tuple[FloatArray, BoolArray]:
        looks.append(len(owner))
        again = owner == 5
        return np.where(again, -float(len(looks)), 1.0), again

    found = looked_at_closely(quick, motion, np.array([2, 5]), look)
    assert looks == [2, *(4**k for k in range(1, closer.MOST_ROUNDS + 1))]
    assert found.tolist() == [1.0, -float(len(looks))]
    too_many = np.zeros(closer.MOST_PIECES + 1, dtype=int)
    assert (looked_at_closely(quick, motion, too_many, look) == -np.inf).all()
