"""The sway of a gait: the support polygons over time, and the body's path for them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.gait.step_timing import SwingEvent
from gaitopt.motion.path import MotionPath
from gaitopt.optimize.sway import build_sway_problem, solve_sway
from gaitopt.planners.by_velocity.body_route import BodyRoute
from gaitopt.planners.by_velocity.contacts import contacts_at, stances_at, support_changes
from gaitopt.planners.by_velocity.motion import refined
from gaitopt.stability.support import support_half_planes
from gaitopt.terrain.footholds import Footholds

PIECES = 12
"""Pieces of the body's spline in a cycle, at least: its accelerations must follow the swings."""


def sway_path(
    route: BodyRoute,
    footholds: Footholds,
    events: Sequence[SwingEvent],
    duration: float,
    height: float,
    cycle_time: float,
    largest_offset: float,
    target: float,
) -> MotionPath:
    """A path of the body's centre, with columns x and y, whose ZMP keeps a margin of stability.

    Args:
        route: the nominal route.
        footholds, events: where feet stand, and their swings.
        duration: of the whole motion [s].
        height: of the centre above the ground [m].
        cycle_time: [s].
        largest_offset: how far from the route the body may go along x and y [m].
        target: margin above which a larger one has no value [m].

    Raises:
        SolverError: the body cannot stay near enough to its route.
    """
    times = refined(support_changes(events, duration), cycle_time / PIECES)
    middles = (times[1:] + times[:-1]) / 2.0
    places = stances_at(footholds, events, middles)[..., :2]
    standing = contacts_at(events, middles)
    sides = [support_sides(feet[stands]) for feet, stands in zip(places, standing, strict=True)]
    problem = build_sway_problem(
        times, sides, route.motion(times)[0], height, cycle_time, largest_offset, target
    )
    return MotionPath(times, solve_sway(problem).coefficients)


def support_sides(feet: FloatArray) -> FloatArray:
    """Sides ``(m, 3)`` of the convex hull of standing ``feet``: inward normal and offset.

    The hull of two feet is a segment, given by two sides along it and two at its ends. That of one
    foot is a point, given by four sides through it. Without feet there are no sides.
    """
    if len(feet) >= 3:
        try:
            planes = support_half_planes(feet)
        except InputError:
            # The feet are on one line: the two that are farthest apart.
            apart = np.linalg.norm(feet[:, None] - feet[None], axis=2)
            feet = feet[list(np.unravel_index(int(apart.argmax()), apart.shape))]
        else:
            return np.column_stack([planes.normals, planes.offsets])
    if not len(feet):
        return np.zeros((0, 3))
    along = feet[-1] - feet[0]
    length = float(np.hypot(*along))
    unit = along / length if length > 0 else np.array([1.0, 0.0])
    across = np.array([-unit[1], unit[0]])
    rows = [(unit, feet[0]), (-unit, feet[-1]), (across, feet[0]), (-across, feet[0])]
    return np.array([[*n, float(n @ p)] for n, p in rows])
