"""Convex quadratic programs in the plane, solved exactly with a few numbers.

At the optimum of such a program at most two constraints set the point. So it is found by going from
the free minimum over one active constraint to two, each time to the constraint that is violated
most; this is the dual method of [Goldfarb1983], which needs two or three such steps here.
ProxQP takes 13 us for a program of this size, and the way to it from Python as much again.
"""

from __future__ import annotations

from collections.abc import Sequence

VIOLATED = 1e-15
"""Violation from which a constraint counts [m]: rounding of coordinates below a metre."""
PARALLEL = 1e-12
"""Determinant of two normals, in the metric of the inverse Hessian, over the product of their
squared lengths, below which they count as parallel."""
MOST_EXCHANGES = 12
"""Most constraints that are taken up. Problems of walks take two at most as a rule."""

Active = tuple[tuple[int, float], ...]
"""Active constraints: the number and the multiplier of each."""


def solve_in_plane(
    hessian: Sequence[Sequence[float]],
    gradient: Sequence[float],
    rows: Sequence[Sequence[float]],
    slacks: Sequence[float],
) -> tuple[float, float, Active] | None:
    """Minimise ``x H x / 2 + g x`` over ``a_i x + s_i >= 0`` in the plane.

    Args:
        hessian: ``(2, 2)``, positive definite.
        gradient: ``g (2,)``.
        rows: the normals ``a_i`` ``(m, 2)``.
        slacks: ``s_i (m,)``.

    Returns:
        The minimiser's two coordinates, and the active constraints, whose multipliers are not
        negative. ``None`` where none was found: there is none, or rounding is in the way.
    """
    (h11, h12), (_, h22) = hessian
    determinant = h11 * h22 - h12 * h12
    if not (h11 > 0.0 and determinant > 0.0):
        return None
    i11, i12, i22 = h22 / determinant, -h12 / determinant, h11 / determinant
    g1, g2 = gradient
    free1, free2 = -i11 * g1 - i12 * g2, -i12 * g1 - i22 * g2
    x, y = free1, free2
    active: Active = ()
    for _ in range(MOST_EXCHANGES):
        worst, number = -VIOLATED, -1
        for i, (a, b) in enumerate(rows):
            value = a * x + b * y + slacks[i]
            if value < worst and all(i != k for k, _ in active):
                worst, number = value, i
        if number < 0:
            return x, y, active
        a, b = rows[number]
        u1, u2 = i11 * a + i12 * b, i12 * a + i22 * b
        own = a * u1 + b * u2
        missing = -(a * free1 + b * free2 + slacks[number])
        found: Active | None = None
        for k, _ in active:
            c, d = rows[k]
            v1, v2 = i11 * c + i12 * d, i12 * c + i22 * d
            other, between = c * v1 + d * v2, a * v1 + b * v2
            area = own * other - between * between
            if area <= PARALLEL * own * other:
                continue
            absent = -(c * free1 + d * free2 + slacks[k])
            mine = (other * missing - between * absent) / area
            its = (own * absent - between * missing) / area
            if mine >= 0.0 and its >= 0.0 and _keeps_others(
                active, k, rows, slacks,
                free1 + mine * u1 + its * v1, free2 + mine * u2 + its * v2,
            ):  # fmt: skip
                found = ((k, its), (number, mine))
                x, y = free1 + mine * u1 + its * v1, free2 + mine * u2 + its * v2
                break
        if found is None:
            # The constraint alone, if those that were active hold there.
            if own <= 0.0 or missing < 0.0:
                return None
            mine = missing / own
            x, y = free1 + mine * u1, free2 + mine * u2
            if not _keeps_others(active, -1, rows, slacks, x, y):
                return None
            found = ((number, mine),)
        active = found
    return None


def _keeps_others(
    active: Active, but: int, rows: Sequence[Sequence[float]], slacks: Sequence[float],
    x: float, y: float,
) -> bool:  # fmt: skip
    """Whether active constraints other than ``but`` hold at a point."""
    for k, _ in active:
        if k != but and rows[k][0] * x + rows[k][1] * y + slacks[k] < -VIOLATED:
            return False
    return True
