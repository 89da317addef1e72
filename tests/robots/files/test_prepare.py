"""URDFs as people have them: what has to be there, what is locked, guessed, or refused."""

from __future__ import annotations

import pickle
import re
import warnings
from pathlib import Path
from types import MappingProxyType

import numpy as np
import pinocchio as pin
import pytest
from robot_loading import feet_by_pinocchio, quiet, refusal
from robot_texts import (
    CORNERS,
    FOOT,
    KNEE,
    LIMIT,
    LINK_MASS,
    LOWER,
    MASS,
    UPPER,
    collision,
    joint,
    leg,
    link,
    robot,
)  # fmt: skip

import gaitopt
from gaitopt.conventions import LEGS
from gaitopt.errors import InputError, RobotError, RobotWarning
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.quadruped import Quadruped


def told(text: str, **options: object) -> list[str]:
    """The warnings of loading a robot."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        load_robot(text, **options)  # type: ignore[arg-type]
    return [str(w.message) for w in caught if issubclass(w.category, RobotWarning)]


def test_robot_that_needs_nothing_keeps_its_text() -> None:
    text = robot()
    made = load_robot(text)
    assert made.urdf == text and not told(text)
    assert made.mass == pytest.approx(MASS) and made.foot_radius == 0.03
    assert [made.legs[name].foot for name in LEGS] == [f"{name}_foot" for name in LEGS]


# --- joints without an end, and joints of no leg ----------------------------------------------


def test_continuous_joints_have_one_angle_and_no_limits() -> None:
    endless = '<limit effort="30" velocity="12"/>'
    made = quiet(
        robot(kinds=("revolute", "continuous", "revolute"), limits=(LIMIT, endless, LIMIT))
    )
    same = quiet(robot(limits=(LIMIT, LIMIT, LIMIT)))
    assert made.model.nq == 7 + 12 and made.joint_names == same.joint_names
    angles = np.random.default_rng(0).uniform(-3, 3, 12)
    np.testing.assert_allclose(
        feet_by_pinocchio(made, angles), feet_by_pinocchio(same, angles), rtol=0, atol=1e-14
    )
    column = made.leg_columns["LF"][1]
    assert made.position_limits[:, column].tolist() == [-np.inf, np.inf]
    assert made.velocity_limits[column] == 12.0 and made.effort_limits[column] == 30.0


HEAD = (
    link("pan", 0.3) + joint("pan_j", "base", "pan", "0.3 0 0.1", "revolute", "0 0 1")
    + link("tilt", 0.2) + joint("tilt_j", "pan", "tilt", "0 0 0.1", "revolute", "0 1 0")
)  # fmt: skip


def test_head_of_two_joints_is_locked_and_its_mass_counts() -> None:
    made = quiet(robot(HEAD))
    assert made.joint_names == load_robot(robot()).joint_names
    assert made.mass == pytest.approx(MASS + 0.5)
    assert dict(made.notes.locked) == {"pan_j": 0.0, "tilt_j": 0.0}


def test_pose_of_locked_joints_may_be_given() -> None:
    """The tilted link's centre of mass lies where the joints' rotation puts it."""
    heavy = HEAD.replace('<origin xyz="0 0 0"/><mass value="0.2"/>',
                         '<origin xyz="0.4 0 0"/><mass value="0.2"/>')  # fmt: skip
    made = quiet(robot(heavy), pose={"tilt_j": -np.pi / 2})
    plain = quiet(robot(heavy))
    shift = [
        pin.centerOfMass(m.model, m.model.createData(), pin.neutral(m.model)) for m in (plain, made)
    ]
    # From 0.4 m forward to 0.4 m up, with 0.2 kg.
    expected = 0.2 * np.array([-0.4, 0.0, 0.4]) / (MASS + 0.5)
    np.testing.assert_allclose(shift[1] - shift[0], expected, rtol=0, atol=1e-15)


def test_joint_that_may_not_be_at_zero_is_locked_at_its_nearest_limit() -> None:
    low = '<limit lower="0.3" upper="1" effort="1" velocity="1"/>'
    tail = link("tail", 0.1) + joint("tail_j", "base", "tail", "-0.3 0 0", "revolute", "0 1 0", low)
    assert quiet(robot(tail)).notes.locked["tail_j"] == pytest.approx(0.3)


@pytest.mark.parametrize("kind", ["prismatic", "floating", "planar", "continuous", "spherical"])
def test_joints_of_any_kind_are_locked_on_an_arm(kind: str) -> None:
    arm = link("arm", 0.4) + joint("arm_j", "base", "arm", "0 0 0.2", kind, "0 0 1")
    made = quiet(robot(arm))
    assert len(made.joint_names) == 12 and made.mass == pytest.approx(MASS + 0.4)


def test_pose_of_a_leg_s_joint_is_refused() -> None:
    with pytest.raises(InputError, match="no joint beside those of the legs"):
        quiet(robot(), pose={"LF_j0": 0.1})


def test_waist_before_the_hind_legs_is_locked() -> None:
    """Hind legs on a second trunk: the joint that two legs share is none of theirs."""
    waist = link("rear", 1.0) + joint("waist", "base", "rear", "0 0 0", "revolute", "0 0 1")
    legs = {name: leg(name, base="rear") for name in ("LH", "RH")}
    made = quiet(robot(waist, changed=legs))
    assert dict(made.notes.locked) == {"waist": 0.0} and made.mass == pytest.approx(MASS + 1.0)
    assert [made.legs[name].joints[0] for name in LEGS] == [f"{name}_j0" for name in LEGS]


def rotors() -> str:
    return "".join(
        link(f"{name}_rotor", 0.05)
        + joint(f"{name}_spin", f"{name}_l1", f"{name}_rotor", "0 0 -0.05", "continuous", "0 1 0")
        for name in CORNERS
    )


def test_rotors_on_the_legs_are_locked() -> None:
    made = quiet(robot(rotors()))
    assert len(made.notes.locked) == 4 and made.mass == pytest.approx(MASS + 0.2)
    assert made.legs["LF"].joints == ("LF_j0", "LF_j1", "LF_j2")


# --- what is above the body -------------------------------------------------------------------


def test_body_below_a_floating_joint_is_the_base() -> None:
    above = link("world", 0) + joint("float", "world", "base", "0 0 0.6", "floating")
    made = quiet(robot(before=above))
    assert made.mass == pytest.approx(MASS) and made.model.nq == 7 + 12
    np.testing.assert_allclose(made.legs["LF"].hip, [0.2, 0.1, 0.0], rtol=0, atol=1e-15)


def test_body_fixed_to_the_world_is_free() -> None:
    above = link("world", 0) + joint("weld", "world", "base", "0 0 0.6")
    made = quiet(robot(before=above))
    np.testing.assert_allclose(made.legs["LF"].hip, [0.2, 0.1, 0.0], rtol=0, atol=1e-15)


def test_massless_link_above_the_trunk_stays_the_base() -> None:
    """The convention of ROS: its frame is the body's."""
    made = quiet(robot(before=link("root", 0) + joint("up", "root", "base", "0 0 0.1")))
    np.testing.assert_allclose(made.legs["LF"].hip, [0.2, 0.1, 0.1], rtol=0, atol=1e-15)


