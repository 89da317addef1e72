"""MJCF: what gaitopt makes of it, against MuJoCo and against Pinocchio's own reader."""

from __future__ import annotations

import re
import sys
import warnings
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from robot_loading import quiet, refusal
from robot_texts import CORNERS, LOWER, MJCF_MASS, OUT, UPPER, mjcf

import gaitopt
from gaitopt.conventions import LEGS
from gaitopt.errors import MissingPackageError, RobotError, RobotWarning
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.files.mjcf import reader
from gaitopt.robots.files.mjcf.check import AGREEMENT, disagreement, refuse_disagreement


def plain(text: str) -> str:
    """The text without what names files that are not there."""
    return text.replace('<geom name="floor" type="plane" size="1 1 1" material="absent"/>', "")


@pytest.mark.parametrize("degrees", [True, False])
def test_masses_and_feet_are_mujoco_s(degrees: bool) -> None:
    made = quiet(mjcf(degrees=degrees))
    theirs = mujoco.MjModel.from_xml_string(plain(mjcf(degrees=degrees)))
    data = mujoco.MjData(theirs)
    assert made.mass == pytest.approx(theirs.body_mass.sum(), rel=1e-12)
    assert made.mass == pytest.approx(MJCF_MASS, rel=1e-12)
    rng, ours, q = np.random.default_rng(1), made.model.createData(), pin.neutral(made.model)
    for _ in range(5):
        q[7:] = rng.uniform(-1, 1, 12)
        for name, angle in zip(made.joint_names, q[7:], strict=True):
            data.joint(name).qpos[0] = angle
        data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
        mujoco.mj_kinematics(theirs, data)
        mujoco.mj_comPos(theirs, data)
        pin.framesForwardKinematics(made.model, ours, q)
        com = pin.centerOfMass(made.model, ours, q)
        np.testing.assert_allclose(com, data.subtree_com[1], rtol=0, atol=1e-9)
        for name in LEGS:
            ball = next(
                g for g in range(theirs.ngeom)
                if theirs.geom_bodyid[g] == theirs.body(f"{name}_shank").id
                and theirs.geom_type[g] == mujoco.mjtGeom.mjGEOM_SPHERE
            )  # fmt: skip
            place = ours.oMf[made.model.getFrameId(made.legs[name].foot)].translation
            np.testing.assert_allclose(place, data.geom_xpos[ball], rtol=0, atol=1e-9)


def test_inertias_are_those_of_pinocchio_s_reader(tmp_path: Path) -> None:
    """The mass matrix of joints and motors, by two readers that know nothing of one another."""
    made = quiet(mjcf())
    (tmp_path / "robot.xml").write_text(plain(mjcf()))
    theirs = pin.buildModelFromMJCF(str(tmp_path / "robot.xml"))
    ours = made.model
    # The rotation of an inertia of mass m at the end of the chain, and not only at rest.
    q_ours, q_theirs = pin.neutral(ours), pin.neutral(theirs)
    rng = np.random.default_rng(2)
    for name in made.joint_names:
        angle = rng.uniform(-1, 1)
        q_ours[ours.joints[ours.getJointId(name)].idx_q] = angle
        q_theirs[theirs.joints[theirs.getJointId(name)].idx_q] = angle
    first = pin.crba(ours, ours.createData(), q_ours)
    second = pin.crba(theirs, theirs.createData(), q_theirs)
    for name in made.joint_names:
        for other in made.joint_names:
            a = [ours.joints[ours.getJointId(n)].idx_v for n in (name, other)]
            b = [theirs.joints[theirs.getJointId(n)].idx_v for n in (name, other)]
            assert first[min(a), max(a)] == pytest.approx(
                second[min(b), max(b)], rel=1e-6, abs=1e-9
            )


def test_limits_gears_and_motors_are_read() -> None:
    made = quiet(mjcf())
    leg = made.legs["LF"]
    assert leg.position_limits[:, 0] == pytest.approx(np.radians([-60, 60]))
    assert leg.position_limits[:, 1].tolist() == [-np.inf, np.inf]
    assert leg.position_limits[:, 2] == pytest.approx(np.radians([-150, -20]))
    columns = list(made.leg_columns["LF"])
    assert made.effort_limits[columns].tolist() == [20.0, 40.0, 40.0]
    assert (made.velocity_limits == 10.0).all()  # none in an MJCF; assumed, and warned about
    assert made.notes.armature["LF_j1"] == 0.02
    assert made.foot_radius == 0.03
    # The thigh is turned by ten degrees at zero, and the hip's joint beside its body's origin.
    np.testing.assert_allclose(leg.hip, [0.2, 0.1, 0.0], rtol=0, atol=1e-12)
    assert (leg.upper, leg.lower) == pytest.approx((UPPER, LOWER))
    assert abs(leg.zeros[0]) == pytest.approx(np.radians(10))


