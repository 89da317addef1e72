"""Where to put the COG before a leg swings: eq. (10) of 000_6dacb41600db6a3c.txt, made exact.

Area A is the support triangle shrunken by the stability margin (three half-planes), Area B the
places from which four feet and the next foothold are within the legs' reach (five discs, or ovals
where a leg's pitch axis lies below its roll axis). Three objectives share the constraints:

* ``"distance"``: the nearest point of A and B (the paper's method; the paper writes a union, which
  must be the intersection);
* ``"margin"``: the point of the largest stability margin (the SSM baseline);
* ``"reach"``: the least reach fraction with which the step is possible (for error messages).

The formulation is built in CasADi, once a robot, leg and objective, and solved by sequential QPs in
ProxQP. Every constraint is convex, so each linearisation contains the feasible set, and the answer
carries a bound on its distance from the true optimum.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError, SolverError
from gaitopt.optimize.quadratic import QuadraticSolver
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.support import triangle_half_planes

Objective = Literal["distance", "margin", "reach"]

PRIMAL_TOLERANCE = 1e-9
"""Largest violation of a constraint in an accepted solution [m]."""
ERROR_TOLERANCE = 1e-6
"""Largest bound on the distance from the true optimum in an accepted solution [m]."""
ACTIVE_DUAL = 1e-6
"""Multiplier above which a constraint is said to be active."""
_STEP_TOLERANCE = 1e-9
_EMPTY = 1e-7
_ITERATIONS = 40
# Weight of the linear objectives against the proximal term |w - w_k|^2 / 2 that keeps H of order 1.
_LINEAR_WEIGHT = 10.0


@dataclass(frozen=True, eq=False)
class CogFormulation:
    """The symbolic problem of one robot, swing leg and objective, built once.

    Attributes:
        objective: which objective.
        swing: the leg that swings next; ``None`` for standing on four feet (no triangle).
        reaching: the leg of each reach constraint.
        expressions: CasADi function ``(w, parameters) -> (cost, constraints)``, to look at.
        derivatives: CasADi function ``(w, parameters, duals) -> (gradient, hessian, constraints,
            jacobian)`` that the solver calls.
    """

    objective: str
    swing: str | None
    reaching: tuple[str, ...]
    expressions: Any
    derivatives: Any

    @cached_property
    def planes(self) -> int:
        """Number of half-planes."""
        return 0 if self.swing is None else 3

    @cached_property
    def constraints(self) -> int:
        """Number of constraints."""
        return self.planes + len(self.reaching)

    @cached_property
    def variables(self) -> int:
        """Number of unknowns: x, y, and the margin or squared reach fraction."""
        return 2 if self.objective == "distance" else 3


@lru_cache(maxsize=256)
def build_cog_formulation(
    robot: Quadruped, swing: str | None, objective: Objective
) -> CogFormulation:
    """Write eqs. (1)-(10) in CasADi for one robot, swing leg and objective.

    Unknowns ``w``: the body centre's x and y in a frame turned to the walk's heading, then for
    ``"margin"`` the margin and for ``"reach"`` the squared reach fraction. Parameters: start (2),
    half-planes (3 x 3: normal, offset), margin, reach fraction, feet (n x 3, height counted from
    the body centre). All constraints read ``>= 0`` and are in metres.
    """
    import casadi as ca

    ca.GlobalOptions.setNumpyMode(1)
    reaching = LEGS if swing is None else (*LEGS, swing)
    planes = 0 if swing is None else 3
    w = ca.SX.sym("w", 2 if objective == "distance" else 3)
    prm = ca.SX.sym("parameters", 2 + 3 * planes + 2 + 3 * len(reaching))
    margin = w[2] if objective == "margin" else prm[2 + 3 * planes]
    square = w[2] if objective == "reach" else prm[3 + 3 * planes] ** 2
    feet = prm[4 + 3 * planes :]
    rows = []
    for i in range(planes):
        nx, ny, offset = (prm[2 + 3 * i + k] for k in range(3))
        rows.append(nx * w[0] + ny * w[1] - offset - margin)
    for i, leg in enumerate(reaching):
        x, y = feet[3 * i] - w[0] + robot.centre[0], feet[3 * i + 1] - w[1] + robot.centre[1]
        distance2 = robot.legs[leg].straightness(x, y, feet[3 * i + 2] + robot.centre[2])
        reach = robot.legs[leg].reach
        rows.append((square * reach**2 - distance2) / (2.0 * reach))
    cost = {
        "distance": ca.sumsqr(w[:2] - prm[:2]) / 2.0,
        "margin": -_LINEAR_WEIGHT * w[-1],
        "reach": _LINEAR_WEIGHT * w[-1],
    }[objective]
    g = ca.vertcat(*rows)
    duals = ca.SX.sym("duals", len(rows))
    hessian, _ = ca.hessian(cost - ca.dot(duals, g), w)
    outputs = [ca.gradient(cost, w), hessian, g, ca.jacobian(g, w)]
    names = ["gradient", "hessian", "constraints", "jacobian"]
    return CogFormulation(
        objective=objective,
        swing=swing,
        reaching=reaching,
        expressions=ca.Function("cog", [w, prm], [cost, g], ["w", "p"], ["cost", "g"]),
        derivatives=ca.Function(
            "cog_derivatives", [w, prm, duals], [ca.densify(o) for o in outputs],
            ["w", "p", "duals"], names,
        ),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class CogProblem:
    """One instance of the problem: numbers for a formulation's parameters.

    Attributes:
        formulation: the symbolic problem.
        parameters: values of the formulation's parameters; the first two are the start.
        names: a name for each constraint, such as ``"margin LF-RH"`` and ``"reach LH"``.
        stability_margin: ``S0`` [m].
        reach_fraction: share of the legs' reach that may be used.
    """

    formulation: CogFormulation
    parameters: FloatArray
    names: tuple[str, ...]
    stability_margin: float
    reach_fraction: float

    @property
    def start(self) -> FloatArray:
        """Where the COG is now ``(2,)`` [m]."""
        return self.parameters[:2]

    def starting_at(self, start: FloatArray) -> CogProblem:
        """The same problem with the COG elsewhere at first."""
        parameters = self.parameters.copy()
        parameters[:2] = start
        return replace(self, parameters=parameters)

    def constraint_values(self, place: ArrayLike) -> FloatArray:
        """Slack of every constraint at a COG position ``(2,)`` [m], at the asked-for margin."""
        w = np.zeros(self.formulation.variables)
        w[:2] = place
        if self.formulation.objective == "margin":
            w[2] = self.stability_margin
        if self.formulation.objective == "reach":
            w[2] = self.reach_fraction**2
        return np.asarray(self.formulation.expressions(w, self.parameters)[1]).ravel()


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
        status: ``"solved"`` when the residuals below are within tolerance, else ``"failed"``.
        primal: largest violation of a constraint [m].
        stationarity: largest entry of the Lagrangian's gradient.
        complementarity: sum of |dual x slack|.
        error_bound: proven bound on the distance from the true optimum (``"distance"``), or on the
            objective's distance from its optimum over the feasible set (the others).
        iterations: QPs solved.
    """

    position: FloatArray
    distance: float
    value: float
    margin: float
    duals: Mapping[str, float]
    active: tuple[str, ...]
    status: str
    primal: float
    stationarity: float
    complementarity: float
    error_bound: float
    iterations: int


