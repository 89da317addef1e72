"""What figures share: colours, axes, legends, lines of few points, and phases of a plan."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import check_count
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.robots.xml_text import shown
from gaitopt.viewing.colours import LEG_COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INK = "#222222"
"""Colour of text and of lines that belong to no leg."""
MUTED = "#8a8a8a"
"""Colour of lines in the background."""
GRID_COLOUR = "#e6e6e6"
SMALL, NORMAL = 8.0, 9.5
"""Sizes of text: legends and ticks; titles and labels [pt]."""
DASHED = (0, (4, 3))
"""Line style of limits."""
BESIDE: dict[str, Any] = {"loc": "center left", "bbox_to_anchor": (1.01, 0.5)}
"""Place of a legend on the right of its axes."""
PIXELS = 1200
"""Pixel columns of a panel: 8 inches at 150 dpi. Lines need no more points than these can show."""
LONGEST = 12.0
"""Largest ratio of width to height of a panel in true proportions. Chosen here: a flatter one is
hard to read."""


def plain(name: str) -> str:
    """A name from a file or a user as a figure shows it: in one line, and never as a formula.

    Two dollar signs would begin one, which may not even be well formed.
    """
    return shown(name).replace("$", r"\$")


def style_axes(ax: Axes, title: str, x: str, y: str, *, grid: bool = True) -> None:
    """Set title and axis labels, show only the left and lower axis, and a faint grid if wanted."""
    ax.set_title(title, fontsize=NORMAL, color=INK, loc="left")
    ax.set_xlabel(x, fontsize=NORMAL, color=INK)
    ax.set_ylabel(y, fontsize=NORMAL, color=INK)
    ax.tick_params(labelsize=SMALL, colors=INK, width=0.6, length=3)
    for side, spine in ax.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_linewidth(0.6)
    ax.set_axisbelow(True)
    if grid:
        ax.grid(True, color=GRID_COLOUR, linewidth=0.5)


def style_space_axis(axis: Any, label: str) -> None:
    """Set the label of an axis of three-dimensional axes, with a faint grid on white."""
    axis.set_label_text(label, fontsize=SMALL)
    axis.pane.set_facecolor("white")
    # Matplotlib has no public way to the grid of three-dimensional axes.
    axis._axinfo["grid"].update(color=GRID_COLOUR, linewidth=0.5)


def add_legend(ax: Axes, handles: list[Any] | None = None, **options: Any) -> None:
    """Add a small legend without frame.

    Args:
        ax: where to add it.
        handles: entries; those of the labelled artists by default.
        options: of :meth:`matplotlib.axes.Axes.legend`, for instance :data:`BESIDE`.
    """
    chosen = {} if handles is None else {"handles": handles}
    ax.legend(**chosen, **{"fontsize": SMALL, "frameon": False, "handlelength": 1.8, **options})


def line_key(
    label: str, colour: str, style: Literal["-", "--", ":"] = "-", width: float = 1.5
) -> Any:
    """A line as an entry of a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=colour, linestyle=style, linewidth=width, label=label)


def dot_key(label: str, colour: str, marker: str = "o", fill: str | None = None) -> Any:
    """A marker as an entry of a legend."""
    from matplotlib.lines import Line2D

    return Line2D([], [], linestyle="", marker=marker, markersize=6, label=label,
                  markeredgecolor=colour, markerfacecolor=fill or colour)  # fmt: skip


def leg_keys(marker: str = "o") -> list[Any]:
    """Entries of a legend for the four legs, in the order of [Wang2020]."""
    return [dot_key(leg, colour, marker) for leg, colour in LEG_COLOURS.items()]


def text_colour_on(colour: str) -> str:
    """Dark or white, whichever is easier to read on ``colour``.

    The brightness is that of ITU-R BT.601; its threshold of 0.6 is chosen for the legs' colours.
    """
    from matplotlib.colors import to_rgb

    return INK if float(np.dot(to_rgb(colour), (0.299, 0.587, 0.114))) > 0.6 else "white"


def shared_dashes(lines: Sequence[FloatArray]) -> list[Any]:
    """Line styles with which lines that coincide are all visible.

    Each of them gets its own part of one row of dashes.

    Args:
        lines: values of each line at the same abscissae ``(n,)``. Two lines coincide where they
            differ by 1e-6 at most, of the unit in which they are drawn.
    """
    groups = [[j for j, other in enumerate(lines) if np.allclose(other, line, rtol=0, atol=1e-6)]
              for line in lines]  # fmt: skip
    return [(5.0 * group.index(i), (5.0, 5.0 * (len(group) - 1))) if len(group) > 1 else "-"
            for i, group in enumerate(groups)]  # fmt: skip


