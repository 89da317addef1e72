"""Solve the COG problem: where to put the COG before a leg swings.

The method is sequential quadratic programming, with ProxQP for each QP. The feasible set is convex,
so that every linearisation of the constraints contains it. The solution carries a proven bound on
its distance from the true optimum (derived in ``docs/theory.md``).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, TextEnum
from gaitopt.errors import SolverError
from gaitopt.inputs import check_kind
from gaitopt.optimize.cog.formulation import LINEAR_WEIGHT, CogFormulation
from gaitopt.optimize.cog.problem import CogProblem, build_cog_problem, build_cog_problems
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
"""Largest violation of a constraint in an accepted solution [m]. Chosen here: a hundred times the
accuracy of the QP solver, and far below what a robot can measure."""
ERROR_TOLERANCE = 1e-6
"""Largest bound on the distance from the true optimum in an accepted solution [m]. Chosen here: a
micrometre, far below what a robot can measure."""
ACTIVE_MULTIPLIER = 1e-6
"""Multiplier above which a constraint is said to be active. Chosen here: multipliers of active
constraints have the size of the distance that the body moves [m], and those of others that of the
QP solver's accuracy, 1e-11."""
MOST_ITERATIONS = 40
"""Most QPs for one problem. Measured: random problems, 9000 of them, took 20 at most."""
EMPTY_VIOLATION = 1e-7
"""Violation from which the linearised constraints have no solution [m]. Where they have one, the
QP solver's result violates them by about 1e-9 m at most."""
CONVERGED = 1e-10
"""Residual at which iterations end: ten times the accuracy of the QP solver."""
LAST_STEP = 1e-9
"""Length of a Newton step after which iterations end [m]. Newton's method converges quadratically,
so that the next step would be smaller than rounding."""
REFINED_GAP = 1e-14
"""Gap below which a solution is not refined [m^2]: rounding in the sum of multipliers times
slacks."""
VECTORS = ("gradient", "constraints")
"""Results of a formulation's derivatives that are no matrices."""
LARGEST_CORRECTION = 1e-6
"""A refinement that moves the COG by more than this is rejected [m]: other constraints would be
active. The same size as :data:`ERROR_TOLERANCE`, which it is meant to correct."""


class CogStatus(TextEnum):
    """The result of :func:`solve_cog`."""

    SOLVED = "solved"
    """The residuals are within tolerance."""
    NOT_VERIFIED = (
        "no solution was verified; usually there is none: reduce the stability margin, or take "
        "another body height or nearer footholds"
    )
    """The residuals are too large."""


@dataclass(frozen=True, eq=False)
class CogSolution:
    """A COG position with the residuals that show that it is optimal.

    Attributes:
        position: ``(2,)`` [m].
        distance: from the start [m].
        value: optimum of the objective: distance [m], margin [m] or reach fraction.
        margin: stability margin there [m]; ``inf`` when no leg is to swing.
        multipliers: multiplier of each constraint by name, scaled to the objective.
        active: names of the active constraints, which determine the optimum.
        status: whether the residuals below are within tolerance.
        primal: largest violation of a constraint [m].
        stationarity: largest entry of the Lagrangian's gradient.
        complementarity: sum of multipliers times slacks.
        error_bound: for ``"distance"`` a bound on the distance from the true optimum [m], for the
            others on the difference between the objective and its optimum. It is proven where no
            constraint is violated. A violation, of 1e-9 m at most, is taken into account to first
            order, by the multipliers.
        iterations: number of QPs that were solved.
    """

    position: FloatArray
    distance: float
    value: float
    margin: float
    multipliers: Mapping[str, float]
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
    """The unknowns ``w`` and multipliers, and the residuals of the optimality conditions there.

    ``gap`` bounds what the objective can still gain: the sum of multipliers times slacks.
    """

    w: FloatArray
    multipliers: FloatArray
    gradient: FloatArray
    hessian: FloatArray
    slack: FloatArray
    jacobian: FloatArray
    primal: float
    stationarity: float
    gap: float

    @property
    def converged(self) -> bool:
        """Whether the residuals are as small as the QP solver can make them."""
        return max(self.primal, self.stationarity, self.gap) < CONVERGED


