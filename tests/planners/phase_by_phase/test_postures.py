"""Walks whose body has a given height, roll, pitch and yaw during every swing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from turning import on_the_spot, up_a_ramp

import gaitopt
from gaitopt import LEGS, InfeasibleStepError, InputError, Plan, Quadruped, plan_crawl, plan_route
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
    assert spin.settings.heading == 7.0


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
    with pytest.raises(InputError, match="does not take postures of footholds into account"):
        plan_route(wang, footholds)
