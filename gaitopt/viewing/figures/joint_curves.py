"""Figs. 13 and 14 of [Wang2024]: angles, velocities and accelerations of joints over time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, leg_index
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_kind
from gaitopt.motion.path import MotionPath
from gaitopt.plan.plan import Plan
from gaitopt.robots.leg_names import as_leg
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.common import (
    DASHED,
    INK,
    MUTED,
    NORMAL,
    SMALL,
    line_key,
    plain,
    style_axes,
    thinned_to_pixels,
    time_limits,
)
from gaitopt.viewing.figures.panels import Panels, legend_below, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

JOINTS = ("roll", "hip", "knee")
"""Joints of a leg from the body to the foot: the angles 1, 2 and 3 of the paper."""
QUANTITIES = (("angle", "deg"), ("velocity", "deg/s"), ("acceleration", "deg/s²"))
"""Names and units of the derivatives, by their order."""
LEAST_RANGES = (2.0, 20.0, 200.0)
"""Least range of a vertical axis, in these units, so that a joint at rest is a straight line.
Chosen here: without it rounding errors would fill the panel."""
DIAGONALS = (("LF", "RH"), ("RF", "LH"))
"""Diagonal legs: the first of each pair is a wide line, the second a dashed one upon it."""
WIDE, THIN = 3.6, 1.2
"""Widths of these lines [pt]."""
LARGEST_RATIO = 4.0
"""Limits are drawn where the axis becomes at most this many times as long as its curves' range.
Chosen here: with farther limits the curves would be too flat to read."""
JUMP = 0.01
"""Share of a curve's range from which a jump is drawn as a gap."""
POINTS = 9000
"""Points of a line before it is thinned out, about: several for each pixel column."""


def plot_joint_curves(
    plan: Plan,
    legs: Iterable[str] | None = None,
    *,
    span: tuple[float, float] | None = None,
    derivatives: Iterable[int] = (0, 1, 2),
    axes: Sequence[Axes] | Panels | None = None,
) -> Panels:
    """Plot angles, velocities and accelerations of the legs' joints over time.

    There is a column for each of roll, hip and knee, and a row for each derivative. A single
    derivative has its joints below each other on a wide time axis. Of two diagonal legs one is a
    wide line and the other a dashed one, so that both are visible where they coincide. Where knees
    point in opposite directions, hip and knee of some legs are drawn with the opposite sign, so
    that they can be compared; the legend names these legs. All lines are exact derivatives of the
    plan's polynomials, and jump where those jump. Limits that are far from the curves are written
    as numbers.

    Source: Figs. 13 and 14 of [Wang2024].

    Args:
        plan: any plan.
        legs: which legs; all by default.
        span: start and end [s]; the whole plan by default.
        derivatives: 0 for angles, 1 for velocities, 2 for accelerations.
        axes: where to draw, an array of the shape that is returned; by default a new figure.

    Returns:
        The axes ``(derivatives, joints)``, or ``(joints, 1)`` for a single derivative.

    Raises:
        InputError: a leg or a derivative is unknown, the span is not within the plan, or the axes
            have another shape.
    """
    check_kind("plan", plan, Plan)
    shown, orders, window = _checked_legs(legs), _checked_orders(derivatives), _window(plan, span)
    joints = JOINTS if any(plan.robot.legs[leg].has_roll for leg in shown) else JOINTS[1:]
    stacked = len(orders) == 1
    rows, columns = (len(joints), 1) if stacked else (len(orders), len(joints))
    size = 9.0 if stacked else 12.0, 0.8 + (1.6 if stacked else 2.1) * rows
    drawn = panels(axes, (rows, columns), *size, sharex=True)
    for i, order in enumerate(orders):
        for j, joint in enumerate(joints):
            ax = drawn[j, 0] if stacked else drawn[i, j]
            _draw_joint(ax, plan, shown, joint, order, window)
            quantity, unit = QUANTITIES[order]
            last, first = ax in drawn[-1], ax in drawn[:, 0]
            symbol = rf"{joint} $\theta_{JOINTS.index(joint) + 1}$"
            style_axes(ax, symbol if ax in drawn[0] and not stacked else "",
                       "time [s]" if last else "",
                       f"{symbol if stacked else quantity} [{unit}]" if first else "")  # fmt: skip
            ax.set_xlim(window)
    if stacked:
        title = f"{plain(plan.robot.name)}: joint {QUANTITIES[orders[0]][0]}s"
        drawn[0, 0].set_title(title, fontsize=NORMAL, color=INK, loc="left")
    _add_keys(drawn, plan, shown, own=axes is None)
    return drawn


