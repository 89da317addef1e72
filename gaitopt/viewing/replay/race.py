"""Plans that race side by side, on one clock, in one page."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace as changed
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.files import StrPath, written_whole
from gaitopt.plan.plan import Plan
from gaitopt.terrain.footholds import Footholds
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.replay.camera import robot_size, view_sphere
from gaitopt.viewing.replay.ground.ground_scene import FLOOR_BELOW, ground_scene, lowest
from gaitopt.viewing.replay.keyframes import kept_samples, turn_error
from gaitopt.viewing.replay.mesh_files import MeshFolders
from gaitopt.viewing.replay.page import Caption, Label, Page, render
from gaitopt.viewing.replay.replay import in_notebook
from gaitopt.viewing.replay.robot_scene import robot_scene
from gaitopt.viewing.replay.runners import BASELINE, Runner, lane_window, line_up
from gaitopt.viewing.replay.scene import Node, Scene, Track, joined, pose
from gaitopt.viewing.replay.terrain_scene import (
    samples_of,
    swings_scene,
    terrain_scene,
)

PLACE_TOLERANCE, TURN_TOLERANCE = 5e-4, 1e-3
"""Most that keyframes of a race are off, beyond those of a replay [m], [rad]."""


def race_replay(
    plans: Mapping[str, Plan],
    path: StrPath,
    *,
    title: str | None = None,
    baseline: str = BASELINE,
    meshes: MeshFolders = False,
    verdicts: Mapping[str, str] | None = None,
) -> Path:
    """Write plans as one HTML file in which their robots race side by side.

    All start together on one clock, each on its own copy of its terrain. Who has arrived stands
    still, with time and ratio above it; the others count their steps. What moves is within 0.6 mm
    (body) and 1.1 mrad (each joint) of its plan. The address may say where to start:
    ``race.html#t=40&paused&follow``.

    Args:
        plans: by name, from the right side of the walk to its left.
        path: the file, which appears complete or not at all.
        title: heading; the robot's name by default.
        baseline: the plan whose time the others' ratios are of; without such a plan there are
            none.
        meshes: see :func:`gaitopt.replay`.
        verdicts: what certificates say of the plans, by name; written with their times.

    Returns:
        The path of the file.

    Raises:
        InputError: there is no plan, the file cannot be written, or a mesh is missing.
    """
    text = race_html(plans, title=title, baseline=baseline, meshes=meshes, verdicts=verdicts)
    with written_whole(path) as stream:
        stream.write(text)
    return Path(path)


def show_race(
    plans: Mapping[str, Plan],
    height: int = 500,
    *,
    title: str | None = None,
    baseline: str = BASELINE,
    meshes: MeshFolders = False,
    verdicts: Mapping[str, str] | None = None,
) -> Any:
    """The race inside a Jupyter notebook; see :func:`race_replay` and :func:`gaitopt.show`.

    Raises:
        InputError: there is no plan, ``height`` is no positive whole number, or a mesh is missing.
        MissingPackageError: IPython is not installed.
    """
    return in_notebook(
        lambda: race_html(plans, title=title, baseline=baseline, meshes=meshes, verdicts=verdicts),
        height,
    )


def race_html(
    plans: Mapping[str, Plan],
    *,
    title: str | None = None,
    baseline: str = BASELINE,
    meshes: MeshFolders = False,
    verdicts: Mapping[str, str] | None = None,
) -> str:
    """The text of :func:`race_replay`'s file."""
    return render(race_page(plans, title, baseline, meshes, verdicts))


def race_page(
    plans: Mapping[str, Plan],
    title: str | None = None,
    baseline: str = BASELINE,
    meshes: MeshFolders = False,
    verdicts: Mapping[str, str] | None = None,
) -> Page:
    """The race with its heading, legend and finishes."""
    runners = line_up(plans, baseline, verdicts)
    first = max(runners, key=lambda r: -r.plan.duration)
    plan = first.plan
    low, high = _bounds(runners)
    x, y, z = ((low + high) / 2.0).tolist()
    corners = np.stack(np.meshgrid(*np.stack([low, high], axis=1)), axis=-1).reshape(-1, 3)
    return Page(
        scene=race_scene(runners, meshes),
        title=plan.robot.name if title is None else str(title),
        facts=(
            f"{plan.footholds.steps} steps over {plan.distance:.2f} m, {len(runners)} plans",
            *([f"×: times as fast as {baseline}"] if baseline in plans and len(plans) > 1 else []),
        ),
        legend=tuple((leg, LEG_COLOURS[leg]) for leg in LEGS),
        captions=_captions(runners),
        centre=(x, y, z),
        radius=float(np.linalg.norm(high - low)) / 2.0,
        heading=view_sphere(plan)[2],
        follow="/" + "/".join((*first.root, "robot", "base")),
        follow_radius=robot_size(plan),
        labels=tuple(_label(runner) for runner in runners),
        view_from=(1.0, 0.08, 0.66),
        in_view=tuple((float(a), float(b), float(c)) for a, b, c in corners),
    )


