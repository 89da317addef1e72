"""The ZMP of a moving body, and bounds on it that hold between samples."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import gaitopt
from gaitopt import LEGS, MotionPath, Plan, Quadruped, plan_gait
from gaitopt.certificate.enclosure import Pieces, chord_deviation
from gaitopt.certificate.supports.zero_moment import ground_below, traced_zmp
from gaitopt.certificate.trace import trace
from gaitopt.conventions import GRAVITY
from gaitopt.plan.record import GaitRecord, RouteRecord
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.stability.zmp import point_mass_zmp

Array = NDArray[np.float64]
STILL = np.zeros(3)


def carried(path: MotionPath, arm: Array, times: Array) -> Array:
    """Place of a mass at ``arm`` in the base ``(N, 3)``."""
    values = path.evaluate(times)
    return values[:, :3] + rpy_to_matrix(values[:, 3:6]) @ arm


def zmp_by_differences(path: MotionPath, arm: Array, times: Array, ground: float) -> Array:
    """ZMP at ``times``, its acceleration by differences of the place."""
    h = 3e-4
    ahead, here, behind = (carried(path, arm, times + k * h) for k in (1, 0, -1))
    return point_mass_zmp(here, (ahead - 2 * here + behind) / h**2, ground)


def departure(path: MotionPath, pieces: Pieces, arm: Array, ground: float) -> tuple[Array, Array]:
    """How far the ZMP is seen to leave its chord on each piece, and the bound on it."""
    points, bounds = traced_zmp(pieces, arm, np.full(len(pieces.starts), ground))
    seen = []
    for i, (start, length) in enumerate(zip(pieces.starts, pieces.lengths, strict=True)):
        share = np.linspace(0.05, 0.95, 150)
        zmp = zmp_by_differences(path, arm, start + share * length, ground)
        chord = points[0, i] + share[:, None] * (points[1, i] - points[0, i])
        seen.append(np.linalg.norm(zmp - chord, axis=1).max())
    return np.array(seen), bounds


def one_piece(columns: dict[int, list[float]], duration: float) -> MotionPath:
    """A path of one polynomial; columns by number, the highest power first."""
    degree = max(len(c) for c in columns.values())
    coefficients = np.zeros((degree, 1, 6))
    for column, powers in columns.items():
        coefficients[degree - len(powers) :, 0, column] = powers
    return MotionPath([0.0, duration], coefficients)


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.integers(2, 5), st.floats(0.0, 0.4))
def test_the_zmp_of_random_paths_stays_within_its_bound(
    seed: int, degree: int, length: float
) -> None:
    """A body that moves, turns and bobs, with its centre off the base's origin."""
    rng = np.random.default_rng(seed)
    coefficients = rng.normal(size=(degree + 1, 3, 6)) * 0.5
    coefficients[:degree, :, 2] *= 0.3
    coefficients[degree, :, 2] = rng.uniform(0.3, 0.6, 3)
    path = MotionPath(np.arange(4) * 0.4, coefficients)
    arm = length * rng.normal(size=3) / 2.0
    pieces = Pieces.of(path).cut(np.full(3, 4))
    seen, bounds = departure(path, pieces, arm, -0.02)
    assert np.isfinite(bounds).any()
    # Rounding of second differences is about 1e-16 / h^2.
    assert (seen <= bounds + 1e-7).all()


def test_a_changing_load_moves_the_zmp_of_a_steady_acceleration() -> None:
    """The mass is pulled steadily along x, so c'''' = 0 and c''' = 0 there; the load alone moves p.

    With z'' = 6 a t the load falls evenly, and u = h / (g + z'') bends all the more.
    """
    path = one_piece({0: [1.0, 0.0, 0.0], 2: [-1.2, 0.0, 0.0, 0.5]}, 1.0)
    pieces = Pieces.of(path)
    seen, bounds = departure(path, pieces, STILL, 0.0)
    steady = chord_deviation(np.array([2.0]), pieces.lengths)
    assert seen[0] > 1.02 * steady[0], "the acceleration alone does not bound it"
    assert seen[0] <= bounds[0]


