"""A plan's end in a given state: the body moves there, at rest, on the feet's last footholds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.entering.moving import moved
from gaitopt.entering.walking import forces_of
from gaitopt.errors import InfeasibleStateError, InputError
from gaitopt.inputs import check_kind
from gaitopt.motion.path import BASE_COLUMNS
from gaitopt.motion.pieces import joined
from gaitopt.plan.com_margin import margins_over, true_com
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.state import State
from gaitopt.robots.whole_body import feet_from_joints

STILL = 1e-6
"""Largest velocity of a state that counts as at rest [m/s, rad/s]."""
FULL_TURN = 2.0 * np.pi
"""[rad]."""
SAMPLES = 33
"""Instants at which the margin of the way to the end is looked at."""


def ended(plan: Plan, end: State) -> Plan:
    """The plan, with the body in the pose of a state in the end.

    It moves there in a straight line while all four feet stand, as fast as contact forces and
    joints allow.

    Args:
        plan: ends at rest on four feet.
        end: at rest on four feet, which are on their last footholds.

    Raises:
        InputError: this is no state, or that of another robot, or nothing is promised of forces.
        InfeasibleStateError: the robot moves in this state, a foot is elsewhere, or the way there
            exceeds a limit; names it.
    """
    check_kind("end", end, State)
    limits = forces_of(plan.settings, "end")
    if end.joint_names != plan.robot.joint_names:
        raise InputError(f"end is no state of {plan.robot.name}: its joints have other names")
    last = plan.footholds.after({leg: plan.footholds.counts[leg] - 1 for leg in LEGS}, ())
    _check_feet(plan, end)
    begin = plan.path.evaluate([plan.duration])[0, :BASE_COLUMNS]
    goal = np.array(end.columns[:BASE_COLUMNS])
    goal[5] += FULL_TURN * np.round((begin[5] - goal[5]) / FULL_TURN)
    accelerations = plan.settings.joint_accelerations(plan.robot)
    move = moved(plan.robot, last, begin, goal, limits, accelerations, "end")
    if move is None:
        return plan
    start = plan.duration
    path = joined([plan.path, move]) if start > 0.0 else move
    place = last[LEGS[0]][0]
    ends = replace(plan, path=path).at([start, path.duration]).cog
    phase = Phase("stance", "", len(plan.swings), start, path.duration - start, ends[0], ends[1],
                  LEGS, place, place, 0.0)  # fmt: skip
    found = replace(plan, phases=(*plan.phases, phase), path=path)
    return _with_margin(found)


def _check_feet(plan: Plan, end: State) -> None:
    """Refuse an end in which the robot moves, or does not stand on the last footholds.

    Raises:
        InfeasibleStateError: it does; names the leg and how far its foot is away.
    """
    speed = float(np.abs(end.v).max())
    if speed > STILL or end.support != LEGS:
        raise InfeasibleStateError(
            f"end: the robot has to rest on four feet, and moves at {speed:.3g} on "
            f"{len(end.support)}; State.standing makes such a state",
            "rest", speed, STILL, "m/s",
        )  # fmt: skip
    feet = feet_from_joints(plan.robot, end.q[:3], end.columns[3:6], end.q[7:])
    for i, leg in enumerate(LEGS):
        away = float(np.linalg.norm(feet[i] - plan.footholds[leg][-1]))
        if away > plan.footholds.landing_radius:
            raise InfeasibleStateError(
                f"end: foot {leg} is {1e3 * away:.1f} mm from its last foothold, at most "
                f"{1e3 * plan.footholds.landing_radius:.1f} mm are allowed; make the state for the "
                "last footholds, which are those of the plan without end",
                f"contact {leg}", away, plan.footholds.landing_radius, "m",
            )  # fmt: skip


def _with_margin(plan: Plan) -> Plan:
    """The plan with the margin of its last phase.

    Raises:
        InfeasibleStateError: it is less than the plan promises.
    """
    phase = plan.phases[-1]
    times = np.linspace(phase.start, phase.end, SAMPLES)
    motion = plan.at(times)
    point = true_com(plan.robot, motion.q) if plan.settings.true_com else motion.cog
    margin = float(margins_over(motion, point).min())
    promised = plan.settings.stability_margin if plan.settings.static else 0.0
    if margin < promised and len(plan.phases) > 1:
        raise InfeasibleStateError(
            f"end: the margin falls to {margin:.4f} m on the way there, and {promised:.4f} m are "
            "promised; end nearer to the middle of the feet",
            "support margin", margin, promised, "m", plan.duration,
        )  # fmt: skip
    return replace(plan, phases=(*plan.phases[:-1], replace(phase, margin=margin)))
