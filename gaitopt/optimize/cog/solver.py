"""Solving the COG problem: where to put the COG before a leg swings.

Sequential QPs in ProxQP. Every constraint is convex, so each linearisation contains the feasible
set, and the answer carries a proven bound on its distance from the true optimum.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, TextEnum
from gaitopt.errors import SolverError
from gaitopt.optimize.cog.problem import (
    LINEAR_WEIGHT,
    CogFormulation,
    CogProblem,
    build_cog_problem,
    build_cog_problems,
)
from gaitopt.optimize.quadratic import QuadraticSolver

__all__ = [
    "CogProblem",
    "CogSolution",
    "CogWorkspace",
    "build_cog_problem",
    "build_cog_problems",
    "require_solved",
    "solve_cog",
]

PRIMAL_TOLERANCE = 1e-9
"""Largest violation of a constraint in an accepted solution [m]."""
ERROR_TOLERANCE = 1e-6
"""Largest bound on the distance from the true optimum in an accepted solution [m]."""
ACTIVE_DUAL = 1e-6
"""Multiplier above which a constraint is said to be active."""
_ITERATIONS = 40
_EMPTY = 1e-7
_CONVERGED = 1e-10
_STEP = 1e-9
_POLISHED = 1e-14


class CogStatus(TextEnum):
    """How :func:`solve_cog` ended."""

    SOLVED = "solved"
    """The residuals are within tolerance."""
    NOT_VERIFIED = (
        "no feasible optimum was verified; usually there is none: lessen the stability margin, or "
        "take another body height or nearer footholds"
    )
    """The residuals are too large."""


@dataclass(frozen=True, eq=False)
class CogSolution:
    """A COG position, and how one knows that it is the right one.

    Attributes:
        position: ``(2,)`` [m].
        distance: from the start [m].
        value: optimum of the objective: distance [m], margin [m] or reach fraction.
        margin: stability margin there [m]; ``inf`` when no leg is to swing.
        duals: multiplier of each constraint by name, scaled to the objective.
        active: names of the constraints that hold the optimum where it is.
        status: whether the residuals below are within tolerance.
        primal: largest violation of a constraint [m].
        stationarity: largest entry of the Lagrangian's gradient.
        complementarity: sum of dual times slack.
        error_bound: bound on the distance from the true optimum [m] (``"distance"``), or on the
            objective's distance from its optimum (the others). Proven for a feasible answer; a
            violation, of 1e-9 m at most, enters to first order through the multipliers.
        iterations: QPs solved.
    """

    position: FloatArray
    distance: float
    value: float
    margin: float
    duals: Mapping[str, float]
    active: tuple[str, ...]
    status: CogStatus
    primal: float
    stationarity: float
    complementarity: float
    error_bound: float
    iterations: int

    @property
    def solved(self) -> bool:
        """Whether the residuals are within tolerance."""
        return self.status is CogStatus.SOLVED


class _State(NamedTuple):
    """A point with its multipliers, and the residuals of the optimality conditions there."""

    w: FloatArray
    duals: FloatArray
    gradient: FloatArray
    hessian: FloatArray
    slack: FloatArray
    jacobian: FloatArray
    primal: float
    stationarity: float
    gap: float

    @property
    def converged(self) -> bool:
        """Whether the residuals are at the QP solver's own accuracy."""
        return max(self.primal, self.stationarity, self.gap) < _CONVERGED


def solve_cog(problem: CogProblem, workspace: CogWorkspace | None = None) -> CogSolution:
    """Solve the COG problem by sequential QPs.

    Args:
        problem: from :func:`build_cog_problem`.
        workspace: solver memory to reuse; made anew by default.

    Returns:
        The solution. Look at its ``status``: there may be no feasible optimum.

    Raises:
        SolverError: the problem holds NaN or infinite numbers.
    """
    if not np.isfinite(problem.parameters).all():
        raise SolverError("the COG problem holds NaN or infinite numbers")
    form = problem.formulation
    workspace = workspace or CogWorkspace()
    call, solver = workspace.call(form), workspace.solver(form.variables, form.constraints)
    w = np.zeros(form.variables)
    w[:2] = problem.parameters[:2]
    if form.objective != "distance":
        w[2] = problem.stability_margin if form.objective == "margin" else 1.0
    state = _evaluate(call, problem, w, np.zeros(form.constraints))
    iterations = 0
    while iterations < _ITERATIONS:
        iterations += 1
        hessian = state.hessian if form.objective == "distance" else state.hessian + np.eye(len(w))
        step, duals = solver.solve(hessian, state.gradient, state.jacobian, -state.slack)
        # Each linearisation contains the feasible set: where one is empty, so is the set.
        empty = not (state.jacobian @ step + state.slack).min() > -_EMPTY
        state = _evaluate(call, problem, state.w + step, duals)
        # Newton's method: after a step this small the next one is below rounding.
        if empty or state.converged or np.abs(step).max() < _STEP:
            break
    return _judge(problem, _polished(call, problem, state), iterations)


class CogWorkspace:
    """Buffers of CasADi functions and ProxQP memory, reused from step to step by one thread."""

    def __init__(self) -> None:
        self._solvers: dict[tuple[int, int], QuadraticSolver] = {}
        self._calls: dict[CogFormulation, _Buffered] = {}

    def solver(self, variables: int, constraints: int) -> QuadraticSolver:
        """The QP memory for this size."""
        key = variables, constraints
        if key not in self._solvers:
            self._solvers[key] = QuadraticSolver(*key)
        return self._solvers[key]

    def call(self, formulation: CogFormulation) -> _Buffered:
        """The formulation's derivatives as a function of NumPy arrays, without copies."""
        if formulation not in self._calls:
            self._calls[formulation] = _Buffered(formulation.derivatives)
        return self._calls[formulation]


