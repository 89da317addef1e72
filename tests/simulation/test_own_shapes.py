"""Robots from an MJCF are simulated with the shapes of that file."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from robot_loading import quiet, refusal
from robot_texts import CORNERS, mjcf, robot

import gaitopt
from gaitopt import Quadruped
from gaitopt.simulation.model import SimModel, build_sim_model, to_mujoco
from gaitopt.simulation.settings import SimulationSettings

BOX = '<geom type="box" size="0.02 0.015 0.03" pos="0 0 -0.19" quat="0.98 0 0.19 0"/>'
TRUNK = (
    '<geom type="ellipsoid" size="0.2 0.1 0.05" mass="0.1"/>'
    '<geom type="cylinder" size="0.03 0.05" pos="0.1 0 0.1" contype="4" conaffinity="8" mass="0"/>'
    '<geom type="box" size="0.01 0.01 0.01" contype="0" conaffinity="0" mass="0"/>'
)
APART = '<contact><exclude body1="trunk" body2="LF_shank"/></contact>'


def model_of(made: Quadruped, **changes: Any) -> SimModel:
    ground = gaitopt.s_columns(0, columns=1, robot=made)
    return build_sim_model(made, ground, SimulationSettings(**changes))


def user_s_own(text: str) -> Any:
    """MuJoCo's model of a text, without the floor whose material is nowhere."""
    return mujoco.MjModel.from_xml_string(text.replace('material="absent"', ""))


def test_shapes_are_where_the_file_has_them(tmp_path: Path) -> None:
    """In random postures, with their sizes and with what they touch; also hulls of meshes."""
    import trimesh

    hand = trimesh.creation.icosphere(subdivisions=1, radius=0.05)
    hand.apply_translation([0.03, 0.0, 0.0])
    hand.export(tmp_path / "hand.stl")
    mesh = '<geom type="mesh" mesh="hand" pos="0 0 0.2" quat="0.8 0 0.6 0" mass="0.2"/>'
    text = mjcf(
        extra=TRUNK + mesh, tail=APART, assets='<mesh name="hand" file="hand.stl"/>',
        foot=BOX + '<geom size="0.025" pos="0 0 -0.22"/>',
    )  # fmt: skip
    (tmp_path / "dog.xml").write_text(text.replace('material="absent"', ""))
    made, theirs = (
        quiet(tmp_path / "dog.xml"),
        mujoco.MjModel.from_xml_path(str(tmp_path / "dog.xml")),
    )
    sim = model_of(made)
    assert sim.own_shapes
    ours, data, other = sim.model, mujoco.MjData(sim.model), mujoco.MjData(theirs)
    q = np.concatenate([[0.1, 0.2, 0.6, 0.1, 0.2, 0.3, 0.9], np.linspace(-1.0, 1.0, 12)])
    q[3:7] /= np.linalg.norm(q[3:7])
    data.qpos[:] = to_mujoco(sim, q)
    other.qpos[:7] = data.qpos[:7]
    for name, angle in zip(made.joint_names, q[7:], strict=True):
        other.joint(name).qpos[0] = angle
    for model, state in ((ours, data), (theirs, other)):
        mujoco.mj_kinematics(model, state)
    touching = theirs.geom_contype | theirs.geom_conaffinity
    kept = [g for g in range(theirs.ngeom) if theirs.geom_bodyid[g] and touching[g]]
    mine = [g for g in range(ours.ngeom) if ours.geom_bodyid[g]]
    assert len(kept) == len(mine) == 3 + 3 * 4
    for one, two in zip(mine, kept, strict=True):
        assert ours.geom_type[one] == theirs.geom_type[two]
        assert ours.body(ours.geom_bodyid[one]).name == theirs.body(theirs.geom_bodyid[two]).name
        assert ours.geom_contype[one] == theirs.geom_contype[two]
        assert ours.geom_conaffinity[one] == theirs.geom_conaffinity[two]
        np.testing.assert_allclose(data.geom_xpos[one], other.geom_xpos[two], rtol=0, atol=1e-6)
        if ours.geom_type[one] == mujoco.mjtGeom.mjGEOM_MESH:
            corners = [np.sort(_corners(m, g) @ d.geom_xmat[g].reshape(3, 3).T + d.geom_xpos[g], 0)
                       for m, g, d in ((ours, one, data), (theirs, two, other))]  # fmt: skip
            np.testing.assert_allclose(corners[0], corners[1], rtol=0, atol=1e-5)
        else:
            np.testing.assert_allclose(ours.geom_size[one], theirs.geom_size[two])
            np.testing.assert_allclose(data.geom_xmat[one], other.geom_xmat[two], rtol=0, atol=1e-9)
    assert ours.nexclude == 1
    pair = int(ours.exclude_signature[0])
    assert {ours.body(pair >> 16).name, ours.body(pair & 0xFFFF).name} == {"trunk", "LF_shank"}


