"""A plan as a page: all that its replay shows, with heading, legend, captions and buttons."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace as changed

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.files import StrPath
from gaitopt.inputs import check_kind
from gaitopt.motion.path import MotionPath
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory
from gaitopt.robots.rotations import quaternion_to_rpy
from gaitopt.viewing.colours import HELD, LEG_COLOURS
from gaitopt.viewing.ground_search import GroundSearch
from gaitopt.viewing.replay.camera import robot_size, view_sphere
from gaitopt.viewing.replay.ground.ground_scene import (
    FOOTING,
    footing_legend,
    footing_scene,
    ground_scene,
)
from gaitopt.viewing.replay.ground.search_scene import SEARCH, TRIED, search_scene
from gaitopt.viewing.replay.ground.window import GroundWindow, ground_window
from gaitopt.viewing.replay.obstacle_scene import obstacle_scene
from gaitopt.viewing.replay.page import Caption, Page, Switch
from gaitopt.viewing.replay.robot_scene import robot_scene
from gaitopt.viewing.replay.scene import Scene, joined
from gaitopt.viewing.replay.standing_scene import STANDING, standing_scene
from gaitopt.viewing.replay.support_scene import INSIDE, support_scene
from gaitopt.viewing.replay.terrain_scene import samples_of, swings_scene, terrain_scene

GHOST = 0.25
"""Opacity of the planned robot beside a simulated one."""

SIMULATED_EVERY = 0.05
"""Least time between two samples of a simulated motion that are shown [s]: a page stays small."""


def plan_scene(
    plan: Plan,
    meshes: bool | StrPath = False,
    simulated: Trajectory | None = None,
    search: GroundSearch | None = None,
) -> Scene:
    """All that a replay shows, as frames and keyframes."""
    check_kind("plan", plan, Plan)
    samples, window = samples_of(plan), ground_window(plan)
    heights = None if window is None else window.heights
    scenes = [
        *_ground(plan, window, search),
        obstacle_scene(plan.settings.obstacles),
        swings_scene(plan, samples),
        support_scene(plan, samples, heights=heights),
        standing_scene(plan, heights=heights),
    ]
    if simulated is None:
        return joined([*scenes, robot_scene(plan, meshes)])
    real = robot_scene(simulated_plan(plan, simulated), meshes, ("simulated",))
    return joined([*scenes, _ghost(robot_scene(plan, meshes)), real])


def _ground(
    plan: Plan, window: GroundWindow | None, search: GroundSearch | None
) -> Iterator[Scene]:
    """What the plan walks on, and what is known of it."""
    if window is None:
        yield terrain_scene(plan.footholds, plan.robot.foot_radius)
        return
    yield ground_scene(plan, window)
    yield footing_scene(
        window.heights, window.codes(plan, None if search is None else search.layers)
    )
    if search is not None:
        yield search_scene(search, window.heights, plan.robot.foot_radius)


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
    search: GroundSearch | None = None,
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
    scene = plan_scene(plan, meshes, simulated, search)
    legend = [*((leg, LEG_COLOURS[leg]) for leg in LEGS), ("support less margin", INSIDE)]
    switches = _switches(scene)
    if any(s.frame == "/".join(STANDING) for s in switches):
        legend.append(("where forces hold the centre of mass", HELD))
    window = ground_window(plan)
    size = robot_size(plan)
    return Page(
        scene=scene,
        title=plan.robot.name if title is None else str(title),
        facts=(*facts, *(() if window is None else window.notes)),
        legend=tuple(legend),
        captions=_captions(plan),
        centre=centre,
        radius=radius,
        heading=heading,
        follow="/robot/base" if simulated is None else "/simulated/base",
        follow_radius=size,
        follow_drop=None if window is None else 0.5 * size,
        switches=switches,
    )


def _switches(scene: Scene) -> tuple[Switch, ...]:
    """Buttons for what the scene has."""
    switches = []
    nodes = {node.path: node for node in scene.nodes}
    if any(path[:-1] == STANDING for path in nodes):
        switches.append(
            Switch("Region", "Where contact forces hold the robot (G)", "g", "/".join(STANDING))
        )
    if FOOTING in nodes:
        switches.append(Switch(
            "Steppable", "Where feet may stand, and why not elsewhere (S)", "s",
            "/".join(FOOTING), shown=False, legend=footing_legend(nodes[FOOTING]),
        ))  # fmt: skip
    if SEARCH in nodes:
        switches.append(Switch(
            "Search", "Where the search tried to put feet, and the way asked for (T)", "t",
            "/".join(SEARCH), shown=False,
            legend=(("dots: places tried; line: way asked for", TRIED),),
        ))  # fmt: skip
    return tuple(switches)


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
