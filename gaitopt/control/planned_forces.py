"""Contact forces that make a planned motion, with loads that rise and fall at the ends of a stance.

A foot that is about to lift off gives up its load before, and one that has landed takes it up
after, as far as the motion leaves a choice. Of all forces that keep the plan's limits those are
taken whose squares, each divided by the foot's squared share of a full load, have the least sum.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contacts import LEVEL_GROUND, ContactGround, ForceLimits
from gaitopt.dynamics.force_space import ForceProblem, ForceSpace, force_rows, force_spaces
from gaitopt.dynamics.forces import build_force_problem
from gaitopt.dynamics.many_programs import solve_quadratic_programs
from gaitopt.dynamics.small_programs import ROW_TOLERANCE
from gaitopt.dynamics.whole_body import Motion
from gaitopt.robots.quadruped import Quadruped

LEAST_SHARE = 0.05
"""Least share of a full load that forces are weighted by: a smaller one would take away hardly more
load, and the programs would be badly scaled."""

BLOCK = 8192
"""Most samples that are solved at once; they take about 5 kB each."""


def planned_forces(
    robot: Quadruped,
    motion: Motion,
    standing: BoolArray,
    load: FloatArray,
    limits: ForceLimits,
    ground: ContactGround = LEVEL_GROUND,
    most: FloatArray | float = np.inf,
) -> FloatArray:
    """Contact forces of a motion in the world's axes ``(N, 4, 3)`` [N]; 0 for feet in the air.

    At an instant where no forces keep the limits they make the motion and exceed them.

    Args:
        robot: the robot.
        motion: in Pinocchio's vectors, ``N`` samples.
        standing: which feet stand ``(N, 4)``.
        load: share of a full load for each foot ``(N, 4)``.
        limits: on forces and torques.
        ground: below the feet; level by default.
        most: largest normal forces as shares of the weight ``(N, 4)``; none by default.
    """
    largest = np.broadcast_to(most, standing.shape)
    forces = np.zeros((len(standing), 4, 3))
    for first in range(0, len(standing), BLOCK):
        part = np.arange(first, min(first + BLOCK, len(standing)))
        below = ground.at(part)
        piece = Motion(motion.q[part], motion.v[part], motion.a[part])
        problem = build_force_problem(
            robot, piece, standing[part], limits, normals=below.normals, grip=below.grip,
            most=largest[part],
        )  # fmt: skip
        for space in force_spaces(problem):
            places = np.ix_(first + space.samples, space.feet)
            z = _coordinates(problem, space, np.maximum(load[places], LEAST_SHARE))
            forces[places] = problem.weight * space.forces(z)
    return forces


def _coordinates(problem: ForceProblem, space: ForceSpace, shares: FloatArray) -> FloatArray:
    """Coordinates ``(n, d)`` of the forces, for shares of a full load ``(n, k)``."""
    count, _, size = space.directions.shape
    # Where the forces are unique there is nothing to choose.
    if not size:
        return np.zeros((count, 0))
    rows = force_rows(problem, space)
    weighted = space.directions * np.repeat(shares, 3, axis=1)[..., None] ** -2.0
    hessian = np.swapaxes(space.directions, 1, 2) @ weighted
    gradient = np.einsum("nfd,nf->nd", weighted, space.particular)
    # Programs are to be of order one.
    unit = np.linalg.norm(hessian, axis=(1, 2))
    hessian, gradient = hessian / unit[:, None, None], gradient / unit[:, None]
    z = np.asarray(-np.linalg.solve(hessian, gradient[..., None])[..., 0])
    values = (rows.matrix @ z[..., None])[..., 0]
    kept = (values >= rows.low - ROW_TOLERANCE) & (values <= rows.high + ROW_TOLERANCE)
    own = np.flatnonzero(~kept.all(axis=1))
    found, solved = solve_quadratic_programs(
        hessian[own], gradient[own], rows.matrix[own], rows.low[own], rows.high[own]
    )
    z[own[solved]] = found[solved]
    return z