def _corners(model: Any, geom: int) -> Any:
    mesh = int(model.geom_dataid[geom])
    start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    return np.unique(np.round(model.mesh_vert[start : start + count], 6), axis=0)


def test_links_that_do_not_move_belong_to_those_that_do() -> None:
    """A foot on a body of its own, which must not touch the trunk."""
    text = mjcf(tail=APART.replace("LF_shank", "LF_foot"), foot="@")
    for name in CORNERS:
        foot = f'<body name="{name}_foot" pos="0 0 -0.22"><geom size="0.03"/></body>'
        text = text.replace("@", foot, 1)
    sim = model_of(quiet(text))
    assert sim.own_shapes and sim.model.nexclude == 1
    pair = int(sim.model.exclude_signature[0])
    names = {sim.model.body(pair >> 16).name, sim.model.body(pair & 0xFFFF).name}
    assert names == {"trunk", "LF_shank"}


def test_the_rest_is_the_file_s_robot_as_well() -> None:
    """Mass matrix with motors, damping and dry friction of every joint."""
    text = mjcf().replace('damping="0.5"', 'damping="0.5" frictionloss="0.3"')
    made, theirs = quiet(text), user_s_own(text)
    sim = model_of(made)
    matrices = []
    q = np.concatenate([[0, 0, 0.5, 0, 0, 0, 1], np.linspace(-0.5, 0.5, 12)])
    for model in (sim.model, theirs):
        data, full = mujoco.MjData(model), np.zeros((18, 18))
        data.qpos[:7] = [0, 0, 0.5, 1, 0, 0, 0]
        for name, angle in zip(made.joint_names, q[7:], strict=True):
            data.joint(name).qpos[0] = angle
        mujoco.mj_forward(model, data)
        for i in range(18):
            mujoco.mj_mulM(model, data, full[i], np.eye(18)[i])
        order = [*range(6), *(int(model.joint(n).dofadr[0]) for n in made.joint_names)]
        matrices.append(full[np.ix_(order, order)])
        assert np.ravel(model.dof_damping)[6:] == pytest.approx(np.full(12, 0.5))
        assert model.dof_frictionloss[6:] == pytest.approx(np.full(12, 0.3))
    np.testing.assert_allclose(matrices[0], matrices[1], rtol=0, atol=1e-9)


@pytest.fixture(scope="module")
def walker() -> gaitopt.Plan:
    """A walk on feet that are boxes with a rounded end."""
    made = quiet(mjcf(foot=BOX + '<geom size="0.025" pos="0 0 -0.22"/>'))
    return gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=2, robot=made))


def test_a_plan_from_a_file_walks_with_the_shapes_of_its_robot(
    walker: gaitopt.Plan, tmp_path: Path
) -> None:
    walker.save(tmp_path / "plan.npz")
    found = gaitopt.simulate(gaitopt.load_plan(tmp_path / "plan.npz"))
    assert found.passed and found.own_shapes and found.bumps == ()
    assert "those of the robot's own MJCF; nothing touched beside the feet" in str(found)
    balls = gaitopt.simulate(walker, SimulationSettings(own_shapes=False, limbs=False))
    assert balls.passed and not balls.own_shapes and "shapes: balls at the feet\n" in str(balls)


def test_a_stick_below_the_body_is_in_the_way() -> None:
    """It reaches below the ground between the columns; with balls nobody would see it."""
    plain = quiet(mjcf())
    long = plain.standing_height + 0.16
    stick = f'<geom type="capsule" fromto="0 0 0 0 0 -{long}" size="0.01" mass="0"/>'
    made = quiet(mjcf(extra=stick))
    plan = gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=2, robot=made))
    found = gaitopt.simulate(plan)
    assert "trunk" in found.bumps and not found.passed
    assert "trunk touched beside the feet" in str(found)
    limbs = gaitopt.simulate(plan, SimulationSettings(own_shapes=False))
    assert "trunk" in limbs.bumps and not limbs.passed
    assert gaitopt.simulate(plan, SimulationSettings(own_shapes=False, limbs=False)).passed


def test_balls_stand_for_feet_that_have_no_shape_or_are_given() -> None:
    shin = '<geom type="capsule" fromto="0 0 0 0 0 -0.22" size="0.01" mass="0.2"/>'
    ghost = mjcf().replace(shin, shin.replace("/>", ' contype="0" conaffinity="0"/>'))
    ghost = ghost.replace('<geom size="0.03"', '<geom contype="0" conaffinity="0" size="0.03"')
    for made in (quiet(mjcf(), foot_radius=0.02), quiet(ghost), quiet(robot())):
        assert not model_of(made).own_shapes
    assert model_of(quiet(mjcf())).own_shapes


