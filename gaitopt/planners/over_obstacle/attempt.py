"""One attempt at a walk over an obstacle, with one body height and margin."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import Progress
from gaitopt.errors import InfeasibleStepError, InputError, SolverError, StrideFault
from gaitopt.motion.pieces import joined
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import StrideRecord
from gaitopt.plan.settings.base import FORCES
from gaitopt.plan.settings.over_obstacle import StrideSettings
from gaitopt.planners.over_obstacle.approach import Stand
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


def attempt(
    robot: Quadruped,
    obstacle: Obstacle,
    settings: StrideSettings,
    around: Surroundings,
    progress: Progress | None,
    stand: Stand | None = None,
) -> Plan:
    """A plan with one body height that is clear of the obstacle at every instant.

    Args:
        robot, obstacle, settings, progress: as for :func:`gaitopt.plan_stride`.
        around: the robot's shapes and the obstacle.
        stand: where the robot stands before; by default where the walk itself begins.

    Raises:
        StrideFault: none was found.
    """
    demand: Demand | None = None
    for _ in range(ROUNDS):
        route = find_route(robot, obstacle, settings, around, demand, stand)
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
