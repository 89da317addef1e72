"""The robot as stick figures from the side: Fig. 12 of [Wang2024], and Fig. 8 of [Shao2011]."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.inputs import check_count, check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.plan.swings import Swing
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    INK,
    MUTED,
    cycle_phases,
    dot_key,
    forward_axis,
    line_key,
    plain,
    span_of,
    style_axes,
    times_to_draw,
)
from gaitopt.viewing.figures.panels import Panels, legend_below, panels
from gaitopt.viewing.figures.posture import front_strides

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH = 10.0
"""Width of the figure [inch]."""
MOST = 100
"""Most stick figures in a row: more cannot be told apart."""
POSES = 8
"""Stick figures of one cycle."""
FRAMES = 5
"""Pictures of one stride. Chosen here: the ends, the top of the flight, and one on each side."""
NEAR, FAR = ("RF", "RH"), ("LF", "LH")
"""Legs on the near and the far side, seen from the right: there forward is to the right."""
ROUND: dict[str, Any] = {"solid_capstyle": "round", "solid_joinstyle": "round"}


def plot_snapshots(
    plan: Plan, count: int | None = None, axes: Sequence[Axes] | Panels | None = None
) -> Panels:
    """Plot the robot from the side: at equal intervals of the walk, and during one cycle.

    Legs are lines from hip to knee to foot, by forward kinematics; those on the far side are paler.
    The upper panel shows the robot where it is, with the paths of the feet. The lower panel shows
    the poses of one cycle in the middle of the walk next to each other, above their times. Feet
    that stand have a dot.

    Source: Fig. 12 of [Wang2024].

    Args:
        plan: any plan.
        count: number of stick figures in the upper panel; by default as many as fit next to each
            other.
        axes: where to draw ``(2,)``; by default a new figure.

    Returns:
        The axes ``(2,)``: the walk, and the cycle.

    Raises:
        InputError: the count is not a whole number from 1 to :data:`MOST`, or the axes have another
            shape.
    """
    check_kind("plan", plan, Plan)
    axis = side_axis(plan)
    count = _fitting(plan, axis) if count is None else check_count("count", count, 1, MOST)
    times = np.linspace(0.0, plan.duration, count)
    poses = np.linspace(*_one_cycle(plan), POSES, endpoint=False)
    spacing = _spacing(plan, poses)
    # The heights of the panels follow from their contents, which fill the width.
    ratios = _proportions(plan, times, axis), _proportions(plan, poses, axis, spacing)
    height = 2.1 + (WIDTH - 1.0) * sum(ratios)
    drawn = panels(axes, (2,), WIDTH, height, height_ratios=ratios)
    upper, lower = drawn
    paths = _from_side(plan.at(times_to_draw(plan)).feet, axis)
    for i, leg in enumerate(LEGS):
        upper.plot(*paths[:, i].T, color=LEG_COLOURS[leg], linewidth=0.8, alpha=0.6, gid="path")
    _draw_poses(upper, plan, times, axis)
    _draw_poses(lower, plan, poses, axis, spacing)
    lower.set_xticks(np.arange(POSES) * spacing, [f"{t:.3f}" for t in poses])
    title = f"{plain(plan.robot.name)}: {len(times)} poses, {_interval(times)}"
    style_axes(upper, title, "along the way [m]", "height [m]", grid=False)
    title = (
        f"One cycle in the middle of the walk: poses {_interval(poses)}, drawn beside each other"
    )
    style_axes(lower, title, "time [s]", "height [m]", grid=False)
    keys = [line_key(leg, colour, width=2.5) for leg, colour in LEG_COLOURS.items()]
    keys += [line_key("body", INK, width=3.0), dot_key("foot stands", MUTED)]
    legend_below(drawn, keys, own=axes is None, ncols=6)
    return drawn


def plot_stride_snapshots(plan: Plan, axes: Sequence[Axes] | Panels | None = None) -> Panels:
    """Plot how the front legs step over the obstacle: a row for each, at equal intervals.

    The robot is drawn as in :func:`plot_snapshots`, with the path of the foot and the obstacle. The
    first picture is the lift-off, the last one the touchdown.

    Source: Fig. 8 of [Shao2011], which shows photographs.

    Args:
        plan: of :func:`gaitopt.plan_stride`.
        axes: where to draw ``(2, 5)``; by default a new figure.

    Returns:
        The axes ``(2, 5)``, the front leg that steps first in the first row.

    Raises:
        InputError: the plan has no obstacle, a front leg does not step over it, or the axes have
            another shape.
    """
    check_kind("plan", plan, Plan)
    strides = front_strides(plan)
    axis = side_axis(plan)
    drawn = panels(axes, (len(strides), FRAMES), WIDTH, 4.0, sharex=True, sharey=True)
    limits = _stride_limits(plan, strides, axis)
    for number, (row, swing) in enumerate(zip(drawn, strides, strict=True)):
        times = np.linspace(swing.start, min(swing.end, plan.duration), FRAMES)
        path = plan.at(np.linspace(times[0], times[-1], 101)).feet[:, LEGS.index(swing.leg)]
        for ax, time in zip(row, times, strict=True):
            for obstacle in plan.settings.obstacles:
                section = obstacle.outline()
                places = np.insert(section, 1, 0.0, axis=1)
                ax.fill(*_from_side(obstacle.to_world(places), axis).T, color=MUTED, linewidth=0)
            ax.plot(*_from_side(path, axis).T, color=LEG_COLOURS[swing.leg], linewidth=0.8,
                    gid="path")  # fmt: skip
            _draw_poses(ax, plan, np.array([time]), axis)
            _draw_ground(ax, plan, limits, None)
            style_axes(ax, f"{swing.leg}, {time:.1f} s", "along [m]" if number else "",
                       "height [m]" if ax is row[0] else "", grid=False)  # fmt: skip
            ax.set_xlim(limits)
            ax.locator_params(axis="x", nbins=4)
    keys = [line_key(leg, colour, width=2.5) for leg, colour in LEG_COLOURS.items()]
    keys += [line_key("body", INK, width=3.0), dot_key("foot stands", MUTED),
             dot_key("obstacle", MUTED, "s")]  # fmt: skip
    legend_below(drawn, keys, own=axes is None, ncols=7)
    return drawn


def _stride_limits(
    plan: Plan, strides: Sequence[Swing], axis: FloatArray
) -> tuple[float, float]:  # fmt: skip
    """Start and end of the axis along the way: all of the robot during the strides [m]."""
    times = np.concatenate([np.linspace(s.start, s.end, FRAMES) for s in strides])
    along = _from_side(leg_points(plan, np.minimum(times, plan.duration)), axis)[..., 0]
    return float(along.min()) - 0.05, float(along.max()) + 0.05


def leg_points(plan: Plan, times: FloatArray) -> FloatArray:
    """Hip, pitch axis, knee and foot of each leg in the world ``(N, 4, 4, 3)`` [m].

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
        points[:, i] = leg.joint_points(q)
    to_world = rpy_to_matrix(values[:, 3:6]) @ plan.robot.body_axes
    return np.asarray(values[:, None, None, :3] + np.einsum("nij,nlkj->nlki", to_world, points))


