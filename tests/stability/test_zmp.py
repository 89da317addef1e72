"""The ZMP: limits, hand-made cases, and momentum as judge of inverse dynamics."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from gaitopt.conventions import GRAVITY, FloatArray, rotation_z
from gaitopt.errors import InputError
from gaitopt.robots.catalog import load_robot, robot_names
from gaitopt.stability.contacts import in_flight, standing_feet, support_margin
from gaitopt.stability.margins import static_stability_margin
from gaitopt.stability.zmp import cart_table_zmp, ground_wrench, point_mass_zmp, whole_body_zmp

STANCE = np.array([[0.2, 0.15], [-0.2, 0.15], [-0.2, -0.15], [0.2, -0.15]])
ALL = np.ones(4, dtype=bool)
UP = np.array([0.0, 0.0, 1.0])
PATTERNS = np.array([[bool(k >> i & 1) for i in range(4)] for k in range(16)])
each_robot = pytest.mark.parametrize("name", robot_names())
robot = cache(load_robot)


def random_motion(model: Any, seed: int, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Configurations anywhere, with velocities and accelerations that keep some load."""
    rng = np.random.default_rng(seed)
    q = np.empty((count, model.nq))
    q[:, :3] = rng.uniform(-2, 2, (count, 3))
    q[:, 3:7] = rng.normal(size=(count, 4))
    q[:, 3:7] /= np.linalg.norm(q[:, 3:7], axis=1, keepdims=True)
    q[:, 7:] = rng.uniform(-1, 1, (count, model.nq - 7))
    return q, rng.normal(size=(count, model.nv)), rng.normal(size=(count, model.nv))


# --- a point mass -----------------------------------------------------------------------------


@pytest.mark.parametrize("zmp", [cart_table_zmp, point_mass_zmp])
def test_at_rest_the_zmp_is_the_projection(zmp: Any) -> None:
    com = np.random.default_rng(0).uniform(-1, 1, (20, 3))
    np.testing.assert_array_equal(zmp(com, np.zeros(3), -2.0), com[:, :2])


def test_speeding_up_moves_it_back_by_the_height_over_g() -> None:
    """0.5 m above ground at 0.1 m, 2 m/s^2 forward: 0.4 * 2 / 9.81 behind."""
    found = cart_table_zmp([1.0, 2.0, 0.5], [2.0, -1.0, 7.0], 0.1)
    assert found == pytest.approx([1.0 - 0.8 / 9.81, 2.0 + 0.4 / 9.81], abs=1e-15)


def test_rising_faster_draws_it_nearer_and_sinking_farther() -> None:
    com, pull = [0.0, 0.0, 0.4], 2.0
    found = point_mass_zmp(com, [[pull, 0.0, a] for a in (0.0, GRAVITY, -GRAVITY / 2)])
    assert found[0] == pytest.approx(cart_table_zmp(com, [pull, 0.0]), abs=1e-16)
    assert found[:, 0] == pytest.approx(found[0, 0] * np.array([1.0, 0.5, 2.0]), rel=1e-14)


@pytest.mark.parametrize("fall", [-GRAVITY, -2 * GRAVITY])
def test_in_free_fall_there_is_no_zmp(fall: float) -> None:
    assert np.isnan(point_mass_zmp([0.1, 0.2, 0.3], [0.0, 0.0, fall])).all()


@given(st.integers(0, 2**32 - 1))
def test_the_force_at_the_zmp_points_at_the_mass(seed: int) -> None:
    """Gravity and inertia act along one line through the mass; the ground answers on it."""
    rng = np.random.default_rng(seed)
    com, pull = rng.uniform(-1, 1, 3) + 2 * UP, rng.uniform(-5, 5, 3)
    foot = np.append(point_mass_zmp(com, pull, 0.3), 0.3)
    force = pull + GRAVITY * UP
    np.testing.assert_allclose(np.cross(com - foot, force), 0.0, rtol=0, atol=1e-13)


def test_samples_and_grounds_are_broadcast() -> None:
    com, pull = np.ones((5, 1, 3)), np.ones((1, 7, 3))
    assert cart_table_zmp(com, pull, np.zeros(7)).shape == (5, 7, 2)
    assert point_mass_zmp(com, pull, np.zeros((5, 1))).shape == (5, 7, 2)


# --- the whole body ---------------------------------------------------------------------------


@each_robot
def test_a_robot_at_rest_has_its_zmp_below_its_com(name: str) -> None:
    model = robot(name).model
    q, v, _ = random_motion(model, 1, 20)
    data = model.createData()
    coms = np.array([pin.centerOfMass(model, data, row).copy() for row in q])
    for ground in (0.0, -1.3):
        found = whole_body_zmp(model, q, 0.0 * v, 0.0 * v, ground)
        np.testing.assert_allclose(found, coms[:, :2], rtol=0, atol=1e-12)


