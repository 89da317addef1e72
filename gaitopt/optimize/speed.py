"""How fast a body or a foot may move when every joint's velocity is limited.

Three ways lead to the same number, [Wang2020], Section IV:

* the linear program in the joint velocities, as stated (:func:`build_speed_lp`);
* the paper's algorithm: guess which joint is at its limit, and get the others from the closed-form
  ratios (:func:`paper_foot_speed`);
* arc length (:func:`arc_speed`, :func:`knot_times`), which the planner uses: in the norm
  ``max_j |dq_j| / limit_j`` the length of a path in joint space *is* its shortest duration.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError, SolverError
from gaitopt.inputs import check_array, check_kind
from gaitopt.robots.leg import Leg

RESIDUAL = 1e-9
"""Largest residual of an accepted solution, all unknowns being of order one."""
ROUNDING = 1e-12
"""Share by which a joint velocity may exceed its limit in the paper's algorithm, for rounding."""


class SpeedLp(NamedTuple):
    """Maximise ``v`` subject to ``J w = v d`` and ``-limit <= w <= limit``.

    Attributes:
        jacobian: foot Jacobian ``(3, nj)``, from Pinocchio for instance.
        direction: unit direction of motion ``(3,)``, in the Jacobian's frame.
        limits: joint velocity limits ``(nj,)`` [rad/s].
    """

    jacobian: FloatArray
    direction: FloatArray
    limits: FloatArray


def build_speed_lp(jacobian: FloatArray, direction: FloatArray, limits: FloatArray) -> SpeedLp:
    """The joint-velocity LP of Section IV for one leg and direction.

    Args:
        jacobian: ``(3, nj)`` [m/rad].
        direction: ``(3,)``, of any length.
        limits: ``(nj,)`` [rad/s].

    Raises:
        InputError: shapes do not fit, a number is not finite, a limit is not positive, or the
            direction is zero.
    """
    j, d = check_array("jacobian", jacobian), check_array("direction", direction)
    w = check_array("limits", limits)
    if j.ndim != 2 or d.shape != j.shape[:1] or w.shape != j.shape[1:]:
        raise InputError(
            f"shapes do not fit: jacobian {j.shape}, direction {d.shape}, limits {w.shape}"
        )
    length = float(np.linalg.norm(d))
    if not (np.isfinite(j).all() and np.isfinite(length) and length > 0 and (w > 0).all()):
        raise InputError("jacobian must be finite, direction not zero, and limits positive")
    return SpeedLp(j, d / length, w)


def solve_speed_lp(problem: SpeedLp) -> float:
    """Largest speed [m/s], by HiGHS [Huangfu2018]; the constraints are checked at its solution.

    Raises:
        SolverError: HiGHS found no optimum with a residual below :data:`RESIDUAL`.
    """
    check_kind("problem", problem, SpeedLp)
    rows, joints = problem.jacobian.shape
    # In units of its limit each joint velocity is within +-1; the speed is scaled alike.
    scaled = problem.jacobian * problem.limits
    scale = float(np.abs(scaled).max()) or 1.0
    solver = _conic(rows, joints)
    matrix = np.column_stack([scaled / scale, -problem.direction])
    cost = np.zeros(joints + 1)
    cost[-1] = -1.0
    bound = np.append(np.ones(joints), np.inf)
    found = solver(g=cost, a=matrix, lba=np.zeros(rows), uba=np.zeros(rows),
                   lbx=-bound, ubx=bound)  # fmt: skip
    x = np.asarray(found["x"]).ravel()
    residual = max(float(np.abs(matrix @ x).max()), float(np.abs(x[:-1]).max()) - 1.0)
    if not residual <= RESIDUAL:
        raise SolverError(f"the speed LP was not solved: residual {residual:.2g}")
    return float(x[-1]) * scale


