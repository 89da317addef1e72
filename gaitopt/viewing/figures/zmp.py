"""The zero moment point: its path over the ground, and its margin over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.robots.rotations import (
    rpy_accelerations_to_angular,
    rpy_rates_to_angular,
    rpy_to_matrix,
)
from gaitopt.stability.contacts import support_margin
from gaitopt.stability.zmp import cart_table_zmp, whole_body_zmp
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    BESIDE,
    INK,
    MUTED,
    add_legend,
    fit_limits,
    leg_keys,
    line_key,
    panel_height,
    plain,
    style_axes,
    support_table,
    time_limits,
    true_proportions,
)
from gaitopt.viewing.figures.panels import Panels, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ZMP_COLOUR, CENTRE_COLOUR, SUPPORT_COLOUR = "#b35806", "#1b4f8f", "#5e6b73"
WIDTH = 9.0
"""Width of the figure [inch]."""
INSIDE = 1e-9
"""Share of a phase by which its first and last sample are moved inside, as accelerations may jump
at its ends. Chosen here: far above rounding, and far below what can be seen."""
SAMPLES = 1000
"""Samples of the whole plan, about: one for each pixel column."""
AREA_COLOUR = "#e3e5e7"
"""Colour of support areas in the legend, like many transparent ones on each other."""


def plot_zmp(plan: Plan, axes: Sequence[Axes] | Panels | None = None) -> Panels:
    """Plot the ZMP from above, and its margin over time.

    It is that of the whole robot for plans that promise contact forces. For others the body's
    centre is taken as a point mass. Support polygons are areas, or lines for two feet.
    The margin is the distance from the polygon's border, negative outside; for two feet it is minus
    the distance from their line. Times of flight, in which there is no ZMP, are shaded.

    Source: [XiLing], "Stability and Gait Control", Section 3;
    [Wang2024], Sections 2 to 4.

    Args:
        plan: any plan.
        axes: where to draw ``(2,)``; by default a new figure.

    Returns:
        The axes ``(2,)``: from above, and the margin over time.

    Raises:
        InputError: the axes have another shape.
    """
    check_kind("plan", plan, Plan)
    times, zmp, margins, standing = zmp_line(plan)
    places = plan.footholds.array.reshape(-1, 3)
    known = np.isfinite(zmp).all(axis=1)
    points = np.concatenate([places[:, :2], zmp[known]])
    strip = panel_height(points, WIDTH - 2.2)
    drawn = panels(axes, (2,), WIDTH, strip + 3.4, height_ratios=(strip + 0.3, 2.1))
    above, margin_axes = drawn
    for leg, colour in LEG_COLOURS.items():
        above.plot(*plan.footholds[leg][:, :2].T, "o", color=colour, markersize=3.5, gid=leg)
    keys = [line_key("body's centre", "#8da7c7", width=2.6), line_key(_name(plan), ZMP_COLOUR)]
    keys += [*_draw_supports(above, plan), *leg_keys()]
    centre = plan.at(np.linspace(0.0, plan.duration, SAMPLES)).cog
    above.plot(*centre[:, :2].T, color=CENTRE_COLOUR, linewidth=2.6, alpha=0.5, gid="centre",
               zorder=4)  # fmt: skip
    above.plot(*zmp.T, color=ZMP_COLOUR, linewidth=1.0, gid="ZMP", zorder=5)
    style_axes(above, f"{plain(plan.robot.name)}: from above", "x [m]", "y [m]", grid=False)
    fit_limits(above, points, 0.06)
    true_proportions(above)
    add_legend(above, keys, **BESIDE)
    _draw_margin(margin_axes, plan, times, margins, standing)
    return drawn


def _name(plan: Plan) -> str:
    """Whose ZMP is drawn."""
    return "its ZMP" if plan.settings.promised_forces is None else "the robot's ZMP"


def zmp_line(plan: Plan) -> tuple[FloatArray, FloatArray, FloatArray, BoolArray]:
    """The ZMP of the whole robot, or of the body's centre as a point mass, and its margin.

    It is the whole robot's where contact forces are promised.

    Returns:
        Times ``(n,)`` [s], with the ends of all phases; the ZMP ``(n, 2)`` [m] and its margin
        ``(n,)`` [m], both NaN in flight; and which feet stand ``(n, 4)``.
    """
    phases = tuple(p for p in plan.phases if p.duration > 0)
    if not phases:
        times, standing = np.array([0.0, plan.duration]), np.ones((2, len(LEGS)), dtype=np.bool_)
        inner = times
    else:
        count = 8 * int(np.clip(SAMPLES // len(phases), 1, 8)) + 1
        share = np.linspace(0.0, 1.0, count)
        ends = np.array([[p.start, p.duration] for p in phases])
        times = (ends[:, :1] + ends[:, 1:] * share).ravel()
        inner = (ends[:, :1] + ends[:, 1:] * np.clip(share, INSIDE, 1.0 - INSIDE)).ravel()
        standing = np.repeat(support_table(phases), count, axis=0)
    feet = plan.at(np.minimum(inner, plan.duration)).feet
    any_foot = standing.any(axis=1)
    level = np.where(standing, feet[..., 2], 0.0).sum(axis=1) / np.maximum(standing.sum(axis=1), 1)
    ground = level - plan.robot.foot_radius
    if plan.settings.promised_forces is None:
        zmp = cart_table_zmp(*centre_motion(plan, inner), ground)
    else:
        moved = motion_of_path(plan.robot, *(plan.path.evaluate(inner, k) for k in range(3)))
        zmp = whole_body_zmp(plan.robot.model, *moved, ground)
    zmp[~any_foot] = np.nan
    return times, zmp, support_margin(feet, standing, zmp), standing


def centre_motion(plan: Plan, times: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Place [m] and acceleration [m/s^2] of the body's centre at ``times (N,)``: ``(N, 3)``."""
    values, rates, accelerations = (plan.path.evaluate(times, k) for k in range(3))
    rpy = values[:, 3:6]
    to_world = rpy_to_matrix(rpy)
    arm = plan.robot.body_axes @ plan.robot.centre
    omega = rpy_rates_to_angular(rpy, rates[:, 3:6])
    alpha = rpy_accelerations_to_angular(rpy, rates[:, 3:6], accelerations[:, 3:6])
    # Of the centre relative to the base's origin, in the base's axes.
    relative = np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
    return (
        np.asarray(values[:, :3] + to_world @ arm),
        np.asarray(accelerations[:, :3] + np.einsum("nij,nj->ni", to_world, relative)),
    )