@each_robot
def test_it_is_what_the_rate_of_the_momentum_asks_for(name: str) -> None:
    """Force and moment from Pinocchio's rate of the centroidal momentum, not from joint forces."""
    model = robot(name).model
    data = model.createData()
    weight = pin.computeTotalMass(model) * GRAVITY
    q, v, a = random_motion(model, 2, 30)
    found = whole_body_zmp(model, q, v, a, -0.4)
    for i in range(len(q)):
        rate = pin.computeCentroidalMomentumTimeVariation(model, data, q[i], v[i], a[i])
        force = rate.linear + weight * UP
        x, y, z = data.com[0]
        expected = [
            x - ((z + 0.4) * force[0] + rate.angular[1]) / force[2],
            y - ((z + 0.4) * force[1] - rate.angular[0]) / force[2],
        ]
        if force[2] > 0:
            np.testing.assert_allclose(found[i], expected, rtol=1e-9, atol=1e-11)
        else:
            assert np.isnan(found[i]).all()


def test_it_follows_the_momentum_of_a_motion_followed_in_time() -> None:
    """Momentum differenced along a motion that is integrated, with no acceleration handed over."""
    model = robot("a1").model
    data, step = model.createData(), 1e-5
    q, v, a = (x[0] for x in random_motion(model, 3, 1))
    momenta = []
    for t in (-step, step):
        # v(t) = v + a t is integrated exactly to the second order in t.
        there = pin.integrate(model, q, v * t + a * t**2 / 2.0)
        momentum = pin.computeCentroidalMomentum(model, data, there, v + a * t)
        place = data.com[0].copy()
        about_origin = momentum.angular + np.cross(place, momentum.linear)
        momenta.append(np.concatenate([momentum.linear, about_origin]))
    rate = (momenta[1] - momenta[0]) / (2 * step)
    com = pin.centerOfMass(model, data, q).copy()
    weight = pin.computeTotalMass(model) * GRAVITY
    force, moment = rate[:3] + weight * UP, rate[3:] + np.cross(com, weight * UP)
    expected = [-moment[1] / force[2], moment[0] / force[2]]
    assert whole_body_zmp(model, q, v, a) == pytest.approx(expected, abs=1e-6)


@each_robot
def test_without_turning_bodies_it_is_that_of_a_point_mass(name: str) -> None:
    """A stiff robot that is only shifted has no angular momentum about its COM."""
    model = robot(name).model
    q, v, a = random_motion(model, 4, 20)
    data = model.createData()
    coms = np.array([pin.centerOfMass(model, data, row).copy() for row in q])
    rotation = np.array([pin.Quaternion(row[3:7]).toRotationMatrix() for row in q])
    shift = a[:, :3].copy()
    a[:, :3] = np.einsum("nij,ni->nj", rotation, shift)
    a[:, 3:], v[:] = 0.0, 0.0
    found = whole_body_zmp(model, q, v, a, 0.1)
    np.testing.assert_allclose(found, point_mass_zmp(coms, shift, 0.1), rtol=0, atol=1e-11)


def test_a_body_that_begins_to_turn_moves_it_although_the_com_stays() -> None:
    """The moment that it needs moves the ZMP by the rate of the angular momentum over m g."""
    model = robot("wang2020").model
    data, q = model.createData(), pin.neutral(model)
    q[2] = 0.4
    v, a = np.zeros(model.nv), np.zeros(model.nv)
    a[4] = 1.0  # the whole robot, stiff, about y
    com = pin.centerOfMass(model, data, q).copy()
    pin.ccrba(model, data, q, v)
    inertia = data.Ig.inertia[1, 1]
    a[:3] = -np.cross(a[3:6], com - q[:3])  # so that the COM itself stays
    found = whole_body_zmp(model, q, v, a)
    shift = -inertia / (pin.computeTotalMass(model) * GRAVITY)
    assert found == pytest.approx([com[0] + shift, com[1]], abs=1e-14)
    assert abs(shift) > 1e-3


def test_a_robot_that_falls_freely_has_no_zmp() -> None:
    model = robot("a1").model
    q, a = pin.neutral(model), np.zeros(model.nv)
    a[2] = -GRAVITY
    np.testing.assert_allclose(ground_wrench(model, q, 0 * a, a), 0.0, rtol=0, atol=1e-11)
    assert np.isnan(whole_body_zmp(model, q, 0 * a, a)).all()


