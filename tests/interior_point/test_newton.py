"""Newton steps, judged by the conditions that they are to meet."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from gaitopt.interior_point.iterate import Iterate
from gaitopt.interior_point.newton import NewtonSystem

Array = NDArray[np.float64]


class Saddle:
    """Unknowns between -1 and 1, and one inequality ``1 - curvature * x0 * x1 >= 0``."""

    restorable = 0

    def __init__(self, curvature: float, size: int = 3) -> None:
        self.curvature, self.size = curvature, size
        self.linear_cost, self.quadratic_cost = np.arange(1.0, size + 1), np.full(size, 0.5)

    def values(self, x: Array) -> Array:
        return np.concatenate([1 + x, 1 - x, [1 - self.curvature * x[0] * x[1]]])

    def restore(self, x: Array, values: Array, slack: Array) -> tuple[Array, Array]:
        return x, values

    def linearise(self, x: Array) -> SaddleLinearisation:
        return SaddleLinearisation(self, x)


class SaddleLinearisation:
    def __init__(self, problem: Saddle, x: Array) -> None:
        self.values, self.hessian = problem.values(x), np.zeros((problem.size,) * 2)
        eye = np.eye(problem.size)
        curved = -problem.curvature * (x[1] * eye[0] + x[0] * eye[1])
        self.jacobian = np.vstack([eye, -eye, curved])
        self.hessian[0, 1] = self.hessian[1, 0] = -problem.curvature

    def jacobian_times(self, dx: Array) -> Array:
        return self.jacobian @ dx

    def jacobian_transpose_times(self, v: Array) -> Array:
        return self.jacobian.T @ v

    def matrix(self, scale: Array, multipliers: Array) -> Array:
        return self.jacobian.T @ (scale[:, None] * self.jacobian) - multipliers[-1] * self.hessian

    def newton_matrix(self, scale: Array, multipliers: Array) -> Array:
        full = self.matrix(scale, multipliers)
        return np.array([np.append(np.diag(full, -d), np.zeros(d)) for d in range(len(full))])


def at_random(problem: Saddle, seed: int, multiplier: float) -> tuple[Iterate, Array]:
    """An iterate with slacks that are not the inequalities' values, and their differences."""
    rng = np.random.default_rng(seed)
    x = rng.uniform(-0.5, 0.5, problem.size)
    values = problem.values(x)
    slack = values * rng.uniform(0.5, 2.0, len(values))
    multipliers = rng.uniform(0.5, 2.0, len(values))
    multipliers[-1] = multiplier
    return Iterate(x, slack, multipliers, 0.1, 1.0), values - slack


@pytest.mark.parametrize("seed", range(5))
def test_a_step_meets_the_linearised_conditions(seed: int) -> None:
    """Slacks meet values, products of slack and multiplier mu, and the gradient vanishes."""
    problem = Saddle(curvature=0.3)
    iterate, residual = at_random(problem, seed, multiplier=1.0)
    here = problem.linearise(iterate.x)
    step = NewtonSystem(problem, iterate, here, False).step(residual)
    assert step is not None and iterate.damping == 0.0
    slack, z = iterate.slack, iterate.multipliers
    values = here.values + here.jacobian @ step.x
    assert values == pytest.approx(slack + step.slack, abs=1e-12)
    product = slack * z + slack * step.multipliers + z * step.slack
    assert product == pytest.approx(np.full(len(slack), 0.1), abs=1e-12)
    gradient = problem.linear_cost + problem.quadratic_cost * (iterate.x + step.x)
    gradient -= here.jacobian.T @ (z + step.multipliers) + z[-1] * here.hessian @ step.x
    assert gradient == pytest.approx(np.zeros(problem.size), abs=1e-11)


@pytest.mark.parametrize("reduce_curvature", [False, True])
def test_an_indefinite_matrix_still_leads_downhill(reduce_curvature: bool) -> None:
    """Damped, or with less of the curvature; which is remembered for the next step."""
    problem = Saddle(curvature=1.0)
    iterate, _ = at_random(problem, 0, multiplier=1e3)
    iterate.slack = problem.values(iterate.x)
    here = problem.linearise(iterate.x)
    exact = here.matrix(iterate.multipliers / iterate.slack, iterate.multipliers)
    assert np.linalg.eigvalsh(exact + np.diag(problem.quadratic_cost)).min() < -1.0
    step = NewtonSystem(problem, iterate, here, reduce_curvature).step(np.zeros(7))
    assert step is not None
    slope = (problem.linear_cost + problem.quadratic_cost * iterate.x) @ step.x
    slope -= iterate.barrier * (step.slack / iterate.slack).sum()
    assert slope < 0.0
    assert (iterate.curvature_share < 1.0) == reduce_curvature
    assert (iterate.damping > 0.0) == (not reduce_curvature)


def test_a_matrix_that_is_not_finite_gives_no_step() -> None:
    problem = Saddle(curvature=np.inf)
    iterate, residual = at_random(Saddle(curvature=0.0), 0, multiplier=1.0)
    with np.errstate(invalid="ignore"):
        here = problem.linearise(iterate.x)
        for reduce_curvature in (False, True):
            system = NewtonSystem(problem, iterate, here, reduce_curvature)
            assert system.step(residual) is None
