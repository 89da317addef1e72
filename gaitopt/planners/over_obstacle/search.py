"""The search for a walk that comes nowhere too near to an obstacle.

First guesses put the feet as near to the obstacle as the margin allows. Where a part of the robot
would then come too near to it, that foot is set farther away, or the foot that flies goes higher;
where the true centre of mass would leave the support, postures take a larger margin. All that is
bounded: what does not come to rest after so many rounds is refused.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, leg_index
from gaitopt.errors import StrideFault
from gaitopt.plan.settings.over_obstacle import StrideSettings
from gaitopt.planners.over_obstacle.clearance import Surroundings
from gaitopt.planners.over_obstacle.layout import first_gaps
from gaitopt.planners.over_obstacle.route import Demand, StrideRoute, make_route
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_quaternion
from gaitopt.robots.whole_body import feet_from_joints, joints_from_feet
from gaitopt.stability.margins import static_stability_margin
from gaitopt.terrain.obstacles import Obstacle

ROOM = 0.015
"""Room beyond the margin at first, in which a flown path may be laid farther out [m]."""
RESERVE = 2e-3
"""What the first look asks for on top of clearance, since it looks at few samples [m]."""
MARGIN_RESERVE = 2e-6
FARTHER = 1.3
"""How much farther a foot is set away than its leg is too near, at first: a leg that leans more
gains less."""
BODY_RESERVE = 3e-3
"""Least margin of the true centre of mass at the samples [m]."""
ROUNDS = 12
MOVE_SAMPLES = 5


def find_route(
    robot: Quadruped,
    obstacle: Obstacle,
    settings: StrideSettings,
    around: Surroundings,
    demand: Demand | None = None,
) -> StrideRoute:
    """A walk that comes nowhere too near to the obstacle, at the places that are looked at.

    Args:
        robot: the robot.
        obstacle: what is in the way.
        settings: what was asked.
        around: the robot's shapes and the obstacle.
        demand: to start with; the least one by default.

    Raises:
        StrideFault: there is none, or none was found within so many rounds.
    """
    wanted = demand or first_demand(robot, obstacle, settings)
    for k in range(ROUNDS):
        route = make_route(robot, obstacle, settings, wanted)
        values, owners = looks(route)
        wider = widened(route, around, values, FARTHER + 0.3 * k)
        if wider != wanted:
            wanted = wider
            continue
        short = BODY_RESERVE - body_margin(route, values, owners)
        if short <= 0.0:
            return route
        wanted = wanted._replace(margin=wanted.margin + short + 1e-3)
    raise StrideFault(
        f"footholds beside the obstacle were not found within {ROUNDS} rounds", cause="obstacle"
    )


def first_demand(robot: Quadruped, obstacle: Obstacle, settings: StrideSettings) -> Demand:
    """The least that can do: the feet at the margin, and the foot alone over the obstacle."""
    missing = settings.swing_height - obstacle.height - settings.margin
    return Demand(
        first_gaps(settings, robot, ROOM), max(missing, 0.0),
        settings.stability_margin + MARGIN_RESERVE,
    )  # fmt: skip


def looks(route: StrideRoute) -> tuple[FloatArray, np.ndarray]:
    """Path values ``(N, 6 + nj)`` at samples of all moves and swings, and each one's step ``(N,)``.

    Steps are counted from 0; samples of the body's move before a step are told apart by
    ``-1 - step``.

    Raises:
        StrideFault: a foot is out of reach somewhere.
    """
    bases, feet, owners = [], [], []
    before = route.start.base(route.robot)
    share = np.linspace(0.0, 1.0, MOVE_SAMPLES)[:, None]
    for k, step in enumerate(route.steps):
        here = step.pose.base(route.robot)
        bases.append(before + share * (here - before))
        feet.append(np.broadcast_to(step.feet, (MOVE_SAMPLES, 4, 3)))
        owners.append(np.full(MOVE_SAMPLES, -1 - k))
        way = route.waypoints(step)
        flying = np.broadcast_to(step.feet, (len(way), 4, 3)).copy()
        flying[:, leg_index(step.leg)] = way
        bases.append(np.broadcast_to(here, (len(way), 6)))
        feet.append(flying)
        owners.append(np.full(len(way), k))
        before = here
    base, places, owner = np.concatenate(bases), np.concatenate(feet), np.concatenate(owners)
    joints, reached = joints_from_feet(
        route.robot, base[:, :3], base[:, 3:], places, on_unreachable="mask"
    )
    if not reached.all():
        k, leg = (int(v) for v in np.argwhere(~reached)[0])
        number = int(owner[k]) if owner[k] >= 0 else -1 - int(owner[k])
        raise StrideFault(
            f"step {number}: foot {LEGS[leg]} is out of reach on the way", LEGS[leg], number
        )
    return np.concatenate([base, joints], axis=1), owner


def widened(
    route: StrideRoute, around: Surroundings, values: FloatArray, gain: float = FARTHER
) -> Demand:
    """The demand that gives more room to all legs that come too near; the same when none does.

    A foot that stands beside the obstacle is blamed for its leg, and set farther away; a foot
    above it goes higher.

    Args:
        route: the walk as it is.
        around: the robot's shapes and the obstacle.
        values: of the path, to look at ``(N, 6 + nj)``.
        gain: how much more room is given than is missing.

    Raises:
        StrideFault: it is the body, whose room is its height.
    """
    found = around.distances(values)
    wanted = route.settings.clearance + RESERVE
    demand = route.demand
    low, high = route.obstacle.extent
    for owner in sorted(set(around.owners)):
        mine = found[:, [k for k, leg in enumerate(around.owners) if leg == owner]].min(axis=1)
        near = np.flatnonzero(mine < wanted)
        if not near.size:
            continue
        if not owner:
            raise StrideFault(
                f"the body would come within {mine.min():.3g} m of the obstacle", cause="body"
            )
        feet = feet_from_joints(route.robot, values[near, :3], values[near, 3:6], values[near, 6:])[
            :, leg_index(owner)
        ]
        across = route.obstacle.to_local(feet)[:, 0]
        for side in (across <= low, across >= high, (across > low) & (across < high)):
            if side.any():
                by = gain * float(wanted - mine[near][side].min()) + 1e-3
                demand = demand.widened(owner, float(across[side][0]), (low, high), by)
    return demand


def body_margin(route: StrideRoute, values: FloatArray, owners: np.ndarray) -> float:
    """Least margin of the true centre of mass at the samples [m]."""
    import pinocchio as pin

    model = route.robot.model
    data = model.createData()
    q = np.concatenate([values[:, :3], rpy_to_quaternion(values[:, 3:6]), values[:, 6:]], axis=1)
    centres = np.array([pin.centerOfMass(model, data, one).copy() for one in q])
    least = np.inf
    for k, step in enumerate(route.steps):
        stand = [i for i, leg in enumerate(LEGS) if leg != step.leg]
        for mine, feet in ((owners == k, step.feet[stand]), (owners == -1 - k, step.feet)):
            least = min(least, float(static_stability_margin(feet, centres[mine]).min()))
    return least
