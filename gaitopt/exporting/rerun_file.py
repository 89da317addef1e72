"""Recordings for the viewer of rerun: the robot walks in 3D beside curves of its joints.

The robot is drawn with the shapes of its URDF; meshes are not read, and lines stand for them
(:func:`gaitopt.robots.collisions.shapes.robot_shapes`).
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any, Final

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS, FloatArray
from gaitopt.errors import MissingPackageError
from gaitopt.exporting.format import Format
from gaitopt.exporting.links import link_motion, moving_links
from gaitopt.exporting.sampled import Exported, Samples, Source
from gaitopt.files import written_whole
from gaitopt.plan.com_margin import true_com
from gaitopt.robots.collisions.shapes import robot_shapes
from gaitopt.terrain.height_map import HeightMap

STEP: Final = 0.02
"""Default time between frames [s]: as often as films show pictures, and more."""
TIMELINE: Final = "plan"
ARROW: Final = 0.5
"""Length of the arrow of a force as large as the robot's weight [m]."""
LINE: Final = 0.004
"""Radius of drawn lines [m]."""
GREY, GREEN, BLUE, RED = (150, 155, 160), (60, 160, 80), (40, 110, 220), (220, 80, 40)


def write_rerun(source: Source, path: Path, dt: float | None = None) -> Exported:
    """Write a recording (``.rrd``) with the timeline ``plan``.

    Args:
        source: what is exported.
        path: the file.
        dt: time between frames [s]; 0.02 by default.

    Raises:
        MissingPackageError: rerun is not installed.
    """
    try:
        import rerun
    except ImportError as error:
        raise MissingPackageError(
            "recordings for rerun need the package rerun-sdk: pip install 'gaitopt[rerun]'"
        ) from error
    samples = source.samples(STEP if dt is None else dt)
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "plan.rrd"
        recording = rerun.RecordingStream("gaitopt")
        recording.save(whole)
        recording.log("/", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        for part in (_robot, _ground, _paths, _balance, _forces, _curves):
            part(rerun, recording, samples)
        recording.flush()
        recording.disconnect()
        with written_whole(path, binary=True) as stream:
            stream.write(whole.read_bytes())
    return Exported((path,), {"frames": float(len(samples))})


def _times(rerun: Any, samples: Samples) -> list[Any]:
    return [rerun.TimeColumn(TIMELINE, duration=samples.times)]


def _entity(rerun: Any, *parts: str) -> str:
    """A path of parts, each of which may hold any character."""
    return str(rerun.new_entity_path(list(parts)))


def _robot(rerun: Any, recording: Any, samples: Samples) -> None:
    """The links with their shapes, where they are at each time."""
    robot = samples.source.plan.robot
    count = len(robot.joint_names) + 1
    links = link_motion(samples, moving_links(robot)[:count])
    for k, name in enumerate(links.names):
        recording.send_columns(
            _entity(rerun, "robot", name), indexes=_times(rerun, samples),
            columns=rerun.Transform3D.columns(
                translation=links.positions[:, k],
                quaternion=np.roll(links.quaternions[:, k], -1, axis=1),
            ),
        )  # fmt: skip
    for i, shape in enumerate(robot_shapes(robot).geometry.geometryObjects):
        name = links.names[int(shape.parentJoint) - 1]
        drawn = _shape(rerun, shape)
        if drawn is not None:
            recording.log(_entity(rerun, "robot", name, f"shape {i}"), drawn, static=True)


def _shape(rerun: Any, shape: Any) -> Any:
    """A shape of Pinocchio's for the viewer; ``None`` where it has none for it."""
    import pinocchio as pin

    place = shape.placement.translation
    turn = pin.Quaternion(shape.placement.rotation).coeffs()
    geometry, kind = shape.geometry, type(shape.geometry).__name__
    common = {"quaternions": [turn], "colors": [GREY], "fill_mode": "solid"}
    if kind == "Box":
        return rerun.Boxes3D(half_sizes=[geometry.halfSide], centers=[place], **common)
    if kind == "Sphere":
        return rerun.Ellipsoids3D(half_sizes=[[geometry.radius] * 3], centers=[place], **common)
    if kind in ("Capsule", "Cylinder"):
        # The viewer's capsules begin at their origin, Pinocchio's have it in their middle.
        begin = place - shape.placement.rotation[:, 2] * geometry.halfLength
        return rerun.Capsules3D(
            lengths=[2.0 * geometry.halfLength], radii=[geometry.radius], translations=[begin],
            **common,
        )  # fmt: skip
    return None


def _ground(rerun: Any, recording: Any, samples: Samples) -> None:
    """The height map and the footholds."""
    plan = samples.source.plan
    if plan.footholds.ground is not None:
        points, triangles = _triangles(plan.footholds.ground)
        mesh = rerun.Mesh3D(vertex_positions=points, triangle_indices=triangles,
                            albedo_factor=[*GREY, 255])  # fmt: skip
        recording.log("ground", mesh, static=True)
    for leg in LEGS:
        below = plan.footholds[leg] - [0.0, 0.0, plan.robot.foot_radius]
        points = rerun.Points3D(below, radii=2.5 * LINE, colors=[GREEN])
        recording.log(f"footholds/{leg}", points, static=True)


def _triangles(ground: HeightMap) -> tuple[FloatArray, np.ndarray]:
    """Points of the grid ``(P, 3)`` and the triangles between known ones ``(T, 3)``."""
    rows, columns = ground.z.shape
    x = ground.origin[0] + ground.resolution * np.arange(rows)
    y = ground.origin[1] + ground.resolution * np.arange(columns)
    places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    points = np.column_stack([places, ground.z.ravel()])
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b = index[:-1, :-1].ravel(), index[1:, :-1].ravel()
    c, d = index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    known = np.isfinite(points[:, 2])
    return np.nan_to_num(points), triangles[known[triangles].all(axis=1)]


def _paths(rerun: Any, recording: Any, samples: Samples) -> None:
    """Where the body's centre and the feet go."""
    motion = samples.motion
    lines = {"paths/body": motion.cog} | {
        f"paths/{leg}": motion.feet[:, i] for i, leg in enumerate(LEGS)
    }
    for name, points in lines.items():
        strip = rerun.LineStrips3D([points], radii=0.5 * LINE, colors=[BLUE])
        recording.log(name, strip, static=True)


def _balance(rerun: Any, recording: Any, samples: Samples) -> None:
    """Support polygon and centre of mass."""
    robot = samples.source.plan.robot
    masses = true_com(robot, samples.vectors.q) if robot.mass > 0.0 else samples.motion.cog
    recording.send_columns("balance/com", indexes=_times(rerun, samples),
                           columns=rerun.Points3D.columns(positions=masses))  # fmt: skip
    recording.log("balance/com", rerun.Points3D.from_fields(radii=3 * LINE, colors=[RED]),
                  static=True)  # fmt: skip
    before = None
    for time, feet, stands in zip(samples.times, samples.motion.feet, samples.motion.contacts,
                                  strict=True):  # fmt: skip
        if before is None or (stands != before).any():
            around = feet[stands] - [0.0, 0.0, robot.foot_radius]
            recording.set_time(TIMELINE, duration=float(time))
            strip = rerun.LineStrips3D([[*around, *around[:1]]], radii=LINE, colors=[BLUE])
            recording.log("balance/support", strip)
        before = stands
    recording.reset_time()


def _forces(rerun: Any, recording: Any, samples: Samples) -> None:
    """Contact forces as arrows at the feet."""
    if samples.forces is None:
        return
    scale = ARROW / (samples.source.plan.robot.mass * GRAVITY)
    for i, leg in enumerate(LEGS):
        recording.send_columns(
            f"forces/{leg}", indexes=_times(rerun, samples),
            columns=rerun.Arrows3D.columns(
                vectors=scale * samples.forces.forces[:, i], origins=samples.motion.feet[:, i]
            ),
        )  # fmt: skip


def _curves(rerun: Any, recording: Any, samples: Samples) -> None:
    """Joints and contacts over time."""
    torques = samples.torques
    tables = {"position": samples.positions, "velocity": samples.velocities}
    if torques is not None:
        tables["torque"] = torques
    curves = {
        ("joints", what, name): table[:, k]
        for what, table in tables.items()
        for k, name in enumerate(samples.source.order.names)
    } | {
        ("contacts", leg): samples.motion.contacts[:, i].astype(float) for i, leg in enumerate(LEGS)
    }
    for parts, values in curves.items():
        recording.send_columns(
            _entity(rerun, *parts), indexes=_times(rerun, samples),
            columns=rerun.Scalars.columns(scalars=values),
        )  # fmt: skip


FORMAT = Format(
    name="rerun",
    summary="a recording for the viewer of rerun",
    suffixes=(".rrd",),
    write=write_rerun,
)
