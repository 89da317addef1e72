"""A primal-dual interior-point method for problems of inequalities with banded matrices.

Minimise ``cost . x + sum(even * x**2) / 2`` subject to ``values(x) >= 0``. Without equalities each
Newton step condenses to one symmetric positive definite banded system in the unknowns alone, whose
Cholesky factor costs size times width squared: the time of a step grows linearly with the length
of a route.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np

from gaitopt.conventions import FloatArray

MOST_ITERATIONS = 300
VIOLATION = 1e-6
"""Most that an answer may violate an inequality which more time does not mend."""
_TO_BOUNDARY = 0.995
_ARMIJO = 1e-4
_CLOSE = 1e10
_NEAR_DUALS = 100.0
_LEAST_BEND = 0.1
_ROUNDING = 1e-10
_MOST_SHIFTS = 60
_PROGRESS = 1e-5
_MOST_HALVINGS = 40


class Local(Protocol):
    """Values and derivatives of a problem at a point."""

    values: FloatArray

    def pull(self, v: FloatArray) -> FloatArray: ...

    def push(self, dx: FloatArray) -> FloatArray: ...

    def normal(self, scale: FloatArray, duals: FloatArray) -> FloatArray: ...


class Problem(Protocol):
    """What the solver needs of a problem."""

    @property
    def cost(self) -> FloatArray: ...

    @property
    def even(self) -> FloatArray: ...

    @property
    def settled(self) -> int: ...

    def values(self, x: FloatArray) -> FloatArray: ...

    def settle(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]: ...

    def linearised(self, x: FloatArray) -> Any: ...


@dataclass(frozen=True, eq=False)
class Answer:
    """What the solver found, with residuals worked out anew at the end.

    Attributes:
        x: unknowns.
        duals: multipliers of the inequalities.
        status: ``"solved"``, or why it stopped.
        iterations: Newton steps.
        primal: largest violation of an inequality.
        stationarity: largest entry of the Lagrangian's gradient.
        complementarity: sum of multiplier times value: how far the objective can be from that of
            the linearised problem's optimum.
        history: barrier parameter, merit, residuals of every iteration.
    """

    x: FloatArray
    duals: FloatArray
    status: str
    iterations: int
    primal: float
    stationarity: float
    complementarity: float
    history: tuple[tuple[float, ...], ...] = ()


@dataclass
class _State:
    x: FloatArray
    slack: FloatArray
    dual: FloatArray
    barrier: float
    largest_miss: float
    shift: float = 0.0
    eased: bool = False
    bend: float = 1.0
    filter: list[tuple[float, float]] = field(default_factory=list)


def solve_route(
    problem: Problem,
    start: FloatArray,
    *,
    tolerance: float = 1e-3,
    barrier: float = 1e-2,
    iterations: int = MOST_ITERATIONS,
    duals: FloatArray | None = None,
    eased: bool = False,
) -> Answer:
    """Solve a route problem from ``start``.

    Args:
        problem: see :class:`gaitopt.optimize.route_problem.RouteProblem`.
        start: first guess; it need not be feasible, but its values must be finite.
        tolerance: complementarity, relative to the objective, at which to stop.
        barrier: first barrier parameter.
        iterations: most Newton steps.
        duals: multipliers of a problem nearby, to begin with.
        eased: where the inequalities' curvature makes the Newton matrix indefinite, take less of
            it (down to none: sequential linear programming), rather than damp the step. Better
            where many inequalities are strongly bent.
    """
    here = problem.linearised(start)
    slack = np.maximum(here.values, 1e-3)
    dual = barrier / slack
    if duals is not None:
        dual = np.clip(duals, dual / _NEAR_DUALS, dual * _NEAR_DUALS)
    state = _State(np.array(start), slack, dual, barrier,
                   max(1.0, 10.0 * float(np.abs(here.values - slack).sum())),
                   eased=eased)  # fmt: skip
    history: list[tuple[float, ...]] = []
    status = "most iterations"
    for _ in range(iterations):
        final = max(tolerance * abs(float(problem.cost @ state.x)) / len(slack), 1e-11)
        gradient = _slope(problem, state.x) - here.pull(state.dual)
        gap = here.values - state.slack
        while True:
            error = _error(state, gradient, gap)
            if error > 10.0 * state.barrier or state.barrier <= final:
                break
            state.filter.clear()
            state.barrier = max(final, min(0.2 * state.barrier, state.barrier**1.5))
        history.append((state.barrier, float(problem.cost @ state.x), float(np.abs(gradient).max()),
                        float(np.abs(gap).max()), state.shift))  # fmt: skip
        broken = float(-here.values[problem.settled :].min(initial=0.0))
        if state.barrier <= final and error <= 10.0 * state.barrier and broken <= VIOLATION:
            status = "solved"
            break
        if not _advance(problem, state, _Newton(problem, state, here), gap):
            status = "no progress"
            break
        here = problem.linearised(state.x)
    return _answer(problem, state, status, history)


def _slope(problem: Problem, x: FloatArray) -> FloatArray:
    """Gradient of the objective ``cost . x + sum(even * x**2) / 2``."""
    return problem.cost + problem.even * x


def _error(state: _State, gradient: FloatArray, gap: FloatArray) -> float:
    """Residual of the barrier problem, in units of its parameter."""
    product = np.abs(state.dual * state.slack - state.barrier).max()
    scale = max(1.0, float(np.abs(state.dual).mean()))
    return float(max(np.abs(gradient).max() / scale, np.abs(gap).max(), product / scale))


class _Step(NamedTuple):
    """A Newton step of unknowns, slacks and multipliers."""

    dx: FloatArray
    ds: FloatArray
    dz: FloatArray


class _Newton:
    """The Newton system at a point, damped until its matrix is positive definite."""

    def __init__(self, problem: Problem, state: _State, here: Any) -> None:
        self._problem, self._here = problem, here
        self._x, self._slack, self._dual = state.x, state.slack, state.dual
        self._barrier = state.barrier
        self._matrix = here.normal(state.dual / state.slack, state.dual)
        self._matrix[0] += problem.even
        self._factor = self._unbent(state) if state.eased else self._factorised(state)

    def _unbent(self, state: _State) -> FloatArray | None:
        """A factor with as much of the curvature as leaves the matrix positive definite."""
        from scipy.linalg import LinAlgError, cholesky_banded

        bent, bend, flat = self._matrix, state.bend, None
        if not np.isfinite(bent).all():
            return None
        tiny = 1e-9 * float(np.abs(bent[0]).mean())
        while bend > 0.0:
            if bend < 1.0 and flat is None:
                flat = self._here.normal(self._dual / self._slack, np.zeros_like(self._dual))
                flat[0] += self._problem.even
            self._matrix = bent.copy() if flat is None else bend * bent + (1.0 - bend) * flat
            self._matrix[0] += tiny
            try:
                factor = cholesky_banded(self._matrix, lower=True, check_finite=False)
            except LinAlgError:
                bend = 0.5 * bend if bend > _LEAST_BEND else 0.0
                continue
            state.bend = min(1.0, 2.0 * bend)
            return np.asarray(factor)
        # Without its curvature the matrix is positive definite but for rounding.
        state.bend = 2.0 * _LEAST_BEND
        assert flat is not None
        self._matrix = flat
        return self._factorised(state)

    def _factorised(self, state: _State) -> FloatArray | None:
        from scipy.linalg import LinAlgError, cholesky_banded

        diagonal = float(np.abs(self._matrix[0]).mean())
        shift = state.shift if state.shift > 1e-12 * diagonal else 0.0
        for _ in range(_MOST_SHIFTS if np.isfinite(diagonal) else 0):
            damped = self._matrix.copy()
            damped[0] += shift
            try:
                factor = cholesky_banded(damped, lower=True, overwrite_ab=True, check_finite=False)
            except LinAlgError:
                shift = max(4.0 * shift, 1e-8 * diagonal)
                continue
            state.shift = shift
            return np.asarray(factor)
        return None

    def step(self, gap: FloatArray) -> _Step | None:
        """The step that closes the ``gap`` between inequalities and slacks."""
        from scipy.linalg import cho_solve_banded

        if self._factor is None:
            return None
        target = self._here.pull((self._barrier - self._dual * gap) / self._slack)
        target -= _slope(self._problem, self._x)
        dx = cho_solve_banded((self._factor, True), target, check_finite=False)
        if not np.isfinite(dx).all():
            return None
        ds = self._here.push(dx) + gap
        return _Step(dx, ds, (self._barrier - self._dual * ds) / self._slack - self._dual)


class _Trial(NamedTuple):
    """A point along a step, its barrier function, and how far it is from feasible."""

    x: FloatArray
    slack: FloatArray
    barrier: float
    miss: float


def _tried(problem: Problem, state: _State, step: _Step, length: float) -> _Trial | None:
    """The point ``length`` along a step; ``None`` where a foot is out of reach."""
    slack = state.slack + length * step.ds
    slack = np.maximum(slack, (1.0 - _TO_BOUNDARY) * state.slack)
    x = state.x + length * step.dx
    values = problem.values(x)
    if not np.isfinite(values).all():
        return None
    x, values = problem.settle(x, values, slack)
    # A slack below its inequality's value only costs: raise it.
    slack = np.maximum(slack, values)
    return _Trial(x, slack, _barrier(problem, state, x, slack), float((slack - values).sum()))


def _advance(problem: Problem, state: _State, newton: _Newton, gap: FloatArray) -> bool:
    """Go along the Newton step as far as the filter allows.

    A point is taken when it is nearer to feasible or has a lower barrier function, and no point
    before it was better in both; where the violation is small the barrier function must fall.
    """
    step = newton.step(gap)
    if step is None:
        return False
    miss = float(np.abs(gap).sum())
    here = _barrier(problem, state, state.x, state.slack)
    fall = float(_slope(problem, state.x) @ step.dx)
    fall -= state.barrier * float((step.ds / state.slack).sum())
    length = _to_boundary(state.slack[problem.settled :], step.ds[problem.settled :])
    for attempt in range(_MOST_HALVINGS):
        trial = _tried(problem, state, step, length)
        strict = fall < 0.0 and (-fall * length) ** 2.3 > miss**1.1
        goal = here + _ARMIJO * length * fall if strict else None
        good = _allowed(state, trial, here, miss, goal)
        if trial is not None and not good and attempt == 0:
            bent = _corrected(problem, state, newton, gap, step, length)
            if bent is not None and _allowed(state, bent[1], here, miss, goal):
                step, trial, good = *bent, True
        if trial is not None and good:
            if not strict:
                state.filter.append((here - _PROGRESS * miss, (1.0 - _PROGRESS) * miss))
            share = _to_boundary(state.dual, step.dz)
            _accept(state, trial, state.dual + share * step.dz)
            # A short step means that the model was trusted too far.
            state.shift *= 0.25 if length > 0.5 else 1.0 if length > 0.1 else 4.0
            return True
        length *= 0.5
    return False


def _allowed(
    state: _State, trial: _Trial | None, here: float, miss: float, goal: float | None
) -> bool:
    """Whether the filter lets a trial pass; ``goal`` bounds its barrier function where given."""
    if trial is None:
        return False
    noise = _ROUNDING * abs(here)
    if any(trial.barrier > b + noise and trial.miss > m for b, m in state.filter):
        return False
    if goal is not None:
        return trial.barrier <= goal + noise and trial.miss <= max(miss, state.largest_miss)
    lower = trial.barrier <= here - _PROGRESS * miss + noise
    return (lower and trial.miss <= state.largest_miss) or trial.miss <= (1.0 - _PROGRESS) * miss


def _corrected(
    problem: Problem,
    state: _State,
    newton: _Newton,
    gap: FloatArray,
    step: _Step,
    length: float,
) -> tuple[_Step, _Trial] | None:
    """The step again, with the curvature seen at its end (second-order correction)."""
    held = problem.settled
    seen = problem.values(state.x + length * step.dx) - (state.slack + length * step.ds)
    seen[:held] = 0.0
    again = newton.step(length * gap + seen)
    if again is None:
        return None
    trial = _tried(problem, state, again, _to_boundary(state.slack[held:], again.ds[held:]))
    return None if trial is None else (again, trial)


def _accept(state: _State, trial: _Trial, dual: FloatArray) -> None:
    state.x, state.slack = trial.x, trial.slack
    ratio = state.barrier / trial.slack
    state.dual = np.clip(dual, ratio / _CLOSE, ratio * _CLOSE)


def _to_boundary(values: FloatArray, steps: FloatArray) -> float:
    shrink = steps < 0
    if not shrink.any():
        return 1.0
    return min(1.0, _TO_BOUNDARY * float((-values[shrink] / steps[shrink]).min()))


def _barrier(problem: Problem, state: _State, x: FloatArray, slack: FloatArray) -> float:
    """The objective with the slacks' logarithms."""
    return float((problem.cost + problem.even * x / 2.0) @ x - state.barrier * np.log(slack).sum())


def _answer(
    problem: Problem, state: _State, status: str, history: list[tuple[float, ...]]
) -> Answer:
    """Residuals from scratch, whatever the iteration believed."""
    here = problem.linearised(state.x)
    slope = _slope(problem, state.x) - here.pull(state.dual)
    return Answer(
        x=state.x, duals=state.dual, status=status, iterations=len(history) - 1,
        primal=float(np.maximum(-here.values, 0.0).max(initial=0.0)),
        stationarity=float(np.abs(slope).max(initial=0.0)),
        complementarity=float(np.abs(state.dual * here.values).sum()), history=tuple(history),
    )  # fmt: skip
