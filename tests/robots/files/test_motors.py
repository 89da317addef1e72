"""What files and users say of motors: their inertia, seen at the joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from robot_loading import quiet, refusal
from robot_texts import mjcf, robot

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
    from gaitopt.certificate.known_robot import refuse_other_robot, refuse_stronger

    refuse_other_robot(load_robot("wang2020", motor_inertia=0.05))
    heavy = load_robot(robot(), motor_inertia=0.05)
    refuse_stronger(heavy, load_robot(robot()))
    with pytest.raises(RobotError, match="the inertia of its motors differs"):
        refuse_stronger(load_robot(robot(), motor_inertia=0.02), heavy)
