"""The figure of the joint splines draws the splines, and the limits that they keep."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt.studies.swing_figures import plot_splines
from gaitopt.studies.swing_study import PAPER_LIMITS, SplineComparison, compare_splines
from gaitopt.viewing.figures.panels import figure_of


@pytest.fixture(scope="module")
def comparison() -> SplineComparison:
    return compare_splines(with_toppra=False)


def test_ours_keeps_the_limits_drawn_and_reaches_one(comparison: SplineComparison) -> None:
    figure = figure_of(plot_splines(comparison))
    shares = []
    for joint in range(2):
        for order, bound in ((1, PAPER_LIMITS.velocity), (2, PAPER_LIMITS.acceleration)):
            ax = figure.axes[2 * order + joint]
            ours = np.asarray(ax.lines[0].get_ydata(), dtype=float)
            limits = [np.asarray(line.get_ydata(), dtype=float)[0] for line in ax.lines[-2:]]
            assert sorted(limits) == pytest.approx(np.degrees([-bound[joint], bound[joint]]))
            shares.append(np.abs(ours).max() / np.degrees(bound[joint]))
    assert max(shares) == pytest.approx(1.0, abs=1e-3)


def test_the_paper_s_curve_lasts_as_long_as_the_paper_says(comparison: SplineComparison) -> None:
    ax = figure_of(plot_splines(comparison)).axes[2]
    theirs = np.asarray(ax.lines[1].get_xdata(), dtype=float)
    assert theirs[-1] == pytest.approx(8.4982, abs=1e-4)
    assert [line.get_label() for line in ax.lines][:2] == [
        f"ours, {comparison.swing.spline.duration:.3f} s",
        "the paper's intervals on our knots, 8.498 s",
    ]
