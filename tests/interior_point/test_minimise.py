"""Problems with known minima, many of them from Hock and Schittkowski (1981), numbered HS."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.optimize
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from gaitopt.interior_point.solver import VIOLATION, minimise
from gaitopt.interior_point.status import Status

Array = NDArray[np.float64]
Values = Callable[[Array], Array]
NAN = float("nan")


@dataclass(frozen=True, eq=False)
class Toy:
    """A problem with dense derivatives and a known minimum.

    Its objective is ``linear . x + sum(quadratic * x**2) / 2``; where that does not do, the first
    unknown is a bound on the real objective.
    """

    name: str
    linear: Array
    quadratic: Array
    inequalities: Values
    jacobian: Values
    hessian: Callable[[Array, Array], Array]
    start: Array
    minimum: Array
    best: float
    iterations: int = 20
    restorable: int = 0

    @property
    def linear_cost(self) -> Array:
        return self.linear

    @property
    def quadratic_cost(self) -> Array:
        return self.quadratic

    def values(self, x: Array) -> Array:
        return self.inequalities(x)

    def restore(self, x: Array, values: Array, slack: Array) -> tuple[Array, Array]:
        return x, values

    def linearise(self, x: Array) -> DenseLinearisation:
        return DenseLinearisation(self, x)


class DenseLinearisation:
    def __init__(self, toy: Toy, x: Array) -> None:
        self.toy, self.x = toy, x
        self.values = toy.inequalities(x)
        self.jacobian = toy.jacobian(x)

    def jacobian_times(self, dx: Array) -> Array:
        return self.jacobian @ dx

    def jacobian_transpose_times(self, v: Array) -> Array:
        return self.jacobian.T @ v

    def newton_matrix(self, scale: Array, multipliers: Array) -> Array:
        matrix = self.jacobian.T @ (scale[:, None] * self.jacobian)
        return lower_band(matrix - self.toy.hessian(self.x, multipliers))


def lower_band(matrix: Array) -> Array:
    """A symmetric matrix in LAPACK's lower banded form."""
    size = len(matrix)
    return np.array([np.append(np.diag(matrix, -d), np.zeros(d)) for d in range(size)])


def box(low: list[float], high: list[float]) -> tuple[Values, Array]:
    """Values and Jacobian of ``low <= x <= high``."""
    eye = np.eye(len(low))
    return (lambda x: np.concatenate([x - low, high - x])), np.concatenate([eye, -eye])


def no_curvature(x: Array, v: Array) -> Array:
    return np.zeros((len(x), len(x)))


def linear_program() -> Toy:
    """The fastest way to a corner of a polygon."""
    matrix = np.array([[1.0, 0], [0, 1], [-1, -1], [-1, 0], [0, -1]])
    return Toy(
        "linear program", np.array([-1.0, -2]), np.zeros(2),
        lambda x: matrix @ x + [0, 0, 4, 3, 3], lambda x: matrix, no_curvature,
        np.array([1.0, 1]), np.array([1.0, 3]), -7.0,
    )  # fmt: skip


def hs21() -> Toy:
    values, bounds = box([2, -50], [50, 50])
    matrix = np.vstack([[10.0, -1], bounds])
    return Toy(
        "HS 21", np.zeros(2), np.array([0.02, 2.0]),
        lambda x: np.concatenate([[10 * x[0] - x[1] - 10], values(x)]), lambda x: matrix,
        no_curvature, np.array([-1.0, -1]), np.array([2.0, 0]), 0.04,
    )  # fmt: skip


def hs12() -> Toy:
    """A parabola within an ellipse; the first unknown bounds the parabola."""
    return Toy(
        "HS 12", np.array([1.0, 0, 0]), np.zeros(3),
        lambda x: np.array([
            x[0] - (x[1] ** 2 / 2 + x[2] ** 2 - x[1] * x[2] - 7 * x[1] - 7 * x[2]),
            25 - 4 * x[1] ** 2 - x[2] ** 2,
        ]),
        lambda x: np.array([
            [1, -x[1] + x[2] + 7, -2 * x[2] + x[1] + 7], [0, -8 * x[1], -2 * x[2]],
        ]),
        lambda x, v: v[0] * np.array([[0.0, 0, 0], [0, -1, 1], [0, 1, -2]])
        + v[1] * np.diag([0.0, -8, -2]),
        np.zeros(3), np.array([-30.0, 2, 3]), -30.0,
    )  # fmt: skip


