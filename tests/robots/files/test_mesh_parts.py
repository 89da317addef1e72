"""Meshes of trunks in convex parts: nothing of the surface is lost, and hollows are free."""

from __future__ import annotations

import dataclasses
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from robot_texts import collision, robot
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

import gaitopt
from gaitopt.certificate.collisions.self_collision import self_collision
from gaitopt.conventions import FloatArray
from gaitopt.motion.path import MotionPath
from gaitopt.plan.plan import Plan
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.collisions.pairs import CollisionPairs
from gaitopt.robots.files.mesh_parts import MOST_PARTS, WORTH, cut_in_parts
from gaitopt.robots.quadruped import Quadruped

HOLLOW, HIT = (1.5, -2.6), (-0.5, -2.6)
"""Angles of hip and knee of the LF leg: its shank lies beside the thin bar, or in a plate [rad]."""


def solid(boxes: list[tuple[list[float], list[float]]]) -> trimesh.Trimesh:
    """Boxes by extents and middles, as one mesh."""
    corners, faces = [], []
    for number, (extents, middle) in enumerate(boxes):
        box = trimesh.creation.box(extents=extents)
        corners.append(np.asarray(box.vertices) + middle)
        faces.append(np.asarray(box.faces) + 8 * number)
    return trimesh.Trimesh(np.concatenate(corners), np.concatenate(faces), process=False)


def dumbbell(half: float = 250.0) -> trimesh.Trimesh:
    """A thin bar with wide plates at both ends, along x [mm]."""
    return solid([
        ([600, 40, 40], [0, 0, 0]),
        ([60, 2 * half, 200], [-330, 0, 0]),
        ([60, 2 * half, 200], [330, 0, 0]),
    ])  # fmt: skip


def u_shape() -> trimesh.Trimesh:
    """A U: a bar along x with two posts up at its ends [mm]."""
    return solid([
        ([500, 100, 40], [0, 0, 0]), ([40, 100, 400], [-230, 0, 220]),
        ([40, 100, 400], [230, 0, 220]),
    ])  # fmt: skip


def parts_of(mesh: trimesh.Trimesh) -> tuple[FloatArray, ...]:
    corners = np.asarray(mesh.vertices)
    return cut_in_parts(np.asarray(mesh.triangles), corners[ConvexHull(corners).vertices])