def _draw_supports(ax: Axes, plan: Plan) -> list[Any]:
    """Draw the support polygons of all phases as areas, and as lines where two feet stand.

    Returns:
        Entries of the legend.
    """
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.patches import Patch
    from scipy.spatial import ConvexHull, QhullError

    lines, areas = [], []
    middles = [min(p.start + p.duration / 2.0, plan.duration) for p in plan.phases]
    feet = plan.at(middles).feet[..., :2] if middles else np.empty((0, len(LEGS), 2))
    for phase, places in zip(plan.phases, feet, strict=True):
        corners = places[[LEGS.index(leg) for leg in phase.support]]
        if len(corners) == 2:
            lines.append(corners)
        elif len(corners) > 2:
            try:
                areas.append(corners[ConvexHull(corners).vertices])
            except QhullError:  # feet in one line support no area
                lines.append(corners)
    fills = PolyCollection(areas, facecolor=SUPPORT_COLOUR, alpha=0.02, linewidth=0, gid="areas")
    ax.add_collection(fills)
    edges = PolyCollection(areas, facecolor="none", edgecolor=SUPPORT_COLOUR, alpha=0.2,
                           linewidth=0.5)  # fmt: skip
    ax.add_collection(edges)
    ax.add_collection(LineCollection(lines, color=SUPPORT_COLOUR, linewidth=0.7, alpha=0.7,
                                     gid="lines"))  # fmt: skip
    keys = []
    if areas:
        keys += [Patch(facecolor=AREA_COLOUR, edgecolor=SUPPORT_COLOUR, linewidth=0.5,
                       label="support areas")]  # fmt: skip
    if lines:
        keys += [line_key("support lines", SUPPORT_COLOUR, width=0.7)]
    return keys


def _draw_margin(
    ax: Axes, plan: Plan, times: FloatArray, margins: FloatArray, standing: BoolArray
) -> None:
    """Draw the margin over time, with times of flight shaded."""
    from matplotlib.patches import Patch

    flights = [p for p in plan.phases if not p.support and p.duration > 0]
    for phase in flights:
        ax.axvspan(phase.start, phase.end, color=MUTED, alpha=0.3, linewidth=0, gid="flight")
    on_line, keys = standing.sum(axis=1) < 3, []
    for chosen, colour, name in (
        (~on_line, CENTRE_COLOUR, "in an area"), (on_line, ZMP_COLOUR, "from a line")
    ):  # fmt: skip
        if np.isfinite(margins[chosen]).any():
            y = np.where(chosen, 1e3 * margins, np.nan)
            ax.plot(times, y, color=colour, linewidth=1.2, gid=name)
            keys.append(line_key(name, colour))
    ax.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
    least = f", smallest {_millimetres(margins)}" if np.isfinite(margins).any() else ""
    style_axes(ax, f"Margin of the ZMP{least}", "time [s]", "margin [mm]")
    ax.set_xlim(time_limits(plan))
    if flights:
        keys.append(Patch(facecolor=MUTED, alpha=0.3, label="flight: no ZMP"))
    add_legend(ax, keys, **BESIDE)


def _millimetres(margins: FloatArray) -> str:
    """The smallest margin [m] as a text; a rounding error below zero is zero."""
    return f"{round(1e3 * float(np.nanmin(margins)), 1) + 0.0:.1f} mm".replace("-", "−")