def test_world_that_moves_the_body_is_refused() -> None:
    above = link("world", 0) + joint("rail", "world", "base", "0 0 0", "prismatic", "1 0 0")
    assert "a robot that walks is free" in refusal(robot(before=above))


def test_mass_above_the_floating_joint_is_refused() -> None:
    above = link("crane", 2.0) + joint("float", "crane", "base", "0 0 0", "floating")
    assert "link crane has a mass and is not below the body base" in refusal(robot(before=above))


# --- which limbs are legs ---------------------------------------------------------------------


def arm(count: int) -> str:
    parts, parent = "", "base"
    for k in range(count):
        parts += link(f"arm{k}", 0.2)
        parts += joint(f"arm_j{k}", parent, f"arm{k}", "0.1 0 0.05", "revolute", "0 1 0")
        parent = f"arm{k}"
    return parts


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6])
def test_arm_of_any_number_of_joints_is_no_leg(count: int) -> None:
    made = quiet(robot(arm(count)))
    assert made.legs["LF"].joints == ("LF_j0", "LF_j1", "LF_j2")
    assert len(made.notes.locked) == count


def test_names_decide_between_four_legs_and_two_arms_like_legs() -> None:
    arms = leg("LF").replace("LF_", "arm_a_") + leg("RF").replace("RF_", "arm_b_")
    made = quiet(robot(arms))
    assert [made.legs[name].joints[0] for name in LEGS] == [f"{name}_j0" for name in LEGS]


