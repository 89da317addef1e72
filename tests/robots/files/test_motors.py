"""What files and users say of motors: inertia, and torque that falls with the speed."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from robot_loading import quiet, refusal, warnings_of
from robot_texts import CORNERS, KNEE, LIMIT, mjcf, robot

import gaitopt
from gaitopt.errors import InputError, RobotError
from gaitopt.robots.catalog import load_robot


def test_one_inertia_is_that_of_every_motor() -> None:
    made = load_robot(robot(), motor_inertia=0.03)
    assert made.motor_inertia.tolist() == [0.03] * 12
    assert not load_robot(robot()).motor_inertia.any()
    # The mass matrix is that of the links and, on its diagonal, the motors.
    plain, q = load_robot(robot()).model, pin.neutral(made.model)
    q[7:] = np.linspace(-1.0, 1.0, 12)
    more = pin.crba(made.model, made.model.createData(), q) - pin.crba(plain, plain.createData(), q)
    np.testing.assert_allclose(more, np.diag([0.0] * 6 + [0.03] * 12), rtol=0, atol=1e-15)


def test_inertias_by_joint_take_the_place_of_the_file_s() -> None:
    of_the_file = quiet(mjcf())
    assert (of_the_file.motor_inertia == 0.02).all()
    made = quiet(mjcf(), motor_inertia={"LF_j1": 0.5, "RH_j2": 0.0})
    found = dict(zip(made.joint_names, made.motor_inertia.tolist(), strict=True))
    assert (found["LF_j1"], found["RH_j2"], found["RF_j0"]) == (0.5, 0.0, 0.02)
    assert not quiet(mjcf(), motor_inertia=0.0).motor_inertia.any()
    # Said once more of a robot that was read before.
    assert quiet(made.urdf).motor_inertia.tolist() == made.motor_inertia.tolist()
    assert (quiet(made.urdf, motor_inertia=0.1).motor_inertia == 0.1).all()


def test_inertias_go_through_plan_files(tmp_path: Path) -> None:
    made = load_robot("a1", motor_inertia={"FL_hip_joint": 0.004, "RR_calf_joint": 0.007})
    plan = gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=1, robot=made))
    plan.save(tmp_path / "plan.npz")
    back = gaitopt.load_plan(tmp_path / "plan.npz").robot
    assert back.motor_inertia.tolist() == made.motor_inertia.tolist()
    assert back.model.armature.tolist() == [0.0] * 6 + made.motor_inertia.tolist()
    assert sorted(back.motor_inertia)[-2:] == [0.004, 0.007]


@pytest.mark.parametrize("given", [-0.1, np.nan, np.inf, 2000.0, "0.1", {"LF_j0": -1.0}])
def test_what_is_no_inertia_is_refused(given: object) -> None:
    with pytest.raises(InputError, match=r"motor_inertia.* must be a number from 0 to 1000 kg m"):
        load_robot(robot(), motor_inertia=given)  # type: ignore[arg-type]


def test_joints_of_no_leg_are_refused() -> None:
    with pytest.raises(InputError, match="motor_inertia: no leg has a joint 'tail'"):
        load_robot(robot(), motor_inertia={"tail": 0.1})


@pytest.mark.parametrize("value", ["-1", "nan", "1e9", "much"])
def test_inertias_in_a_text_from_somebody_else_are_checked(value: str) -> None:
    note = f'<gaitopt><armature joint="LF_j0" value="{value}"/></gaitopt></robot>'
    assert f"armature {value!r} is no number that is allowed" in refusal(
        robot().replace("</robot>", note)
    )


def test_a_known_robot_s_motors_may_be_told(wang: gaitopt.Quadruped) -> None:
    """Of gaitopt's own robots none knows its motors, so a plan may."""
    from gaitopt.certificate.claims.known_robot import refuse_other_robot, refuse_stronger

    refuse_other_robot(load_robot("wang2020", motor_inertia=0.05))
    heavy = load_robot(robot(), motor_inertia=0.05)
    refuse_stronger(heavy, load_robot(robot()))
    with pytest.raises(RobotError, match="the inertia of its motors differs"):
        refuse_stronger(load_robot(robot(), motor_inertia=0.02), heavy)


