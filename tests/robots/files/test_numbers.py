"""Axes, limits, masses and inertias of robot files: mended, guessed, given or refused."""

from __future__ import annotations

import re
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pytest
import trimesh
from robot_loading import feet_by_pinocchio, quiet, refusal, warnings_of
from robot_texts import (
    CORNERS,
    KNEE,
    LIMIT,
    LINK_MASS,
    MASS,
    UPPER,
    collision,
    joint,
    leg,
    link,
    robot,
)  # fmt: skip

import gaitopt
from gaitopt.errors import InputError
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.quadruped import Quadruped


def test_axes_with_rounded_digits_are_made_square() -> None:
    """A joint whose frame is turned by 1.5708, and whose axis is y for x."""
    turned = (
        leg("LF")
        .replace(
            f'<origin xyz="0 {0.04} 0" rpy="0 0 0"/><axis xyz="0 1 0"/>',
            f'<origin xyz="0 {0.04} 0" rpy="0 0 1.5708"/><axis xyz="1 0 0"/>',
        )
        .replace(
            f'<origin xyz="0 0 {-UPPER}" rpy="0 0 0"/>',
            f'<origin xyz="0 0 {-UPPER}" rpy="0 0 -1.5708"/>',
        )
    )
    assert "1.5708" in turned
    made = quiet(robot(changed={"LF": turned}))
    assert made.closed_form_error < 1e-12
    angles = np.full(12, 0.3)
    exact = feet_by_pinocchio(load_robot(robot()), angles)
    np.testing.assert_allclose(feet_by_pinocchio(made, angles), exact, rtol=0, atol=1e-5)


def test_axes_that_are_off_by_a_tenth_of_a_degree_are_warned_about() -> None:
    off = leg("LF", axes=("1 0 0", "0 1 0.002", "0 1 0"))
    (words,) = warnings_of(robot(changed={"LF": off}))
    assert "turned by up to 0.0573 degrees" in words


def test_axes_that_are_farther_off_are_meant_to_be() -> None:
    """They stay as they are: a leg with other axes than roll-pitch-pitch."""
    far = leg("LF", axes=("1 0 0", "0 1 0.06", "0 1 0"))
    made = quiet(robot(changed={"LF": far}))
    assert [x.name for x in made.legs.values() if x.is_general] == ["LF"]
    assert not [text for text in made.notes.warnings if "turned by" in text]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("lower", "low", "its lower limit is 'low'; it must be a number"),
        ("velocity", "-1", "its velocity limit is '-1'; it must be a number, and not negative"),
        ("effort", "nan", "its effort limit is 'nan'; it must be a number, and not negative"),
    ],
)
def test_limits_that_are_no_numbers_are_refused_by_name(name: str, text: str, words: str) -> None:
    limit = re.sub(f'{name}="[^"]*"', f'{name}="{text}"', LIMIT)
    changed = {"RH": leg("RH", limits=(LIMIT, limit, KNEE))}
    assert f"joint RH_j1: {words}" in refusal(robot(changed=changed))


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        ("", "no velocity limit for LF_j0: 10 rad/s is assumed"),
        ('<limit lower="-1" upper="1" effort="9"/>', "no velocity limit for LF_j0"),
        ('<limit lower="-1" upper="1" effort="9" velocity="inf"/>', "no velocity limit for LF_j0"),
        (
            '<limit lower="-1" upper="1" effort="9" velocity="1000"/>',
            "placeholders [rad/s]: LF_j0 1000",
        ),
        ('<limit lower="-1" upper="1" effort="0" velocity="9"/>', "no effort limit for LF_j0"),
        ('<limit lower="-1" upper="1" effort="1e-320" velocity="9"/>', "no effort limit for LF_j0"),
        ('<limit lower="-1" upper="1" effort="9" velocity="5e-324"/>', "no velocity limit for"),
        ('<limit lower="1" upper="-1" effort="9" velocity="9"/>', "exchanged"),
        ('<limit lower="-inf" upper="inf" effort="9" velocity="9"/>', "have no position limits"),
    ],
)
def test_limits_that_cannot_be_true_are_warned_about(limit: str, words: str) -> None:
    text = robot(changed={"LF": leg("LF", limits=(limit, LIMIT, LIMIT))})
    assert any(words in message for message in warnings_of(text))


def test_limits_in_the_wrong_order_are_exchanged() -> None:
    limit = '<limit lower="1" upper="-0.5" effort="9" velocity="9"/>'
    made = quiet(robot(changed={"LF": leg("LF", limits=(limit, LIMIT, LIMIT))}))
    assert made.legs["LF"].position_limits[:, 0].tolist() == [-0.5, 1.0]