def build_cog_problem(
    robot: Quadruped,
    feet: Mapping[str, ArrayLike],
    height: float,
    start: ArrayLike,
    *,
    swing: str | None = None,
    foothold: ArrayLike | None = None,
    stability_margin: float = 0.02,
    reach_fraction: float = 1.0,
    objective: Objective = "distance",
) -> CogProblem:
    """Put one step's numbers into the problem of eq. (10).

    Args:
        robot: the robot; its body axes are along the world's.
        feet: where the four feet stand, ``(3,)`` each [m].
        height: height of the body centre [m].
        start: where the COG is now ``(2,)`` [m].
        swing: the leg that swings next; ``None`` asks for a place to stand on four feet.
        foothold: where it will touch down ``(3,)`` [m].
        stability_margin: ``S0`` [m].
        reach_fraction: share of the legs' reach that may be used, in (0, 1].
        objective: ``"distance"``, ``"margin"`` or ``"reach"``.

    Raises:
        InputError: the feet of the support triangle stand in one line, or ``swing`` and
            ``foothold`` are not given together.
    """
    if (swing is None) != (foothold is None):
        raise InputError("swing and foothold go together: name both, or neither")
    stance = np.array([[feet[leg] for leg in LEGS]], dtype=np.float64)
    target = None if foothold is None else np.array([foothold], dtype=np.float64)
    (problem,) = build_cog_problems(
        robot, stance, np.array([height]), [swing], target,
        stability_margin=stability_margin, reach_fraction=reach_fraction, objective=objective,
    )  # fmt: skip
    return problem.starting_at(np.asarray(start, dtype=np.float64))


