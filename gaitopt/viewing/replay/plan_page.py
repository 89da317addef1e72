"""A plan as a page: all that its replay shows, with heading, legend, captions and buttons."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace as changed
from typing import Final

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.inputs import check_kind
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory
from gaitopt.viewing.colours import HELD, LEG_COLOURS, LEG_WORDS
from gaitopt.viewing.ground_search import GroundSearch
from gaitopt.viewing.replay.camera import robot_size, view_sphere
from gaitopt.viewing.replay.curves.of_physics import physics_curves
from gaitopt.viewing.replay.curves.of_plan import plan_curves
from gaitopt.viewing.replay.ground.ground_scene import (
    FOOTING,
    footing_legend,
    footing_scene,
    ground_scene,
)
from gaitopt.viewing.replay.ground.search_scene import SEARCH, TRIED, search_scene
from gaitopt.viewing.replay.ground.window import GroundWindow, ground_window
from gaitopt.viewing.replay.mesh_files import MeshFolders
from gaitopt.viewing.replay.obstacle_scene import obstacle_scene
from gaitopt.viewing.replay.page import Caption, Label, Page, Switch
from gaitopt.viewing.replay.physics.happened import Happened, SimulatedWalk, what_happened
from gaitopt.viewing.replay.physics.missed_scene import ALARM, missed_scene
from gaitopt.viewing.replay.robot_scene import foot_frames, robot_scene
from gaitopt.viewing.replay.scene import FramePath, Scene, joined
from gaitopt.viewing.replay.standing_scene import MOST_REGIONS, STANDING, standing_scene
from gaitopt.viewing.replay.support_scene import DOT, INK, INSIDE, support_scene
from gaitopt.viewing.replay.terrain_scene import samples_of, swings_scene, terrain_scene

SIMULATED: Final[FramePath] = ("simulated",)
"""The frame of the robot in physics."""
WAY, NEAR_LIMIT, NEAREST = "#8d97a3", "#ff7a00", "#c2185b"
"""Colours in the legend for the ways of the feet, which have their legs' colours, and of what
``curves.js`` draws: the mark at a joint near its limit, and the stick down to the ground."""

GHOST = 0.25
"""Opacity of the planned robot beside a simulated one."""

AFTER_A_FALL = 2.0
"""How long a robot that fell is shown lying [s]."""


def plan_scene(
    plan: Plan,
    meshes: MeshFolders = False,
    simulated: Trajectory | SimulatedWalk | None = None,
    search: GroundSearch | None = None,
) -> Scene:
    """All that a replay shows, as frames and keyframes."""
    check_kind("plan", plan, Plan)
    real = None if simulated is None else what_happened(plan, simulated)
    return _scene(plan, real, meshes, search)


def _scene(
    plan: Plan, real: Happened | None, meshes: MeshFolders, search: GroundSearch | None
) -> Scene:
    """Ground and ways of the plan, and what stands and moves: as planned, or as it happened."""
    window, walk = ground_window(plan), plan if real is None else real.walk
    heights = None if window is None else window.heights
    samples = samples_of(walk)
    scenes = [
        *_ground(plan, window, search),
        obstacle_scene(plan.settings.obstacles),
        swings_scene(plan, samples if real is None else samples_of(plan)),
        support_scene(walk, samples, heights=heights),
        standing_scene(walk, heights=heights),
    ]
    if real is None:
        return joined([*scenes, robot_scene(plan, meshes)])
    shown = joined([
        *scenes,
        missed_scene(plan, real.missed),
        # Without its meshes, which would be in the page twice.
        _ghost(robot_scene(real.ghost)),
        robot_scene(real.walk, meshes, SIMULATED),
    ])  # fmt: skip
    # The plan goes on after a fall, but the page does not.
    end = real.walk.duration if real.fell is None else real.fell + AFTER_A_FALL
    return changed(shown, duration=end)


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


def plan_page(
    plan: Plan,
    title: str | None = None,
    meshes: MeshFolders = False,
    simulated: Trajectory | SimulatedWalk | None = None,
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
    real = None if simulated is None else what_happened(plan, simulated)
    if real is not None:
        facts += filter(None, ["solid: what happened in physics; pale: the plan", real.told])
    scene = _scene(plan, real, meshes, search)
    switches = _switches(scene)
    window = ground_window(plan)
    size = robot_size(plan)
    base = "/robot/base" if real is None else "/simulated/base"
    return Page(
        scene=scene,
        title=plan.robot.name if title is None else str(title),
        facts=(*facts, *(() if window is None else window.notes)),
        legend=_legend(plan, real, any(s.frame == "/".join(STANDING) for s in switches)),
        captions=_captions(plan if real is None else real.walk, real),
        centre=centre,
        radius=radius,
        heading=heading,
        follow=base,
        follow_radius=size,
        follow_drop=None if window is None else 0.5 * size,
        switches=switches,
        labels=(*_names(plan, real), *_fall(real, base, size)),
        curves=plan_curves(plan) if real is None else physics_curves(real, SIMULATED),
    )


def _legend(plan: Plan, real: Happened | None, held: bool) -> tuple[tuple[str, str], ...]:
    """What every colour, line and dot of the scene is."""
    margin = 1e3 * plan.settings.stability_margin
    found = [(f"{leg}: {LEG_WORDS[leg]}", LEG_COLOURS[leg]) for leg in LEGS]
    found += [
        ("coloured lines: ways of the feet", WAY),
        ("support polygon of the feet that stand", INK),
        (f"the same, shrunk by the margin of {margin:.0f} mm", INSIDE),
        ("dot: body centre, on the ground; line: its way", DOT),
    ]
    if held:
        found.append(("where forces hold the centre of mass", HELD))
        if len(plan.swings) > MOST_REGIONS:
            found[-1] = (f"{found[-1][0]} (first {MOST_REGIONS} swings)", HELD)
    if real is not None and real.missed:
        found.append(("footholds that were missed", ALARM))
    found.append(("joint near its limit", NEAR_LIMIT))
    if plan.footholds.ground is not None:
        found.append(("stick: where legs or trunk are nearest to the ground", NEAREST))
    return tuple(found)


def _names(plan: Plan, real: Happened | None) -> Iterator[Label]:
    """The names of the feet."""
    root = ("robot",) if real is None else SIMULATED
    for leg, (path, _) in foot_frames(plan.robot, root).items():
        yield Label("/" + "/".join(path), 0.0, leg, LEG_COLOURS[leg], kind="foot")


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
        return f"stability margin at least {1e3 * plan.margin:.1f} mm"
    if zmp >= -1e-4:
        return f"ZMP margin at least {1e3 * max(zmp, 0.0):.1f} mm"
    return f"ZMP at most {-1e3 * zmp:.1f} mm off its support"


def _fall(real: Happened | None, base: str, size: float) -> Iterator[Label]:
    """What is written above a robot once it has fallen."""
    if real is not None and real.fell is not None:
        yield Label(base, 0.4 * size, f"{_ended(real)} at {real.fell:.1f} s", ALARM, kind="event",
                    since=real.fell)  # fmt: skip


def _ended(real: Happened) -> str:
    """Whether the robot is known to have fallen."""
    return "fell" if real.result is not None else "physics ended"


def _captions(plan: Plan, real: Happened | None) -> tuple[Caption, ...]:
    count = plan.footholds.steps
    found = [
        Caption(p.start, _label(p, count), LEG_COLOURS[p.leg] if len(p.flying) == 1 else "")
        for p in plan.phases if p.duration > 0
    ]  # fmt: skip
    if real is not None and real.fell is not None:
        found.append(Caption(real.fell, f"{_ended(real)} at {real.fell:.1f} s", ALARM))
    return tuple(found)


def _label(phase: Phase, steps: int) -> str:
    if not phase.support:
        return f"no foot on the ground, step {phase.step + 1} of {steps}"
    if phase.kind == "swing":
        doing = f"swing {' '.join(phase.flying)}"
    else:
        doing = f"shift body for {phase.leg}" if phase.leg else "stand"
    return f"{doing}, step {phase.step + 1} of {steps}"