class _Buffered:
    """A CasADi function on NumPy memory: 1 us a call where the ordinary call costs 60.

    The arrays that a call returns are overwritten by the next call.
    """

    def __init__(self, function: Any) -> None:
        self._buffer, self._evaluate = function.buffer()
        self._inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self._outputs: list[FloatArray] = []
        for i, array in enumerate(self._inputs):
            self._buffer.set_arg(i, memoryview(array.data))
        for i in range(function.n_out()):
            rows, columns = function.size_out(i)
            flat = np.zeros(rows * columns)
            self._buffer.set_res(i, memoryview(flat.data))
            # CasADi stores columns one after another.
            self._outputs.append(flat if columns == 1 else flat.reshape(columns, rows).T)

    def __call__(self, *values: FloatArray) -> list[FloatArray]:
        for array, value in zip(self._inputs, values, strict=True):
            array[:] = value
        self._evaluate()
        return self._outputs


def _evaluate(call: _Buffered, problem: CogProblem, w: FloatArray, duals: FloatArray) -> _State:
    gradient, hessian, slack, jacobian = call(w, problem.parameters, duals)
    residual = gradient - duals @ jacobian
    primal = max(0.0, -float(slack.min()))
    return _State(
        w, duals, gradient, hessian, slack, jacobian,
        primal=primal,
        stationarity=max(map(abs, residual.tolist())),
        # A violation shifts the optimum's value by the multipliers times its size.
        gap=float(duals @ np.abs(slack)) + float(duals.sum()) * primal,
    )  # fmt: skip


def _polished(call: _Buffered, problem: CogProblem, state: _State) -> _State:
    """One Newton step on the optimality conditions of the active constraints.

    ProxQP may stop at 1e-11, and a slack of that size still allows 1e-6 m of doubt about the
    optimum; the step takes it to rounding. It is kept only if the active constraints stay the same.
    """
    active = np.flatnonzero(state.duals > ACTIVE_DUAL)
    count, size = len(active), len(state.w)
    if not count or state.gap < _POLISHED:
        return state
    normals = state.jacobian[active]
    system = np.zeros((size + count, size + count))
    system[:size, :size] = state.hessian
    system[:size, size:] = -normals.T
    system[size:, :size] = normals
    wanted = np.concatenate([-state.gradient, -state.slack[active]])
    try:
        # More active constraints than unknowns meet in one point: the multipliers are not unique.
        step = (
            np.linalg.solve(system, wanted)
            if count <= size
            else np.linalg.lstsq(system, wanted, rcond=None)[0]
        )
    except np.linalg.LinAlgError:
        return state
    if np.abs(step[:size]).max() > 1e-6 or step[size:].min() < 0.0:
        return state
    duals = np.zeros_like(state.duals)
    duals[active] = step[size:]
    return _evaluate(call, problem, state.w + step[:size], duals)


def _judge(problem: CogProblem, state: _State, iterations: int) -> CogSolution:
    """The answer with a bound on its distance from the optimum."""
    form, w = problem.formulation, state.w
    weight = 1.0 if form.objective == "distance" else LINEAR_WEIGHT
    slope, gap = state.stationarity / weight, state.gap / weight
    if form.objective == "distance":
        # f - duals.g is 1-strongly convex: r^2 / 2 <= gap + |slope| r for the distance r.
        bound = float(2.0**0.5 * slope + (2.0 * slope**2 + 2.0 * gap) ** 0.5)
    else:
        # A linear objective: its shortfall is at most the gap plus slope times the region's width.
        bound = gap + slope * form.width * max(1.0, problem.reach_fraction)
    solved = state.primal <= PRIMAL_TOLERANCE and bound <= ERROR_TOLERANCE
    position = w[:2] + problem.origin
    position.setflags(write=False)
    distance = float(np.hypot(*(w[:2] - problem.parameters[:2]).tolist()))
    value = {"distance": distance, "margin": float(w[-1]),
             "reach": max(float(w[-1]), 0.0) ** 0.5}[form.objective]  # fmt: skip
    duals = (state.duals / weight).tolist()
    return CogSolution(
        position=position,
        distance=distance,
        value=value,
        margin=_margin(problem, w),
        duals=dict(zip(problem.names, duals, strict=True)),
        active=tuple(n for n, d in zip(problem.names, duals, strict=True) if d > ACTIVE_DUAL),
        status=CogStatus.SOLVED if solved else CogStatus.NOT_VERIFIED,
        primal=state.primal,
        stationarity=slope,
        complementarity=gap,
        error_bound=bound,
        iterations=iterations,
    )


def _margin(problem: CogProblem, w: FloatArray) -> float:
    """Stability margin at the unknowns ``w`` [m], from the half-planes alone."""
    if not problem.formulation.planes:
        return float("inf")
    x, y = w[:2].tolist()
    planes = problem.parameters[2:11].tolist()
    return float(min(planes[i] * x + planes[i + 1] * y - planes[i + 2] for i in (0, 3, 6)))


def require_solved(solution: CogSolution, what: str) -> CogSolution:
    """``solution`` itself when it is verified.

    Raises:
        SolverError: its residuals are too large; the message holds them.
    """
    if not solution.solved:
        raise SolverError(
            f"{what}: not solved within {solution.iterations} QPs (violation "
            f"{solution.primal:.2g} m, gradient {solution.stationarity:.2g}, error bound "
            f"{solution.error_bound:.2g} m)"
        )
    return solution