def test_forcerange_is_the_effort_limit() -> None:
    text = mjcf().replace('ctrlrange="-20 20"', 'forcerange="-7 9"').replace("<motor", "<position")
    assert quiet(text).effort_limits.min() == 7.0 and quiet(text).effort_limits.max() == 14.0


def test_velocity_limits_are_missing_and_told() -> None:
    with pytest.warns(RobotWarning, match="no velocity limit for LF_j0.*10 rad/s is assumed"):
        load_robot(mjcf())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        load_robot(mjcf(), velocity_limits=20.0)


def key(name: str, thigh: float, knee: float) -> str:
    angles = " ".join(f"0 {thigh} {knee}" for _ in CORNERS)
    return f'<keyframe><key name="{name}" qpos="0 0 0.3 1 0 0 0 {angles}"/></keyframe>'


def test_key_frame_is_the_standing_pose() -> None:
    made = quiet(mjcf(tail=key("home", 0.6, -1.4)))
    data = mujoco.MjData(theirs := mujoco.MjModel.from_xml_string(plain(mjcf())))
    for name in LEGS:
        data.joint(f"{name}_j1").qpos[0], data.joint(f"{name}_j2").qpos[0] = 0.6, -1.4
    mujoco.mj_kinematics(theirs, data)
    shank = theirs.body("LF_shank").id
    tip = data.xpos[shank] + data.xmat[shank].reshape(3, 3) @ [0, 0, -0.22]
    assert made.standing_height == pytest.approx(0.5 - tip[2], abs=0.006)


@pytest.mark.parametrize("frame", [key("home", 0.6, 1.4), key("home", 2.5, -2.5),
                                   '<keyframe><key qpos="0 0 1"/></keyframe>'])  # fmt: skip
def test_key_frame_of_another_robot_is_no_standing_pose(frame: str) -> None:
    """Beyond the limits, lying, or with other numbers."""
    assert quiet(mjcf(tail=frame)).standing_height == quiet(mjcf()).standing_height


def test_knees_of_several_joints_and_reference_angles_are_kept() -> None:
    """Two joints on one body, and a joint whose first pose is not zero."""
    text = mjcf().replace('<joint name="LF_j1" axis="0 1 0"/>',
                          '<joint name="LF_j1" axis="0 1 0" ref="15"/>')  # fmt: skip
    arm = ('<body name="arm" pos="0 0 0.1"><joint name="a" axis="0 0 1" pos="0.02 0 0"/>'
           '<joint name="b" axis="0 1 0"/><joint name="c" type="ball"/>'
           '<geom size="0.02" pos="0 0 0.1" mass="0.3"/></body>')  # fmt: skip
    made = quiet(mjcf(extra=arm))
    assert set(made.notes.locked) == {"a", "b", "c"}
    assert made.mass == pytest.approx(quiet(mjcf()).mass + 0.3)
    leg, turned = quiet(mjcf()).legs["LF"], quiet(text).legs["LF"]
    q = np.array([0.1, 0.2, -1.0])
    moved = q + np.array([0.0, np.radians(15), 0.0])
    np.testing.assert_allclose(turned.forward(moved), leg.forward(q), rtol=0, atol=1e-9)


def test_scene_is_read_with_what_it_includes(tmp_path: Path) -> None:
    (tmp_path / "dog.xml").write_text(mjcf())
    scene = tmp_path / "scene.xml"
    scene.write_text(
        '<mujoco model="scene"><include file="dog.xml"/><asset><texture name="t" file="sky.png" '
        'type="skybox"/></asset><worldbody><body name="ball" pos="2 0 0"><freejoint/><geom '
        'size="0.1"/></body></worldbody><sensor><gyro name="g" site="nowhere"/></sensor></mujoco>'
    )
    made = quiet(scene)
    assert made.mass == pytest.approx(quiet(tmp_path / "dog.xml").mass)
    assert made.notes.kind == "mjcf"


