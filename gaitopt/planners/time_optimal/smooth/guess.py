"""The first guess of a smooth walk: mostly the one without acceleration limits, roughly solved."""

from __future__ import annotations

from dataclasses import replace

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.solver import minimise
from gaitopt.plan.settings.base import VELOCITY
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.walk import Route

ROUGH, FORCE_ROUGH = 0.1, 0.3
"""Tolerances with which the walk without acceleration limits is solved; the second where forces
set the timing. Of eight walks of wang2020 (16 steps, ``swing`` and ``height``) seven came out equal
with 0.3 and one 0.1 % slower, with a tenth fewer Newton steps; with 1 they came out 0.2 % slower.
"""
LONGER = 2.0
"""Factor by which spans of the first guess are longer than times without acceleration limits."""
LONGER_BY = 0.1
"""What is added to them, in units of the problem's time: some of these times are zero."""
STRAIGHT_LONGER, STRAIGHT_LONGER_BY = 1.2, 0.05
"""The same along the straight lines of a walk phase by phase. With 2 and 0.1 the first round of
``dynamic`` took five times as many Newton steps."""


def rough_guess(
    route: Route, time_unit: float, start: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Poses ``(K, 9)`` and spans ``(K - 1,)`` [s] near those of a smooth walk.

    Where the walk without acceleration limits cannot be solved, the poses are its own first guess.
    So they are where forces set the timing and the body tilts: six walks of wang2020 came out
    equal, with a third fewer Newton steps. With a level body they came out up to 1 % slower.

    Args:
        route: the walk, or a window of it.
        time_unit: of the smooth problem [s].
        start: pose at the first knot ``(9,)``; by default where the robot stands.
    """
    free = route.settings.free
    straight = start is None and free.posture and route.settings.forces is not None
    settings = replace(
        route.settings,
        free=replace(free, dynamic=False),
        acceleration_limit=None,
        timing=VELOCITY,
        forces=None,
    )
    _, problem = build_route(replace(route, settings=settings))
    if start is not None:
        problem = problem.with_start(start)
    if straight:
        least = problem.least_times(problem.poses)
        return problem.poses, STRAIGHT_LONGER * least + STRAIGHT_LONGER_BY * time_unit
    tolerance = ROUGH if route.settings.forces is None else FORCE_ROUGH
    solution = minimise(problem, problem.first_guess(), tolerance=tolerance,
                        barrier=problem.first_barrier)  # fmt: skip
    poses = problem.unpack(solution.x)[0] if solution.solved else problem.poses
    return poses, LONGER * problem.least_times(poses) + LONGER_BY * time_unit
