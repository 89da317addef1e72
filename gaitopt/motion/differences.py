"""Derivatives by finite differences."""

from __future__ import annotations

from collections.abc import Callable

from gaitopt.conventions import FloatArray

_STEP = 2e-4


def time_derivatives(
    values: Callable[[FloatArray], FloatArray], times: FloatArray, h: float = _STEP
) -> tuple[FloatArray, FloatArray]:
    """First and second derivatives of smooth ``values(times)``, to fourth order in ``h``."""
    far = [values(times + k * h) for k in (-2, -1, 0, 1, 2)]
    first = (far[0] - 8.0 * far[1] + 8.0 * far[3] - far[4]) / (12.0 * h)
    second = (-far[0] + 16.0 * far[1] - 30.0 * far[2] + 16.0 * far[3] - far[4]) / (12.0 * h**2)
    return first, second
