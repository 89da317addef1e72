"""Finding four legs in a URDF, whatever they are called and however their frames are turned."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import robot_texts
from hypothesis import given, settings
from hypothesis import strategies as st
from robot_loading import feet_by_pinocchio, quiet

from gaitopt.conventions import LEGS, rotation_z
from gaitopt.errors import InputError, RobotError
from gaitopt.robots.discovery import local_axis
from gaitopt.robots.quadruped import Quadruped

CORNERS = {"LF": (0.2, 0.1), "LH": (-0.2, 0.1), "RH": (-0.2, -0.1), "RF": (0.2, -0.1)}
UPPER, LOWER, OUT, DROP = 0.25, 0.22, 0.04, 0.03


@dataclass(frozen=True)
class Hinge:
    """One joint of a leg: its place and turn on the joint before it, and what kind it is."""

    axis: str
    xyz: tuple[float, float, float] = (0.0, 0.0, 0.0)
    pitch: float = 0.0
    kind: str = "revolute"
    limits: tuple[float, float] = (-3.0, 3.0)


def roll_pitch_pitch(left: bool) -> tuple[Hinge, ...]:
    """Offset sideways at the hip, pitch axis below the roll axis."""
    out = OUT if left else -OUT
    return Hinge("1 0 0"), Hinge("0 1 0", (0.0, out, -DROP)), Hinge("0 1 0", (0.0, 0.0, -UPPER))


def pitch_pitch() -> tuple[Hinge, ...]:
    return Hinge("0 1 0"), Hinge("0 1 0", (0.0, 0.0, -UPPER))


@dataclass(frozen=True)
class Limb:
    """A chain of hinges on the base, with a foot at its end."""

    name: str
    x: float
    y: float
    hinges: tuple[Hinge, ...]
    foot: tuple[float, float, float] | None = (0.0, 0.0, -LOWER)


def limbs(hinges: tuple[Hinge, ...] | None = None) -> list[Limb]:
    """Four good legs, in alphabetical order of no use."""
    return [
        Limb(leg, x, y, hinges or roll_pitch_pitch(leg.startswith("L")))
        for leg, (x, y) in CORNERS.items()
    ]


def joint(
    name: str, kind: str, parent: str, child: str, xyz: Sequence[float], rpy: str, more: str = ""
) -> str:
    return (
        f'<link name="{child}"><inertial><mass value="0.5"/><inertia ixx="0.01" iyy="0.01" '
        f'izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="{name}" type="{kind}">'
        f'<parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{" ".join(map(repr, map(float, xyz)))}" rpy="{rpy}"/>{more}</joint>'
    )


def urdf(parts: Sequence[Limb], yaw: float = 0.0, extra: str = "") -> str:
    """A URDF whose base is turned by `yaw` against the robot's own forward direction."""
    turn = rotation_z(-yaw)
    text = ['<robot name="test"><link name="base"/>', extra]
    for limb in parts:
        parent = "base"
        for k, hinge in enumerate(limb.hinges):
            place = turn @ [limb.x, limb.y, 0.0] + turn @ hinge.xyz if k == 0 else hinge.xyz
            rpy = f"0 {hinge.pitch!r} {-yaw!r}" if k == 0 else f"0 {hinge.pitch!r} 0"
            low, high = hinge.limits
            limit = f'<limit lower="{low!r}" upper="{high!r}" effort="9" velocity="2"/>'
            limit = limit if hinge.kind != "continuous" else ""
            name, child = f"{limb.name}_j{k}", f"{limb.name}_l{k}"
            more = f'<axis xyz="{hinge.axis}"/>{limit}'
            text.append(joint(name, hinge.kind, parent, child, place, rpy, more))
            parent = child
        if limb.foot is not None:
            text.append(
                joint(f"{limb.name}_end", "fixed", parent, f"{limb.name}_tip", limb.foot, "0 0 0")
            )
    return "".join([*text, "</robot>"])


def load(parts: Sequence[Limb], yaw: float = 0.0, extra: str = "") -> Quadruped:
    return Quadruped.from_urdf(urdf(parts, yaw, extra))