def solve_cog(problem: CogProblem, workspace: CogWorkspace | None = None) -> CogSolution:
    """Solve the COG problem by sequential quadratic programming.

    Args:
        problem: from :func:`build_cog_problem`.
        workspace: memory of the solver to reuse; a new one by default.

    Returns:
        The solution. Its ``status`` says whether it was verified: the problem may be infeasible.

    Raises:
        SolverError: the problem holds NaN or infinite numbers.
    """
    check_kind("problem", problem, CogProblem)
    if not np.isfinite(problem.parameters).all():
        raise SolverError("the COG problem holds NaN or infinite numbers")
    form = problem.formulation
    workspace = workspace or CogWorkspace()
    call, solver = workspace.call(form), workspace.solver(form.variables, form.constraints)
    w = np.zeros(form.variables)
    w[: form.place] = problem.parameters[: form.place]
    if form.objective != "distance":
        w[-1] = problem.stability_margin if form.objective == "margin" else 1.0
    state = _evaluate(call, problem, w, np.zeros(form.constraints))
    iterations = 0
    while iterations < MOST_ITERATIONS:
        iterations += 1
        hessian = state.hessian if form.objective == "distance" else state.hessian + np.eye(len(w))
        step, multipliers = solver.solve(hessian, state.gradient, state.jacobian, -state.slack)
        # Each linearisation contains the feasible set: where one is empty, the set is empty, too.
        empty = not (state.jacobian @ step + state.slack).min() > -EMPTY_VIOLATION
        state = _evaluate(call, problem, state.w + step, multipliers)
        if empty or state.converged or np.abs(step).max() < LAST_STEP:
            break
    return _verified(problem, _refined(call, problem, state), iterations)


class CogWorkspace:
    """Memory of CasADi and ProxQP that is reused from problem to problem, by one thread."""

    def __init__(self) -> None:
        self._solvers: dict[tuple[int, int], QuadraticSolver] = {}
        self._calls: dict[CogFormulation, _Buffered] = {}

    def solver(self, variables: int, constraints: int) -> QuadraticSolver:
        """The QP solver for problems of this size."""
        key = variables, constraints
        if key not in self._solvers:
            self._solvers[key] = QuadraticSolver(*key)
        return self._solvers[key]

    def call(self, formulation: CogFormulation) -> _Buffered:
        """The formulation's derivatives as a function of NumPy arrays."""
        if formulation not in self._calls:
            self._calls[formulation] = _Buffered(formulation.derivatives)
        return self._calls[formulation]