def test_six_nameless_legs_are_refused_until_four_are_named() -> None:
    text = robot(leg("LF").replace("LF_", "q_") + leg("RF").replace("RF_", "p_"))
    for old, new in zip(CORNERS, "stuv", strict=True):
        text = text.replace(f"{old}_", f"{new}_")
    text = text.replace('xyz="0.2 0.1 0"', 'xyz="0.2001 0.1 0"', 1)
    assert "more than four chains are like legs" in refusal(text)
    legs = {"FL": "s_foot", "hind_left": "t_j2", "RH": "u_l2", "front-right": "v_foot"}
    made = quiet(text, legs=legs)
    assert [made.legs[name].joints[2] for name in LEGS] == ["s_j2", "t_j2", "u_j2", "v_j2"]
    assert len(made.joint_names) == 12


def test_robot_may_be_called_by_the_wrong_names() -> None:
    """Names that the user gives decide which end is the front: here it is the other one."""
    swapped = {"LF": "RH_foot", "LH": "RF_foot", "RH": "LF_foot", "RF": "LH_foot"}
    made = quiet(robot(), legs=swapped)
    assert made.legs["LF"].joints[0] == "RH_j0"
    np.testing.assert_array_equal(made.body_axes[:, 0], [-1.0, 0.0, 0.0])
    copy = Quadruped.from_urdf(made.urdf, made.name)
    assert copy.legs["LF"].joints == made.legs["LF"].joints


@pytest.mark.parametrize(
    ("legs", "words"),
    [
        ({"LF": "LF_foot"}, "legs names no LH and no RH and no RF"),
        (dict.fromkeys(LEGS, "nothing"), "there is no joint or link 'nothing' (LF)"),
        ({**{n: f"{n}_foot" for n in LEGS}, "LF": "base"}, "a leg has 2 or 3 hinges"),
        ({**{n: f"{n}_foot" for n in LEGS}, "LF": "LH_foot"}, "a leg has 2 or 3 hinges"),
    ],
)
def test_legs_that_are_none_are_named(legs: dict[str, str], words: str) -> None:
    with pytest.raises(InputError, match=re.escape(words)):
        quiet(robot(), legs=legs)


def test_unknown_leg_is_an_input_error() -> None:
    with pytest.raises(InputError, match="legs: 'XY' is no leg"):
        quiet(robot(), legs={"XY": "LF_foot"})
    with pytest.raises(InputError, match="a second name of one"):
        quiet(robot(), legs={"LF": "LF_foot", "FL": "LF_foot"})


def test_three_legs_are_refused_with_the_way_out() -> None:
    text = refusal(robot(changed={"LF": ""}))
    assert "no four legs found" in text and "RF_j0-RF_j1-RF_j2" in text and "legs={" in text


def test_leg_that_follows_another_joint_is_a_linkage() -> None:
    knee = '<mimic joint="LF_j1" multiplier="-1"/>' + LIMIT
    text = robot(changed={"LF": leg("LF", limits=(LIMIT, LIMIT, knee))})
    assert "joint LF_j2 follows LF_j1 (<mimic>), as in a parallel or five-bar linkage" in refusal(
        text
    )


def test_two_chains_at_each_corner_are_five_bar_legs() -> None:
    """As in Minitaur, whose URDF leaves the joint between the two halves of a leg out."""
    text = robot()
    other = "".join(leg(name) for name in CORNERS)
    for name in CORNERS:
        other = other.replace(f"{name}_", f"{name}b_")
    assert "as in five-bar or parallel legs" in refusal(
        text.replace("</robot>", other + "</robot>")
    )


def test_link_on_two_joints_is_a_closed_chain() -> None:
    text = robot(joint("strut", "base", "LF_foot", "0 0 0", "revolute", "0 1 0"))
    assert "link LF_foot hangs on two joints" in refusal(text)
    assert "five-bar" in refusal(text)


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        (link("loose"), "2 links hang on no joint (base, loose)"),
        (joint("odd", "base", "nothing"), "names the link 'nothing', which is missing"),
        ('<joint name="odd" type="fixed"><parent link="base"/></joint>', "has no child link"),
        (link("a") + link("b") + joint("ab", "a", "b") + joint("ba", "b", "a"), "form a circle"),
        (link("a") + joint("LF_j0", "base", "a"), "2 joints have the name LF_j0"),
        (link("a") + joint("turn", "base", "a", "0 0 0", "revolute", "0 0 0"), "no direction"),
        (link("a") + joint("far", "base", "a", "1e9 0 0"), "farther than 1000 m"),
        (link("a") + joint("nan", "base", "a", "nan 0 0"), "must be 3 finite numbers"),
        (link("a") + joint("two", "base", "a", "0 0"), "must be 3 finite numbers"),
    ],
)
def test_broken_trees_are_refused_by_name(extra: str, words: str) -> None:
    assert words in refusal(robot(extra))


