"""How far to go along a Newton step: the line search with a filter of [Waechter2006].

A point is judged by two numbers. Its *violation* is the sum of ``|values(x) - slack|``. Its
*barrier function* is ``objective(x) - mu sum(log(slack))``. Steps are halved until one is found
that improves either of them enough, and that no point in the filter beats in both. Where the
violation is small, the barrier function itself must fall (Armijo's condition).

Names of constants in brackets are those of [Waechter2006]; IPOPT's options have the same names.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.iterate import Iterate
from gaitopt.interior_point.newton import NewtonSystem, Step
from gaitopt.interior_point.problem import Problem, objective, objective_gradient

_TO_BOUNDARY = 0.995
"""Share of the way to zero that slacks and multipliers may go in a step [tau]. The value is that of
[Nocedal2006], section 19.2; IPOPT's is 0.99 at least (``tau_min``), and rises as mu falls."""
_SUFFICIENT_DECREASE = 1e-4
"""Share of the promised fall of the barrier function that must come true [eta_phi]; as in the
paper, where IPOPT's option is 1e-8."""
_SUFFICIENT_PROGRESS = 1e-5
"""Share of the violation by which it, or the barrier function, must fall [gamma_theta, gamma_phi];
both as in the paper, where IPOPT's option gamma_phi is 1e-8."""
_FALL_EXPONENT, _VIOLATION_EXPONENT = 2.3, 1.1
"""Exponents of the switching condition [s_phi, s_theta]: the barrier function must fall where
``fall ** s_phi > violation ** s_theta``. In the paper the step's length stands outside the power;
here ``fall`` is what the slope promises over the step, its length included."""
_MULTIPLIER_RANGE = 1e10
"""Factor by which a multiplier may differ from mu over its slack [kappa_sigma]; as in the paper
and in IPOPT."""
_ROUNDING = 1e-10
"""Differences of the barrier function that are no more than this share of it count as rounding.
IPOPT takes ten times the machine's precision. Here the logarithms of up to 10^5 slacks are added
up; walks of 16 steps are the same with 1e-15."""
_MOST_HALVINGS = 40
"""Halvings before the search gives up: a step of 1e-12 of the whole changes nothing any more."""
_LONG_STEP, _SHORT_STEP = 0.5, 0.1
"""After a longer step than the first the next Newton matrix is damped less, after a shorter one
than the second it is damped more."""
_DAMPING_FALL, _DAMPING_RISE = 0.25, 4.0
"""Factors of less and more damping. IPOPT divides by 3 after every step (``perturb_dec_fact``), and
never damps more for a short step."""


class _Trial(NamedTuple):
    """A point along a step.

    Attributes:
        x: unknowns.
        slack: slacks, none of them below its inequality's value.
        seen: values of the inequalities before any of them was restored.
        barrier_function: there.
        violation: there.
    """

    x: FloatArray
    slack: FloatArray
    seen: FloatArray
    barrier_function: float
    violation: float


class _Reference(NamedTuple):
    """What trial points are compared with.

    Attributes:
        barrier_function, violation: where the step begins.
        slope: derivative of the barrier function along the step.
    """

    barrier_function: float
    violation: float
    slope: float

    def must_decrease(self, length: float) -> bool:
        """Whether the barrier function must fall on a step of this length (switching condition)."""
        if not self.slope < 0.0:
            return False
        fall = -self.slope * length
        return bool(fall**_FALL_EXPONENT > self.violation**_VIOLATION_EXPONENT)

    def accepts(self, iterate: Iterate, trial: _Trial | None, length: float) -> bool:
        """Whether a trial point is good enough."""
        if trial is None:
            return False
        here, noise = self.barrier_function, _ROUNDING * abs(self.barrier_function)
        if any(
            trial.barrier_function > barrier_function + noise and trial.violation > violation
            for barrier_function, violation in iterate.filter
        ):
            return False
        if self.must_decrease(length):
            goal = here + _SUFFICIENT_DECREASE * length * self.slope
            allowed = max(self.violation, iterate.violation_limit)
            return trial.barrier_function <= goal + noise and trial.violation <= allowed
        lower = trial.barrier_function <= here - _SUFFICIENT_PROGRESS * self.violation + noise
        nearer = trial.violation <= (1.0 - _SUFFICIENT_PROGRESS) * self.violation
        return (lower and trial.violation <= iterate.violation_limit) or nearer


