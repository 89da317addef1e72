"""The paper's swing over its board, and TOPP-RA's package beside it."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from gaitopt import MissingPackageError
from gaitopt.optimize.spline.obstacle_swing import ObstacleSwing
from gaitopt.studies import swing_study as reference
from gaitopt.studies.swing_study import PAPER_LIMITS as TABLE_1


@pytest.fixture(scope="module")
def paper() -> ObstacleSwing:
    """The paper's case: frog1 over its board, 13 waypoints, Table I."""
    return reference.paper_swing()


def test_comparison_puts_all_side_by_side(paper: ObstacleSwing) -> None:
    comparison = reference.compare_splines(with_toppra=False)
    rows = {row.name: row for row in comparison.rows}
    ours = rows["ours, least time"]
    assert ours.duration == pytest.approx(paper.spline.duration, rel=1e-9)
    floor = rows["no curve through these knots can be faster than"].duration
    assert floor < ours.duration < rows["equal intervals, stretched (by hand)"].duration
    for row in comparison.rows:
        assert np.isnan(row.shares).all() or max(row.shares) <= 1 + 1e-9
    np.testing.assert_allclose(comparison.intervals.sum(axis=0), [ours.duration, 8.4982])
    table = comparison.table()
    assert all(row.name in table and f"{row.duration:.4f}" in table for row in comparison.rows)
    assert f"{paper.spline.intervals[4]:.4f}     0.5917" in table


def test_toppra_along_our_own_curve_is_a_lower_bound(paper: ObstacleSwing) -> None:
    """It has no jerk bound, so it is faster; its acceleration limit holds to a few per cent."""
    spline = paper.spline
    dense = spline.evaluate(np.linspace(0, spline.duration, 401))
    along = reference.toppra_reference(dense, TABLE_1)
    assert 0.8 * spline.duration < along.duration < spline.duration
    assert along.velocity < 1.01 and along.acceleration < 1.05
    knots = reference.toppra_reference(spline.angles, TABLE_1)
    assert knots.duration == pytest.approx(along.duration, rel=0.05)


def test_without_toppra_the_error_says_how_to_install_it(
    paper: ObstacleSwing, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "toppra", None)
    with pytest.raises(MissingPackageError, match="pip install toppra"):
        reference.toppra_reference(paper.spline.angles, TABLE_1)
    assert reference.main() == 0
    printed = capsys.readouterr().out
    assert "ours, least time" in printed and "pip install toppra" in printed
