"""Which limbs of a robot are its legs, and trees that are broken."""

from __future__ import annotations

import re

import numpy as np
import pytest
from robot_loading import feet_by_pinocchio, quiet, refusal, warnings_of
from robot_texts import (
    CORNERS,
    LIMIT,
    joint,
    leg,
    link,
    robot,
)  # fmt: skip

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError, RobotError
from gaitopt.robots.quadruped import Quadruped


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


def test_links_side_by_side_are_no_legs() -> None:
    """As in an MJCF whose bodies are not inside each other."""
    text = "".join(
        link(f"{name}{part}") + joint(f"{name}{part}_j", "base", f"{name}{part}", axis="0 1 0",
                                      kind="revolute")
        for name in CORNERS for part in ("hip", "thigh")
    )  # fmt: skip
    told = refusal(f'<robot name="flat">{link("base", 5.0)}{text}</robot>')
    assert "every joint that moves hangs on the body alone (" in told and "LFhip_j; " in told
    assert "put their <body> inside each other" in told
    told = refusal(f'<robot name="one">{link("base", 5.0)}</robot>')
    assert told.endswith(
        "nothing moves in this file (1 links, 0 joints, which are all fixed); give a file with the "
        "joints of the legs"
    )


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


def six_legs(height: float = 0.0) -> str:
    """Two more legs start far beside the body, at a height above the hips [m]."""
    more = leg("LF").replace("LF_", "q_").replace("0.2 0.1 0", f"0 0.3 {height}", 1)
    other = leg("RF").replace("RF_", "p_").replace("0.2 -0.1 0", f"0 -0.3 {height}", 1)
    return robot(more + other)


def without_names(text: str) -> str:
    for old, new in zip(CORNERS, "stuv", strict=True):
        text = text.replace(f"{old}_", f"{new}_")
    return text


def test_hexapod_whose_middle_legs_start_farther_out_is_no_quadruped() -> None:
    """No other four of its legs are at the corners of a rectangle."""
    assert "more than four chains are like legs" in refusal(without_names(six_legs()))
    # Where names tell which four are meant, it is said that the others are held still.
    (words,) = (w for w in warnings_of(six_legs()) if "like legs" in w)
    assert "those that end at p_l2, q_l2 are held still" in words
    legs = {"LF": "LF_foot", "LH": "LH_foot", "RH": "RH_foot", "RF": "RF_foot"}
    assert not warnings_of(six_legs(), legs=legs)


def test_arms_above_the_body_are_no_legs() -> None:
    assert len(quiet(without_names(six_legs(height=0.3))).joint_names) == 12
    assert not warnings_of(six_legs(height=0.3))


def test_robot_may_be_called_by_the_wrong_names() -> None:
    """Names that the user gives decide which end is the front: here it is the other one."""
    swapped = {"LF": "RH_foot", "LH": "RF_foot", "RH": "LF_foot", "RF": "LH_foot"}
    made = quiet(robot(), legs=swapped)
    assert made.legs["LF"].joints[0] == "RH_j0"
    np.testing.assert_array_equal(made.body_axes[:, 0], [-1.0, 0.0, 0.0])
    copy = Quadruped.from_urdf(made.urdf, made.name)
    assert copy.legs["LF"].joints == made.legs["LF"].joints


def test_names_that_tell_other_corners_are_told() -> None:
    """Left and right exchanged in the names of a file; what they are called does not move legs."""
    swapped = robot()
    for one, other in (("LF_", "RF_"), ("LH_", "RH_")):
        swapped = swapped.replace(one, "X").replace(other, one).replace("X", other)
    (told,) = warnings_of(swapped)
    assert told.startswith("tester: legs are in other corners than their names tell: RF_j0 is on")
    assert quiet(swapped).legs["LF"].joints[0] == "RF_j0"
    meant = {"LF": "RF_foot", "LH": "RH_foot", "RH": "LH_foot", "RF": "LF_foot"}
    assert not warnings_of(swapped, legs=meant) and not warnings_of(robot())


