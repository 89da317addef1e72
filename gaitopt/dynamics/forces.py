"""Contact forces for a motion: smoothest, with least torque, or with the largest reserve.

The motion fixes what the ground must do as a whole, the six equations of the base. On three feet or
more many forces do that. Those that are chosen keep to friction pyramids, least normal forces and
torque limits, and minimise an objective: small quadratic or linear programs, one a sample, of at
most seven unknowns. Where the limits contradict each other, the forces exceed them as little as
possible, so that one sees which limit is in the way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import BoolArray, FloatArray, TextEnum
from gaitopt.dynamics.contact_forces import ContactForces
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.force_residuals import judged
from gaitopt.dynamics.force_space import (
    ForceProblem,
    ForceRows,
    ForceSpace,
    force_rows,
    force_spaces,
)
from gaitopt.dynamics.least_excess import least_excess
from gaitopt.dynamics.many_programs import solve_quadratic_programs
from gaitopt.dynamics.small_programs import NO_BOUND, ROW_TOLERANCE, solve_linear
from gaitopt.dynamics.torque_limits import torque_bounds
from gaitopt.dynamics.whole_body import Motion, equations_of_motion
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_array, check_numbers
from gaitopt.robots.quadruped import Quadruped

FORCE_WEIGHT: Final = 1e-4
"""Weight of the squared forces, in units of the weight, against the squared shares of the torques.
It makes forces of least torque unique also where a straight leg carries any force without torque,
and raises the sum of the squared shares by 1e-4 at most."""

HELD: Final = 1e-4
"""Multiplier from which on a limit counts as being in the way: a limit with a smaller one could be
lifted, and what is exceeded would shrink by less than 1e-4 of the weight, or of a torque limit, for
each of these units by which it is lifted."""


class ForceObjective(TextEnum):
    """Which of all possible forces are chosen."""

    SMOOTHEST = "smoothest"
    """The forces of least norm. They are unique and, while the same feet stand, continuous in
    time, and they load all feet alike as far as the motion allows."""
    LEAST_TORQUE = "least torque"
    """Least sum of the squared torques, as shares of their limits. Joints without a known limit do
    not count."""
    LARGEST_RESERVE = "largest reserve"
    """Largest normal force on the foot that presses least."""


def build_force_problem(
    robot: Quadruped,
    motion: Motion,
    standing: ArrayLike,
    limits: ForceLimits | None = None,
    *,
    normals: ArrayLike = (0.0, 0.0, 1.0),
    grip: ArrayLike = 1.0,
    times: ArrayLike | None = None,
    most: ArrayLike = np.inf,
) -> ForceProblem:
    """The contact forces that are looked for, at every sample of a motion.

    Args:
        robot: the robot.
        motion: in Pinocchio's vectors, ``N`` samples.
        standing: which feet stand, as truth values ``(N, 4)``, legs in the order of
            :data:`gaitopt.LEGS`.
        limits: what is asked of forces and torques.
        normals: of the ground below the feet, of any length, broadcast to ``(N, 4, 3)``.
        grip: friction of each contact as a share of that of the limits, broadcast to ``(N, 4)``.
        times: of the samples ``(N,)`` [s], for the report; 0, 1, 2, ... by default.
        most: largest normal force of each foot as a share of the weight, broadcast to ``(N, 4)``.
            The ``transfer_time`` of the limits means nothing here: samples do not tell when feet
            land.

    Raises:
        InputError: shapes do not fit, a number is not finite, a normal has no direction, the
            limits are none, or the robot has no mass.
    """
    asked = ForceLimits.or_default(limits)
    robot.require_masses()
    equations = equations_of_motion(robot, motion, normals, grip)
    count = len(equations)
    flags = np.array(standing)
    if flags.dtype != np.bool_ or flags.shape != (count, 4):
        raise InputError(
            f"standing must be truth values ({count}, 4), got {flags.dtype} {flags.shape}"
        )
    low, high = torque_bounds(robot, asked, np.asarray(motion.v)[:, 6:])
    moments = check_numbers("times", np.arange(count) if times is None else times, -1e12, 1e12, "s")
    if moments.shape != (count,):
        raise InputError(f"times must be ({count},), got {moments.shape}")
    return ForceProblem(
        robot=robot,
        equations=equations,
        standing=flags,
        limits=asked,
        torque_low=low,
        torque_high=high,
        times=np.array(moments),
        weight=robot.mass * float(np.linalg.norm(robot.model.gravity.linear)),
        length=robot.stance_size[0] / 2.0,
        most=_largest_shares(most, count),
    )


def _largest_shares(most: ArrayLike, count: int) -> FloatArray:
    """Largest normal forces as shares of the weight ``(count, 4)``."""
    shares = check_array("most", most)
    try:
        given = np.array(np.broadcast_to(shares, (count, 4)))
    except ValueError as error:
        raise InputError(f"most must fit ({count}, 4), got {np.shape(most)}: {error}") from error
    # Comparisons with NaN are false.
    if not (given >= 0.0).all():
        raise InputError("most must be shares of the weight of at least 0")
    return given


def solve_forces(
    problem: ForceProblem, objective: ForceObjective | str = ForceObjective.SMOOTHEST
) -> ContactForces:
    """Contact forces that make the motion and keep all limits, as far as there are any.

    Args:
        problem: from :func:`build_force_problem`.
        objective: which of all forces.

    Returns:
        Forces, torques and residuals. Instants without forces are no error: their status says
        which limit is in the way.

    Raises:
        InputError: the objective is unknown.
        SolverError: no solver found forces for a sample, feasible or not.
    """
    solve = _SOLVERS[_objective(objective)]
    forces = np.zeros((len(problem), 4, 3))
    conflicts = np.zeros((len(problem), 8 + len(problem.robot.joint_names)), dtype=np.bool_)
    for space in force_spaces(problem):
        count, _, size = space.directions.shape
        found = _Coordinates(np.zeros((count, size)))
        # Where the forces are unique there is nothing to choose.
        if size:
            rows = force_rows(problem, space)
            found = solve(problem, space, rows)
            for i, multipliers in found.conflicts:
                held = rows.constraints[np.abs(multipliers[: len(rows.normal)]) > HELD]
                conflicts[space.samples[i], rows.columns[held]] = True
        forces[np.ix_(space.samples, space.feet)] = problem.weight * space.forces(found.z)
    return judged(problem, forces, conflicts)


class _Coordinates(NamedTuple):
    """Coordinates ``z (n, d)`` of the forces of a group.

    ``conflicts`` are the samples whose limits contradict each other, with multipliers of their
    rows that prove it.
    """

    z: FloatArray
    conflicts: Sequence[tuple[int, FloatArray]] = ()


def _objective(objective: ForceObjective | str) -> ForceObjective:
    try:
        return ForceObjective(objective)
    except (TypeError, ValueError):
        known = ", ".join(repr(str(member)) for member in ForceObjective)
        raise InputError(f"objective {as_text(objective)} is unknown; there are {known}") from None


def _smoothest(problem: ForceProblem, space: ForceSpace, rows: ForceRows) -> _Coordinates:
    """Coordinates of the forces of least norm ``(n, d)``."""
    count, _, size = rows.matrix.shape
    # The directions are orthonormal, and square to the particular forces of least norm.
    hessian = np.repeat(np.eye(size)[None], count, axis=0)
    return _quadratic(problem, space, rows, hessian, np.zeros((count, size)))


def _least_torque(problem: ForceProblem, space: ForceSpace, rows: ForceRows) -> _Coordinates:
    """Coordinates of the forces of least torque ``(n, d)``."""
    by_torque = np.swapaxes(rows.torque_matrix, 1, 2)
    hessian = by_torque @ rows.torque_matrix + FORCE_WEIGHT * np.eye(by_torque.shape[1])
    gradient = (by_torque @ rows.torque_offset[..., None])[..., 0]
    return _quadratic(problem, space, rows, hessian, gradient)


def _quadratic(
    problem: ForceProblem,
    space: ForceSpace,
    rows: ForceRows,
    hessian: FloatArray,
    gradient: FloatArray,
) -> _Coordinates:
    """Minimisers of ``z H z / 2 + g z`` over the rows, sample by sample ``(n, d)``."""
    z = np.asarray(-np.linalg.solve(hessian, gradient[..., None])[..., 0])
    # Where the minimum over all forces keeps the limits, it is that over those that keep them.
    own = np.flatnonzero(~_kept(rows, z))
    found, kept = solve_quadratic_programs(
        hessian[own], gradient[own], rows.matrix[own], rows.low[own], rows.high[own]
    )
    z[own[kept]] = found[kept]
    without = own[~kept].tolist()
    least = least_excess(problem, space, rows, without)
    z[without] = least.z
    return _Coordinates(z, [(i, least.multipliers[k]) for k, i in enumerate(without)])


def _largest_reserve(problem: ForceProblem, space: ForceSpace, rows: ForceRows) -> _Coordinates:
    """Coordinates of the forces of largest reserve ``(n, d)``."""
    count, length, size = rows.matrix.shape
    # One more unknown, what all feet have above the least normal force, and one more row, so that
    # it is bounded where feet that press against each other could press without end.
    matrix = np.zeros((count, length + 1, size + 1))
    matrix[:, :-1, :-1] = rows.matrix
    matrix[:, np.append(rows.normal, False), -1] = -1.0
    matrix[:, -1, -1] = 1.0
    low = np.pad(rows.low, ((0, 0), (0, 1)), constant_values=-NO_BOUND)
    high = np.pad(rows.high, ((0, 0), (0, 1)), constant_values=1.0)
    costs = np.append(np.zeros(size), -1.0)
    z, without, conflicts = np.empty((count, size)), [], []
    for i in range(count):
        found = solve_linear(costs, matrix[i], low[i], high[i])
        if found is None:
            without.append(i)
            continue
        z[i] = found.point[:-1]
        if found.point[-1] < -ROW_TOLERANCE:
            conflicts.append((i, found.multipliers))
    least = least_excess(problem, space, rows, without)
    z[without] = least.z
    for k, i in enumerate(without):
        # A program that is feasible, and was not solved, is one for another solver.
        if least.excess[k] <= ROW_TOLERANCE:
            found = solve_linear(costs, matrix[i], low[i], high[i], by_highs=True)
            z[i] = z[i] if found is None else found.point[:-1]
        else:
            conflicts.append((i, least.multipliers[k]))
    return _Coordinates(z, conflicts)


def _kept(rows: ForceRows, z: FloatArray) -> BoolArray:
    """Which samples keep all their rows ``(n,)``."""
    values = (rows.matrix @ z[..., None])[..., 0]
    kept = (values >= rows.low - ROW_TOLERANCE) & (values <= rows.high + ROW_TOLERANCE)
    return np.asarray(kept.all(axis=1))


_SOLVERS: Final[
    dict[ForceObjective, Callable[[ForceProblem, ForceSpace, ForceRows], _Coordinates]]
] = {
    ForceObjective.SMOOTHEST: _smoothest,
    ForceObjective.LEAST_TORQUE: _least_torque,
    ForceObjective.LARGEST_RESERVE: _largest_reserve,
}