def side_axis(plan: Plan) -> FloatArray:
    """Direction of the figure's horizontal axis ``(2,)``.

    It is that from start to end of the walk, or the heading where these are close to each other.
    """
    ends = plan.at([0.0, plan.duration]).cog[:, :2]
    walked = ends[1] - ends[0]
    length = float(np.hypot(*walked))
    return walked / length if length > 0.5 * plan.robot.stance_size[0] else forward_axis(plan)


def _from_side(points: FloatArray, axis: FloatArray) -> FloatArray:
    """Distance along ``axis`` and height of points ``(..., 3)``: ``(..., 2)`` [m]."""
    return np.stack([points[..., :2] @ axis, points[..., 2]], axis=-1)


def _draw_poses(
    ax: Axes, plan: Plan, times: FloatArray, axis: FloatArray, spacing: float | None = None
) -> None:
    """Draw stick figures at ``times``: where the robot is, or with a ``spacing`` [m]."""
    points, standing = leg_points(plan, times), plan.at(times).contacts
    flat = _from_side(points, axis)
    if spacing is not None:
        middles = flat[:, :, 0, 0].mean(axis=1)
        flat[..., 0] += (np.arange(len(times)) * spacing - middles)[:, None, None]
    low, high = flat[..., 0].min(), flat[..., 0].max()
    margin = 0.04 * (high - low)
    _draw_ground(ax, plan, (low - margin, high + margin), axis if spacing is None else None)
    for pose, stands in zip(flat, standing, strict=True):
        _draw_pose(ax, pose, stands)
    top = flat[..., 1].max()
    ax.set(xlim=(low - margin, high + margin), ylim=(_ground(plan) - 0.04 * top, 1.08 * top))
    ax.set_aspect("equal", adjustable="box")


