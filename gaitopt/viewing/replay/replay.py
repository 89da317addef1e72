"""Replays: a plan as one HTML file that plays in any browser, or inside a notebook."""

from __future__ import annotations

import html
from collections.abc import Callable
from dataclasses import replace as changed
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError, MissingPackageError
from gaitopt.files import StrPath, written_whole
from gaitopt.inputs import check_kind
from gaitopt.motion.path import MotionPath
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory
from gaitopt.robots.rotations import quaternion_to_rpy
from gaitopt.viewing.colours import HELD, LEG_COLOURS
from gaitopt.viewing.replay.obstacle_scene import obstacle_scene
from gaitopt.viewing.replay.page import Caption, Page, Switch, render
from gaitopt.viewing.replay.robot_scene import robot_scene
from gaitopt.viewing.replay.scene import Scene, joined
from gaitopt.viewing.replay.standing_scene import STANDING, standing_scene
from gaitopt.viewing.replay.support_scene import INSIDE, support_scene
from gaitopt.viewing.replay.terrain_scene import (
    ground_level,
    samples_of,
    swings_scene,
    terrain_scene,
)

GHOST = 0.25
"""Opacity of the planned robot beside a simulated one."""

SIMULATED_EVERY = 0.05
"""Least time between two samples of a simulated motion that are shown [s]: a page stays small."""


def replay(
    plan: Plan,
    path: StrPath,
    *,
    title: str | None = None,
    meshes: bool | StrPath = False,
    simulated: Trajectory | None = None,
) -> Path:
    """Write a plan as one HTML file that plays in any browser, without a network.

    It shows the robot, the columns, the ways of feet and body, and at each instant the support
    polygon with its inside less the stability margin. Where forces are promised, it shows during
    each swing where they hold the robot's centre of mass, too; a button hides it. What moves is
    within 0.1 mm (body) and 0.1 mrad (each joint) of the plan. The address may say where to start:
    ``walk.html#t=60&paused&speed=5&follow&no-region``.

    Args:
        plan: the motion.
        path: the file, which appears complete or not at all.
        title: heading; the robot's name by default.
        meshes: for robots whose URDF names mesh files. ``False`` draws them as tubes along their
            joints, in about 1 MB. ``True`` embeds example-robot-data's meshes; a folder embeds the
            meshes found in it (up to tens of MB), and leaves out links whose meshes are missing.
        simulated: the same robot's motion in physics, ``gaitopt.simulate(plan).motion``. It is
            shown in full, sampled twenty times a second, and the plan's robot as a ghost.

    Returns:
        The path of the file.

    Raises:
        InputError: the file cannot be written, no mesh is there, or ``simulated`` is another
            robot's motion.
    """
    text = replay_html(plan, title=title, meshes=meshes, simulated=simulated)
    with written_whole(path) as stream:
        stream.write(text)
    return Path(path)


def show(
    plan: Plan,
    height: int = 500,
    *,
    title: str | None = None,
    meshes: bool | StrPath = False,
    simulated: Trajectory | None = None,
) -> Any:
    """The replay inside a Jupyter notebook; see :func:`replay`.

    Args:
        plan: the motion.
        height: of the frame [pixels].
        title, meshes, simulated: as for :func:`replay`.

    Returns:
        An ``IPython.display.HTML``. The replay runs in a frame of its own that can reach neither
        the notebook nor the network.

    Raises:
        InputError: ``height`` is no positive whole number, or a mesh is missing.
        MissingPackageError: IPython is not installed.
    """
    return in_notebook(
        lambda: replay_html(plan, title=title, meshes=meshes, simulated=simulated), height
    )


def in_notebook(page: Callable[[], str], height: int) -> Any:
    """A page in a frame of a Jupyter notebook that can reach neither notebook nor network.

    Args:
        page: makes the page's text.
        height: of the frame [pixels].

    Raises:
        InputError: ``height`` is no positive whole number.
        MissingPackageError: IPython is not installed.
    """
    if isinstance(height, bool) or not 50 <= int(height) <= 10_000:
        raise InputError(f"height must be from 50 to 10000 pixels, got {height!r}")
    try:
        from IPython.display import HTML
    except ImportError as error:
        raise MissingPackageError(
            "show() needs a notebook: pip install 'gaitopt[notebook]'"
        ) from error
    inside = html.escape(page(), quote=True)
    return HTML(  # type: ignore[no-untyped-call]
        f'<div><iframe srcdoc="{inside}" sandbox="allow-scripts" title="gaitopt replay" '
        f'style="width:100%;height:{int(height)}px;border:0"></iframe></div>'
    )


def replay_html(
    plan: Plan,
    *,
    title: str | None = None,
    meshes: bool | StrPath = False,
    simulated: Trajectory | None = None,
) -> str:
    """The text of :func:`replay`'s file."""
    return render(plan_page(plan, title, meshes, simulated))


def plan_scene(
    plan: Plan, meshes: bool | StrPath = False, simulated: Trajectory | None = None
) -> Scene:
    """All that a replay shows, as frames and keyframes."""
    check_kind("plan", plan, Plan)
    samples = samples_of(plan)
    scenes = [
        terrain_scene(plan.footholds, plan.robot.foot_radius),
        obstacle_scene(plan.settings.obstacles),
        swings_scene(plan, samples),
        support_scene(plan, samples),
        standing_scene(plan),
    ]
    if simulated is None:
        return joined([*scenes, robot_scene(plan, meshes)])
    real = robot_scene(simulated_plan(plan, simulated), meshes, ("simulated",))
    return joined([*scenes, _ghost(robot_scene(plan, meshes)), real])