def test_the_ground_carries_the_weight_at_the_com() -> None:
    model = robot("anymal_c").model
    q, v, _ = random_motion(model, 5, 10)
    data, weight = model.createData(), pin.computeTotalMass(model) * GRAVITY
    arms = np.array([pin.centerOfMass(model, data, row) - row[:3] for row in q])
    wrench = ground_wrench(model, q, 0 * v, 0 * v)
    np.testing.assert_allclose(wrench[:, :3], np.tile(weight * UP, (10, 1)), rtol=0, atol=1e-9)
    np.testing.assert_allclose(wrench[:, 3:], np.cross(arms, weight * UP), rtol=0, atol=1e-9)


def test_moving_and_turning_the_world_moves_and_turns_the_zmp() -> None:
    model = robot("a1").model
    q, v, a = random_motion(model, 6, 20)
    turn, move = rotation_z(0.7), np.array([30.0, -20.0, 0.0])
    there = q.copy()
    there[:, :3] = q[:, :3] @ turn.T + move
    spin = pin.Quaternion(turn)
    there[:, 3:7] = [(spin * pin.Quaternion(row[3:7])).coeffs() for row in q]
    here = whole_body_zmp(model, q, v, a)
    found = whole_body_zmp(model, there, v, a)
    np.testing.assert_allclose(found, here @ turn[:2, :2].T + move[:2], rtol=0, atol=1e-11)


def test_a_motion_of_another_model_is_refused() -> None:
    model = robot("a1").model
    q, v, a = random_motion(model, 7, 3)
    with pytest.raises(InputError, match=r"v must be \(\.\.\., 18\), got \(3, 19\)"):
        whole_body_zmp(model, q, q, a)
    assert whole_body_zmp(model, q[None], v, a[0]).shape == (1, 3, 2)


# --- the margin -------------------------------------------------------------------------------


def hull_distance(feet: FloatArray, point: FloatArray) -> float:
    """Distance from the hull by a search over the feet's weights."""
    start = np.full(len(feet), 1.0 / len(feet))
    found = minimize(
        lambda w: np.sum((w @ feet - point) ** 2), start, method="SLSQP", tol=1e-16,
        bounds=[(0, 1)] * len(feet), constraints={"type": "eq", "fun": lambda w: w.sum() - 1.0},
        options={"maxiter": 500},
    )  # fmt: skip
    return float(np.sqrt(found.fun))


def test_every_set_of_feet_has_its_margin() -> None:
    """All sixteen sets: the static margin inside, minus the distance from the hull outside."""
    rng = np.random.default_rng(2)
    inside = 0
    for pattern in PATTERNS[1:]:
        for _ in range(20):
            feet, point = rng.uniform(-0.5, 0.5, (4, 2)), rng.uniform(-0.3, 0.3, 2)
            found = float(support_margin(feet, pattern, point))
            standing = feet[pattern]
            if len(standing) >= 3 and static_stability_margin(standing, point) > 0:
                inside += 1
                assert found == pytest.approx(static_stability_margin(standing, point), abs=1e-15)
            else:
                assert found == pytest.approx(-hull_distance(standing, point), abs=1e-6)
    assert inside > 10


@pytest.mark.parametrize(
    ("pattern", "point", "margin"),
    [
        ((1, 1, 1, 1), (0.0, 0.0), 0.15),
        ((1, 1, 1, 1), (0.2 + 0.03, 0.15 + 0.04), -0.05),  # off a corner: from the corner
        ((1, 0, 1, 0), (0.0, 0.0), 0.0),  # a trot's diagonal
        ((1, 0, 1, 0), (0.03, -0.04), -0.05),  # square to it
        ((1, 0, 1, 0), (0.2 + 0.08, 0.15 + 0.06), -0.1),  # beyond its end
        ((1, 1, 0, 0), (0.0, 0.0), -0.15),
        ((0, 0, 0, 1), (0.2, -0.15), 0.0),
        ((0, 0, 0, 1), (0.5, 0.25), -0.5),
    ],
)
def test_known_margins(pattern: tuple[int, ...], point: tuple[float, float], margin: float) -> None:
    found = support_margin(STANCE, np.array(pattern, dtype=bool), point)
    assert found == pytest.approx(margin, abs=1e-15)


def test_in_flight_there_is_no_margin_and_the_mask_says_why() -> None:
    contacts = np.array([[False] * 4, [True] * 4])
    found = support_margin(STANCE, contacts, [[0.0, 0.0], [np.nan, 0.0]])
    assert np.isnan(found).all()
    assert in_flight(contacts).tolist() == [True, False]


def test_feet_in_one_row_are_a_segment() -> None:
    row = np.array([[0.0, 0.0], [0.1, 0.0], [0.3, 0.0], [0.2, 0.0]])
    assert support_margin(row, ALL, [0.15, 0.0]) == 0.0
    assert support_margin(row, ALL, [0.15, 0.05]) == pytest.approx(-0.05, abs=1e-16)
    assert support_margin(row, ALL, [0.7, 0.0]) == pytest.approx(-0.4, abs=1e-16)


