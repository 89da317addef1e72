"""Fig. 11 of [Wang2024] with its cycloids, and all swing curves next to each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.swing.catalogue import SWING_CURVES, swing_curve
from gaitopt.swing.curve import SwingCurve
from gaitopt.swing.cycloid import CycloidSwing
from gaitopt.viewing.figures.common import (
    BESIDE,
    INK,
    MUTED,
    NORMAL,
    SMALL,
    add_legend,
    line_key,
    shared_dashes,
    style_axes,
    style_space_axis,
)
from gaitopt.viewing.figures.panels import Panels, new_figure, panel, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PAPER_START, PAPER_END, PAPER_HEIGHT, PAPER_PERIOD = (-10, -10, 0), (40, 40, 0), 20, 1.0
"""Numbers of Fig. 11 in [Wang2024]. It states no unit of length; here they are millimetres."""
PAPER_DUTIES = {"trot": 0.5, "walk": 0.25}
"""Share of the swing in the period, in the same figure."""
GAIT_COLOURS = {"trot": "#1b4f8f", "walk": "#b35806"}
WALK_OFFSET = 20.0
"""How far the walk's curve is drawn to the front, since both curves are the same in space [mm]."""
DOT_INTERVAL = 0.025
"""Time between two dots [s]. Chosen here: a tenth of the walk's swing."""
CURVE_COLOURS = ("#5a5a5a", "#1b4f8f", "#2e9e5b", "#b35806", "#8e4585", "#c2a30a")


def plot_cycloids(ax: Axes | None = None) -> Axes:
    """Plot the paper's two cycloids in three dimensions, with dots at equal times.

    The foot swings along the same curve in trot and walk, in the walk in half the time. The walk's
    curve is drawn in front of the other. The dotted line is the curve as it is printed, which
    begins backwards and goes too far (``docs/papers.md``, errata).

    Source: Fig. 11 and eqs. (17)-(20) of [Wang2024].

    Args:
        ax: where to draw, axes with ``projection="3d"``; by default a new figure.

    Returns:
        The axes.

    Raises:
        InputError: the axes have two dimensions.
    """
    own = ax is None
    if ax is None:
        ax = new_figure(7.5, 3.9, None).add_axes((-0.02, 0.0, 0.82, 1.0), projection="3d")
    keys = _draw_cycloids(panel(ax, 0.0, 0.0))
    title = (
        f"Cycloids with a dot every {1e3 * DOT_INTERVAL:g} ms; walk drawn {WALK_OFFSET:g} mm "
        "to the front"
    )
    if own:
        ax.figure.text(0.02, 0.945, title, fontsize=NORMAL, color=INK)
        ax.figure.legend(handles=keys, loc="center right", fontsize=SMALL, frameon=False)
    else:
        ax.set_title(title, fontsize=NORMAL, color=INK)
        add_legend(ax, keys)
    return ax


def _draw_cycloids(ax: Any) -> list[Any]:
    """Draw the cycloids into axes of three dimensions; returns the entries of the legend."""
    if ax.name != "3d":
        raise InputError('ax must have three dimensions: figure.add_subplot(projection="3d")')
    keys = []
    for gait, duty in PAPER_DUTIES.items():
        curve = paper_cycloid(gait)
        offset = np.array([0.0, -WALK_OFFSET if gait == "walk" else 0.0, 0.0])
        duration = float(curve.duration)
        line = 1e3 * curve.position(np.linspace(0.0, duration, 200)) + offset
        dots = 1e3 * curve.position(np.arange(0.0, duration + 1e-9, DOT_INTERVAL)) + offset
        ax.plot(*line.T, color=GAIT_COLOURS[gait], linewidth=1.6, gid=gait)
        ax.plot(*dots.T, "o", color=GAIT_COLOURS[gait], markersize=3.5, gid=f"{gait} dots")
        shadow = np.vstack([line, line[::-1] * [1.0, 1.0, 0.0]])
        ax.plot(*shadow.T, color=GAIT_COLOURS[gait], linewidth=0.4, alpha=0.5)
        keys.append(
            line_key(f"{gait}: μ = {duty:g},\n{duration:g} s in the air", GAIT_COLOURS[gait])
        )
    ax.plot(*as_printed().T, ":", color=MUTED, linewidth=1.3, gid="as printed")
    keys.append(line_key("trot as printed,\n2 sin σ", MUTED, "--"))
    keys[-1].set_linestyle(":")
    _style_space(ax)
    return keys


def paper_cycloid(gait: str) -> CycloidSwing:
    """The cycloid of the paper's ``"walk"`` or ``"trot"`` (Fig. 11), in metres and seconds."""
    start, end = (np.array(place) / 1e3 for place in (PAPER_START, PAPER_END))
    return CycloidSwing(start, end, PAPER_HEIGHT / 1e3, PAPER_DUTIES[gait] * PAPER_PERIOD)  # type: ignore[arg-type]


