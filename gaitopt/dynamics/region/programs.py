"""Linear programs over one polytope, many objectives one after the other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import daqp
import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import SolverError

DAMPING = 1e-9
"""Weight of the squared coordinates, which makes a quadratic program for DAQP of the linear one.
With coordinates and multipliers of order one it moves no vertex: of 300 random programs all agreed
with HiGHS to 2e-15 with weights of 1e-8 and 1e-10. With 1e-12 some were wrong by 6e-6."""

SOLVER_TOLERANCE = 1e-10
"""Violation of an inequality that DAQP and HiGHS accept: the least that HiGHS takes."""

_HIGHS = {
    "primal_feasibility_tolerance": SOLVER_TOLERANCE,
    "dual_feasibility_tolerance": SOLVER_TOLERANCE,
}


@dataclass(frozen=True, eq=False)
class Polytope:
    """A polytope ``{x : A x <= b}`` and its image in the plane, ``c(x) = c0 + C x``.

    Attributes:
        rows: ``A (r, n)``.
        bounds: ``b (r,)``.
        place: ``c0 (2,)`` [m].
        map: ``C (2, n)`` [m].
        radius: no point of the polytope has a larger norm.
    """

    rows: FloatArray
    bounds: FloatArray
    place: FloatArray
    map: FloatArray
    radius: float


class Optimum(NamedTuple):
    """What a solver says is the maximiser of a linear objective.

    Attributes:
        point: ``(n,)``.
        multipliers: of the inequalities ``(r,)``; negative ones are rounding.
    """

    point: FloatArray
    multipliers: FloatArray


class Daqp:
    """Maximises over one polytope by DAQP [Arnstrom2022].

    The first objective starts from no active inequality, and each of the others from those that
    were active at the maximiser before.
    """

    def __init__(self, polytope: Polytope) -> None:
        self._polytope = polytope
        self._model = daqp.Model()
        self._model.settings = {"primal_tol": SOLVER_TOLERANCE}
        self._started = False

    def maximise(self, objective: FloatArray) -> Optimum | None:
        """The maximiser of ``objective (n,)``; ``None`` when there is none, or it is not found."""
        if self._started:
            self._model.update(f=-objective)
        else:
            hessian = DAMPING * np.eye(len(objective))
            self._model.setup(hessian, -objective, self._polytope.rows, self._polytope.bounds)
            self._started = True
        point, _, flag, report = self._model.solve()
        return Optimum(point, report["lam"]) if flag == 1 else None


class Highs:
    """Maximises over one polytope by HiGHS [Huangfu2018]: slower, and another method."""

    def __init__(self, polytope: Polytope) -> None:
        self._polytope = polytope

    def maximise(self, objective: FloatArray) -> Optimum | None:
        """The maximiser of ``objective (n,)``; ``None`` when there is none, or it is not found."""
        from scipy.optimize import linprog

        rows, bounds = self._polytope.rows, self._polytope.bounds
        result = linprog(-objective, rows, bounds, bounds=(None, None), options=_HIGHS)
        return Optimum(result.x, -result.ineqlin.marginals) if result.status == 0 else None


def has_slack(polytope: Polytope, least: float) -> bool:
    """Whether all inequalities can be kept by ``least`` at once.

    DAQP finds a point that does so, or multipliers that show that none does. Where it finds
    neither, :func:`largest_slack` tells; it takes a hundred times as long.

    Args:
        polytope: the polytope.
        least: from 0 to 1.

    Raises:
        SolverError: as there.
    """
    low, high = _bounds_of_slack(polytope)
    if low >= least:
        return True
    return not high < least and largest_slack(polytope) >= least


def _bounds_of_slack(polytope: Polytope) -> tuple[float, float]:
    """Numbers between which :func:`largest_slack` is, where it is positive, whatever DAQP found."""
    rows, bounds = polytope.rows, polytope.bounds
    count, size = rows.shape
    program = np.zeros((count + 1, size + 1))
    program[:count, :size], program[:, -1] = rows, 1.0
    objective = np.zeros(size + 1)
    objective[-1] = -1.0
    model = daqp.Model()
    model.settings = {"primal_tol": SOLVER_TOLERANCE}
    model.setup(DAMPING * np.eye(size + 1), objective, program, np.append(bounds, 1.0))
    point, _, _, report = model.solve()
    slack = min(float((bounds - rows @ point[:size]).min()), 1.0)
    duals = np.maximum(report["lam"], 0.0)
    total = float(duals.sum())
    if not 0.0 < total < np.inf:
        return slack, 1.0
    # What all keep by t: duals t <= duals (b - A x), and no point of the polytope is far away.
    held = duals[:count] @ bounds + duals[count]
    rest = polytope.radius * np.linalg.norm(duals[:count] @ rows)
    return slack, float(held + rest) / total


def largest_slack(polytope: Polytope) -> float:
    """The largest number, at most 1, by which all inequalities can be kept at once, by HiGHS.

    Negative when the polytope is empty: some inequality must give by this much.

    Raises:
        SolverError: HiGHS did not solve this linear program, which has a solution.
    """
    from scipy.optimize import linprog

    rows = np.column_stack([polytope.rows, np.ones(len(polytope.rows))])
    objective = np.zeros(rows.shape[1])
    objective[-1] = -1.0
    free = [(None, None)] * polytope.rows.shape[1]
    result = linprog(objective, rows, polytope.bounds, bounds=[*free, (None, 1.0)], options=_HIGHS)
    if result.status != 0:
        raise SolverError(f"HiGHS did not solve a linear program of a region: {result.message}")
    return float(result.x[-1])
