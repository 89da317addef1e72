"""``plan_stride``: up to an obstacle, over it with one leg after another, and on.

Source: [Shao2011]. The body moves on four feet to where the posture optimisation puts
it (Section IV), then one foot flies while the body stands still: over the obstacle by the fastest
joint spline (Section III), over open ground by a plain swing.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gaitopt.conventions import Progress
from gaitopt.errors import InfeasibleStepError, InputError, SolverError, StrideFault
from gaitopt.motion.pieces import joined
from gaitopt.optimize.posture.solver import solve_posture
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import StrideRecord
from gaitopt.plan.settings.keywords import chosen_settings, takes_settings
from gaitopt.plan.settings.over_obstacle import BODY_HEIGHTS, StrideSettings
from gaitopt.planners.over_obstacle.assembly import (
    Piece,
    energy_margin,
    foot_margin,
    pieces_of,
    plan_of,
)
from gaitopt.planners.over_obstacle.clearance import Approach, Surroundings
from gaitopt.planners.over_obstacle.layout import Gaps
from gaitopt.planners.over_obstacle.route import Demand, StrideRoute
from gaitopt.planners.over_obstacle.search import find_route, widened
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.obstacles import Obstacle

ROUNDS = 6
FOOT_TOLERANCE = 2e-5
"""What the proof of the feet's margin may fall short by [m]: it is so fine."""
HALVINGS = 5
"""Bisections for the largest obstacle: it is found to a thirtieth of the one asked for."""


@takes_settings(StrideSettings)
def plan_stride(
    robot: Quadruped,
    obstacle: Obstacle,
    settings: StrideSettings | None = None,
    *,
    progress: Progress | None = None,
    **options: Any,
) -> Plan:
    """Plan a statically stable walk over an obstacle that lies across the way.

    The robot walks along the obstacle's x axis on the level ground that the obstacle stands on, and
    begins in front of it. The planner chooses the footholds: each pair of feet strides over the
    obstacle in one cycle, from as near before it to as near behind it as no part of the robot comes
    within ``clearance`` of it. That is checked with the URDF's collision shapes at every instant;
    where these are meshes, lines along the legs stand for them.

    Args:
        robot: from :func:`gaitopt.load_robot`; legs with or without roll joint.
        obstacle: from :func:`gaitopt.rectangular_obstacle`, for instance.
        settings: all settings as one object; its heading and obstacles become this obstacle's. By
            default they fit the robot, and the body is as high as the highest of a few heights,
            from 0.9 to 0.7 of the legs' reach, with which it works.
        progress: called with (steps done, steps in all).
        options: single settings by name: the fields of :class:`gaitopt.StrideSettings`;
            ``acceleration_limit`` and ``jerk_limit`` may be one number, or one for each joint of
            a leg from body to foot.

    Returns:
        The plan. Its record holds ``clearance``, the distance that no part of the robot falls
        short of [m]; ``foot_margin``, the same of the feet's balls on their way over it [m];
        ``energy_margin``, the least energy that tips the robot while a foot flies
        [J]; and the gaps between the obstacle and the feet beside it [m].

    Raises:
        InputError: a setting is unknown or out of range, or a joint has no velocity limit.
        InfeasibleStepError: no such walk was found; says how large an obstacle would do.
    """
    _check(robot, obstacle)
    this = {"heading": obstacle.yaw, "obstacles": (obstacle,)}
    taken = sorted(this.keys() & options.keys())
    if taken:
        raise InputError(f"plan_stride takes {taken[0]} from the obstacle; leave it out")
    chosen = chosen_settings(StrideSettings, robot, settings, {**options, **this})
    tries = [chosen]
    if settings is None and options.get("body_height") is None:
        reach = float(np.mean([leg.reach for leg in robot.legs.values()]))
        tries = [replace(chosen, body_height=share * reach) for share in BODY_HEIGHTS]
    return _planned(robot, obstacle, tries, progress)


def _planned(
    robot: Quadruped, obstacle: Obstacle, tries: list[StrideSettings], progress: Progress | None
) -> Plan:
    around = Surroundings.of(robot, obstacle)
    faults: list[StrideFault] = []
    for settings in tries:
        try:
            return _attempt(robot, obstacle, settings, around, progress)
        except StrideFault as fault:
            faults.append(fault)
    raise _refusal(robot, obstacle, tries, faults[0])


def _attempt(
    robot: Quadruped,
    obstacle: Obstacle,
    settings: StrideSettings,
    around: Surroundings,
    progress: Progress | None,
) -> Plan:
    """A plan that is clear of the obstacle at every instant.

    Raises:
        StrideFault: none was found.
    """
    demand: Demand | None = None
    for _ in range(ROUNDS):
        route = find_route(robot, obstacle, settings, around, demand)
        try:
            pieces = pieces_of(route, progress)
        except (InputError, SolverError) as error:
            # Another height of the body may do, or a smaller obstacle.
            raise StrideFault(str(error), cause="swing") from error
        path = joined([piece.path for piece in pieces if piece.path is not None])
        closest = around.along(path, settings.clearance)
        foot = foot_margin(route, pieces)
        if closest.proven < settings.clearance:
            demand = _roomier(route, around, pieces, closest)
        elif foot < settings.margin - FOOT_TOLERANCE:
            more = settings.margin - foot + FOOT_TOLERANCE
            gaps = Gaps(*(gap + more for gap in route.demand.gaps))
            demand = route.demand._replace(foot=route.demand.foot + more, gaps=gaps)
        else:
            return plan_of(route, pieces, _record(route, around, closest, foot))
    raise StrideFault(
        f"leg {closest.seen.leg or 'none, the body'} comes within {closest.proven:.4g} m of the "
        f"obstacle after {ROUNDS} rounds",
        closest.seen.leg, cause="obstacle",
    )  # fmt: skip