def test_one_torque_line_is_that_of_every_motor() -> None:
    made = load_robot(robot(), torque_line=(8, 14.0))
    assert made.torque_lines.tolist() == [[8.0] * 12, [14.0] * 12]
    assert np.isinf(load_robot(robot()).torque_lines).all()
    one = load_robot(made.urdf, torque_line={"LF_j1": (1.0, 2.0)})
    column = one.leg_columns["LF"][1]
    assert one.torque_lines[:, column].tolist() == [1.0, 2.0]
    assert np.delete(one.torque_lines, column, axis=1).tolist() == [[8.0] * 11, [14.0] * 11]


def test_the_speed_without_load_is_a_velocity_limit_where_there_is_no_other() -> None:
    assert (quiet(mjcf(), torque_line=(5.0, 21.0)).velocity_limits == 21.0).all()
    assert (quiet(robot(), torque_line=(5.0, 21.0)).velocity_limits == 12.0).all()


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (5.0, "torque_line must be two speeds"),
        ((1.0, 2.0, 3.0), "torque_line must be two speeds"),
        ((5.0, 5.0), "must be above the one with the whole torque, 5 rad/s"),
        ((-1.0, 5.0), "speed with the whole torque, must be a number from 0"),
        ((1.0, np.nan), "speed without load, must be a number"),
        ({"tail": (1.0, 2.0)}, "torque_line: no leg has a joint 'tail'"),
        ({"LF_j0": 3.0}, "torque_line LF_j0 must be two speeds"),
    ],
)
def test_what_is_no_torque_line_is_refused(given: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        load_robot(robot(), torque_line=given)  # type: ignore[arg-type]


@pytest.mark.parametrize("speeds", ['full_to="2" no_load="1"', 'full_to="nan" no_load="1"',
                                    'full_to="0" no_load="1e99"'])  # fmt: skip
def test_torque_lines_in_a_text_from_somebody_else_are_checked(speeds: str) -> None:
    note = f'<gaitopt><torque_line joint="LF_j0" {speeds}/></gaitopt></robot>'
    assert "a torque_line needs speeds 0 <= full_to < no_load" in refusal(
        robot().replace("</robot>", note)
    )


def test_a_known_robot_s_torque_may_fall_earlier_and_not_later() -> None:
    from gaitopt.certificate.claims.known_robot import refuse_stronger

    known = load_robot(robot(), torque_line=(8.0, 14.0))
    refuse_stronger(load_robot(robot(), torque_line=(7.0, 13.0)), known)
    refuse_stronger(known, load_robot(robot()))
    with pytest.raises(RobotError, match=r"speed without load limit of \w+ is wider \(15 and 14"):
        refuse_stronger(load_robot(robot(), torque_line=(8.0, 15.0)), known)
    with pytest.raises(RobotError, match=r"the full torque's speed limit .* is wider"):
        refuse_stronger(load_robot(robot()), known)


def general(extra: str = "", gain: float = 0.5, slope: float = 0.08) -> str:
    """Motors with gears of 9 that are driven by up to 24 volts."""
    motors = "".join(
        f'<general name="{n}_m{k}" joint="{n}_j{k}" gear="9" ctrlrange="-24 24" gainprm="{gain}" '
        f'biastype="affine" biasprm="0 0 -{slope}" {extra}/>'
        for n in CORNERS for k in range(3)
    )  # fmt: skip
    return mjcf(actuators=motors)


@pytest.mark.parametrize("extra", ["", 'forcerange="-3 4"'])
def test_motors_driven_by_a_voltage_are_torque_lines(extra: str) -> None:
    """By MuJoCo: with the whole voltage it makes the torque of the line, at any speed."""
    made = quiet(general(extra))
    assert any("fall with the speed" in text for text in made.notes.done)
    plain = general(extra).replace('material="absent"', "")
    model = mujoco.MjModel.from_xml_string(plain)
    data = mujoco.MjData(model)
    column = made.leg_columns["LF"][0]
    full, none = made.torque_lines[:, column]
    assert full == pytest.approx(0.0 if not extra else (12.0 - 3.0) / (9.0 * 0.08))
    assert none == pytest.approx(12.0 / (9.0 * 0.08))
    assert made.velocity_limits[column] == none
    data.actuator("LF_m0").ctrl[0] = -24.0
    for speed in np.linspace(0.0, none, 9):
        data.joint("LF_j0").qvel[0] = -speed
        mujoco.mj_forward(model, data)
        share = min(1.0, (none - speed) / (none - full))
        driving = made.effort_limits[column] * share
        assert data.joint("LF_j0").qfrc_actuator[0] == pytest.approx(-driving, abs=1e-9)


@pytest.mark.parametrize(
    "text",
    [
        general(gain=0.5, slope=0.5),  # a servo of the speed
        general('forcerange="-3 3" dyntype="filter" dynprm="0.1"'),
        general().replace('ctrlrange="-24 24"', 'forcerange="-3 3"'),
        general().replace("</actuator>", '<motor joint="LF_j0" ctrlrange="-1 1"/></actuator>'),
    ],
)
def test_what_may_be_a_servo_tells_no_torque_line(text: str) -> None:
    assert np.isinf(quiet(text).torque_lines[:, quiet(text).leg_columns["LF"][0]]).all()


def test_inertia_of_an_actuator_counts_behind_its_gear() -> None:
    if not hasattr(mujoco.MjModel.from_xml_string("<mujoco/>"), "actuator_armature"):
        pytest.skip("MuJoCo before 4")
    made = quiet(general('armature="0.001"'))
    assert made.motor_inertia == pytest.approx(np.full(12, 0.02 + 81.0 * 0.001))


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        ('armature="1"', "its motor's inertia is inf kg m"),
        ('armature="0"', "its motor's inertia is nan kg m"),
    ],
)
def test_inertia_behind_a_huge_gear_is_refused(extra: str, words: str) -> None:
    if not hasattr(mujoco.MjModel.from_xml_string("<mujoco/>"), "actuator_armature"):
        pytest.skip("MuJoCo before 4")
    text = general(extra).replace('gear="9"', 'gear="1e200"')
    assert f"joint LF_j0: {words}" in refusal(text)