def test_feet_that_are_taken_larger_keep_the_shapes_of_the_file() -> None:
    """Nobody has said that they are others: thin pegs, which touch the ground as these."""
    peg = '<geom type="box" size="0.001 0.001 0.02" pos="0 0 -0.245" mass="0"/>'
    made = quiet(mjcf(foot=peg + '<geom size="0.03" pos="0 0 -0.22"/>'))
    assert any("so its radius is taken as" in told for told in made.notes.warnings)
    assert model_of(made).own_shapes


def test_shapes_survive_a_second_reading() -> None:
    made = quiet(mjcf(extra=TRUNK, tail=APART))
    assert len(made.notes.own.shapes) == 2 + 2 * len(CORNERS)
    assert made.notes.own.apart == (("trunk", "LF_shank"),)
    assert quiet(made.urdf).notes.own == made.notes.own
    assert quiet(made.urdf, effort_limits=9.0).notes.own == made.notes.own


@pytest.mark.parametrize(
    "shape",
    [
        'link="base" kind="plane" size="1 1 1" place="0 0 0" turn="1 0 0 0" bits="1 1"',
        'link="" kind="sphere" size="0.1" place="0 0 0" turn="1 0 0 0" bits="1 1"',
        'link="base" kind="sphere" size="-0.1" place="0 0 0" turn="1 0 0 0" bits="1 1"',
        'link="base" kind="sphere" size="0.1 0.1" place="0 0 0" turn="1 0 0 0" bits="1 1"',
        'link="base" kind="sphere" size="0.1" place="0 nan 0" turn="1 0 0 0" bits="1 1"',
        'link="base" kind="sphere" size="0.1" place="0 0 0" turn="0 0 0 0" bits="1 1"',
        'link="base" kind="sphere" size="0.1" place="0 0 0" turn="1e200 0 0 0" bits="1 1"',
        'link="base" kind="sphere" size="0.1" place="0 0 0" turn="1 0 0 0" bits="-1 1"',
        'link="base" kind="mesh" size="" place="0 0 0" turn="1 0 0 0" bits="1 1"',
    ],
)
def test_shapes_in_a_text_from_somebody_else_are_checked(shape: str) -> None:
    text = robot().replace("</robot>", f"<gaitopt><shape {shape}/></gaitopt></robot>")
    assert "is no shape of MuJoCo" in refusal(text)


def test_too_many_shapes_are_refused() -> None:
    one = ('<shape link="base" kind="sphere" size="0.1" place="0 0 0" turn="1 0 0 0" '
           'bits="1 1"/>')  # fmt: skip
    text = robot().replace("</robot>", f"<gaitopt>{one * 1001}</gaitopt></robot>")
    assert "more than 1000 shapes" in refusal(text)


def test_a_mesh_that_mujoco_cannot_take_is_an_error_of_the_robot() -> None:
    """Four corners in a plane: text that only an attacker writes."""
    flat = " ".join(["0 0 0", "1 0 0", "0 1 0", "1 1 0"])
    made = quiet(mjcf())
    text = made.urdf.replace(
        "</gaitopt>",
        '<shape link="trunk" kind="mesh" size="" place="0 0 0" turn="1 0 0 0" bits="1 1">'
        f"{flat}</shape></gaitopt>",
    )
    with pytest.raises(gaitopt.RobotError, match="MuJoCo cannot simulate"):
        model_of(quiet(text))
    assert not model_of(quiet(text), own_shapes=False).own_shapes


def test_shapes_that_overlap_when_the_robot_stands_do_not_push_it_apart() -> None:
    """A trunk so wide that the upper legs are inside of it: the certificate leaves it out, too."""
    wide = '<geom type="box" size="0.25 0.17 0.04" mass="0.1"/>'
    thigh = '<geom type="capsule" fromto="0 0 -0.02 0 0 -0.15" size="0.02" mass="0.01"/>'
    text = mjcf(extra=wide).replace('<body name="LF_shank"', f'{thigh}<body name="LF_shank"')
    assert text.count(thigh) == 1
    made = quiet(text)
    sim = model_of(made)
    names = {mujoco.mj_id2name(sim.model, mujoco.mjtObj.mjOBJ_BODY, k): k
             for k in range(sim.model.nbody)}  # fmt: skip
    left_out = {frozenset((int(s) >> 16, int(s) & 0xFFFF)) for s in sim.model.exclude_signature}
    thighs = [name for name in names if "LF" in name and "thigh" in name]
    assert any(frozenset((names["trunk"], names[name])) in left_out for name in thighs)
    assert len(left_out) == 1
    plan = gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=2, robot=made))
    assert gaitopt.simulate(plan).passed