@pytest.mark.parametrize(
    ("order", "wrong"),
    [
        # Left and right exchanged, front and hind exchanged, a quarter turn, one side exchanged:
        # the legs that are given as LF, LH, RH, RF.
        (("RF", "RH", "LH", "LF"), {"LF": "RF", "LH": "RH", "RH": "LH", "RF": "LF"}),
        (("LH", "LF", "RF", "RH"), {"LF": "RF", "LH": "RH", "RH": "LH", "RF": "LF"}),
        (("RF", "LF", "LH", "RH"), {"LF": "RF", "LH": "LF", "RH": "LH", "RF": "RH"}),
        (("LH", "LF", "RH", "RF"), {"LF": "LH", "LH": "LF"}),
    ],
)
def test_legs_on_the_wrong_side_are_refused_by_name(
    order: tuple[str, ...], wrong: dict[str, str]
) -> None:
    """The body can be turned and not mirrored; with hind legs in front, left is right."""
    legs = {name: f"{given}_foot" for name, given in zip(LEGS, order, strict=True)}
    text = refusal(robot(), legs=legs)
    for name in LEGS:
        words = rf"{legs[name][:2]}_j2 is the last joint of (..) and was given as {name}"
        found = re.search(words, text)
        assert (found.group(1) if found else None) == wrong.get(name)


def test_legs_of_a_plan_s_text_are_in_their_corners() -> None:
    """Somebody else may have exchanged the feet in the text of a plan's robot."""
    made = quiet(robot(), legs={name: f"{name}_foot" for name in LEGS})
    text = made.urdf.replace('leg="LF"', 'leg="X"').replace('leg="RF"', 'leg="LF"')
    with pytest.raises(RobotError, match="RF_j2 is the last joint of RF and was given as LF"):
        Quadruped.from_urdf(text.replace('leg="X"', 'leg="RF"'))


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
        (
            link("loose"),
            "2 links hang on no joint (base, loose); a robot has one base: remove loose, or let a "
            "joint hold it",
        ),
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


def test_legs_with_a_second_chain_beside_each_are_five_bars() -> None:
    """The second chain may have other joints than the first: a slider, as in some minitaurs."""
    second = "".join(
        joint(f"{name}_s", "base", f"{name}_slide", f"{x} {1.2 * y} 0", "prismatic", "1 0 0")
        + link(f"{name}_slide", 0.1)
        + joint(f"{name}_m", f"{name}_slide", f"{name}_crank", kind="revolute", axis="0 1 0")
        + link(f"{name}_crank", 0.1)
        for name, (x, y) in CORNERS.items()
    )
    told = refusal(robot(second))
    assert "another chain starts beside each leg (" in told and "LF_s (prismatic)-LF_m" in told
    assert "five-bar" in told


def test_parts_of_a_xacro_are_told_from_robots() -> None:
    told = refusal('<robot name="leg" xmlns:xacro="http://www.ros.org/wiki/xacro"></robot>')
    assert "the file has no link" in told and "give the file that includes it" in told


def test_toes_on_joints_that_float_are_fixed() -> None:
    """Some files of PyBullet have them."""
    floating = robot().replace('_end" type="fixed"', '_end" type="floating"')
    assert floating != robot()
    made = quiet(floating)
    assert made.notes.done[0].startswith("joints that float with nothing below them count as fixed")
    assert [leg.foot for leg in made.legs.values()] == [f"{name}_foot" for name in CORNERS]


def test_legs_of_more_hinges_than_four_name_the_cure() -> None:
    """As those of Centauro: a yaw, three pitches, a yaw and a wheel."""
    more = "".join(
        link(f"{name}_x{k}", 0.1)
        + joint(f"{name}_xj{k}", f"{name}_x{k - 1}" if k else f"{name}_foot", f"{name}_x{k}",
                "0 0 -0.02", "revolute", "0 1 0")
        for name in CORNERS for k in range(3)
    )  # fmt: skip
    told = refusal(robot(more))
    assert "legs have up to 6 hinges here, and gaitopt plans for 2 or 3, and locks a fourth" in told
    assert "make the others 'fixed' in the file" in told


def test_legs_that_lie_beside_the_others_name_the_origin_to_correct() -> None:
    """As in a file of the Pupper, whose left legs are turned by a right angle at zero angles."""
    lying = {name: leg(name).replace('rpy="0 0 0"', 'rpy="1.5707963 0 0"', 1)
             for name in ("LF", "LH")}  # fmt: skip
    told = refusal(robot(changed=lying))
    assert "LF_j2, LH_j2 turn about the vertical" in told or "LH_j2, LF_j2 turn" in told
    assert "correct the <origin> (rpy) of L" in told


def test_legs_that_end_with_sliders_name_the_cure() -> None:
    sliding = robot().replace('_end" type="fixed"', '_end" type="prismatic"')
    told = refusal(sliding)
    assert "a leg has hinges alone: make RF_end (prismatic), RH_end (prismatic)," in told
    assert "'fixed'; legs=" in told
