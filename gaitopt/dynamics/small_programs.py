"""Linear programs of a few unknowns, by the active-set method DAQP [Arnstrom2022].

No status of a solver is believed: a solution counts if multipliers prove it. HiGHS [Huangfu2018] is
there for programs that DAQP did not solve.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray

NO_BOUND: Final = 1e30
"""What DAQP takes for infinity."""

SOLVER_TOLERANCE: Final = 1e-9
"""Violation of a row that DAQP may leave. Rows are of order one. Its default of 1e-6 is larger than
:data:`ROW_TOLERANCE`."""

ROW_TOLERANCE: Final = 1e-8
"""Violation of a row that counts as rounding: ten times :data:`SOLVER_TOLERANCE`."""

PROGRAM_TOLERANCE: Final = 1e-6
"""The same for programs along paths (:mod:`gaitopt.dynamics.chains.program_sequence`), whose limits
a planner tightens by far more. DAQP leaves up to 2e-7 there; HiGHS, which would leave less, takes
20 times as long. Where torques fall with the speed, and joints turn as fast as they can, the rows
that bound the path acceleration hardly contain it. Multipliers of 100 and more then make an error
of 1e-7 one of 1e-5, and the next interval makes up for it: squared speeds of wang2020 differ by up
to 6 % from those of exact programs, durations by 4e-5. There sweeps over polygons
(:mod:`gaitopt.dynamics.speed_sweeps`) agree with exact programs to 1e-9."""

PROOF_TOLERANCE: Final = 1e-6
"""Error of the multipliers' equation, and of a multiplier times its slack, up to which a linear
program counts as solved. Objectives are shares of the weight or of a torque limit."""

LINEAR_WEIGHT: Final = 1e-7
"""Weight of the squared unknowns in a linear program. It makes the solution unique: of all
solutions the one of least norm. Unknowns are of order one, so it moves the objective by about this
much at most; in general it does not move it at all."""


class LinearSolution(NamedTuple):
    """A minimiser of a linear program.

    Attributes:
        point: the minimiser ``(n,)``.
        multipliers: of the rows ``(m,)``: positive at their upper limit, negative at their lower
            one, and zero where a row holds nothing back.
    """

    point: FloatArray
    multipliers: FloatArray


def solve_linear(
    costs: FloatArray,
    rows: FloatArray,
    low: FloatArray,
    high: FloatArray,
    *,
    tolerance: float = ROW_TOLERANCE,
    by_highs: bool = False,
) -> LinearSolution | None:
    """Minimise ``c x`` over ``low <= A x <= high``.

    Args:
        costs: ``c (n,)``.
        rows: ``A (m, n)``, of order one.
        low: ``(m,)``, at least ``-NO_BOUND``.
        high: ``(m,)``, at most ``NO_BOUND``.
        tolerance: violation of a row that counts as rounding.
        by_highs: solve by HiGHS instead of DAQP: 50 times as slow, and more robust.

    Returns:
        A minimiser; ``None`` when there is none, or none was proven to be one.
    """
    if by_highs:
        return _highs(costs, rows, low, high)
    weight = LINEAR_WEIGHT * np.eye(len(costs))
    point, multipliers = _daqp(weight, costs, rows, low, high)
    gradient = costs + LINEAR_WEIGHT * point
    if not _proven(gradient, rows, low, high, point, multipliers, tolerance):
        return None
    return LinearSolution(point, multipliers)


def _daqp(
    hessian: FloatArray, gradient: FloatArray, rows: FloatArray, low: FloatArray, high: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """DAQP's last point ``(n,)`` and its multipliers ``(m,)``: positive at ``high``."""
    import daqp

    point, _, _, report = daqp.solve(
        hessian, gradient, rows, high, low, np.zeros(len(rows), dtype=np.int32),
        primal_tol=SOLVER_TOLERANCE,
    )  # fmt: skip
    return np.asarray(point), np.asarray(report["lam"])


def _proven(
    gradient: FloatArray,
    rows: FloatArray,
    low: FloatArray,
    high: FloatArray,
    point: FloatArray,
    multipliers: FloatArray,
    tolerance: float,
) -> bool:
    """Whether the multipliers prove that ``point``, which is to keep all rows, is a minimiser."""
    # Where rows contradict each other the last point need not even be finite.
    if not max(np.abs(point).max(), np.abs(multipliers).max()) < NO_BOUND:
        return False
    values = rows @ point
    above, below = high - values, values - low
    slack = np.where(multipliers > 0.0, above, below)
    held = np.abs(multipliers) * slack
    return bool(
        min(above.min(), below.min()) >= -tolerance
        and np.abs(gradient + rows.T @ multipliers).max() <= PROOF_TOLERANCE
        and np.abs(held[multipliers != 0.0]).max(initial=0.0) <= PROOF_TOLERANCE
    )


def _highs(
    costs: FloatArray, rows: FloatArray, low: FloatArray, high: FloatArray
) -> LinearSolution | None:
    from scipy.optimize import linprog

    upper, lower = np.flatnonzero(high < NO_BOUND), np.flatnonzero(low > -NO_BOUND)
    found = linprog(
        costs,
        A_ub=np.vstack([rows[upper], -rows[lower]]),
        b_ub=np.concatenate([high[upper], -low[lower]]),
        bounds=(None, None),
        method="highs",
    )
    if found.status != 0:
        return None
    multipliers = np.zeros(len(rows))
    # HiGHS gives how the minimum changes with a limit, which is not positive.
    np.add.at(multipliers, upper, -found.ineqlin.marginals[: len(upper)])
    np.add.at(multipliers, lower, found.ineqlin.marginals[len(upper) :])
    return LinearSolution(np.asarray(found.x), multipliers)
