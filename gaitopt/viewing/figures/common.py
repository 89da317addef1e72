"""What the figures share: paper and ink, thinning to screen resolution, steps and cycles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import check_count
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.viewing.colours import LEG_COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK = "#222222"
MUTED = "#8a8a8a"
SMALL, NORMAL = 8.0, 9.5
PIXELS = 1200
"""Columns of a wide panel at 150 dpi; lines with more points than that are thinned."""
LONGEST = 12.0
"""Panels in true proportions may be this many times as wide as high."""


def new_figure(
    width: float, height: float, layout: Literal["compressed"] | None = "compressed"
) -> Figure:
    """An empty figure of ``width`` times ``height`` [inch] that pyplot knows nothing of."""
    from matplotlib.figure import Figure

    # "compressed" is "constrained" that also knows of axes in true proportions.
    return Figure(figsize=(width, height), layout=layout)


def panel(ax: Axes | None, width: float, height: float) -> tuple[Figure, Axes]:
    """``ax`` with its figure, or the one panel of a new figure of that size [inch]."""
    if ax is None:
        figure = new_figure(width, height)
        return figure, figure.add_subplot()
    if ax.figure is None:
        raise InputError("ax belongs to no figure; make it with figure.add_subplot()")
    # The figure of a figure is itself, that of a subfigure the whole one.
    return ax.figure.figure, ax


def dress(ax: Axes, title: str, x: str, y: str, *, grid: bool = True) -> None:
    """Title, axis labels (with their units) and sober axes."""
    ax.set_title(title, fontsize=NORMAL, color=INK, loc="left")
    ax.set_xlabel(x, fontsize=NORMAL, color=INK)
    ax.set_ylabel(y, fontsize=NORMAL, color=INK)
    ax.tick_params(labelsize=SMALL, colors=INK, width=0.6, length=3)
    for side, spine in ax.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_linewidth(0.6)
    ax.set_axisbelow(True)
    if grid:
        ax.grid(True, color="#e6e6e6", linewidth=0.5)


def add_legend(ax: Axes, handles: list[Any] | None = None, **where: Any) -> None:
    """A small frameless legend, of the labelled artists unless ``handles`` are given."""
    chosen = {} if handles is None else {"handles": handles}
    ax.legend(**chosen, **{"fontsize": SMALL, "frameon": False, "handlelength": 1.8, **where})


def line_key(label: str, colour: str, style: Literal["-", "--"] = "-", width: float = 1.5) -> Any:
    """A line for a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=colour, linestyle=style, linewidth=width, label=label)


def dot_key(label: str, colour: str, marker: str = "o", fill: str | None = None) -> Any:
    """A marker for a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], linestyle="", marker=marker, markersize=6, label=label,
                  markeredgecolor=colour, markerfacecolor=fill or colour)  # fmt: skip


def leg_keys(marker: str = "o") -> list[Any]:
    """A legend's entries for the four legs, in the order of [Wang2020]."""
    return [dot_key(leg, colour, marker) for leg, colour in LEG_COLOURS.items()]


def true_proportions(ax: Axes) -> None:
    """Equal axes; a walk much longer than wide is stretched sideways, and says so."""
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    stretch = max(1.0, np.ceil((x1 - x0) / (y1 - y0) / LONGEST))
    ax.set_aspect(stretch, adjustable="box")
    if stretch > 1:
        ax.set_ylabel(f"{ax.get_ylabel()}\ndrawn ×{stretch:g}")


def strip_height(points: FloatArray, width: float) -> float:
    """Height [inch] that a panel of ``width`` needs for ``points (n, >=2)`` in true proportions."""
    span = np.ptp(points[:, :2], axis=0) + 0.15
    return float(np.clip(width * span[1] / span[0], width / LONGEST, 0.6 * width))


def seconds(time: float) -> str:
    """A time for a label."""
    return f"{time:.1f} s" if time >= 10.0 else f"{time:.3f} s"


def fit(ax: Axes, points: FloatArray, pad: float) -> None:
    """Limits that hold ``points (n, >=2)`` and ``pad`` around them [m]."""
    low, high = points[:, :2].min(axis=0) - pad, points[:, :2].max(axis=0) + pad
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])


