"""Low-level commands in the order of Unitree's SDK."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt import InputError, Plan

SDK = [f"{leg}_{k}" for leg in ("FR", "FL", "RR", "RL") for k in range(3)]


def columns(path: Path) -> dict[str, np.ndarray]:
    with path.open(newline="") as stream:
        header = next(csv.reader(stream))
    return dict(zip(header, np.loadtxt(path, delimiter=",", skiprows=1).T, strict=True))


def test_motors_stand_in_the_order_of_the_sdk_at_its_rate(a1_walk: Plan, tmp_path: Path) -> None:
    done = gaitopt.export(a1_walk, tmp_path / "a.csv", "unitree")
    told = columns(tmp_path / "a.csv")
    values = ("q", "dq", "kp", "kd", "tau")
    assert list(told) == ["time", *(f"{m}_{v}" for m in SDK for v in values)]
    assert np.diff(told["time"]) == pytest.approx(0.002, abs=1e-9)
    motion = a1_walk.at(np.minimum(told["time"], a1_walk.duration))
    forces = gaitopt.contact_forces(a1_walk, times=motion.t)
    joints = [str(n) for n in a1_walk.robot.joint_names]
    for motor in SDK:
        # Unitree's URDF calls the three motors hip, thigh and calf.
        joint = f"{motor[:2]}_{('hip', 'thigh', 'calf')[int(motor[-1])]}_joint"
        i = joints.index(joint)
        assert told[f"{motor}_q"] == pytest.approx(motion.q[:, 7 + i], abs=1e-7)
        assert told[f"{motor}_dq"][:-1] == pytest.approx(motion.v[:-1, 6 + i], abs=1e-6)
        assert told[f"{motor}_tau"][:-1] == pytest.approx(forces.torques[:-1, i], abs=1e-6)
        assert (told[f"{motor}_kp"] == told["FR_0_kp"]).all()
        assert told[f"{motor}_dq"][[0, -1]] == pytest.approx(0.0)
    assert told["FR_0_kp"][0] == pytest.approx(done.numbers["kp [N m/rad]"], rel=1e-6)
    # The gains that are stated: half a radian under the weight at the end of a stretched leg.
    reach = np.mean([leg.reach for leg in a1_walk.robot.legs.values()])
    assert 0.5 * told["FR_0_kp"][0] == pytest.approx(a1_walk.robot.mass * 9.81 * reach, rel=1e-6)


def test_gains_and_period_are_the_users_and_torques_are_never_invented(
    short_plan: Plan, tmp_path: Path
) -> None:
    done = gaitopt.export(short_plan, tmp_path / "a.csv", "unitree", dt=0.01, kp=40.0, kd=1.5)
    told = columns(tmp_path / "a.csv")
    assert (told["RL_2_kp"] == 40.0).all() and (told["RL_2_kd"] == 1.5).all()
    assert not any(told[f"{m}_tau"].any() for m in SDK)
    assert "tau is 0" in done.notes[-1]
    # Between two commands no motor is asked for more than it has.
    limits = short_plan.robot.velocity_limits.max()
    for motor in SDK:
        assert np.abs(np.diff(told[f"{motor}_q"]) / 0.01).max() <= limits * (1 + 1e-5)


def test_an_order_of_ones_own_is_refused(a1_walk: Plan, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="own order and names"):
        gaitopt.export(a1_walk, tmp_path / "a.csv", "unitree", prefix="a_")
    with pytest.raises(InputError, match="kp must be a number"):
        gaitopt.export(a1_walk, tmp_path / "a.csv", "unitree", kp=-1.0)