def refusal(parts: Sequence[Limb], yaw: float = 0.0, extra: str = "") -> str:
    with pytest.raises(RobotError) as caught:
        load(parts, yaw, extra)
    return str(caught.value)


def with_hinge(parts: list[Limb], which: int, k: int, **changes: object) -> list[Limb]:
    """The same robot with joint `k` of limb `which` changed."""
    hinges = list(parts[which].hinges)
    hinges[k] = replace(hinges[k], **changes)  # type: ignore[arg-type]
    return [replace(p, hinges=tuple(hinges)) if i == which else p for i, p in enumerate(parts)]


# --- what is found ----------------------------------------------------------------------------


def test_constants_of_a_known_leg_are_read_off() -> None:
    robot = load(limbs())
    for name, leg in robot.legs.items():
        side = 1.0 if name.startswith("L") else -1.0
        np.testing.assert_allclose(leg.hip, [*CORNERS[name], 0.0], rtol=0, atol=1e-15)
        np.testing.assert_allclose(leg.axes, np.eye(3), rtol=0, atol=1e-15)
        assert (leg.upper, leg.lower) == pytest.approx((UPPER, LOWER), abs=1e-15)
        assert (leg.lateral, leg.drop) == pytest.approx((side * OUT, DROP), abs=1e-12)
        assert leg.zeros == pytest.approx((0.0, 0.0), abs=1e-15)
        assert leg.signs == (1.0, 1.0, 1.0)
        assert leg.joints == tuple(f"{name}_j{k}" for k in range(3))
        assert leg.foot == f"{name}_tip"
        np.testing.assert_array_equal(leg.velocity_limits, [2.0, 2.0, 2.0])
        np.testing.assert_array_equal(leg.position_limits, [[-3.0] * 3, [3.0] * 3])


def test_two_joint_legs_are_found() -> None:
    robot = load(limbs(pitch_pitch()))
    assert not any(leg.has_roll for leg in robot.legs.values())
    assert all(leg.reach == pytest.approx(UPPER + LOWER) for leg in robot.legs.values())


def test_names_without_any_leg_words_do_not_matter() -> None:
    named, nameless = (
        load(limbs()),
        load(
            [
                replace(p, name=n)
                for p, n in zip(limbs(), ["zeta", "omega", "pi", "q9"], strict=True)
            ]
        ),
    )
    assert [leg.joints[0] for leg in nameless.legs.values()] == [
        "zeta_j0", "omega_j0", "pi_j0", "q9_j0",
    ]  # fmt: skip
    for leg in LEGS:
        np.testing.assert_array_equal(nameless.legs[leg].hip, named.legs[leg].hip)


def test_legs_are_told_by_their_place_and_not_by_their_order_in_the_file() -> None:
    robot = load(limbs()[::-1])
    assert [leg.joints[0][:2] for leg in robot.legs.values()] == list(LEGS)


@pytest.mark.parametrize("quarters", [0, 1, 2, 3, -1])
def test_base_may_be_turned_by_quarters_when_names_tell_front_from_hind(quarters: int) -> None:
    """Like example-robot-data's "quadruped", whose legs stand along y."""
    straight, turned = load(limbs()), load(limbs(), yaw=quarters * np.pi / 2)
    q = np.random.default_rng(0).uniform(-1, 1, 12)
    np.testing.assert_allclose(
        feet_by_pinocchio(turned, q), feet_by_pinocchio(straight, q), rtol=0, atol=1e-12
    )
    for leg in LEGS:
        np.testing.assert_allclose(turned.legs[leg].hip, straight.legs[leg].hip, rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        turned.body_axes, rotation_z(-quarters * np.pi / 2), rtol=0, atol=1e-12
    )


@pytest.mark.parametrize(
    ("yaw", "forward"), [(0.0, [1, 0, 0]), (np.pi, [1, 0, 0]), (np.pi / 2, [0, 1, 0])]
)
def test_nameless_robot_faces_along_the_base_s_positive_axis(
    yaw: float, forward: list[float]
) -> None:
    nameless = [replace(p, name=n) for p, n in zip(limbs(), "stuv", strict=True)]
    np.testing.assert_array_equal(load(nameless, yaw).body_axes[:, 0], forward)