class _Buffered:
    """A CasADi function that reads and writes NumPy memory directly.

    A call takes 1 us, an ordinary call of CasADi 60 us. The arrays that a call returns are
    overwritten by the next call.
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
            is_vector = function.name_out(i) in VECTORS
            self._outputs.append(flat if is_vector else flat.reshape(columns, rows).T)

    def __call__(self, *values: FloatArray) -> list[FloatArray]:
        for array, value in zip(self._inputs, values, strict=True):
            array[:] = value
        self._evaluate()
        return self._outputs


def _evaluate(
    call: _Buffered, problem: CogProblem, w: FloatArray, multipliers: FloatArray
) -> _State:
    """Derivatives and residuals at the unknowns ``w`` with these multipliers."""
    gradient, hessian, slack, jacobian = call(w, problem.parameters, multipliers)
    residual = gradient - multipliers @ jacobian
    primal = max(0.0, -float(slack.min()))
    return _State(
        w, multipliers, gradient, hessian, slack, jacobian,
        primal=primal,
        stationarity=max(map(abs, residual.tolist())),
        # A violation shifts the optimum's value by the multipliers times its size.
        gap=float(multipliers @ np.abs(slack)) + float(multipliers.sum()) * primal,
    )  # fmt: skip


def _refined(call: _Buffered, problem: CogProblem, state: _State) -> _State:
    """One Newton step on the optimality conditions of the active constraints.

    ProxQP may stop at residuals of 1e-11, with which the bound on the distance from the optimum is
    still of the order of 1e-6 m. This step reduces them to rounding. It is rejected if other
    constraints become active.
    """
    active = np.flatnonzero(state.multipliers > ACTIVE_MULTIPLIER)
    count, size = len(active), len(state.w)
    if not count or state.gap < REFINED_GAP:
        return state
    normals = state.jacobian[active]
    system = np.zeros((size + count, size + count))
    system[:size, :size] = state.hessian
    system[:size, size:] = -normals.T
    system[size:, :size] = normals
    wanted = np.concatenate([-state.gradient, -state.slack[active]])
    try:
        # With more active constraints than unknowns, the multipliers are not unique.
        step = (
            np.linalg.solve(system, wanted)
            if count <= size
            else np.linalg.lstsq(system, wanted, rcond=None)[0]
        )
    except np.linalg.LinAlgError:
        return state
    if np.abs(step[:size]).max() > LARGEST_CORRECTION or step[size:].min() < 0.0:
        return state
    multipliers = np.zeros_like(state.multipliers)
    multipliers[active] = step[size:]
    return _evaluate(call, problem, state.w + step[:size], multipliers)


def _verified(problem: CogProblem, state: _State, iterations: int) -> CogSolution:
    """The solution with a bound on its distance from the optimum, and its status."""
    form, w = problem.formulation, state.w
    weight = 1.0 if form.objective == "distance" else LINEAR_WEIGHT
    slope, gap = state.stationarity / weight, state.gap / weight
    if form.objective == "distance":
        # The Lagrangian is 1-strongly convex: r^2 / 2 <= gap + |slope| r for the distance r.
        bound = float(2.0**0.5 * slope + (2.0 * slope**2 + 2.0 * gap) ** 0.5)
    else:
        # Linear objectives differ from the optimum by at most the gap plus slope times width.
        bound = gap + slope * form.width * max(1.0, problem.reach_fraction)
    solved = state.primal <= PRIMAL_TOLERANCE and bound <= ERROR_TOLERANCE
    place = _place(problem, w)
    position = place + problem.origin
    position.setflags(write=False)
    distance = float(np.hypot(*(place - problem.parameters[:2]).tolist()))
    value = {"distance": distance, "margin": float(w[-1]),
             "reach": max(float(w[-1]), 0.0) ** 0.5}[form.objective]  # fmt: skip
    multipliers = (state.multipliers / weight).tolist()
    return CogSolution(
        position=position,
        distance=distance,
        value=value,
        margin=_margin(problem, w),
        multipliers=dict(zip(problem.names, multipliers, strict=True)),
        active=tuple(
            name
            for name, multiplier in zip(problem.names, multipliers, strict=True)
            if multiplier > ACTIVE_MULTIPLIER
        ),
        status=CogStatus.SOLVED if solved else CogStatus.NOT_VERIFIED,
        primal=state.primal,
        stationarity=slope,
        complementarity=gap,
        error_bound=bound,
        iterations=iterations,
    )


def _place(problem: CogProblem, w: FloatArray) -> FloatArray:
    """The body centre ``(2,)`` at the unknowns ``w``, from the problem's origin [m]."""
    place: FloatArray = problem.parameters[:2].copy()
    place[: problem.formulation.place] = w[: problem.formulation.place]
    return place


def _margin(problem: CogProblem, w: FloatArray) -> float:
    """Stability margin at the unknowns ``w`` [m]; ``inf`` where no leg is to swing."""
    if not problem.formulation.planes:
        return float("inf")
    x, y = _place(problem, w).tolist()
    planes = problem.parameters[2:11].tolist()
    return float(min(planes[i] * x + planes[i + 1] * y - planes[i + 2] for i in (0, 3, 6)))


def require_solved(solution: CogSolution, what: str) -> CogSolution:
    """Return ``solution``, if it is verified.

    Args:
        solution: of a COG problem.
        what: name of the problem, for the message.

    Raises:
        SolverError: its residuals are too large; the message contains them.
    """
    if not solution.solved:
        raise SolverError(
            f"{what}: not solved within {solution.iterations} QPs (violation "
            f"{solution.primal:.2g} m, gradient {solution.stationarity:.2g}, error bound "
            f"{solution.error_bound:.2g} m)"
        )
    return solution