def thinned(t: FloatArray, y: FloatArray, columns: int = PIXELS) -> tuple[FloatArray, FloatArray]:
    """The points of a line that are seen: first, lowest, highest and last of each pixel column.

    Args:
        t: increasing times ``(n,)``.
        y: values ``(n,)``.
        columns: pixel columns over the whole of ``t``.

    Returns:
        Times and values ``(m,)``, a subset in the same order, ``m <= max(n, 4 columns)``.
    """
    if len(t) <= 4 * columns or t[-1] <= t[0]:
        return t, y
    column = np.minimum((t - t[0]) / (t[-1] - t[0]) * columns, columns - 1).astype(int)
    by_time = np.flatnonzero(np.diff(column, prepend=-1, append=columns))
    order = np.lexsort((y, column))
    ends = np.concatenate([by_time[:-1], by_time[1:] - 1])
    kept = np.unique(np.concatenate([ends, order[ends]]))
    return t[kept], y[kept]


def walk_times(plan: Plan, most: int = 4 * PIXELS) -> FloatArray:
    """Times that show a plan's motion: its knots, some between, and not many more than ``most``."""
    knots = plan.path.times
    pieces = 1 if plan.path.degree <= 1 else int(np.clip(most // len(knots), 2, 32))
    if len(knots) * pieces > 2 * most:
        return np.linspace(0.0, plan.duration, most)
    inner = knots[:-1, None] + np.diff(knots)[:, None] * (np.arange(pieces) / pieces)
    return np.append(inner.ravel(), knots[-1])


def forward_axis(plan: Plan) -> FloatArray:
    """The walk's forward direction ``(2,)``."""
    heading = plan.settings.heading
    return np.array([np.cos(heading), np.sin(heading)])


def steps_of(plan: Plan) -> int:
    """Number of steps in a plan."""
    return 1 + max((p.step for p in plan.phases), default=-1)


def step_phases(plan: Plan, step: int) -> tuple[Phase | None, Phase | None]:
    """The stance phase before a step and the swing phase of it; ``None`` where there is none.

    Raises:
        InputError: there is no such step.
    """
    count = steps_of(plan)
    if not count:
        raise InputError(f"step {step!r} cannot be drawn: the plan has no steps")
    check_count("step", step, 0, count - 1)
    mine = [p for p in plan.phases if p.step == step]
    stance = next((p for p in mine if p.kind == "stance"), None)
    return stance, next((p for p in mine if p.kind == "swing"), None)


def cycle_phases(plan: Plan, cycle: int | None) -> tuple[int, tuple[Phase, ...]]:
    """The number and the phases of a gait cycle; of the middle one by default.

    A cycle lasts until the leg that swung first is about to swing again. A plan without steps has
    one cycle, without phases.

    Raises:
        InputError: there is no such cycle.
    """
    first = plan.phases[0].leg if plan.phases else ""
    starts, step = [], -1
    for i, phase in enumerate(plan.phases):
        if phase.step != step and phase.leg == first:
            starts.append(i)
        step = phase.step
    count = max(len(starts), 1)
    chosen = count // 2 if cycle is None else check_count("cycle", cycle, 0, count - 1)
    edges = [*starts, len(plan.phases)] if starts else [0, 0]
    return chosen, plan.phases[edges[chosen] : edges[chosen + 1]]


def cycle_title(number: int, phases: tuple[Phase, ...]) -> str:
    """Name of a gait cycle, with its steps."""
    if not phases:
        return "No gait cycle: the plan has no steps"
    return f"Gait cycle {number} (steps {phases[0].step} to {phases[-1].step})"


def span_of(phases: tuple[Phase, ...]) -> tuple[float, float]:
    """First start and last end of ``phases`` [s]; a second when they take no time."""
    if not phases or not phases[-1].end > phases[0].start:
        return (phases[0].start, phases[0].start + 1.0) if phases else (0.0, 1.0)
    return phases[0].start, phases[-1].end


def time_limits(plan: Plan) -> tuple[float, float]:
    """The whole plan [s]; a second for a plan that takes no time."""
    return 0.0, plan.duration if plan.duration > 0 else 1.0


def during(plan: Plan, span: tuple[float, float]) -> tuple[Phase, ...]:
    """The phases that take place within ``span`` [s]."""
    return tuple(p for p in plan.phases if p.end > span[0] and p.start < span[1])


def support_table(phases: tuple[Phase, ...]) -> BoolArray:
    """Which legs stand in each phase ``(P, 4)``."""
    return np.array([[leg in p.support for leg in LEGS] for p in phases], dtype=np.bool_)


def shade_swings(ax: Axes, phases: tuple[Phase, ...]) -> None:
    """Tint the times at which feet fly in the colours of their legs."""
    for phase in phases:
        for leg in phase.flying if phase.duration > 0 else ():
            ax.axvspan(phase.start, phase.end, color=LEG_COLOURS[leg], alpha=0.13, linewidth=0)