@pytest.mark.parametrize(
    "names",
    [
        ["FL", "RL", "RR", "FR"],
        ["front_left", "rear_left", "rear_right", "front_right"],
        ["lf", "lh", "rh", "rf"],
        ["FL", "HL", "HR", "FR"],
        ["FL", "BL", "BR", "FR"],
    ],
)
def test_usual_ways_of_naming_tell_front_from_hind(names: list[str]) -> None:
    robot = load([replace(p, name=n) for p, n in zip(limbs(), names, strict=True)], yaw=np.pi)
    assert [leg.joints[0] for leg in robot.legs.values()] == [f"{n}_j0" for n in names]


@pytest.mark.parametrize("negated", [(0,), (1,), (2,), (0, 1, 2)])
def test_axes_may_point_the_other_way(negated: tuple[int, ...]) -> None:
    parts = [
        replace(
            p,
            hinges=tuple(
                replace(h, axis=h.axis.replace("1", "-1")) if k in negated else h
                for k, h in enumerate(p.hinges)
            ),
        )
        for p in limbs()
    ]
    signs = np.array([-1.0 if k in negated else 1.0 for k in range(3)])
    q = np.random.default_rng(1).uniform(-1, 1, (50, 3))
    for leg, negative in load(parts).legs.items():
        positive = load(limbs()).legs[leg]
        assert negative.signs == tuple(signs)
        np.testing.assert_allclose(
            negative.forward(q * signs), positive.forward(q), rtol=0, atol=1e-14
        )


@settings(max_examples=30, deadline=None)
@given(st.floats(-6.2, 6.2), st.floats(-6.2, 6.2))
def test_pose_that_a_urdf_calls_zero_is_a_matter_of_taste(thigh: float, knee: float) -> None:
    """Zero angles moved, limits moved along: the same legs, the same reach, the same bend."""
    low, high = -2.6, -0.4

    def parts(first: float, second: float) -> list[Limb]:
        moved = [
            (Hinge("1 0 0"), replace(h[1], pitch=first, limits=(-2 - first, 2 - first)),
             replace(h[2], pitch=second, limits=(low - second, high - second)))
            for h in (p.hinges for p in limbs())
        ]  # fmt: skip
        return [replace(p, hinges=h) for p, h in zip(limbs(), moved, strict=True)]

    usual, other = load(parts(0.0, 0.0)), load(parts(thigh, knee))
    q = np.random.default_rng(2).uniform([-0.5, -1.5, low], [0.5, 1.5, high], (20, 3))
    for leg in LEGS:
        ours, theirs = usual.legs[leg], other.legs[leg]
        assert ours.knee == theirs.knee == -1.0
        assert theirs.reach == pytest.approx(ours.reach, abs=1e-12)
        assert theirs.least_reach == pytest.approx(ours.least_reach, abs=1e-12)
        points, moved = ours.forward(q), np.array([0.0, thigh, knee])
        np.testing.assert_allclose(
            theirs.inverse(points), ours.inverse(points) - moved, rtol=0, atol=1e-9
        )


def test_pitch_axes_may_lie_anywhere_along_their_line() -> None:
    """Where a joint sits on its own axis changes nothing."""
    shifted = [
        replace(
            p,
            hinges=(
                p.hinges[0],
                replace(p.hinges[1], xyz=(0.0, p.hinges[1].xyz[1] + 0.05, -DROP)),
                replace(p.hinges[2], xyz=(0.0, -0.07, -UPPER)),
            ),
            foot=(0.0, 0.02, -LOWER),
        )
        for p in limbs()
    ]
    q = np.random.default_rng(3).uniform(-1, 1, 12)
    np.testing.assert_allclose(
        feet_by_pinocchio(load(shifted), q), feet_by_pinocchio(load(limbs()), q), rtol=0, atol=1e-15
    )