def build_cog_problems(
    robot: Quadruped,
    feet: FloatArray,
    heights: FloatArray,
    swings: Sequence[str | None],
    footholds: FloatArray | None,
    *,
    stability_margin: float,
    reach_fraction: float,
    objective: Objective,
) -> list[CogProblem]:
    """The problems of many steps at once, each starting below the origin.

    Args:
        feet: where the feet stand before each step ``(S, 4, 3)`` [m].
        heights: heights of the body centre ``(S,)`` [m].
        swings: the leg that swings at each step; all ``None`` for standing only.
        footholds: where it touches down ``(S, 3)`` [m]; ``None`` for standing only.
        robot, stability_margin, reach_fraction, objective: as in :func:`build_cog_problem`.

    Raises:
        InputError: the feet of a support triangle stand in one line.
    """
    count = len(feet)
    blocks = [np.zeros((count, 2))]
    places = feet
    if footholds is not None:
        standing = np.array([[i for i, leg in enumerate(LEGS) if leg != s] for s in swings])
        corners = np.take_along_axis(feet[..., :2], standing[..., None], axis=1)
        normals, offsets = triangle_half_planes(corners)
        flat = np.flatnonzero(np.isnan(offsets).any(axis=1))
        if flat.size:
            raise InputError(
                f"step {flat[0]} ({swings[flat[0]]}): the three feet that stand, at "
                f"{np.round(corners[flat[0]], 4).tolist()}, are in one line and support no area"
            )
        blocks.append(np.concatenate([normals, offsets[..., None]], axis=2).reshape(count, 9))
        places = np.concatenate([feet, footholds[:, None]], axis=1)
    below = places - np.array([0.0, 0.0, 1.0]) * heights[:, None, None]
    blocks.append(np.tile([stability_margin, reach_fraction], (count, 1)))
    blocks.append(below.reshape(count, -1))
    parameters = np.concatenate(blocks, axis=1)
    return [
        CogProblem(build_cog_formulation(robot, swing, objective), row, _constraint_names(swing),
                   stability_margin, reach_fraction)
        for swing, row in zip(swings, parameters, strict=True)
    ]  # fmt: skip


@lru_cache(maxsize=8)
def _constraint_names(swing: str | None) -> tuple[str, ...]:
    reach = tuple(f"reach {leg}" for leg in LEGS)
    if swing is None:
        return reach
    a, b, c = (leg for leg in LEGS if leg != swing)
    return (f"margin {a}-{b}", f"margin {b}-{c}", f"margin {c}-{a}", *reach,
            f"reach {swing} foothold")  # fmt: skip


def solve_cog(problem: CogProblem, workspace: CogWorkspace | None = None) -> CogSolution:
    """Solve the COG problem by sequential QPs.

    Args:
        problem: from :func:`build_cog_problem`.
        workspace: solver memory to reuse; made anew by default.

    Returns:
        The solution. Look at its ``status``: ``"failed"`` means that no feasible optimum was
        verified, usually because there is none.
    """
    form = problem.formulation
    workspace = workspace or CogWorkspace()
    call = workspace.call(form)
    solver = workspace.solver(form.variables, form.constraints)
    if not np.isfinite(problem.parameters).all():
        raise SolverError("the COG problem holds NaN or infinite numbers")
    w = np.zeros(form.variables)
    w[:2] = problem.start
    if form.objective != "distance":
        w[2] = problem.stability_margin if form.objective == "margin" else 1.0
    duals = np.zeros(form.constraints)
    proximal = np.eye(form.variables) * (form.objective != "distance")
    iterations = 0
    while iterations < _ITERATIONS:
        iterations += 1
        gradient, hessian, g, jacobian = call(w, problem.parameters, duals)
        step, duals = solver.solve(hessian + proximal, gradient, jacobian, -g)
        w = w + step
        # Each linearisation contains the feasible set: where one is empty, so is the set.
        if not (jacobian @ step + g).min() > -_EMPTY:
            break
        # Newton's method: after a step this small the next one is below rounding. A step that
        # changed only what is linear and quadratic in the problem is exact at once.
        if abs(step[0]) + abs(step[1]) < _STEP_TOLERANCE or _is_exact(
            form, duals, w, call, problem.parameters
        ):
            break
    w, duals = _polished(problem, w, duals, call)
    return _judge(problem, w, duals, call, iterations)


def _is_exact(
    form: CogFormulation, duals: FloatArray, w: FloatArray, call: Any, parameters: FloatArray
) -> bool:
    """Whether one QP solved the distance problem: only half-planes active, nothing violated."""
    if form.objective != "distance" or duals[form.planes :].max() > ACTIVE_DUAL:
        return False
    return bool(call(w, parameters, duals)[2].min() > -_STEP_TOLERANCE)


