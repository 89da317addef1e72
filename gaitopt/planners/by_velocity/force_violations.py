"""Limits on contact forces and joint torques that a gait exceeds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.dynamics.contacts import LEAST_BALANCE_TOLERANCE, ForceLimits
from gaitopt.dynamics.forces import build_force_problem, solve_forces
from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.motion.path import MotionPath
from gaitopt.plan.load_transfer import most_normal_shares, stances
from gaitopt.planners.by_velocity.contacts import contacts_at, support_changes
from gaitopt.planners.by_velocity.limits import BALANCE, Violation
from gaitopt.planners.by_velocity.motion import GaitMotion
from gaitopt.retiming.reserves import MIDDLE_SHARE, SHARE_OF_WEIGHT, tightened

PLACES = (1e-6, 0.5, 1.0 - 1e-6)
"""Where forces are looked for on each segment of a path, as shares of its time: forces may jump at
its ends."""
PLACES_OF_TRANSFERS = (1e-6, *np.linspace(0.1, 0.9, 9).tolist(), 1.0 - 1e-6)
"""The same where largest forces grow with time. A trot of a1 whose feet take over the weight in
50 ms exceeded one by 0.3 % of the weight between fewer places."""
BALANCE_SHARE = 0.5
"""Share of the balance's tolerance that a plan may use at these instants; the rest is left for what
happens between them."""


def force_violations(motion: GaitMotion, path: MotionPath, limits: ForceLimits) -> list[Violation]:
    """The limit that forces and torques exceed most; nothing where they keep all of them.

    Args:
        motion: the gait.
        path: of the motion, without jumps of velocities.
        limits: that the plan promises.
    """
    robot = motion.robot
    lengths = np.diff(path.times)
    places = PLACES if limits.transfer_time == 0.0 else PLACES_OF_TRANSFERS
    times = (path.times[:-1, None] + lengths[:, None] * np.array(places)).ravel()
    moved = motion_of_path(robot, *(path.evaluate(times, k) for k in range(3)))
    asked = replace(
        tightened(limits, MIDDLE_SHARE),
        balance_tolerance=max(BALANCE_SHARE * limits.balance_tolerance, LEAST_BALANCE_TOLERANCE),
    )
    standing = contacts_at(motion.events, times)
    most = _largest_shares(motion, path, limits, times)
    found = solve_forces(build_force_problem(robot, moved, standing, asked, times=times, most=most))
    worst = found.worst()
    if worst is None:
        return []
    kind, whose = worst.kind.words, worst.name
    told = f"{kind} of {whose} is {worst.excess}"
    return [Violation(f"{kind} {whose}", 1.0 + worst.share, worst.time, told)]


def _largest_shares(
    motion: GaitMotion, path: MotionPath, limits: ForceLimits, times: FloatArray
) -> FloatArray:
    """Largest normal forces of feet that have landed or will lift off, as shares of the weight."""
    edges = np.unique(np.clip(support_changes(motion.events, path.duration), 0.0, path.duration))
    standing = contacts_at(motion.events, (edges[1:] + edges[:-1]) / 2.0)
    landed, lifted = stances(standing, edges[:-1], edges[1:])
    own = np.clip(np.searchsorted(edges, times, side="right") - 1, 0, len(standing) - 1)
    since, until = times[:, None] - landed[own], lifted[own] - times[:, None]
    return np.asarray(most_normal_shares(limits, since, until) - SHARE_OF_WEIGHT * MIDDLE_SHARE)


def no_path(motion: GaitMotion, time: float) -> Violation:
    """What is wrong with a gait for whose body no path has contact forces.

    Args:
        motion: the gait.
        time: where the last attempt missed most [s].
    """
    standing = contacts_at(motion.events, np.array([time]))[0]
    feet = " and ".join(leg for leg, stands in zip(LEGS, standing, strict=True) if stands)
    has = f"that has contact forces on {feet}" if feet else "on which the robot falls freely"
    return Violation(BALANCE, np.inf, time, f"no path of the body was found {has}")