def test_bent_links_are_as_long_as_the_distance_between_their_axes() -> None:
    parts = with_hinge(limbs(), 0, 2, xyz=(0.03, 0.0, -0.04))
    leg = load(parts).legs["LF"]
    assert leg.upper == pytest.approx(0.05, abs=1e-15)
    assert leg.zeros[0] == pytest.approx(np.arctan2(-0.03, 0.04), abs=1e-15)


ARM = (Hinge("0 0 1", (0.2, 0.0, 0.1)), *[Hinge("0 1 0", (0.0, 0.0, 0.1))] * 4)


def test_arm_with_more_joints_than_a_leg_is_left_alone() -> None:
    robot = load([Limb("arm", 0.0, 0.0, ARM), *limbs()])
    assert len(robot.joint_names) == 17
    assert [robot.joint_names[c] for c in robot.leg_columns["RH"]] == ["RH_j0", "RH_j1", "RH_j2"]
    np.testing.assert_array_equal(robot.neutral_joints(), np.zeros(17))


def test_head_on_one_joint_and_a_gripper_that_branches_are_left_alone() -> None:
    fingers = "".join(
        joint(f"finger{k}", "prismatic", "head_l0", f"finger_link{k}", (0.1, 0, 0), "0 0 0",
              '<axis xyz="1 0 0"/><limit lower="0" upper="0.1" effort="1" velocity="1"/>')
        for k in range(2)
    )  # fmt: skip
    text = urdf([Limb("head", 0.3, 0.0, (Hinge("0 0 1"),)), *limbs()])
    robot = Quadruped.from_urdf(text.replace("</robot>", fingers + "</robot>"))
    assert len(robot.joint_names) == 15 and tuple(robot.legs) == LEGS


def test_joint_that_never_moves_may_stand_anywhere_in_a_leg() -> None:
    robot = load(limbs())
    shoe = joint("shoe", "fixed", "LF_l2", "LF_strap", (0.0, 0.0, -0.1), "0 0 0")
    same = Quadruped.from_urdf(urdf(limbs()).replace("</robot>", shoe + "</robot>"))
    assert same.legs["LF"].foot == robot.legs["LF"].foot == "LF_tip"


def test_foot_like_name_breaks_the_tie_between_links_in_one_place() -> None:
    toe = joint("glue", "fixed", "LF_l2", "LF_rubber_toe", (0.0, 0.0, -LOWER), "0 0 0")
    for text in (urdf(limbs()).replace("</robot>", toe + "</robot>"), urdf(limbs(), extra=toe)):
        assert Quadruped.from_urdf(text).legs["LF"].foot == "LF_rubber_toe"


@pytest.mark.parametrize(
    ("limits", "side"),
    [((-2.5, -0.2), -1.0), ((0.2, 2.5), 1.0), ((-2.5, 0.05), -1.0), ((-0.05, 2.5), 1.0)],
)
def test_limits_of_the_knee_tell_its_side(limits: tuple[float, float], side: float) -> None:
    for which, leg in enumerate(LEGS):
        assert load(with_hinge(limbs(), which, 2, limits=limits)).legs[leg].knee == side


def test_knees_point_inward_where_their_limits_allow_both_sides() -> None:
    assert {n: leg.knee for n, leg in load(limbs()).legs.items()} == {
        "LF": -1.0, "LH": 1.0, "RH": 1.0, "RF": -1.0,
    }  # fmt: skip


def test_joint_without_a_range_is_free() -> None:
    """lower = upper = 0 is how a URDF says that it does not know."""
    leg = load(with_hinge(limbs(), 0, 2, limits=(0.0, 0.0))).legs["LF"]
    assert leg.position_limits[:, 2].tolist() == [-np.inf, np.inf]
    assert leg.reach == pytest.approx(UPPER + LOWER, abs=1e-15)
    assert leg.least_reach == pytest.approx(UPPER - LOWER, abs=1e-9)


# --- knees, as asked for ----------------------------------------------------------------------