def race_scene(runners: tuple[Runner, ...], meshes: MeshFolders = False) -> Scene:
    """All robots on their lanes, and one ground below."""
    return joined([_ground(runners), *(_lane(runner, meshes) for runner in runners)])


def _lane(runner: Runner, meshes: MeshFolders) -> Scene:
    """A robot with its terrain and the ways of its feet, below the lane's frame."""
    plan = runner.plan
    below = _terrain(plan)
    scene = joined([below, swings_scene(plan, samples_of(plan)), robot_scene(plan, meshes)])
    return Scene(
        nodes=(
            Node(runner.root, pose=pose(runner.offset)),
            *(changed(node, path=runner.root + node.path) for node in scene.nodes),
        ),
        tracks=tuple(
            changed(_lighter(track), path=runner.root + track.path) for track in scene.tracks
        ),
        duration=scene.duration,
    )


def _terrain(plan: Plan) -> Scene:
    """What a robot walks on, without the floor under all lanes."""
    window = lane_window(plan)
    if window is None:
        terrain = terrain_scene(plan.footholds, plan.robot.foot_radius)
        return changed(terrain, nodes=tuple(n for n in terrain.nodes if n.path[-1] != "ground"))
    ground = ground_scene(plan, window)
    return changed(ground, nodes=tuple(n for n in ground.nodes if n.path[-1] != "floor"))


def _ground(runners: tuple[Runner, ...]) -> Scene:
    """The floor under all lanes, below the lowest point of their height maps."""
    drop = 0.0
    for runner in runners:
        window = lane_window(runner.plan)
        if window is not None:
            drop = max(drop, FLOOR_BELOW - lowest(window.heights) - float(runner.offset[2]))
    places = [r.plan.footholds.array + r.offset for r in runners]
    # A terrain of all lanes' footholds, of which only the ground is taken.
    every = np.concatenate(places, axis=1)
    terrain = terrain_scene(
        Footholds(dict(zip(LEGS, every, strict=True)), runners[0].plan.footholds.radius),
        runners[0].plan.robot.foot_radius,
    )
    return changed(terrain, nodes=tuple(
        changed(n, pose=pose([0.0, 0.0, -drop])) for n in terrain.nodes if n.path[-1] == "ground"
    ))  # fmt: skip


def _lighter(track: Track) -> Track:
    """A track with fewer keys, still within the tolerances of a race."""
    if track.kind == "visible":
        return track
    values = np.asarray(track.values, dtype=np.float64)
    if track.kind == "position":
        keys = kept_samples(track.times, values, PLACE_TOLERANCE)
    else:
        keys = kept_samples(track.times, values, TURN_TOLERANCE, error=turn_error)
    return changed(track, times=track.times[keys], values=values[keys])


def _bounds(runners: tuple[Runner, ...]) -> tuple[FloatArray, FloatArray]:
    """A box around all lanes with their robots: its lowest and highest corners ``(3,)`` [m]."""
    points = np.concatenate([
        np.concatenate([r.plan.footholds.array.reshape(-1, 3), r.plan.path.knots()[:, :3]])
        + r.offset
        for r in runners
    ])  # fmt: skip
    low, high = points.min(axis=0), points.max(axis=0)
    low[2], high[2] = 0.0, high[2] + max(_lift(r.plan) for r in runners)
    return low, high


def _label(runner: Runner) -> Label:
    plan = runner.plan
    return Label(
        frame="/" + "/".join((*runner.root, "robot", "base")), lift=_lift(plan),
        name=runner.name, colour=runner.colour, landings=tuple(s.end for s in plan.swings),
        result="\n".join(filter(None, [runner.result, runner.verdict])), since=plan.duration,
    )  # fmt: skip


def _lift(plan: Plan) -> float:
    """How far above the base its label floats [m]."""
    return 0.4 * robot_size(plan)


def _captions(runners: tuple[Runner, ...]) -> tuple[Caption, ...]:
    """Who arrives when, with its mark; the bar is coloured by who comes next."""
    order = sorted(runners, key=lambda r: r.plan.duration)
    start = Caption(0.0, "all start together", order[0].colour, "")
    later = [*order[1:], None]
    return (start, *(
        Caption(r.plan.duration, _arrival(r), after.colour if after else "", r.colour)
        for r, after in zip(order, later, strict=True)
    ))  # fmt: skip


def _arrival(runner: Runner) -> str:
    """What is told when a robot arrives."""
    return " · ".join(filter(None, [f"{runner.name} has arrived: {runner.result}", runner.verdict]))