def test_joints_may_be_called_as_links() -> None:
    """Pinocchio does not tell a fixed joint from a link of the same name."""
    text = robot().replace('joint name="LF_end"', 'joint name="LF_foot"')
    made = quiet(text.replace('joint name="RF_end"', 'joint name="root_joint"'))
    assert made.legs["LF"].foot == "LF_foot"
    np.testing.assert_array_equal(
        feet_by_pinocchio(made, np.zeros(12)), feet_by_pinocchio(quiet(robot()), np.zeros(12))
    )


# --- feet -------------------------------------------------------------------------------------

WHEEL = collision('<cylinder radius="0.08" length="0.04"/>', "0 0.05 0", "1.5707963267948966 0 0")


def wheeled(name: str, shape: str = WHEEL) -> str:
    plain = leg(name, foot=None)
    wheel = link(f"{name}_wheel", 0.3, shape)
    kind = '<limit effort="30" velocity="12"/>'
    return (
        plain
        + wheel
        + joint(
            f"{name}_spin",
            f"{name}_l2",
            f"{name}_wheel",
            f"0 0 {-LOWER}",
            "continuous",
            "0 1 0",
            kind,
        )
    )


def test_wheels_are_locked_and_stand_on_their_lowest_point() -> None:
    made = quiet(robot(changed={name: wheeled(name) for name in CORNERS}))
    assert len(made.joint_names) == 12 and made.foot_radius == pytest.approx(0.08)
    assert set(made.notes.locked) == {f"{name}_spin" for name in CORNERS}
    feet = feet_by_pinocchio(made, np.zeros(12))
    # The middle of the wheel is 0.05 m beside the lower leg.
    assert feet[0] == pytest.approx([0.2, 0.1 + 0.04 + 0.05, -UPPER - LOWER], abs=1e-12)


def test_wheel_whose_shape_is_missing_is_told() -> None:
    mesh = collision('<mesh filename="package://nowhere/wheel.dae"/>')
    text = robot(changed={name: wheeled(name, mesh) for name in CORNERS})
    assert any("radius of the feet is not known" in words for words in told(text))
    assert quiet(text, foot_radius=0.07).foot_radius == 0.07


ALONG = f"0 0 {-LOWER / 2}"


@pytest.mark.parametrize(
    ("shape", "xyz", "length", "radius"),
    [
        (f'<cylinder radius="0.015" length="{LOWER}"/>', ALONG, LOWER - 0.015, 0.015),
        (f'<capsule radius="0.015" length="{LOWER}"/>', ALONG, LOWER, 0.015),
        ('<sphere radius="0.025"/>', f"0 0 {-LOWER}", LOWER, 0.025),
    ],
)
def test_leg_without_a_foot_link_ends_with_its_shape(
    shape: str, xyz: str, length: float, radius: float
) -> None:
    made = quiet(robot(foot=None, shank=collision(shape, xyz)))
    assert made.foot_radius == pytest.approx(radius)
    assert all(one.lower == pytest.approx(length, abs=1e-12) for one in made.legs.values())
    visual = collision(shape, xyz).replace("collision", "visual")
    assert quiet(robot(foot=None, shank=visual)).legs["LF"].lower == pytest.approx(length)


def test_shapes_that_urdf_does_not_know_are_written_in_those_it_does(
    capfd: pytest.CaptureFixture[str],
) -> None:
    capsule = collision('<capsule radius="0.015" length="0.2"/>', "0 0 -0.1", "0.1 0 0")
    made = quiet(robot(shank=capsule + collision('<cone radius="1" length="1"/>')))
    assert "<capsule" not in made.urdf and "<cone" not in made.urdf
    shapes = pin.buildGeomFromUrdfString(made.model, made.urdf, pin.GeometryType.COLLISION)
    first = [s for s in shapes.geometryObjects if "LF_l2" in s.name]
    places = np.array([s.placement.translation for s in first])
    turn = np.array([0.0, -np.sin(0.1), np.cos(0.1)])
    middle = np.array([0.0, 0.0, -0.1])
    expected = [middle, middle - 0.1 * turn, middle + 0.1 * turn]
    np.testing.assert_allclose(places, expected, rtol=0, atol=1e-12)
    assert "Could not parse" not in capfd.readouterr().err


