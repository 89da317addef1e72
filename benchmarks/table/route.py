"""The time-optimal route: whole plans by row, growth with the steps, a horizon, IPOPT and fatrop.

The rivals solve the very problem that ours solves, from the same first guess, written in CasADi
with exact derivatives. Building their functions is not counted.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks import walks
from benchmarks.measuring import Result, Timing, timed
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.interior_point.solver import minimise
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.planner import plan_route
from gaitopt.planners.time_optimal.walk import prepare_route

MOST_GROWTH = 1.2
"""Largest power of the steps that still counts as linear: iterations differ from walk to walk."""
GOAL, LIMIT = 1000.0, 3000.0
_STATIC = ("route", "overlap", "swing", "height", "posture")


def measure_route(quick: bool) -> list[Result]:
    """Whole plans of every row over 64 steps, then growth, horizon and rivals for one row."""
    rounds, steps = (1, 8) if quick else (5, walks.MAIN_STEPS)
    results = []
    for row in _STATIC[2:3] if quick else _STATIC:
        timing = _plan_time(steps, row, rounds)
        what = f"plan_route, row {row}, {steps} steps"
        # Goal and limit are those of the main job.
        limits = (GOAL, LIMIT) if row == "swing" and not quick else (None, None)
        results.append(timing.result(f"route-{row}", what, "ms", goal=limits[0], limit=limits[1]))
    rest = [*_horizon(steps, rounds), *_rivals(4 if quick else 16, rounds)]
    return [*results, *_growth(quick), *rest]


def _plan_time(steps: int, row: str, rounds: int, **options: Any) -> Timing:
    robot, terrain = walks.robot(), walks.terrain(steps)
    return timed(
        lambda: plan_route(robot, terrain, free=row, **options, timing="velocity"), rounds, 0
    )


def _growth(quick: bool) -> list[Result]:
    """Times of longer and longer routes, and the power of the steps with which they grow."""
    sizes = [4, 8] if quick else [16, 32, 64, 128, 256, 512]
    timings = {n: _plan_time(n, "swing", 1) for n in sizes}
    times = [timings[n].median for n in sizes]
    power = float(np.polyfit(np.log(sizes), np.log(times), 1)[0])
    results = [t.result(f"route-{n}", f"plan_route, swing, {n} steps", "ms")
               for n, t in timings.items()]  # fmt: skip
    what = f"p in time ~ steps^p, {sizes[0]} to {sizes[-1]} steps"
    return [*results, Result("route-power", what, "", (power,), limit=MOST_GROWTH)]


def _horizon(steps: int, rounds: int) -> list[Result]:
    """Planning in windows of eight steps: time a step, and the time that the walk loses."""
    robot, terrain = walks.robot(), walks.terrain(steps)
    timing = _plan_time(steps, "swing", rounds, horizon=8)
    whole = plan_route(robot, terrain, free="swing", timing="velocity").duration
    near = plan_route(robot, terrain, free="swing", horizon=8, timing="velocity").duration
    each = tuple(1e3 * t / steps for t in timing.wall)
    return [
        Result("route-horizon", "horizon of 8 steps, swing, each step", "ms", each),
        Result("route-horizon-loss", "walking time lost to the horizon of 8 steps", "%",
               (100.0 * max(near / whole - 1.0, 0.0),), limit=2.0),
    ]  # fmt: skip


def _rivals(steps: int, rounds: int) -> list[Result]:
    """The same problem by our solver, IPOPT and fatrop."""
    route = prepare_route(
        walks.robot(),
        walks.terrain(steps),
        RouteSettings(free=VARIANTS["swing"], timing="velocity"),
    )
    problem = build_route(route.window(0, steps))[1]
    start = problem.first_guess()
    ours = timed(lambda: minimise(problem, start, tolerance=1e-4), rounds, 0)
    found = minimise(problem, start, tolerance=1e-4)
    best = problem.linear_cost @ found.x
    results = [ours.result("route-solve", f"our solver, swing, {steps} steps", "ms")]
    for name in ("ipopt", "fatrop"):
        solve, objective = rival(name, problem)
        timing = timed(solve, rounds, 0)
        results += [
            timing.result(f"route-{name}", f"{name}, the same problem", "ms",
                          ratio=timing.median / ours.median),
            Result(f"route-{name}-time", f"walking time found by {name} over ours", "",
                   (objective() / best,)),
        ]  # fmt: skip
    return results


def rival(
    name: str, problem: RouteProblem, begin: tuple[FloatArray, FloatArray] | None = None
) -> tuple[Any, Any]:
    """A solve to be timed, and what gives the sum of times that it found.

    Stage by stage as fatrop needs it: the state is a pose, the controls are its change and the
    time; each stage's inequalities see its own state and controls.

    Args:
        name: ``"ipopt"`` or ``"fatrop"``.
        problem: what is solved.
        begin: poses ``(K, 9)`` and times ``(K - 1,)`` [s] to begin with; by default the first guess
            of the problem.
    """
    import casadi as ca

    model = _Stages(problem, begin)
    options: dict[str, Any] = {"print_time": False, "expand": True}
    if name == "fatrop":
        options |= {
            "structure_detection": "auto",
            "equality": model.equality,
            "fatrop.print_level": 0,
        }
    else:
        options |= {"ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-5}
    solver = ca.nlpsol("route", name, model.nlp, options)
    found: dict[str, Any] = {}

    def solve() -> None:
        found.update(solver(x0=model.start, lbg=0.0, ubg=model.upper))

    return solve, lambda: float(np.asarray(found["x"]).ravel()[model.times].sum())


class _Stages:
    """The problem as CasADi sees it."""

    def __init__(
        self, problem: RouteProblem, begin: tuple[FloatArray, FloatArray] | None = None
    ) -> None:
        import casadi as ca

        poses, times = problem.unpack(problem.first_guess()) if begin is None else begin
        free = problem.unknown >= 0
        variables: list[Any] = []
        rows: list[Any] = []
        start: list[float] = []
        self.equality: list[bool] = []
        self.times: list[int] = []
        cost: Any = 0
        state = None
        for k in range(problem.knots):
            if state is None:
                state, names = _pose(problem, poses, free, k)
                variables += names
                start += poses[k, free[k]].tolist()
            if k == problem.knots - 1:
                self._single(problem, k, state, rows)
                break
            change = ca.SX.sym(f"u{k}", int(free[k + 1].sum()))
            time = ca.SX.sym(f"h{k}")
            variables += [change, time]
            start += [*(poses[k + 1] - poses[k])[free[k + 1]].tolist(), float(times[k])]
            self.times.append(len(start) - 1)
            after = [*poses[k + 1]]
            for i, c in enumerate(np.flatnonzero(free[k + 1])):
                after[c] = (state[c] if free[k, c] else float(poses[k, c])) + change[i]
            following, names = _pose(problem, poses, free, k + 1)
            variables += names
            start += poses[k + 1, free[k + 1]].tolist()
            for c in np.flatnonzero(free[k + 1]):
                rows.append(following[c] - after[c])
                self.equality.append(True)
            turn = _angles(problem, k + 1, after) - _angles(problem, k, state)
            room = ca.DM(problem.velocity_limits) * time
            rows += [room - turn, room + turn]
            self.equality += [False] * 24
            self._single(problem, k, state, rows)
            cost += time + problem.quadratic_weight * time**2 / 2
            state = following
        self.start = np.array(start)
        self.upper = np.where(self.equality, 0.0, np.inf)
        self.nlp = {"x": ca.vertcat(*variables), "f": cost, "g": ca.vertcat(*rows)}

    def _single(self, problem: RouteProblem, k: int, state: list[Any], rows: list[Any]) -> None:
        for r in np.flatnonzero(problem.rows.knot == k):
            a, b = problem.rows.linear[r], problem.rows.square[r]
            used = [c for c in range(9) if a[c] or b[c]]
            total = problem.rows.offset[r] + sum(
                (a[c] + b[c] / 2 * state[c]) * state[c] for c in used
            )
            if not isinstance(total, float):
                rows.append(total)
                self.equality.append(False)


def _pose(problem: RouteProblem, poses: Any, free: Any, k: int) -> tuple[list[Any], list[Any]]:
    import casadi as ca

    count = int(free[k].sum())
    symbols = ca.SX.sym(f"y{k}", count)
    pose: list[Any] = [float(v) for v in poses[k]]
    for i, c in enumerate(np.flatnonzero(free[k])):
        pose[c] = symbols[i]
    return pose, [symbols] if count else []


def _angles(problem: RouteProblem, k: int, pose: list[Any]) -> Any:
    import casadi as ca

    robot = walks.robot()
    turn = _rotation(pose[3:6])
    out = []
    for i, name in enumerate(LEGS):
        foot = pose[6:] if problem.swing[k, i] else problem.feet[k, i].tolist()
        away = [foot[a] - pose[a] for a in range(3)]
        local = [
            sum(turn[b][a] * away[b] for b in range(3)) + float(robot.centre[a]) for a in range(3)
        ]
        out += list(robot.legs[name].inverse_columns(*local))
    return ca.vertcat(*out)


def _rotation(angles: list[Any]) -> list[list[Any]]:
    """Rows of the rotation by roll, pitch and yaw."""
    import casadi as ca

    (cr, cp, cy), (sr, sp, sy) = ([f(angle) for angle in angles] for f in (ca.cos, ca.sin))
    return [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
