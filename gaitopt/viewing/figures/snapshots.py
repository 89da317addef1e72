"""Fig. 12 of [Wang2024]: the robot at regular times, as stick figures from the side."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.inputs import check_count
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    INK,
    MUTED,
    SMALL,
    cycle_phases,
    dot_key,
    dress,
    forward_axis,
    line_key,
    new_figure,
    span_of,
    walk_times,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 10.0
"""Of the figure [inch]."""
MOST = 100
"""Most stick figures in a row."""
POSES = 8
"""Stick figures of one cycle."""
NEAR, FAR = ("RF", "RH"), ("LF", "LH")
"""Seen from the right, where forward is to the right as well."""
ROUND: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round"}


def plot_snapshots(plan: Plan, count: int | None = None) -> Figure:
    """The robot from the side: at regular times along its way, and over one cycle.

    Body and legs are lines from hip to knee to foot, by forward kinematics; legs on the far side
    are paler. The upper panel shows them where they are, with the paths of the feet. The lower
    one draws the poses of one cycle in the middle of the walk beside each other, each over its
    time. A foot that stands has a dot.

    Source: Fig. 12 of [Wang2024].

    Args:
        plan: any plan.
        count: stick figures along the way; by default as many as fit beside each other.

    Raises:
        InputError: the count is not a whole number from 1 to :data:`MOST`.
    """
    axis = side_axis(plan)
    times = np.linspace(0.0, plan.duration, _checked(count) or _fitting(plan, axis))
    poses = np.linspace(*_one_cycle(plan), POSES, endpoint=False)
    pitch = _pitch(plan, poses)
    # Panels as high as their contents are when they fill the width in true proportions.
    ratios = _proportions(plan, times, axis), _proportions(plan, poses, axis, pitch)
    figure = new_figure(WIDTH, 2.1 + (WIDTH - 1.0) * sum(ratios))
    along, apart = figure.subplots(2, 1, height_ratios=ratios)
    paths = _from_side(plan.at(walk_times(plan)).feet, axis)
    for i, leg in enumerate(LEGS):
        along.plot(*paths[:, i].T, color=LEG_COLOURS[leg], linewidth=0.8, alpha=0.6, gid="path")
    _draw_poses(along, plan, times, axis)
    _draw_poses(apart, plan, poses, axis, pitch)
    apart.set_xticks(np.arange(POSES) * pitch, [f"{t:.3f}" for t in poses])
    title = f"{plan.robot.name}: {len(times)} poses, {_spacing(times)}"
    dress(along, title, "along the way [m]", "height [m]", grid=False)
    title = f"One cycle in the middle of the walk: poses {_spacing(poses)}, drawn beside each other"
    dress(apart, title, "time [s]", "height [m]", grid=False)
    keys = [line_key(leg, colour, width=2.5) for leg, colour in LEG_COLOURS.items()]
    keys += [line_key("body", INK, width=3.0), dot_key("foot stands", MUTED)]
    figure.legend(handles=keys, loc="outside lower center", ncols=6, fontsize=SMALL, frameon=False)
    return figure


def _checked(count: int | None) -> int:
    """The number of stick figures along the way; 0 where it is left open."""
    return 0 if count is None else check_count("count", count, 1, MOST)


def leg_points(plan: Plan, times: FloatArray) -> FloatArray:
    """Hip, start of the upper leg, knee and foot of each leg in the world ``(N, 4, 4, 3)`` [m].

    Args:
        plan: any plan.
        times: instants ``(N,)`` [s].

    Returns:
        The second axis runs over the legs in the order of ``LEGS``, the third from hip to foot.
    """
    values = plan.path.evaluate(times)
    points = np.empty((len(values), len(LEGS), 4, 3))
    for i, name in enumerate(LEGS):
        leg = plan.robot.legs[name]
        q = values[:, 6:][:, list(plan.robot.leg_columns[name])]
        points[:, i, 0] = leg.hip
        # A leg without its lower part ends in the knee, without both at the pitch axis.
        points[:, i, 1] = replace(leg, upper=0.0, lower=0.0).forward(q)
        points[:, i, 2] = replace(leg, lower=0.0).forward(q)
        points[:, i, 3] = leg.forward(q)
    to_world = rpy_to_matrix(values[:, 3:6]) @ plan.robot.body_axes
    return np.asarray(values[:, None, None, :3] + np.einsum("nij,nlkj->nlki", to_world, points))


def side_axis(plan: Plan) -> FloatArray:
    """The direction ``(2,)`` that the figure shows: of the way, or forward where it is short."""
    ends = plan.at([0.0, plan.duration]).cog[:, :2]
    way = ends[1] - ends[0]
    length = float(np.hypot(*way))
    return way / length if length > 0.5 * plan.robot.stance_size[0] else forward_axis(plan)


def _from_side(points: FloatArray, axis: FloatArray) -> FloatArray:
    """Points ``(..., 3)`` along ``axis`` and in height ``(..., 2)``."""
    return np.stack([points[..., :2] @ axis, points[..., 2]], axis=-1)


def _draw_poses(
    ax: Axes, plan: Plan, times: FloatArray, axis: FloatArray, pitch: float | None = None
) -> None:
    """Stick figures at ``times``: where they are, or ``pitch`` [m] apart."""
    points, standing = leg_points(plan, times), plan.at(times).contacts
    flat = _from_side(points, axis)
    if pitch is not None:
        middles = flat[:, :, 0, 0].mean(axis=1)
        flat[..., 0] += (np.arange(len(times)) * pitch - middles)[:, None, None]
    low, high = flat[..., 0].min(), flat[..., 0].max()
    margin = 0.04 * (high - low)
    _draw_ground(ax, plan, (low - margin, high + margin), axis if pitch is None else None)
    for pose, stands in zip(flat, standing, strict=True):
        _draw_pose(ax, pose, stands)
    top = flat[..., 1].max()
    ax.set(xlim=(low - margin, high + margin), ylim=(_ground(plan) - 0.04 * top, 1.08 * top))
    ax.set_aspect("equal", adjustable="box")


def _draw_pose(ax: Axes, pose: FloatArray, stands: BoolArray) -> None:
    """One stick figure of points ``(4, 4, 2)``; feet that stand ``(4,)`` get a dot."""
    order = [*FAR, "", *NEAR]
    for layer, leg in enumerate(order):
        if not leg:
            corners = pose[[LEGS.index(name) for name in (*FAR[::-1], *NEAR, FAR[1])], 0]
            ax.fill(*corners.T, color=INK, alpha=0.15, linewidth=0, zorder=2 + layer)
            ax.plot(*corners.T, color=INK, linewidth=3.0, zorder=2 + layer, gid="body", **ROUND)
            continue
        line, alpha = pose[LEGS.index(leg)], 0.45 if leg in FAR else 1.0
        ax.plot(*line.T, color=LEG_COLOURS[leg], linewidth=2.5, alpha=alpha, gid=leg,
                zorder=2 + layer, **ROUND)  # fmt: skip
        if stands[LEGS.index(leg)]:
            ax.plot(*line[-1], "o", color=LEG_COLOURS[leg], markersize=5, alpha=alpha,
                    zorder=2 + layer, gid="stands")  # fmt: skip


def _draw_ground(ax: Axes, plan: Plan, span: tuple[float, float], axis: FloatArray | None) -> None:
    """Level ground as a line; of footholds at different heights a tick below each."""
    level, places = _ground(plan), plan.footholds.array
    if float(np.ptp(places[..., 2])) < 1e-9:
        ax.fill_between(span, level - 1.0, level, color="#e9e6df", linewidth=0, zorder=0)
        ax.plot(span, (level, level), color=MUTED, linewidth=1.0, zorder=1, gid="ground")
    elif axis is not None:
        spots = _from_side(places, axis).reshape(-1, 2) - [0.0, plan.robot.foot_radius]
        ax.plot(*spots.T, "_", color=MUTED, markersize=9, markeredgewidth=1.5, gid="ground")


def _ground(plan: Plan) -> float:
    """Height of the lowest ground that a foot stands on [m]."""
    return float(plan.footholds.array[..., 2].min()) - plan.robot.foot_radius


def _one_cycle(plan: Plan) -> tuple[float, float]:
    """A cycle in the middle of the plan [s]."""
    settings = plan.settings
    schedule = settings.schedule if isinstance(settings, GaitSettings) else None
    if isinstance(schedule, GaitSchedule) and schedule.cycle_time < plan.duration:
        half = schedule.cycle_time / 2.0
        return plan.duration / 2.0 - half, plan.duration / 2.0 + half
    start, end = span_of(cycle_phases(plan, None)[1])
    return start, min(end, plan.duration)


def _pitch(plan: Plan, times: FloatArray) -> float:
    """Distance of stick figures that stand beside each other [m]."""
    flat = _from_side(leg_points(plan, times), side_axis(plan))[..., 0]
    middles = flat[:, :, :1].mean(axis=1, keepdims=True)
    return 1.15 * float(np.ptp(flat - middles))


def _fitting(plan: Plan, axis: FloatArray) -> int:
    """How many stick figures fit beside each other along the way, at least two."""
    cog = plan.at([0.0, plan.duration]).cog[:, :2] @ axis
    spots = np.linspace(0.0, plan.duration, 3 * POSES)
    return int(np.clip(1 + (cog[1] - cog[0]) // _pitch(plan, spots), 2, 12))


def _proportions(
    plan: Plan, times: FloatArray, axis: FloatArray, pitch: float | None = None
) -> float:
    """Height over width of a panel of stick figures."""
    flat = _from_side(leg_points(plan, times), axis)
    width = float(np.ptp(flat[..., 0])) if pitch is None else len(times) * pitch
    return float(np.clip((flat[..., 1].max() - _ground(plan)) / width, 0.05, 0.5))


def _spacing(times: FloatArray) -> str:
    return f"{times[1] - times[0]:.3g} s apart" if len(times) > 1 else "at the start"