def test_a_height_that_changes_with_the_acceleration_counts_twice() -> None:
    """2 u' c''' outweighs all else: h rises as fast as the acceleration does."""
    path = one_piece({0: [5.0, 0.0, 0.0, 0.0], 2: [1.0, 0.2]}, 0.02)
    pieces = Pieces.of(path)
    seen, bounds = departure(path, pieces, STILL, 0.0)
    # p = x - z x'' / g = 5 t^3 - (0.2 + t) 30 t / g, whose second derivative is 30 t - 60 / g.
    assert seen[0] == pytest.approx((60.0 / GRAVITY - 0.3) * 0.02**2 / 8.0, rel=1e-2)
    without = chord_deviation(np.array([30.0 * 0.02]), pieces.lengths)
    assert seen[0] > 9.0 * without[0], "neither x'' nor u x'''' bounds it"
    assert bounds[0] == pytest.approx((60.0 / GRAVITY + 0.6) * 0.02**2 / 8.0, rel=1e-9)


def test_the_bound_of_a_level_path_is_nearly_reached() -> None:
    """x = t^4: p = t^4 - 12 u t^2 has p'' = 12 t^2 - 24 u, and u'' = u' = 0."""
    path = one_piece({0: [1.0, 0.0, 0.0, 0.0, 0.0], 2: [0.4]}, 0.02)
    pieces = Pieces.of(path)
    seen, bounds = departure(path, pieces, STILL, 0.0)
    u = 0.4 / GRAVITY
    assert bounds[0] == pytest.approx((24 * u + 48e-4) * 4e-4 / 8.0, rel=1e-9)
    assert traced_zmp(pieces, STILL, np.zeros(1))[0][1, 0, 0] == pytest.approx(16e-8 - 48e-4 * u)
    assert 0.97 * bounds[0] < seen[0] < bounds[0]


def test_halved_pieces_have_a_quarter_of_the_bound() -> None:
    path = one_piece({0: [3.0, 1.0, 0.0, 0.0], 2: [0.5, 0.0, 0.4], 4: [0.3, 0.2, 0.0]}, 0.2)
    arm = np.array([0.1, 0.05, -0.05])
    coarse, fine = (
        traced_zmp(p, arm, np.zeros(len(p.starts)))[1].max()
        for p in (Pieces.of(path).cut(np.array([n])) for n in (64, 128))
    )
    assert fine == pytest.approx(coarse / 4.0, rel=0.02)


def test_a_body_that_may_fall_freely_has_no_bound() -> None:
    falling = one_piece({0: [1.0, 0.0, 0.0], 2: [-0.5 * GRAVITY, 0.0, 0.5]}, 0.1)
    nearly = one_piece({0: [1.0, 0.0, 0.0], 2: [-0.499 * GRAVITY, 0.0, 0.5]}, 0.1)
    bounds = [traced_zmp(Pieces.of(p), STILL, np.zeros(1))[1][0] for p in (falling, nearly)]
    assert bounds[0] == np.inf and np.isfinite(bounds[1])


def test_the_ground_is_below_the_feet_that_stand(wang: Quadruped) -> None:
    """As planners have it: the mean of the standing feet of a phase, and their balls' radius."""
    rough = gaitopt.plan_crawl(
        wang, gaitopt.s_columns(5, columns=3, height_jitter=0.03), timing="velocity"
    )
    motion = trace(rough)
    ground = ground_below(rough, motion)
    flown = dict.fromkeys(LEGS, 0)
    for index, phase in enumerate(rough.phases):
        if phase.kind == "swing":
            flown[phase.leg] += 1
        places = [rough.footholds[leg][flown[leg], 2] for leg in phase.support]
        mine = ground[motion.phase == index]
        assert mine == pytest.approx(np.mean(places) - wang.foot_radius, abs=1e-6)
    assert np.ptp(ground) > 5e-3


