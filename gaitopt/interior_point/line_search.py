"""How far an interior-point method goes along a Newton step: a line search with a filter."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.newton import Newton, State, Step
from gaitopt.interior_point.problem import Problem, slope_of

_TO_BOUNDARY = 0.995
_ARMIJO = 1e-4
_CLOSE = 1e10
_ROUNDING = 1e-10
_PROGRESS = 1e-5
_MOST_HALVINGS = 40


class _Trial(NamedTuple):
    """A point along a step, its barrier function, and how far it is from feasible."""

    x: FloatArray
    slack: FloatArray
    barrier: float
    miss: float


def _tried(problem: Problem, state: State, step: Step, length: float) -> _Trial | None:
    """The point ``length`` along a step; ``None`` where a foot is out of reach."""
    slack = state.slack + length * step.ds
    slack = np.maximum(slack, (1.0 - _TO_BOUNDARY) * state.slack)
    x = state.x + length * step.dx
    values = problem.values(x)
    if not np.isfinite(values).all():
        return None
    x, values = problem.restore(x, values, slack)
    # A slack below its inequality's value only costs: raise it.
    slack = np.maximum(slack, values)
    return _Trial(x, slack, _barrier(problem, state, x, slack), float((slack - values).sum()))


def advance(problem: Problem, state: State, newton: Newton, gap: FloatArray) -> bool:
    """Go along the Newton step as far as the filter allows.

    A point is taken when it is nearer to feasible or has a lower barrier function, and no point
    before it was better in both; where the violation is small the barrier function must fall.
    """
    step = newton.step(gap)
    if step is None:
        return False
    miss = float(np.abs(gap).sum())
    here = _barrier(problem, state, state.x, state.slack)
    fall = float(slope_of(problem, state.x) @ step.dx)
    fall -= state.barrier * float((step.ds / state.slack).sum())
    length = _to_boundary(state.slack[problem.restorable :], step.ds[problem.restorable :])
    for attempt in range(_MOST_HALVINGS):
        trial = _tried(problem, state, step, length)
        strict = fall < 0.0 and (-fall * length) ** 2.3 > miss**1.1
        goal = here + _ARMIJO * length * fall if strict else None
        good = _allowed(state, trial, here, miss, goal)
        if trial is not None and not good and attempt == 0:
            corrected = _corrected(problem, state, newton, gap, step, length)
            if corrected is not None and _allowed(state, corrected[1], here, miss, goal):
                step, trial, good = *corrected, True
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
    state: State, trial: _Trial | None, here: float, miss: float, goal: float | None
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
    state: State,
    newton: Newton,
    gap: FloatArray,
    step: Step,
    length: float,
) -> tuple[Step, _Trial] | None:
    """The step again, with the curvature seen at its end (second-order correction)."""
    held = problem.restorable
    seen = problem.values(state.x + length * step.dx) - (state.slack + length * step.ds)
    seen[:held] = 0.0
    again = newton.step(length * gap + seen)
    if again is None:
        return None
    trial = _tried(problem, state, again, _to_boundary(state.slack[held:], again.ds[held:]))
    return None if trial is None else (again, trial)


def _accept(state: State, trial: _Trial, dual: FloatArray) -> None:
    state.x, state.slack = trial.x, trial.slack
    ratio = state.barrier / trial.slack
    state.dual = np.clip(dual, ratio / _CLOSE, ratio * _CLOSE)


def _to_boundary(values: FloatArray, steps: FloatArray) -> float:
    shrink = steps < 0
    if not shrink.any():
        return 1.0
    return min(1.0, _TO_BOUNDARY * float((-values[shrink] / steps[shrink]).min()))


def _barrier(problem: Problem, state: State, x: FloatArray, slack: FloatArray) -> float:
    """The objective with the slacks' logarithms."""
    return float(
        (problem.linear_cost + problem.quadratic_cost * x / 2.0) @ x
        - state.barrier * np.log(slack).sum()
    )
