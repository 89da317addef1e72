"""Stances for the tests of forces, and forces by another solver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from gaitopt import LEGS, Quadruped
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.whole_body import Motion, motion_of_path
from gaitopt.motion.body_and_feet import path_states

# Values of `status` of scipy.optimize.linprog.
SOLVED, INFEASIBLE = 0, 2


@dataclass(frozen=True)
class Stance:
    """One sample of a robot on its feet."""

    motion: Motion
    feet: np.ndarray


def stance(
    robot: Quadruped,
    *,
    place: ArrayLike = (0.0, 0.0),
    height: float | None = None,
    rpy: ArrayLike = (0.0, 0.0, 0.0),
    feet: ArrayLike | None = None,
    velocity: ArrayLike = (0.0,) * 6,
    acceleration: ArrayLike = (0.0,) * 6,
) -> Stance:
    """The robot over feet that do not move; by default those of a rectangle on level ground.

    Args:
        robot: the robot.
        place: horizontal place of the base.
        height: of the base above the foot frames.
        rpy: of the base.
        feet: foot frames ``(4, 3)``.
        velocity, acceleration: of the base's x, y, z, roll, pitch, yaw ``(6,)``.
    """
    if feet is None:
        feet = level_feet(robot)
    tall = robot.standing_height if height is None else height
    base = np.concatenate([place, [tall + robot.foot_radius], rpy])[None]
    points, still = np.asarray(feet, np.float64)[None], np.zeros((1, 4, 3))
    states = path_states(
        robot,
        (base, np.asarray(velocity, np.float64)[None], np.asarray(acceleration, np.float64)[None]),
        (points, still, still),
    )
    return Stance(motion_of_path(robot, *states), points[0])


def level_feet(robot: Quadruped) -> np.ndarray:
    """Foot frames below the hips, on the ground at height 0 ``(4, 3)``."""
    legs = [robot.legs[leg] for leg in LEGS]
    places = np.array([leg.hip + leg.axes[:, 1] * leg.lateral for leg in legs])
    return np.column_stack([places[:, :2], np.full(4, robot.foot_radius)])


def centre_of_mass(robot: Quadruped, motion: Motion) -> np.ndarray:
    """Of the first sample ``(3,)``."""
    return np.array(pin.centerOfMass(robot.model, robot.model.createData(), motion.q[0]))


@dataclass(frozen=True)
class Reference:
    """The limits of one sample, stated anew with all forces, torques and Pinocchio's Jacobians."""

    equality: np.ndarray
    target: np.ndarray
    rows: np.ndarray
    limits: np.ndarray
    normal_rows: np.ndarray
    size: int


def reference(
    robot: Quadruped,
    motion: Motion,
    sample: int,
    standing: np.ndarray,
    limits: ForceLimits,
    normal: ArrayLike = (0.0, 0.0, 1.0),
) -> Reference:
    """The linear program in the forces of all standing feet ``f`` [N], and a share ``s``.

    ``equality @ (f, s) = target`` and ``rows @ (f, s) <= limits``; ``s`` is the least normal force
    of all standing feet as a share of the weight, and no limit binds it but its definition.
    """
    model, data = robot.model, robot.model.createData()
    q, v, a = (x[sample] for x in motion)
    pin.computeAllTerms(model, data, q, v)
    left = data.M @ a + data.nle
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    up = np.asarray(normal, np.float64) / np.linalg.norm(normal)
    # With a normal on the x-z plane these tangents are those of the shortest rotation.
    side = np.array([0.0, 1.0, 0.0])
    ahead = np.cross(side, up)
    columns, blocks, normals = [], [], []
    legs = [leg for leg, stands in zip(LEGS, standing, strict=True) if stands]
    weight, size = robot.mass * 9.81, 3 * len(legs) + 1
    for i, leg in enumerate(legs):
        frame = model.getFrameId(robot.legs[leg].foot)
        jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
        arm = -robot.foot_radius * up
        columns.append(jacobian[:3] + np.cross(jacobian[3:].T, arm).T)
        angles = 2 * np.pi * np.arange(limits.sides) / limits.sides
        slope = limits.friction * np.cos(np.pi / limits.sides)
        for angle in angles:
            row = np.zeros(size)
            row[3 * i : 3 * i + 3] = np.cos(angle) * ahead + np.sin(angle) * side - slope * up
            blocks.append((row, 0.0))
        row = np.zeros(size)
        row[3 * i : 3 * i + 3], row[-1] = -up, weight
        normals.append(row)
    transposed = np.hstack([np.vstack(columns).T, np.zeros((model.nv, 1))])
    bound = limits.torque_share * model.effortLimit[6:]
    for k, largest in enumerate(bound):
        blocks.append((-transposed[6 + k], largest - left[6 + k]))
        blocks.append((transposed[6 + k], largest + left[6 + k]))
    return Reference(
        equality=transposed[:6],
        target=left[:6],
        rows=np.array([row for row, _ in blocks]),
        limits=np.array([limit for _, limit in blocks]),
        normal_rows=np.array(normals),
        size=size,
    )


def largest_reserve(problem: Reference) -> float | None:
    """Largest share of the weight on the foot that presses least; ``None`` without forces."""
    for method in ("highs", "highs-ipm"):
        found: Any = linprog(
            -np.eye(problem.size)[-1],
            A_ub=np.vstack([problem.rows, problem.normal_rows]),
            b_ub=np.concatenate([problem.limits, np.zeros(len(problem.normal_rows))]),
            A_eq=problem.equality,
            b_eq=problem.target,
            bounds=(None, None),
            method=method,
        )
        # The simplex method stops with "Not Set" where coefficients of 1e-9 stand beside ones.
        if found.status in (SOLVED, INFEASIBLE):
            return float(found.x[-1]) if found.status == SOLVED else None
    raise AssertionError(f"HiGHS solved the linear program of a stance by no method: {found}")
