"""Walks whose body has a given height, roll, pitch and yaw during every swing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from turning import on_the_spot, up_a_ramp

import gaitopt
from gaitopt import (
    LEGS,
    Footholds,
    InfeasibleStepError,
    InputError,
    Plan,
    Quadruped,
    plan_crawl,
    plan_route,
)
from gaitopt.motion.body_and_feet import base_poses
from gaitopt.stability.margins import static_stability_margin

TURN, SLOPE = 0.3, float(np.radians(10.0))


@pytest.fixture(scope="module")
def spin(wang: Quadruped) -> Plan:
    return plan_crawl(wang, on_the_spot(wang, 2, TURN, first=7.0), timing="velocity")


@pytest.fixture(scope="module")
def climb(wang: Quadruped) -> Plan:
    return plan_crawl(wang, up_a_ramp(wang, SLOPE, 2), timing="velocity")


def bases(plan: Plan, times: list[float]) -> np.ndarray:
    """x, y, z, roll, pitch, yaw of the base."""
    return plan.path.evaluate(np.array(times))[:, :6]


@pytest.mark.parametrize("which", ["spin", "climb"])
def test_the_body_is_as_asked_during_every_swing(
    which: str, request: pytest.FixtureRequest
) -> None:
    plan: Plan = request.getfixturevalue(which)
    asked = plan.footholds.postures
    assert asked is not None
    for swing in plan.swings:
        times = np.linspace(swing.start, swing.end, 7)
        motion, base = plan.at(times), bases(plan, times.tolist())
        np.testing.assert_allclose(motion.cog[:, 2], asked[swing.step + 1, 0], atol=1e-9)
        np.testing.assert_allclose(
            base[:, 3:], np.tile(asked[swing.step + 1, 1:], (7, 1)), atol=1e-9
        )
        np.testing.assert_allclose(base, np.tile(base[0], (7, 1)), atol=1e-9)
    np.testing.assert_allclose(bases(plan, [0.0])[0, 3:], asked[0, 1:], atol=1e-12)
    certificate = gaitopt.verify(plan)
    assert certificate.ok, certificate.report()


def test_the_body_turns_evenly_along_a_straight_line(spin: Plan) -> None:
    for phase in spin.phases[::2]:
        times = np.linspace(phase.start, phase.end, 9)
        base = bases(spin, times.tolist())
        change = base[-1] - base[0]
        share = (base[:, 5] - base[0, 5]) / change[5]
        assert (np.diff(share) > 0.0).all()
        np.testing.assert_allclose(base, base[0] + share[:, None] * change, atol=1e-12)


def test_yaw_counts_whole_turns(spin: Plan) -> None:
    base = bases(spin, [0.0, spin.duration])
    assert base[0, 5] == pytest.approx(7.0, abs=1e-12)
    assert base[1, 5] == pytest.approx(7.0 + TURN * 7.5 / 4, abs=1e-9)
    assert spin.settings.heading == pytest.approx(7.0 - 2.0 * np.pi, abs=1e-12)


def test_the_true_centre_of_mass_keeps_its_margin_in_tilted_postures(wang: Quadruped) -> None:
    """Judged by Pinocchio's centre of mass and the triangle of the standing feet."""
    plan = plan_crawl(
        wang, up_a_ramp(wang, SLOPE, 1), timing="velocity", com="model", stability_margin=0.03
    )
    data = wang.model.createData()
    least = np.inf
    for swing in plan.swings:
        motion = plan.at(np.linspace(swing.start, swing.end, 41))
        for q, feet in zip(motion.q, motion.feet, strict=True):
            com = pin.centerOfMass(wang.model, data, q)
            standing = np.array([feet[i] for i, leg in enumerate(LEGS) if leg != swing.leg])
            least = min(least, float(static_stability_margin(standing, com)))
    assert 0.03 - 1e-6 < least < 0.031


def test_level_postures_give_the_walk_without_any(wang: Quadruped) -> None:
    columns = gaitopt.s_columns(3, columns=2)
    plain = plan_crawl(wang, columns, body_height=0.4, timing="velocity")
    level = np.tile([columns.array[..., 2].mean() + 0.4, 0.0, 0.0, 0.0], (5, 1))
    order = plain.settings.to_dict()["sequence"]
    again = plan_crawl(wang, columns.with_(order=order, postures=level), timing="velocity")
    assert again.duration == pytest.approx(plain.duration, rel=1e-9)
    times = np.linspace(0.0, plain.duration, 101)
    np.testing.assert_allclose(again.at(times).q, plain.at(times).q, atol=1e-7)


@pytest.mark.parametrize(
    ("timing", "yaw", "close"), [("velocity", 2.5, 1e-6), ("forces", np.pi / 2, 1e-4)]
)
def test_a_walk_turned_as_a_whole_is_the_same_walk(
    wang: Quadruped, timing: str, yaw: float, close: float
) -> None:
    """Pyramids of friction have four sides along the world's axes: they turn by right angles.

    Rounding may decide whether a path gets one knot more, by which timings with forces differ.
    """
    one = plan_crawl(wang, up_a_ramp(wang, SLOPE, 1), timing=timing)
    other = plan_crawl(wang, up_a_ramp(wang, SLOPE, 1, yaw=yaw), timing=timing)
    assert other.duration == pytest.approx(one.duration, rel=close)
    for mine, plain in zip(other.phases, one.phases, strict=True):
        joints = [p.at([x.start, x.end]).q[:, 7:] for p, x in ((other, mine), (one, plain))]
        np.testing.assert_allclose(joints[0], joints[1], atol=1e-6)


