"""Why a course has no timing: errors that name the step and what is in the way."""

from __future__ import annotations

import numpy as np

from gaitopt.dynamics.contacts import ContactGround, ForceLimits
from gaitopt.dynamics.forces import build_force_problem, solve_forces
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.errors import InfeasibleStepError, InputError, SingularLegError, SolverError
from gaitopt.plan.phase import Phase
from gaitopt.retiming.course import Course, Grid
from gaitopt.robots.whole_body_rates import SINGULAR_LEG

WAY_OUT = "take another stability_margin or body_height, or allow more friction or torque"
"""What the user can do where limits are in the way."""


def no_motion(
    course: Course,
    grid: Grid,
    interval: int,
    phase: Phase,
    limits: ForceLimits,
    ground: ContactGround,
) -> InfeasibleStepError:
    """The error of an interval on which no motion was found.

    Args:
        course, grid, interval: the interval.
        phase: that it is part of.
        limits: on forces and torques.
        ground: below the feet there.
    """
    piece = grid.piece[[interval]]
    value = course.states(grid.begin[[interval]], piece)[0]
    rest = motion_of_path(course.robot, value, np.zeros_like(value), np.zeros_like(value))
    problem = build_force_problem(
        course.robot, rest, course.standing[piece], limits, normals=ground.normals, grip=ground.grip
    )
    forces = solve_forces(problem)
    conflicts, worst = forces.conflicts(0), forces.worst()
    way_out = WAY_OUT if limits.transfer_time == 0.0 else f"{WAY_OUT}, or a shorter transfer_time"
    if conflicts:
        how = f"not even at rest: {'; '.join(conflicts)}"
    elif worst is not None:
        # No limit is in the way: two feet or one have no forces for this load.
        conflicts = (f"{worst.kind.name.lower().replace('_', ' ')} {worst.name}",)
        how = f"neither at rest ({conflicts[0]}) nor in motion at any speed"
        way_out = "so few feet carry hardly another timing; keep that of a plan made with forces"
    else:
        how = "in motion: the robot could rest here, but cannot go on along its path at any speed"
    return InfeasibleStepError(
        f"{_named(phase)}: no contact forces hold the robot here, {how}; {way_out}",
        step=phase.step, leg=phase.leg, conflicts=conflicts,
    )  # fmt: skip


def not_reached(phase: Phase, error: InputError) -> InfeasibleStepError:
    """The error of a course on which a leg does not reach its foot, or has no finite velocities.

    What a planner made is no argument of its user.

    Args:
        phase: where that is.
        error: which leg, and why.
    """
    if isinstance(error, SingularLegError):
        return InfeasibleStepError(
            f"{_named(phase)}: leg {error.leg} would be quite straight or folded, or its foot on "
            "its roll axis, where no joint velocities move it on; take a smaller reach_fraction, "
            "0.95 for example, or another body_height",
            step=phase.step, leg=phase.leg, conflicts=(f"{SINGULAR_LEG} {error.leg}",),
        )  # fmt: skip
    return InfeasibleStepError(
        f"{_named(phase)}: {error}; take another body_height, or a smaller reach_fraction",
        step=phase.step, leg=phase.leg,
    )  # fmt: skip


def no_forces_between(phase: Phase, time: float) -> SolverError:
    """The error of a motion that has no forces between two places of its grid.

    Args:
        phase: where they are missing.
        time: and when [s].
    """
    return SolverError(
        f"{_named(phase)}: no timing was found whose contact forces exist "
        f"between the places at which they were looked for, near {time:.3f} s; take "
        "another stability_margin or swing_height, or allow more friction or torque",
        step=phase.step,
    )


def _named(phase: Phase) -> str:
    """The step that a phase belongs to, and its leg."""
    return f"step {phase.step} ({phase.leg})" if phase.leg else "after the last step"
