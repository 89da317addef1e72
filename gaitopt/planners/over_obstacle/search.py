"""The search for a walk of which no part comes too near to an obstacle.

The first round puts the feet as near to the obstacle as the margin allows. Where a part of the
robot comes too near to the obstacle, the next round sets that part's foot farther away, or lets a
flying foot go higher; where the true centre of mass has too little margin, postures get a larger
one. The number of rounds is limited.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, leg_index
from gaitopt.errors import StrideFault
from gaitopt.plan.settings.over_obstacle import StrideSettings
from gaitopt.planners.over_obstacle.approach import Stand
from gaitopt.planners.over_obstacle.clearance import Surroundings
from gaitopt.planners.over_obstacle.layout import first_gaps
from gaitopt.planners.over_obstacle.route import Demand, StrideRoute, make_route
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import configuration, feet_from_joints, joints_from_feet
from gaitopt.stability.margins import static_stability_margin
from gaitopt.terrain.obstacles import Obstacle

GAP_RESERVE = 0.015
"""By how much the first gaps exceed the margin [m], so that a path may be laid farther out."""
CLEARANCE_RESERVE = 2e-3
"""Additional clearance at the samples of the search [m], which are few."""
MARGIN_RESERVE = 2e-6
"""Additional stability margin [m], so that timing and rounding do not break the one that is set."""
GAIN = 1.3
"""Factor on the missing clearance by which a foot is set away in the first round: a leg that is
more inclined gains less clearance than its foot gains distance."""
GAIN_GROWTH = 0.3
"""By how much this factor grows from round to round."""
LEAST_CHANGE = 1e-3
"""Added to every change of a demand [m], so that rounds make progress."""
BODY_RESERVE = 3e-3
"""Least margin of the true centre of mass at the samples [m]."""
ROUNDS = 12
"""Most rounds; chosen here."""
MOVE_SAMPLES = 5
"""Samples of each move of the body."""


def find_route(
    robot: Quadruped,
    obstacle: Obstacle,
    settings: StrideSettings,
    around: Surroundings,
    demand: Demand | None = None,
    stand: Stand | None = None,
) -> StrideRoute:
    """A walk that keeps its clearance at all samples.

    Args:
        robot: the robot.
        obstacle: the obstacle.
        settings: of the walk.
        around: the robot's shapes and the obstacle.
        demand: of the first round; the least one by default.
        stand: where the robot stands before; by default where the walk itself begins.

    Raises:
        StrideFault: a posture is impossible, or no walk was found within :data:`ROUNDS`.
    """
    wanted = demand or first_demand(robot, obstacle, settings)
    for k in range(ROUNDS):
        route = make_route(robot, obstacle, settings, wanted, stand)
        values, owners = sample(route)
        wider = widened(route, around, values, GAIN + GAIN_GROWTH * k)
        if wider != wanted:
            wanted = wider
            continue
        short = BODY_RESERVE - body_margin(route, values, owners)
        if short <= 0.0:
            return route
        wanted = wanted._replace(margin=wanted.margin + short + LEAST_CHANGE)
    raise StrideFault(
        f"footholds beside the obstacle were not found within {ROUNDS} rounds", cause="obstacle"
    )


def first_demand(robot: Quadruped, obstacle: Obstacle, settings: StrideSettings) -> Demand:
    """The least demand: feet at the margin, and paths over the obstacle without a lift for legs."""
    missing = settings.swing_height - obstacle.height - settings.margin
    return Demand(
        first_gaps(settings, robot, GAP_RESERVE), max(missing, 0.0),
        settings.stability_margin + MARGIN_RESERVE,
    )  # fmt: skip


def sample(route: StrideRoute) -> tuple[FloatArray, np.ndarray]:
    """Path values ``(N, 6 + nj)`` at samples of all moves and swings, and their steps ``(N,)``.

    A sample of a swing has the index of its step, from 0; a sample of the body's move before that
    step has ``-1 - step``.

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
    route: StrideRoute, around: Surroundings, values: FloatArray, gain: float = GAIN
) -> Demand:
    """The demand with larger distances for all legs that come too near; the same when none does.

    Where any part of a leg is too near, its foot is set farther away from the obstacle, or lifted
    when it is above it.

    Args:
        route: the walk.
        around: the robot's shapes and the obstacle.
        values: columns of a path at samples ``(N, 6 + nj)``.
        gain: factor on the missing clearance.

    Raises:
        StrideFault: the body comes too near, which only another body height can change.
    """
    found = around.distances(values)
    wanted = route.settings.clearance + CLEARANCE_RESERVE
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
                by = gain * float(wanted - mine[near][side].min()) + LEAST_CHANGE
                demand = demand.widened(owner, float(across[side][0]), (low, high), by)
    return demand


def body_margin(route: StrideRoute, values: FloatArray, owners: np.ndarray) -> float:
    """Least static margin of the true centre of mass at samples of :func:`sample` [m]."""
    import pinocchio as pin

    model = route.robot.model
    data = model.createData()
    q = configuration(route.robot, values[:, :3], values[:, 3:6], values[:, 6:])
    centres = np.array([pin.centerOfMass(model, data, one).copy() for one in q])
    least = np.inf
    for k, step in enumerate(route.steps):
        stand = [i for i, leg in enumerate(LEGS) if leg != step.leg]
        for mine, feet in ((owners == k, step.feet[stand]), (owners == -1 - k, step.feet)):
            least = min(least, float(static_stability_margin(feet, centres[mine]).min()))
    return least
