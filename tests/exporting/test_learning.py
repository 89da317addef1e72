"""Reference motions for learning, and data frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import gaitopt
from gaitopt import Plan

FIELDS = {
    "dof_positions": (12,), "dof_velocities": (12,), "body_positions": (17, 3),
    "body_rotations": (17, 4), "body_linear_velocities": (17, 3),
    "body_angular_velocities": (17, 3),
}  # fmt: skip
"""What Isaac Lab's motion loader reads, beside fps, dof_names and body_names: for a1 a base, twelve
links and four feet."""


@pytest.fixture(scope="module")
def written(a1_walk: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("learning")
    gaitopt.export(a1_walk, folder / "fine.npz", "learning", dt=0.002)
    gaitopt.export(a1_walk, folder / "walk.npz", "learning")
    return folder


def test_a_motion_loader_finds_what_it_reads(a1_walk: Plan, written: Path) -> None:
    told = np.load(written / "walk.npz")
    frames = len(told["time"])
    assert 1.0 / told["fps"] == pytest.approx(0.02)
    assert (frames - 1) * 0.02 >= a1_walk.duration
    for name, shape in FIELDS.items():
        assert told[name].shape == (frames, *shape), name
    assert told["dof_names"].tolist() == list(a1_walk.robot.joint_names)
    assert {"FL_foot", "RR_foot"} <= set(told["body_names"].tolist())
    assert np.linalg.norm(told["body_rotations"], axis=-1) == pytest.approx(1.0)


def test_velocities_are_the_derivatives_of_places(written: Path) -> None:
    told = np.load(written / "fine.npz")
    step = 0.002
    inner = slice(5, -10)

    def close(rates: np.ndarray, places: np.ndarray, scale: float) -> None:
        found = (places[2:] - places[:-2]) / (2 * step)
        # Accelerations jump in a plan by forces: differences see them a little late.
        assert np.abs(found - rates[1:-1])[inner].mean() < 0.01 * scale

    close(told["dof_velocities"], told["dof_positions"], 10.0)
    close(told["body_linear_velocities"], told["body_positions"], 1.0)
    for k in range(told["body_names"].size):
        turned = Rotation.from_quat(np.roll(told["body_rotations"][:, k], -1, axis=1))
        rates = (turned[2:] * turned[:-2].inv()).as_rotvec() / (2 * step)
        told_rates = told["body_angular_velocities"][1:-1, k]
        assert np.abs(rates - told_rates)[inner].mean() < 0.1


def test_feet_that_stand_do_not_move_and_carry_the_robot(a1_walk: Plan, written: Path) -> None:
    told = np.load(written / "fine.npz")
    names = told["body_names"].tolist()
    for i, leg in enumerate(told["foot_names"].tolist()):
        foot = names.index(a1_walk.robot.legs[leg].foot)
        assert told["body_positions"][:, foot] == pytest.approx(told["foot_positions"][:, i])
        speed = np.linalg.norm(told["body_linear_velocities"][:, foot], axis=1)
        standing = told["contacts"][:, i]
        assert speed[standing].max() < 1e-6
        assert speed[~standing].max() > 0.1
        assert not told["contact_forces"][~standing, i].any()
    assert told["contact_forces"][..., 2].sum(axis=1).mean() == pytest.approx(
        9.81 * a1_walk.robot.mass, rel=0.02
    )
    assert not told["root_linear_velocity"][[0, -1]].any()
    # After the end the robot stands: the ground carries its weight, and no more.
    weight = np.array([0.0, 0.0, 9.81 * a1_walk.robot.mass])
    assert told["contact_forces"][-1].sum(axis=0) == pytest.approx(weight, abs=1e-3)


def test_hdf5_holds_the_same_with_units(a1_walk: Plan, written: Path, tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py", reason="needs pip install 'gaitopt[learning]'")
    gaitopt.export(a1_walk, tmp_path / "walk.h5")
    told = np.load(written / "walk.npz")
    with h5py.File(tmp_path / "walk.h5") as file:
        assert set(file) == set(told.files)
        for name in told.files:
            value = file[name].asstr()[()] if told[name].dtype.kind == "U" else file[name][()]
            assert (np.asarray(value) == told[name]).all(), name
        assert file["torques"].attrs["unit"] == "N m"


def test_without_promised_forces_there_are_none(short_plan: Plan, tmp_path: Path) -> None:
    gaitopt.export(short_plan, tmp_path / "a.npz", "learning", dt=0.5)
    assert "torques" not in np.load(tmp_path / "a.npz").files


def test_a_data_frame_has_the_columns_of_the_table(a1_walk: Plan, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas", reason="needs pip install 'gaitopt[learning]'")
    frame = a1_walk.to_dataframe(0.05)
    gaitopt.export_csv(a1_walk, tmp_path / "a.csv", dt=0.05)
    read = pandas.read_csv(tmp_path / "a.csv", index_col="t")
    assert list(frame.columns) == list(read.columns)
    assert frame.to_numpy(float) == pytest.approx(read.to_numpy(float), abs=1e-9)
    assert frame["LF_contact"].dtype == bool
    assert frame.index[-1] == a1_walk.duration