def advance(problem: Problem, iterate: Iterate, newton: NewtonSystem, residual: FloatArray) -> bool:
    """Move the iterate along its Newton step, as far as the filter allows.

    Args:
        problem: what is solved.
        iterate: is moved; its filter and damping are brought up to date.
        newton: the system at the iterate.
        residual: ``values - slack`` there ``(m,)``.

    Returns:
        Whether it moved; ``False`` where there is no step, or no part of it is acceptable.
    """
    step = newton.step(residual)
    if step is None:
        return False
    reference = _reference(problem, iterate, step, residual)
    length = _longest(problem, iterate, step)
    for attempt in range(_MOST_HALVINGS):
        trial = _trial(problem, iterate, step, length)
        accepted = reference.accepts(iterate, trial, length)
        if trial is not None and not accepted and attempt == 0:
            seen = trial.seen - (iterate.slack + length * step.slack)
            corrected = _second_order_correction(problem, iterate, newton, residual, length, seen)
            if corrected is not None and reference.accepts(iterate, corrected[1], length):
                step, trial, accepted = *corrected, True
        if trial is not None and accepted:
            _take(iterate, reference, step, trial, length)
            return True
        length *= 0.5
    return False


def _reference(problem: Problem, iterate: Iterate, step: Step, residual: FloatArray) -> _Reference:
    """The merit of the iterate, and its derivative along the step."""
    slope = float(objective_gradient(problem, iterate.x) @ step.x)
    slope -= iterate.barrier * float((step.slack / iterate.slack).sum())
    here = _barrier_function(problem, iterate.barrier, iterate.x, iterate.slack)
    return _Reference(here, float(np.abs(residual).sum()), slope)


def _longest(problem: Problem, iterate: Iterate, step: Step) -> float:
    """The length of step, at most 1, that keeps slacks positive, but for those to be restored."""
    first = problem.restorable
    return _fraction_to_boundary(iterate.slack[first:], step.slack[first:])


def _trial(problem: Problem, iterate: Iterate, step: Step, length: float) -> _Trial | None:
    """The point at a share of a step; ``None`` where an inequality is undefined."""
    slack = iterate.slack + length * step.slack
    slack = np.maximum(slack, (1.0 - _TO_BOUNDARY) * iterate.slack)
    x = iterate.x + length * step.x
    values = problem.values(x)
    if not np.isfinite(values).all():
        return None
    seen = values
    x, values = problem.restore(x, values, slack)
    # A slack below its inequality's value makes both numbers worse: raise it.
    slack = np.maximum(slack, values)
    barrier_function = _barrier_function(problem, iterate.barrier, x, slack)
    return _Trial(x, slack, seen, barrier_function, float((slack - values).sum()))


def _second_order_correction(
    problem: Problem,
    iterate: Iterate,
    newton: NewtonSystem,
    residual: FloatArray,
    length: float,
    seen: FloatArray,
) -> tuple[Step, _Trial] | None:
    """A step that makes up for the curvature seen at the end of the first one, and its end.

    The residual there is added to that at the iterate ([Waechter2006], section 2.4). Only one
    correction is tried, where IPOPT tries up to four (``max_soc``).

    Args:
        problem, iterate, newton, residual: as for :func:`advance`.
        length: of the first step.
        seen: ``values - slack`` at its end ``(m,)``; is changed.
    """
    seen[: problem.restorable] = 0.0
    corrected = newton.step(length * residual + seen)
    if corrected is None:
        return None
    trial = _trial(problem, iterate, corrected, _longest(problem, iterate, corrected))
    return None if trial is None else (corrected, trial)


def _take(
    iterate: Iterate, reference: _Reference, step: Step, trial: _Trial, length: float
) -> None:
    """Move the iterate to a trial point, and remember what was seen on the way."""
    if not reference.must_decrease(length):
        lost = _SUFFICIENT_PROGRESS * reference.violation
        iterate.filter.append(
            (reference.barrier_function - lost, (1.0 - _SUFFICIENT_PROGRESS) * reference.violation)
        )
    share = _fraction_to_boundary(iterate.multipliers, step.multipliers)
    multipliers = iterate.multipliers + share * step.multipliers
    iterate.x, iterate.slack = trial.x, trial.slack
    central = iterate.barrier / trial.slack
    iterate.multipliers = np.clip(
        multipliers, central / _MULTIPLIER_RANGE, central * _MULTIPLIER_RANGE
    )
    # A short step tells that the quadratic model was trusted too far.
    if length > _LONG_STEP:
        iterate.damping *= _DAMPING_FALL
    elif length <= _SHORT_STEP:
        iterate.damping *= _DAMPING_RISE


def _fraction_to_boundary(values: FloatArray, steps: FloatArray) -> float:
    """The share of ``steps``, at most 1, that leaves positive ``values`` positive."""
    fastest = float((steps / values).min(initial=0.0))
    return 1.0 if fastest >= 0.0 else min(1.0, -_TO_BOUNDARY / fastest)


def _barrier_function(problem: Problem, barrier: float, x: FloatArray, slack: FloatArray) -> float:
    """``objective(x) - mu sum(log(slack))``."""
    return objective(problem, x) - barrier * float(np.log(slack).sum())