def _draw_pose(ax: Axes, pose: FloatArray, stands: BoolArray) -> None:
    """Draw one stick figure from points ``(4, 4, 2)``, with dots for feet that stand ``(4,)``."""
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
    """Draw level ground as a line; uneven ground as a short line below each foothold."""
    level, places = _ground(plan), plan.footholds.array
    if float(np.ptp(places[..., 2])) < 1e-9:
        ax.fill_between(span, level - 1.0, level, color="#e9e6df", linewidth=0, zorder=0)
        ax.plot(span, (level, level), color=MUTED, linewidth=1.0, zorder=1, gid="ground")
    elif axis is not None:
        spots = _from_side(plan.footholds.touching(plan.robot.foot_radius), axis).reshape(-1, 2)
        ax.plot(*spots.T, "_", color=MUTED, markersize=9, markeredgewidth=1.5, gid="ground")


def _ground(plan: Plan) -> float:
    """Height of the lowest ground that a foot stands on [m]."""
    return float(plan.footholds.array[..., 2].min()) - plan.robot.foot_radius


def _one_cycle(plan: Plan) -> tuple[float, float]:
    """Start and end of a cycle in the middle of the plan [s]."""
    settings = plan.settings
    schedule = settings.schedule if isinstance(settings, GaitSettings) else None
    if isinstance(schedule, GaitSchedule) and schedule.cycle_time < plan.duration:
        half = schedule.cycle_time / 2.0
        return plan.duration / 2.0 - half, plan.duration / 2.0 + half
    start, end = span_of(cycle_phases(plan, None)[1])
    return start, min(end, plan.duration)


def _spacing(plan: Plan, times: FloatArray) -> float:
    """Distance at which stick figures next to each other do not touch [m]."""
    flat = _from_side(leg_points(plan, times), side_axis(plan))[..., 0]
    middles = flat[:, :, :1].mean(axis=1, keepdims=True)
    return 1.15 * float(np.ptp(flat - middles))


def _fitting(plan: Plan, axis: FloatArray) -> int:
    """How many stick figures fit next to each other along the walk, from 2 to 12."""
    cog = plan.at([0.0, plan.duration]).cog[:, :2] @ axis
    times = np.linspace(0.0, plan.duration, 3 * POSES)
    return int(np.clip(1 + (cog[1] - cog[0]) // _spacing(plan, times), 2, 12))


def _proportions(
    plan: Plan, times: FloatArray, axis: FloatArray, spacing: float | None = None
) -> float:
    """Ratio of height to width of a panel of stick figures."""
    flat = _from_side(leg_points(plan, times), axis)
    width = float(np.ptp(flat[..., 0])) if spacing is None else len(times) * spacing
    return float(np.clip((flat[..., 1].max() - _ground(plan)) / width, 0.05, 0.5))


def _interval(times: FloatArray) -> str:
    """The interval between equally spaced times, in words."""
    return f"{times[1] - times[0]:.3g} s apart" if len(times) > 1 else "at the start"
