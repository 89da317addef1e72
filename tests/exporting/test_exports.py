"""Plans as tables and as joint trajectories."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import yaml

import gaitopt
from gaitopt import InputError, Plan
from gaitopt.terrain.columns import s_columns


def test_the_table_holds_the_samples(short_plan: Plan, tmp_path: Path) -> None:
    gaitopt.export_csv(short_plan, tmp_path / "motion.csv", dt=0.05)
    with (tmp_path / "motion.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    motion = short_plan.sample(0.05)
    assert len(rows) == len(motion)

    def column(name: str) -> np.ndarray:
        return np.array([float(row[name]) for row in rows])

    assert column("t") == pytest.approx(motion.t, abs=1e-9)
    assert column("base_z") == pytest.approx(motion.q[:, 2], abs=1e-9)
    assert column("base_qw") == pytest.approx(motion.q[:, 6], abs=1e-9)
    for i, joint in enumerate(motion.joint_names):
        assert column(joint) == pytest.approx(motion.q[:, 7 + i], abs=1e-9)
        assert column(f"{joint}_velocity") == pytest.approx(motion.v[:, 6 + i], abs=1e-9)
    for i, leg in enumerate(motion.legs):
        assert (column(f"{leg}_contact") == motion.contacts[:, i]).all()
        assert column(f"{leg}_y") == pytest.approx(motion.feet[:, i, 1], abs=1e-9)
    assert column("cog_x") == pytest.approx(motion.cog[:, 0], abs=1e-9)


def test_the_short_way_to_ros_obeys_the_same_rules(short_plan: Plan, tmp_path: Path) -> None:
    gaitopt.export_ros(short_plan, tmp_path / "walk.yaml", dt=0.05)
    gaitopt.export(short_plan, tmp_path / "same.yml", dt=0.05)
    text = (tmp_path / "walk.yaml").read_text()
    assert text == (tmp_path / "same.yml").read_text()
    points = yaml.load(text, getattr(yaml, "CSafeLoader", yaml.SafeLoader))["points"]
    assert not np.any([points[0]["velocities"], points[-1]["velocities"]])
    stamps = [p["time_from_start"] for p in points]
    times = np.array([s["sec"] + s["nanosec"] * 1e-9 for s in stamps])
    assert np.diff(times).min() > 0.0 and np.diff(times).max() <= 0.05 + 1e-9


@pytest.mark.parametrize("export", [gaitopt.export_csv, gaitopt.export_ros])
def test_a_bad_request_leaves_nothing(short_plan: Plan, tmp_path: Path, export) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match="dt must be"):
        export(short_plan, tmp_path / "out", dt=-1.0)
    with pytest.raises(InputError, match="cannot write"):
        export(short_plan, tmp_path / "none" / "out")
    assert not list(tmp_path.iterdir())


def test_by_default_a_table_has_the_knots_and_nothing_is_lost(tmp_path: Path) -> None:
    """A fast robot's whole walk lasts seconds: samples at a fixed rate would cut its corners."""
    robot = gaitopt.load_robot("a1")
    plan = gaitopt.plan_crawl(
        robot,
        s_columns(0, columns=3, robot=robot),
        body_height=robot.standing_height,
        swing_height=0.04,
        timing="velocity",
    )
    gaitopt.export_csv(plan, tmp_path / "walk.csv")
    assert len((tmp_path / "walk.csv").read_text().splitlines()) == len(plan.path.times) + 1