def test_box_is_as_thick_as_its_end() -> None:
    made = quiet(robot(foot=None, shank=collision(f'<box size="0.02 0.02 {LOWER}"/>', ALONG)))
    assert made.foot_radius == pytest.approx(0.01, abs=1e-3)
    tip = made.legs["LF"].lower + made.foot_radius
    assert tip == pytest.approx(LOWER, abs=2e-3)


def ball_on_a_stick(path: Path, centre: float, radius: float) -> None:
    """A mesh of a lower leg with a ball at its end, as STL."""
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    ball.apply_translation([0.0, 0.0, centre])
    stick = trimesh.creation.box(extents=[0.01, 0.01, abs(centre)])
    stick.apply_translation([0.0, 0.0, centre / 2.0])
    trimesh.util.concatenate([ball, stick]).export(path)


@pytest.mark.parametrize("name", ["package://tester/meshes/shank.stl", "../meshes/shank.stl",
                                  "package://meshes/shank.stl", "shank.stl"])  # fmt: skip
def test_mesh_of_a_leg_without_a_foot_link_is_found_and_measured(tmp_path: Path, name: str) -> None:
    """Beside the file, above it, and with or without the name of its package."""
    folder = tmp_path / "tester"
    for inside in ("urdf", "meshes"):
        (folder / inside).mkdir(parents=True)
    home = folder / ("urdf" if name == "shank.stl" else "meshes")
    ball_on_a_stick(home / "shank.stl", -LOWER, 0.02)
    file = folder / "urdf" / "mine.urdf"
    file.write_text(robot(foot=None, shank=collision(f'<mesh filename="{name}"/>')))
    made = quiet(file)
    assert made.name == "mine"
    assert made.foot_radius == pytest.approx(0.02, abs=5e-4)
    assert made.legs["LF"].lower == pytest.approx(LOWER, abs=1e-3)


def test_meshes_are_looked_for_in_given_folders_and_ros_package_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "dog" / "meshes").mkdir(parents=True)
    ball_on_a_stick(tmp_path / "dog" / "meshes" / "shank.stl", -LOWER, 0.02)
    mesh = collision('<mesh filename="package://dog/meshes/shank.stl"/>')
    text = robot(foot=None, shank=mesh)
    assert "no shape of LF_l2 tells where it ends" in refusal(text)
    assert quiet(text, package_folders=[tmp_path]).foot_radius == pytest.approx(0.02, abs=5e-4)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    assert quiet(text).foot_radius == pytest.approx(0.02, abs=5e-4)


def test_ball_beside_the_foot_link_is_the_foot() -> None:
    """The foot frame is the ball's centre, wherever the link's origin is."""
    made = quiet(robot(foot=collision('<sphere radius="0.03"/>', "0 0 0.02")))
    assert made.legs["LF"].lower == pytest.approx(LOWER - 0.02, abs=1e-12)
    assert made.foot_radius == 0.03


def test_lowest_of_several_balls_is_the_foot() -> None:
    balls = collision('<sphere radius="0.012"/>', "0 0 0.013") + FOOT
    made = load_robot(robot(foot=balls))
    assert made.foot_radius == 0.03 and made.legs["LF"].lower == pytest.approx(LOWER)


def test_foot_may_be_named_and_placed() -> None:
    text = robot(foot=None)
    with pytest.raises(RobotError, match=r"feet=\{'LF': "):
        load_robot(text)
    feet = {name: (f"{name}_l2", (0.0, 0.0, -0.2)) for name in LEGS}
    made = quiet(text, feet=feet, foot_radius=0.015)
    assert made.legs["RH"].lower == pytest.approx(0.2) and made.foot_radius == 0.015
    with pytest.raises(InputError, match="is no link beyond the last joint of leg LF"):
        quiet(robot(), feet={"LF": "base"})
    with pytest.raises(InputError, match="feet: LF: give the name of a link"):
        load_robot(text, feet={"LF": 3})


