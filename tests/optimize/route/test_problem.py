"""Problems of time-optimal walks, judged by differences, by dense matrices, and by IPOPT."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

from gaitopt import LEGS, Quadruped
from gaitopt.interior_point.solver import minimise
from gaitopt.interior_point.status import Status
from gaitopt.optimize.route.carried import carried_multipliers
from gaitopt.optimize.route.dynamic_layout import Entry, ZmpRows
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.optimize.route.layout import Rows
from gaitopt.optimize.route.problem import RouteProblem

Array = NDArray[np.float64]


def with_accelerations(problem: RouteProblem, moving: bool = False) -> DynamicRouteProblem:
    """The same problem with random limits and rows for the ZMP; it may begin in motion."""
    rng = np.random.default_rng(3)
    knots = problem.knots
    shared = {f.name: getattr(problem, f.name) for f in fields(RouteProblem)}
    return DynamicRouteProblem(
        **shared, acceleration_limits=rng.uniform(3, 4, (2, knots, 12)),
        interval_velocity_limits=rng.uniform(0.2, 0.3, (2, knots - 1, 12)),
        zmp=ZmpRows(np.sort(rng.integers(1, knots, 20)), rng.normal(size=(20, 2)),
                    0.01 * rng.normal(size=20), 0.02 * rng.normal(size=20), np.zeros(20),
                    np.full(20, 9.81)),
        entry=Entry(rng.normal(size=15), 0.2) if moving else None,
    )  # fmt: skip


@pytest.mark.parametrize("com", ["body", "model"])
@pytest.mark.parametrize("kind", ["fast", "smooth", "moving"])
@pytest.mark.parametrize("variant", ["route", "overlap", "swing", "height", "posture"])
def test_derivatives_are_those_of_differences(
    wang: Quadruped, small_problem: Any, variant: str, kind: str, com: str
) -> None:
    """Jacobian, its transpose, and the banded matrix, column by column."""
    problem = small_problem(wang, variant, 2, swing_knots=5, stance_knots=2, com=com)
    problem = replace(problem, time_unit=0.3)
    problem = problem if kind == "fast" else with_accelerations(problem, kind == "moving")
    rng = np.random.default_rng(0)
    x = problem.first_guess()
    x = x + 1e-3 * rng.normal(size=len(x)) * (problem.linear_cost == 0)
    here = problem.linearise(x)
    assert here.values == pytest.approx(problem.values(x), abs=1e-14)
    n, m, step = len(x), len(here.values), 1e-6
    jacobian = np.array([
        (problem.values(x + step * e) - problem.values(x - step * e)) / (2 * step)
        for e in np.eye(n)
    ]).T  # fmt: skip
    exact = np.array([here.jacobian_times(e) for e in np.eye(n)]).T
    np.testing.assert_allclose(exact, jacobian, rtol=0, atol=1e-6)
    weights = rng.uniform(0, 1, m)
    assert here.jacobian_transpose_times(weights) == pytest.approx(jacobian.T @ weights, abs=1e-5)
    bands = here.newton_matrix(weights, np.zeros(m))
    expected = exact.T @ (weights[:, None] * exact)
    np.testing.assert_allclose(dense(bands), expected, rtol=1e-12, atol=1e-9)
    curved = dense(here.newton_matrix(np.zeros(m), weights))
    for i in rng.choice(n, 12, replace=False):
        ends = [
            problem.linearise(x + s * step * np.eye(n)[i]).jacobian_transpose_times(weights)
            for s in (1, -1)
        ]
        assert -curved[i] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-5)


@pytest.mark.parametrize("com", ["body", "model"])
@pytest.mark.parametrize("kind", ["fast", "smooth"])
def test_carried_multipliers_weigh_the_same_rows(
    wang: Quadruped, small_problem: Any, kind: str, com: str
) -> None:
    """New rows get none, so weighted gradients of all rows stay; and what is known comes back."""
    plain = small_problem(wang, "posture", 2, swing_knots=5, stance_knots=2, com=com)
    plain = plain if kind == "fast" else with_accelerations(plain)
    rng = np.random.default_rng(5)
    knots = np.array([1, 1, 4, 9])
    added = Rows(knots, rng.normal(size=(4, 9)), np.zeros((4, 9)), np.ones(4))
    more = replace(plain, rows=Rows.joined([plain.rows, added]))
    x = plain.first_guess()
    before, after = plain.linearise(x), more.linearise(x)
    known = rng.uniform(0.1, 1.0, len(before.values))
    carried = carried_multipliers(plain, more, known)
    assert (carried == 0.0).sum() == len(knots)
    np.testing.assert_allclose(
        after.jacobian_transpose_times(carried), before.jacobian_transpose_times(known), atol=1e-12
    )
    np.testing.assert_array_equal(carried_multipliers(more, plain, carried), known)


def dense(bands: Array) -> Array:
    """The symmetric matrix of a lower band."""
    size = bands.shape[1]
    out = np.zeros((size, size))
    for d, row in enumerate(bands):
        out += np.diag(row[: size - d], -d)
        out += np.diag(row[: size - d], d) if d else 0.0
    return out


@pytest.mark.parametrize("variant", ["swing", "height"])
def test_the_optimum_is_ipopt_s(wang: Quadruped, small_problem: Any, variant: str) -> None:
    """An independent model in CasADi, from which IPOPT can gain nothing more."""
    problem = small_problem(wang, variant)
    ours = minimise(problem, problem.first_guess(), tolerance=1e-5)
    assert ours.solved
    assert ours.violation() <= 1e-6
    # The small even term is part of both objectives.
    objective = problem.linear_cost @ ours.x + (problem.quadratic_cost * ours.x**2).sum() / 2.0
    assert objective == pytest.approx(ipopt_optimum(wang, problem, ours.x), rel=1e-4)


def ipopt_optimum(robot: Quadruped, problem: RouteProblem, start: Array) -> float:
    """The optimum next to ``start``, from :meth:`Leg.inverse_columns` on symbols."""
    placed, at, size = problem.numbering
    x = ca.SX.sym("x", size)
    angles, rows = [], []
    for k in range(problem.knots):
        pose = [float(v) for v in problem.poses[k]]
        for c, where in zip(problem.free_columns, placed[k], strict=True):
            if where >= 0:
                pose[c] = x[int(where)]
        here = []
        for i, name in enumerate(LEGS):
            foot = pose[6:] if problem.swing[k, i] else problem.feet[k, i].tolist()
            local = [foot[a] - pose[a] + float(robot.centre[a]) for a in range(3)]
            here += list(robot.legs[name].inverse_columns(*local))
        angles.append(ca.vertcat(*here))
        for r in np.flatnonzero(problem.rows.knot == k):
            a, b = problem.rows.linear[r], problem.rows.square[r]
            rows.append(
                problem.rows.offset[r]
                + sum((a[c] + b[c] / 2 * pose[c]) * pose[c] for c in range(9) if a[c] or b[c])
            )
    for k in range(problem.knots - 1):
        room = ca.DM(problem.velocity_limits) * x[int(at[k])]
        rows += [room - (angles[k + 1] - angles[k]), room + (angles[k + 1] - angles[k])]
    time = x[at.tolist()]
    cost = ca.sum1(time) + problem.quadratic_weight * ca.sumsqr(time) / 2
    options = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes",
               "ipopt.tol": 1e-7, "ipopt.mu_init": 1e-6}  # fmt: skip
    solver = ca.nlpsol("s", "ipopt", {"x": x, "f": cost, "g": ca.vertcat(*rows)}, options)
    found = solver(x0=start, lbg=0.0, ubg=np.inf)
    assert solver.stats()["success"]
    return float(found["f"])


def test_the_iteration_limit_is_reported(wang: Quadruped, small_problem: Any) -> None:
    problem = small_problem(wang, "swing")
    solution = minimise(problem, problem.first_guess(), iteration_limit=3)
    assert solution.status is Status.ITERATION_LIMIT
    assert solution.iterations == 3


def test_residuals_are_those_of_the_answer(wang: Quadruped, small_problem: Any) -> None:
    """Worked out here by hand from the solution's unknowns and multipliers."""
    problem = small_problem(wang, "swing")
    solution = minimise(problem, problem.first_guess())
    values = problem.values(solution.x)
    slope = (
        problem.linear_cost
        + problem.quadratic_cost * solution.x
        - problem.linearise(solution.x).jacobian_transpose_times(solution.multipliers)
    )
    assert solution.stationarity() == pytest.approx(np.abs(slope).max(), abs=1e-15)
    assert solution.complementarity() == pytest.approx(
        (solution.multipliers * np.abs(values)).sum()
    )
    assert solution.stationarity() < 1e-3
    assert (solution.multipliers > 0).all()
    assert solution.complementarity() < 2e-3 * (problem.linear_cost @ solution.x)
