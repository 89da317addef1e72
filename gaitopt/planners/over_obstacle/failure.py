"""The error for an obstacle that is too large, with the largest one that is possible."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from gaitopt.errors import InfeasibleStepError, InputError, StrideFault
from gaitopt.optimize.posture.solver import solve_posture
from gaitopt.plan.settings.over_obstacle import StrideSettings
from gaitopt.planners.over_obstacle.attempt import attempt
from gaitopt.planners.over_obstacle.clearance import Surroundings
from gaitopt.planners.over_obstacle.search import find_route
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.obstacles import Obstacle

BISECTIONS = 5
"""Bisections for the largest possible obstacle: it is found to a 32nd of the given one."""
SAFE_SHARES = (1.0, 0.95, 0.9)
"""Shares of the obstacle for which footholds and postures exist that are then planned in full.
Chosen here: swings may need a little more distance than postures alone."""


def infeasible(
    robot: Quadruped, obstacle: Obstacle, candidates: list[StrideSettings], fault: StrideFault
) -> InfeasibleStepError:
    """The error for an obstacle that is too large, with the largest one that is possible."""
    # Cycles without obstacle do not matter here, and every second body height is precise enough.
    few = [replace(settings, approach=0, leave=0) for settings in candidates[::2]]
    best = _largest(robot, few, lambda share: scaled(obstacle, height=share))
    if best is None:
        best = _largest(robot, few, lambda share: scaled(obstacle, width=share))
    if best is not None:
        remedy = (
            f"with these settings it gets over one {best.height:.3g} m high and "
            f"{best.width:.3g} m wide"
        )
    else:
        remedy = (
            "neither a lower nor a narrower one is possible: reduce margin, stability_margin or "
            "clearance, or give another body_height"
        )
    if candidates[0].forces is not None:
        remedy += '; without contact forces more may be possible: timing="velocity"'
    largest = None
    if fault.posture is not None:
        found = solve_posture(fault.posture.problem.largest_margin())
        largest = found.margin if found.solved else None
    return InfeasibleStepError(
        f"{robot.name} does not get over this obstacle: {fault}; {remedy}",
        step=fault.step, leg=fault.leg, conflicts=(fault.cause,),
        margin=candidates[0].stability_margin, largest_margin=largest,
        reach_fraction=candidates[0].reach_fraction,
    )  # fmt: skip


def _largest(
    robot: Quadruped, candidates: list[StrideSettings], sized: Callable[[float], Obstacle]
) -> Obstacle | None:
    """The largest possible obstacle, by bisection.

    The bisection asks for footholds and postures only. The largest obstacle that has them is then
    planned in full, and made a little smaller where that fails.

    Args:
        robot, candidates: the robot, and settings to try.
        sized: gives the obstacle for a share, from 0 to 1, of its size.

    Returns:
        The obstacle; ``None`` where even a 32nd of it is too large.
    """
    low, high = 0.0, 1.0
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        if _is_possible(robot, sized(middle), candidates):
            low = middle
        else:
            high = middle
    # With contact forces one size only: a try in full takes seconds for each body height.
    shares = SAFE_SHARES if candidates[0].forces is None else SAFE_SHARES[-1:]
    for share in shares:
        size = share * low
        if size and _is_possible(robot, sized(size), candidates, in_full=True):
            return sized(size)
    return None


def _is_possible(
    robot: Quadruped, obstacle: Obstacle, candidates: list[StrideSettings], *, in_full: bool = False
) -> bool:
    """Whether any of the settings gives footholds and postures, or, ``in_full``, a plan."""
    around = Surroundings.of(robot, obstacle)
    for settings in candidates:
        asked = replace(settings, obstacles=(obstacle,))
        try:
            if in_full:
                attempt(robot, obstacle, asked, around, None)
            else:
                find_route(robot, obstacle, asked, around)
        except (StrideFault, InputError):
            continue
        return True
    return False


def scaled(obstacle: Obstacle, height: float = 1.0, width: float = 1.0) -> Obstacle:
    """The obstacle with its section scaled by two factors; a round one by ``height`` alone.

    An obstacle whose section would be too small is returned unchanged.
    """
    if obstacle.shape == "round":
        width = height
    core = tuple((x * width, z * height) for x, z in obstacle.core)
    rounding = obstacle.rounding * min(height, width)
    try:
        return replace(obstacle, core=core, rounding=rounding)
    except InputError:
        return obstacle