def test_point_feet_are_warned_about() -> None:
    (words,) = told(robot(foot=""))
    assert (
        words
        == "tester: the radius of the feet is not known, so they are points; give foot_radius="
    )
    assert not told(robot(foot=""), foot_radius=0.01)


# --- axes with few digits ---------------------------------------------------------------------


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
    (words,) = told(robot(changed={"LF": off}))
    assert "turned by up to 0.0573 degrees" in words
    far = leg("LF", axes=("1 0 0", "0 1 0.2", "0 1 0"))
    assert "neither roll-pitch-pitch nor pitch-pitch" in refusal(robot(changed={"LF": far}))


# --- limits -----------------------------------------------------------------------------------


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
        ('<limit lower="1" upper="-1" effort="9" velocity="9"/>', "exchanged"),
        ('<limit lower="-inf" upper="inf" effort="9" velocity="9"/>', "have no position limits"),
    ],
)
def test_limits_that_cannot_be_true_are_warned_about(limit: str, words: str) -> None:
    text = robot(changed={"LF": leg("LF", limits=(limit, LIMIT, LIMIT))})
    assert any(words in message for message in told(text))


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


# --- masses -----------------------------------------------------------------------------------

MASSLESS = re.compile(r"<inertial>.*?</inertial>")


def test_robot_without_masses_is_refused_with_the_ways_out() -> None:
    text = MASSLESS.sub("", robot())
    words = refusal(text)
    assert "no link has a mass" in words and "masses='shapes'" in words and "'none'" in words
    assert quiet(text, masses="none").mass == 0.0


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
    assert any("estimated from shapes" in words for words in told(text, masses="shapes"))


def test_inertia_that_no_body_has_is_refused_or_told() -> None:
    good = robot()
    hip = (
        '<link name="LF_l0"><inertial><origin xyz="0 0 0"/><mass value="0.5"/><inertia ixx="0.005"'
    )
    assert hip in good
    assert "inertia of link LF_l0 is not that of a body" in refusal(
        good.replace(hip, hip.replace("0.005", "-0.005"))
    )
    (words,) = told(good.replace(hip, hip.replace('ixx="0.005"', 'ixx="0.5"')))
    assert "inertias that no body can have" in words and "LF_l0" in words


def test_inertia_of_a_link_without_mass_counts() -> None:
    """Pinocchio adds it to the body that the link is fixed to."""
    sensor = link("sensor", 0.1).replace('value="0.1"', 'value="0"').replace("0.001", "-5.0")
    assert "-5.0" in sensor
    assert "inertia of link base is not that of a body" in refusal(
        robot(sensor + joint("glue", "base", "sensor"))
    )


def test_bad_options_are_input_errors() -> None:
    for options in ({"masses": "guess"}, {"masses": {"base": -1.0}}, {"foot_radius": -1.0},
                    {"pose": {"x": "a"}}, {"feet": 3}, {"masses": {"nothing": 1.0}},
                    {"masses": 5.0}, {"masses": [5.0]}, {"pose": 3}, {"pose": "x"},
                    {"xacro_arguments": "x"}, {"package_folders": "folder"},
                    {"package_folders": 3}, {"velocity_limits": {"LF_j0": None}},
                    {"velocity_limits": [1.0]}, {"effort_limits": "9"},
                    {"knees": {"LF": "forward", "FL": "backward"}}, {"knees": {"LF": ["up"]}},
                    {"knees": ["LF"]}):  # fmt: skip
        with pytest.raises(InputError):
            quiet(robot(), **options)


def test_numbers_of_numpy_are_numbers() -> None:
    made = quiet(robot(), velocity_limits=np.float32(3.0), effort_limits={"LF_j0": np.int64(9)})
    assert (made.velocity_limits == 3.0).all() and made.effort_limits.min() == 9.0


# --- the same everywhere ----------------------------------------------------------------------


