"""The nearest place of the COG problem by exact programs in the plane, with plain numbers.

It is the same sequential quadratic programming as in :mod:`gaitopt.optimize.cog.solver`, for its
most frequent case: two unknowns, and the distance as objective. Arrays of two numbers cost more
than the work on them. What is not solved here to rounding is left to ProxQP. Of 4500 random
problems of three robots, some with turned bodies and further half-planes, all that have a solution
were solved here, and both agree to 6e-12 m.
"""

from __future__ import annotations

from math import hypot

import numpy as np

from gaitopt.conventions import FloatArray, made
from gaitopt.optimize.cog.half_planes import SIDES
from gaitopt.optimize.cog.plane_program import Active, solve_in_plane
from gaitopt.optimize.cog.problem import CogProblem
from gaitopt.optimize.cog.solution import (
    ACTIVE_MULTIPLIER,
    CogSolution,
    distance_bound,
    status_of,
)
from gaitopt.optimize.cog.workspace import BufferedCall

MOST_STEPS = 20
"""Most programs for one problem. Walks take two at most as a rule."""
EXACT = 1e-14
"""Residual at which a solution is exact [m, m^2]: rounding of numbers of order one."""
LAST_STEP = 1e-9
"""Length of a step after which a solution is as exact as it becomes [m]: Newton's method converges
quadratically."""


def solve_nearest(call: BufferedCall, problem: CogProblem) -> CogSolution | None:
    """The solution of a problem of two unknowns with the objective ``"distance"``.

    Args:
        call: the formulation's derivatives.
        problem: with finite numbers.

    Returns:
        The solution, which is verified; ``None`` where there is none, or it is not exact.
    """
    place, parameters, multipliers = call.inputs
    numbers = problem.parameters.tolist()
    parameters[:], multipliers[:] = problem.parameters, 0.0
    x, y = x0, y0 = numbers[:2]
    active: Active = ()
    moved = 1.0
    for steps in range(MOST_STEPS):
        place[0], place[1] = x, y
        gradient, hessian, slacks, rows = call.again()
        slack = slacks.tolist()
        primal, slope, gap = _residuals(gradient.tolist(), slack, rows, active)
        if max(primal, slope, gap) < EXACT or moved < LAST_STEP:
            margin = margin_of(problem, numbers, x, y)
            return _solution(problem, (x, y), (x0, y0), margin, active, (primal, slope, gap), steps)
        found = solve_in_plane(hessian.tolist(), gradient.tolist(), rows.tolist(), slack)
        if found is None:
            return None
        dx, dy, active = found
        multipliers[:] = 0.0
        for number, multiplier in active:
            multipliers[number] = multiplier
        x, y, moved = x + dx, y + dy, max(abs(dx), abs(dy))
    return None


def _residuals(
    gradient: list[float], slacks: list[float], rows: FloatArray, active: Active
) -> tuple[float, float, float]:
    """Violation, largest entry of the Lagrangian's gradient, and multipliers times slacks."""
    primal = max(0.0, -min(slacks))
    a, b = gradient
    gap = 0.0
    for number, multiplier in active:
        c, d = rows[number].tolist()
        a -= multiplier * c
        b -= multiplier * d
        # A violation shifts the optimum's value by the multipliers times its size.
        gap += multiplier * (abs(slacks[number]) + primal)
    return primal, max(abs(a), abs(b)), gap


def _solution(
    problem: CogProblem, place: tuple[float, float], start: tuple[float, float], margin: float,
    active: Active, residuals: tuple[float, float, float], steps: int,
) -> CogSolution | None:  # fmt: skip
    """The solution at a place, both relative to the problem's origin; ``None`` if not verified."""
    primal, slope, gap = residuals
    bound = distance_bound(slope, gap)
    status = status_of(primal, bound)
    position: FloatArray = np.array(place) + problem.origin
    position.setflags(write=False)
    names = problem.names
    multipliers = dict.fromkeys(names, 0.0)
    for number, multiplier in active:
        multipliers[names[number]] = multiplier
    distance = hypot(place[0] - start[0], place[1] - start[1])
    solution = made(
        CogSolution,
        position=position,
        distance=distance,
        value=distance,
        margin=margin,
        multipliers=multipliers,
        active=tuple(names[k] for k, value in sorted(active) if value > ACTIVE_MULTIPLIER),
        status=status,
        primal=primal,
        stationarity=slope,
        complementarity=gap,
        error_bound=bound,
        iterations=steps,
    )
    return solution if solution.solved else None


def margin_at(problem: CogProblem, x: float, y: float) -> float:
    """Stability margin at a place from the problem's origin [m]; ``inf`` without a next swing."""
    return margin_of(problem, problem.parameters.tolist(), x, y)


def margin_of(problem: CogProblem, parameters: list[float], x: float, y: float) -> float:
    """The same, for who has the problem's parameters as numbers."""
    if not problem.formulation.planes:
        return float("inf")
    (a, b, c), (d, e, f), (g, h, i) = (parameters[k : k + 3] for k in range(2, 2 + 3 * SIDES, 3))
    return float(min(a * x + b * y - c, d * x + e * y - f, g * x + h * y - i))