class CogWorkspace:
    """Buffers of CasADi functions and ProxQP memory, reused from step to step by one thread."""

    def __init__(self) -> None:
        self._solvers: dict[tuple[int, int], QuadraticSolver] = {}
        self._calls: dict[CogFormulation, Any] = {}

    def solver(self, variables: int, constraints: int) -> QuadraticSolver:
        """The QP memory for this size."""
        key = variables, constraints
        if key not in self._solvers:
            self._solvers[key] = QuadraticSolver(*key)
        return self._solvers[key]

    def call(self, formulation: CogFormulation) -> Any:
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


def _polished(
    problem: CogProblem, w: FloatArray, duals: FloatArray, call: Any
) -> tuple[FloatArray, FloatArray]:
    """One Newton step on the optimality conditions of the active constraints.

    ProxQP stops at 1e-11, and a slack of that size still allows 1e-6 m of doubt about the optimum;
    the step takes it to rounding. It is kept only if the active constraints stay the same.
    """
    active = np.flatnonzero(duals > ACTIVE_DUAL)
    count, size = len(active), len(w)
    if not 0 < count <= size:
        return w, duals
    gradient, hessian, g, jacobian = call(w, problem.parameters, duals)
    system = np.zeros((size + count, size + count))
    system[:size, :size] = hessian
    system[:size, size:] = -jacobian[active].T
    system[size:, :size] = jacobian[active]
    try:
        step = np.linalg.solve(system, np.concatenate([-gradient, -g[active]]))
    except np.linalg.LinAlgError:
        return w, duals
    if np.abs(step[:size]).max() > 1e-6 or step[size:].min() < 0.0:
        return w, duals
    polished = np.zeros_like(duals)
    polished[active] = step[size:]
    return w + step[:size], polished


def _judge(
    problem: CogProblem, w: FloatArray, duals: FloatArray, call: Any, iterations: int
) -> CogSolution:
    """Recompute all residuals at the answer, and a bound on its distance from the optimum."""
    form = problem.formulation
    weight = 1.0 if form.objective == "distance" else _LINEAR_WEIGHT
    gradient, _, g, jacobian = call(w, problem.parameters, duals)
    residual = (gradient - duals @ jacobian) / weight
    duals = duals / weight
    primal = max(0.0, -float(g.min()))
    slope = float(np.abs(residual).max())
    gap = float(np.abs(duals * g).sum())
    if form.objective == "distance":
        # f - duals.g is 1-strongly convex: r^2 / 2 <= gap + |slope| r for the distance r.
        norm = float(np.hypot(*residual))
        bound = norm + float(np.sqrt(norm**2 + 2.0 * gap))
    else:
        # A linear objective: its shortfall is at most the gap plus slope times the region's width.
        bound = gap + slope * 2.0
    solved = primal <= PRIMAL_TOLERANCE and bound <= ERROR_TOLERANCE
    margin = np.inf
    if form.planes:
        planes = problem.parameters[2 : 2 + 3 * form.planes].reshape(form.planes, 3)
        margin = float((planes[:, :2] @ w[:2] - planes[:, 2]).min())
    position = np.array(w[:2])
    position.setflags(write=False)
    distance = float(np.hypot(*(w[:2] - problem.start)))
    value = {"distance": distance, "margin": float(w[-1]),
             "reach": float(np.sqrt(max(w[-1], 0.0)))}[form.objective]  # fmt: skip
    listed = duals.tolist()
    return CogSolution(
        position=position,
        distance=distance,
        value=value,
        margin=float(margin),
        duals=dict(zip(problem.names, listed, strict=True)),
        active=tuple(n for n, d in zip(problem.names, listed, strict=True) if d > ACTIVE_DUAL),
        status="solved" if solved else "failed",
        primal=primal,
        stationarity=slope,
        complementarity=gap,
        error_bound=bound,
        iterations=iterations,
    )


def require_solved(solution: CogSolution, what: str) -> CogSolution:
    """``solution`` itself when it is verified.

    Raises:
        SolverError: its residuals are too large; the message holds them.
    """
    if solution.status != "solved":
        raise SolverError(
            f"{what}: not solved within {solution.iterations} QPs (violation "
            f"{solution.primal:.2g} m, gradient {solution.stationarity:.2g}, error bound "
            f"{solution.error_bound:.2g} m)"
        )
    return solution
