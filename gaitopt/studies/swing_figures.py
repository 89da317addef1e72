"""The joint spline of a swing and one with the paper's intervals: [Shao2011], Fig. 6."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gaitopt.optimize.spline.joint_spline import JointSpline, uniform_spline
from gaitopt.studies.swing_study import PAPER_INTERVALS, PAPER_LIMITS, SplineComparison
from gaitopt.viewing.figures.common import INK, MUTED
from gaitopt.viewing.figures.panels import Panels, legend_below, panels

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

JOINTS = ("hip", "knee")
ROWS = ("angle [deg]", "velocity [deg/s]", "acceleration [deg/s²]", "jerk [deg/s³]")
OURS, THEIRS = "#1b4f8f", "#b45309"


def plot_splines(
    comparison: SplineComparison, axes: Sequence[Axes] | Panels | None = None
) -> Panels:
    """Plot angles, velocities, accelerations and jerks of both joints over time.

    The paper gives its twelve intervals, but not its thirteen waypoints. So the spline with its
    intervals passes through our knots here: where that exceeds a limit, the paper's own curve need
    not.

    Args:
        comparison: from :func:`gaitopt.studies.swing_study.compare_splines`.
        axes: where to draw ``(4, 2)``; by default a new figure.

    Returns:
        The axes ``(4, 2)``: a row for each derivative, hip and knee.

    Raises:
        InputError: the axes have another shape.
    """

    ours = comparison.swing.spline
    theirs = uniform_spline(ours.angles, PAPER_LIMITS, PAPER_INTERVALS)
    theirs = theirs.stretched(float(PAPER_INTERVALS.sum()) / theirs.duration)
    drawn = panels(axes, (4, 2), 11.0, 9.0, sharex=True)
    for joint, name in enumerate(JOINTS):
        for order, row in enumerate(ROWS):
            ax = drawn[order, joint]
            _draw(ax, ours, joint, order, OURS, "-", f"ours, {ours.duration:.3f} s")
            _draw(ax, theirs, joint, order, THEIRS, "--",
                  f"the paper's intervals on our knots, {theirs.duration:.3f} s")  # fmt: skip
            _limits(ax, joint, order)
            ax.set_ylabel(row)
            ax.grid(alpha=0.3)
        drawn[0, joint].set_title(f"RF {name}", loc="left")
        drawn[-1, joint].set_xlabel("time [s]")
    handles, _ = drawn[1, 0].get_legend_handles_labels()
    legend_below(drawn, handles, own=axes is None, ncols=3)
    return drawn


def _draw(
    ax: Axes, spline: JointSpline, joint: int, order: int, colour: str, style: str, label: str
) -> None:
    """Draw one derivative of one joint; the jerk is constant between knots and jumps at them."""
    if order == 3:
        jerks = np.degrees(6.0 * spline.coefficients[0, :, joint])
        ax.stairs(jerks, spline.times, color=colour, linestyle=style, label=label, baseline=None)
        return
    times = np.linspace(0.0, spline.duration, 801)
    ax.plot(times, np.degrees(spline.evaluate(times, order)[:, joint]), color=colour,
            linestyle=style, label=label)  # fmt: skip
    if order == 0:
        ax.plot(spline.times, np.degrees(spline.angles[:, joint]), "o", color=colour, markersize=3)


def _limits(ax: Axes, joint: int, order: int) -> None:
    """Draw the limits of one derivative of one joint."""
    if not order:
        return
    bound = (PAPER_LIMITS.velocity, PAPER_LIMITS.acceleration, PAPER_LIMITS.jerk)[order - 1]
    for sign in (-1.0, 1.0):
        ax.axhline(sign * float(np.degrees(bound[joint])), color=INK if sign > 0 else MUTED,
                   linewidth=0.8, linestyle=":",
                   label="limits of Table I" if sign > 0 else None)  # fmt: skip
