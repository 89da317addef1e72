"""The race as bars: the time of each row."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import check_array, check_kind
from gaitopt.viewing.figures.common import INK, MUTED, SMALL, plain, style_axes
from gaitopt.viewing.figures.panels import panel
from gaitopt.viewing.replay.runners import BASELINE, lane_colour, short_time

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_race(
    times: Mapping[str, ArrayLike], *, baseline: str = BASELINE, ax: Axes | None = None
) -> Axes:
    """Plot a bar for each row of a race: the median of its times, with their range.

    Args:
        times: of each row, by its name: one for each terrain ``(n,)`` [s]; ``nan`` where there is
            no plan. The terrains are the same for all rows.
        baseline: name of the row with which the others are compared. The median over all terrains
            of its time divided by a row's time is written beside that row's bar. If there is no
            such row, no ratios are written.
        ax: where to draw; by default a new figure.

    Returns:
        The axes.

    Raises:
        InputError: there are no rows, or rows have different numbers of times.
    """
    check_kind("times", times, Mapping)
    # NaN is a row without a plan.
    values = {
        str(name): np.atleast_1d(check_array(f"times of {name}", t)) for name, t in times.items()
    }
    counts = {len(v) for v in values.values()}
    if len(counts) != 1 or any(v.ndim != 1 for v in values.values()):
        raise InputError(
            "each name must have the same number of times (n,), got "
            + (", ".join(f"{name} {v.shape}" for name, v in values.items()) or "no name")
        )
    ax = panel(ax, 7.2, 0.6 + 0.38 * len(values))
    for place, (name, v) in enumerate(values.items()):
        _bar(ax, place, name, v, values.get(baseline), name == baseline)
    several = f" (median and range over {counts.pop()} terrains)" if max(counts) > 1 else ""
    style_axes(ax, f"Time over the same footholds{several}", "time [s]", "")
    ax.grid(False, axis="y")
    ax.set_yticks(range(len(values)), [plain(name) for name in values])
    ax.invert_yaxis()
    ax.set_xlim(0.0, 1.2 * max(np.nanmax(v, initial=0.0) for v in values.values()) or 1.0)
    return ax


def _bar(
    ax: Axes, place: int, name: str, times: FloatArray, base: FloatArray | None, is_base: bool
) -> None:
    """Draw the bar of one row."""
    known = times[np.isfinite(times)]
    if not known.size:
        ax.text(0.0, place, " no plan", va="center", fontsize=SMALL, color=MUTED)
        return
    middle = float(np.median(known))
    ax.barh(place, middle, height=0.66, color=lane_colour(name, place), alpha=0.9)
    if known.size > 1:
        spread = [[middle - known.min()], [known.max() - middle]]
        ax.errorbar(middle, place, xerr=spread, color=INK, linewidth=1.0, capsize=2.5)
    label = short_time(middle)
    ratios = np.array([]) if base is None else (base / times)[np.isfinite(base / times)]
    if ratios.size and not is_base:
        label += f"   {np.median(ratios):.2f}×"
    ax.annotate(label, (float(known.max()), place), (6, 0), textcoords="offset points",
                va="center", fontsize=SMALL, color=INK)  # fmt: skip
