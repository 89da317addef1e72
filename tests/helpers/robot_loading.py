"""Loading robots in tests: without warnings, with a refusal; and their feet by Pinocchio."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import RobotError, RobotWarning
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.quadruped import Quadruped


def quiet(text: str | Path, **options: object) -> Quadruped:
    """A robot, without its warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        return load_robot(text, **options)  # type: ignore[arg-type]


def warnings_of(text: str, **options: object) -> list[str]:
    """The warnings of loading a robot."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        load_robot(text, **options)  # type: ignore[arg-type]
    return [str(w.message) for w in caught if issubclass(w.category, RobotWarning)]


def refusal(text: str | Path, **options: object) -> str:
    """The message with which a robot is refused."""
    with pytest.raises(RobotError) as caught:
        quiet(text, **options)
    return str(caught.value)


def feet_by_pinocchio(robot: Quadruped, joints: FloatArray) -> FloatArray:
    """Foot frames `(4, 3)` in the body frame."""
    data, q = robot.model.createData(), pin.neutral(robot.model)
    q[7:] = joints
    pin.framesForwardKinematics(robot.model, data, q)
    frames = [robot.model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
    return np.array([robot.body_axes.T @ data.oMf[f].translation for f in frames])