def test_made_robot_survives_files_and_pickles(tmp_path: Path) -> None:
    text = robot(HEAD, foot=collision('<sphere radius="0.03"/>', "0 0 0.02"))
    made = quiet(text, knees={"RL": "backward"})
    for copy in (pickle.loads(pickle.dumps(made)), quiet(made.urdf)):
        assert copy.sha256 == made.sha256 and copy.foot_radius == made.foot_radius
        assert [copy.legs[n].foot for n in LEGS] == [made.legs[n].foot for n in LEGS]
    plan = gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=1, robot=made))
    plan.save(tmp_path / "plan.npz")
    back = gaitopt.load_plan(tmp_path / "plan.npz")
    assert back.robot.sha256 == made.sha256 and back.robot.notes.locked == made.notes.locked
    np.testing.assert_array_equal(back.sample(0.1).q, plan.sample(0.1).q)


def test_option_on_a_made_robot_keeps_what_was_found() -> None:
    made = quiet(robot(HEAD), foot_radius=0.02)
    slower = quiet(made.urdf, velocity_limits=3.0)
    assert (slower.velocity_limits == 3.0).all() and slower.mass == pytest.approx(made.mass)
    assert slower.notes.locked == made.notes.locked


def test_made_robot_that_was_edited_is_checked_again() -> None:
    text = quiet(robot(HEAD)).urdf
    assert quiet(text).urdf == text
    bad = text.replace('<inertia ixx="0.005"', '<inertia ixx="-0.005"', 1)
    assert "is not that of a body" in refusal(bad)
    missing = text.replace('ixy="0" ', "", 1)
    assert 'ixy="0"' in quiet(missing).urdf and missing != text


def test_feet_of_a_made_robot_stay_where_they_were_put() -> None:
    """Another option, or the foot of one leg, does not have the others looked for again."""
    feet = {name: (f"{name}_l2", (0.0, 0.0, -0.2)) for name in LEGS}
    text = quiet(robot(), feet=feet).urdf
    slower = quiet(text, velocity_limits=3.0, feet={"LF": ("LF_l2", (0.0, 0.0, -0.15))})
    lengths = [slower.legs[name].lower for name in LEGS]
    assert lengths == pytest.approx([0.15, 0.2, 0.2, 0.2], abs=1e-12)
    # A ball that is beside the foot that the user named is not the foot the second time, either.
    beside = robot(foot=collision('<sphere radius="0.03"/>', "0 0 0.02"))
    named = quiet(beside, feet={name: (f"{name}_foot", (0.0, 0.0, 0.0)) for name in LEGS})
    again = quiet(named.urdf, velocity_limits=3.0)
    assert again.legs["LF"].lower == named.legs["LF"].lower == pytest.approx(LOWER, abs=1e-12)


def test_legs_of_a_made_robot_may_be_named_anew() -> None:
    text = quiet(robot(), foot_radius=0.02).urdf
    swapped = {"LF": "RH_foot", "LH": "RF_foot", "RH": "LF_foot", "RF": "LH_foot"}
    assert quiet(text, legs=swapped).legs["LF"].foot == "RH_foot"


def test_doubts_stay_until_an_option_settles_them() -> None:
    """The assumed velocity limit is in the text now, and still assumed."""
    limit = '<limit lower="-1" upper="1" effort="9"/>'
    left = leg("LF", foot="", limits=(limit, LIMIT, LIMIT))
    made = quiet(robot(changed={"LF": left}, foot=""))
    text = made.urdf
    assert len(quiet(text, effort_limits=8.0).notes.warnings) == 2
    assert not quiet(text, velocity_limits=8.0, foot_radius=0.02).notes.warnings


@pytest.mark.parametrize(
    ("notes", "words"),
    [
        ('<gaitopt foot_radius="nan"/>', "foot_radius must be from 0 to 1 m, got 'nan'"),
        ('<gaitopt foot_radius="-1"/>', "foot_radius must be from 0 to 1 m"),
        ('<gaitopt><foot leg="LF" link="LF_foot"/></gaitopt>', "it names feet of LF; legs are"),
        ('<gaitopt><foot leg="LF"/></gaitopt>', "a <foot> has no link"),
        ('<gaitopt><armature joint="LF_j0" value="-1"/></gaitopt>', "armature '-1' is no number"),
        ("<gaitopt>" + "".join(f'<foot leg="{n}" link="base"/>' for n in LEGS) + "</gaitopt>",
         "the foot 'base' of leg LF is on the last joint of no leg"),
    ],
)  # fmt: skip
def test_notes_of_somebody_else_are_checked(notes: str, words: str) -> None:
    with pytest.raises(RobotError) as caught:
        Quadruped.from_urdf(robot().replace("</robot>", f"{notes}</robot>"))
    assert words in str(caught.value)