def test_limits_of_the_user_count_and_go_into_the_plan_s_file(tmp_path: Path) -> None:
    made = quiet(robot(), velocity_limits=7.0, effort_limits={"LF_j2": 11.0})
    assert (made.velocity_limits == 7.0).all()
    assert made.effort_limits[made.leg_columns["LF"][2]] == 11.0
    assert made.effort_limits[made.leg_columns["LF"][1]] == 30.0
    again = Quadruped.from_urdf(made.urdf)
    np.testing.assert_array_equal(again.velocity_limits, made.velocity_limits)
    with pytest.raises(InputError, match="no leg has a joint 'knee'"):
        load_robot(robot(), velocity_limits=MappingProxyType({"knee": 3.0}))
    with pytest.raises(InputError, match="effort_limits must be a number"):
        load_robot(robot(), effort_limits=-1.0)


def test_standing_height_keeps_the_limits_of_all_joints() -> None:
    """Thighs that turn little: at the usual height of 0.7 of the reach they would have to more."""
    thigh = '<limit lower="-0.2" upper="0.4" effort="30" velocity="12"/>'
    made = quiet(robot(limits=(LIMIT, thigh, KNEE)))
    usual = quiet(robot()).standing_height
    assert made.standing_height > usual + 0.05
    for one in made.legs.values():
        foot = one.hip + np.array([0.0, one.lateral, -made.standing_height])
        angles = one.inverse(foot)
        assert (angles >= one.position_limits[0]).all() and (angles <= one.position_limits[1]).all()


MASSLESS = re.compile(r"<inertial>.*?</inertial>")


def test_robot_without_masses_is_refused_with_the_ways_out() -> None:
    text = MASSLESS.sub("", robot())
    words = refusal(text)
    assert "no link has a mass" in words and "masses='shapes'" in words and "'none'" in words
    assert quiet(text, masses="none").mass == 0.0


@pytest.mark.parametrize("mass", ["-0.5", "nan", "inf"])
@pytest.mark.parametrize("every", [True, False])
def test_negative_mass_is_told_with_its_link(mass: str, every: bool) -> None:
    text = robot()
    if every:
        text = re.sub(r'mass value="[^"]*"', f'mass value="{mass}"', text)
    else:
        text = text.replace('mass value="0.1"', f'mass value="{mass}"', 1)
    link_name = "base" if every else "LF_foot"
    words = refusal(text)
    assert f"link {link_name}: its mass is {mass} kg" in words and "masses={" in words
    if not every:
        assert quiet(text, masses={"LF_foot": 0.1}).mass == pytest.approx(MASS)


def test_part_that_moves_without_a_mass_is_named() -> None:
    text = robot(changed={"LF": leg("LF", masses=(0.0, 0.5, 0.5))})
    assert "link LF_l0 moves and has no mass" in refusal(text)
    made = quiet(text, masses={"LF_l0": 0.7})
    assert made.mass == pytest.approx(MASS - LINK_MASS + 0.7)


def test_masses_from_shapes_are_water() -> None:
    """A ball of 3 cm and a box: volumes that anyone can work out."""
    box = collision('<box size="0.4 0.2 0.1"/>')
    text = MASSLESS.sub("", robot(shank=collision('<box size="0.1 0.1 0.1"/>')))
    text = text.replace('<link name="base">', f'<link name="base">{box}')
    for name in CORNERS:
        for k in (0, 1):
            text = text.replace(f'<link name="{name}_l{k}">', f'<link name="{name}_l{k}">{box}')
    made = quiet(text, masses="shapes")
    ball = 4.0 / 3.0 * np.pi * 0.03**3
    assert made.mass == pytest.approx(1000.0 * (9 * 0.008 + 4 * 0.001 + 4 * ball))
    assert any("estimated from shapes" in words for words in warnings_of(text, masses="shapes"))


def test_shapes_of_no_sensible_size_are_refused() -> None:
    """The mass of such a ball is no number."""
    text = robot(shank=collision('<sphere radius="1e200"/>'))
    assert "a sphere of size" in refusal(text, masses="shapes")


def test_inertia_that_no_body_has_is_refused_or_told() -> None:
    good = robot()
    hip = (
        '<link name="LF_l0"><inertial><origin xyz="0 0 0"/><mass value="0.5"/><inertia ixx="0.005"'
    )
    assert hip in good
    assert "inertia of link LF_l0 is not that of a body" in refusal(
        good.replace(hip, hip.replace("0.005", "-0.005"))
    )
    (words,) = warnings_of(good.replace(hip, hip.replace('ixx="0.005"', 'ixx="0.5"')))
    assert "inertias that no body can have" in words and "LF_l0" in words