def test_includes_stay_beside_the_file(tmp_path: Path) -> None:
    inside = tmp_path / "a" / "b"
    inside.mkdir(parents=True)
    (tmp_path / "secret.xml").write_text(mjcf())
    scene = inside / "scene.xml"
    scene.write_text('<mujoco><include file="../../secret.xml"/></mujoco>')
    assert "which is not beside it" in refusal(scene)
    scene.write_text('<mujoco><include file="/etc/hostname"/></mujoco>')
    assert "which is not beside it" in refusal(scene)
    scene.write_text('<mujoco><include file="scene.xml"/></mujoco>')
    assert "includes more than 50 files" in refusal(scene)
    assert "give the path of the file" in refusal('<mujoco><include file="x.xml"/></mujoco>')


def test_missing_meshes_cost_their_shapes_only() -> None:
    assets = '<mesh name="trunk" file="trunk.stl"/><mesh file="hip.obj"/>'
    extra = (
        '<geom type="mesh" mesh="trunk" contype="0" conaffinity="0"/><geom mesh="hip" type="mesh"/>'
    )
    with pytest.warns(RobotWarning, match="2 meshes are missing \\(trunk, hip\\)"):
        made = load_robot(mjcf(assets=assets, extra=extra))
    assert made.mass == pytest.approx(quiet(mjcf()).mass)


def test_mesh_is_where_mujoco_has_it(tmp_path: Path) -> None:
    """MuJoCo moves meshes to their centre; the URDF names the file as it is."""
    import trimesh

    box = trimesh.creation.box(extents=[0.02, 0.02, LOWER])
    box.apply_translation([0.0, 0.0, -LOWER / 2.0])
    (tmp_path / "parts").mkdir()
    box.export(tmp_path / "parts" / "shank.stl")
    shape = '<geom type="mesh" mesh="shank" mass="0"/>'
    text = mjcf(assets='<mesh name="shank" file="shank.stl"/>', foot=shape).replace(
        "<compiler", '<compiler meshdir="parts"'
    ).replace('<geom type="capsule" fromto="0 0 0 0 0 -0.22" size="0.01" mass="0.2"/>',
              '<inertial pos="0 0 0" mass="0.2" diaginertia="0.001 0.001 0.001"/>')  # fmt: skip
    (tmp_path / "dog.xml").write_text(text)
    made = quiet(tmp_path / "dog.xml")
    assert 'filename="parts/shank.stl"' in made.urdf and str(tmp_path) not in made.urdf
    assert made.legs["LF"].lower == pytest.approx(LOWER - 0.01, abs=1e-3)
    assert np.hypot(0.01, 0.01) < made.foot_radius < np.sqrt(3.0) * 0.01  # edge, corner


@pytest.mark.parametrize(
    ("tail", "words"),
    [
        ('<equality><connect body1="LF_shank" body2="trunk" anchor="0 0 0"/></equality>',
         "LF_shank and trunk are bound by an <equality> (connect)"),
        ('<equality><joint joint1="LF_j2" joint2="LF_j1"/></equality>',
         "LF_j2 and LF_j1 are bound by an <equality> (joint)"),
    ],
)  # fmt: skip
def test_closed_chains_are_refused_by_name(tail: str, words: str) -> None:
    text = refusal(mjcf(tail=tail))
    assert words in text and "five-bar" in text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<mujoco/>", "has no body with joints below it"),
        ("<mujoco><worldbody><body><geom size='1'/></body></worldbody></mujoco>", "no body with"),
        ("<mujoco><worldbody></mujoco>", "no well-formed XML"),
        ('<!DOCTYPE mujoco [<!ENTITY a "b">]><mujoco/>', "declares a document type"),
        (mjcf().replace('axis="1 0 0"', 'axis="0 0 0"'), "MuJoCo cannot read this MJCF"),
        (mjcf().replace('mass="5"', 'mass="-5"'), "MuJoCo cannot read this MJCF"),
        (mjcf().replace("<worldbody>", '<worldbody><replicate count="1000000"><body/></replicate>'),
         "more than 100 copies"),
        (mjcf(extra='<replicate count="11">' * 2 + "<site/>" + "</replicate>" * 2),
         "more than 100 copies"),
        (mjcf(extra='<attach model="arm" body="hand" prefix="a"/>'), "attaches a part of"),
        (mjcf(extra="<frame>" * 300 + "</frame>" * 300), "more than 200 elements inside"),
    ],
)  # fmt: skip
def test_broken_models_are_refused(text: str, words: str) -> None:
    assert words in refusal(text)