def _roomier(
    route: StrideRoute, around: Surroundings, pieces: list[Piece], closest: Approach
) -> Demand:
    """More room where timed motions come too near, by the samples of each piece."""
    samples = [
        piece.path.evaluate(np.linspace(0.0, piece.path.duration, 41))
        for piece in pieces if piece.path is not None
    ]  # fmt: skip
    demand = widened(route, around, np.concatenate(samples))
    if demand != route.demand:
        return demand
    # Between the samples: a little more everywhere.
    more = route.settings.clearance - closest.proven + 1e-3
    return demand._replace(gaps=Gaps(*(gap + more for gap in demand.gaps)), lift=demand.lift + more)


def _record(
    route: StrideRoute, around: Surroundings, closest: Approach, foot: float
) -> StrideRecord:
    gaps = {f"gap_{name}": float(gap) for name, gap in route.demand.gaps._asdict().items()}
    return StrideRecord(
        stability="static margin of the body centre, on the horizontal projection",
        clearance=float(closest.proven),
        foot_margin=float(foot),
        energy_margin=energy_margin(route),
        nearest=f"{closest.seen.shape} at {closest.time:.2f} s",
        lines_for_meshes=", ".join(around.stand_ins) or None,
        **gaps,
    )


# --- refusals ---------------------------------------------------------------------------------


def _refusal(
    robot: Quadruped, obstacle: Obstacle, tries: list[StrideSettings], fault: StrideFault
) -> InfeasibleStepError:
    """The error that tells the largest obstacle that would do."""
    # The strides alone decide, and every second height of the body is near enough to the others.
    few = [replace(settings, approach=0, leave=0) for settings in tries[::2]]
    lower = _largest(robot, few, lambda share: scaled(obstacle, height=share))
    narrower = None
    if lower is None:
        narrower = _largest(robot, few, lambda share: scaled(obstacle, width=share))
    best = lower or narrower
    if best is not None:
        way = (
            f"; with these settings it gets over one {best.height:.3g} m high and "
            f"{best.width:.3g} m wide"
        )
    else:
        way = (
            "; neither a lower nor a narrower one will do: lessen margin, stability_margin or "
            "clearance, or give another body_height"
        )
    largest = None
    if fault.posture is not None:
        found = solve_posture(fault.posture.problem.largest_margin())
        largest = found.margin if found.solved else None
    return InfeasibleStepError(
        f"{robot.name} does not get over this obstacle: {fault}{way}",
        step=fault.step, leg=fault.leg, conflicts=(fault.cause,),
        margin=tries[0].stability_margin, largest_margin=largest,
        reach_fraction=tries[0].reach_fraction,
    )  # fmt: skip


def _largest(
    robot: Quadruped, tries: list[StrideSettings], sized: Callable[[float], Obstacle]
) -> Obstacle | None:
    """The largest obstacle that works, by bisection over its share of the one asked for.

    Postures and footholds decide; what they allow is then planned in full, and made smaller when
    that fails. ``None`` when a 32nd does not do.
    """
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if _works(robot, sized(middle), tries) else (low, middle)
    for share in (low, 0.95 * low, 0.9 * low):
        if share and _works(robot, sized(share), tries, in_full=True):
            return sized(share)
    return None


def _works(
    robot: Quadruped, obstacle: Obstacle, tries: list[StrideSettings], *, in_full: bool = False
) -> bool:
    """Whether postures and footholds are found at any of the heights, or a plan in full."""
    around = Surroundings.of(robot, obstacle)
    for settings in tries:
        asked = replace(settings, obstacles=(obstacle,))
        try:
            if in_full:
                _attempt(robot, obstacle, asked, around, None)
            else:
                find_route(robot, obstacle, asked, around)
        except (StrideFault, InputError):
            continue
        return True
    return False


# --- what is asked ----------------------------------------------------------------------------


def _check(robot: object, obstacle: object) -> None:
    if not isinstance(robot, Quadruped) or not isinstance(obstacle, Obstacle):
        raise InputError(
            "plan_stride takes a Quadruped (from load_robot) and an Obstacle (rectangular_obstacle("
            f"0.11, 0.04), for instance), got {type(robot).__name__} and {type(obstacle).__name__}"
        )
    robot.require_velocity_limits()


def scaled(obstacle: Obstacle, height: float = 1.0, width: float = 1.0) -> Obstacle:
    """The obstacle with its section scaled; a round one by ``height`` in both directions."""
    if obstacle.shape == "round":
        width = height
    core = tuple((x * width, z * height) for x, z in obstacle.core)
    rounding = obstacle.rounding * min(height, width)
    try:
        return replace(obstacle, core=core, rounding=rounding)
    except InputError:
        return obstacle
