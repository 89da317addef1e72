"""How the posture problem is solved, and the cycle of six states.

IPOPT [Waechter2006] with exact second derivatives finds the pose. Its residuals are then computed
from the pose alone: joints by the legs' closed form, the margin by the support polygon, and the
distance of feet from the planes of legs without roll joint.

Source: [Shao2011], Section IV, eq. (11) and Fig. 5.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.gait.crawl import SHAO_SEQUENCE
from gaitopt.inputs import as_text, check_kind
from gaitopt.optimize.posture.formulation import (
    PLANES,
    PostureFormulation,
    posture_formulation,
)
from gaitopt.optimize.posture.problem import (
    FREEDOMS,
    LEVEL,
    BodyPose,
    PostureProblem,
    angle_bounds,
    build_posture_problem,
    feet_by_leg,
)
from gaitopt.optimize.posture.solution import (
    PostureResiduals,
    PostureSolution,
    PostureStatus,
)
from gaitopt.robots.leg_names import as_leg
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.margins import static_stability_margin
from gaitopt.stability.support import support_half_planes

FEASIBILITY = 1e-7
"""Largest violation of a constraint in an accepted solution [m, rad]: a thousand times IPOPT's
tolerance, and far below the accuracy of a real robot."""
OPTIMALITY = 1e-6
"""Largest entry of the Lagrangian's gradient in an accepted solution, a thousand times IPOPT's
tolerance."""
MARGIN_RESERVE = 1e-8
"""By how much more margin IPOPT is asked for, so that rounding does not break it [m]."""
_LARGEST_MARGIN = 100.0
"""Bound of the margin where the largest one is asked for [m]: no robot stands so wide."""
_ITERATIONS = 100
"""Most iterations of IPOPT."""


def solve_posture(problem: PostureProblem) -> PostureSolution:
    """Solve a posture problem by IPOPT, and judge the solution by its residuals.

    Without a solution the pose violates a constraint, and its residuals show which. IPOPT finds a
    local minimum near the pose before.
    """
    check_kind("problem", problem, PostureProblem)
    form = problem.formulation
    call = _ipopt(problem.robot, form.reaching)
    low, high = _bounds(problem)
    start = _start(problem, low, high)
    parameters = _parameters(problem)
    least, most = _row_bounds(problem)
    found = call(x0=start, p=parameters, lbx=low, ubx=high, lbg=least, ubg=most)
    x, rows, bounds = (np.asarray(found[k]).ravel() for k in ("x", "lam_g", "lam_x"))
    x = np.clip(x, low, high)
    slope = np.asarray(form.gradient(x, parameters, rows)[0]).ravel() + bounds
    said = call.stats()
    pose = BodyPose(x[:3], x[3:6]) if np.isfinite(x[:6]).all() else problem.start
    residuals = _judged(
        problem, pose, float(np.abs(slope[high > low]).max(initial=0.0)),
        str(said["return_status"]).replace("_", " "), int(said["iter_count"]),
    )  # fmt: skip
    good = residuals.violation <= FEASIBILITY and residuals.stationarity <= OPTIMALITY
    return PostureSolution(
        problem, pose, PostureStatus.SOLVED if good else PostureStatus.INFEASIBLE, residuals
    )


def posture_cycle(
    robot: Quadruped,
    feet: Mapping[str, ArrayLike],
    stride: float,
    start: BodyPose,
    *,
    sequence: Sequence[str] = SHAO_SEQUENCE,
    recover: bool = True,
    **asked: Any,
) -> tuple[PostureSolution, ...]:
    """The six states of Fig. 5: start, the four swing states, and recovery.

    Each swing state is the nearest posture from which its leg may lift off and reach its next
    foothold, ``stride`` ahead along the body's heading; the recovery state has the body over its
    feet as the start state has.

    Args:
        robot: the robot.
        feet: where each foot is at the start ``(3,)`` [m].
        stride: length of each leg's step [m].
        start: pose of the start state.
        sequence: order of the legs.
        recover: whether the recovery state is computed, too.
        asked: keyword arguments of :func:`build_posture_problem`: margin, reach_fraction,
            plane_tolerance, free, weights.

    Raises:
        InputError: a value is out of range, or the sequence does not name every leg once.
    """
    sequence, feet = [as_leg(leg) for leg in sequence], feet_by_leg(feet)
    if sorted(map(str, sequence)) != sorted(LEGS):
        raise InputError(
            f"sequence must name the four legs once each, got {as_text(tuple(sequence))}"
        )
    way = float(stride) * start.axes[:, 0]
    places = {leg: frozen(feet[leg]) for leg in LEGS}
    first = solve_posture(build_posture_problem(robot, places, start, **asked))
    states = [first]
    for leg in sequence:
        target = places[leg] + way
        problem = build_posture_problem(
            robot, places, states[-1].pose, swing=leg, places=[target], **asked
        )
        states.append(solve_posture(problem))
        places = {**places, leg: frozen(target)}
    if recover:
        home = BodyPose(first.pose.centre + way, first.pose.rpy)
        states.append(solve_posture(build_posture_problem(robot, places, home, **asked)))
    return tuple(states)


def leg_gaps(
    robot: Quadruped, pose: BodyPose, places: Sequence[tuple[str, ArrayLike]]
) -> FloatArray:
    """How far places are beside the planes of their legs, to the left ``(n,)`` [m].

    Zero for legs that have a roll joint.
    """
    out = np.zeros(len(places))
    for i, (name, place) in enumerate(places):
        leg = robot.legs[name]
        if not leg.has_roll:
            local = pose.in_body(robot, place)
            out[i] = (local - leg.hip) @ leg.axes[:, 1] - leg.lateral
    return out


@lru_cache(maxsize=32)
def _ipopt(robot: Quadruped, reaching: tuple[str, ...]) -> Any:
    """The solver for one robot and set of legs, built once."""
    import casadi as ca

    options: dict[str, Any] = {
        "print_level": 0, "sb": "yes", "tol": 1e-9, "constr_viol_tol": 1e-10,
        "max_iter": _ITERATIONS, "bound_relax_factor": 0.0, "honor_original_bounds": "yes",
    }  # fmt: skip
    more: dict[str, Any] = {"print_time": False, "error_on_fail": False, "ipopt": options}
    form: PostureFormulation = posture_formulation(robot, reaching)
    return ca.nlpsol("posture", "ipopt", form.nlp, more)


def _bounds(problem: PostureProblem) -> tuple[FloatArray, FloatArray]:
    """Bounds of all unknowns: the pose, the margin, and joint angles."""
    before = problem.start.numbers
    free = np.array([name in problem.free for name in FREEDOMS])
    if problem.has_planar_leg and problem.plane_tolerance == 0.0:
        # Roll and yaw are fixed; x and y stay free, coupled by the equation of the mean plane.
        free[[3, 5]] = False
        if abs(before[3]) > LEVEL:
            # With a roll angle, pitch turns the planes of the legs, too.
            free[4] = False
    low = [np.where(free, -np.inf, before)]
    high = [np.where(free, np.inf, before)]
    asked = problem.margin + MARGIN_RESERVE
    most = _LARGEST_MARGIN if problem.objective == "margin" else asked
    low.append(np.array([-_LARGEST_MARGIN if problem.objective == "margin" else asked]))
    high.append(np.array([most]))
    for leg, _ in problem.reaching:
        least, greatest = angle_bounds(problem.robot, leg, problem.reach_fraction)
        low.append(least)
        high.append(greatest)
    return np.concatenate(low), np.concatenate(high)


def _row_bounds(problem: PostureProblem) -> tuple[FloatArray, FloatArray]:
    """Bounds of all constraints."""
    # Without a tolerance roll and yaw are fixed, and all planes ask for the same shift sideways.
    # Their equations are equal then, so the mean stands for all.
    each = problem.plane_tolerance if problem.plane_tolerance > 0.0 else np.inf
    mean = 0.0 if problem.has_planar_leg and problem.plane_tolerance == 0.0 else np.inf
    most = {"closed": 0.0, "plane": each, "mean plane": mean, "margin": np.inf}
    least = {"closed": 0.0, "plane": -each, "mean plane": -mean, "margin": 0.0}
    rows = problem.formulation.rows
    return np.array([least[r] for r in rows]), np.array([most[r] for r in rows])


def _start(problem: PostureProblem, low: FloatArray, high: FloatArray) -> FloatArray:
    """Unknowns from which IPOPT starts: the pose before, with joint angles within their bounds."""
    robot = problem.robot
    angles = [
        robot.legs[leg].inverse(problem.start.in_body(robot, place))
        for leg, place in problem.reaching
    ]
    x = np.concatenate([problem.start.numbers, [problem.margin], *angles])
    return np.asarray(np.clip(x, low, high))


def _parameters(problem: PostureProblem) -> FloatArray:
    standing = problem.feet[[LEGS.index(leg) for leg in problem.support]]
    sides = support_half_planes(standing)
    planes = np.tile([0.0, 0.0, -1.0], (PLANES, 1))
    planes[: len(sides.offsets)] = np.column_stack([sides.normals, sides.offsets])
    return np.concatenate([
        problem.start.numbers, problem.weights, [problem.height_weight], planes.ravel(),
        *[place for _, place in problem.reaching], [float(problem.objective == "margin")],
    ])  # fmt: skip


def _judged(
    problem: PostureProblem, pose: BodyPose, stationarity: float, message: str, iterations: int
) -> PostureResiduals:
    """The residuals of a pose."""
    robot = problem.robot
    standing = problem.feet[[LEGS.index(leg) for leg in problem.support]]
    margin = float(static_stability_margin(standing, pose.centre))
    short, beyond = 0.0, 0.0
    for name, place in problem.reaching:
        leg, local = robot.legs[name], pose.in_body(robot, place)
        length = float(leg.length(local))
        short = max(short, length - problem.reach_fraction * leg.reach, leg.least_reach - length)
        angles = leg.inverse(local)
        low, high = leg.position_limits
        beyond = max(beyond, float(np.maximum(low - angles, angles - high).max()))
    gaps = np.abs(leg_gaps(robot, pose, problem.reaching)).max()
    asked = problem.margin if problem.objective == "motion" else -np.inf
    return PostureResiduals(
        margin=max(asked - margin, 0.0),
        reach=max(short, 0.0),
        plane=max(float(gaps) - problem.plane_tolerance, 0.0),
        joints=max(beyond, 0.0),
        stationarity=stationarity,
        message=message,
        iterations=iterations,
    )
