"""Static stability judged with the robot's true centre of mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.inputs import check_kind
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.margins import static_stability_margin


def true_com(robot: Quadruped, q: FloatArray) -> FloatArray:
    """Centre of mass of the whole model at configurations ``q (N, nq)``: ``(N, 3)`` [m]."""
    import pinocchio as pin

    data = robot.model.createData()
    # data.com[0] is a live view of Pinocchio's memory: copy.
    return np.array([np.array(pin.centerOfMass(robot.model, data, row)) for row in q])


def com_margin(plan: Plan, times: FloatArray | None = None) -> tuple[FloatArray, FloatArray]:
    """Static stability margin of the model's true COM over time.

    The paper plans with the body's centre. But legs have mass, so the true centre of mass moves
    against the body when a leg swings (``docs/papers.md``, errata of [Wang2020], Section II.C (2)).

    Args:
        plan: the plan.
        times: instants ``(N,)`` [s]; every knot of the plan's path by default.

    Returns:
        The times ``(N,)`` [s] and the margins ``(N,)`` [m], on the horizontal projection.
    """
    check_kind("plan", plan, Plan)
    motion = plan.at(times_of_margins(plan) if times is None else times)
    return motion.t, margins_over(motion, true_com(plan.robot, motion.q))


def times_of_margins(plan: Plan) -> FloatArray:
    """Every knot of a plan's path, and the last instant of every phase ``(N,)`` [s].

    At the knot that ends a swing the foot stands. So the instant just before this knot is added,
    at which the foot is still in the air.
    """
    ends = np.nextafter([p.end for p in plan.phases if p.duration > 0], 0.0)
    return np.union1d(plan.path.times, ends)


def with_com_margins(plan: Plan) -> Plan:
    """The plan with the true COM's margins in its phases; see :func:`with_margins`.

    Args:
        plan: any plan.
    """
    return with_margins(plan, *com_margin(plan))


def with_margins(plan: Plan, times: FloatArray, margins: FloatArray) -> Plan:
    """The plan with the smallest of the given margins in each of its phases.

    Phases that last no time, or in which a margin is not finite because fewer than three feet
    stand, keep the margin that they have.

    Args:
        plan: any plan.
        times: those of :func:`times_of_margins` ``(N,)`` [s].
        margins: at these ``(N,)`` [m].
    """
    phases = list(plan.phases)
    for i, phase in enumerate(phases):
        first, last = np.searchsorted(times, [phase.start, phase.end])
        if last > first and np.isfinite(margins[first:last]).all():
            phases[i] = replace(phase, margin=float(margins[first:last].min()))
    return replace(plan, phases=tuple(phases))


def margins_over(motion: Trajectory, points: FloatArray) -> FloatArray:
    """Margin of ``points (N, 3)`` over the feet that stand at each sample ``(N,)`` [m]."""
    margins = np.full(len(motion), np.nan)
    patterns, group = np.unique(motion.contacts, axis=0, return_inverse=True)
    for i, pattern in enumerate(patterns):
        chosen = np.flatnonzero(group.ravel() == i)
        if pattern.sum() >= 3:
            feet = motion.feet[chosen][:, np.flatnonzero(pattern)]
            margins[chosen] = static_stability_margin(feet, points[chosen])
    return margins
