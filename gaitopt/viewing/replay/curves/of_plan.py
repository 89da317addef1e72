"""The curves of a plan."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS, FloatArray
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.plan.com_margin import margins_over, true_com
from gaitopt.plan.contact_forces import contact_forces
from gaitopt.plan.plan import Plan
from gaitopt.plan.trajectory import Trajectory
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.zmp import whole_body_zmp
from gaitopt.viewing.replay.curves.clearance import Clearance, clearance_over
from gaitopt.viewing.replay.curves.curves import Curves, Joints
from gaitopt.viewing.replay.robot_scene import joint_paths
from gaitopt.viewing.replay.scene import FramePath

MOST_INSTANTS = 6000
"""Most instants of the curves of a plan, about. Chosen: 0.3 MB of the page, and half a second of
computing forces."""
PER_PHASE = (3, 60)
"""Least and most instants of a phase: its ends and its middle; and every pixel of a screen where
one phase is all that is shown."""


def plan_curves(plan: Plan, root: FramePath = ("robot",)) -> Curves | None:
    """The curves of a plan; ``None`` where it takes no time.

    Each phase has equally many instants, with its first and its last one. What is between them is
    not drawn: the certificate judges it.

    Args:
        plan: the motion.
        root: the frame above the robot's base.
    """
    if not plan.duration > 0.0:
        return None
    times = instants(plan)
    motion = plan.at(times)
    name, margin = _margin(plan, motion)
    torque, pressing, notes = _forces(plan, times)
    return Curves(
        times=times,
        standing=stances(plan),
        velocity_use=np.abs(motion.v[:, 6:]) / plan.robot.velocity_limits,
        torque_use=torque,
        margin=margin,
        margin_name=name,
        promised=float(plan.settings.stability_margin),
        pressing=pressing,
        clearance=clearance_of(plan, times, motion.q),
        weight=plan.robot.mass * GRAVITY,
        notes=notes,
        joints=joints_of(plan.robot, root),
    )


def clearance_of(plan: Plan, times: FloatArray, q: FloatArray) -> Clearance | None:
    """How far legs and trunk are above the plan's height map; ``None`` where it has none."""
    ground = plan.footholds.ground
    return None if ground is None else clearance_over(plan.robot, ground, times, q)


def instants(plan: Plan) -> FloatArray:
    """Instants of all phases that last ``(N,)`` [s]; that of a phase's end lies just before."""
    lasting = [phase for phase in plan.phases if phase.duration > 0.0]
    if not lasting:
        return np.linspace(0.0, plan.duration, PER_PHASE[1])
    count = int(np.clip(MOST_INSTANTS // len(lasting), *PER_PHASE))
    starts = np.array([phase.start for phase in lasting])
    ends = np.minimum([phase.end for phase in lasting], plan.duration)
    parts = np.linspace(0.0, 1.0, count)
    table = starts[:, None] + parts * (ends - starts)[:, None]
    table[:, -1] = np.nextafter(ends, 0.0)
    return np.asarray(np.append(np.maximum.accumulate(table.ravel()), plan.duration))


def joints_of(robot: Quadruped, root: FramePath) -> Joints:
    """A robot's joints, whose frames are below ``root``."""
    paths = joint_paths(robot, root)
    legs = {column: leg for leg in LEGS for column in robot.leg_columns[leg]}
    numbers = [int(robot.model.getJointId(name)) for name in robot.joint_names]
    return Joints(
        names=robot.joint_names,
        legs=tuple(legs.get(column, "") for column in range(len(robot.joint_names))),
        frames=tuple("/".join(paths[number]) for number in numbers),
    )


def stances(plan: Plan) -> dict[str, tuple[tuple[float, float], ...]]:
    """When each leg stands."""
    found: dict[str, list[tuple[float, float]]] = {leg: [] for leg in LEGS}
    for phase in plan.phases:
        for leg in phase.support:
            spans = found[leg]
            if spans and spans[-1][1] >= phase.start - 1e-9:
                spans[-1] = (spans[-1][0], phase.end)
            else:
                spans.append((phase.start, phase.end))
    return {leg: tuple(s for s in spans if s[1] > s[0]) for leg, spans in found.items()}


def _margin(plan: Plan, motion: Trajectory) -> tuple[str, FloatArray]:
    """What the margin is of, and the margin at each sample ``(N,)`` [m]."""
    if plan.settings.static:
        if not getattr(plan.settings, "true_com", False):
            return "body centre", margins_over(motion, motion.cog)
        return "centre of mass", margins_over(motion, true_com(plan.robot, motion.q))
    if not plan.robot.mass > 0.0:
        return "body centre", margins_over(motion, motion.cog)
    moved = motion_of_path(plan.robot, *(plan.path.evaluate(motion.t, k) for k in range(3)))
    count = np.maximum(motion.contacts.sum(axis=1), 1)
    heights = np.where(motion.contacts, motion.feet[..., 2], 0.0).sum(axis=1) / count
    zmp = whole_body_zmp(plan.robot.model, *moved, heights - plan.robot.foot_radius)
    found = margins_over(motion, np.nan_to_num(zmp, nan=np.inf))
    found = np.where(motion.contacts.sum(axis=1) == 2, -_off_the_line(motion, zmp), found)
    return "ZMP", np.where(np.isfinite(found), found, np.nan)


def _off_the_line(motion: Trajectory, points: FloatArray) -> FloatArray:
    """Distances of ``points (N, 2)`` from the line between the two feet that stand ``(N,)`` [m].

    Of samples with another number of feet they mean nothing.
    """
    order = np.argsort(~motion.contacts, axis=1, kind="stable")[:, :2]
    rows = np.arange(len(motion))
    start, end = (motion.feet[rows, order[:, i], :2] for i in range(2))
    along = end - start
    length = np.maximum((along**2).sum(axis=1), 1e-12)
    part = np.clip(((points - start) * along).sum(axis=1) / length, 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - part[:, None] * along, axis=1))


def _forces(
    plan: Plan, times: FloatArray
) -> tuple[FloatArray | None, FloatArray | None, tuple[str, ...]]:
    """Torques as shares, pressing forces [N], and what is left out."""
    if not plan.robot.mass > 0.0:
        return None, None, ("no torques and forces: the robot's file has no masses",)
    found = contact_forces(plan, times=times)
    torque: FloatArray | None = found.torque_use
    notes: tuple[str, ...] = ()
    if len(found.unlimited) == len(found.joint_names):
        torque, notes = None, ("no torques: their limits are not known",)
    return torque, found.forces[..., 2], notes
