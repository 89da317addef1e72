"""Whether the derivatives of a problem are those of its values, by central differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

STEP = 1e-6
"""Of the differences."""


def check_derivatives(
    problem: Any, x: np.ndarray, rng: np.random.Generator, products: float, matrix: float
) -> None:
    """Products with the Jacobian, and the band of Newton's matrix, against differences.

    Args:
        problem: of the interior-point method.
        x: unknowns ``(n,)``.
        rng: for the directions.
        products: tolerance of products with the Jacobian.
        matrix: tolerance of the matrix, as a share of its largest number.
    """
    here = problem.linearise(x)
    units = np.eye(len(x))
    jacobian = np.array([
        (problem.values(x + STEP * e) - problem.values(x - STEP * e)) / (2 * STEP) for e in units
    ]).T  # fmt: skip
    dx, v = rng.normal(size=len(x)), rng.normal(size=len(here.values))
    assert here.jacobian_times(dx) == pytest.approx(jacobian @ dx, abs=products)
    assert here.jacobian_transpose_times(v) == pytest.approx(jacobian.T @ v, abs=products)
    scale, multipliers = rng.random((2, len(v)))
    band = here.newton_matrix(scale, multipliers)
    full = np.zeros((len(x),) * 2)
    for below, row in enumerate(band):
        for column in range(len(x) - below):
            full[column + below, column] = full[column, column + below] = row[column]
    moved = [problem.linearise(x + s * STEP * e).jacobian_transpose_times(multipliers)
             for e in units for s in (1, -1)]  # fmt: skip
    hessian = (np.array(moved[::2]) - np.array(moved[1::2])) / (2 * STEP)
    wanted = jacobian.T @ (scale[:, None] * jacobian) - hessian
    assert np.abs(full - wanted).max() <= matrix * np.abs(wanted).max()
