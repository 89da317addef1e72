"""Solve the COG problem: where to put the COG before a leg swings.

The method is sequential quadratic programming. QPs of two unknowns are solved exactly
(:mod:`gaitopt.optimize.cog.plane_program`); ProxQP solves what is not solved so, and all others.
The feasible set is convex, so that every linearisation of the constraints contains it. The solution
carries a proven bound on its distance from the true optimum (derived in ``docs/theory.md``).
"""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import SolverError
from gaitopt.inputs import check_kind
from gaitopt.optimize.cog.formulation import LINEAR_WEIGHT
from gaitopt.optimize.cog.in_plane import margin_at, solve_nearest
from gaitopt.optimize.cog.problem import CogProblem, build_cog_problem, build_cog_problems
from gaitopt.optimize.cog.solution import (
    ACTIVE_MULTIPLIER,
    CogSolution,
    distance_bound,
    status_of,
)
from gaitopt.optimize.cog.workspace import BufferedCall, CogWorkspace

__all__ = [
    "CogProblem",
    "CogSolution",
    "CogWorkspace",
    "build_cog_problem",
    "build_cog_problems",
    "require_solved",
    "solve_cog",
]

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
LARGEST_CORRECTION = 1e-6
"""A refinement that moves the COG by more than this is rejected [m]: other constraints would be
active. The same size as :data:`ERROR_TOLERANCE`, which it is meant to correct."""


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
    parameters = problem.parameters
    # The square is finite where all numbers are, unless they are huge.
    if not isfinite(parameters @ parameters) and not np.isfinite(parameters).all():
        raise SolverError("the COG problem holds NaN or infinite numbers")
    form = problem.formulation
    workspace = workspace or CogWorkspace()
    call = workspace.call(form)
    if form.objective == "distance" and form.variables == 2:
        nearest = solve_nearest(call, problem)
        if nearest is not None:
            return nearest
    solver = workspace.solver(form.variables, form.constraints)
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


def _evaluate(
    call: BufferedCall, problem: CogProblem, w: FloatArray, multipliers: FloatArray
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


def _refined(call: BufferedCall, problem: CogProblem, state: _State) -> _State:
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
        bound = distance_bound(slope, gap)
    else:
        # Linear objectives differ from the optimum by at most the gap plus slope times width.
        bound = gap + slope * form.width * max(1.0, problem.reach_fraction)
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
        margin=margin_at(problem, *place.tolist()),
        multipliers=dict(zip(problem.names, multipliers, strict=True)),
        active=tuple(
            name
            for name, multiplier in zip(problem.names, multipliers, strict=True)
            if multiplier > ACTIVE_MULTIPLIER
        ),
        status=status_of(state.primal, bound),
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