@lru_cache(maxsize=8)
def _conic(rows: int, joints: int) -> Any:
    import casadi as ca

    shapes = {"a": ca.Sparsity.dense(rows, joints + 1), "h": ca.Sparsity(joints + 1, joints + 1)}
    return ca.conic("speed", "highs", shapes, {"highs": {"output_flag": False}})


def arc_speed(rates: FloatArray, limits: FloatArray) -> FloatArray:
    """Largest speed along a path whose joint angles change by ``rates`` per metre.

    Args:
        rates: ``dq/ds (..., nj)`` [rad/m].
        limits: ``(nj,)`` [rad/s].

    Returns:
        ``1 / max_j |dq_j/ds| / limit_j`` ``(...)`` [m/s], the optimum of the LP.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 / np.max(np.abs(rates) / limits, axis=-1))


def foot_rates(leg: Leg, q: FloatArray, direction: FloatArray) -> FloatArray:
    """``dq/ds`` of one leg whose foot moves along a unit ``direction``: ``(..., 3)`` [rad/m].

    Args:
        leg: a leg with three joints.
        q: joint angles ``(..., 3)`` [rad].
        direction: ``(..., 3)``, in the body frame.
    """
    unit = direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    return np.asarray(np.linalg.solve(leg.jacobian(q), unit[..., None])[..., 0])


def body_speed(speeds: FloatArray) -> FloatArray:
    """Largest body speed: the smallest of the supporting legs' ``speeds (..., legs)`` [m/s].

    Source: [Wang2020], Section IV.B.
    """
    return np.asarray(np.min(speeds, axis=-1))


def knot_times(
    joints: FloatArray, limits: FloatArray, lengths: FloatArray | None, speed: float | None
) -> tuple[FloatArray, np.ndarray]:
    """Shortest times between knots of a path that is straight in joint space between them.

    Args:
        joints: ``(..., K, nj)`` [rad].
        limits: ``(nj,)`` [rad/s].
        lengths: lengths of the body's or foot's path between knots ``(..., K - 1)`` [m]; needed
            with a speed.
        speed: a speed not to be exceeded along ``lengths`` [m/s]; ``None`` for none.

    Returns:
        Times ``(..., K - 1)`` [s], and which joint sets each, -1 where ``speed`` does.
    """
    needed = np.abs(np.diff(joints, axis=-2)) / limits
    slowest = needed.argmax(axis=-1)
    times = np.take_along_axis(needed, slowest[..., None], axis=-1)[..., 0]
    if speed is None or lengths is None:
        return times, slowest
    given = lengths / speed
    return np.maximum(times, given), np.where(given >= times, -1, slowest)


def paper_foot_speed(leg: Leg, q: FloatArray, direction: FloatArray) -> float:
    """Largest foot speed by the paper's algorithm, Figs. 9 and 10.

    Each joint in turn is taken to be the one at its limit; the closed-form ratios give the other
    two, and the first guess that leaves both within their limits is right. Vertical motion uses
    eqs. (13), (14), motion at constant height eqs. (15), (16), with the signs and the misprint of
    the paper corrected (``docs/papers.md``) and the slope k written as a direction, so that motion
    along y is no exception.

    Args:
        leg: a roll-pitch-pitch leg without offsets.
        q: joint angles ``(3,)`` [rad], not singular.
        direction: ``(3,)``, vertical or horizontal, in the body frame.

    Returns:
        Speed [m/s].

    Raises:
        InputError: the leg has offsets, or the direction is neither vertical nor horizontal.
    """
    plain = leg.has_roll and not (leg.is_general or leg.lateral or leg.drop)
    if not plain or not np.allclose(leg.axes, np.eye(3)):
        raise InputError(f"leg {leg.name}: the paper's formulae hold for legs without offsets only")
    unit = np.asarray(direction, dtype=np.float64)
    unit = unit / np.linalg.norm(unit)
    if np.any(unit[:2]) and unit[2]:
        raise InputError("the paper's formulae hold for vertical or horizontal motion only")
    # One column per joint: joint rates w = ratios * w_j when joint j is the reference.
    rates = _vertical_rates(leg, q) if unit[2] else _horizontal_rates(leg, q, unit)
    limits = leg.velocity_limits
    for j in range(3):
        if rates[j] == 0.0:
            continue
        others = rates / rates[j] * limits[j]
        if np.all(np.abs(others) <= limits * (1.0 + ROUNDING)):
            return float(np.linalg.norm(_paper_foot_velocity(leg, q, others)))
    raise SolverError(f"leg {leg.name}: no joint moves the foot along {unit} at q = {q}")


class _PaperAngles(NamedTuple):
    """Sines and cosines of eqs. (11), (12), and the paper's lambda."""

    s1: float
    c1: float
    s2: float
    c2: float
    s3: float
    c3: float
    lam: float