FINGER = '<body name="a"><joint name="a" type="slide"/><geom size="0.01" mass="0.1"/></body>'
GRIPPER = (
    '<body name="hand" pos="0 0 0.1"><joint axis="0 0 1"/><geom size="0.02" mass="0.3"/>'
    + FINGER
    + FINGER.replace('name="a"', 'name="b"')
    + "</body>"
)


@pytest.mark.parametrize(
    "equality",
    ['<joint joint1="a" joint2="b"/>', '<weld body1="a" body2="b"/>',
     '<connect body1="a" body2="trunk" anchor="0 0 0"/>'],
)  # fmt: skip
def test_fingers_that_are_bound_to_one_another_are_locked(equality: str) -> None:
    """One of the arm's joints has no name, and two are called as their bodies."""
    made = quiet(mjcf(extra=GRIPPER, tail=f"<equality>{equality}</equality>"))
    assert dict(made.notes.locked) == {"joint 13": 0.0, "a": 0.0, "b": 0.0}
    assert made.mass == pytest.approx(MJCF_MASS + 0.5)


def test_fingers_that_are_bound_to_a_leg_are_refused() -> None:
    tie = '<equality><connect body1="LF_shank" body2="a" anchor="0 0 0"/></equality>'
    assert "LF_shank and a are bound by an <equality>" in refusal(mjcf(extra=GRIPPER, tail=tie))


def test_legs_on_the_world_get_their_trunk_back() -> None:
    """Its mass is lost, and has to be given."""
    text = mjcf()
    start, end = text.index('<body name="trunk"'), text.index('<body name="LF_hip"')
    fixed = text[:start] + '<geom type="box" size="0.2 0.1 0.05"/>' + text[end:]
    close = fixed.rindex("</body>", 0, fixed.index("</worldbody>"))
    fixed = fixed[:close] + fixed[close + len("</body>") :]
    fixed = fixed.replace('<joint name="LF_j0"', '<joint name="LF_j0" class="leg"')
    fixed = fixed.replace('class="knee" axis', "axis")
    assert "link trunk moves and has no mass" in refusal(fixed)
    made = quiet(fixed, masses={"trunk": 5.0})
    assert made.mass == pytest.approx(MJCF_MASS)
    np.testing.assert_allclose(made.legs["LF"].hip, [0.2, 0.1, 0.0], rtol=0, atol=1e-12)


def test_plugins_and_their_files_are_never_touched() -> None:
    text = mjcf(tail='<extension><plugin plugin="evil"/></extension>').replace(
        "<worldbody>", '<size memory="1000000000000"/><worldbody>'
    )
    assert quiet(text).mass == quiet(mjcf()).mass


def test_a_urdf_of_another_robot_does_not_agree() -> None:
    """The planted fault: a link that is 1 mm longer."""
    made = quiet(mjcf())
    theirs = mujoco.MjModel.from_xml_string(plain(mjcf()))
    base = theirs.body("trunk").id
    assert disagreement(mujoco, theirs, base, made.urdf, locked={}, masses=True) < AGREEMENT
    other = made.urdf.replace(f"0.0 0.0 {-UPPER}", f"0.0 0.0 {-UPPER - 1e-3}", 1)
    assert other != made.urdf
    far = disagreement(mujoco, theirs, base, other, locked={}, masses=True)
    with pytest.raises(RobotError, match=r"differs from MuJoCo's model by 0.001 m"):
        refuse_disagreement(far, "other")


def test_axes_with_rounded_digits_are_made_square_and_the_rest_is_still_compared() -> None:
    """Honey Badger's thighs are turned by quaternions of three digits: by 0.8 mrad."""
    text = mjcf().replace('<joint name="LF_j1" axis="0 1 0"/>',
                          '<joint name="LF_j1" axis="0.0008 1 0"/>')  # fmt: skip
    assert text != mjcf()
    made = quiet(text)
    assert any("axes of the legs were turned by" in w for w in made.notes.warnings)
    assert abs(made.legs["LF"].axes[:, 0] @ made.legs["LF"].axes[:, 1]) < 1e-12