def true_proportions(ax: Axes) -> None:
    """Set the same scale for both axes; a long walk is drawn wider, and the label says so."""
    (x0, x1), (y0, y1) = ax.get_xlim(), ax.get_ylim()
    stretch = max(1.0, np.ceil((x1 - x0) / (y1 - y0) / LONGEST))
    ax.set_aspect(stretch, adjustable="box")
    if stretch > 1:
        ax.set_ylabel(f"{ax.get_ylabel()}\ndrawn ×{stretch:g}")


def panel_height(points: FloatArray, width: float) -> float:
    """Height [inch] of a panel of a ``width`` for ``points (n, >=2)`` in true proportions."""
    span = np.ptp(points[:, :2], axis=0) + 0.15
    return float(np.clip(width * span[1] / span[0], width / LONGEST, 0.6 * width))


def time_label(time: float) -> str:
    """A time [s] as a label."""
    return f"{time:.1f} s" if time >= 10.0 else f"{time:.3f} s"


def fit_limits(ax: Axes, points: FloatArray, pad: float) -> None:
    """Set the limits of both axes so that they contain ``points (n, >=2)`` and a border ``pad``."""
    low, high = points[:, :2].min(axis=0) - pad, points[:, :2].max(axis=0) + pad
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])


def thinned_to_pixels(
    t: FloatArray, y: FloatArray, columns: int = PIXELS
) -> tuple[FloatArray, FloatArray]:
    """A line with fewer points that looks the same.

    Of each pixel column, the first, the lowest, the highest and the last point are kept.

    Args:
        t: increasing times ``(n,)``.
        y: values ``(n,)``.
        columns: number of pixel columns over the whole of ``t``.

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


def times_to_draw(plan: Plan, most: int = 4 * PIXELS) -> FloatArray:
    """Times at which a plan's motion is drawn ``(n,)`` [s]: its knots and some between.

    They are about ``most`` at the most.
    """
    knots = plan.path.times
    pieces = 1 if plan.path.degree <= 1 else int(np.clip(most // len(knots), 2, 32))
    if len(knots) * pieces > 2 * most:
        return np.linspace(0.0, plan.duration, most)
    inner = knots[:-1, None] + np.diff(knots)[:, None] * (np.arange(pieces) / pieces)
    return np.append(inner.ravel(), knots[-1])


def forward_axis(plan: Plan) -> FloatArray:
    """Unit vector of the walk's heading ``(2,)``."""
    heading = plan.settings.heading
    return np.array([np.cos(heading), np.sin(heading)])


def steps_of(plan: Plan) -> int:
    """Number of steps in a plan."""
    return 1 + max((p.step for p in plan.phases), default=-1)


def step_phases(plan: Plan, step: int) -> tuple[Phase | None, Phase | None]:
    """The stance phase before a step and its swing phase; ``None`` where there is none.

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
    """Index and phases of a gait cycle; of the middle one by default.

    A cycle ends before the leg that swung first swings again. A plan without steps has one cycle
    without phases.

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
    """Title of a gait cycle with its steps."""
    if not phases:
        return "No gait cycle: the plan has no steps"
    return f"Gait cycle {number} (steps {phases[0].step} to {phases[-1].step})"


def span_of(phases: tuple[Phase, ...]) -> tuple[float, float]:
    """First start and last end of ``phases`` [s]; one second for phases that take no time."""
    if not phases or not phases[-1].end > phases[0].start:
        return (phases[0].start, phases[0].start + 1.0) if phases else (0.0, 1.0)
    return phases[0].start, phases[-1].end


def time_limits(plan: Plan) -> tuple[float, float]:
    """Start and end of a plan [s]; one second for a plan that takes no time."""
    return 0.0, plan.duration if plan.duration > 0 else 1.0


def phases_within(plan: Plan, span: tuple[float, float]) -> tuple[Phase, ...]:
    """The phases that overlap ``span`` [s]."""
    return tuple(p for p in plan.phases if p.end > span[0] and p.start < span[1])


def support_table(phases: tuple[Phase, ...]) -> BoolArray:
    """Which legs stand in each of ``P`` phases ``(P, 4)``."""
    return np.array([[leg in p.support for leg in LEGS] for p in phases], dtype=np.bool_)


def shade_swings(ax: Axes, phases: tuple[Phase, ...]) -> None:
    """Shade the times of swings in the colours of their legs."""
    for phase in phases:
        for leg in phase.flying if phase.duration > 0 else ():
            ax.axvspan(phase.start, phase.end, color=LEG_COLOURS[leg], alpha=0.13, linewidth=0)