@pytest.mark.parametrize("which", ["turn", "ramp"])
def test_forces_time_a_body_that_turns_and_its_feet_do_not_slip(
    wang: Quadruped, which: str
) -> None:
    footholds = on_the_spot(wang, 1, TURN) if which == "turn" else up_a_ramp(wang, SLOPE, 1)
    plan = plan_crawl(wang, footholds)
    certificate = gaitopt.verify(plan)
    assert certificate.ok, certificate.report()
    assert certificate["slip of standing feet"].worst < 1.1e-5


def test_a_plan_file_keeps_postures(climb: Plan, tmp_path: Path) -> None:
    climb.save(tmp_path / "climb.npz")
    again = gaitopt.load_plan(tmp_path / "climb.npz")
    assert again.footholds == climb.footholds and gaitopt.verify(again).ok


def test_postures_that_legs_do_not_reach_are_refused_with_the_step(wang: Quadruped) -> None:
    footholds = on_the_spot(wang, 1, TURN)
    assert footholds.postures is not None
    high, pitched = footholds.postures.copy(), footholds.postures.copy()
    high[2, 0] = 0.7
    pitched[3, 2] = 1.3
    with pytest.raises(InfeasibleStepError, match=r"step 1: in the posture .* lower the body"):
        plan_crawl(wang, footholds.with_(postures=high))
    with pytest.raises(InfeasibleStepError, match=r"step 2") as caught:
        plan_crawl(wang, footholds.with_(postures=pitched))
    assert caught.value.step == 2


def test_a_body_that_turns_fully_on_planted_feet_is_refused(wang: Quadruped) -> None:
    footholds = on_the_spot(wang, 1, TURN)
    assert footholds.postures is not None
    postures = footholds.postures.copy()
    postures[3:, 3] += 2.0 * np.pi
    with pytest.raises(InfeasibleStepError, match="step 2"):
        plan_crawl(wang, footholds.with_(postures=postures), timing="velocity")


def test_postures_go_with_the_order_of_the_footholds(wang: Quadruped) -> None:
    footholds = on_the_spot(wang, 1, TURN)
    with pytest.raises(InputError, match="postures of the body go with the order"):
        plan_crawl(wang, footholds, sequence=("RH", "LF", "LH", "RF"))
    with pytest.raises(InputError, match="a free order is asked for"):
        plan_crawl(wang, footholds, sequence="free")
    with pytest.raises(InputError, match="a free order is asked for"):
        plan_route(wang, footholds, sequence="free")


@pytest.mark.parametrize("free", ["overlap", "swing", "posture"])
def test_time_optimal_walks_turn_with_the_postures(wang: Quadruped, free: str) -> None:
    """Beyond half a turn from zero, where angles of rotations jump."""
    footholds = on_the_spot(wang, 1, TURN, first=3.0)
    plan = plan_route(wang, footholds, free=free, timing="velocity")
    certificate = gaitopt.verify(plan)
    assert certificate.ok, certificate.report()
    assert plan.duration < plan_crawl(wang, footholds, timing="velocity").duration
    ends = bases(plan, [0.0, plan.duration])[:, 3:]
    np.testing.assert_allclose(ends[0], [0.0, 0.0, 3.0], atol=1e-9)
    if free == "posture":
        assert np.abs(ends[1] - [0.0, 0.0, 3.0 + TURN * 3.5 / 4]).max() < 0.36
    else:
        np.testing.assert_allclose(ends[1], [0.0, 0.0, 3.0 + TURN * 3.5 / 4], atol=1e-9)
    middle = plan.swings[1]
    rpy = bases(plan, [(middle.start + middle.end) / 2.0])[0, 3:]
    within = 1e-9 if free == "overlap" else 0.36
    assert np.abs(rpy - [0.0, 0.0, 3.0 + TURN * 1.5 / 4]).max() < within


def test_splines_turn_with_forces(wang: Quadruped) -> None:
    whole = up_a_ramp(wang, SLOPE, 1)
    count = {leg: 2 if leg in ("RH", "RF") else 1 for leg in LEGS}
    assert whole.postures is not None and whole.normals is not None
    two_steps = Footholds(
        {leg: whole[leg][: count[leg]] for leg in LEGS}, order=("RH", "RF"),
        normals={leg: whole.normals[leg][: count[leg]] for leg in LEGS},
        postures=whole.postures[:3],
    )  # fmt: skip
    plan = plan_route(wang, two_steps, free="swing")
    certificate = gaitopt.verify(plan)
    assert certificate.ok, certificate.report()
    assert plan.record.to_dict().get("instead") is None
    np.testing.assert_allclose(bases(plan, [0.5, 1.0])[:, 4], -SLOPE, atol=1e-9)


def test_turns_of_the_base_are_those_of_the_body_however_they_are_cut(wang: Quadruped) -> None:
    tilts = np.zeros((400, 3))
    tilts[:, 2] = np.linspace(-9.0, 30.0, 400)
    whole = base_poses(wang, 2.0, np.zeros((400, 3)), tilts)
    np.testing.assert_allclose(whole[:, 5], 2.0 + tilts[:, 2], atol=1e-9)
    for cut in (slice(150, 160), slice(390, 400), slice(7, 8)):
        part = base_poses(wang, 2.0, np.zeros((len(tilts[cut]), 3)), tilts[cut])
        np.testing.assert_allclose(part, whole[cut], atol=1e-12)
