"""A crawl takes any swing: from foothold to foothold, as high as asked, and certified."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gaitopt
from gaitopt import InputError, Quadruped, swing_curve
from gaitopt.planners.phase_by_phase.swing_polylines import swing_polylines
from gaitopt.swing.catalogue import SWINGS

lengths = st.floats(-0.3, 0.3)


@pytest.mark.parametrize("name", SWINGS)
@given(x=lengths, y=lengths, z=st.floats(-0.1, 0.1), height=st.floats(0.0, 0.2))
def test_polylines_lead_from_end_to_end_and_rise_to_the_swing_height(
    name: str, x: float, y: float, z: float, height: float
) -> None:
    start, end = np.array([[0.1, 0.2, 0.3]]), np.array([[0.1 + x, 0.2 + y, 0.3 + z]])
    (line,) = swing_polylines(name, start, end, height)
    np.testing.assert_allclose(line[[0, -1]], [start[0], end[0]], atol=1e-12)
    assert line[:, 2].max() == pytest.approx(max(0.3, 0.3 + z) + height, abs=1e-12)
    assert line[:, 2].min() >= min(0.3, 0.3 + z) - 1e-9
    # All in the upright plane through both ends.
    across = (line - start[0])[:, :2] @ np.array([-y, x])
    assert np.abs(across).max() <= 1e-9


def test_points_of_a_curve_s_polyline_lie_on_the_curve() -> None:
    starts, ends = np.zeros((2, 3)), np.array([[0.1, 0.0, 0.0], [0.0, 0.1, 0.05]])
    lines = swing_polylines("half-ellipse", starts, ends, 0.07)
    for line, end in zip(lines, ends, strict=True):
        curve = swing_curve("half-ellipse", np.zeros(3), end, 0.07, 2.0)
        np.testing.assert_allclose(line, curve.position(np.linspace(0, 2, len(line))), atol=1e-12)


@pytest.mark.parametrize("name", SWINGS)
def test_crawls_with_any_swing_are_certified(wang: Quadruped, name: str) -> None:
    plan = gaitopt.plan_crawl(wang, gaitopt.s_columns(4, columns=3), swing=name, timing="velocity")
    certificate = gaitopt.verify(plan, collisions=False)
    assert certificate.ok, certificate.report()
    assert certificate["joint velocities"].worst == pytest.approx(1.0)


def test_every_other_swing_is_faster_than_the_box(wang: Quadruped) -> None:
    """A box is the longest path of this height."""
    terrain = gaitopt.s_columns(4, columns=3)
    times = {
        n: gaitopt.plan_crawl(wang, terrain, swing=n, timing="velocity").duration for n in SWINGS
    }
    assert max(times, key=times.__getitem__) == "box"


def test_uneven_ground_and_other_robots(wang: Quadruped) -> None:
    rough = gaitopt.s_columns(5, columns=3, height_jitter=0.03)
    plan = gaitopt.plan_crawl(
        wang, rough, swing="parabola path", follow_terrain=True, timing="velocity"
    )
    assert gaitopt.verify(plan, collisions=False).ok


def test_unknown_swings_are_refused(wang: Quadruped) -> None:
    with pytest.raises(InputError, match="swing must be one of box"):
        gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=2), swing="loop", timing="velocity")
