"""Motions for MuJoCo, replayed in MuJoCo."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt import InputError, Plan

mujoco = pytest.importorskip("mujoco", reason="needs pip install 'gaitopt[sim]'")


def feet(model, qpos: np.ndarray) -> np.ndarray:  # type: ignore[no-untyped-def]
    data = mujoco.MjData(model)
    out = []
    for row in qpos:
        data.qpos[:] = row
        mujoco.mj_kinematics(model, data)
        out.append([data.site(f"foot {leg}").xpos.copy() for leg in gaitopt.LEGS])
    return np.array(out)


@pytest.fixture(scope="module")
def written(a1_walk: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mujoco")
    gaitopt.export(a1_walk, folder / "walk.npz", "mujoco", dt=0.01)
    return folder


def test_the_model_that_is_made_replays_the_plan(a1_walk: Plan, written: Path) -> None:
    model = mujoco.MjModel.from_xml_path(str(written / "walk.xml"))
    told = np.load(written / "walk.npz")
    motion = a1_walk.at(np.minimum(told["time"], a1_walk.duration))
    assert feet(model, told["qpos"]) == pytest.approx(motion.feet, abs=1e-6)
    assert model.body_mass.sum() == pytest.approx(a1_walk.robot.mass, rel=1e-5)
    assert not told["qvel"][[0, -1]].any(), "at rest at both ends"
    # MuJoCo's own difference of configurations is the velocity, up to the acceleration's share.
    before, after = a1_walk.at([0.4 - 1e-5, 0.4 + 1e-5]), told["qpos"][40]
    step, rows = np.zeros(model.nv), []
    for q in before.q:
        row = after.copy()
        row[:3], row[3:7] = q[:3], q[[6, 3, 4, 5]]
        row[[int(model.joint(n).qposadr[0]) for n in a1_walk.robot.joint_names]] = q[7:]
        rows.append(row)
    mujoco.mj_differentiatePos(model, step, 2e-5, *rows)
    assert step == pytest.approx(told["qvel"][40], abs=0.05)


def test_key_frames_are_samples_and_servos_are_told_the_joints(
    a1_walk: Plan, written: Path
) -> None:
    model = mujoco.MjModel.from_xml_path(str(written / "walk.xml"))
    told = np.load(written / "walk.npz")
    assert model.nkey >= len({p.start for p in a1_walk.phases})
    for key in range(model.nkey):
        row = int(np.abs(told["time"] - model.key_time[key]).argmin())
        assert model.key_qpos[key] == pytest.approx(told["qpos"][row], abs=1e-9)
        assert model.key_ctrl[key] == pytest.approx(told["ctrl"][row], abs=1e-9)
    angle = {n: told["qpos"][:, int(model.joint(n).qposadr[0])] for n in told["joint_names"]}
    for i in range(model.nu):
        joint = model.joint(int(model.actuator_trnid[i, 0])).name
        assert told["ctrl"][:, i] == pytest.approx(angle[joint])


def own_model(written: Path, actuators: str) -> Path:
    """The robot as a user may have it: legs in another order, other actuators, a scene around."""
    text = (written / "walk.xml").read_text()
    text = re.sub(r"  <include .*\n", "", text)
    legs = re.findall(r'        <body name="\w\w_hip".*?\n        </body>\n', text, re.S)
    assert len(legs) == 4
    for old, new in zip(legs, ["A", "B", "C", "D"], strict=True):
        text = text.replace(old, new + "\n")
    for new, leg in zip(["A\n", "B\n", "C\n", "D\n"], reversed(legs), strict=True):
        text = text.replace(new, leg, 1)
    text = re.sub(r"<actuator>.*</actuator>", f"<actuator>{actuators}</actuator>", text, flags=re.S)
    text = text.replace("<worldbody>", '<worldbody><geom type="plane" size="5 5 1"/><light/>')
    out = written / "mine.xml"
    out.write_text(text)
    return out


def test_the_users_own_model_has_its_own_order_and_motors(a1_walk: Plan, written: Path) -> None:
    names = [str(n) for n in a1_walk.robot.joint_names]
    motors = "".join(f'<motor joint="{n}" gear="2"/>' for n in sorted(names))
    mine = own_model(written, motors)
    gaitopt.export(a1_walk, written / "mine.npz", "mujoco", dt=0.01, mjcf=mine)
    model = mujoco.MjModel.from_xml_path(str(mine))
    told = np.load(written / "mine.npz")
    made = np.load(written / "walk.npz")
    assert np.abs(told["qpos"] - made["qpos"]).max() > 0.01, "another order"
    motion = a1_walk.at(np.minimum(told["time"], a1_walk.duration))
    assert feet(model, told["qpos"]) == pytest.approx(motion.feet, abs=1e-6)
    forces = gaitopt.contact_forces(a1_walk, times=motion.t)
    by_name = dict(zip(forces.joint_names, forces.torques.T, strict=True))
    for i, name in enumerate(sorted(names)):
        assert 2.0 * told["ctrl"][:-1, i] == pytest.approx(by_name[name][:-1], abs=1e-6)
    # Key frames fit into the user's model.
    whole = mine.read_text().replace("</mujoco>", '<include file="mine.keyframes.xml"/></mujoco>')
    (written / "with.xml").write_text(whole)
    assert mujoco.MjModel.from_xml_path(str(written / "with.xml")).nkey > 3


def test_another_robot_is_refused_by_the_name_of_the_joint(a1_walk: Plan, written: Path) -> None:
    mine = own_model(written, "")
    mine.write_text(mine.read_text().replace('name="FL_calf" pos="0 0 -0.2"',
                                             'name="FL_calf" pos="0 0 -0.21"'))  # fmt: skip
    with pytest.raises(InputError, match=r"joint FL_calf_joint is 0\.0\d+ m or rad"):
        gaitopt.export(a1_walk, written / "no.npz", "mujoco", mjcf=mine)
    with pytest.raises(InputError, match="no joint 'left'"):
        gaitopt.export(a1_walk, written / "no.npz", "mujoco", joints={"FL_hip_joint": "left"},
                       mjcf=mine)  # fmt: skip
    with pytest.raises(InputError, match="kp and kd"):
        gaitopt.export(a1_walk, written / "no.npz", "mujoco", mjcf=mine, kp=3.0)
    assert not (written / "no.npz").exists()
