"""Derivatives by finite differences."""

from __future__ import annotations

from collections.abc import Callable

from gaitopt.conventions import FloatArray

STEP = 1e-4
"""Step of the differences [s], chosen here for motions that take tenths of a second.

The first derivative's error by rounding is about 1e-12 of the values, the second's 1e-8; those by
the step are of the order of its fourth power, 1e-16, times the values' fifth and sixth derivatives.
Knees of solo12 turn at 40 rad/s within milliseconds: with twice the step velocities on both sides
of knots were 6e-6 rad/s apart.
"""


def time_derivatives(
    values: Callable[[FloatArray], FloatArray], times: FloatArray, h: float = STEP
) -> tuple[FloatArray, FloatArray]:
    """First and second derivatives of a smooth function, by central differences of five values.

    Args:
        values: the function; gives ``(N, n)`` at times ``(N,)``.
        times: where the derivatives are taken ``(N,)`` [s].
        h: step [s]; errors are of the order of its fourth power.

    Returns:
        Both derivatives ``(N, n)``.
    """
    return values_and_derivatives(values, times, h)[1:]


def values_and_derivatives(
    values: Callable[[FloatArray], FloatArray], times: FloatArray, h: float = STEP
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The function at ``times`` as well, and both derivatives of :func:`time_derivatives`."""
    far = [values(times + k * h) for k in (-2, -1, 0, 1, 2)]
    first = (far[0] - 8.0 * far[1] + 8.0 * far[3] - far[4]) / (12.0 * h)
    second = (-far[0] + 16.0 * far[1] - 30.0 * far[2] + 16.0 * far[3] - far[4]) / (12.0 * h**2)
    return far[2], first, second
