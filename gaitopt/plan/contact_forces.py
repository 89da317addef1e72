"""Contact forces and joint torques of a plan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.dynamics.contact_forces import ContactForces
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.forces import ForceObjective, build_force_problem, solve_forces
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.inputs import check_kind
from gaitopt.plan.contact_ground import ground_below
from gaitopt.plan.load_transfer import largest_shares
from gaitopt.plan.plan import Plan


def contact_forces(
    plan: Plan,
    limits: ForceLimits | None = None,
    *,
    dt: float = 0.005,
    times: ArrayLike | None = None,
    objective: ForceObjective | str = ForceObjective.SMOOTHEST,
    normals: ArrayLike | None = None,
) -> ContactForces:
    """Contact forces and joint torques that make a plan's motion, with the whole robot's dynamics.

    Masses and inertias of all links count. Feet touch the ground one foot radius from their
    frames, against the normals. Whether forces exist is judged at the instants that are asked for,
    not between them; a path whose velocity jumps needs impulses at its knots, which no instant
    shows (:attr:`ContactForces.velocity_jump`).

    Args:
        plan: the plan.
        limits: what is asked of forces and torques; by default what the plan promises, or the
            defaults of :class:`ForceLimits` where it promises nothing of them.
        dt: time between the instants [s]; the last one is the plan's end.
        times: the instants themselves ``(N,)`` [s], instead of ``dt``. At a knot where the
            acceleration jumps, and where a foot lands or lifts off, it is the later value.
        objective: which of all possible forces: ``"smoothest"`` (of least norm), ``"least
            torque"``, or ``"largest reserve"`` (on the foot that presses least).
        normals: of the ground below the feet, of any length, broadcast to ``(N, 4, 3)``; those of
            the plan's footholds by default. Where these have less friction than the limits, theirs
            counts.

    Returns:
        Forces, torques and residuals. Where no forces keep all limits, the status of the instant
        says which limit is in the way; :meth:`ContactForces.worst` names foot or joint.

    Raises:
        InputError: a time lies outside the plan, ``dt`` is not positive, or the objective is
            unknown.
    """
    check_kind("plan", plan, Plan)
    limits = plan.settings.promised_forces if limits is None else limits
    motion = plan.sample(dt) if times is None else plan.at(times)
    values, first, second = (plan.path.evaluate(motion.t, order) for order in range(3))
    asked = ForceLimits.or_default(limits)
    ground = ground_below(plan, motion.t, asked.friction)
    problem = build_force_problem(
        plan.robot,
        motion_of_path(plan.robot, values, first, second),
        motion.contacts,
        limits,
        normals=ground.normals if normals is None else normals,
        grip=ground.grip,
        times=motion.t,
        most=largest_shares(plan, asked, motion.t),
    )
    jump = float(np.max(plan.path.jumps(1), initial=0.0))
    return replace(solve_forces(problem, objective), velocity_jump=jump)
