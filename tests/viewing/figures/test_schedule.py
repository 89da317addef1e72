"""Gait diagrams show the schedule, and the figure of the leg orders their margins."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.gait.crawl import CRAWL_SEQUENCES
from gaitopt.gait.gaits import bound, crawl, quasi_static, trot, walk, wave
from gaitopt.gait.longitudinal import longitudinal_margin
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.figures.panels import figure_of
from gaitopt.viewing.figures.schedule import plot_gait_diagram, plot_margin_over_duty

GAITS = [walk(1.0), walk(2.0, 0.83), trot(0.6), trot(0.5, 0.35), quasi_static(0.8), bound(0.5, 0.2),
         wave(1.0, 0.9), crawl(CRAWL_SEQUENCES[3], 1.0)]  # fmt: skip


def bars(ax: Axes, gid: str) -> list[tuple[float, float]]:
    """Starts and ends of the bars with a name, from left to right."""
    paths = [p for c in ax.collections if c.get_gid() == gid for p in c.get_paths()]
    return sorted(tuple(float(x) for x in p.get_extents().intervalx) for p in paths)


def words(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.axes[0].texts]


@pytest.mark.parametrize("schedule", GAITS, ids=lambda g: f"{g.name} {g.duty_factor:g}")
@pytest.mark.parametrize("cycles", [1, 2, 5])
def test_bars_are_the_times_at_which_legs_stand(schedule: GaitSchedule, cycles: int) -> None:
    (ax,) = figure_of(plot_gait_diagram(schedule, cycles)).axes
    t = (np.arange(2000) + 0.5) / 2000 * cycles
    support = schedule.support(t * schedule.cycle_time)
    for i, leg in enumerate(LEGS):
        drawn = np.any([(t >= a) & (t < b) for a, b in bars(ax, leg)], axis=0)
        clear = np.abs(t[:, None] - np.ravel(bars(ax, leg))).min(axis=1) > 1e-9
        np.testing.assert_array_equal(drawn[clear], support[clear, i])
    assert ax.get_xlim() == (0, cycles)


def test_bars_have_the_legs_colours_and_names() -> None:
    (ax,) = figure_of(plot_gait_diagram(walk(1.0))).axes
    names = dict(zip(ax.get_yticks(), (t.get_text() for t in ax.get_yticklabels()), strict=True))
    for leg, colour in LEG_COLOURS.items():
        (collection,) = (c for c in ax.collections if c.get_gid() == leg)
        rows = [p.get_extents().intervaly.mean() for p in collection.get_paths()]
        assert {names[round(row)] for row in rows} == {leg}
        from matplotlib.colors import to_hex

        assert to_hex(collection.get_facecolor()[0]) == colour


@pytest.mark.parametrize("schedule", GAITS, ids=lambda g: f"{g.name} {g.duty_factor:g}")
def test_lowest_row_counts_the_feet_that_stand(schedule: GaitSchedule) -> None:
    figure = figure_of(plot_gait_diagram(schedule, 1))
    found = bars(figure.axes[0], "feet")
    intervals = schedule.intervals(schedule.cycle_time)
    expected = [(i.start / schedule.cycle_time, i.end / schedule.cycle_time) for i in intervals]
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)
    counts = [w for w in words(figure) if w.isdigit()]
    assert counts == [
        str(len(i.support)) for i in intervals if i.duration > 0.015 * schedule.cycle_time
    ]


def test_duty_factor_and_offsets_are_marked() -> None:
    figure = figure_of(plot_gait_diagram(walk(1.0, 0.8)))
    assert {"β = 0.8", "φ = 0", "φ = 0.25", "φ = 0.5", "φ = 0.75"} <= set(words(figure))
    assert figure.axes[0].get_title(loc="left") == "Walk: β = 0.8, cycle 1 s"


def test_flight_is_reported() -> None:
    title = figure_of(plot_gait_diagram(trot(0.5, 0.35))).axes[0].get_title(loc="left")
    assert title == "Trot: β = 0.35, cycle 0.5 s, in flight for 30 % of it"


@pytest.mark.parametrize("wrong", [0, 21, 1.5, True, None])
def test_a_number_of_cycles_that_cannot_be_drawn_is_refused(wrong: object) -> None:
    with pytest.raises(InputError, match="cycles must be a whole number from 1 to 20, got"):
        plot_gait_diagram(walk(1.0), wrong)  # type: ignore[arg-type]


def test_lines_are_the_margins_of_the_leg_orders() -> None:
    duties = np.array([0.75, 0.8, 0.95])
    (ax,) = figure_of(plot_margin_over_duty(duties, stride=0.2, length=0.5)).axes
    lines = {line.get_gid(): line for line in ax.lines}
    for order in CRAWL_SEQUENCES:
        expected = [1e3 * longitudinal_margin(crawl(order, 1.0, d), 0.2, 0.5) for d in duties]
        np.testing.assert_allclose(lines[" ".join(order)].get_ydata(), expected)
    expected = [1e3 * longitudinal_margin(wave(1.0, d), 0.2, 0.5) for d in duties]
    np.testing.assert_allclose(lines["wave"].get_ydata(), expected)
    for name in ("wave", *map(" ".join, CRAWL_SEQUENCES)):
        np.testing.assert_array_equal(lines[name].get_xdata(), duties)


def test_every_order_is_in_the_legend_and_the_axes_have_units() -> None:
    (ax,) = figure_of(plot_margin_over_duty()).axes
    legend = ax.get_legend()
    assert legend is not None
    labels = [text.get_text() for text in legend.get_texts()]
    assert labels == ["RH RF LH LF, as a wave", *map(" ".join, CRAWL_SEQUENCES)]
    assert "[mm]" in ax.get_ylabel() and "[-]" in ax.get_xlabel()
    assert "stride 0.3 m, hips 0.6 m apart" in ax.get_title(loc="left")


def test_figures_go_into_given_axes() -> None:
    figure = Figure()
    first, second = figure.subplots(2)
    assert plot_gait_diagram(trot(1.0), ax=first) is first
    assert plot_margin_over_duty(ax=second) is second
    assert len(figure.axes) == 2 and first.get_title(loc="left") and second.get_title(loc="left")