def hs35() -> Toy:
    """Beale's problem; the first unknown bounds the quadratic."""
    curvature = np.array([[4.0, 2, 2], [2, 4, 0], [2, 0, 2]])
    slope = np.array([-8.0, -6, -4])
    rows = np.array([[0.0, -1, -1, -2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    full = np.zeros((4, 4))
    full[1:, 1:] = curvature
    return Toy(
        "HS 35", np.array([1.0, 0, 0, 0]), np.zeros(4),
        lambda x: np.concatenate([
            [x[0] - 9 - slope @ x[1:] - x[1:] @ curvature @ x[1:] / 2], rows @ x + [3, 0, 0, 0],
        ]),
        lambda x: np.vstack([np.append(1, -slope - curvature @ x[1:]), rows]),
        lambda x, v: -v[0] * full,
        np.array([10.0, 0.5, 0.5, 0.5]), np.array([1 / 9, 4 / 3, 7 / 9, 4 / 9]), 1 / 9,
    )  # fmt: skip


ROSEN_SUZUKI = np.array([[-2.0, -2, -2, -2], [-2, -4, -2, -4], [-4, -2, -2, 0]])
ROSEN_SUZUKI_SLOPES = np.array([[-1.0, 1, -1, 1], [1, 0, 0, 1], [-2, 1, 0, 1]])


def hs43() -> Toy:
    """Rosen and Suzuki's problem."""
    return Toy(
        "HS 43", np.array([-5.0, -5, -21, 7]), np.array([2.0, 2, 4, 2]),
        lambda x: np.array([8.0, 10, 5]) + ROSEN_SUZUKI_SLOPES @ x + ROSEN_SUZUKI @ x**2 / 2,
        lambda x: ROSEN_SUZUKI_SLOPES + ROSEN_SUZUKI * x,
        lambda x, v: np.diag(v @ ROSEN_SUZUKI),
        np.zeros(4), np.array([0.0, 1, 2, -1]), -44.0,
    )  # fmt: skip


def rosenbrock() -> Toy:
    """Rosenbrock's valley as far as x = 1/2; the first unknown bounds the function."""
    values, bounds = box([-100, -2, -2], [100, 0.5, 2])

    def valley(x: Array) -> float:
        return float(100 * (x[2] - x[1] ** 2) ** 2 + (1 - x[1]) ** 2)

    def slope(x: Array) -> list[float]:
        fall = x[2] - x[1] ** 2
        return [1, 400 * x[1] * fall + 2 * (1 - x[1]), -200 * fall]

    def hessian(x: Array, v: Array) -> Array:
        twice = [
            [0, 0, 0],
            [0, -400 * (x[2] - 3 * x[1] ** 2) + 2, -400 * x[1]],
            [0, -400 * x[1], 200],
        ]
        return -v[0] * np.array(twice)

    return Toy(
        "Rosenbrock within bounds", np.array([1.0, 0, 0]), np.zeros(3),
        lambda x: np.append(x[0] - valley(x), values(x)),
        lambda x: np.vstack([slope(x), bounds]), hessian,
        np.array([30.0, -1.2, 1]), np.array([0.25, 0.5, 0.25]), 0.25, 30,
    )  # fmt: skip


def hs29() -> Toy:
    """The largest box within an ellipsoid: its product of three unknowns is not convex."""
    sizes = np.array([0.0, 1, 2, 4])

    def slope(x: Array) -> list[float]:
        return [1, x[2] * x[3], x[1] * x[3], x[1] * x[2]]

    def hessian(x: Array, v: Array) -> Array:
        product = [[0, 0, 0, 0], [0, 0, x[3], x[2]], [0, x[3], 0, x[1]], [0, x[2], x[1], 0]]
        return v[0] * np.array(product) - 2 * v[1] * np.diag(sizes)

    return Toy(
        "HS 29", np.array([1.0, 0, 0, 0]), np.zeros(4),
        lambda x: np.array([x[0] + x[1] * x[2] * x[3], 48 - sizes @ x**2]),
        lambda x: np.array([slope(x), -2 * sizes * x]), hessian,
        np.array([0.0, 1, 1, 1]), np.array([-16 * 2**0.5, 4, 2 * 2**0.5, 2]), -16 * 2**0.5,
    )  # fmt: skip


def outside_a_disc() -> Toy:
    """The point outside the unit disc that is nearest to one inside it."""
    return Toy(
        "outside a disc", np.array([0.0, -0.2]), np.array([2.0, 2]),
        lambda x: np.array([x @ x - 1]), lambda x: 2 * x[None], lambda x, v: 2 * v[0] * np.eye(2),
        np.array([0.5, 1.5]), np.array([0.0, 1]), 0.8,
    )  # fmt: skip


def downhill_both_ways() -> Toy:
    """An objective that is not convex: every iterate's Newton matrix may be indefinite."""
    values, bounds = box([-1], [2])
    return Toy(
        "downhill both ways", np.array([-0.1]), np.array([-1.0]), values, lambda x: bounds,
        no_curvature, np.array([0.5]), np.array([2.0]), -2.2,
    )  # fmt: skip


TOYS = [
    linear_program(), hs21(), hs12(), hs35(), hs43(), rosenbrock(), hs29(), outside_a_disc(),
    downhill_both_ways(), replace(hs43(), name="HS 43 from outside", start=np.full(4, 3.0)),
]  # fmt: skip


@pytest.mark.parametrize("reduce_curvature", [False, True])
@pytest.mark.parametrize("toy", TOYS, ids=[toy.name for toy in TOYS])
def test_the_minimum_is_the_known_one(toy: Toy, reduce_curvature: bool) -> None:
    solution = minimise(toy, toy.start, tolerance=1e-7, reduce_curvature=reduce_curvature)
    assert solution.status is Status.SOLVED and solution.solved
    assert solution.objective() == pytest.approx(toy.best, abs=1e-5)
    assert solution.x == pytest.approx(toy.minimum, abs=1e-3)
    assert solution.violation() <= VIOLATION
    assert solution.stationarity() <= 1e-5
    assert solution.complementarity() <= 1e-5
    assert (solution.multipliers > 0.0).all()
    assert solution.iterations <= toy.iterations


@pytest.mark.parametrize("toy", TOYS, ids=[toy.name for toy in TOYS])
def test_derivatives_are_those_of_differences(toy: Toy) -> None:
    rng = np.random.default_rng(0)
    x, step = toy.start + 0.1 * rng.normal(size=len(toy.start)), 1e-6
    here = toy.linearise(x)
    v = rng.normal(size=len(here.values))
    ends = [[toy.linearise(x + s * step * e) for s in (1, -1)] for e in np.eye(len(x))]
    jacobian = np.array([(a.values - b.values) / (2 * step) for a, b in ends]).T
    assert here.jacobian == pytest.approx(jacobian, abs=1e-5)
    hessian = [(a.jacobian - b.jacobian).T @ v / (2 * step) for a, b in ends]
    assert toy.hessian(x, v) == pytest.approx(np.array(hessian), abs=1e-5)


def test_residuals_are_computed_from_the_problem() -> None:
    toy = hs43()
    solution = minimise(toy, toy.start)
    x, z = solution.x, solution.multipliers
    gradient = toy.linear + toy.quadratic * x - toy.jacobian(x).T @ z
    assert solution.lagrangian_gradient() == pytest.approx(gradient, abs=1e-15)
    assert solution.stationarity() == np.abs(gradient).max()
    assert solution.complementarity() == pytest.approx(float(np.abs(z * toy.values(x)).sum()))
    moved = replace(solution, x=x + 1.0)
    assert moved.violation() == pytest.approx(float(-toy.values(x + 1.0).min()))


def test_the_tolerance_bounds_the_error() -> None:
    """A linear program's objective is above its minimum by no more than the complementarity."""
    toy = linear_program()
    errors = []
    for tolerance in (1e-2, 1e-4, 1e-6):
        solution = minimise(toy, toy.start, tolerance=tolerance)
        errors.append(solution.objective() - toy.best)
        assert errors[-1] <= 1.01 * solution.complementarity() + 1e-9
        assert solution.complementarity() <= 10 * tolerance * abs(toy.best)
    assert errors == sorted(errors, reverse=True)


def test_multipliers_of_a_similar_problem_save_iterations() -> None:
    toy = hs43()
    first = minimise(toy, toy.start)
    moved = replace(toy, linear=toy.linear + 0.01)
    cold = minimise(moved, toy.start)
    warm = minimise(moved, first.x, barrier=1e-4, multipliers=first.multipliers)
    assert warm.solved and warm.objective() == pytest.approx(cold.objective(), abs=0.05)
    assert warm.iterations < cold.iterations / 2


@pytest.mark.parametrize("stationary", [0.0, 1e-3, 1e-1])
def test_a_rough_gradient_saves_steps_and_inequalities_are_kept(stationary: float) -> None:
    toy = rosenbrock()
    exact = minimise(toy, toy.start, tolerance=1e-7)
    rough = minimise(toy, toy.start, tolerance=1e-7, stationary=stationary)
    assert rough.solved and rough.violation() <= VIOLATION
    assert rough.iterations <= exact.iterations
    assert rough.stationarity() <= max(stationary, 1e-5)


def test_a_matrix_that_is_not_positive_definite_is_damped() -> None:
    solution = minimise(downhill_both_ways(), np.array([0.5]))
    assert max(one.damping for one in solution.history) > 0.1


def infeasible() -> Toy:
    """At least 1 and at most 0."""
    matrix = np.array([[1.0], [-1.0]])
    return Toy(
        "infeasible", np.ones(1), np.zeros(1), lambda x: matrix @ x + [-1.0, 0.0],
        lambda x: matrix, no_curvature, np.array([0.5]), np.array([NAN]), NAN,
    )  # fmt: skip


def test_an_infeasible_problem_is_never_solved() -> None:
    solution = minimise(infeasible(), np.array([0.5]))
    assert solution.status is Status.NO_PROGRESS
    assert solution.violation() >= 0.5
    assert "contradict each other: relax them" in str(solution.status)


def test_no_progress_is_reported() -> None:
    """Where all points but the start are undefined, no step can be taken."""
    toy = linear_program()
    start = toy.start

    def broken(x: Array) -> Array:
        return toy.inequalities(x) if np.array_equal(x, start) else np.full(5, NAN)

    solution = minimise(replace(toy, inequalities=broken), start)
    assert solution.status is Status.NO_PROGRESS
    assert solution.iterations == 0
    assert "start from another point" in str(solution.status)


def test_the_iteration_limit_is_reported() -> None:
    toy = hs43()
    solution = minimise(toy, toy.start, iteration_limit=3)
    assert solution.status is Status.ITERATION_LIMIT
    assert solution.iterations == 3 and len(solution.history) == 4
    assert "more iterations" in str(solution.status)
    needed = minimise(toy, toy.start).iterations
    assert minimise(toy, toy.start, iteration_limit=needed).solved


def test_an_undefined_start_is_reported() -> None:
    solution = minimise(linear_program(), np.array([NAN, 1.0]))
    assert solution.status is Status.UNDEFINED_START
    assert solution.iterations == 0


class Stretched(Toy):
    """A toy of which the second unknown can make the first inequality hold, whatever it takes."""

    def restore(self, x: Array, values: Array, slack: Array) -> tuple[Array, Array]:
        missing = max(slack[0] - values[0], 0.0)
        x, values = x.copy(), values.copy()
        x[1] += missing
        values[0] += missing
        return x, values


def test_inequalities_that_can_be_restored_are_met_at_every_step() -> None:
    """The least bound of a curved function, which the bound itself can always meet."""
    toy = Stretched(
        "restorable", np.array([0.0, 1]), np.zeros(2),
        lambda x: np.array([x[1] - np.cosh(x[0]), x[0] - 0.5]),
        lambda x: np.array([[-np.sinh(x[0]), 1], [1.0, 0]]),
        lambda x, v: np.diag([-v[0] * np.cosh(x[0]), 0]),
        np.array([3.0, 0]), np.array([0.5, np.cosh(0.5)]), float(np.cosh(0.5)), restorable=1,
    )  # fmt: skip
    solution = minimise(toy, toy.start, tolerance=1e-7)
    assert solution.solved
    assert solution.x == pytest.approx(toy.minimum, abs=1e-4)
    stopped = minimise(toy, toy.start, iteration_limit=1)
    assert stopped.iterations == 1 and stopped.problem.values(stopped.x)[0] > 0.0


@settings(max_examples=60, deadline=None, derandomize=True)
@given(size=st.integers(1, 6), seed=st.integers(0, 10**6))
def test_random_quadratic_programs_are_scipy_s(size: int, seed: int) -> None:
    """Strictly convex, within a box of ``matrix @ x``: least squares within bounds of that."""
    rng = np.random.default_rng(seed)
    matrix = np.eye(size) + 0.5 * rng.normal(size=(size, size)) / size
    weight, linear = rng.uniform(0.2, 5.0, size), rng.normal(size=size)
    low = rng.uniform(-1.0, 1.0, size)
    high = low + rng.uniform(0.1, 2.0, size)
    jacobian = np.concatenate([matrix, -matrix])
    toy = Toy(
        "box", linear, weight, lambda x: jacobian @ x + np.concatenate([-low, high]),
        lambda x: jacobian, no_curvature, np.zeros(size), np.zeros(size), 0.0,
    )  # fmt: skip
    solution = minimise(toy, rng.normal(size=size), tolerance=1e-8)
    back = np.linalg.inv(matrix)
    scaled = np.sqrt(weight)
    known = scipy.optimize.lsq_linear(scaled[:, None] * back, -linear / scaled, (low, high),
                                      tol=1e-14)  # fmt: skip
    assert solution.solved
    assert solution.x == pytest.approx(back @ known.x, abs=1e-4)
    assert solution.iterations <= 40