@given(st.integers(0, 2**32 - 1), st.integers(1, 15))
def test_its_sign_is_that_of_the_static_margin_and_it_is_never_above_it(
    seed: int, pattern: int
) -> None:
    rng = np.random.default_rng(seed)
    feet, point, standing = rng.uniform(-1, 1, (4, 2)), rng.uniform(-1, 1, 2), PATTERNS[pattern]
    found = support_margin(feet, standing, point)
    if standing.sum() < 3:
        assert found <= 0
    else:
        static = static_stability_margin(feet[standing], point)
        assert found <= static + 1e-15 and np.sign(found) == np.sign(static)


@given(st.integers(0, 2**32 - 1), st.integers(1, 15), st.floats(-4.0, 4.0))
def test_margin_does_not_depend_on_place_heading_or_hand(
    seed: int, pattern: int, angle: float
) -> None:
    rng = np.random.default_rng(seed)
    feet, point, standing = rng.uniform(-1, 1, (4, 2)), rng.uniform(-1, 1, 2), PATTERNS[pattern]
    here = support_margin(feet, standing, point)
    turn, move = rotation_z(angle)[:2, :2] * [1.0, -1.0], rng.uniform(-10, 10, 2)
    there = support_margin(feet @ turn.T + move, standing, turn @ point + move)
    assert there == pytest.approx(here, abs=1e-12)


@given(st.integers(0, 2**32 - 1), st.integers(1, 15))
def test_it_changes_no_faster_than_the_point_moves(seed: int, pattern: int) -> None:
    rng = np.random.default_rng(seed)
    feet, points = rng.uniform(-1, 1, (4, 2)), rng.uniform(-1, 1, (2, 2))
    margins = support_margin(feet, PATTERNS[pattern], points)
    assert abs(margins[1] - margins[0]) <= np.linalg.norm(points[1] - points[0]) + 1e-12


def test_mixed_samples_are_the_samples_one_by_one_wherever_feet_fly() -> None:
    rng = np.random.default_rng(3)
    contacts = PATTERNS[rng.integers(1, 16, 400)]
    feet, points = rng.uniform(-1, 1, (400, 4, 3)), rng.uniform(-1, 1, (400, 2))
    flying = np.where(contacts[..., None], feet, np.nan)
    found = support_margin(flying, contacts, points)
    for i in range(400):
        standing = feet[i][contacts[i]]
        alone = support_margin(standing, np.ones(len(standing), dtype=bool), points[i])
        assert found[i] == pytest.approx(alone, abs=1e-15)


def test_heights_do_not_count_and_samples_are_broadcast() -> None:
    rng = np.random.default_rng(5)
    feet, points = rng.uniform(-1, 1, (7, 1, 4, 3)), rng.uniform(-1, 1, (5, 3))
    found = support_margin(feet, PATTERNS[:7, None], points)
    assert found.shape == (7, 5)
    flat = support_margin(feet[3, 0, :, :2], PATTERNS[3], points[2, :2])
    assert found[3, 2] == pytest.approx(flat, abs=1e-15)
    assert in_flight(PATTERNS[:7, None]).tolist() == [[True]] + [[False]] * 6


def test_feet_that_fly_stand_in_for_one_that_stands() -> None:
    moved = standing_feet(STANCE, np.array([False, True, False, True]))
    np.testing.assert_array_equal(moved, STANCE[[1, 1, 1, 3]])
    assert np.isnan(standing_feet(STANCE, np.zeros(4, dtype=bool))).all()


def test_loads_are_no_contacts() -> None:
    with pytest.raises(InputError, match=r"contacts must be truth values \(bool\), got float64"):
        support_margin(STANCE, [0.3, 0.0, 1.0, 1.0], [0.0, 0.0])
    with pytest.raises(InputError, match=r"got int64"):
        in_flight([1, 1, 0, 1])


@pytest.mark.parametrize("zmp", [cart_table_zmp, point_mass_zmp])
@pytest.mark.parametrize("height", ["0.1", None, np.ma.masked, 1e7])
def test_what_is_no_height_of_the_ground_is_refused(zmp: Any, height: Any) -> None:
    with pytest.raises(InputError, match=r"^ground_height.* must be "):
        zmp(np.ones(3), np.ones(3), height)


def test_what_is_no_place_is_refused() -> None:
    with pytest.raises(InputError, match=r"point must be \(\.\.\., 2\) or \(\.\.\., 3\), got \(\)"):
        support_margin(STANCE, ALL, 0.0)
    with pytest.raises(InputError, match=r"com must be \(\.\.\., 3\), got \(2,\)"):
        cart_table_zmp([0.0, 0.0], [0.0, 0.0])
