"""The path of a gait's body for which contact forces exist.

The ZMP of the whole robot, with all links' momentum, must lie where the standing feet can push: on
the line between two feet, or inside the polygon of three or four. In flight there is no reaction:
the robot falls freely, and keeps its angular momentum. The body's path is a spline, and these
conditions hold at as many instants of every phase as its accelerations have coefficients.
They are solved by Newton's method: each step is a quadratic program that keeps the body near its
route.

Source: [Kajita2003] corrects a path of a point mass in this way by the dynamics of all links.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.optimize.balanced_path import BalancedPathProblem, BodySpline, solve_balanced_path
from gaitopt.planners.by_velocity.balance_rows import BalanceRows, Phases
from gaitopt.planners.by_velocity.freedom import Freedom
from gaitopt.planners.by_velocity.motion import GaitMotion
from gaitopt.planners.by_velocity.reaction import linearised, reaction

MOST_STEPS = 12
"""Most steps of Newton's method. Measured: walks, trots and quasi-static gaits of six robots take
one or two, trots with flight, pronks and bounds three to six, and paces of free bodies up to
ten."""
ON_LINE = 1e-6
"""How far the ZMP may be beside the line between two feet at the instants of the conditions [m],
and what may be left of the reaction in flight [share of the weight]: with the usual tolerance the
balance may be missed by a hundred times that."""
INSIDE = 1e-5
"""By how much other conditions may be missed there [m], [share of the weight]."""
JUMP_WEIGHT = 1.0
"""Weight of the mean squared jump of a level body's accelerations, against their mean square. Those
of a free body jump as they like: where it takes off and lands they have to, and a price makes
forces oscillate there."""
INSET = 1e-9
"""Share of a phase by which the first and the last instant lie inside it."""
GAUSS = np.polynomial.legendre.leggauss(4)
"""Places and weights of the integrals of displacements and accelerations on each piece."""


def balanced_motion(
    motion: GaitMotion,
    limits: ForceLimits,
    period: float,
    largest_offset: float,
    target: float,
    pieces: int,
    freedom: Freedom,
) -> tuple[GaitMotion | None, float]:
    """The motion with a path of the body for which the ground's reaction is where feet can make it.

    Args:
        motion: along its route.
        limits: on forces, with the reserves that planning needs.
        period: of the gait, which weighs accelerations against displacements [s].
        largest_offset: how far from the route the body may go along x and y, or along its way [m].
        target: margin above which a larger one has no value [m].
        pieces: of the body's spline in the time of a swing, at least.
        freedom: how the body may move.

    Returns:
        The motion, ``None`` where no such path was found; and when the last attempt missed its
        conditions most [s].

    Raises:
        InputError: a foot is out of reach.
    """
    phases = Phases.of(motion, limits, free=freedom is Freedom.FREE)
    swing = max(e.touch_down - e.lift_off for e in motion.events)
    spline = BodySpline.over(phases.edges, phases.jumping, swing / pieces)
    times, owner = _instants(phases.edges, spline.breaks)
    rows = BalanceRows.of(phases, owner)
    problem = BalancedPathProblem(
        spline, times, _route(motion, spline.breaks, freedom),
        freedom.route(motion, phases.edges[[0, -1]])[0], period,
        freedom.largest_offsets(motion, largest_offset), freedom.sizes(motion),
        0.0 if freedom is Freedom.FREE else JUMP_WEIGHT, target,
        np.diff(phases.edges)[phases.wide],
    )  # fmt: skip
    points = freedom.route(motion, spline.abscissae)[0]
    centre = problem.derivatives(points)
    worst, when = np.inf, 0.0
    for _ in range(MOST_STEPS):
        conditions = rows.conditions(linearised(motion, times, centre), centre)
        points = solve_balanced_path(problem, conditions, points)
        centre = problem.derivatives(points)
        off, short = rows.missed(reaction(motion, times, centre))
        when = float(times[rows.samples[int((off + short).argmax())]])
        if off.max() <= ON_LINE and short.max() <= INSIDE:
            found = points * motion.ahead if freedom is Freedom.AHEAD else points
            return replace(motion, sway=spline.path(found)), when
        missed = float(off.max() + short.max())
        if not missed < worst:
            break
        worst = missed
    return None, when


def _instants(edges: FloatArray, breaks: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Instants of the conditions ``(N,)`` [s], and the phase of each.

    They are the abscissae of Greville of the accelerations, which are cubic splines.
    """
    found = []
    for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        inner = breaks[(breaks >= a) & (breaks <= b)]
        knots = np.concatenate([[a] * 2, inner, [b] * 2])
        mean = (knots[:-2] + knots[1:-1] + knots[2:]) / 3.0
        found.append(np.clip(mean, a + INSET * (b - a), b - INSET * (b - a)))
    return np.concatenate(found), np.repeat(np.arange(len(found)), [len(x) for x in found])


def _route(
    motion: GaitMotion, breaks: FloatArray, freedom: Freedom
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Instants of the route, their weights, places and accelerations."""
    half = np.diff(breaks)[:, None] / 2.0
    times = (breaks[:-1, None] + half * (1.0 + GAUSS[0])).ravel()
    place, _, acceleration = freedom.route(motion, times)
    return times, (half * GAUSS[1]).ravel(), place, acceleration