def _paper_angles(leg: Leg, q: FloatArray) -> _PaperAngles:
    lam = 1.0 if leg.name.endswith("F") else -1.0
    roll = leg.signs[0] * q[0]
    thigh = leg.signs[1] * q[1] + leg.zeros[0]
    knee = leg.signs[2] * q[2] + leg.zeros[1]
    # theta_2 = -lam thigh, theta_3 = -lam knee, and s3 = sin(-theta_3 - theta_2).
    two, three = -lam * thigh, lam * (knee + thigh)
    return _PaperAngles(
        np.sin(roll), np.cos(roll), np.sin(two), np.cos(two), np.sin(three), np.cos(three), lam
    )


def _vertical_rates(leg: Leg, q: FloatArray) -> FloatArray:
    """Joint rates in proportion, from eq. (14) with the sign of w1/w3 corrected."""
    s1, c1, s2, c2, s3, c3, lam = _paper_angles(leg, q)
    l2, l3 = leg.upper, leg.lower
    height, cross = l2 * c2 + l3 * c3, c2 * s3 + c3 * s2
    theta = np.array([s1 * l2 * l3 * cross, l3 * c3 * c1 * height, -c1 * height**2])
    return _to_joint_rates(leg, theta, lam)


def _horizontal_rates(leg: Leg, q: FloatArray, unit: FloatArray) -> FloatArray:
    """Joint rates in proportion, from eq. (16) with signs and the misprint corrected."""
    s1, c1, s2, c2, s3, c3, lam = _paper_angles(leg, q)
    l2, l3 = leg.upper, leg.lower
    height, cross = l2 * c2 + l3 * c3, c2 * s3 + c3 * s2
    kx, ky = unit[0], unit[1] * lam
    theta = np.array(
        [
            c1 * l2 * l3 * ky * cross,
            l3 * height * (s3 * kx - c3 * s1 * ky),
            height * ((l2 * s2 - l3 * s3) * kx + s1 * ky * height),
        ]
    )
    return _to_joint_rates(leg, theta, lam)


def _to_joint_rates(leg: Leg, theta: FloatArray, lam: float) -> FloatArray:
    return np.asarray(theta * np.array([1.0, -lam, -lam]) * np.array(leg.signs))


def _paper_foot_velocity(leg: Leg, q: FloatArray, rates: FloatArray) -> FloatArray:
    """Eq. (12), with the shank's rate ``-(w2 + w3)`` where the paper writes ``w3``."""
    s1, c1, s2, c2, s3, c3, lam = _paper_angles(leg, q)
    w1, w2, w3 = rates * np.array(leg.signs) * np.array([1.0, -lam, -lam])
    l2, l3, shank = leg.upper, leg.lower, -(w2 + w3)
    # Height of the roll axis over the foot in the leg's own plane, and minus its derivative.
    height, change = l2 * c2 + l3 * c3, l2 * w2 * s2 + l3 * shank * s3
    return np.array(
        [
            lam * (l2 * w2 * c2 - l3 * shank * c3),
            w1 * c1 * height - s1 * change,
            w1 * s1 * height + c1 * change,
        ]
    )
