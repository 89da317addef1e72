"""Why a course has no timing: errors that name the step and what is in the way."""

from __future__ import annotations

import numpy as np

from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.forces import build_force_problem, solve_forces
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.plan.phase import Phase
from gaitopt.retiming.course import Course, Grid


def no_motion(
    course: Course, grid: Grid, interval: int, phase: Phase, limits: ForceLimits
) -> InfeasibleStepError:
    """The error of an interval on which no motion was found.

    Args:
        course, grid, interval: the interval.
        phase: that it is part of.
        limits: on forces and torques.
    """
    piece = grid.piece[[interval]]
    value = course.states(grid.begin[[interval]], piece)[0]
    rest = motion_of_path(course.robot, value, np.zeros_like(value), np.zeros_like(value))
    problem = build_force_problem(course.robot, rest, course.standing[piece], limits)
    conflicts = solve_forces(problem).conflicts(0)
    how = (
        f"not even at rest: {'; '.join(conflicts)}" if conflicts else
        "in motion: the robot could rest here, but cannot go on along its path at any speed"
    )  # fmt: skip
    return InfeasibleStepError(
        f"step {phase.step} ({phase.leg}): no contact forces hold the robot here, {how}; take "
        "another stability_margin or body_height, or allow more friction or torque",
        step=phase.step, leg=phase.leg, conflicts=conflicts,
    )  # fmt: skip


def no_forces_between(phase: Phase, time: float) -> SolverError:
    """The error of a motion that has no forces between two places of its grid.

    Args:
        phase: where they are missing.
        time: and when [s].
    """
    return SolverError(
        f"step {phase.step} ({phase.leg}): no timing was found whose contact forces exist "
        f"between the places at which they were looked for, near {time:.3f} s; take "
        "another stability_margin or swing_height, or allow more friction or torque"
    )