def test_inertia_of_a_link_without_mass_counts() -> None:
    """Pinocchio adds it to the body that the link is fixed to."""
    sensor = link("sensor", 0.1).replace('value="0.1"', 'value="0"').replace("0.001", "-5.0")
    assert "-5.0" in sensor
    assert "inertia of link base is not that of a body" in refusal(
        robot(sensor + joint("glue", "base", "sensor"))
    )


@pytest.mark.parametrize(
    "shape", ['<cylinder radius="1e200" length="0.2"/>', '<box size="0.1 1e4 0.1"/>']
)
def test_shapes_larger_than_a_kilometre_are_refused(shape: str) -> None:
    """With a cylinder of 1e200 m the certificate's bounds were no numbers."""
    told = refusal(robot(shank=collision(shape)))
    assert "LF_l2" in told and "1000 m" in told and "float64" not in told


@pytest.mark.parametrize(
    ("value", "reason"), [("0", "not that of a body"), ("100", "of a body of 1[57]")]
)
def test_wrong_inertias_name_their_links_and_a_cure_that_works(value: str, reason: str) -> None:
    """PyBullet makes inertias of shapes where a file has zeros; gaitopt does if asked."""
    box = collision('<box size="0.1 0.1 0.3"/>')
    text = re.sub(r'(i\w\w)="0.00[15]"', rf'\1="{value}"', robot(shank=box))
    text = re.sub(r'(ix[yz]|iyz)="[^"]*"', r'\1="0"', text)
    told = refusal(text)
    assert re.search(rf"link LF_l0 \(and of LH_l0, .* and 7 more\) is .*{reason}", told)
    assert "give masses='file'" in told
    made = quiet(text, masses="file")
    assert made.mass == pytest.approx(MASS)
    # About its own axis a square bar has m (a^2 + a^2) / 12, and a ball 2 / 5 m r^2.
    shank = made.model.inertias[made.model.getJointId("LF_j2")]
    assert shank.inertia[2, 2] == pytest.approx(0.5 * 0.02 / 12 + 0.4 * 0.1 * 0.03**2, rel=1e-9)


def test_shapes_of_size_zero_mark_places_and_are_left_out() -> None:
    ghost = collision('<sphere radius="0"/>') + collision('<box size="0.1 0 0.1"/>')
    made = quiet(robot(shank=ghost))
    assert made.notes.done[0].startswith("shapes of size zero are left out, at LF_l2, ")
    assert made.foot_radius == quiet(robot()).foot_radius
    assert "sphere of size [-0.1]" in refusal(
        robot(shank=collision('<sphere radius="-0.1"/>'), foot=None)
    )


def test_blanks_around_numbers_do_not_drop_a_link_s_mass() -> None:
    """Pinocchio's reader drops an `<inertial>` whose mass is "0.5 ", and says so on the console."""
    spoiled = robot().replace('<mass value="0.5"/>', '<mass value="0.5 "/>')
    assert spoiled != robot()
    assert quiet(spoiled).mass == pytest.approx(MASS)
    assert "mass" in refusal(robot().replace('<mass value="0.5"/>', '<mass value="0_5"/>'))


def test_elements_that_come_twice_count_once() -> None:
    """Pinocchio takes the first of two axes, and MuJoCo refuses the file."""
    twice = robot().replace('<axis xyz="1 0 0"/>', '<axis xyz="1 0 0"/><axis xyz="0 1 0"/>')
    made = quiet(twice)
    assert twice.count("<axis") == 16 and made.urdf.count("<axis") == 12
    plan = gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=2, robot=made))
    assert not gaitopt.simulate(plan).failures


def test_one_scale_of_a_mesh_is_that_along_all_axes(tmp_path: Path) -> None:
    """Pinocchio drops a shape whose mesh has one number for its scale."""
    trimesh.creation.box((20.0, 20.0, 440.0)).export(tmp_path / "shank.stl")
    sizes = []
    for scale in ("0.001", "0.001 0.001 0.001"):
        shank = collision(f'<mesh filename="shank.stl" scale="{scale}"/>')
        file = tmp_path / "tester.urdf"
        file.write_text(robot(shank=shank, foot=None))
        sizes.append(quiet(file).legs["LF"].lower)
    assert sizes[0] == sizes[1] > 0.2


def test_torque_limits_that_no_leg_can_need_are_told_with_the_option() -> None:
    text = robot(limits=(LIMIT.replace('effort="30"', 'effort="1000"'), LIMIT, KNEE))
    (told,) = [w for w in warnings_of(text) if "effort limits that look" in w]
    assert "placeholders [N m]: LF_j0 1000, LH_j0 1000" in told
    assert told.endswith("these torques are not limited: give effort_limits= in N m")
    assert not any("effort" in w for w in warnings_of(text, effort_limits=30.0))
