"""Who runs in a race: plans with their lanes, colours and results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.plan.plan import Plan
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.viewing.replay.camera import robot_size, view_sphere
from gaitopt.viewing.replay.ground.window import GroundWindow, ground_window
from gaitopt.viewing.replay.scene import FramePath
from gaitopt.viewing.replay.terrain_scene import ground_level

BASELINE = "the paper"
"""The plan that the others are held against, by name."""

LANE_COLOURS = {
    "SSM baseline": "#6b7683",
    "the paper": "#20262e",
    "phase by phase": "#5c7a29",
    "route": "#8d6a9f",
    "overlap": "#3f7cac",
    "swing": "#2a9d8f",
    "height": "#e9a23b",
    "posture": "#e4572e",
    "dynamic": "#b5179e",
}
"""Colours of the rows of a race; lanes of other names take them in turn."""


GROUND_MARGIN = 0.3
"""How far around a walk its height map is drawn, as a share of the robot's size. Chosen: as far as
lanes without maps are apart."""

GROUND_GAP = 0.05
"""Distance between the height maps of neighbours [m]."""


def lane_colour(name: str, lane: int) -> str:
    """The colour of a lane by its name, or else by its number from 0."""
    others = tuple(LANE_COLOURS.values())
    return LANE_COLOURS.get(name, others[lane % len(others)])


@dataclass(frozen=True, eq=False)
class Runner:
    """One plan of a race.

    Attributes:
        name: what it is called.
        plan: its motion.
        result: what is written once it has arrived.
        verdict: what its certificate says; empty where nothing is to be told.
        colour: of its lane.
        offset: of its lane from where the plan is made ``(3,)`` [m].
        root: the frame of its lane.
    """

    name: str
    plan: Plan
    result: str
    verdict: str
    colour: str
    offset: FloatArray
    root: FramePath


def line_up(
    plans: Mapping[str, Plan],
    baseline: str = BASELINE,
    verdicts: Mapping[str, str] | None = None,
) -> tuple[Runner, ...]:
    """Each plan with its lane: as near to one another as terrain and robots allow.

    Raises:
        InputError: there is no plan, or something that is none.
    """
    named = isinstance(plans, Mapping) and len(plans) > 0
    if not named or not all(isinstance(p, Plan) for p in plans.values()):
        raise InputError("a race needs at least one plan, by name: {'route': plan}")
    own = next(iter(plans.values()))
    heading = view_sphere(own)[2]
    left = np.array([-np.sin(heading), np.cos(heading), 0.0])
    pitch = _pitch(plans, heading)
    reference = plans[baseline].duration if baseline in plans else None
    runners = []
    for i, (name, plan) in enumerate(plans.items()):
        start = plan.footholds.array[:, 0].mean(axis=0)
        start[2] = ground_level(plan.footholds, plan.robot.foot_radius)
        offset = (i - (len(plans) - 1) / 2.0) * pitch * left - start
        runners.append(Runner(
            str(name), plan, _result(plan, reference, name == baseline),
            (verdicts or {}).get(name, ""),
            lane_colour(str(name), i), offset, (f"lane {i}",),
        ))  # fmt: skip
    return tuple(runners)


def _pitch(plans: Mapping[str, Plan], heading: float) -> float:
    """Distance between lanes that keeps robots off their neighbours and their columns [m].

    Lanes may bend with the route: only what lies side by side must keep apart.
    """
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    size = max(robot_size(plan) for plan in plans.values())
    across = 0.0
    for plan in plans.values():
        flat = np.concatenate([plan.footholds.array[:, :, :2].reshape(-1, 2), _hips(plan)]) @ turn
        flat = flat[np.argsort(flat[:, 0])]
        ends = np.searchsorted(flat[:, 0], flat[:, 0] + 0.3 * size, side="right")
        widths = [float(np.ptp(flat[i:end, 1])) for i, end in enumerate(ends)]
        across = max(across, *widths)
    return max(across + 0.3 * size, _ground_width(plans, heading))


def lane_window(plan: Plan) -> GroundWindow | None:
    """The part of a plan's height map that is drawn on its lane; ``None`` where it has none."""
    return ground_window(plan, GROUND_MARGIN * robot_size(plan))


def _ground_width(plans: Mapping[str, Plan], heading: float) -> float:
    """Distance between lanes that keeps their height maps off each other [m]; 0 without maps.

    All lanes are lined up by the starts of their plans.
    """
    left = np.array([-np.sin(heading), np.cos(heading)])
    low, high = np.inf, -np.inf
    for plan in plans.values():
        window = lane_window(plan)
        if window is None:
            continue
        corners = np.array(np.meshgrid(*window.ground.extent)).reshape(2, -1).T
        across = (corners - plan.footholds.array[:, 0, :2].mean(axis=0)) @ left
        low, high = min(low, across.min()), max(high, across.max())
    return float(high - low) + GROUND_GAP if high > low else 0.0


def _hips(plan: Plan) -> FloatArray:
    """Where the hips are at the start of each phase ``(n, 2)`` [m]."""
    pose_then = plan.path.evaluate(plan.phase_starts if plan.phases else np.zeros(1))
    hips = np.array([leg.hip for leg in plan.robot.legs.values()])
    body = rpy_to_matrix(pose_then[:, 3:6]) @ plan.robot.body_axes
    places = pose_then[:, None, :3] + np.einsum("nij,lj->nli", body, hips)
    return np.asarray(places[:, :, :2].reshape(-1, 2))


def _result(plan: Plan, reference: float | None, is_baseline: bool) -> str:
    """Time and ratio, as they stand above a robot that has arrived."""
    time = short_time(plan.duration)
    if reference is None or is_baseline or not plan.duration:
        return time
    return f"{time} · {reference / plan.duration:.2f}×"


def short_time(time: float) -> str:
    """A time with its unit, for a label [s]."""
    return f"{time:.1f} s" if time >= 10.0 else f"{time:.2f} s"
