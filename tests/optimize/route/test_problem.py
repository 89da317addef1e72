"""The banded interior-point method, judged by dense algebra and by IPOPT."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import LEGS, Quadruped
from gaitopt.interior_point.solver import solve_route
from gaitopt.optimize.route.dynamic_layout import Entry, ZmpRows
from gaitopt.optimize.route.dynamic_problem import RouteDynamics
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.settings.time_optimal import ROWS, RouteSettings
from gaitopt.planners.time_optimal.build import problem_of
from gaitopt.planners.time_optimal.walk import prepared

Array = NDArray[np.float64]


def small_problem(robot: Quadruped, row: str, steps: int = 4, **settings: Any) -> RouteProblem:
    """The first ``steps`` of a random terrain."""
    chosen = RouteSettings(free=ROWS[row], **settings)
    route = prepared(robot, gaitopt.s_columns(2, columns=3), chosen, None)
    # With all position limits, not only those that are near.
    return replace(problem_of(route, 0, steps), bounded=np.ones((2, 12), dtype=np.bool_))


def with_accelerations(problem: RouteProblem, moving: bool = False) -> RouteDynamics:
    """The same problem with random limits and rows for the ZMP; it may begin in motion."""
    rng = np.random.default_rng(3)
    knots = problem.knots
    shared = {f.name: getattr(problem, f.name) for f in fields(RouteProblem)}
    return RouteDynamics(
        **shared, accelerations=rng.uniform(3, 4, (2, knots, 12)),
        hurry=rng.uniform(0.2, 0.3, (2, knots - 1, 12)),
        zmp=ZmpRows(np.sort(rng.integers(1, knots, 20)), rng.normal(size=(20, 2)),
                    0.01 * rng.normal(size=20), 0.02 * rng.normal(size=20), np.zeros(20),
                    np.full(20, 9.81)),
        entry=Entry(rng.normal(size=15), 0.2) if moving else None,
    )  # fmt: skip


@pytest.mark.parametrize("com", ["body", "model"])
@pytest.mark.parametrize("unit", [1.0, 0.3])
@pytest.mark.parametrize("kind", ["fast", "smooth", "moving"])
@pytest.mark.parametrize("row", ["route", "overlap", "swing", "height", "posture"])
def test_derivatives_are_those_of_differences(
    wang: Quadruped, row: str, kind: str, unit: float, com: str
) -> None:
    """Jacobian, its transpose, and the banded matrix, column by column."""
    problem = small_problem(wang, row, 2, swing_knots=5, stance_knots=2, com=com)
    problem = replace(problem, unit=unit)
    problem = problem if kind == "fast" else with_accelerations(problem, kind == "moving")
    rng = np.random.default_rng(0)
    x = problem.start()
    x = x + 1e-3 * rng.normal(size=len(x)) * (problem.cost == 0)
    here = problem.linearised(x)
    assert here.values == pytest.approx(problem.values(x), abs=1e-14)
    n, m, step = len(x), len(here.values), 1e-6
    jacobian = np.array([
        (problem.values(x + step * e) - problem.values(x - step * e)) / (2 * step)
        for e in np.eye(n)
    ]).T  # fmt: skip
    assert pytest.approx(jacobian, abs=1e-6) == np.array([here.push(e) for e in np.eye(n)]).T
    weights = rng.uniform(0, 1, m)
    assert here.pull(weights) == pytest.approx(jacobian.T @ weights, abs=1e-5)
    bands = here.normal(weights, np.zeros(m))
    exact = np.array([here.push(e) for e in np.eye(n)]).T
    assert dense(bands) == pytest.approx(exact.T @ (weights[:, None] * exact), abs=1e-9)
    bowed = dense(here.normal(np.zeros(m), weights))
    for i in rng.choice(n, 12, replace=False):
        ends = [problem.linearised(x + s * step * np.eye(n)[i]).pull(weights) for s in (1, -1)]
        assert -bowed[i] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-5)


def dense(bands: Array) -> Array:
    """The symmetric matrix of a lower band."""
    size = bands.shape[1]
    out = np.zeros((size, size))
    for d, row in enumerate(bands):
        out += np.diag(row[: size - d], -d)
        out += np.diag(row[: size - d], d) if d else 0.0
    return out


@pytest.mark.parametrize("row", ["swing", "height"])
def test_the_optimum_is_ipopt_s(wang: Quadruped, row: str) -> None:
    """An independent model in CasADi, from which IPOPT can gain nothing more."""
    problem = small_problem(wang, row)
    ours = solve_route(problem, problem.start(), tolerance=1e-5)
    assert ours.status == "solved"
    assert ours.primal <= 1e-6
    # The small even term is part of both objectives.
    objective = problem.cost @ ours.x + (problem.even * ours.x**2).sum() / 2.0
    assert objective == pytest.approx(ipopt_optimum(wang, problem, ours.x), rel=1e-4)


def ipopt_optimum(robot: Quadruped, problem: RouteProblem, start: Array) -> float:
    """The optimum next to ``start``, from :meth:`Leg.inverse_columns` on symbols."""
    placed, at, size = problem.numbering
    x = ca.SX.sym("x", size)
    angles, rows = [], []
    for k in range(problem.knots):
        pose = [float(v) for v in problem.poses[k]]
        for c, where in zip(problem.columns, placed[k], strict=True):
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
        room = ca.DM(problem.rates) * x[int(at[k])]
        rows += [room - (angles[k + 1] - angles[k]), room + (angles[k + 1] - angles[k])]
    time = x[at.tolist()]
    cost = ca.sum1(time) + problem.evenness * ca.sumsqr(time) / 2
    options = {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes",
               "ipopt.tol": 1e-7, "ipopt.mu_init": 1e-6}  # fmt: skip
    solver = ca.nlpsol("s", "ipopt", {"x": x, "f": cost, "g": ca.vertcat(*rows)}, options)
    found = solver(x0=start, lbg=0.0, ubg=np.inf)
    assert solver.stats()["success"]
    return float(found["f"])


def test_a_stuck_solver_says_so(wang: Quadruped) -> None:
    problem = small_problem(wang, "swing")
    answer = solve_route(problem, problem.start(), iterations=3)
    assert answer.status == "most iterations"
    assert len(answer.history) == 3


def test_residuals_are_those_of_the_answer(wang: Quadruped) -> None:
    """Worked out here by hand from the answer's unknowns and multipliers."""
    problem = small_problem(wang, "swing")
    answer = solve_route(problem, problem.start())
    values = problem.values(answer.x)
    slope = problem.cost + problem.even * answer.x - problem.linearised(answer.x).pull(answer.duals)
    assert answer.stationarity == pytest.approx(np.abs(slope).max(), abs=1e-15)
    assert answer.complementarity == pytest.approx((answer.duals * np.abs(values)).sum())
    assert answer.stationarity < 1e-3
    assert (answer.duals > 0).all()
    assert answer.complementarity < 2e-3 * (problem.cost @ answer.x)
