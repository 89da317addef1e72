"""First guesses for Crocoddyl, which judges them: its own dynamics must give the plan's motion."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import InputError, Plan


@pytest.fixture(scope="module")
def told(a1_walk: Plan, tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = tmp_path_factory.mktemp("crocoddyl") / "guess.npz"
    gaitopt.export(a1_walk, path, "crocoddyl", dt=0.01)
    return np.load(path)


def test_states_and_contacts_are_the_plans(a1_walk: Plan, told: Any) -> None:
    motion = a1_walk.at(np.minimum(told["time"], a1_walk.duration))
    nodes = len(told["time"])
    assert told["xs"].shape == (nodes, 19 + 18) and told["us"].shape == (nodes - 1, 12)
    assert told["xs"][:, :19] == pytest.approx(motion.q)
    assert told["xs"][:-1, 19:] == pytest.approx(motion.v[:-1])
    assert not told["xs"][[0, -1], 19:].any(), "at rest at both ends"
    assert (told["contacts"] == motion.contacts).all()


def test_torques_alone_make_the_plans_motion_where_feet_are_held(told: Any) -> None:
    """The equations that Crocoddyl solves at a node, here with Pinocchio's terms."""
    import pinocchio as pin

    model = pin.buildModelFromXML(str(told["urdf"]), pin.JointModelFreeFlyer())
    model.armature = told["armature"]
    data = model.createData()
    world = pin.LOCAL_WORLD_ALIGNED
    for k in range(0, len(told["us"]), 7):
        q, v = told["xs"][k][:19], told["xs"][k][19:]
        feet = [model.getFrameId(str(n)) for n in told["foot_frames"][told["contacts"][k]]]
        pin.forwardKinematics(model, data, q, v, 0.0 * v)
        pin.updateFramePlacements(model, data)
        drift = [pin.getFrameClassicalAcceleration(model, data, f, world).linear for f in feet]
        jacobian = np.vstack([pin.computeFrameJacobian(model, data, q, f, world)[:3]
                              for f in feet])  # fmt: skip
        mass = pin.crba(model, data, q)
        mass = np.triu(mass) + np.triu(mass, 1).T
        pushed = np.concatenate([np.zeros(6), told["us"][k]]) - pin.nle(model, data, q, v)
        size = len(jacobian)
        matrix = np.block([[mass, jacobian.T], [jacobian, np.zeros((size, size))]])
        found = np.linalg.solve(matrix, np.concatenate([pushed, -np.concatenate(drift)]))
        assert found[:18] == pytest.approx(told["accelerations"][k], abs=1e-4)
        planned = told["contact_forces"][k][told["contacts"][k]]
        assert -found[18:].reshape(-1, 3) == pytest.approx(planned, abs=1e-4)


SCRIPT = """
import json, sys
import numpy as np, crocoddyl, pinocchio as pin
arm = pin.buildSampleModelManipulator()
state = crocoddyl.StateMultibody(arm)
free = crocoddyl.DifferentialActionModelFreeFwdDynamics(
    state, crocoddyl.ActuationModelFull(state), crocoddyl.CostModelSum(state))
at, x, u = free.createData(), state.rand(), np.ones(arm.nv)
free.calc(at, x, u)
if np.abs(at.xout - pin.aba(arm, arm.createData(), x[:arm.nq], x[arm.nq:], u)).max() > 1e-8:
    sys.exit(3)
told = np.load(sys.argv[1])
model = pin.buildModelFromXML(str(told["urdf"]), pin.JointModelFreeFlyer())
model.armature = told["armature"]
state = crocoddyl.StateMultibody(model)
actuation = crocoddyl.ActuationModelFloatingBase(state)
kept, nodes = [], []
for standing, feet in zip(told["contacts"], told["foot_positions"]):
    contacts = crocoddyl.ContactModelMultiple(state, actuation.nu)
    for name, place, stands in zip(told["foot_frames"], feet, standing):
        if stands:
            held = crocoddyl.ContactModel3D(state, model.getFrameId(str(name)), place,
                                            pin.LOCAL_WORLD_ALIGNED, actuation.nu, np.zeros(2))
            contacts.addContact(str(name), held)
            kept.append(held)
    costs = crocoddyl.CostModelSum(state, actuation.nu)
    dynamics = crocoddyl.DifferentialActionModelContactFwdDynamics(
        state, actuation, contacts, costs, 0.0, True)
    nodes.append(crocoddyl.IntegratedActionModelEuler(dynamics, float(told["dt"])))
    kept += [contacts, costs, dynamics]
shooting = crocoddyl.ShootingProblem(told["xs"][0], nodes[:-1], nodes[-1])
xs, us = list(told["xs"]), list(told["us"])
shooting.calc(xs, us)
off = [float(np.abs(d.differential.xout - a).max())
       for d, a in zip(shooting.runningDatas, told["accelerations"])]
gaps = [float(np.abs(state.diff(d.xnext, x)).max()) for d, x in zip(shooting.runningDatas, xs[1:])]
print(json.dumps({"accelerations": max(off), "gap": float(np.median(gaps)), "nodes": len(off)}))
"""
"""In a process of its own: a Crocoddyl that was built for another Pinocchio crashes, or computes
nonsense (3.2.1 needs pin 4.0.0; with 4.1.0 it does both)."""


def test_crocoddyl_builds_the_problem_and_gets_the_plans_accelerations(
    a1_walk: Plan, tmp_path: Path
) -> None:
    if importlib.util.find_spec("crocoddyl") is None:
        pytest.skip("needs Crocoddyl, and the Pinocchio that it was built for")
    gaitopt.export(a1_walk, tmp_path / "guess.npz", "crocoddyl", dt=0.01)
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(tmp_path / "guess.npz")],
        capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    if done.returncode == 3 or done.returncode < 0:
        pytest.skip("this Crocoddyl was built for another Pinocchio")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["accelerations"] < 1e-3 and found["nodes"] > 50
    # From node to node Euler's step is off by half the change of the acceleration.
    assert found["gap"] < 0.5


def test_without_torques_it_says_so(short_plan: Plan, tmp_path: Path) -> None:
    done = gaitopt.export(short_plan, tmp_path / "a.npz", "crocoddyl", dt=0.5)
    assert "us" not in np.load(tmp_path / "a.npz").files and "no us" in done.notes[-1]
    with pytest.raises(InputError, match="model's own joints"):
        gaitopt.export(short_plan, tmp_path / "a.npz", "crocoddyl", prefix="x")