@pytest.fixture(scope="module")
def swaying() -> Plan:
    return plan_gait(
        gaitopt.load_robot("wang2020-fast"), gaitopt.walk(1.6), velocity=0.08, duration=1.5,
        timing="velocity",
    )  # fmt: skip


def zmp_check(plan: Plan) -> gaitopt.Check:
    return gaitopt.verify(plan, collisions=False)["ZMP of the body centre"]


def test_a_gaits_own_margin_is_what_is_certified(swaying: Plan) -> None:
    """The planner's figure and the certificate's, from the path alone, are hundredths apart."""
    check = zmp_check(swaying)
    told = swaying.record.zmp_margin
    assert isinstance(told, float)
    assert check.status == "ok" and check.worst == pytest.approx(told, abs=2e-4)
    assert check.bound < 1e-4


def test_a_claim_is_judged_and_its_absence_told(swaying: Plan) -> None:
    told = swaying.record.zmp_margin
    assert isinstance(told, float)
    bold = dataclasses.replace(swaying, record=GaitRecord(zmp_margin=told + 2e-3))
    assert zmp_check(bold).status == "violated"
    silent = dataclasses.replace(swaying, record=GaitRecord())
    assert zmp_check(silent).status == "unchecked"
    assert "zmp_margin" in zmp_check(silent).note


@pytest.fixture(scope="module")
def dynamic(wang: gaitopt.Quadruped) -> Plan:
    return gaitopt.plan_route(wang, gaitopt.s_columns(0, columns=3), free="dynamic",
                              stability_margin=0.02, timing="velocity")  # fmt: skip


def asking(plan: Plan, **settings: object) -> Plan:
    """The same motion, said to be planned with other settings."""
    return dataclasses.replace(plan, settings=dataclasses.replace(plan.settings, **settings))


def test_a_dynamic_walk_is_held_to_what_was_asked_of_it(dynamic: Plan) -> None:
    """Whatever its record says: planted faults, and claims that are taken away."""
    check = zmp_check(dynamic)
    assert check.status == "ok" and check.limit == pytest.approx(0.02, abs=2e-6)
    assert 0.02 - 1e-6 <= check.worst < 0.0203
    assert zmp_check(asking(dynamic, stability_margin=0.0205)).status == "violated"
    for record in (RouteRecord(), RouteRecord(zmp_margin=-1.0)):
        told = dataclasses.replace(dynamic, record=record)
        assert zmp_check(told).limit == check.limit and zmp_check(told).status == "ok"
        assert zmp_check(asking(told, stability_margin=0.2)).status == "violated"


def test_a_static_walk_cannot_pass_for_a_dynamic_one(wang: gaitopt.Quadruped) -> None:
    plan = gaitopt.plan_route(
        wang, gaitopt.s_columns(0, columns=2), free="posture", timing="velocity"
    )
    named = (*plan.settings.to_dict()["free"], "dynamic")
    with pytest.raises(gaitopt.InputError, match="needs an acceleration_limit"):
        asking(plan, free=named)
    assert zmp_check(asking(plan, free=named, acceleration_limit=6.0)).worst == -np.inf


def test_settings_that_exclude_one_another_are_no_settings(dynamic: Plan) -> None:
    with pytest.raises(gaitopt.InputError, match="dynamic walk needs an acceleration_limit"):
        asking(dynamic, acceleration_limit=None)


def test_a_base_whose_velocity_jumps_has_no_zmp(swaying: Plan) -> None:
    """The base's velocity jumps by 0.1 mm/s in the middle."""
    times, coefficients = swaying.path.times, swaying.path.coefficients.copy()
    middle = len(times) // 2
    ramp = np.zeros_like(coefficients)
    ramp[-1, middle:, 0] = 1e-4 * (times[middle:-1] - times[middle])
    ramp[-2, middle:, 0] = 1e-4
    pushed = dataclasses.replace(swaying, path=MotionPath(times, coefficients + ramp))
    check = zmp_check(pushed)
    assert check.status == "violated" and check.worst == -np.inf
    assert check.when == pytest.approx(times[middle])
