"""``plan_stride``: plan a walk up to an obstacle, over it with one leg after another, and on.

Source: [Shao2011]. Before each swing the body moves on four feet to the pose that the posture
optimisation finds (Section IV). Then one foot swings while the body stands still: over the obstacle
along the fastest joint spline (Section III), over open ground along a simple swing curve.
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
from gaitopt.plan.settings.base import FORCES
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
from gaitopt.retiming.retimed import retimed
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.obstacles import Obstacle

ROUNDS = 6
"""How often a walk is timed, each time with larger distances from the obstacle. Measured: four
walks of three robots needed one. Each further round adds at least what was missing."""
FOOT_TOLERANCE = 2e-5
"""By how much the proven margin of the feet may be below the one that is asked for [m]: the
precision of that proof."""
RESERVE = 1e-3
"""Distance that is asked for beyond what is missing [m]. Chosen here: a millimetre, so that the
next round does not end just below the limit again."""
SAMPLES = 41
"""Instants of each move and swing at which distances are measured, to find which leg is too near.
Chosen here: a fortieth of a swing apart; what they miss, the next round finds."""
BISECTIONS = 5
"""Bisections for the largest possible obstacle: it is found to a 32nd of the given one."""
MARGINS = (1.0, 1.5, 2.0)
"""Stability margins that are tried with contact forces, as multiples of the usual one, where none
is given: the true centre of mass may be nearer to a side of the support than the body centre."""
SAFE_SHARES = (1.0, 0.95, 0.9)
"""Shares of the obstacle for which footholds and postures exist that are then planned in full.
Chosen here: swings may need a little more distance than postures alone."""


@takes_settings(StrideSettings)
def plan_stride(
    robot: Quadruped,
    obstacle: Obstacle,
    settings: StrideSettings | None = None,
    *,
    progress: Progress | None = None,
    **options: Any,
) -> Plan:
    """Plan a statically stable walk over an obstacle.

    The robot walks along the obstacle's x axis on the level ground that the obstacle stands on, and
    begins in front of it. The planner chooses the footholds: each pair of feet strides over the
    obstacle in one cycle, and stands before and behind it as near as ``clearance`` allows. The
    distance of all parts of the robot from the obstacle is checked at every instant with the
    collision shapes of the URDF; where these are meshes, lines along the legs replace them.

    Args:
        robot: from :func:`gaitopt.load_robot`; legs with or without roll joint.
        obstacle: from :func:`gaitopt.rectangular_obstacle`, for instance.
        settings: all settings as one object; heading and obstacles in it are replaced by those of
            this obstacle. By default they fit the robot, and the body height is the largest of a
            few heights, from 0.9 to 0.7 of the legs' reach, at which the walk is possible.
        progress: called with (steps done, steps in all).
        options: single settings by name: the fields of :class:`gaitopt.StrideSettings`;
            ``acceleration_limit`` and ``jerk_limit`` may be one number, or one for each joint of
            a leg from body to foot.

    With ``timing="forces"``, the default, the walk is as fast as contact forces and joint torques
    allow (:func:`gaitopt.retimed`). Where no margin is given and a foot presses too little, larger
    ones are tried.

    Returns:
        The plan. Its record holds ``clearance``, the least distance of any part of the robot from
        the obstacle [m]; ``foot_margin``, that of the balls of the feet during their swings over it
        [m]; ``energy_margin``, the least energy that tips the robot during a swing [J]; and the
        distances between the obstacle and the feet that stand beside it [m].

    Raises:
        InputError: a setting is unknown or out of range, a joint has no velocity limit, or with
            ``timing="forces"`` the robot has no mass or a jerk limit is given.
        InfeasibleStepError: no such walk was found; names the largest obstacle that is possible.
    """
    _check_kinds(robot, obstacle)
    this = {"heading": obstacle.yaw, "obstacles": (obstacle,)}
    taken = sorted(this.keys() & options.keys())
    if taken:
        raise InputError(f"plan_stride takes {taken[0]} from the obstacle; leave it out")
    chosen = chosen_settings(StrideSettings, robot, settings, {**options, **this})
    if chosen.forces is not None:
        _check_forces(robot, chosen)
    candidates = [chosen]
    if settings is None and options.get("body_height") is None:
        reach = float(np.mean([leg.reach for leg in robot.legs.values()]))
        candidates = [replace(chosen, body_height=share * reach) for share in BODY_HEIGHTS]
    margin_is_open = settings is None and options.get("stability_margin") is None
    margins = MARGINS if margin_is_open and chosen.forces is not None else MARGINS[:1]
    return _first_plan(robot, obstacle, candidates, margins, progress)


def _check_forces(robot: Quadruped, settings: StrideSettings) -> None:
    """Refuse what cannot be had with contact forces.

    Raises:
        InputError: the robot has no mass, or a jerk limit is given.
    """
    robot.require_masses()
    if settings.jerk_limit is not None:
        raise InputError(
            "a jerk limit is not kept where contact forces set the timing: leave jerk_limit out, "
            'or take timing="velocity"'
        )


def _first_plan(
    robot: Quadruped,
    obstacle: Obstacle,
    candidates: list[StrideSettings],
    margins: tuple[float, ...],
    progress: Progress | None,
) -> Plan:
    """The plan with the first of some settings with which one is found.

    Args:
        robot, obstacle, progress: as in :func:`plan_stride`.
        candidates: the settings.
        margins: multiples of their stability margin that are tried in turn where nothing but
            contact forces is missing.

    Raises:
        InfeasibleStepError: none is; the error is that of the first settings that only lack
            forces, or else of the first ones.
    """
    around = Surroundings.of(robot, obstacle)
    faults: list[StrideFault] = []
    for settings in candidates:
        for share in margins:
            wider = replace(settings, stability_margin=share * settings.stability_margin)
            try:
                return _attempt(robot, obstacle, wider, around, progress)
            except StrideFault as fault:
                faults.append(fault)
                if fault.cause != FORCES:
                    break
    # A walk that only lacks forces came farthest.
    reason = next((found for found in faults if found.cause == FORCES), faults[0])
    raise _infeasible(robot, obstacle, candidates, reason)


def _attempt(
    robot: Quadruped,
    obstacle: Obstacle,
    settings: StrideSettings,
    around: Surroundings,
    progress: Progress | None,
) -> Plan:
    """A plan with one body height that is clear of the obstacle at every instant.

    Raises:
        StrideFault: none was found.
    """
    demand: Demand | None = None
    for _ in range(ROUNDS):
        route = find_route(robot, obstacle, settings, around, demand)
        try:
            pieces = pieces_of(route, progress)
        except (InputError, SolverError) as error:
            # The walk may be possible at another height of the body, or over a smaller obstacle.
            raise StrideFault(str(error), cause="swing") from error
        path = joined([piece.path for piece in pieces if piece.path is not None])
        closest = around.along(path, settings.clearance)
        foot = foot_margin(route, pieces)
        if closest.proven < settings.clearance:
            demand = _with_more_distance(route, around, pieces, closest)
        elif foot < settings.margin - FOOT_TOLERANCE:
            more = settings.margin - foot + FOOT_TOLERANCE
            gaps = Gaps(*(gap + more for gap in route.demand.gaps))
            demand = route.demand._replace(foot=route.demand.foot + more, gaps=gaps)
        else:
            plan = plan_of(route, pieces, _record(route, around, closest, foot))
            return plan if settings.forces is None else _with_forces(plan)
    raise StrideFault(
        f"{f'leg {closest.seen.leg}' if closest.seen.leg else 'the body'} comes within "
        f"{closest.proven:.4g} m of the obstacle after {ROUNDS} rounds",
        closest.seen.leg, cause="obstacle",
    )  # fmt: skip


def _with_forces(plan: Plan) -> Plan:
    """The plan as fast as contact forces allow.

    Raises:
        StrideFault: somewhere there are none.
    """
    try:
        return retimed(plan)
    except (InfeasibleStepError, SolverError) as error:
        raise StrideFault(str(error), cause=FORCES) from error


def _with_more_distance(
    route: StrideRoute, around: Surroundings, pieces: list[Piece], closest: Approach
) -> Demand:
    """Larger distances for the legs that come too near to the obstacle.

    Args:
        route, around: the walk, and the robot's shapes with the obstacle.
        pieces: its timed moves and swings.
        closest: how near they come.
    """
    samples = [
        piece.path.evaluate(np.linspace(0.0, piece.path.duration, SAMPLES))
        for piece in pieces if piece.path is not None
    ]  # fmt: skip
    demand = widened(route, around, np.concatenate(samples))
    if demand != route.demand:
        return demand
    # No leg is too near at the samples, so it is between them: a larger distance for all legs.
    more = route.settings.clearance - closest.proven + RESERVE
    return demand._replace(gaps=Gaps(*(gap + more for gap in demand.gaps)), lift=demand.lift + more)


def _record(
    route: StrideRoute, around: Surroundings, closest: Approach, foot: float
) -> StrideRecord:
    """What the plan's record holds; ``foot`` is the proven margin of the feet [m]."""
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


# --- errors -----------------------------------------------------------------------------------


def _infeasible(
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
                _attempt(robot, obstacle, asked, around, None)
            else:
                find_route(robot, obstacle, asked, around)
        except (StrideFault, InputError):
            continue
        return True
    return False


# --- arguments --------------------------------------------------------------------------------


def _check_kinds(robot: object, obstacle: object) -> None:
    """Check that ``plan_stride`` got a robot with velocity limits and an obstacle.

    Raises:
        InputError: one of them is something else.
    """
    if not isinstance(robot, Quadruped) or not isinstance(obstacle, Obstacle):
        raise InputError(
            "plan_stride takes a Quadruped (from load_robot) and an Obstacle (rectangular_obstacle("
            f"0.11, 0.04), for instance), got {type(robot).__name__} and {type(obstacle).__name__}"
        )
    robot.require_velocity_limits()


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