def simulated_plan(plan: Plan, simulated: Trajectory) -> Plan:
    """``plan`` with another motion, so that what draws plans draws it; its phases stay.

    Raises:
        InputError: the motion is another robot's.
    """
    if simulated.joint_names != plan.robot.joint_names:
        raise InputError(
            f"the simulated motion has the joints {', '.join(simulated.joint_names)}, the plan's "
            f"robot has {', '.join(plan.robot.joint_names)}"
        )
    keep = np.unique(np.searchsorted(
        simulated.t, np.append(np.arange(0.0, simulated.t[-1], SIMULATED_EVERY), simulated.t[-1])
    ))  # fmt: skip
    q, times = simulated.q[keep], simulated.t[keep] - simulated.t[0]
    turned = np.unwrap(quaternion_to_rpy(q[:, 3:7]), axis=0)
    values = np.concatenate([q[:, :3], turned, q[:, 7:]], axis=1)
    return changed(plan, path=MotionPath.polyline(times, values))


def plan_page(
    plan: Plan,
    title: str | None = None,
    meshes: bool | StrPath = False,
    simulated: Trajectory | None = None,
) -> Page:
    """A plan's scene with its heading, legend and phases."""
    check_kind("plan", plan, Plan)
    centre, radius, heading = view_sphere(plan)
    facts = [
        f"{plan.footholds.steps} steps in {plan.duration:.1f} s",
        f"mean speed {1e3 * plan.mean_speed:.2f} mm/s",
    ]
    if np.isfinite(plan.margin) or not plan.settings.static:
        facts.append(_balance(plan))
    if simulated is not None:
        facts.append("solid: simulated in physics; ghost: planned")
    scene = plan_scene(plan, meshes, simulated)
    legend = [*((leg, LEG_COLOURS[leg]) for leg in LEGS), ("support less margin", INSIDE)]
    held = any(node.path[:-1] == STANDING for node in scene.nodes)
    if held:
        legend.append(("where forces hold the centre of mass", HELD))
    region = Switch("Region", "Where contact forces hold the robot (G)", "g", "/".join(STANDING))
    return Page(
        scene=scene,
        title=plan.robot.name if title is None else str(title),
        facts=tuple(facts),
        legend=tuple(legend),
        captions=_captions(plan),
        centre=centre,
        radius=radius,
        heading=heading,
        follow="/robot/base" if simulated is None else "/simulated/base",
        follow_radius=robot_size(plan),
        switches=(region,) if held else (),
    )


def _ghost(scene: Scene) -> Scene:
    """The same scene, seen through, without shadows."""
    nodes = tuple(
        changed(node, parts=tuple(
            changed(part, appearance=changed(
                part.appearance, opacity=GHOST * part.appearance.opacity, casts_shadow=False,
            ))
            for part in node.parts
        ))
        for node in scene.nodes
    )  # fmt: skip
    return changed(scene, nodes=nodes)


def view_sphere(plan: Plan) -> tuple[tuple[float, float, float], float, float]:
    """Centre and radius [m] of a ball around route and body, and the heading [rad]."""
    level = ground_level(plan.footholds, plan.robot.foot_radius)
    body = plan.path.knots()[:, :3]
    points = np.concatenate([plan.footholds.array.reshape(-1, 3), body])
    low, high = points.min(axis=0), points.max(axis=0)
    low[2] = level
    x, y, z = ((low + high) / 2.0).tolist()
    ends = plan.footholds.array[:, [0, -1], :2].mean(axis=0)
    ahead = ends[1] - ends[0]
    if float(np.hypot(*ahead)) < 1e-6:
        ahead = np.array([np.cos(plan.settings.heading), np.sin(plan.settings.heading)])
    radius = float(np.linalg.norm(high - low)) / 2.0
    return (x, y, z), max(radius, 1.3 * robot_size(plan)), float(np.arctan2(ahead[1], ahead[0]))


def robot_size(plan: Plan) -> float:
    """Radius [m] of a ball around the robot as it walks."""
    legs = plan.robot.legs.values()
    return max(float(np.linalg.norm(leg.hip)) + 0.6 * (leg.upper + leg.lower) for leg in legs)


def _balance(plan: Plan) -> str:
    """What holds the robot up, at its worst."""
    zmp = plan.record.zmp_margin
    if plan.settings.static or zmp is None:
        return f"stability margin {1e3 * plan.margin:.1f} mm"
    if zmp >= -1e-4:
        return f"ZMP margin {1e3 * max(zmp, 0.0):.1f} mm"
    return f"ZMP at most {-1e3 * zmp:.1f} mm off its support"


def _captions(plan: Plan) -> tuple[Caption, ...]:
    count = plan.footholds.steps
    return tuple(
        Caption(p.start, _label(p, count), LEG_COLOURS[p.leg] if len(p.flying) == 1 else "")
        for p in plan.phases if p.duration > 0
    )  # fmt: skip


def _label(phase: Phase, steps: int) -> str:
    if phase.kind == "swing":
        doing = f"swing {' '.join(phase.flying)}"
    else:
        doing = f"shift body for {phase.leg}" if phase.leg else "stand"
    # Two feet span a line: there is no margin to speak of.
    known = np.isfinite(phase.margin) and len(phase.support) > 2
    margin = f", margin {1e3 * phase.margin:.1f} mm" if known else ""
    return f"{doing}, step {phase.step + 1} of {steps}{margin}"