@pytest.mark.parametrize("leg", LEGS)
@pytest.mark.parametrize(("side", "sign"), [("forward", 1.0), ("backward", -1.0)])
def test_knee_side_may_be_asked_for(leg: str, side: str, sign: float) -> None:
    robot = Quadruped.from_urdf(urdf(limbs()), knees={leg: side})
    asked = robot.legs[leg]
    assert asked.knee == sign
    assert all(robot.legs[n].knee == load(limbs()).legs[n].knee for n in LEGS if n != leg)
    foot = asked.hip + np.array([0.0, asked.lateral, -0.3])
    assert np.sign(asked.inverse(foot)[-1]) == sign
    np.testing.assert_allclose(asked.forward(asked.inverse(foot)), foot, rtol=0, atol=1e-15)


def test_knees_may_be_asked_for_by_any_usual_name_of_a_leg() -> None:
    robot = Quadruped.from_urdf(urdf(limbs()), knees={"front_left": "forward", "RL": "backward"})
    assert {leg: robot.legs[leg].knee for leg in LEGS} == {
        "LF": 1.0, "LH": -1.0, "RH": 1.0, "RF": -1.0,
    }  # fmt: skip


def test_knee_side_that_the_limits_forbid_is_refused() -> None:
    text = urdf(with_hinge(limbs(), 0, 2, limits=(-2.5, -0.2)))
    assert Quadruped.from_urdf(text, knees={"LF": "backward"}).legs["LF"].knee == -1.0
    with pytest.raises(InputError) as caught:
        Quadruped.from_urdf(text, knees={"LF": "forward"})
    assert str(caught.value) == (
        "test: the limits of LF_j2 let the knee of leg LF point only backward; leave LF out of "
        "knees, or change the limits"
    )


@pytest.mark.parametrize(
    ("leg", "side", "words"),
    [
        (
            "XY",
            "forward",
            "knees: 'XY' is no leg, or a second name of one; legs are LF, LH, RH, RF",
        ),
        ("FL", "up", "knees: LF: must be 'forward' or 'backward', got 'up'"),
        ("LF", "", "knees: LF: must be 'forward' or 'backward', got ''"),
    ],
)
def test_unknown_knees_are_named(leg: str, side: str, words: str) -> None:
    with pytest.raises(InputError) as caught:
        Quadruped.from_urdf(urdf(limbs()), knees={leg: side})
    assert str(caught.value).startswith(words)


# --- what is refused --------------------------------------------------------------------------

ADVICE = (
    "; every leg must be a serial chain of 2 or 3 revolute joints (gaitopt.load_robot makes such a "
    "robot of files with other joints)"
)


def test_three_legs_are_too_few() -> None:
    assert refusal(limbs()[:3]) == (
        "test: found 3 chains of two or three hinges on the body where a quadruped has 4 "
        "(LF_j0-LF_j1-LF_j2; LH_j0-LH_j1-LH_j2; RH_j0-RH_j1-RH_j2)" + ADVICE
    )


def test_five_legs_are_too_many() -> None:
    text = refusal([*limbs(), Limb("tail", -0.3, 0.0, roll_pitch_pitch(True))])
    assert text.startswith("test: found 5 chains") and "tail_j0-tail_j1-tail_j2" in text


def test_robot_without_legs_has_none() -> None:
    text = refusal([])
    assert text.startswith("test: found 0 chains") and "(none)" in text


def test_leg_of_four_joints_is_passed_over_by_name() -> None:
    parts = limbs()
    parts[1] = replace(parts[1], hinges=(*parts[1].hinges, Hinge("0 1 0", (0, 0, -LOWER))))
    text = refusal(parts)
    assert text.startswith("test: found 3 chains")
    assert (
        "passed over: [LH_j0 (JointModelRX), LH_j1 (JointModelRY), LH_j2 (JointModelRY), " in text
    )
    assert "LH_j3 (JointModelRY)]" in text


def test_leg_of_one_joint_is_passed_over_by_name() -> None:
    parts = limbs()
    parts[1] = replace(parts[1], hinges=parts[1].hinges[:1])
    assert "passed over: [LH_j0 (JointModelRX)]" in refusal(parts)


