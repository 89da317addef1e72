"""Configurations for Pinocchio's own model of a file."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pinocchio as pin
import pytest
from robot_texts import LIMIT, joint, link, robot

import gaitopt
from gaitopt.conventions import LEGS
from gaitopt.errors import InputError

HEAD = link("head", 0.4) + joint("neck", "base", "head", "0.3 0 0.1", "revolute", "0 0 1")
WORLD = link("world", 0) + joint("weld", "world", "base", "0.1 0.2 0.6", rpy="0.1 0.2 0.3")


@pytest.mark.parametrize("before", ["", WORLD])
def test_feet_are_where_they_are_in_pinocchio_s_own_model(before: str) -> None:
    """Endless joints with two numbers, a head that gaitopt has locked, a link for the world."""
    endless = '<limit effort="30" velocity="12"/>'
    kinds = ("revolute", "continuous", "revolute")
    text = robot(HEAD, before=before, kinds=kinds, limits=(LIMIT, endless, LIMIT))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gaitopt.RobotWarning)
        made = gaitopt.load_robot(text, pose={"neck": 0.4})
    theirs = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    assert theirs.nq == 7 + 4 * 4 + 1
    rng = np.random.default_rng(0)
    q = np.array([pin.randomConfiguration(made.model, -np.ones(19), np.ones(19)) for _ in range(5)])
    q[:, 7:] = rng.uniform(-3, 3, (5, 12))
    mapped = gaitopt.file_configurations(made, q, theirs)
    ours, data = made.model.createData(), theirs.createData()
    for a, b in zip(q, mapped, strict=True):
        pin.framesForwardKinematics(made.model, ours, a)
        pin.framesForwardKinematics(theirs, data, b)
        for leg in LEGS:
            foot = made.legs[leg].foot
            places = [d.oMf[m.getFrameId(foot)].translation
                      for m, d in ((made.model, ours), (theirs, data))]  # fmt: skip
            np.testing.assert_allclose(*places, rtol=0, atol=1e-12)
        com = [pin.centerOfMass(made.model, ours, a), pin.centerOfMass(theirs, data, b)]
        np.testing.assert_allclose(*com, rtol=0, atol=1e-12)


def test_links_that_float_below_the_legs_do_not_matter() -> None:
    """A pupper's toes hang on floating joints: its model has five free joints."""
    text = re.sub(r'(name="\w\w_end" type=)"fixed"', r'\1"floating"', robot())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gaitopt.RobotWarning)
        made = gaitopt.load_robot(text)
    theirs = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    assert theirs.nq == 7 + 12 + 4 * 7
    q = pin.randomConfiguration(made.model, -np.ones(19), np.ones(19))
    data = theirs.createData()
    mapped = gaitopt.file_configurations(made, q[None], theirs)[0]
    pin.framesForwardKinematics(theirs, data, mapped)
    place = data.oMf[theirs.getBodyId("base")].translation
    np.testing.assert_allclose(place, q[:3], rtol=0, atol=1e-12)
    np.testing.assert_allclose(
        pin.centerOfMass(theirs, data, mapped),
        pin.centerOfMass(made.model, made.model.createData(), q),
        rtol=0,
        atol=1e-12,
    )


def test_models_of_other_robots_are_refused() -> None:
    made = gaitopt.load_robot(robot())
    q = np.zeros((1, made.model.nq))
    with pytest.raises(InputError, match="no free joint"):
        gaitopt.file_configurations(made, q, pin.buildModelFromXML(robot()))
    other = pin.buildModelFromXML(gaitopt.load_robot("wang2020").urdf, pin.JointModelFreeFlyer())
    with pytest.raises(InputError, match="no joint LF_j0"):
        gaitopt.file_configurations(made, q, other)
    for wrong in (q[:, :5], np.full_like(q, np.nan), "q"):
        with pytest.raises(InputError, match="q must be"):
            gaitopt.file_configurations(made, wrong, other)
    with pytest.raises(InputError, match=r"must be a pinocchio\.Model"):
        gaitopt.file_configurations(made, q, None)
