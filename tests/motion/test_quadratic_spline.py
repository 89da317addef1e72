"""Quadratic splines that begin and end at rest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BSpline

from gaitopt.motion.quadratic_spline import neighbours, parabola_weights, spline_parabolas

KNOTS = 9


def test_they_are_splines() -> None:
    """Against scipy's B-splines, on even spans and away from the ends."""
    points = np.random.default_rng(1).normal(size=(KNOTS, 2))
    spline = BSpline(0.2 * np.arange(-1, KNOTS + 2), points, 2)
    a, b, c = spline_parabolas(points, np.full(KNOTS, 0.2))
    for t in (0.0, 0.06, 0.2):
        wanted = spline(0.2 * np.arange(1, KNOTS - 1) + t)
        assert ((a * t + b) * t + c)[1:-1] == pytest.approx(wanted, abs=1e-12)


def test_velocities_are_continuous_and_zero_at_both_ends() -> None:
    rng = np.random.default_rng(2)
    points, spans = rng.normal(size=(KNOTS, 3)), rng.uniform(0.1, 0.3, KNOTS)
    a, b, c = spline_parabolas(points, spans)
    length = spans[:, None]
    place, velocity = (a * length + b) * length + c, 2.0 * a * length + b
    assert place[:-1] == pytest.approx(c[1:], abs=1e-12)
    assert velocity[:-1] == pytest.approx(b[1:], abs=1e-12)
    assert b[0] == pytest.approx(0.0) and velocity[-1] == pytest.approx(0.0, abs=1e-12)
    assert c[0] == pytest.approx(points[0]) and place[-1] == pytest.approx(points[-1])


def test_weights_add_up_to_one_place() -> None:
    """A spline whose control points are all in one place stays there."""
    weights = parabola_weights(np.random.default_rng(3).uniform(0.1, 0.3, KNOTS))
    at = np.einsum("cki,ki->ck", weights, neighbours(np.ones(KNOTS)))
    assert at == pytest.approx(np.tile([[0.0], [0.0], [1.0]], KNOTS), abs=1e-12)
