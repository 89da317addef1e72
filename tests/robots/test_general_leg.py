"""Legs of three hinges with any axes, with Pinocchio, closed forms and physics as judges."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from robot_loading import quiet, refusal
from robot_texts import CORNERS, LOWER, OUT, UPPER, collision, joint, link, robot

import gaitopt
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.discovery import find_chains, with_feet
from gaitopt.robots.general_leg.hinges import ThreeHinges
from gaitopt.robots.general_leg.inverse import HingeInverse
from gaitopt.robots.general_leg.leg import GeneralLeg
from gaitopt.robots.general_leg.reading import general_leg
from gaitopt.robots.leg_angles import wrap_angle
from gaitopt.robots.leg_parts import LegParts
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.columns import s_columns

PITCH_ROLL_PITCH = ("0 1 0", "1 0 0", "0 1 0")
TILTED = ("0.97 0.17 0.17", "0.1 0.98 -0.1", "0 1 0.15")
TOE_OUT = ("0.985 0.174 0", "0 1 0", "0 1 0")


def lowered(text: str, down: float = 0.05) -> str:
    """The second axis of each leg lies below the first one, and does not meet it."""
    for out in (OUT, -OUT):
        text = text.replace(f'<origin xyz="0 {out} 0"', f'<origin xyz="0 {out} {-down}"')
    return text


TEXTS: dict[str, Callable[[], str]] = {
    "pitch-roll-pitch": lambda: robot(axes=PITCH_ROLL_PITCH),
    "pitch-roll-pitch, apart": lambda: lowered(robot(axes=PITCH_ROLL_PITCH)),
    "hips toe out": lambda: robot(axes=TOE_OUT),
    "all axes tilted": lambda: robot(axes=TILTED),
    "all axes tilted, apart": lambda: lowered(robot(axes=TILTED)),
}
CLOSED = {"pitch-roll-pitch", "hips toe out"}
each_kind = pytest.mark.parametrize("kind", TEXTS)


@cache
def model(kind: str) -> Quadruped:
    return quiet(TEXTS[kind]())


def legs_of(kind: str) -> list[GeneralLeg]:
    found = list(model(kind).legs.values())
    assert all(isinstance(leg, GeneralLeg) for leg in found)
    return found  # type: ignore[return-value]


def postures(leg: GeneralLeg, count: int, seed: int = 0, swing: float = 0.6) -> FloatArray:
    """Joint angles around the standing posture, within the limits."""
    rng = np.random.default_rng(seed)
    q = leg.standing + rng.uniform(-swing, swing, (count, 3))
    return np.clip(q, *leg.position_limits)


# --- forwards, by Pinocchio -------------------------------------------------------------------


@each_kind
def test_forward_jacobian_and_its_rate_are_pinocchio_s(kind: str) -> None:
    made = model(kind)
    data, rng = made.model.createData(), np.random.default_rng(1)
    q, v = pin.neutral(made.model), np.zeros(made.model.nv)
    for _ in range(50):
        q[7:], v[6:] = rng.uniform(-np.pi, np.pi, (2, 12))
        pin.computeJointJacobiansTimeVariation(made.model, data, q, v)
        pin.framesForwardKinematics(made.model, data, q)
        for name, leg in made.legs.items():
            columns = list(made.leg_columns[name])
            angles, rates = q[7:][columns], v[6:][columns]
            frame = made.model.getFrameId(leg.foot)
            place = data.oMf[frame].translation
            np.testing.assert_allclose(leg.forward(angles), place, rtol=0, atol=1e-14)
            six = [6 + c for c in columns]
            world = pin.LOCAL_WORLD_ALIGNED
            slope = pin.getFrameJacobian(made.model, data, frame, world)[:3, six]
            np.testing.assert_allclose(leg.jacobian(angles), slope, rtol=0, atol=1e-14)
            change = pin.getFrameJacobianTimeVariation(made.model, data, frame, world)[:3, six]
            np.testing.assert_allclose(leg.jacobian_rate(angles, rates), change, rtol=0, atol=1e-13)


# --- backwards --------------------------------------------------------------------------------


@each_kind
def test_inverse_leads_back_to_the_angles(kind: str) -> None:
    for leg in legs_of(kind):
        assert leg.is_closed_form == (kind in CLOSED)
        q = postures(leg, 500)
        found = leg.inverse(leg.forward(q))
        np.testing.assert_allclose(found, q, rtol=0, atol=1e-9)
        assert (leg.shortfall(leg.forward(q)) == 0.0).all()


@each_kind
def test_inverse_takes_any_leading_axes_and_places_that_are_not_finite(kind: str) -> None:
    leg = legs_of(kind)[0]
    points = leg.forward(postures(leg, 24)).reshape(2, 3, 4, 3)
    found = leg.inverse(points)
    alone = leg.inverse(points[1, 2, 3])
    np.testing.assert_allclose(found[1, 2, 3], alone, rtol=0, atol=1e-12)
    points[0, 1, 2, 0] = np.nan
    points[1, 0, 0] = [np.inf, 0.0, -0.3]
    lost = np.isnan(leg.inverse(points)).all(axis=-1)
    assert lost.sum() == 2 and lost[0, 1, 2] and lost[1, 0, 0]
    assert leg.inverse(np.zeros((0, 3))).shape == (0, 3)
    assert np.isfinite(leg.inverse([1e300, -1e300, 1e200])).all()


@pytest.mark.parametrize("name", ["wang2020", "go2", "hyq", "anymal_c"])
def test_a_leg_that_has_a_closed_form_gets_its_angles(name: str) -> None:
    """Roll-pitch-pitch legs, read as if their axes were any: an independent formula."""
    known = load_robot(name)
    feet = {leg: one.foot for leg, one in known.legs.items()}
    for leg_name, chain in with_feet(known.model, find_chains(known.model), feet).items():
        points, axes = chain.points @ known.body_axes, chain.axes @ known.body_axes
        leg = known.legs[leg_name]
        parts = LegParts(known.model, leg.name, chain, points, axes, chain.tip @ known.body_axes,
                         leg.knee)  # fmt: skip
        ours = general_leg(parts)
        assert ours.knee == leg.knee
        assert (ours.upper, ours.lower) == pytest.approx((leg.upper, leg.lower), abs=1e-12)
        assert (ours.least_reach, ours.reach) == pytest.approx(
            (leg.least_reach, leg.reach), abs=1e-9
        )
        places = leg.forward(postures(ours, 300, swing=0.5))
        np.testing.assert_allclose(ours.inverse(places), leg.inverse(places), rtol=0, atol=1e-8)
        np.testing.assert_allclose(ours.shortfall(places), 0.0, rtol=0, atol=1e-9)
        far = leg.hip + np.array([0.1, 1.1 * leg.lateral, -1.2 * (leg.drop + leg.reach)])
        # The closed form counts lengths square to the knee's axis, and ours is a distance.
        assert ours.shortfall(far) == pytest.approx(float(leg.shortfall(far)), rel=0.1)


unit = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)
angles = st.tuples(*[st.floats(-3.1, 3.1)] * 3)


@given(st.tuples(unit, unit, unit), st.tuples(unit, unit, unit), unit, angles)
def test_every_posture_of_any_three_hinges_is_found(
    axes: tuple[tuple[float, ...], ...], points: tuple[tuple[float, ...], ...],
    foot: tuple[float, ...], q: tuple[float, ...],
) -> None:  # fmt: skip
    """Unless two postures are so near to each other that rounding decides."""
    rows = np.array(axes) / np.linalg.norm(axes, axis=1)[:, None]
    hinges = ThreeHinges(rows, np.array(points), np.array(foot))
    inverse, angle = HingeInverse.of(hinges), np.array(q)
    at = hinges.placed(angle)
    size = inverse.size
    if inverse.is_singular or abs(np.linalg.det(at.jacobian)) <= 1e-2 * size**3:
        return
    found = inverse.postures(at.foot[None])[0]
    found = inverse.improved(found, np.repeat(at.foot[None], 4, axis=0))
    assert np.abs(wrap_angle(found - angle)).max(axis=1).min() < 1e-8
    kept = np.linalg.norm(hinges.placed(found).foot - at.foot, axis=1) < 1e-9 * size
    assert kept.any()


def test_path_of_a_foot_has_no_jump() -> None:
    """Along a path that the leg can follow the posture never changes to another one."""
    for kind in TEXTS:
        for leg in legs_of(kind):
            share = np.linspace(0.0, 2.0 * np.pi, 2000)[:, None]
            middle = leg.forward(leg.standing)
            circle = np.hstack([np.cos(share), 0.5 * np.sin(2.0 * share), 0.3 * np.sin(share)])
            q = leg.inverse(middle + 0.12 * circle)
            assert leg.shortfall(middle + 0.12 * circle).max() == 0.0
            assert np.abs(np.diff(q, axis=0)).max() < 0.02


# --- reach ------------------------------------------------------------------------------------


@each_kind
def test_standing_posture_has_its_foot_below_the_shoulder_and_the_knee_on_its_side(
    kind: str,
) -> None:
    for leg in legs_of(kind):
        hip, shoulder, knee, foot = leg.joint_points(leg.standing)
        np.testing.assert_allclose(shoulder, leg.hip, rtol=0, atol=1e-6)
        np.testing.assert_allclose(foot[:2] - leg.hip[:2], [0.0, leg.lateral], rtol=0, atol=1e-6)
        assert np.linalg.norm(hip - shoulder) == pytest.approx(
            0.05 if "pitch-roll-pitch, apart" in kind else np.linalg.norm(hip - shoulder), abs=1e-12
        )
        ahead = knee[0] - (shoulder[0] + foot[0]) / 2.0
        assert np.sign(ahead) == leg.knee


@each_kind
def test_straightness_is_a_bound_on_the_length_of_the_leg(kind: str) -> None:
    """The length by the law of cosines; equal where the first two axes meet."""
    for leg in legs_of(kind):
        q = postures(leg, 3000, seed=5)
        bend = leg.signs[2] * q[:, 2] + leg.zeros[1]
        square = leg.upper**2 + leg.lower**2 + 2.0 * leg.upper * leg.lower * np.cos(bend)
        np.testing.assert_allclose(leg.length(leg.forward(q)) ** 2, square, rtol=0, atol=1e-9)
        bound = leg.straightness(*leg.forward(q).T)
        assert (bound >= square - 1e-12).all()
        if kind in CLOSED:
            assert leg.slack == 0.0
            np.testing.assert_allclose(bound, square, rtol=0, atol=1e-12)


@each_kind
def test_what_lies_within_straightness_and_reach_is_reached(kind: str) -> None:
    """Places below the hip, by the planners' own test of reach."""
    rng = np.random.default_rng(6)
    for leg in legs_of(kind):
        away = rng.uniform([-0.2, -0.2, -0.44], [0.2, 0.2, -0.28], (2000, 3))
        away[:, 1] += leg.lateral
        places = leg.hip + away
        length = np.sqrt(leg.straightness(*places.T))
        inside = (length < leg.reach) & (length > leg.least_reach + 2.0 * leg.slack)
        assert inside.sum() > 500
        assert leg.shortfall(places[inside]).max() == 0.0


