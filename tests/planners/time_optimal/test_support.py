"""Sides of support polygons, against margins that are computed in another way."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt import Footholds, Quadruped, static_stability_margin
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.knots import Flying
from gaitopt.planners.time_optimal.support import support_on_spans, support_sides
from gaitopt.planners.time_optimal.walk import prepare_route


def feet_at_random(count: int) -> np.ndarray:
    """Feet near the corners of a rectangle ``(count, 4, 3)``."""
    corners = np.array([[0.3, 0.2, 0.0], [-0.3, 0.2, 0.0], [-0.3, -0.2, 0.0], [0.3, -0.2, 0.0]])
    return corners + np.random.default_rng(0).normal(scale=0.05, size=(count, 4, 3))


@pytest.mark.parametrize("flies", [False, True])
def test_the_nearest_side_is_as_far_as_the_margin(flies: bool) -> None:
    feet = feet_at_random(20)
    leg = np.arange(20) % 4
    points = np.random.default_rng(1).normal(scale=0.1, size=(20, 2))
    sides = support_sides(feet, Flying(np.full(20, flies), leg))
    distance = np.einsum("nsi,ni->ns", sides.normal, points) - sides.offset
    for i in range(20):
        standing = [k for k in range(4) if not (flies and k == leg[i])]
        margin = static_stability_margin(feet[i, standing], points[i])
        assert distance[i].min() == pytest.approx(margin, abs=1e-12)
        assert sides.exists[i].sum() == (3 if flies else 4)


def test_every_knot_has_the_sides_of_the_feet_that_stand_on_its_span(
    wang: Quadruped, short: Footholds
) -> None:
    knots, _ = build_route(prepare_route(wang, short, RouteSettings(timing="velocity")))
    rows = support_on_spans(knots)
    assert (np.diff(rows.knot) >= 0).all()
    counts = np.bincount(rows.knot, minlength=len(knots.feet))
    assert np.array_equal(counts, np.where(knots.flying_on_spans.flies, 3, 4))