def curve_lines(
    path: MotionPath,
    columns: Iterable[int],
    span: tuple[float, float],
    derivative: int = 0,
    points: int = POINTS,
) -> tuple[FloatArray, FloatArray]:
    """A derivative of joint angles as lines that jump where the path's derivative jumps.

    Args:
        path: the plan's path.
        columns: indices of the joints in ``robot.joint_names``.
        span: start and end [s]. Pieces that overlap it are drawn completely.
        derivative: 0, 1, 2 and so on.
        points: number of points of a curved line, about.

    Returns:
        Times ``(m,)`` [s], every knot twice, and exact values ``(m, len(columns))`` [rad/s^k]. A
        piece that is straight has two points, a curved one more.
    """
    ends = np.append(path.times[1:], path.times[-1])[: path.coefficients.shape[1]]
    starts = path.times[: len(ends)]
    seen = np.flatnonzero((starts < span[1]) & ((ends > span[0]) | (ends == starts)))
    count = 2 if path.degree - derivative <= 1 else int(np.clip(points // max(len(seen), 1), 5, 65))
    local = (ends - starts)[seen][:, None] * np.linspace(0.0, 1.0, count)
    chosen = path.coefficients[:, seen][:, :, 6 + np.array(list(columns), dtype=int)]
    values = np.zeros((len(seen), count, chosen.shape[2]))
    for power in range(path.degree, derivative - 1, -1):
        factor = float(np.prod(np.arange(power - derivative + 1, power + 1)))
        values = values * local[..., None] + factor * chosen[path.degree - power][:, None, :]
    times = starts[seen][:, None] + local
    return times.ravel(), values.reshape(-1, chosen.shape[2])


def _draw_joint(
    ax: Axes, plan: Plan, legs: tuple[str, ...], joint: str, order: int,
    span: tuple[float, float],
) -> None:  # fmt: skip
    """Draw the lines of one joint of the legs, and its limits."""
    low, high = np.inf, -np.inf
    owners = tuple(leg for leg in legs if len(plan.robot.legs[leg].joints) >= _from_foot(joint))
    for leg in owners:
        column = plan.robot.leg_columns[leg][-_from_foot(joint)]
        times, values = curve_lines(plan.path, (column,), span, order)
        degrees = _sign(plan, legs, leg, joint) * np.degrees(values[:, 0])
        low, high = min(low, float(degrees.min())), max(high, float(degrees.max()))
        t, y = _with_gaps(*thinned_to_pixels(times, degrees))
        ax.plot(t, y, gid=leg, zorder=3 if _is_wide(leg) else 4, **_style(leg))
    missing = max(LEAST_RANGES[order] - (high - low), 0.0)
    low, high = low - missing / 2.0, high + missing / 2.0
    limits = _limits(plan, legs, owners, joint, order)
    ends = min([low, *limits]), max([high, *limits])
    near = ends[1] - ends[0] <= LARGEST_RATIO * (high - low)
    low, high = ends if near else (low, high)
    for limit in limits if near else ():
        ax.axhline(limit, color=INK, linewidth=0.8, linestyle=DASHED, gid="limit")
    pad = 0.08 * (high - low)
    ax.set_ylim(low - pad, high + (pad if near else 2.5 * pad))
    if limits and not near:
        ax.annotate(_limits_text(limits), (0.99, 0.97), xycoords="axes fraction", ha="right",
                    va="top", fontsize=SMALL - 1, color=MUTED)  # fmt: skip


def _with_gaps(t: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A line with a gap (NaN) wherever it jumps."""
    jumps = np.flatnonzero((np.diff(t) == 0) & (np.abs(np.diff(y)) > JUMP * np.ptp(y))) + 1
    return np.insert(t, jumps, np.nan), np.insert(y, jumps, np.nan)


def _limits_text(limits: list[float]) -> str:
    """Limits as a text."""
    if len(limits) == 2 and limits[0] == -limits[1]:
        return f"limits ±{round(limits[1], 1):.10g}"
    numbers = ", ".join(f"{round(limit, 1):.10g}" for limit in limits).replace("-", "−")
    return f"limit{'s' * (len(limits) > 1)} {numbers}"


def _limits(
    plan: Plan, legs: tuple[str, ...], owners: tuple[str, ...], joint: str, order: int
) -> list[float]:
    """The limits of a joint as it is drawn, sorted, each once [deg], [deg/s] or [deg/s²]."""
    found = set()
    for name in owners:
        leg = plan.robot.legs[name]
        at = -_from_foot(joint)
        speed = leg.velocity_limits[at]
        column = plan.robot.leg_columns[name][at]
        acceleration = plan.settings.joint_accelerations(plan.robot)[column]
        ends = (
            leg.position_limits[:, at], (-speed, speed), (-acceleration, acceleration)
        )[order]  # fmt: skip
        drawn = _sign(plan, legs, name, joint) * np.degrees(ends)
        found |= {float(value) for value in drawn.round(6) + 0.0 if np.isfinite(value)}
    return sorted(found)


def _from_foot(joint: str) -> int:
    """Number of a joint of a leg, counted from the foot, from 1."""
    return len(JOINTS) - JOINTS.index(joint)


def _sign(plan: Plan, legs: tuple[str, ...], leg: str, joint: str) -> float:
    """-1 where a joint turns in the opposite direction to that of the first leg, otherwise 1."""
    signs = []
    for name in (legs[0], leg):
        chosen = plan.robot.legs[name]
        sign = chosen.signs[-min(_from_foot(joint), len(chosen.signs))]
        signs.append(sign if joint == "roll" else sign * chosen.knee)
    return 1.0 if signs[0] == signs[1] else -1.0


def _is_wide(leg: str) -> bool:
    """Whether a leg is the wide line of its diagonal."""
    return leg in (pair[0] for pair in DIAGONALS)


def _style(leg: str) -> dict[str, Any]:
    """The style of a leg's lines."""
    if _is_wide(leg):
        return {"color": LEG_COLOURS[leg], "linewidth": WIDE, "alpha": 0.45}
    return {"color": LEG_COLOURS[leg], "linewidth": THIN, "dashes": (3.5, 1.5)}


def _add_keys(drawn: Panels, plan: Plan, legs: tuple[str, ...], *, own: bool) -> None:
    """Add a legend below the panels, with diagonal legs next to each other."""
    from matplotlib.lines import Line2D

    keys = [Line2D([], [], label=leg, **_style(leg))
            for pair in DIAGONALS for leg in pair if leg in legs]  # fmt: skip
    if any(line.get_gid() == "limit" for ax in drawn.flat for line in ax.lines):
        keys.append(line_key("limit", INK, "--", 0.8))
    opposite = [leg for leg in legs if _sign(plan, legs, leg, "knee") < 0]
    title = ""
    if opposite:
        title = f"{' and '.join(opposite)}: knees on the other side; hip and knee drawn times −1"
    legend_below(drawn, keys, own=own, ncols=5, handlelength=3.2, title=title,
                 title_fontsize=SMALL)  # fmt: skip


def _checked_legs(legs: Iterable[str] | None) -> tuple[str, ...]:
    """The legs in the order of ``LEGS``; raises InputError for unknown ones."""
    chosen = [as_leg(leg) for leg in (LEGS if legs is None else legs)]
    unknown = [leg for leg in chosen if not (isinstance(leg, str) and leg in LEGS)]
    if unknown or not chosen:
        raise InputError(
            f"legs must be some of {', '.join(LEGS)}, got {as_text(unknown[0])}"
            if unknown
            else f"legs must be one or more of {', '.join(LEGS)}, got none"
        )
    return tuple(sorted(set(chosen), key=leg_index))


def _checked_orders(derivatives: Iterable[int]) -> tuple[int, ...]:
    """The orders of the derivatives; raises InputError for others than 0, 1 and 2."""
    orders = tuple(derivatives)
    if not orders or any(isinstance(k, bool) or k not in (0, 1, 2) for k in orders):
        raise InputError(f"derivatives must be one or more of 0, 1 and 2, got {as_text(orders)}")
    return orders


def _window(plan: Plan, span: tuple[float, float] | None) -> tuple[float, float]:
    """Start and end of the time axis [s]; raises InputError where they are not in the plan."""
    if span is None:
        return time_limits(plan)
    try:
        start, end = (float(t) for t in span)
    except (TypeError, ValueError):
        start = end = float("nan")
    if not 0.0 <= start < end <= plan.duration:
        raise InputError(
            f"span must be two increasing times within 0 and {plan.duration:.6g} s, got "
            f"{as_text(span)}"
        )
    return start, end