@each_kind
def test_shortfall_beyond_the_straight_leg_is_what_is_missing(kind: str) -> None:
    for leg in legs_of(kind):
        q = leg.standing.copy()
        q[2] = np.clip(leg.signs[2] * (0.3 * leg.knee - leg.zeros[1]), *leg.position_limits[:, 2])
        _, shoulder, _, foot = leg.joint_points(q)
        away = (foot - shoulder) / np.linalg.norm(foot - shoulder)
        far = float(leg.shortfall(foot + 0.2 * away))
        assert far == pytest.approx(0.2, rel=0.05 if leg.slack else 1e-3)
        assert leg.gap_in_words(foot + 0.2 * away).startswith(f"{far:.4g} m away")


@each_kind
def test_levers_bound_the_distances_of_the_foot_from_the_axes(kind: str) -> None:
    for leg in legs_of(kind):
        q = np.random.default_rng(7).uniform(-np.pi, np.pi, (2000, 3))
        speeds = np.linalg.norm(leg.jacobian(q), axis=-2).max(axis=0)
        assert (speeds <= leg.levers + 1e-12).all()
        assert (leg.levers < 1.6 * speeds).all()


# --- whole walks ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "kind",
    [pytest.param("pitch-roll-pitch", marks=pytest.mark.slow), "all axes tilted, apart"],
)
def test_walk_with_forces_keeps_its_promises_and_passes_in_physics(kind: str) -> None:
    made = model(kind)
    plan = gaitopt.plan_crawl(made, s_columns(robot=made, columns=3), reach_fraction=0.95)
    certificate = gaitopt.verify(plan)
    assert not certificate.violations, certificate
    assert gaitopt.simulate(plan).passed
    # A plan goes through a file, and its legs with it.
    times = np.linspace(0.0, plan.duration, 20)
    feet = plan.at(times).feet
    joints = plan.path.evaluate(times)[:, 6:]
    for i, name in enumerate(LEGS):
        leg = made.legs[name]
        own = leg.forward(joints[:, list(made.leg_columns[name])])
        base = plan.path.evaluate(times)[:, :3]
        np.testing.assert_allclose(base + own, feet[:, i], rtol=0, atol=1e-9)


