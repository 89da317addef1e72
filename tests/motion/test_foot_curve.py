"""The curve of one foot: where Pinocchio puts it, and never faster than its bound."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import MotionPath
from gaitopt.motion.foot_curve import FootCurve, LegOfPath
from gaitopt.robots.rotations import matrix_to_rpy, rpy_to_quaternion


@pytest.mark.parametrize("name", ["frog1", "anymal_c", "a1"])
@pytest.mark.parametrize("leg", ["LH", "RF"])
def test_a_leg_of_a_path_moves_its_foot_as_pinocchio_does(name: str, leg: str) -> None:
    robot = gaitopt.load_robot(name)
    rng = np.random.default_rng(5)
    position, rotation = rng.normal(size=3), pin.utils.rotate("y", 0.2)
    coefficients = rng.uniform(-0.5, 0.5, (4, 6, 6 + len(robot.joint_names)))
    coefficients[:, :, :6] = 0.0
    coefficients[-1, :, :3] = position
    coefficients[-1, :, 3:6] = matrix_to_rpy(rotation @ robot.body_axes.T)
    path = MotionPath(np.linspace(0.0, 3.0, 7), coefficients)
    curve = FootCurve(robot.legs[leg], LegOfPath(path, robot.leg_columns[leg]), position, rotation)
    times = np.linspace(0.0, 3.0, 25)
    data, frame = robot.model.createData(), robot.model.getFrameId(robot.legs[leg].foot)
    for place, values in zip(curve.place(times), path.evaluate(times), strict=True):
        q = np.concatenate([values[:3], rpy_to_quaternion(values[3:6]), values[6:]])
        pin.framesForwardKinematics(robot.model, data, q)
        np.testing.assert_allclose(place, data.oMf[frame].translation, atol=1e-12)
    for k in range(6):
        times = np.linspace(path.times[k], path.times[k + 1], 2001)[:-1]
        steps = np.linalg.norm(np.diff(curve.place(times), axis=0), axis=1)
        assert (steps / np.diff(times)).max() <= curve.speeds[k] * (1 + 1e-9)
