"""Recordings for rerun, read back with its reader."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from ground_walks import bumpy_walk

import gaitopt
from gaitopt import LEGS, Plan

chunk = pytest.importorskip("rerun.chunk", reason="needs pip install 'gaitopt[rerun]' (700 MB)")


def tables(path: Path) -> dict[tuple[str, str], tuple[np.ndarray | None, Any]]:
    """Times and values by entity and component."""
    found: dict[tuple[str, str], tuple[np.ndarray | None, Any]] = {}
    for part in chunk.RrdReader(str(path)).stream().to_chunks():
        batch = part.to_record_batch()
        names = batch.schema.names
        times = None
        if "plan" in names:
            times = np.array(batch.column("plan").cast("int64")) * 1e-9
        for name in names:
            if ":" in name:
                key = (str(part.entity_path), name)
                found[key] = (times, batch.column(name).to_pylist())
    return found


@pytest.fixture(scope="module")
def told(a1_walk: Plan, tmp_path_factory: pytest.TempPathFactory) -> Any:
    path = tmp_path_factory.mktemp("rerun") / "walk.rrd"
    gaitopt.export(a1_walk, path)
    return tables(path)


def test_links_are_where_the_plan_has_them(a1_walk: Plan, told: Any) -> None:
    import pinocchio as pin

    times, places = told["/robot/FL_calf", "Transform3D:translation"]
    _, turns = told["/robot/FL_calf", "Transform3D:quaternion"]
    model = a1_walk.robot.model
    data = model.createData()
    for row in (0, 20, len(times) - 1):
        q = a1_walk.at([min(times[row], a1_walk.duration)]).q[0]
        pin.framesForwardKinematics(model, data, q)
        pose = data.oMf[model.getFrameId("FL_calf")]
        assert places[row][0] == pytest.approx(pose.translation, abs=1e-6)
        found = pin.Quaternion(np.array(turns[row][0])).matrix()
        assert found == pytest.approx(pose.rotation, abs=1e-6)


def test_curves_and_forces_are_the_plans(a1_walk: Plan, told: Any) -> None:
    times, angles = told["/joints/position/FL_calf_joint", "Scalars:scalars"]
    motion = a1_walk.at(np.minimum(times, a1_walk.duration))
    column = 7 + list(motion.joint_names).index("FL_calf_joint")
    assert np.ravel(angles) == pytest.approx(motion.q[:, column])
    contacts = np.ravel(told["/contacts/LF", "Scalars:scalars"][1])
    assert (contacts == motion.contacts[:, 0]).all()
    arrows = np.array([told[f"/forces/{leg}", "Arrows3D:vectors"][1] for leg in LEGS])[:, :, 0]
    # Together the arrows are as long as stated where the robot only stands: at its end.
    assert arrows.sum(axis=0)[-1] == pytest.approx([0.0, 0.0, 0.5], abs=1e-4)


def test_the_robot_has_shapes_and_the_ground_its_surface(told: Any, tmp_path: Path) -> None:
    shapes = {entity.split("/")[2] for entity, _ in told if "shape" in entity}
    assert len(shapes) == 13, "the base and twelve links"
    plan = bumpy_walk()
    ground = plan.footholds.ground
    assert ground is not None
    gaitopt.export(plan, tmp_path / "walk.rrd", dt=1.0)
    found = tables(tmp_path / "walk.rrd")
    points = np.array(found["/ground", "Mesh3D:vertex_positions"][1][0])
    triangles = np.array(found["/ground", "Mesh3D:triangle_indices"][1][0])
    middles = points[triangles].mean(axis=1)
    assert middles[:, 2] == pytest.approx(ground.height(middles[:, :2]), abs=1e-6)
    rows, columns = ground.z.shape
    assert len(triangles) < 2 * (rows - 1) * (columns - 1), "nothing where heights are unknown"