def test_true_centre_of_mass_can_keep_the_margin() -> None:
    made = model("all axes tilted, apart")
    plan = gaitopt.plan_crawl(made, s_columns(robot=made, columns=3), com="model")
    assert not gaitopt.verify(plan).violations


def test_time_optimal_planner_refuses_such_legs_and_names_the_way_out() -> None:
    made = model("pitch-roll-pitch")
    for call in (
        lambda: gaitopt.plan_route(made, s_columns(robot=made, columns=3)),
        lambda: gaitopt.plan_crawl(made, s_columns(robot=made, columns=3), objective="time"),
    ):
        with pytest.raises(InputError, match=r"leg LF .* take plan_crawl with its usual objective"):
            call()


def test_leg_that_stands_only_with_its_knee_aside_is_refused() -> None:
    """Roll, yaw, pitch: the knee has to turn about the robot's forward axis."""
    text = refusal(robot(axes=("1 0.09 -0.15", "0 0 1", "0 1 0")))
    assert "it cannot stand: no posture within its limits has the foot below the hip" in text


def test_knees_may_point_to_either_side() -> None:
    """The limits of this robot's knees allow both; the postures mirror each other."""
    wide = '<limit lower="-2.6" upper="2.6" effort="30" velocity="12"/>'
    text = robot(axes=PITCH_ROLL_PITCH, limits=(wide, wide, wide))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        ahead = load_robot(text, knees={leg: "forward" for leg in LEGS}).legs["LF"]
        behind = load_robot(text, knees={leg: "backward" for leg in LEGS}).legs["LF"]
    foot = ahead.hip + np.array([0.05, 0.02, -0.35])
    there, here = ahead.inverse(foot), behind.inverse(foot)
    assert there[2] == pytest.approx(-here[2], abs=1e-12) and here[2] < 0.0
    np.testing.assert_allclose(ahead.forward(there), behind.forward(here), rtol=0, atol=1e-12)
    assert there[2] == pytest.approx(
        np.arccos((0.05**2 + 0.02**2 + 0.35**2 - UPPER**2 - LOWER**2) / (2 * UPPER * LOWER)),
        abs=1e-12,
    )