def test_armature_above_every_motor_s_is_refused_by_its_joint() -> None:
    text = mjcf().replace('armature="0.02"', 'armature="2000"')
    assert "joint LF_j0: its motor's inertia is 2000 kg m^2, above 1000" in refusal(text)


def test_torque_lines_of_numbers_out_of_range_are_none_or_refused() -> None:
    """A speed without load of no motor, two equal speeds, and a product that is 0."""
    words = "joint LF_j0: by its actuator its torque falls from"
    assert words in refusal(general(gain=1.0, slope=1e-290))
    assert words in refusal(general('forcerange="-1e-20 1e-20"'))
    flat = general(slope=1e-300).replace('gear="9"', 'gear="1e-100"')
    assert np.isinf(quiet(flat).torque_lines).all()


@pytest.mark.parametrize(("friction", "told"), [(0.5, 0), (20.0, 0), (40.0, 1)])
def test_joints_that_rub_too_much_are_told(friction: float, told: int) -> None:
    """The robot's weight at a leg's length is 52 N m."""
    limit = f'{LIMIT}<dynamics friction="{friction}"/>'
    found = [w for w in warnings_of(robot(limits=(LIMIT, limit, KNEE))) if "rub with" in w]
    assert len(found) == told
    if told:
        assert "LF_j1 40 of 52" in found[0] and "frictionloss=" in found[0]
