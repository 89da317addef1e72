"""Contact forces where limits contradict each other: those that exceed the limits least."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.dynamics.force_space import ForceProblem, ForceRows, ForceSpace
from gaitopt.dynamics.small_programs import NO_BOUND, solve_linear
from gaitopt.errors import SolverError


class LeastExcess(NamedTuple):
    """Forces that exceed the limits least, for ``c`` samples of a group.

    ``z (c, d)`` are their coordinates, ``excess (c,)`` the sums of what is exceeded, and
    ``multipliers (c, ...)`` those of the rows of the group, and of further rows behind them.
    """

    z: FloatArray
    excess: FloatArray
    multipliers: FloatArray


def least_excess(
    problem: ForceProblem, space: ForceSpace, rows: ForceRows, chosen: list[int]
) -> LeastExcess:
    """Forces that exceed the limits least.

    What is least is the sum over the constraints of how far each is exceeded, as a share of the
    weight or of the joint's torque limit. Then few constraints are exceeded at all.

    Args:
        problem, space, rows: what is asked of the group.
        chosen: samples of the group.

    Raises:
        SolverError: no solver found them.
    """
    _, length, size = rows.matrix.shape
    count = len(rows.columns)
    belongs = (rows.constraints[:, None] == np.arange(count)).astype(np.float64)
    # An upper limit and a lower one of the same row are exceeded in opposite directions.
    above = np.flatnonzero(~(rows.high >= NO_BOUND).all(axis=0))
    matrix = np.zeros((len(chosen), length + len(above) + count, size + count))
    matrix[:, :-count, :size] = np.concatenate([rows.matrix, rows.matrix[:, above]], axis=1)[chosen]
    matrix[:, :-count, size:] = np.concatenate([belongs, -belongs[above]])
    matrix[:, -count:, size:] = np.eye(count)
    low, high = np.full(matrix.shape[:2], -NO_BOUND), np.full(matrix.shape[:2], NO_BOUND)
    low[:, :length] = rows.low[chosen]
    low[:, -count:] = 0.0
    high[:, length:-count] = rows.high[chosen][:, above]
    costs = np.repeat([0.0, 1.0], [size, count])
    points = np.empty((len(chosen), size + count))
    multipliers = np.empty(matrix.shape[:2])
    for k, i in enumerate(chosen):
        found = solve_linear(costs, matrix[k], low[k], high[k])
        if found is None:
            found = solve_linear(costs, matrix[k], low[k], high[k], by_highs=True)
        if found is None:
            raise SolverError(_nothing_found(problem, int(space.samples[i])))
        points[k], multipliers[k] = found
    multipliers[:, above] += multipliers[:, length:-count]
    return LeastExcess(points[:, :size], points[:, size:].sum(axis=1), multipliers)


def _nothing_found(problem: ForceProblem, sample: int) -> str:
    return (
        f"{problem.robot.name}: no contact forces were found at {problem.times[sample]:.6g} s "
        f"(sample {sample}), not even ones that exceed limits; are masses and limits of a sensible "
        "size?"
    )
