"""The robot as the planners see it: read from URDF text, whole, and no other than what it says."""

from __future__ import annotations

import dataclasses
import hashlib
import io
import pickle
import re
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError, RobotError
from gaitopt.robots import xml_text
from gaitopt.robots.catalog import load_robot, own_urdf, robot_names
from gaitopt.robots.quadruped import CLOSED_FORM_TOLERANCE, Quadruped

robot = cache(load_robot)
WANG = own_urdf("wang2020").read_text("utf-8")
each_robot = pytest.mark.parametrize("name", robot_names())


def refusal(urdf: str) -> str:
    with pytest.raises(RobotError) as caught:
        Quadruped.from_urdf(urdf, "mine")
    return str(caught.value)


# --- numbers ----------------------------------------------------------------------------------


def test_wang2020_is_the_robot_of_table_1() -> None:
    wang = robot("wang2020")
    assert wang.mass == pytest.approx(25, abs=1e-12)
    assert wang.stance_size == (0.4, 0.3)
    assert wang.standing_height == 0.40
    assert wang.foot_radius == 0.015
    np.testing.assert_allclose(wang.velocity_limits, np.deg2rad(17), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(wang.body_axes, np.eye(3))
    np.testing.assert_allclose(wang.centre, 0, rtol=0, atol=1e-16)


def test_robot_introduces_itself() -> None:
    assert repr(robot("wang2020")) == "Quadruped('wang2020', 25 kg, 12 joints, legs LF LH RH RF)"


@each_robot
def test_robot_is_known_by_its_catalogue_name(name: str) -> None:
    assert robot(name).name == robot(name).model.name == name


def test_robot_without_another_name_has_the_urdf_s() -> None:
    assert Quadruped.from_urdf(WANG).name == "wang2020"
    assert Quadruped.from_urdf(WANG, "mine").name == "mine"


@each_robot
def test_centre_is_the_middle_of_the_hips(name: str) -> None:
    hips = [leg.hip for leg in robot(name).legs.values()]
    np.testing.assert_allclose(robot(name).centre, np.mean(hips, axis=0), rtol=0, atol=1e-15)


@each_robot
def test_body_axes_are_a_rotation_about_the_vertical(name: str) -> None:
    axes = robot(name).body_axes
    np.testing.assert_array_equal(axes @ axes.T, np.eye(3))
    assert np.linalg.det(axes) == 1.0 and axes[2, 2] == 1.0


@each_robot
def test_left_legs_are_left_and_front_legs_ahead(name: str) -> None:
    legs, centre = robot(name).legs, robot(name).centre
    for leg in LEGS:
        x, y, _ = legs[leg].hip - centre
        assert np.sign(x) == (1 if leg[1] == "F" else -1)
        assert np.sign(y) == (1 if leg[0] == "L" else -1)


@each_robot
def test_standing_height_is_in_whole_centimetres_and_within_reach(name: str) -> None:
    model = robot(name)
    height = model.standing_height
    assert height * 100 == pytest.approx(round(height * 100), abs=1e-9)
    for leg in model.legs.values():
        foot = leg.hip + leg.axes[:, 1] * leg.lateral - [0, 0, height]
        assert leg.shortfall(foot) == 0.0


@each_robot
def test_stance_size_is_the_distance_between_straight_legs(name: str) -> None:
    model = robot(name)
    feet = {
        leg: model.legs[leg].hip + model.legs[leg].axes[:, 1] * model.legs[leg].lateral
        for leg in LEGS
    }
    length, width = model.stance_size
    assert feet["LF"][0] - feet["LH"][0] == pytest.approx(length, abs=2e-6)
    assert feet["LF"][1] - feet["RF"][1] == pytest.approx(width, abs=2e-6)


# --- joints by name ---------------------------------------------------------------------------


@each_robot
def test_leg_columns_lead_to_the_leg_s_joints_by_name(name: str) -> None:
    model = robot(name)
    seen = []
    for leg in LEGS:
        columns = model.leg_columns[leg]
        assert tuple(model.joint_names[c] for c in columns) == model.legs[leg].joints
        for column, joint in zip(columns, model.legs[leg].joints, strict=True):
            assert model.model.joints[model.model.getJointId(joint)].idx_q == 7 + column
            assert model.model.joints[model.model.getJointId(joint)].idx_v == 6 + column
        seen += columns
    assert sorted(seen) == list(range(len(model.joint_names)))


def test_file_s_order_of_the_joints_is_not_pinocchio_s() -> None:
    """Why joints are mapped by name: Pinocchio sorts branches alphabetically."""
    theirs = yourdfpy.URDF.load(io.BytesIO(robot("a1").urdf.encode()), load_meshes=False)
    assert list(theirs.actuated_joint_names) != list(robot("a1").joint_names)
    assert sorted(theirs.actuated_joint_names) == sorted(robot("a1").joint_names)


def test_yourdfpy_agrees_on_the_feet_of_wang2020() -> None:
    wang = robot("wang2020")
    judge = yourdfpy.URDF.load(io.BytesIO(wang.urdf.encode()))
    data, q = wang.model.createData(), pin.neutral(wang.model)
    rng = np.random.default_rng(0)
    for _ in range(100):
        q[7:] = rng.uniform(-np.pi, np.pi, 12)
        judge.update_cfg(dict(zip(wang.joint_names, q[7:], strict=True)))
        pin.framesForwardKinematics(wang.model, data, q)
        for name, leg in wang.legs.items():
            theirs = judge.get_transform(leg.foot, "base")[:3, 3]
            closed = leg.forward(q[7:][list(wang.leg_columns[name])])
            pinocchio = data.oMf[wang.model.getFrameId(leg.foot)].translation
            np.testing.assert_allclose(closed, theirs, rtol=0, atol=1e-12)
            np.testing.assert_allclose(pinocchio, theirs, rtol=0, atol=1e-12)


def test_velocity_limits_are_in_the_order_of_the_joints() -> None:
    slow = WANG.replace('<joint name="RF_KFE"', '<joint name="RF_KFE" ')
    start = slow.index('<joint name="RF_KFE" ')
    slow = slow[:start] + re.sub(r'velocity="[^"]*"', 'velocity="0.125"', slow[start:], count=1)
    changed = Quadruped.from_urdf(slow)
    assert changed.velocity_limits[changed.leg_columns["RF"][2]] == 0.125
    assert changed.legs["RF"].velocity_limits[2] == 0.125
    assert (changed.velocity_limits == 0.125).sum() == 1


@each_robot
def test_joints_that_no_leg_owns_rest_within_their_limits(name: str) -> None:
    model = robot(name)
    low, high = model.model.lowerPositionLimit[7:], model.model.upperPositionLimit[7:]
    rest = model.neutral_joints()
    free = low >= high
    assert ((low <= rest) & (rest <= high) | free).all()
    assert (rest[free] == 0).all()


# --- identity ---------------------------------------------------------------------------------


@each_robot
def test_pickle_rebuilds_the_same_robot(name: str) -> None:
    model = robot(name)
    copy = pickle.loads(pickle.dumps(model))
    assert (copy.name, copy.urdf, copy.sha256) == (model.name, model.urdf, model.sha256)
    assert copy.joint_names == model.joint_names and copy.knees == model.knees
    for leg in LEGS:
        for field in dataclasses.fields(model.legs[leg]):
            ours, theirs = (getattr(m.legs[leg], field.name) for m in (model, copy))
            np.testing.assert_array_equal(ours, theirs)


def test_pickle_keeps_the_knees_that_were_asked_for() -> None:
    asked = load_robot("solo12", knees={"LF": "forward", "RH": "backward"})
    copy = pickle.loads(pickle.dumps(asked))
    assert dict(copy.knees) == {"LF": "forward", "RH": "backward"}
    assert {n: leg.knee for n, leg in copy.legs.items()} == {
        "LF": 1.0, "LH": 1.0, "RH": -1.0, "RF": -1.0,
    }  # fmt: skip


def test_fingerprint_is_of_the_text_alone() -> None:
    assert robot("wang2020").sha256 == hashlib.sha256(WANG.encode()).hexdigest()
    assert Quadruped.from_urdf(WANG, "mine").sha256 == robot("wang2020").sha256
    assert Quadruped.from_urdf(WANG + "\n").sha256 != robot("wang2020").sha256


def test_robot_cannot_be_changed() -> None:
    wang = robot("wang2020")
    with pytest.raises(AttributeError):
        wang.name = "other"  # type: ignore[misc]
    with pytest.raises(TypeError):
        wang.legs["LF"] = wang.legs["RF"]  # type: ignore[index]
    for array in (wang.body_axes, wang.centre, wang.velocity_limits):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


# --- the check at load ------------------------------------------------------------------------


def test_pinocchio_s_data_is_made_once_for_each_thread_and_size_of_the_model() -> None:
    mine = load_robot("a1")
    with ThreadPoolExecutor(1) as other:
        theirs = other.submit(mine.own_data).result()
        assert other.submit(mine.own_data).result() is theirs is not mine.own_data()
    first = mine.own_data()
    assert mine.own_data() is first
    mine.model.addFrame(pin.Frame("tip", 1, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    assert len(mine.own_data().oMf) == mine.model.nframes == len(first.oMf) + 1
    assert pickle.loads(pickle.dumps(mine)) == load_robot("a1")


@each_robot
def test_closed_form_was_checked_at_load(name: str) -> None:
    assert 0 < robot(name).closed_form_error < CLOSED_FORM_TOLERANCE == 1e-9


@pytest.mark.parametrize("leg", LEGS)
@pytest.mark.parametrize(
    ("constant", "fault"), [("upper", 1e-7), ("drop", 2e-9), ("lateral", -1e-3), ("lower", np.nan)]
)
def test_planted_fault_in_any_leg_is_found_and_named(
    monkeypatch: pytest.MonkeyPatch, leg: str, constant: str, fault: float
) -> None:
    from gaitopt.robots import leg_reading

    def wrong(model: object, name: str, *rest: object) -> object:
        found = genuine(model, name, *rest)  # type: ignore[arg-type]
        value = getattr(found, constant) + fault
        return dataclasses.replace(found, **{constant: value}) if name == leg else found

    genuine = leg_reading.read_leg
    monkeypatch.setattr(leg_reading, "read_leg", wrong)
    text = refusal(WANG)
    assert text.startswith(f"mine: the kinematics of leg {leg} disagree with Pinocchio by ")
    distance = float(text.split(" by ")[1].split(" m;")[0])
    assert distance == pytest.approx(abs(fault), rel=1e-2, nan_ok=True)


# --- what is no robot -------------------------------------------------------------------------


@pytest.mark.parametrize("text", ["", "hello", "<html></html>", "\0\1\2", '{"robot": 1}'])
def test_what_is_no_urdf_is_refused(text: str) -> None:
    assert refusal(text) == "mine: no <robot> element; this is not a URDF"


@pytest.mark.parametrize("length", [7, 500, 4000, len(WANG) - 12])
def test_urdf_cut_short_is_refused(length: int) -> None:
    start = WANG.index("<robot")
    text = WANG[: start + length] if length < 5000 else WANG[:length]
    assert refusal(text).startswith("mine: the URDF is no well-formed XML: ")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("</link>", "</lnk>", "the URDF is no well-formed XML: mismatched tag: line"),
        ('<parent link="base"/>', '<parent link="nowhere"/>', "cannot read this URDF: .*nowhere"),
        ('<joint name="LF_HFE" type="revolute"', '<joint name="LF_HFE" type="magic"',
         "cannot read this URDF: .*LF_HFE"),
        ('<child link="LF_HIP"/>', "", "cannot read this URDF: "),
        ('lower="-2.8" upper="0"', 'lower="2" upper="-2"',
         r"joint LF_KFE: its lower limit 2 is above its upper limit -2"),
        ('lower="-2.8" upper="0"', 'lower="nan" upper="0"', "KFE: lower of its <limit> is 'nan'"),
        ('velocity="0.29670597283903605"', 'velocity="-1"', "LF_HAA: its velocity limit -1"),
        ('<mass value="0.4"/>', '<mass value="-1"/>', "link LF_SHANK: a mass of -1 kg"),
        ('<mass value="0.4"/>', '<mass value="abc"/>', "SHANK: value of its <mass> is 'abc'"),
        ('<mass value="0.4"/>', '<mass value="inf"/>', "SHANK: value of its <mass> is 'inf'"),
        ('<sphere radius="0.015"/>', '<sphere radius="-1"/>', "LF_FOOT: a sphere with radius -1"),
        ('<joint name="LF_HFE"', '<joint name="LF_HAA"', "2 joints have the name LF_HAA"),
        ('<link name="LF_HIP"', '<link name="LF_FOOT"', "2 links have the name LF_FOOT"),
    ],
)  # fmt: skip
def test_malformed_urdf_is_refused(
    old: str, new: str, words: str, capfd: pytest.CaptureFixture[str]
) -> None:
    assert old in WANG
    assert re.search(words, refusal(WANG.replace(old, new)))
    # urdfdom's own words belong into the message, not onto the terminal.
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    "head",
    [
        '<!DOCTYPE robot [<!ENTITY x SYSTEM "file:///etc/passwd">]>',
        "<!doctype robot>",
        '<! DOCTYPE robot SYSTEM "http://127.0.0.1/robot.dtd">',
        '<!ENTITY a "aaaaaaaaaa">',
    ],
)
def test_document_types_and_entities_are_not_read(head: str) -> None:
    start = WANG.index("<robot")
    assert refusal(WANG[:start] + head + WANG[start:]) == (
        "mine: the URDF declares a document type or entities, which are not read; remove the "
        "<!DOCTYPE ...> part"
    )


def test_urdf_over_the_limit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xml_text, "LIMIT", 3_000_000)
    padded = WANG.replace("</robot>", " " * 3_000_000 + "</robot>")
    assert refusal(padded) == "mine: the URDF is larger than 3 MB"


def test_joint_whose_place_is_no_number_is_refused() -> None:
    start = WANG.index('<joint name="LF_HFE"')
    broken = WANG[:start] + WANG[start:].replace('xyz="0 0 0"', 'xyz="nan 0 0"', 1)
    assert broken != WANG
    with pytest.raises(RobotError):
        Quadruped.from_urdf(broken)


def test_bad_knees_are_an_input_error() -> None:
    with pytest.raises(InputError, match=r"^knees: 'front' is no leg"):
        load_robot("wang2020", knees={"front": "forward"})