def turned(mesh: trimesh.Trimesh, seed: int) -> trimesh.Trimesh:
    """Turned by 0.2 rad, with the corners of some triangles in the wrong order."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    turn = Rotation.from_rotvec(0.2 * axis / np.linalg.norm(axis))
    faces = np.asarray(mesh.faces)
    wrong = rng.random(len(faces)) < 0.3
    faces = np.where(wrong[:, None], faces[:, ::-1], faces)
    return trimesh.Trimesh(turn.apply(np.asarray(mesh.vertices)), faces, process=False)


@pytest.mark.parametrize("seed", [None, 0, 1, 2])
@pytest.mark.parametrize("make", [dumbbell, u_shape])
def test_all_points_of_the_surface_are_in_a_part(
    make: Callable[[], trimesh.Trimesh], seed: int | None
) -> None:
    mesh = make() if seed is None else turned(make(), seed)
    parts = parts_of(mesh)
    assert len(parts) > 1
    share = np.random.default_rng(5).dirichlet([0.5, 0.5, 0.5], size=40)
    points = np.einsum("sc,tcx->tsx", share, np.asarray(mesh.triangles)).reshape(-1, 3)
    beyond = [
        (points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        for hull in map(ConvexHull, parts)
    ]
    assert np.min(beyond, axis=0).max() <= 1e-9 * 600.0


@pytest.mark.parametrize("place", [-360.0, -300.0, 300.0, 360.0])
@pytest.mark.parametrize("order", [(0, 1, 2), (0, 2, 1)])
def test_sheets_in_planes_of_cuts_are_in_a_part(place: float, order: tuple[int, ...]) -> None:
    """A triangle that shares no corner with the plates, and stands out beyond them."""
    body = dumbbell()
    sheet = np.array([[place, 0.0, 0.0], [place, 0.0, 150.0], [place, 50.0, 150.0]])
    corners = np.concatenate([np.asarray(body.vertices), sheet])
    faces = np.concatenate([np.asarray(body.faces), [np.array(order) + len(body.vertices)]])
    parts = parts_of(trimesh.Trimesh(corners, faces, process=False))
    assert len(parts) > 1
    beyond = [
        (sheet @ hull.equations[:, :3].T + hull.equations[:, 3]).max()
        for hull in map(ConvexHull, parts)
    ]
    assert min(beyond) <= 1e-6


def test_parts_of_a_dumbbell_are_its_boxes() -> None:
    parts = parts_of(dumbbell())
    assert 2 < len(parts) <= MOST_PARTS
    volume = sum(ConvexHull(part).volume for part in parts)
    assert volume == pytest.approx(600 * 40 * 40 + 2 * 60 * 500 * 200, rel=1e-9)


def test_a_u_is_cut_into_three() -> None:
    parts = parts_of(u_shape())
    assert len(parts) == 3
    assert sum(ConvexHull(part).volume for part in parts) == pytest.approx(
        420 * 100 * 40 + 2 * 40 * 100 * 440, rel=1e-9
    )


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.box(extents=[500, 200, 100]),
        trimesh.creation.icosphere(subdivisions=2, radius=100.0),
        solid([([500, 200, 100], [0, 0, 0]), ([100, 100, 60], [0, 0, 80])]),
    ],
)
def test_meshes_whose_hulls_fit_keep_one(mesh: trimesh.Trimesh) -> None:
    (hull,) = parts_of(mesh)
    assert ConvexHull(hull).volume == pytest.approx(mesh.convex_hull.volume)
    assert mesh.volume > WORTH * mesh.convex_hull.volume


def test_flat_slabs_are_joined_with_others() -> None:
    """Plates that a sheet without thickness joins: no part is flat."""
    sheet = np.array([[-300, -20, 0], [300, -20, 0], [300, 20, 0], [-300, 20, 0]], dtype=float)
    plates = solid([([60, 500, 200], [-330, 0, 0]), ([60, 500, 200], [330, 0, 0])])
    corners = np.concatenate([np.asarray(plates.vertices), sheet])
    faces = np.concatenate([np.asarray(plates.faces), [[16, 17, 18], [16, 18, 19]]])
    parts = parts_of(trimesh.Trimesh(corners, faces, process=False))
    assert len(parts) > 1
    assert all(ConvexHull(part).volume > 0.0 for part in parts)


def walker(folder: Path, trunk: trimesh.Trimesh) -> Quadruped:
    """A robot with a mesh for a trunk, in millimetres."""
    folder.mkdir()
    trunk.export(folder / "trunk.stl")
    mesh = collision('<mesh filename="trunk.stl" scale="0.001 0.001 0.001"/>')
    text = robot(shank=collision('<box size="0.03 0.04 0.2"/>', "0 0 -0.1"))
    named = '<link name="base">'
    assert named in text
    (folder / "walker.urdf").write_text(text.replace(named, named + mesh))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gaitopt.RobotWarning)
        return load_robot(folder / "walker.urdf")


@pytest.fixture(scope="module")
def walkers(tmp_path_factory: pytest.TempPathFactory) -> tuple[Quadruped, Quadruped]:
    """Robots whose trunks are a dumbbell, and the hull of one; legs stand between the plates."""
    folder = tmp_path_factory.mktemp("walkers")
    return walker(folder / "parts", dumbbell()), walker(folder / "one", dumbbell().convex_hull)


def moved(made: Quadruped, short_plan: Plan, angles: tuple[float, float]) -> Plan:
    """A plan in which the LF leg turns from where it stands to other angles."""
    joints = np.zeros((2, 12))
    joints[:, made.leg_joint_columns] = np.tile([0.0, 0.9, -1.5], 4)
    joints[1, made.leg_columns["LF"][1:]] = angles
    values = np.hstack([np.tile([0.0, 0.0, 0.4, 0.0, 0.0, 0.0], (2, 1)), joints])
    path = MotionPath.polyline([0.0, 1.0], values)
    return dataclasses.replace(short_plan, robot=made, path=path)


@pytest.mark.parametrize(("angles", "verdicts"), [(HOLLOW, ("ok", "violated")),
                                                  (HIT, ("violated", "violated"))])  # fmt: skip
def test_legs_may_be_in_hollows_and_not_in_the_trunk(
    walkers: tuple[Quadruped, Quadruped], short_plan: Plan, angles: tuple[float, float],
    verdicts: tuple[str, str],
) -> None:  # fmt: skip
    checks = [self_collision(moved(made, short_plan, angles)) for made in walkers]
    assert tuple(check.status for check in checks) == verdicts
    assert "those of base in 3 parts" in checks[0].about
    assert checks[1].about.count("parts") == 0


def test_planners_see_the_same_parts(walkers: tuple[Quadruped, Quadruped]) -> None:
    """Their shapes are apart by as much as the boxes are by hand."""
    made = walkers[0]
    assert [link for link, _ in made.notes.hulls] == ["base"] * 3
    pairs = CollisionPairs.of(made)
    assert pairs is not None
    joints = np.tile([0.0, 0.9, -1.5], 4)
    joints[:3] = [0.0, *HOLLOW]
    bar = [k for k, pair in enumerate(pairs.geometry.collisionPairs)
           if "base (hull 1)" in {str(pairs.geometry.geometryObjects[n].name)
                                  for n in (pair.first, pair.second)}]  # fmt: skip
    # The shank's box reaches 20 mm inwards from y = 140 mm, and the bar 20 mm outwards.
    assert pairs.distances(joints[None], bar).min() == pytest.approx(0.1, abs=1e-4)


def test_parts_go_with_the_plan(walkers: tuple[Quadruped, Quadruped], short_plan: Plan) -> None:
    again = Quadruped.from_urdf(walkers[0].urdf)
    assert again.notes.hulls == walkers[0].notes.hulls
    assert "in 3 parts" in self_collision(moved(again, short_plan, HOLLOW)).about


def test_legs_keep_one_hull(tmp_path: Path) -> None:
    """Only trunks are cut."""
    dumbbell().export(tmp_path / "shank.stl")
    mesh = collision('<mesh filename="shank.stl" scale="0.0001 0.0001 0.0001"/>', "0 0 -0.1")
    (tmp_path / "legs.urdf").write_text(robot(shank=mesh))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gaitopt.RobotWarning)
        made = load_robot(tmp_path / "legs.urdf")
    assert len(made.notes.hulls) == 4