@pytest.mark.parametrize(
    ("kind", "shown"), [("prismatic", "JointModelPY"), ("continuous", "JointModelRUBY")]
)
def test_leg_with_a_joint_that_is_no_hinge_is_passed_over_by_name(kind: str, shown: str) -> None:
    text = refusal(with_hinge(limbs(), 3, 1, kind=kind))
    assert text.startswith("test: found 3 chains")
    assert f"passed over: [RF_j0 (JointModelRX), RF_j1 ({shown}), RF_j2 (JointModelRY)]" in text
    assert text.endswith(ADVICE)


def test_leg_that_branches_is_passed_over() -> None:
    more = '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>'
    spur = joint("spur", "revolute", "LF_l1", "spur_link", (0, 0, -0.1), "0 0 0", more)
    with pytest.raises(RobotError, match="found 3 chains"):
        Quadruped.from_urdf(urdf(limbs()).replace("</robot>", spur + "</robot>"))


def test_joint_without_limits_elsewhere_on_the_robot_is_named() -> None:
    """A spinning lidar has two numbers in Pinocchio's configuration; joint vectors have one."""
    lidar = joint(
        "lidar", "continuous", "base", "dome", (0, 0, 0.1), "0 0 0", '<axis xyz="0 0 1"/>'
    )
    assert refusal(limbs(), extra=lidar) == (
        "test: joint lidar (JointModelRUBZ) has no limits or moves more than one way; make it "
        "'fixed', or 'revolute' with limits"
    )


def test_yaw_pitch_pitch_leg_is_named_with_its_axes() -> None:
    """With its foot below the vertical axis it cannot move the foot sideways, nor reach out."""
    parts = with_hinge(limbs(), 2, 0, axis="0 0 1")
    for k in (1, 2):
        parts = with_hinge(parts, 2, k, limits=(-0.05, 0.05))
    text = refusal(parts)
    assert text.startswith(
        "test: leg RH (RH_j0 about [0. 0. 1.], RH_j1 about [0. 1. 0.], RH_j2 about [0. 1. 0.], in "
        "the body frame) turns first about the vertical, and no posture within its limits has "
        "the foot below the hip or beside it, "
    )


@pytest.mark.parametrize("axis", ["0 0 1", "1 0 0"])
def test_knee_that_does_not_point_sideways_is_refused(axis: str) -> None:
    text = refusal(with_hinge(limbs(), 1, 2, axis=axis))
    assert text.startswith("test: leg LH (LH_j0 about ") and "and it cannot stand: " in text


def test_three_pitch_joints_are_refused() -> None:
    text = refusal(with_hinge(limbs(), 0, 0, axis="0 1 0"))
    assert text.startswith("test: leg LF (LF_j0 about [0. 1. 0.], ")
    assert "and it cannot stand: " in text


@pytest.mark.parametrize("axis", ["0 1 0.01", "0 1 0.0000005"])
def test_two_joints_whose_axes_are_not_parallel_are_refused(axis: str) -> None:
    text = refusal(with_hinge(limbs(pitch_pitch()), 1, 1, axis=axis))
    assert text.startswith("test: leg LH (LH_j0 about ")
    assert "is not pitch-pitch: both axes must point sideways and be parallel." in text
    assert "give each leg a third joint" in text


@pytest.mark.parametrize(
    ("k", "axis"), [(2, "0 1 0.01"), (2, "0.01 1 0"), (2, "0 1 0.0000005"), (0, "1 0.01 0"),
                    (0, "1 1 0"), (1, "0.2 1 0.1")],
)  # fmt: skip
def test_three_joints_with_other_axes_are_a_general_leg(k: int, axis: str) -> None:
    robot = load(with_hinge(limbs(), 3, k, axis=axis))
    assert [leg.name for leg in robot.legs.values() if leg.is_general] == ["RF"]
    assert robot.closed_form_error < 1e-15


@pytest.mark.parametrize(("yaw", "axis"), [(np.pi / 4, "0.7071 0.7071"), (0.6, "0.5646 0.8253")])
def test_robot_that_faces_between_its_base_s_axes_is_told_to_turn(yaw: float, axis: str) -> None:
    assert refusal(limbs(), yaw) == (
        "test: the knees turn about axes between x and y of the base link (LF_j2 about "
        f"[{axis} 0.    ]); turn the base link so that the robot faces along its x or y"
    )