def as_printed() -> FloatArray:
    """The curve of eqs. (17)-(19) as printed, for the ends of Fig. 11 ``(n, 3)`` [mm].

    Only the y in eq. (19) is replaced by z.
    """
    sigma = np.linspace(0.0, 2.0 * np.pi, 200)[:, None]
    start, end = (np.array(place, dtype=np.float64) for place in (PAPER_START, PAPER_END))
    curve = start + (end - start) * (sigma - 2.0 * np.sin(sigma)) / (2.0 * np.pi)
    curve[:, 2:] = start[2] + PAPER_HEIGHT * (1.0 - np.cos(sigma)) / 2.0
    return np.asarray(curve)


def _style_space(ax: Any) -> None:
    """Set the same scale for all three axes, their labels and a faint grid."""
    ax.set(xlim=(-20, 50), ylim=(-35, 50), zlim=(0, 25))
    ax.set_box_aspect((70, 85, 25), zoom=1.22)
    ax.view_init(elev=24, azim=-62)
    for axis, name in zip((ax.xaxis, ax.yaxis, ax.zaxis), "xyz", strict=True):
        style_space_axis(axis, f"{name} [mm]")
    ax.set_zticks((0, 10, 20))
    ax.tick_params(labelsize=SMALL - 1, pad=0)


def plot_swing_curves(
    length: float = 0.15, height: float = 0.06, duration: float = 0.25, rise: float = 0.0,
    axes: Sequence[Axes] | Panels | None = None,
) -> Panels:  # fmt: skip
    """Plot all swing curves from the side with dots at equal times, and height and speed over time.

    Args:
        length: of the step [m].
        height: of the swing above the higher end [m].
        duration: time in the air [s].
        rise: how much higher the foot lands than it lifts off [m].
        axes: where to draw ``(8,)``; by default a new figure.

    Returns:
        The axes ``(8,)``: one for each of the six curves, then height and speed over time.

    Raises:
        InputError: a number is out of range, or there are more axes or fewer.
    """
    curves = {
        name: swing_curve(name, (0.0, 0.0, 0.0), (length, 0.0, rise), height, duration)
        for name in SWING_CURVES
    }
    drawn = _curve_panels(len(curves)) if axes is None else panels(axes, (len(curves) + 2,), 0, 0)
    *sides, height_axes, speed_axes = drawn
    for ax, (name, curve), colour in zip(sides, curves.items(), CURVE_COLOURS, strict=True):
        _draw_side(ax, name, curve, colour, first=ax is sides[0])
    times = np.linspace(0.0, duration, 2001)
    heights = [1e3 * curve.position(times)[:, 2] for curve in curves.values()]
    for name, colour, y, dashes in zip(
        curves, CURVE_COLOURS, heights, shared_dashes(heights), strict=True
    ):
        height_axes.plot(times, y, color=colour, linewidth=1.6, linestyle=dashes, gid=name,
                         dash_capstyle="butt")  # fmt: skip
        rate = np.linalg.norm(curves[name].velocity(times), axis=-1)
        label = f"{name}: {float(curves[name].peak_speed):.2f} m/s"
        speed_axes.plot(times, rate, color=colour, linewidth=1.3, label=label, gid=name)
    style_axes(height_axes, "Height over time", "time [s]", "height [mm]")
    style_axes(speed_axes, "Speed over time", "time [s]", "speed of the foot [m/s]")
    height_axes.set_xlim(0.0, duration)
    speed_axes.set(xlim=(0.0, duration), ylim=(0.0, None))
    add_legend(speed_axes, title="largest speed", title_fontsize=SMALL, **BESIDE)
    return drawn


def _curve_panels(curves: int) -> Panels:
    """Panels of a new figure: a row of ``curves`` small ones, and two below."""
    figure = new_figure(10.0, 4.7)
    grid = figure.add_gridspec(2, 1, height_ratios=(1.0, 1.9))
    sides: list[Axes] = []
    upper, lower = grid[0].subgridspec(1, curves), grid[1].subgridspec(1, 2)
    for i in range(curves):
        first = sides[0] if sides else None
        sides.append(figure.add_subplot(upper[i], sharex=first, sharey=first))
        sides[-1].tick_params(labelleft=first is None)
    below = [figure.add_subplot(lower[i]) for i in range(2)]
    return np.array([*sides, *below], dtype=object)


def _draw_side(ax: Axes, name: str, curve: SwingCurve, colour: str, first: bool) -> None:
    """Draw one curve in the x-z plane; the ``first`` one has a label at its vertical axis."""
    duration = float(curve.duration)
    line = 1e3 * curve.position(np.linspace(0.0, duration, 500))
    dots = 1e3 * curve.position(np.linspace(0.0, duration, 21))
    ax.plot(line[:, 0], line[:, 2], color=colour, linewidth=1.5, gid=name)
    ax.plot(dots[:, 0], dots[:, 2], "o", color=colour, markersize=2.5)
    style_axes(ax, name, "along [mm]", "height [mm]" if first else "")
    ax.margins(0.1)
    ax.set_aspect("equal", adjustable="box")