@each_kind
def test_a_foot_just_beyond_the_straight_leg_gets_the_straight_leg(kind: str) -> None:
    """Not a posture with the hip on its other side: solvers leave such gaps."""
    straight = '<limit lower="-2.6" upper="0" effort="30" velocity="12"/>'
    text = TEXTS[kind]().replace('upper="-0.3"', 'upper="0"')
    assert straight in text
    for leg in quiet(text).legs.values():
        q = postures(leg, 200, seed=8)  # type: ignore[arg-type]
        q[:, 2] = -leg.signs[2] * leg.zeros[1]
        _, shoulder, _, foot = np.moveaxis(leg.joint_points(q), -2, 0)
        away = foot - shoulder
        for gap in (1e-9, 1e-7, 1e-5):
            found = leg.inverse(foot + gap * away)
            # Tilted axes let the foot go a little farther with the knee a little bent.
            near = 20.0 * np.sqrt(gap) + 0.1 * (kind not in CLOSED)
            np.testing.assert_allclose(found, q, rtol=0, atol=near)


def spider(yaw: float, coxa: float = 0.05) -> str:
    """A robot whose legs reach out from vertical axes at their corners, turned from x by `yaw`."""
    limit = '<limit lower="-1.6" upper="1.6" effort="30" velocity="12"/>'
    parts = [link("base", 5.0)]
    for leg, (x, y) in CORNERS.items():
        turn = f"0 0 {np.arctan2(np.sin(yaw) * np.sign(y), np.cos(yaw) * np.sign(x))}"
        names = [f"{leg}_{part}" for part in ("coxa", "femur", "tibia")]
        parts += [link(name, 0.3) for name in names]
        parts.append(link(f"{leg}_foot", 0.05, collision('<sphere radius="0.01"/>')))
        for k, (parent, xyz, axis, rpy) in enumerate([
            ("base", f"{x} {y} 0", "0 0 1", turn), (names[0], f"{coxa} 0 0", "0 1 0", "0 0 0"),
            (names[1], "0.1 0 0", "0 1 0", "0 0 0"),
        ]):  # fmt: skip
            parts.append(joint(f"{leg}_j{k}", parent, names[k], xyz, "revolute", axis, limit, rpy))
        parts.append(joint(f"{leg}_end", names[2], f"{leg}_foot", "0 0 -0.15"))
    return f'<robot name="spider">{"".join(parts)}</robot>'