@pytest.mark.parametrize("which", range(4))
@pytest.mark.parametrize("axis", ["1 0 0", "0 0 1"])
def test_one_wrong_knee_is_named_whichever_leg_it_is_on(which: int, axis: str) -> None:
    leg = LEGS[which]
    text = refusal(with_hinge(limbs(), which, 2, axis=axis))
    assert text.startswith(f"test: leg {leg} (") and f"{leg}_j2 about [" in text


def test_legs_whose_knees_turn_about_the_vertical_are_refused() -> None:
    hinges = (Hinge("1 0 0"), Hinge("0 0 1"), Hinge("0 0 1", (0.0, 0.0, -UPPER)))
    assert refusal(limbs(hinges)) == (
        "test: joint LF_j2 turns about a vertical axis; legs must be roll-pitch-pitch or "
        "pitch-pitch"
    )


@pytest.mark.parametrize("length", [0.0, 5e-5])
def test_link_without_length_is_named_with_its_joints(length: float) -> None:
    assert refusal(with_hinge(limbs(), 1, 2, xyz=(0.0, 0.0, -length))) == (
        f"test: leg LH has a link of length {length:.2g} m between LH_j1 and LH_j2 and LH_tip; "
        "upper and lower leg need a length"
    )


@pytest.mark.parametrize("foot", [None, (0.0, 0.0, 0.0)])
def test_lower_leg_without_a_foot_is_named(foot: tuple[float, float, float] | None) -> None:
    parts = limbs()
    parts[3] = replace(parts[3], foot=foot)
    assert refusal(parts) == (
        "test: no link lies beyond joint RF_j2; add a foot link on a fixed joint at the end of "
        "the lower leg"
    )


def test_two_legs_in_one_corner_are_named() -> None:
    parts = limbs()
    parts[1] = replace(parts[1], x=0.1)
    assert refusal(parts) == (
        "test: legs LF_j0-LF_j1-LF_j2 and LH_j0-LH_j1-LH_j2 both start in the body's LF corner; a "
        "quadruped has one leg in each"
    )


def test_limits_of_the_thigh_tell_the_knee_s_side_where_its_own_do_not() -> None:
    """Hind thighs that cannot lean forward, as knees that point forward would have them."""
    limit = robot_texts.LIMIT
    back = '<limit lower="0" upper="2.5" effort="30" velocity="12"/>'
    hind = {name: robot_texts.leg(name, limits=(limit, back, limit)) for name in ("LH", "RH")}
    plain = quiet(robot_texts.robot(limits=(limit,) * 3))
    told = quiet(robot_texts.robot(changed=hind, limits=(limit,) * 3))
    sides = [[made.legs[name].knee for name in ("LF", "LH")] for made in (plain, told)]
    assert sides == [[-1.0, 1.0], [-1.0, -1.0]]
    low, high = told.position_limits
    assert ((low <= told.standing_joints()) & (told.standing_joints() <= high)).all()


class WatchedJoint:
    """A joint of Pinocchio that is only given configurations that reach its angle."""

    def __init__(self, joint: Any) -> None:
        self.joint, self.idx_q, self.nq = joint, joint.idx_q, joint.nq

    def createData(self) -> Any:
        return self.joint.createData()

    def calc(self, data: Any, q: np.ndarray) -> None:
        assert len(q) >= self.idx_q + self.nq
        self.joint.calc(data, q)


def test_no_joint_reads_beyond_the_configuration(wang: Quadruped) -> None:
    """It would read what lies behind it in the memory."""
    data = wang.model.createData()
    q = pin.neutral(wang.model)
    pin.computeJointJacobians(wang.model, data, q)
    for number in range(2, wang.model.njoints):
        axis = local_axis(WatchedJoint(wang.model.joints[number]))
        column = wang.model.joints[number].idx_v
        turned = pin.getJointJacobian(wang.model, data, number, pin.ReferenceFrame.LOCAL)
        assert np.allclose(axis, turned[3:, column], atol=1e-12)