def test_hinges_of_backlash_beside_those_of_motors_are_locked() -> None:
    text = re.sub(r'<joint name="(\w+)_j1" axis="0 1 0"/>',
                  r'<joint name="\1_j1" axis="0 1 0"/>'
                  r'<joint name="\1_play" axis="0 1 0" range="-0.3 0.5"/>', mjcf())  # fmt: skip
    made = quiet(text)
    assert {f"{name}_play": pytest.approx(np.radians(0.1)) for name in CORNERS} == dict(
        made.notes.locked
    )
    assert [leg.joints[1] for leg in made.legs.values()] == [f"{leg}_j1" for leg in LEGS]
    assert any("as those of backlash" in text for text in made.notes.done)


def test_without_mujoco_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingPackageError, match=r"is MJCF; .*pip install 'gaitopt\[sim\]'"):
        load_robot(mjcf())
    assert reader.STANDING  # the module itself needs no MuJoCo


def test_robot_from_mjcf_walks(tmp_path: Path) -> None:
    made = quiet(mjcf())
    plan = gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=2, robot=made))
    plan.save(tmp_path / "plan.npz")
    back = gaitopt.load_plan(tmp_path / "plan.npz")
    assert back.robot.notes == made.notes
    certificate = gaitopt.verify(back, collisions=False)
    assert all(check.status != "violated" for check in certificate.checks)
    found = gaitopt.simulate(back)
    assert found.passed and found.own_shapes and found.steps > 0


def test_a_damping_without_an_end_is_refused_with_its_joint() -> None:
    text = mjcf()
    endless = re.sub(r'(<joint name="[^"]*")', r'\1 damping="inf"', text, count=1)
    assert endless != text
    with pytest.raises(RobotError, match=r"damping of the joint '\w+' is inf"):
        load_robot(endless)


def test_a_body_may_be_called_as_a_joint() -> None:
    named = mjcf().replace('name="trunk"', 'name="RF_j1"')
    assert quiet(named).mass == pytest.approx(MJCF_MASS)


def test_a_body_may_have_several_joints() -> None:
    """The links that a URDF needs between them weigh next to nothing, and physics takes them."""
    text = mjcf()
    for name, (_, y) in CORNERS.items():
        out = OUT if y > 0 else -OUT
        text = text.replace(f'<joint name="{name}_j1" axis="0 1 0"/>', "")
        text = text.replace(
            f'<body name="{name}_thigh" pos="0 {out} -0.1" euler="0 10 0">',
            f'<joint name="{name}_j1" axis="0 1 0" pos="0 {out} -0.1"/>'
            f'<body name="{name}_thigh" pos="0 {out} -0.1">',
        )
    made = quiet(text)
    assert [len(leg.joints) for leg in made.legs.values()] == [3] * 4
    assert made.mass == pytest.approx(MJCF_MASS, rel=1e-8)
    plan = gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=2, robot=made))
    assert not gaitopt.simulate(plan).failures


def test_meshes_that_git_lfs_did_not_fetch_are_missing(tmp_path: Path) -> None:
    (tmp_path / "part.stl").write_text("version https://git-lfs.github.com/spec/v1\noid 1\n")
    assets = '<mesh name="part" file="part.stl"/>'
    file = tmp_path / "tester.xml"
    file.write_text(mjcf(assets=assets, extra='<geom type="mesh" mesh="part"/>'))
    assert any("1 mesh is missing (part)" in words for words in quiet(file).notes.warnings)


def test_meshes_that_mujoco_cannot_read_count_as_their_hulls(tmp_path: Path) -> None:
    """MuJoCo reads no STL that is text; trimesh does."""
    trimesh.creation.box((0.2, 0.1, 0.05)).export(tmp_path / "part.stl", file_type="stl_ascii")
    (tmp_path / "broken.stl").write_bytes(b"solid nothing")
    assets = '<mesh name="part" file="part.stl"/><mesh name="broken" file="broken.stl"/>'
    file = tmp_path / "tester.xml"
    shapes = '<geom type="mesh" mesh="part"/><geom type="mesh" mesh="broken"/>'
    file.write_text(mjcf(assets=assets, extra=shapes))
    made = quiet(file)
    assert any("1 mesh is missing (broken)" in words for words in made.notes.warnings)
    assert [shape.kind for shape in made.notes.own.shapes if shape.link == "trunk"] == ["mesh"]
