"""URDFs as people have them: what is locked, what is the body, and what is kept."""

from __future__ import annotations

import pickle
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from robot_loading import feet_by_pinocchio, quiet, refusal, warnings_of
from robot_texts import (
    CORNERS,
    LIMIT,
    LOWER,
    MASS,
    collision,
    joint,
    leg,
    link,
    robot,
)  # fmt: skip

import gaitopt
from gaitopt.conventions import LEGS
from gaitopt.errors import InputError, RobotError
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.quadruped import Quadruped


def test_robot_that_needs_nothing_keeps_its_text() -> None:
    text = robot()
    made = load_robot(text)
    assert made.urdf == text and not warnings_of(text)
    assert made.mass == pytest.approx(MASS) and made.foot_radius == 0.03
    assert [made.legs[name].foot for name in LEGS] == [f"{name}_foot" for name in LEGS]


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