@pytest.mark.parametrize("yaw", [pytest.param(np.pi / 2, marks=pytest.mark.slow), np.pi / 4])
def test_spiders_walk(yaw: float) -> None:
    """Legs to the sides; and to the corners, where the knees do not say where the front is."""
    made = quiet(spider(yaw))
    assert made.legs["LF"].hip[0] > 0.0 < made.legs["LF"].hip[1]
    walks(made)


def test_spiders_whose_feet_stand_beside_their_hips_walk() -> None:
    """Yaw and pitch axes meet, and a foot below them could not move to the side."""
    made = quiet(spider(np.pi / 4, coxa=0.0))
    for name, leg in made.legs.items():
        x, y = CORNERS[name]
        out = leg.hip[:2] - [x, y]
        assert out @ np.sign([x, y]) > 0.25 * leg.reach
        np.testing.assert_allclose(out, np.linalg.norm(out) * np.sign([x, y]) / np.sqrt(2.0))
        assert leg.inverse(leg.forward(leg.standing)) == pytest.approx(leg.standing)
    walks(made)


def walks(made: gaitopt.Quadruped) -> None:
    """It walks over two columns a leg; certificate and physics agree."""
    plan = gaitopt.plan_crawl(made, s_columns(0, columns=2, robot=made))
    assert gaitopt.verify(plan).ok
    assert gaitopt.simulate(plan).passed
