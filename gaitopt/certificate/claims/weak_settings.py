"""Settings that say so little that checks mean nothing: with them no plan is certified.

A check holds a plan against what its settings promise. So a plan whose settings promise almost
nothing would pass. Each such setting is told, as a check that could not be made.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np

from gaitopt.certificate.check import Check, unchecked
from gaitopt.conventions import GRAVITY, LEGS, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.torque_limits import effort_limits
from gaitopt.plan.plan import Plan
from gaitopt.robots.files.joint_limits import PLACEHOLDER_VELOCITY
from gaitopt.robots.quadruped import Quadruped

MOST_FRICTION: Final = 1.5
"""Largest coefficient of friction that is believed. Chosen: rubber on dry concrete has about 1."""
LEAST_RESERVE: Final = 0.005
"""Least reserve that counts as one, as a share of the weight. Chosen: a quarter of the default."""
MOST_UNBALANCED: Final = 0.01
"""Largest moment about the line between two feet that counts as none, as a share of the weight
times half the stance's length. Chosen: ten times the default, 2 mm beside the line for a stance of
0.4 m, which is less than the radius of a foot."""
LEAST_LENGTH: Final = 1e-3
"""Least stability margin and swing height that count [m]. Chosen: what the ground is known to."""
MOST_LANDING: Final = 0.25
"""Largest radius of a column as a share of a leg's reach: on a larger one a foot may land a good
part of a step away from its foothold."""
MOST_FOOT: Final = 0.25
"""Largest radius of a foot as a share of a leg's reach: what lies within the foot's ball is not
held against the ground. Robots' feet have up to 0.08 of it, and wheels that are locked 0.2."""
MOST_TORQUE: Final = 3.0
"""Largest effort limit that is believed, as a share of the robot's weight times the reach of its
longest leg: it is at most 0.75 for robots with real limits."""
SHOWN: Final = 4
"""Most joints that a message names."""


def weak_settings(plan: Plan, judged: Sequence[ForceLimits]) -> list[Check]:
    """Checks that could not be made, each with what is missing.

    Args:
        plan: the plan.
        judged: limits within which contact forces are looked for.
    """
    weak = [*_of_the_plan(plan), *(text for limits in judged for text in _of_forces(limits))]
    found = [unchecked("settings", "", f"too weak to certify: {'; '.join(weak)}")] if weak else []
    robot = plan.robot
    fast = _beyond(robot, robot.velocity_limits, PLACEHOLDER_VELOCITY)
    if fast:
        found.append(unchecked("velocity limits", "rad/s", _unknown("velocity", fast)))
    reach = max(leg.reach for leg in robot.legs.values())
    strong = _beyond(robot, effort_limits(robot).limits, MOST_TORQUE * robot.mass * GRAVITY * reach)
    if judged and strong:
        found.append(unchecked("joint torques", "N m", _unknown("effort", strong)))
    return found


def _beyond(robot: Quadruped, limits: FloatArray, most: float) -> list[str]:
    """Names of the joints whose limit is not below the largest one that is believed."""
    return [name for name, limit in zip(robot.joint_names, limits, strict=True) if not limit < most]


def _of_the_plan(plan: Plan) -> Iterator[str]:
    settings, claimed = plan.settings, plan.record.zmp_margin
    reach = min(leg.reach for leg in plan.robot.legs.values())
    if not plan.footholds.landing_radius <= MOST_LANDING * reach:
        yield (
            f"feet may land {plan.footholds.landing_radius:g} m from their footholds, more than "
            f"{MOST_LANDING:g} of the reach of a leg"
        )
    if not plan.robot.foot_radius <= MOST_FOOT * reach:
        yield (
            f"feet are balls of {plan.robot.foot_radius:g} m, more than {MOST_FOOT:g} of the reach "
            "of a leg"
        )
    slippery = plan.footholds.friction or {}
    friction = max((float(each.max(initial=0.0)) for each in slippery.values()), default=0.0)
    if not friction <= MOST_FRICTION:
        yield f"a foothold's friction of {friction:g} is more than {MOST_FRICTION:g}"
    if settings.static and not settings.stability_margin >= LEAST_LENGTH:
        yield f"a stability margin of {settings.stability_margin:g} m is less than {LEAST_LENGTH:g}"
    height = _least_swing_height(plan)
    if plan.swings and not height >= LEAST_LENGTH:
        yield f"a swing height of {height:g} m is less than {LEAST_LENGTH:g}"
    if settings.promised_forces is not None:
        return
    if settings.zmp_margin is None and isinstance(claimed, (int, float)) and not claimed > 0.0:
        yield (
            f"the ZMP's margin of {claimed:g} m is the plan's own statement, and says that the ZMP "
            "leaves the support"
        )


def _least_swing_height(plan: Plan) -> float:
    """The least height that any swing was asked to rise [m]."""
    own = plan.footholds.swing_heights
    if own is None:
        return plan.settings.swing_height
    return min((float(each.min()) for each in own.values() if len(each)), default=np.inf)


def _of_forces(limits: ForceLimits) -> Iterator[str]:
    if not limits.friction <= MOST_FRICTION:
        yield f"a friction of {limits.friction:g} is more than {MOST_FRICTION:g}"
    tolerance = limits.balance_tolerance
    if not tolerance <= MOST_UNBALANCED:
        yield f"a balance tolerance of {tolerance:g} is more than {MOST_UNBALANCED:g}"
    on_four = float(limits.least_normal_shares(np.ones(len(LEGS), dtype=np.bool_))[0])
    for name, reserve, least in (
        ("reserve", limits.reserve, LEAST_RESERVE),
        ("reserve on four feet", on_four, LEAST_RESERVE / 2.0),
    ):
        if not reserve >= least:
            yield f"a {name} of {reserve:g} of the weight is less than {least:g}"


def _unknown(kind: str, names: Sequence[str]) -> str:
    more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
    return (
        f"none is known of {', '.join(names[:SHOWN])}{more}: the URDF states none, or one so large "
        f"that it must be a placeholder; load the robot with {kind}_limits="
    )
